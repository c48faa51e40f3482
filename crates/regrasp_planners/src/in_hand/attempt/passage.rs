//! Passages: ends of a leg that the object by itself can leave only straight out, such as a hole. Uniform draws seldom find
//! the way out (Saut 2011, sec. 5.1, example 4), so some poses are drawn along it.

use regrasp_base::Rng;
use regrasp_geometry::{Pose, Vector};
use regrasp_manipulation::ends::blocked::object_blocked_by;
use regrasp_manipulation::model::Model;

/// An end lies in a passage when at least this many of the six ways along the object's axes are blocked.
const LEAST_BLOCKED: usize = 4;

/// A way out of a passage.
#[derive(Debug, Clone, Copy)]
struct WayOut {
    end: Pose,
    direction_in_world: Vector,
    length: f64,
}

/// The ways out of the ends of a leg that lie in passages.
#[derive(Debug, Clone, Default)]
pub struct Passages {
    ways_out: Vec<WayOut>,
}

impl Passages {
    /// Looks along the axes of the object at both ends, as far as poses wander; none in scenes without obstacles.
    pub fn of(model: &Model, wander_distance: f64, ends: [&Pose; 2]) -> Self {
        let mut ways_out = Vec::new();
        if model.view.obstacles.is_empty() {
            return Passages { ways_out };
        }
        let length = model.turn_length();
        for end in ends {
            let directions = (0..6).map(|k| {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                let mut axis = Vector::zeros();
                axis[k / 2] = sign;
                end.rotation * axis
            });
            let free: Vec<Vector> =
                directions.filter(|direction| is_free(model, wander_distance, end, direction)).collect();
            if free.len() + LEAST_BLOCKED <= 6 {
                ways_out.extend(free.into_iter().map(|direction_in_world| WayOut {
                    end: *end,
                    direction_in_world,
                    length,
                }));
            }
        }
        Passages { ways_out }
    }

    /// With chance `share` a pose on a way out; None, and no random number used, where there is no passage.
    pub fn draw(&self, share: f64, rng: &mut Rng) -> Option<Pose> {
        if self.ways_out.is_empty() || !rng.chance(share) {
            return None;
        }
        let way = &self.ways_out[rng.below(self.ways_out.len())];
        let shift = way.direction_in_world * (way.length * rng.unit());
        Some(Pose::from_parts((way.end.translation.vector + shift).into(), way.end.rotation))
    }
}

/// True when the object by itself can move along `direction` as far as poses wander.
fn is_free(model: &Model, wander_distance: f64, end: &Pose, direction: &Vector) -> bool {
    let n_steps = (wander_distance / model.settings.step).ceil() as usize;
    (1..=n_steps).all(|k| {
        let shift = direction * (wander_distance * k as f64 / n_steps as f64);
        let pose = Pose::from_parts((end.translation.vector + shift).into(), end.rotation);
        object_blocked_by(model, &pose).is_none()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SearchSettings;
    use regrasp_manipulation::settings::PhysicsSettings;
    use regrasp_robot::import::LoadOptions;
    use regrasp_scene::load_scene;
    use std::path::Path;

    fn passages_of(name: &str) -> (Vec<WayOut>, Vec<Pose>) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
        let loaded = load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let poses = loaded.task().query(0).as_in_hand().unwrap().poses();
        let view = loaded.view();
        let model = Model::new(&view, &PhysicsSettings::default());
        let ways_out = poses
            .windows(2)
            .flat_map(|leg| {
                Passages::of(&model, SearchSettings::default().wander_distance, [&leg[0], &leg[1]]).ways_out
            })
            .collect();
        (ways_out, poses)
    }

    #[test]
    fn the_only_way_out_of_the_socket_is_down_and_nothing_else_is_a_passage() {
        let (ways_out, poses) = passages_of("bulb.toml");
        // The tilted start below the socket is none; the way pose ends one leg and begins the next.
        let ends = [&poses[1], &poses[1], &poses[2]];
        assert_eq!(ways_out.iter().map(|way| &way.end).collect::<Vec<_>>(), ends);
        for way in &ways_out {
            assert!((way.direction_in_world + Vector::z()).norm() < 1e-12, "{way:?}");
        }
        for name in ["ellipsoid_obstacle.toml", "ellipsoid_free.toml", "box_90x.toml"] {
            assert!(passages_of(name).0.is_empty(), "{name}");
        }
    }

    #[test]
    fn poses_are_drawn_on_the_way_out_and_random_numbers_are_only_used_for_them() {
        let (ways_out, _) = passages_of("bulb.toml");
        let passages = Passages { ways_out: ways_out[..1].to_vec() };
        let mut rng = Rng::keyed(1, "passage", 0);
        let drawn: Vec<Pose> = (0..1000).filter_map(|_| passages.draw(0.5, &mut rng)).collect();
        assert!((400..600).contains(&drawn.len()), "{}", drawn.len());
        for pose in &drawn {
            let shift = pose.translation.vector - ways_out[0].end.translation.vector;
            assert!(shift.xy().norm() < 1e-12 && (-ways_out[0].length..=0.0).contains(&shift.z));
            assert_eq!(pose.rotation, ways_out[0].end.rotation);
        }
        let (mut used, mut unused) = (Rng::keyed(1, "passage", 1), Rng::keyed(1, "passage", 1));
        assert_eq!(Passages::default().draw(1.0, &mut used), None);
        assert_eq!(used.bits(), unused.bits());
    }
}
