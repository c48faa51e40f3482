//! When each waypoint is passed.

use super::model::Model;
use regrasp_plan::plan::{MotionLimits, Segment};

/// Limits that plans promise.
pub fn limits(model: &Model) -> MotionLimits {
    let n_joints = model.scene.hand.n_joints();
    MotionLimits {
        largest_speed: 0.04,
        joint_velocities: vec![2.0; n_joints],
        joint_accelerations: vec![20.0; n_joints],
    }
}

/// Gives every waypoint its time.
pub fn assign_times(segments: &mut [Segment]) {
    let mut now = 0.0;
    for segment in segments {
        for (k, waypoint) in segment.waypoints.iter_mut().enumerate() {
            now += if k == 0 { 0.0 } else { 0.2 };
            waypoint.time = now;
        }
    }
}
