//! States that bring wrists to poses.

use super::problem::Problem;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_robot::kinematics::arm_ik::{ArmIk, IkBudget, Unreachable};
use regrasp_robot::manipulator::layout::Part;
use regrasp_scene::{MotionGoal, WristGoal};

/// States that are looked for, at most.
const GOALS: usize = 32;
/// Values of the common joints that are drawn, after those of the start.
const DRAWS: u64 = 200;
/// Postures of one arm for one value of the common joints.
const POSTURES: usize = 8;

impl Problem<'_> {
    /// States that answer the query.
    pub fn goals(&self, seed: u64) -> Result<Vec<Vec<f64>>, Failure> {
        match &self.query.goal {
            MotionGoal::Joints(joints) => Ok(vec![joints.clone()]),
            MotionGoal::Wrists(wrists) => states(self, wrists, seed),
        }
    }
}

/// States in which the mount links have the poses asked for: with the common joints of the start first, then with drawn ones.
///
/// Errors: an arm of fewer than six joints, poses out of reach.
fn states(problem: &Problem, wrists: &[WristGoal], seed: u64) -> Result<Vec<Vec<f64>>, Failure> {
    let robot = problem.robot;
    let prepared: Result<Vec<ArmIk>, _> = wrists.iter().map(|wrist| ArmIk::new(robot, wrist.arm)).collect();
    let prepared = prepared.map_err(|few| {
        Failure::bare(FailureKind::Impossible, few.to_string(), "ask for joints, or name an arm of six joints or more")
    })?;
    // Common joints that move a wrist.
    let coordinates = &robot.layout.coordinates;
    let above = |k: usize| wrists.iter().any(|w| robot.coordinates_above(robot.arms[w.arm].mount).contains(&k));
    let common: Vec<usize> =
        (0..coordinates.len()).filter(|&k| coordinates[k].part == Part::Common && above(k)).collect();
    let mut rng = Rng::keyed(seed, "wrist_goals", 0);
    let mut found = Vec::new();
    let mut nearest: Option<(f64, String)> = None;
    for draw in 0..=if common.is_empty() { 0 } else { DRAWS } {
        let mut state = problem.query.start.clone();
        if draw > 0 {
            for &k in &common {
                state[k] = rng.uniform(coordinates[k].lower.max(-3.2), coordinates[k].upper.min(3.2));
            }
            if !robot.layout.within_limits(&state, 0.0) {
                continue;
            }
        }
        match postures(problem, wrists, &prepared, &state, seed) {
            Ok(states) => found.extend(states),
            Err((by, why)) => {
                if nearest.as_ref().is_none_or(|nearest| by < nearest.0) {
                    nearest = Some((by, why));
                }
            }
        }
        if found.len() >= GOALS {
            break;
        }
    }
    if found.is_empty() {
        let why = nearest.map_or_else(String::new, |(_, why)| format!(": {why}"));
        let message = format!("the goal is out of reach{why}");
        let advice = "move the pose of the wrist nearer to the robot, or turn it";
        return Err(Failure::bare(FailureKind::GoalInvalid, message, advice));
    }
    // The nearest to the start first.
    let start = &problem.query.start;
    found.sort_by(|a, b| crate::search::distance(a, start).total_cmp(&crate::search::distance(b, start)));
    found.truncate(GOALS);
    Ok(found)
}

/// States with the common joints of `state`. Errors: by how much a pose is out of reach, in metres or radians, and in words.
fn postures(
    problem: &Problem,
    wrists: &[WristGoal],
    prepared: &[ArmIk],
    state: &[f64],
    seed: u64,
) -> Result<Vec<Vec<f64>>, (f64, String)> {
    let robot = problem.robot;
    let mut poses: Vec<Pose> = Vec::new();
    robot.link_poses(state, &mut poses);
    let mut states = vec![state.to_vec()];
    for (wrist, ik) in wrists.iter().zip(prepared) {
        let arm = &robot.arms[wrist.arm];
        let base_from_mount = poses[arm.base.0].inverse() * wrist.world_from_mount;
        let near = robot.arm_joints(wrist.arm, state).to_vec();
        let budget = IkBudget { postures: POSTURES, seed, ..IkBudget::default() };
        let solved = ik.solve(&base_from_mount, &near, &budget).map_err(|unreachable| {
            let by = match &unreachable {
                Unreachable::TooFar { by } | Unreachable::TooNear { by } | Unreachable::Limits { by, .. } => *by,
                Unreachable::NotFound { distance, angle } => distance + angle,
            };
            (by, format!("arm \"{}\": {unreachable}", arm.name))
        })?;
        let first = robot.layout.range(Part::Arm(wrist.arm)).start;
        let with = |before: &Vec<f64>| {
            let before = before.clone();
            solved.iter().map(move |posture| {
                let mut state = before.clone();
                state[first..first + posture.joints.len()].copy_from_slice(&posture.joints);
                state
            })
        };
        let all: Vec<Vec<f64>> = states.iter().flat_map(with).collect();
        states = all;
        states.truncate(GOALS);
    }
    Ok(states)
}
