//! Serial chains, forward kinematics and Jacobians.

use super::body_frame::{BodyFrame, PreparedJoint};
pub use super::chain_joint::{ChainJoint, JointMotion};
use crate::coupling::{LinearLimit, bring_within};
use arrayvec::ArrayVec;
use nalgebra::{Matrix3xX, Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Vector};

/// Where a joint's axis is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointLine {
    /// Direction, of unit length, in the base frame.
    pub axis: Vector,
    /// The origin of the joint's body, in the base frame: on the axis, for turning joints.
    pub origin: Vector,
}

/// A serial chain of moving joints, driven by as many or fewer independent coordinates.
///
/// Made by [`Chain::new`]; the public fields are for reading. To change joints, make a new chain.
#[derive(Debug, Clone)]
pub struct Chain {
    /// Moving joints, base first. Body `i` is what joint `i` carries; its frame is the joint's child frame.
    pub joints: Vec<ChainJoint>,
    /// Names of the independent joints, one per coordinate.
    pub names: Vec<String>,
    /// Lowest value of each coordinate, couplings included; minus infinity for continuous joints.
    pub lower: Vec<f64>,
    /// Highest value of each coordinate.
    pub upper: Vec<f64>,
    /// Limits of joints that follow several coordinates at once.
    pub linear_limits: Vec<LinearLimit>,
    /// The joints as forward kinematics wants them.
    prepared: Vec<PreparedJoint>,
}

impl Chain {
    /// A chain of `joints`, base first, driven by one coordinate per name, each within `lower..=upper`.
    ///
    /// Panics unless `names`, `lower` and `upper` are equally long and every joint's coordinate is among them.
    pub fn new(joints: Vec<ChainJoint>, names: Vec<String>, lower: Vec<f64>, upper: Vec<f64>) -> Self {
        assert!(names.len() == lower.len() && lower.len() == upper.len(), "one name and two limits per coordinate");
        let is_driven = |joint: &ChainJoint| {
            !joint.drive.terms.is_empty() && joint.drive.terms.iter().all(|(k, _)| *k < lower.len())
        };
        assert!(joints.iter().all(is_driven), "a joint without a coordinate");
        let prepared = joints.iter().map(PreparedJoint::new).collect();
        Chain { joints, names, lower, upper, linear_limits: Vec::new(), prepared }
    }

    /// The same chain with limits on sums of coordinates.
    ///
    /// Panics if a limit names a coordinate that the chain does not have.
    #[must_use]
    pub fn with_linear_limits(mut self, limits: Vec<LinearLimit>) -> Self {
        let is_known = |limit: &LinearLimit| limit.terms.iter().all(|(k, _)| *k < self.lower.len());
        assert!(limits.iter().all(is_known), "a limit on a coordinate that the chain does not have");
        self.linear_limits = limits;
        self
    }

    /// Number of independent coordinates.
    pub fn n_coordinates(&self) -> usize {
        self.lower.len()
    }

    /// True when every coordinate can move by `margin` (in its unit) and all limits, those of sums too, are kept.
    pub fn within_limits(&self, coordinates: &[f64], margin: f64) -> bool {
        coordinates
            .iter()
            .zip(self.lower.iter().zip(&self.upper))
            .all(|(&q, (&lower, &upper))| q >= lower + margin && q <= upper - margin)
            && self.within_linear_limits(coordinates, margin)
    }

    /// True when the limits of sums of coordinates are kept while every coordinate moves by at most `margin`.
    #[inline]
    pub fn within_linear_limits(&self, coordinates: &[f64], margin: f64) -> bool {
        self.linear_limits.iter().all(|limit| limit.room(coordinates) >= margin)
    }

    /// Smallest distance of a coordinate, or of all at once, from a limit; negative outside.
    pub fn limit_distance(&self, coordinates: &[f64]) -> f64 {
        let own = coordinates
            .iter()
            .zip(self.lower.iter().zip(&self.upper))
            .map(|(&q, (&lower, &upper))| (q - lower).min(upper - q))
            .fold(f64::INFINITY, f64::min);
        self.linear_limits.iter().map(|limit| limit.room(coordinates)).fold(own, f64::min)
    }

    /// Coordinates near `near`, which keep their own limits, that keep those of sums too. None where no such coordinates are found.
    pub fn bring_within_limits(&self, near: &[f64]) -> Option<Vec<f64>> {
        match self.linear_limits.as_slice() {
            [] => Some(near.to_vec()),
            limits => bring_within(limits, [&self.lower, &self.upper], near),
        }
    }

    /// Poses of the bodies in the base frame, written to `base_from_body` (one per joint).
    pub fn forward(&self, coordinates: &[f64], base_from_body: &mut Vec<Pose>) {
        base_from_body.clear();
        let mut parent = Pose::identity();
        for joint in &self.joints {
            let position = joint.position(coordinates);
            parent = parent * joint.parent_from_joint * joint_motion(joint, position);
            base_from_body.push(parent);
        }
    }

    /// Frames of the bodies in the base frame, one per joint: [`Chain::forward`] at a fraction of its time.
    ///
    /// Panics unless `base_from_body` has one place per joint.
    #[inline]
    pub fn forward_frames(&self, coordinates: &[f64], base_from_body: &mut [BodyFrame]) {
        assert_eq!(base_from_body.len(), self.prepared.len(), "one frame per joint");
        let mut parent = BodyFrame::IDENTITY;
        for (joint, frame) in self.prepared.iter().zip(base_from_body) {
            parent = joint.child_frame(&parent, coordinates);
            *frame = parent;
        }
    }

    /// Frame of the last body in the base frame; the base frame itself for a chain without joints.
    #[inline]
    pub fn last_frame(&self, coordinates: &[f64]) -> BodyFrame {
        self.prepared.iter().fold(BodyFrame::IDENTITY, |parent, joint| joint.child_frame(&parent, coordinates))
    }

    /// Axes of the joints in the base frame, appended to `lines`; the frame of the last body.
    ///
    /// Panics if there are more joints than `lines` has room for.
    #[inline]
    pub(crate) fn joint_lines<const N: usize>(
        &self,
        coordinates: &[f64],
        lines: &mut ArrayVec<JointLine, N>,
    ) -> BodyFrame {
        let mut frame = BodyFrame::IDENTITY;
        for (joint, prepared) in self.joints.iter().zip(&self.prepared) {
            frame = prepared.child_frame(&frame, coordinates);
            lines.push(JointLine { axis: frame.vector(&joint.axis), origin: frame.translation });
        }
        frame
    }

    /// Position, in the base frame, of `point_in_body` of the last body.
    pub fn tip(&self, coordinates: &[f64], point_in_body: &Point) -> Point {
        self.last_frame(coordinates).point(point_in_body)
    }

    /// Jacobian of a point of the last body: 3 rows, one column per coordinate, in the base frame.
    ///
    /// `base_from_body` are the poses at the configuration, `point_in_base` the point.
    pub fn jacobian(&self, base_from_body: &[Pose], point_in_base: &Point) -> Matrix3xX<f64> {
        let mut jacobian = Matrix3xX::zeros(self.n_coordinates());
        for (joint, pose) in self.joints.iter().zip(base_from_body) {
            let axis = pose.rotation * joint.axis.into_inner();
            let column: Vector = match joint.motion {
                JointMotion::Turn => axis.cross(&(point_in_base - Point::from(pose.translation.vector))),
                JointMotion::Slide => axis,
            };
            for &(k, multiplier) in &joint.drive.terms {
                let mut target = jacobian.column_mut(k);
                target += multiplier * column;
            }
        }
        jacobian
    }

    /// Moves the base of the chain: later results are in the frame in which the base is at `parent_from_base`.
    pub fn place_at(&mut self, parent_from_base: &Pose) {
        if let Some(first) = self.joints.first_mut() {
            first.parent_from_joint = parent_from_base * first.parent_from_joint;
            self.prepared[0] = PreparedJoint::new(first);
        }
    }
}

/// Pose of the child frame in the joint frame at `position`.
fn joint_motion(joint: &ChainJoint, position: f64) -> Pose {
    match joint.motion {
        JointMotion::Turn => {
            Pose::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&joint.axis, position))
        }
        JointMotion::Slide => {
            Pose::from_parts(Translation3::from(joint.axis.into_inner() * position), UnitQuaternion::identity())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coupling::Coupling;
    use regrasp_geometry::UnitVector;

    fn chain() -> Chain {
        let joint = |z: f64, axis: Vector, motion, coordinate, multiplier| ChainJoint {
            parent_from_joint: Pose::new(Vector::new(0.01, 0.0, z), Vector::new(0.1, -0.2, 0.3)),
            axis: UnitVector::new_normalize(axis),
            motion,
            drive: Coupling::one(coordinate, multiplier, 0.05),
        };
        Chain::new(
            vec![
                joint(0.0, Vector::x(), JointMotion::Turn, 0, 1.0),
                joint(0.05, Vector::new(0.0, 1.0, 0.2), JointMotion::Turn, 1, 1.0),
                joint(0.04, Vector::z(), JointMotion::Slide, 2, 1.0),
                joint(0.03, Vector::y(), JointMotion::Turn, 1, 0.7),
            ],
            vec!["a".into(), "b".into(), "c".into()],
            vec![-1.0; 3],
            vec![1.0; 3],
        )
    }

    #[test]
    fn frames_agree_with_poses() {
        for axis in [Vector::x(), Vector::y(), Vector::z(), -Vector::x(), -Vector::y(), -Vector::z()] {
            let mut joints = chain().joints;
            joints[1].axis = UnitVector::new_normalize(axis);
            joints[1].parent_from_joint.rotation = UnitQuaternion::identity();
            joints[3].axis = UnitVector::new_normalize(axis);
            compare(Chain::new(joints, chain().names, chain().lower, chain().upper));
        }
        compare(chain());
    }

    fn compare(mut chain: Chain) {
        chain.place_at(&Pose::new(Vector::new(0.1, 0.2, -0.3), Vector::new(1.0, -0.4, 0.2)));
        let mut rng = regrasp_base::Rng::keyed(1, "frames", 0);
        let (mut poses, mut frames) = (Vec::new(), [BodyFrame::IDENTITY; 4]);
        for _ in 0..200 {
            let coordinates: [f64; 3] = std::array::from_fn(|_| rng.uniform(-8.0, 8.0));
            chain.forward(&coordinates, &mut poses);
            chain.forward_frames(&coordinates, &mut frames);
            for (pose, frame) in poses.iter().zip(&frames) {
                let difference = (pose.to_homogeneous() - frame.to_pose().to_homogeneous()).abs().max();
                assert!(difference < 1e-13, "{difference:e}");
                let point = Point::new(0.3, -0.1, 0.2);
                assert!((pose * point - frame.point(&point)).norm() < 1e-13);
                assert!((pose.inverse() * point - frame.point_to_child(&point)).norm() < 1e-13);
            }
        }
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        let chain = chain();
        let point = Point::new(0.01, 0.02, 0.03);
        let coordinates = [0.3, -0.4, 0.01];
        let mut poses = Vec::new();
        chain.forward(&coordinates, &mut poses);
        let tip = chain.tip(&coordinates, &point);
        let jacobian = chain.jacobian(&poses, &tip);
        for k in 0..3 {
            let step = 1e-6;
            let (mut low, mut high) = (coordinates, coordinates);
            low[k] -= step;
            high[k] += step;
            let difference = (chain.tip(&high, &point) - chain.tip(&low, &point)) / (2.0 * step);
            assert!((difference - jacobian.column(k)).norm() < 1e-9);
        }
    }
}
