//! Motions of a longer task: a path between states of the whole robot, with or without times.

use super::execute::execute;
use super::path::Found;
use super::problem::Problem;
use super::{FEW_SAMPLES, path};
use crate::model::ArmModel;
use crate::motion::{Collider, ColliderSettings, Track};
use crate::times::{TimedPath, TimedPoint};
use regrasp_base::{Budget, Rng};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::motion_settings::{MotionSettings, PartsMove};
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
    /// True where a graph was asked first and had no way.
    pub is_new: bool,
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
        let found = find(problem, &model, goals, settings, (seed, budget)).and_then(|found| {
            let corners = found.path.iter().map(|corner| model.state_at(corner)).collect();
            let is_new = found.is_new;
            match times {
                LegTimes::Callers => Ok(Leg { corners, timed: None, statistics: found.statistics, is_new }),
                LegTimes::Fastest => execute(problem, &model, found, settings).map(|executed| Leg {
                    corners,
                    timed: Some(of_states(&model, &executed.timed)),
                    statistics: executed.statistics,
                    is_new,
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

/// Samples with certified motions alone, at most: they are slow.
const CERTIFIED_SAMPLES: u64 = 60;
/// How far a configuration is moved to get room, in radians or metres; so many tries with each.
const SPREADS: [f64; 4] = [0.03, 0.08, 0.16, 0.3];
const TRIES: usize = 25;

/// A path between ends that have little room: first to places near by that have some, straight and certified.
fn find(
    problem: &Problem,
    model: &ArmModel,
    goals: &[Vec<f64>],
    settings: &MotionSettings,
    (seed, budget): (u64, &Budget),
) -> Result<Found, Failure> {
    let mut rng = Rng::keyed(seed, "room", 0);
    let mut refused = None;
    for goal in goals {
        // Callers have other goals: no time is spent on how deep, and what would be free.
        match problem.collision(model, &model.configuration_of(goal), settings) {
            None => {
                refused = None;
                break;
            }
            Some([first, second]) => {
                refused = refused.or(Some(format!("the goal collides: \"{first}\" meets \"{second}\"")))
            }
        }
    }
    if let Some(message) = refused {
        return Err(Failure::bare(FailureKind::GoalInvalid, message, ""));
    }
    let start = problem.query.start.clone();
    let near_start = room(problem, model, &start, settings, &mut rng);
    let near_goals: Vec<Vec<f64>> = goals.iter().map(|goal| room(problem, model, goal, settings, &mut rng)).collect();
    let ends = (near_start.as_slice(), near_goals.as_slice(), CERTIFIED_SAMPLES);
    let mut found = path::find(problem, model, ends, settings, (seed, budget), &mut |_| {})?;
    if near_start != start {
        found.path.insert(0, model.configuration_of(&start));
    }
    let last = found.path.last().cloned();
    let reached = near_goals.iter().position(|goal| Some(model.configuration_of(goal)) == last);
    if let Some(index) = reached
        && near_goals[index] != goals[index]
    {
        found.path.push(model.configuration_of(&goals[index]));
    }
    Ok(found)
}

/// A state near `end` in which searches have room; `end` itself where it has room, or where none was found.
fn room(problem: &Problem, model: &ArmModel, end: &[f64], settings: &MotionSettings, rng: &mut Rng) -> Vec<f64> {
    let at = model.configuration_of(end);
    if settings.parts == PartsMove::InTurn {
        return end.to_vec();
    }
    let clearance = settings.clearance + settings.search_margin;
    let sampled = ColliderSettings { clearance, resolution: settings.resolution, ..ColliderSettings::default() };
    let mut sampled = Collider::new(model, &problem.world, sampled);
    if sampled.is_sampled_free(&at, &at) {
        return end.to_vec();
    }
    let mut certified = path::certifying(model, problem, settings);
    for spread in SPREADS {
        for _ in 0..TRIES {
            let drawn = at.iter().zip(&model.coordinates);
            let mut drawn: Vec<f64> = drawn.map(|(q, c)| (q + spread * rng.normal()).clamp(c.lower, c.upper)).collect();
            model.linear_limits.iter().for_each(|limit| limit.settle(&mut drawn));
            if model.is_within_limits(&drawn, 0.0)
                && sampled.is_sampled_free(&drawn, &drawn)
                && certified.is_certified_free(&Track::straight(&at, &drawn))
            {
                return model.state_at(&drawn);
            }
        }
    }
    end.to_vec()
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
