//! Motions of a longer task: a path between states of the whole robot, with or without times.

use super::execute::execute;
use super::problem::Problem;
use super::{FEW_SAMPLES, path};
use crate::model::ArmModel;
use crate::times::{TimedPath, TimedPoint};
use regrasp_base::Budget;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::motion_settings::MotionSettings;
use regrasp_plan::robot_plan::RobotStatistics;

/// A motion from state to state.
#[derive(Debug, Clone)]
pub struct Leg {
    /// Values of all coordinates at the corners of the path. Straight motions between them are certified.
    pub corners: Vec<Vec<f64>>,
    /// With times and rounded corners, where they were asked for; joints and velocities of all coordinates.
    pub timed: Option<TimedPath>,
    /// Counts of the search.
    pub statistics: RobotStatistics,
}

/// Whether a leg gets times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LegTimes {
    /// As fast as the joints allow.
    Fastest,
    /// The caller finds them.
    Callers,
}

/// A motion from the start of the problem's query to one of `goals` (states). The start has to be free.
///
/// Errors: no goal is free; no path was found.
pub fn plan_leg(
    problem: &Problem,
    goals: &[Vec<f64>],
    times: LegTimes,
    settings: &MotionSettings,
    (seed, budget): (u64, &Budget),
) -> Result<Leg, Failure> {
    let groups = problem.groups(goals);
    let mut last = None;
    for (index, free) in groups.iter().enumerate() {
        let model = problem.model(free);
        let few = if index + 1 < groups.len() { FEW_SAMPLES } else { u64::MAX };
        let settings = &MotionSettings { max_samples: settings.max_samples.min(few), ..settings.clone() };
        let found = path::find(problem, &model, goals, settings, (seed, budget), &mut |_| {}).and_then(|found| {
            let corners = found.path.iter().map(|corner| model.state_at(corner)).collect();
            match times {
                LegTimes::Callers => Ok(Leg { corners, timed: None, statistics: found.statistics }),
                LegTimes::Fastest => execute(problem, &model, found, settings).map(|executed| Leg {
                    corners,
                    timed: Some(of_states(&model, &executed.timed)),
                    statistics: executed.statistics,
                }),
            }
        });
        match found {
            Ok(leg) => return Ok(leg),
            Err(failure) if failure.kind != FailureKind::WorkSpent => return Err(failure),
            Err(failure) => last = Some(failure),
        }
    }
    let nothing = || Failure::bare(FailureKind::Impossible, "the robot has no joint that moves".into(), "");
    Err(last.unwrap_or_else(nothing))
}

/// The same with all coordinates.
fn of_states(model: &ArmModel, timed: &TimedPath) -> TimedPath {
    let point = |point: &TimedPoint| {
        let mut velocities = vec![0.0; model.state.len()];
        for (coordinate, velocity) in model.coordinates.iter().zip(&point.velocities) {
            velocities[coordinate.index] = *velocity;
        }
        TimedPoint { time: point.time, joints: model.state_at(&point.joints), velocities }
    };
    TimedPath { points: timed.points.iter().map(point).collect(), corners: timed.corners.clone() }
}
