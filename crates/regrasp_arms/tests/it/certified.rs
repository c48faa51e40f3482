//! Motions against dense sampling with distances of another kind.

use crate::robots::{Loaded, draw, shared, two_arms, world};
use regrasp_arms::motion::{ColliderSettings, Track};
use regrasp_arms::world::World;
use regrasp_arms::{ArmModel, Collider};
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::reference::{Clearance, ReferenceShape, distance};
use regrasp_robot::LinkId;
use regrasp_robot::hand::convex_of;

/// Distance of two shapes; zero where they overlap, and at least 1 m for all that are farther.
fn gap(a: &ReferenceShape, at_a: &Pose, b: &ReferenceShape, at_b: &Pose) -> f64 {
    match distance(a, at_a, b, at_b, 1.0) {
        Clearance::SeparatedBy(distance) => distance,
        _ => 0.0,
    }
}

/// The least distance of any pair that has to be apart, from the files alone: the robot's own kinematics and parry's distances.
struct Reference<'a> {
    loaded: &'a Loaded,
    /// By link, its shapes.
    links: Vec<Vec<(Pose, ReferenceShape)>>,
    obstacles: Vec<(Pose, ReferenceShape)>,
    moves: Vec<bool>,
}

impl<'a> Reference<'a> {
    fn new(loaded: &'a Loaded, world: &World) -> Self {
        let shape = |placed: &regrasp_geometry::shape::PlacedShape| {
            let convex = convex_of(&placed.shape).unwrap();
            (placed.parent_from_shape, ReferenceShape::new(&convex).unwrap())
        };
        let links = &loaded.robot.robot.links;
        Reference {
            loaded,
            links: links.iter().map(|link| link.collision.iter().map(shape).collect()).collect(),
            obstacles: world.obstacles.iter().map(|obstacle| shape(&obstacle.placed)).collect(),
            moves: (0..links.len()).map(|k| !loaded.robot.coordinates_above(LinkId(k)).is_empty()).collect(),
        }
    }

    fn least_distance(&self, state: &[f64]) -> f64 {
        let mut poses = Vec::new();
        self.loaded.robot.link_poses(state, &mut poses);
        let mut least = f64::INFINITY;
        for (a, shapes) in self.links.iter().enumerate() {
            for (pose, shape) in shapes {
                let at = poses[a] * pose;
                if self.moves[a] {
                    for (other_at, other) in &self.obstacles {
                        least = least.min(gap(shape, &at, other, other_at));
                    }
                }
                for b in 0..a {
                    let robot = &self.loaded.robot;
                    let is_rigid = robot.coordinates_above(LinkId(a)) == robot.coordinates_above(LinkId(b));
                    if is_rigid || robot.may_touch(LinkId(a), LinkId(b)) {
                        continue;
                    }
                    for (other_pose, other) in &self.links[b] {
                        least = least.min(gap(shape, &at, other, &(poses[b] * other_pose)));
                    }
                }
            }
        }
        least
    }
}

/// Of random motions: what is certified is free in every sample, and what is clearly free is certified.
fn agrees(loaded: &Loaded, n_motions: usize, n_obstacles: usize, seed: u64) {
    let mut rng = Rng::keyed(seed, "certified", 0);
    let (mut n_free, mut n_blocked, mut n_refused) = (0, 0, 0);
    let all: Vec<usize> = (0..loaded.robot.layout.len()).collect();
    for _ in 0..n_motions {
        let world = world(&mut rng, n_obstacles, 1.0);
        let (from, to) = (draw(loaded, &mut rng), draw(loaded, &mut rng));
        let share = rng.uniform(0.02, 0.5);
        let to: Vec<f64> = from.iter().zip(&to).map(|(a, b)| a + share * (b - a)).collect();
        let bent: Vec<f64> = from.iter().map(|_| rng.uniform(-0.3, 0.3)).collect();
        let track = match rng.chance(0.5) {
            true => Track::straight(&from, &to),
            false => Track::cubic(&from, &to, [&bent, &from.iter().map(|_| 0.1).collect::<Vec<_>>()], 0.7),
        };
        let model = ArmModel::new(&loaded.robot, &loaded.covers, &[], &from, &all);
        let mut collider = Collider::new(&model, &world, ColliderSettings::default());
        let is_certified = collider.is_certified_free(&track);
        let reference = Reference::new(loaded, &world);
        let n_looks = 60;
        let least = (0..=n_looks)
            .map(|i| reference.least_distance(&track.at(f64::from(i) / f64::from(n_looks))))
            .fold(f64::INFINITY, f64::min);
        match (is_certified, least) {
            (true, least) => {
                assert!(least > 0.0, "certified, and in contact");
                n_free += 1;
            }
            (false, least) if least <= 0.0 => n_blocked += 1,
            (false, least) => {
                assert!(least < 0.02, "refused, with {least} m left in every sample");
                n_refused += 1;
            }
        }
    }
    assert!(n_free > n_motions / 20 && n_blocked > n_motions / 20, "{n_free} {n_blocked} {n_refused}");
    assert!(n_refused < n_motions / 5, "{n_refused} of {n_motions}");
}

#[test]
fn certified_motions_of_capsules_are_free_in_every_sample() {
    agrees(&two_arms(), 60, 4, 1);
}

#[test]
fn certified_motions_of_balls_are_free_in_every_sample() {
    if let Some(loaded) = shared("panda", "panda_spherized.urdf", "panda.srdf") {
        agrees(&loaded, 60, 6, 2);
    }
}

#[test]
fn sampled_motions_agree_with_single_configurations() {
    let Some(loaded) = shared("panda", "panda_spherized.urdf", "panda.srdf") else { return };
    let mut rng = Rng::keyed(3, "sampled", 0);
    let all: Vec<usize> = (0..loaded.robot.layout.len()).collect();
    let (mut n_free, mut n_blocked) = (0, 0);
    for case in 0..150 {
        // Few obstacles, and so many that they are kept in a tree.
        let world = world(&mut rng, if case % 3 == 0 { 120 } else { 8 }, 1.2);
        let (from, to) = (draw(&loaded, &mut rng), draw(&loaded, &mut rng));
        let share = rng.uniform(0.05, 0.4);
        let to: Vec<f64> = from.iter().zip(&to).map(|(a, b)| a + share * (b - a)).collect();
        let model = ArmModel::new(&loaded.robot, &loaded.covers, &[], &from, &all);
        let with = |clearance: f64| {
            let settings = ColliderSettings { resolution: 32.0, clearance, ..ColliderSettings::default() };
            Collider::new(&model, &world, settings).is_sampled_free(&from, &to)
        };
        let distance = regrasp_arms::search::distance(&from, &to);
        let n = 8 * (distance * 32.0 / 8.0).ceil().max(1.0) as usize;
        let mut exact = Collider::new(&model, &world, ColliderSettings::default());
        let is_free = (1..=n).all(|i| {
            let t = i as f64 / n as f64;
            let at: Vec<f64> = from.iter().zip(&to).map(|(a, b)| a + t * (b - a)).collect();
            exact.contact(&at).is_none()
        });
        // Single precision decides within a hundredth of a millimetre.
        if with(1e-5) {
            assert!(is_free);
            n_free += 1;
        } else if !with(-1e-5) {
            assert!(!is_free);
            n_blocked += 1;
        }
    }
    assert!(n_free > 20 && n_blocked > 20, "{n_free} {n_blocked}");
}
