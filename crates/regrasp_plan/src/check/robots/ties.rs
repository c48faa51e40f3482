//! Joints on the motor of another finger's joint.

use crate::check::Log;
use crate::check::kinematics::Drive;
use crate::check::robots::motion::RobotStep;
use crate::check::robots::question::Question;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::robot_plan::RobotPlan;

/// A joint may be this far off the joints that it follows, in radians or metres: rounding.
const TOLERANCE: f64 = 1e-8;

/// Every joint of a hand that follows joints of other fingers is where its coupling has it, at and between waypoints: the difference of
/// cubics is a cubic.
pub fn check_ties(question: &Question, plan: &RobotPlan, log: &mut Log) {
    let joints = &question.robot.robot.joints;
    let place = |joint: regrasp_robot::JointId| {
        let name = &joints[joint.0].name;
        question.joint_names.iter().position(|known| known == name)
    };
    let ties = question.robot.hands.iter().flat_map(|mounted| &mounted.hand.ties);
    let differences: Vec<(&str, Option<Drive>)> = ties
        .map(|tie| {
            let terms = tie.coupling.terms.iter().map(|&(leader, factor)| Some((place(leader)?, -factor)));
            let all = std::iter::once(place(tie.follower).map(|k| (k, 1.0))).chain(terms);
            let terms = all.collect::<Option<Vec<(usize, f64)>>>();
            let drive = terms.map(|terms| Drive { terms, offset: -tie.coupling.offset });
            (joints[tie.follower.0].name.as_str(), drive)
        })
        .collect();
    for (name, drive) in &differences {
        let Some(drive) = drive else {
            let message = format!("joint \"{name}\" follows a joint that the plan does not move");
            log.push(Violation::new(Kind::WrongScene, message).subjects([*name]));
            continue;
        };
        for (s, segment) in plan.segments.iter().enumerate() {
            for (w, pair) in segment.waypoints.windows(2).enumerate() {
                let step = RobotStep::new(&pair[0], &pair[1]);
                let start = step.start_of(drive);
                let off = step.of_drive(drive).range().map(|change| (start + change).abs());
                let off = off[0].max(off[1]);
                if !(off <= TOLERANCE) {
                    let message =
                        format!("joint \"{name}\" is {off:.3e} off the joints of other fingers that it follows");
                    let violation = Violation::new(Kind::JointLimit, message).when(Moment::at(s, w));
                    log.push(violation.subjects([*name]).amount(off, TOLERANCE));
                }
            }
        }
    }
}
