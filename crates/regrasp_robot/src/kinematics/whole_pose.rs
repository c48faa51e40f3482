//! Links of fingers as bodies that move: Jacobians of all six directions, joints for a pose, torques for a force.

use super::body_frame::BodyFrame;
use super::chain::{Chain, JointMotion};
use super::finger_ik::{Coordinates, MAX_COORDINATES};
use arrayvec::ArrayVec;
use nalgebra::{Matrix6, Vector6};
use regrasp_geometry::frame::turn_between;
use regrasp_geometry::{Point, Vector};

/// Steps of Newton's method for the joints of a pose.
const MOST_STEPS: usize = 8;
/// Distance and angle from the pose, in metres and radians, at which it is reached.
const REACHED: f64 = 1e-12;
/// Distance and angle below which the pose counts as reached where rounding ends the method.
const CLOSE_ENOUGH: f64 = 1e-9;
/// Joints of a chain, at most: inverse kinematics allows no more.
const MAX_JOINTS: usize = 2 * MAX_COORDINATES;

/// Velocity of the last body for unit velocity of each coordinate: of `point` in the base frame, and angular.
pub fn twists(chain: &Chain, coordinates: &[f64], point: &Point) -> ArrayVec<[Vector; 2], MAX_COORDINATES> {
    let mut frames = [BodyFrame::IDENTITY; MAX_JOINTS];
    let frames = &mut frames[..chain.joints.len()];
    chain.forward_frames(coordinates, frames);
    let mut twists: ArrayVec<[Vector; 2], MAX_COORDINATES> =
        coordinates.iter().map(|_| [Vector::zeros(), Vector::zeros()]).collect();
    for (joint, frame) in chain.joints.iter().zip(frames.iter()) {
        // A joint's axis is the same in the frame before and after its motion.
        for &(k, multiplier) in &joint.drive.terms {
            let axis = frame.vector(&joint.axis) * multiplier;
            let [linear, angular] = &mut twists[k];
            match joint.motion {
                JointMotion::Slide => *linear += axis,
                JointMotion::Turn => {
                    *linear += axis.cross(&(point.coords - frame.translation));
                    *angular += axis;
                }
            }
        }
    }
    twists
}

/// True where the chain can take its last body to any pose near by: three slides or turns for the place, three for the turn.
pub fn has_all_directions(chain: &Chain) -> bool {
    chain.n_coordinates() == 6
}

/// Coordinates near `near` with which the last body has the pose `wanted` in the base frame, for chains of six coordinates. None
/// where Newton's method does not find them within the limits.
pub fn joints_of_pose(chain: &Chain, near: &[f64], wanted: &BodyFrame) -> Option<Coordinates> {
    let mut joints: Coordinates = near.iter().copied().collect();
    let mut before = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let frame = chain.last_frame(&joints);
        let way = wanted.translation - frame.translation;
        let turn = turn_between(&frame.rotation, &wanted.rotation);
        let left = way.norm().max(turn.norm());
        if left < REACHED || (left < CLOSE_ENOUGH && left > 0.5 * before) {
            return chain.within_limits(&joints, 0.0).then_some(joints);
        }
        before = left;
        let twists = twists(chain, &joints, &Point::from(frame.translation));
        let jacobian = Matrix6::from_fn(|row, column| {
            let [linear, angular] = &twists[column];
            if row < 3 { linear[row] } else { angular[row - 3] }
        });
        let step = jacobian.lu().solve(&Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z))?;
        if !step.iter().all(|change| change.abs() < 1.0) {
            return None;
        }
        joints.iter_mut().zip(step.iter()).for_each(|(joint, change)| *joint += change);
    }
    None
}

/// Torques, or forces of sliding joints, with which the last body exerts `force` at `point`, both in the base frame.
pub fn torques(chain: &Chain, coordinates: &[f64], point: &Point, force: &Vector) -> Coordinates {
    twists(chain, coordinates, point).iter().map(|[linear, _]| linear.dot(force)).collect()
}

/// A bound on the torque of each coordinate, or force of one that slides, per newton that the last body exerts within `radius` of the
/// origin of its frame: in no posture within the limits is it more. By lengths alone; infinite behind slides without limits.
pub fn largest_torques(chain: &Chain, radius: f64) -> Coordinates {
    let mut largest: Coordinates = (0..chain.n_coordinates()).map(|_| 0.0).collect();
    // From the frame that the joint carries to the contact, at most.
    let mut distance = radius;
    for joint in chain.joints.iter().rev() {
        let lever = if joint.motion == JointMotion::Slide { 1.0 } else { distance };
        joint.drive.terms.iter().for_each(|&(k, multiplier)| largest[k] += multiplier.abs() * lever);
        distance += joint.parent_from_joint.translation.vector.norm();
        if joint.motion == JointMotion::Slide {
            let [low, high] = joint.drive.range(|k| [chain.lower[k], chain.upper[k]]);
            distance += low.abs().max(high.abs());
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coupling::Coupling;
    use crate::kinematics::chain::ChainJoint;
    use regrasp_base::Rng;
    use regrasp_geometry::{Pose, UnitVector};

    /// Three slides and three turns about skew axes, displaced from each other.
    fn chain(rng: &mut Rng) -> Chain {
        let joint = |coordinate: usize| ChainJoint {
            parent_from_joint: Pose::new(Vector::from(rng.direction()) * 0.02, Vector::from(rng.direction()) * 0.2),
            axis: UnitVector::new_normalize(Vector::ith(coordinate % 3, 1.0) + Vector::from(rng.direction()) * 0.1),
            motion: if coordinate < 3 { JointMotion::Slide } else { JointMotion::Turn },
            drive: Coupling::independent(coordinate),
        };
        let joints = (0..6).map(joint).collect();
        let names = (0..6).map(|k| format!("j{k}")).collect();
        Chain::new(joints, names, vec![-2.0; 6], vec![2.0; 6])
    }

    #[test]
    fn twists_are_those_of_finite_differences_and_torques_do_their_work() {
        let mut rng = Rng::keyed(1, "twists", 0);
        for _ in 0..50 {
            let chain = chain(&mut rng);
            let joints: Vec<f64> = (0..6).map(|_| rng.uniform(-0.6, 0.6)).collect();
            let in_body = Point::from(Vector::from(rng.direction()) * 0.05);
            let point = chain.last_frame(&joints).point(&in_body);
            let force = Vector::from(rng.direction()) * 3.0;
            let (twists, torques) = (twists(&chain, &joints, &point), torques(&chain, &joints, &point, &force));
            for k in 0..6 {
                let h = 1e-6;
                let [before, after] = [-h, h].map(|h| {
                    let mut moved = joints.clone();
                    moved[k] += h;
                    chain.last_frame(&moved)
                });
                let linear = (after.point(&in_body) - before.point(&in_body)) / (2.0 * h);
                let angular = turn_between(&before.rotation, &after.rotation) / (2.0 * h);
                assert!((linear - twists[k][0]).norm() < 1e-8 && (angular - twists[k][1]).norm() < 1e-8);
                assert!((torques[k] - linear.dot(&force)).abs() < 1e-7);
                let most = largest_torques(&chain, in_body.coords.norm())[k] * force.norm();
                assert!(torques[k].abs() <= most && most < 10.0, "{} {most}", torques[k]);
            }
        }
    }

    #[test]
    fn joints_of_a_pose_near_by_are_found_and_limits_are_kept() {
        let mut rng = Rng::keyed(1, "joints_of_pose", 0);
        for _ in 0..100 {
            let chain = chain(&mut rng);
            let joints: Vec<f64> = (0..6).map(|_| rng.uniform(-0.6, 0.6)).collect();
            let near: Vec<f64> = joints.iter().map(|joint| joint + rng.uniform(-0.1, 0.1)).collect();
            let found = joints_of_pose(&chain, &near, &chain.last_frame(&joints)).expect("it is near");
            assert!(found.iter().zip(&joints).all(|(a, b)| (a - b).abs() < 1e-8));
            let narrow = Chain::new(chain.joints.clone(), chain.names.clone(), vec![-1e-3; 6], vec![1e-3; 6]);
            assert_eq!(joints_of_pose(&narrow, &near, &chain.last_frame(&joints)), None);
        }
    }
}
