//! The plan of a motion that was found.

use super::execute::Executed;
use super::problem::Problem;
use crate::model::ArmModel;
use regrasp_manipulation::motion_settings::MotionSettings;
use regrasp_plan::RobotPlan;
use regrasp_plan::plan::PoseData;
use regrasp_plan::robot_plan::{RobotSegment, RobotSegmentKind, RobotWaypoint};

impl Problem<'_> {
    /// The plan of a motion.
    pub fn record(&self, model: &ArmModel, executed: Executed, settings: &MotionSettings, seed: u64) -> RobotPlan {
        let mut plan = RobotPlan::answering(self.scene, self.query);
        let n = self.robot.layout.len();
        let mut poses = Vec::new();
        let mut waypoints = Vec::new();
        for point in &executed.timed.points {
            let joints = model.state_at(&point.joints);
            let mut joint_velocities = vec![0.0; n];
            for (coordinate, velocity) in model.coordinates.iter().zip(&point.velocities) {
                joint_velocities[coordinate.index] = *velocity;
            }
            self.robot.link_poses(&joints, &mut poses);
            let of_objects = self.attached.iter().zip(&self.link_from_objects);
            let world_from_objects =
                of_objects.map(|(body, link_from_object)| PoseData::from(&(poses[body.link.0] * link_from_object)));
            waypoints.push(RobotWaypoint {
                time: point.time,
                joints,
                joint_velocities,
                world_from_objects: world_from_objects.collect(),
                contacts: Vec::new(),
            });
        }
        let kind = if self.attached.is_empty() { RobotSegmentKind::Transit } else { RobotSegmentKind::Carry };
        plan.segments =
            vec![RobotSegment { kind, held_by: RobotPlan::held_by(self.scene, self.query), in_hand: None, waypoints }];
        plan.method = serde_json::to_value(settings.method)
            .ok()
            .and_then(|name| Some(name.as_str()?.to_owned()))
            .unwrap_or_default();
        plan.seed = seed;
        plan.settings = serde_json::to_value(settings).unwrap_or_default();
        plan.promises.clearance = executed.clearance;
        plan.statistics = executed.statistics;
        plan
    }
}
