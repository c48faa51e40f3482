//! Postures in which a link that is in the way is pushed out: object and fingers go aside, and the fingertips back onto the object.

use super::ProjectionLimits;
use super::fit::{Posture, TURN_DEVIATION, deviation, displaced, fit};
use crate::model::{Carrier, Model, Pair};
use regrasp_geometry::Vector;

/// How far things go aside, as shares of the limits: near ones first.
const SHARES: [f64; 3] = [0.25, 0.5, 0.9];

/// Postures near `posture`, in which `pair` is too near, with what moves the two bodies displaced to either side, one coordinate at a
/// time. The fingers of `holding` touch in them, about so. Nearest first.
pub fn pushed<'m>(
    model: &'m Model,
    posture: &'m Posture,
    pair: Pair,
    holding: u32,
    limits: &'m ProjectionLimits,
) -> impl Iterator<Item = Posture> + 'm {
    let moves = moves_of(model, pair);
    SHARES.into_iter().flat_map(move |share| {
        let moves = moves.clone();
        moves.into_iter().flat_map(move |coordinate| {
            [1.0, -1.0].map(|sign| {
                let aside = moved(model, posture, coordinate, sign * share, limits);
                fit(model, &aside, holding)
            })
        })
    })
}

/// A coordinate of the object or of a finger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Coordinate {
    /// The object's position along an axis.
    Shift(usize),
    /// Its orientation about one.
    Turn(usize),
    /// A joint of a finger.
    Joint(usize, usize),
}

/// What moves the bodies of `pair` towards or away from each other.
fn moves_of(model: &Model, pair: Pair) -> Vec<Coordinate> {
    let mut moves = Vec::new();
    for body in [pair.a, pair.b] {
        match model.bodies[body].carrier {
            Carrier::Finger { finger, .. } => {
                let n_own = model.fingers[finger].ik.chain().n_coordinates();
                moves.extend((0..n_own).map(|k| Coordinate::Joint(finger, k)));
            }
            Carrier::Object => {
                moves.extend((0..3).map(Coordinate::Shift));
                moves.extend((0..3).map(Coordinate::Turn));
            }
            Carrier::World => {}
        }
    }
    let mut once: Vec<Coordinate> = Vec::with_capacity(moves.len());
    for coordinate in moves {
        if !once.contains(&coordinate) {
            once.push(coordinate);
        }
    }
    once
}

/// `posture` with one coordinate moved by a share of what it may.
fn moved(model: &Model, posture: &Posture, coordinate: Coordinate, share: f64, limits: &ProjectionLimits) -> Posture {
    let mut aside = posture.clone();
    let along = |axis: usize, size: f64| Vector::from_fn(|k, _| if k == axis { size } else { 0.0 });
    let zero = Vector::zeros();
    match coordinate {
        Coordinate::Shift(axis) => {
            aside.object = displaced(&posture.object, &along(axis, share * limits.distance), &zero);
        }
        Coordinate::Turn(axis) => {
            // About the centre of mass: turns about the frame's origin would shift it.
            let center = model.view.object.center_of_mass;
            let turned = displaced(&posture.object, &zero, &along(axis, share * limits.turn));
            aside.object = displaced(&turned, &(posture.object * center - turned * center), &zero);
        }
        Coordinate::Joint(finger, k) => {
            let chain = model.fingers[finger].ik.chain();
            let size = share * limits.turn * deviation(chain, k) / TURN_DEVIATION;
            let value = &mut aside.joints[finger][k];
            *value = (*value + size).clamp(chain.lower[k], chain.upper[k].max(chain.lower[k]));
        }
    }
    aside
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::PhysicsSettings;
    use regrasp_robot::LoadOptions;
    use regrasp_scene::load_scene;

    fn with_model(name: &str, look: impl FnOnce(&Model)) {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
        let loaded = load_scene(&path, &LoadOptions::default()).unwrap();
        let view = loaded.view();
        look(&Model::new(&view, &PhysicsSettings::default()));
    }

    #[test]
    fn everything_that_moves_the_pair_goes_aside_by_no_more_than_it_may() {
        with_model("sphere_90x.toml", |model| {
            let object = model.bodies.iter().position(|body| matches!(body.carrier, Carrier::Object)).unwrap();
            let of_first = |body: &crate::model::Body| matches!(body.carrier, Carrier::Finger { finger: 0, .. });
            let link = model.bodies.iter().position(of_first).unwrap();
            let pair = Pair { a: link.min(object), b: link.max(object), tip_of: None };
            let middle = |finger: &crate::model::FingerModel| {
                let chain = finger.ik.chain();
                chain.lower.iter().zip(&chain.upper).map(|(low, high)| 0.5 * (low + high)).collect()
            };
            let posture = Posture {
                object: regrasp_geometry::pose_from([0.0, 0.0, 0.08], [0.0, 0.0, 0.0, 1.0]),
                joints: model.fingers.iter().map(middle).collect(),
            };
            let limits = ProjectionLimits::default();
            // No finger holds, so that nothing is brought back.
            let all: Vec<Posture> = pushed(model, &posture, pair, 0, &limits).collect();
            let n_joints = posture.joints[0].len();
            assert_eq!(all.len(), 2 * SHARES.len() * (6 + n_joints));
            let center = model.view.object.center_of_mass;
            for aside in &all {
                assert_eq!(aside.joints[1..], posture.joints[1..], "only the first finger is in the way");
                let shift = (aside.object * center - posture.object * center).norm();
                let turn = regrasp_geometry::frame::rotation_between(&aside.object, &posture.object).norm();
                let joint = aside.joints[0].iter().zip(&posture.joints[0]).map(|(a, b)| (a - b).abs());
                let joint = joint.fold(0.0, f64::max);
                let moved = [shift / limits.distance, turn / limits.turn, joint / limits.turn];
                assert!(moved.iter().all(|share| *share <= 0.9 + 1e-9), "{moved:?}");
                let n_moved = moved.iter().filter(|share| **share > 1e-9).count();
                assert_eq!(n_moved, 1, "one coordinate at a time: {moved:?}");
            }
        });
    }
}
