//! The motion that is executed: rounded corners, times, and the proof that it is free.

use super::path::Found;
use super::problem::Problem;
use crate::model::ArmModel;
use crate::motion::{Collider, ColliderSettings, Track};
use crate::times::{Limits, RoundedPath, Row, TimedPath, TimedPoint, times};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::motion_settings::{MotionSettings, Validation};
use regrasp_plan::robot_plan::{RobotPromises, RobotStatistics};
use regrasp_robot::Manipulator;
use regrasp_scene::Scene;

/// A motion with its times.
pub struct Executed {
    pub timed: TimedPath,
    pub statistics: RobotStatistics,
    /// Distance that bodies keep at every moment, in metres.
    pub clearance: f64,
}

/// Rounds after which corners that are not free become stops.
const ROUNDS: usize = 12;
/// Steps of a motion that are proved to be free together: bounds are over all of them.
const TOGETHER: usize = 8;
/// A robot that stays where it is takes this long, in seconds.
const REST: f64 = 1e-3;

/// Rounds the corners of a path as far as the motion stays free, and gives it times.
pub fn execute(
    problem: &Problem,
    model: &ArmModel,
    found: Found,
    settings: &MotionSettings,
) -> Result<Executed, Failure> {
    let free: Vec<usize> = model.coordinates.iter().map(|c| c.index).collect();
    let limits = limits(problem.scene, problem.robot, &free);
    let is_certified = settings.validation == Validation::Certified;
    let of_collider = ColliderSettings {
        clearance: settings.clearance,
        resolution: settings.resolution,
        ..ColliderSettings::default()
    };
    let mut collider = Collider::new(model, &problem.world, of_collider);
    let mut statistics = found.statistics;
    let clearance = if is_certified { settings.clearance } else { 0.0 };
    let Some(mut path) = RoundedPath::new(&found.path, settings.largest_rounding) else {
        return Ok(Executed { timed: at_rest(&found.path[0]), statistics, clearance });
    };
    for k in path.inner_corners() {
        while !path.is_sharp(k) && !collider.is_certified_free(&path.parabola(k)) {
            path.sharpen(k);
        }
    }
    let mut timed = times(&path, &limits);
    for round in 0..=ROUNDS {
        // What is executed between two waypoints, not the path that it follows. Straight pieces are pieces of the path's lines.
        let unfree = (0..timed.corners.len())
            .filter(|&k| timed.corners[k].is_some() && !collider.is_certified_free(&timed.track(k)))
            .find_map(|k| timed.corners[k]);
        let Some(corner) = unfree else { break };
        if round == ROUNDS {
            path.inner_corners().for_each(|k| path.stop(k));
        } else {
            path.sharpen(corner);
        }
        timed = times(&path, &limits);
    }
    if is_certified {
        let tracks: Vec<Track> = (0..timed.corners.len()).map(|k| timed.track(k)).collect();
        for few in tracks.chunks(TOGETHER) {
            if !collider.are_certified_free(few) {
                let message = "the motion that was found could not be certified".to_owned();
                return Err(Failure::bare(FailureKind::WorkSpent, message, "try another seed or a smaller clearance"));
            }
        }
    }
    statistics.work += 8 * collider.counts.blocks + collider.counts.exact;
    statistics.counts.insert("corners".into(), path.inner_corners().len() as u64);
    statistics.counts.insert("stops".into(), path.inner_corners().filter(|&k| path.is_sharp(k)).count() as u64);
    Ok(Executed { timed, statistics, clearance })
}

fn at_rest(configuration: &[f64]) -> TimedPath {
    let point =
        |time: f64| TimedPoint { time, joints: configuration.to_vec(), velocities: vec![0.0; configuration.len()] };
    TimedPath { points: vec![point(0.0), point(REST)], corners: vec![None] }
}

/// What limits the coordinates `free` of a robot, and joints that follow them.
pub fn limits(scene: &Scene, robot: &Manipulator, free: &[usize]) -> Limits {
    let promises = RobotPromises::of(scene, robot);
    let row = |(k, &index): (usize, &usize)| Row {
        terms: vec![(k, 1.0)],
        velocity: promises.joint_velocities[index],
        acceleration: promises.joint_accelerations[index],
    };
    let mut rows: Vec<Row> = free.iter().enumerate().map(row).collect();
    let tree = &robot.robot;
    for (index, joint) in tree.joints.iter().enumerate().filter(|(_, joint)| joint.coupling.is_some()) {
        let Some(velocity) = joint.limits.and_then(|limits| limits.velocity) else { continue };
        let Some(drive) = robot.layout.drive_of(tree, index) else { continue };
        let own = |k: usize| free.iter().position(|&index| index == k);
        let terms: Vec<(usize, f64)> = drive.terms.iter().filter_map(|&(k, m)| Some((own(k)?, m))).collect();
        if !terms.is_empty() {
            rows.push(Row { terms, velocity, acceleration: f64::INFINITY });
        }
    }
    Limits { rows }
}
