//! How natural postures are (Saut 2010, sec. V-C). The paper names three measures and states neither sign nor scale; here each is a
//! penalty, zero in the robot's rest posture or best at zero, and the settings weigh them (`PostureWeights`):
//!
//! - *joints*: Euclidean distance of the arm's joints from its home posture, in radians (metres of joints that slide);
//! - *height*: how much higher or lower the elbow is than in the home posture, in metres. The elbow is the origin of the body that the
//!   middle joint of the arm moves;
//! - *plane*: distance of the wrist from the plane through both shoulders and the foot of the torso, in metres, no matter on which side.

use regrasp_geometry::{Point, Pose, Vector};
use regrasp_manipulation::task_settings::PostureWeights;
use regrasp_robot::Manipulator;
use regrasp_robot::manipulator::layout::Part;

/// Shoulders that are nearer to the line through the foot of the torso span no plane, in metres.
const LEAST_SPAN: f64 = 0.05;

/// The rest posture that others are compared with.
pub struct Rest {
    weights: PostureWeights,
    up: Vector,
    /// By coordinate.
    joints: Vec<f64>,
    /// By arm: the height of its elbow, in the world.
    elbows: Vec<f64>,
    /// The first link that joints of the common part move, or the root.
    foot: usize,
}

impl Rest {
    /// Of a robot; `up` points against gravity.
    pub fn new(robot: &Manipulator, up: &Vector, weights: PostureWeights) -> Self {
        let joints = robot.layout.rest();
        let mut poses = Vec::new();
        robot.link_poses(&joints, &mut poses);
        let first_common = robot.layout.coordinates.iter().find(|coordinate| coordinate.part == Part::Common);
        let foot = first_common.map_or(0, |coordinate| robot.robot.joints[coordinate.joint.0].child.0);
        let mut rest = Rest { weights, up: *up, joints, elbows: Vec::new(), foot };
        for arm in 0..robot.arms.len() {
            let own = robot.layout.range(Part::Arm(arm)).start;
            let base = poses[robot.arms[arm].base.0];
            let height = rest.elbow_height(robot, arm, &base, &rest.joints[own..]);
            rest.elbows.push(height);
        }
        rest
    }

    /// True where nothing is weighed: postures are as natural as each other.
    pub fn is_silent(&self) -> bool {
        self.weights == PostureWeights::NONE
    }

    /// True where postures of one arm at one place differ.
    pub fn weighs_arms(&self) -> bool {
        self.weights.joints > 0.0 || self.weights.height > 0.0
    }

    fn elbow_height(&self, robot: &Manipulator, arm: usize, world_from_base: &Pose, joints: &[f64]) -> f64 {
        let chain = &robot.arms[arm].chain;
        let mut bodies = Vec::with_capacity(chain.joints.len());
        chain.forward(&joints[..chain.n_coordinates()], &mut bodies);
        let elbow = bodies.get(chain.joints.len() / 2).map_or_else(Pose::identity, |body| *body);
        self.up.dot(&(world_from_base * elbow).translation.vector)
    }

    /// Penalty of an arm's own joints, its base where it is in the world.
    pub fn of_arm(&self, robot: &Manipulator, arm: usize, world_from_base: &Pose, joints: &[f64]) -> f64 {
        let PostureWeights { joints: per_radian, height: per_metre, .. } = self.weights;
        let first = robot.layout.range(Part::Arm(arm)).start;
        let own = &joints[..robot.arms[arm].chain.n_coordinates()];
        let far: f64 = own.iter().zip(&self.joints[first..]).map(|(q, rest)| (q - rest).powi(2)).sum();
        let higher = match per_metre > 0.0 {
            true => (self.elbow_height(robot, arm, world_from_base, own) - self.elbows[arm]).abs(),
            false => 0.0,
        };
        per_radian * far.sqrt() + per_metre * higher
    }

    /// Penalty of the common joints of a state, for arms whose wrists are to be at points: how far these joints are from rest, and the
    /// wrists from the plane of torso and shoulders.
    pub fn of_common(&self, robot: &Manipulator, state: &[f64], wrists: &[Point]) -> f64 {
        let common = robot.layout.range(Part::Common);
        let pairs = state[common.clone()].iter().zip(&self.joints[common]);
        let far = pairs.map(|(q, rest)| (q - rest).powi(2)).sum::<f64>().sqrt();
        let plane = match self.weights.plane > 0.0 {
            true => wrists.iter().map(|wrist| self.plane_distance(robot, state, wrist)).sum(),
            false => 0.0,
        };
        self.weights.joints * far + self.weights.plane * plane
    }

    /// Distance of a point from the plane of torso and shoulders; 0 of robots with one arm, or whose shoulders span no plane.
    fn plane_distance(&self, robot: &Manipulator, state: &[f64], point: &Point) -> f64 {
        let [first, second, ..] = robot.arms.as_slice() else { return 0.0 };
        let mut poses = Vec::new();
        robot.link_poses(state, &mut poses);
        let at = |link: usize| poses[link].translation.vector;
        let (foot, right, left) = (at(self.foot), at(first.base.0), at(second.base.0));
        let normal = (right - foot).cross(&(left - foot));
        if normal.norm() < LEAST_SPAN * (right - left).norm() {
            return 0.0;
        }
        (point.coords - foot).dot(&normal.normalize()).abs()
    }
}

/// Puts items in the order of their penalties, which are not negative: their bits have the same order.
pub fn least_first<T>(items: &mut [T], penalty: impl Fn(&T) -> f64) {
    items.sort_by_cached_key(|item| penalty(item).to_bits());
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3x2;
    use regrasp_base::Rng;
    use regrasp_robot::LoadOptions;
    use std::path::Path;

    fn robot() -> Manipulator {
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/two_arms/justin_horse.toml");
        let loaded =
            regrasp_scene::load_scene(&scene, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        loaded.scene.robots[0].clone()
    }

    fn drawn(robot: &Manipulator, rng: &mut Rng) -> Vec<f64> {
        let coordinates = &robot.layout.coordinates;
        coordinates.iter().map(|c| rng.uniform(c.lower.max(-3.0), c.upper.min(3.0))).collect()
    }

    /// Each measure against another way to compute it; one at a time.
    #[test]
    fn measures_are_what_they_say() {
        let robot = robot();
        let up = Vector::z();
        let weigh = |joints, height, plane| Rest::new(&robot, &up, PostureWeights { joints, height, plane });
        let [joints, height, plane] = [weigh(2.0, 0.0, 0.0), weigh(0.0, 3.0, 0.0), weigh(0.0, 0.0, 4.0)];
        let rest = robot.layout.rest();
        let mut rng = Rng::keyed(0, "posture", 0);
        let (mut poses, mut home) = (Vec::new(), Vec::new());
        robot.link_poses(&rest, &mut home);
        for round in 0..40 {
            let state = if round == 0 { rest.clone() } else { drawn(&robot, &mut rng) };
            robot.link_poses(&state, &mut poses);
            for (index, arm) in robot.arms.iter().enumerate() {
                let own = robot.layout.range(Part::Arm(index));
                let far = own.clone().map(|k| (state[k] - rest[k]).powi(2)).sum::<f64>().sqrt();
                let base = &poses[arm.base.0];
                assert!((joints.of_arm(&robot, index, base, &state[own.clone()]) - 2.0 * far).abs() < 1e-12);
                // The elbow is the link that the middle joint moves.
                let middle = robot.robot.joint_named(&arm.chain.names[arm.chain.names.len() / 2]).unwrap();
                let elbow = robot.robot.joints[middle.0].child.0;
                let higher = (poses[elbow].translation.vector.z - home[elbow].translation.vector.z).abs();
                let penalty = height.of_arm(&robot, index, base, &state[own]);
                assert!((penalty - 3.0 * higher).abs() < 1e-9, "{penalty} {higher}");
            }
            // What is left of a point when its part in the plane is taken away, by least squares.
            let at = |link: usize| poses[link].translation.vector;
            let foot = at(robot.robot.joints[robot.robot.joint_named("torso_1").unwrap().0].child.0);
            let [right, left] = [0, 1].map(|arm| at(robot.arms[arm].base.0) - foot);
            let sides = Matrix3x2::from_columns(&[right, left]);
            let point = Vector::new(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(0.0, 2.0));
            let shares = (sides.transpose() * sides).try_inverse().unwrap() * sides.transpose() * (point - foot);
            let left_over = (point - foot - sides * shares).norm();
            let penalty = plane.of_common(&robot, &state, &[point.into(), point.into()]);
            assert!((penalty - 8.0 * left_over).abs() < 1e-6, "{penalty} {left_over}");
        }
        assert_eq!(joints.of_common(&robot, &rest, &[]), 0.0);
        assert!(weigh(0.0, 0.0, 0.0).is_silent() && !plane.is_silent() && !plane.weighs_arms());
    }

    #[test]
    fn the_least_penalty_comes_first() {
        let mut items = vec![3.0, 0.0, 2.5, 1e-300, 7.0];
        least_first(&mut items, |item| *item);
        assert_eq!(items, [0.0, 1e-300, 2.5, 3.0, 7.0]);
    }
}
