//! Robots that tests load, and worlds about them.

use crate::places::{repository, shared_models};
use regrasp_arms::model::cover::{LinkCover, covers};
use regrasp_arms::world::{Obstacle, World};
use regrasp_base::Rng;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{ConvexHull, Pose, Shape, Vector};
use regrasp_robot::import::srdf::load_srdf;
use regrasp_robot::manipulator::Parts;
use regrasp_robot::{LoadOptions, Manipulator, load_manipulator, load_robot};
use std::sync::Arc;

/// A robot with its covers.
pub struct Loaded {
    pub robot: Manipulator,
    pub covers: Vec<LinkCover>,
}

/// A robot of the shared models by its files, all pairs of its SRDF allowed. None where models are absent.
pub fn shared(folder: &str, urdf: &str, srdf: &str) -> Option<Loaded> {
    let folder = shared_models()?.join("robots").join(folder);
    let options = LoadOptions { lenient: true, ..LoadOptions::default() };
    let robot = load_robot(&folder.join(urdf), &options).unwrap().robot;
    let allow = load_srdf(&folder.join(srdf), &robot, &options).unwrap().srdf.disabled_pairs;
    let allow = allow.iter().map(|pair| pair.links).collect();
    let covers = covers(&robot);
    let robot = Manipulator::new(urdf.into(), Arc::new(robot), Parts { allow, ..Parts::default() }).unwrap();
    Some(Loaded { robot, covers })
}

/// The robot of the repository with two arms and two hands: capsules and boxes.
pub fn two_arms() -> Loaded {
    let path = repository().join("assets/robots/two_arms/robot.toml");
    let robot = load_manipulator(&path, &LoadOptions::default()).unwrap().manipulator;
    Loaded { covers: covers(&robot.robot), robot }
}

/// Random obstacles of every kind about a place.
pub fn world(rng: &mut Rng, n: usize, spread: f64) -> World {
    let obstacle = |index: usize| {
        let [a, b, c] = [0; 3].map(|_| rng.uniform(0.02, 0.12));
        let shape = match index % 5 {
            0 => Shape::Cuboid { half_extents: Vector::new(a, b, c) },
            1 => Shape::Cylinder { half_length: a, radius: b },
            2 => Shape::Sphere { radius: a },
            3 => Shape::Capsule { half_length: a, radius: b },
            _ => {
                let points: Vec<_> = (0..20).map(|_| (Vector::from(rng.direction()) * a).into()).collect();
                Shape::Convex(Arc::new(ConvexHull::new(&points).unwrap()))
            }
        };
        let position =
            Vector::new(rng.uniform(-spread, spread), rng.uniform(-spread, spread), rng.uniform(-0.3 * spread, spread));
        let turn = Vector::from(rng.direction()) * rng.uniform(0.0, 3.0);
        Obstacle {
            name: format!("obstacle {index}"),
            placed: PlacedShape { parent_from_shape: Pose::new(position, turn), shape },
        }
    };
    World::new((0..n).map(obstacle).collect())
}

/// A configuration within limits.
pub fn draw(loaded: &Loaded, rng: &mut Rng) -> Vec<f64> {
    let coordinates = &loaded.robot.layout.coordinates;
    loop {
        let state: Vec<f64> = coordinates.iter().map(|c| rng.uniform(c.lower.max(-3.0), c.upper.min(3.0))).collect();
        if loaded.robot.layout.within_limits(&state, 0.0) {
            return state;
        }
    }
}
