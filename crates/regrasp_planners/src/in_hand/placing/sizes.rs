//! Which sizes of objects fit a hand: balls, because they look the same from everywhere.

use super::evidence::Evidence;
use super::outlook::Outlook;
use super::proposals::Proposals;
use super::samples::ContactSamples;
use crate::in_hand::attempt::search::{Context, Search};
use crate::in_hand::refusals;
use crate::settings::InHandSettings;
use regrasp_base::{Budget, Rng};
use regrasp_geometry::surface::DEFAULT_CREASE_ANGLE;
use regrasp_geometry::{Point, Pose, Shape, Surface};
use regrasp_manipulation::ends::blocked::object_blocked_by;
use regrasp_manipulation::failure::Failure;
use regrasp_manipulation::model::{Model, fingers_in_words};
use regrasp_robot::Hand;
use regrasp_robot::inspect::TipReach;
use regrasp_scene::{Limits, Manipulation, Object, Scene, SceneHand, State};
use std::sync::atomic::AtomicUsize;

/// Radii that are tried, in metres.
const RADII: [f64; 14] = [0.006, 0.01, 0.015, 0.02, 0.025, 0.03, 0.035, 0.04, 0.045, 0.05, 0.06, 0.07, 0.085, 0.1];
/// Friction and density of the balls.
const FRICTION: f64 = 0.8;
const DENSITY: f64 = 500.0;
/// Poses estimated for each, and how many of the best are looked at with all links.
const POSES: usize = 1_500;
const LOOKED_AT: usize = 5;

/// A ball, and whether the hand can hold it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Size {
    /// Its radius, in metres.
    pub radius: f64,
    /// Where its centre is held best, in the hand's frame; none where no grasp was found.
    pub center: Option<[f64; 3]>,
    /// True where every finger may lift from some grasp there, one at a time.
    pub lets_go: bool,
    /// Share of grasps that hold without a finger, over the fingers: [`Evidence::worth`] there.
    pub evidence: f64,
}

/// Which balls `hand`, whose tips reach `reach`, can hold. Errors: the hand cannot hold anything.
pub fn sizes(hand: &Hand, reach: &TipReach, settings: &InHandSettings, seed: u64) -> Result<Vec<Size>, Failure> {
    let mut found = Vec::with_capacity(RADII.len());
    let mut samples: Option<(f64, ContactSamples)> = None;
    for (index, &radius) in RADII.iter().enumerate() {
        let Some(object) = ball(radius) else { continue };
        let scene = scene_of(hand, object);
        let state = State::at_rest(&scene, vec![Pose::identity()]);
        let view = regrasp_scene::HandView::of(&Manipulation::first(&scene, &state));
        Failure::refuse_many_fingers(&view)?;
        Failure::refuse_tied_fingers(&view)?;
        let model = Model::new(&view, &settings.physics);
        let reach = &super::reach_of(&model, reach);
        refusals::refuse_holding_nothing(&model)?;
        let mut rng = Rng::keyed(seed, "sizes", index as u64);
        // Which contacts of a ball close does not depend on its size.
        let (known, unit) = samples.get_or_insert_with(|| (radius, ContactSamples::draw(&model, &mut rng)));
        let outlook = Outlook::with(&model, reach, unit.scaled(radius / *known));
        let proposals = Proposals::new(&model, reach, None);
        if proposals.is_empty() {
            found.push(Size { radius, center: None, lets_go: false, evidence: 0.0 });
            continue;
        }
        let mut poses: Vec<(f64, Pose)> = (0..POSES)
            .map(|_| {
                let pose = proposals.draw(&mut rng);
                (outlook.worth(&pose), pose)
            })
            .collect();
        poses.retain(|(worth, _)| *worth > outlook.nothing());
        poses.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (winner, budget) = (AtomicUsize::new(usize::MAX), Budget::unlimited());
        let context = Context { model: &model, settings, seed, budget: &budget, winner: &winner, progress: &|_| {} };
        let mut search = Search::new(context, [Pose::identity(); 2], 0, u64::MAX);
        search.rng = Rng::keyed(seed, "sizes_evidence", index as u64);
        if !model.may_release || !model.may_move_object() {
            search.ask_only_to_hold();
        }
        let mut best = Size { radius, center: None, lets_go: false, evidence: 0.0 };
        let clear = poses.iter().filter(|(_, pose)| object_blocked_by(&model, pose).is_none());
        for (_, pose) in clear.take(LOOKED_AT) {
            let evidence = Evidence::gather(&mut search, pose);
            let worth = evidence.worth(&model);
            if evidence.grasp.is_some() && worth > best.evidence {
                let lets_go =
                    model.may_release && evidence.released[..model.n_fingers()].iter().all(|share| *share > 0.0);
                let center = Some(pose.translation.vector.into());
                best = Size { center, lets_go: lets_go || best.lets_go, evidence: worth, ..best };
            }
        }
        found.push(best);
    }
    Ok(found)
}

/// Why `hand` can hold objects and never change its grasp of them, and what would help, in words. None for hands that can, that hold nothing, or
/// whose fingers cannot follow an object: that is said otherwise.
pub fn never_lets_go(hand: &Hand, settings: &InHandSettings) -> Option<String> {
    with_a_ball(hand, settings, |model| {
        refusals::refuse_holding_nothing(model).and_then(|()| refusals::refuse_hand_that_cannot_follow(model)).ok()?;
        let may_try_transfers = model.n_fingers() == 2 || settings.search.transfers_alone;
        let failure = refusals::refuse_impossible(model).err().filter(|_| !may_try_transfers)?;
        let (fingers, why) = (fingers_in_words(model), refusals::OTHERS_CANNOT_HOLD);
        Some(format!("it can never change its grasp: it has {fingers}, and {why}. To turn objects {}", failure.advice))
    })
}

/// Which fingers of `hand` cannot follow an object that moves, and whether the hand can turn objects all the same, in words. None where
/// all of them follow.
pub fn fingers_that_only_hold(hand: &Hand, settings: &InHandSettings) -> Option<String> {
    with_a_ball(hand, settings, |model| {
        if model.closing_fingers() == 0 {
            return None;
        }
        if let Err(failure) = refusals::refuse_hand_that_cannot_follow(model) {
            return Some(failure.message);
        }
        let closing = (0..model.n_fingers()).filter(|&f| model.fingers[f].closes());
        let names: Vec<&str> = closing.map(|f| hand.fingers[f].name.as_str()).collect();
        Some(format!(
            "fingers that hold an object only while it stands still, as their tips move in fewer than three directions: {}",
            names.join(", ")
        ))
    })
}

/// What `say` says of the hand with the smallest ball; None for hands that no search takes.
fn with_a_ball(hand: &Hand, settings: &InHandSettings, say: impl FnOnce(&Model) -> Option<String>) -> Option<String> {
    let scene = scene_of(hand, ball(RADII[0])?);
    let state = State::at_rest(&scene, vec![Pose::identity()]);
    let view = regrasp_scene::HandView::of(&Manipulation::first(&scene, &state));
    Failure::refuse_many_fingers(&view).ok()?;
    say(&Model::new(&view, &settings.physics))
}

fn ball(radius: f64) -> Option<Object> {
    let shape = Shape::Sphere { radius };
    Some(Object {
        name: "ball".into(),
        surface: Surface::of(&shape).ok()?,
        hull: None,
        radius,
        mesh_body: None,
        mass: DENSITY * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3),
        center_of_mass: Point::origin(),
        friction: FRICTION,
        edge_distance: 0.0,
        crease_angle: DEFAULT_CREASE_ANGLE,
        shape,
    })
}

fn scene_of(hand: &Hand, object: Object) -> Scene {
    let placed = SceneHand {
        name: "hand".into(),
        hand: hand.clone(),
        world_from_hand: Pose::identity(),
        carrier: None,
        reach: None,
    };
    Scene {
        grasp_files: Vec::new(),
        name: "sizes".into(),
        robots: Vec::new(),
        hands: vec![placed],
        objects: vec![object],
        supports: Vec::new(),
        obstacles: Vec::new(),
        gravity: None,
        limits: Limits::default(),
        inputs: Vec::new(),
    }
}
