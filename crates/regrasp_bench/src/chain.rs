//! Chains of goals: each query begins in the pose and the grasp in which the last plan ended.

use crate::csv;
use crate::row::{Problem, Row, RunSettings, measured, plan_only};
use crate::summary::Spread;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Vector, frame};
use regrasp_plan::Plan;
use regrasp_scene::{GraspRequest, InHandQuery, Query};
use serde::Serialize;
use std::fmt::Write;

/// Largest angle from one goal to the next, in radians.
const LARGEST_TURN: f64 = std::f64::consts::FRAC_PI_2;
/// Largest distance of a goal's centre of mass from that of the scene's start, in metres.
const LARGEST_SHIFT: f64 = 0.005;

const LEADING: [&str; 3] = ["link", "angle_deg", "motion_s"];

/// One query of a chain.
#[derive(Debug, Clone, Serialize)]
pub struct Link {
    /// Its number in the chain, from 0; that one chooses its own start grasp.
    pub link: usize,
    /// Angle from its start to its goal, in degrees.
    pub angle_deg: f64,
    /// How long the plan moves, in seconds; 0 without a plan.
    pub motion_s: f64,
    /// What came of it.
    pub row: Row,
}

/// The queries of a chain of `n_links` goals, planned one after the other; `tell` hears of each. A goal that is missed is given up:
/// the next is drawn from where the object is. The goals depend on the seed only, and on which were missed.
///
/// Errors: the first of `tell`, which ends the chain.
pub fn run<E>(
    problem: Problem,
    n_links: usize,
    settings: &RunSettings,
    mut tell: impl FnMut(Link) -> Result<(), E>,
) -> Result<(), E> {
    let Query::InHand(first) = problem.query else { return Ok(()) };
    let center = problem.task.scene.objects[first.object].center_of_mass;
    let home = first.world_from_object_start * center;
    let mut rng = Rng::keyed(problem.seed, "chain", 0);
    let mut here = (first.world_from_object_start, first.start_grasp.clone());
    for link in 0..n_links {
        let goal = draw_goal(&here.0, &center, &home, &mut rng);
        let query = Query::InHand(InHandQuery {
            world_from_object_start: here.0,
            world_from_object_way: Vec::new(),
            world_from_object_goal: goal,
            start_grasp: here.1.clone(),
            goal_grasp: GraspRequest::Automatic,
            open_start: None,
            ..first.clone()
        });
        let problem = Problem { query: &query, ..problem };
        let (row, plan) = plan_only(problem, settings);
        let end = plan.as_ref().and_then(end_of);
        let row = measured(problem, (row, plan), &settings.planner, settings.judge);
        let angle_deg = frame::rotation_between(&here.0, &goal).norm().to_degrees();
        let motion_s = end.as_ref().map_or(0.0, |end| end.time);
        if let Some(end) = end {
            here = (end.pose, GraspRequest::Posture { joints: end.joints, holds: end.holds });
        }
        tell(Link { link, angle_deg, motion_s, row })?;
    }
    Ok(())
}

/// Where a plan ends.
struct End {
    pose: Pose,
    joints: Vec<f64>,
    holds: Vec<bool>,
    time: f64,
}

fn end_of(plan: &Plan) -> Option<End> {
    let last = plan.segments.last()?.waypoints.last()?;
    let holds = last.contacts.iter().map(|contact| contact.holds()).collect();
    Some(End { pose: Pose::from(&last.world_from_object), joints: last.joints.clone(), holds, time: last.time })
}

/// A turn about any axis by up to [`LARGEST_TURN`], with the centre of mass near `home`.
fn draw_goal(from: &Pose, center: &Point, home: &Point, rng: &mut Rng) -> Pose {
    let turn = Vector::from(rng.direction()) * rng.uniform(0.0, LARGEST_TURN);
    let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn) * from.rotation;
    let shift = Vector::from(rng.direction()) * (LARGEST_SHIFT * rng.unit().cbrt());
    let origin = home + shift - rotation * center.coords;
    Pose::from_parts(origin.coords.into(), rotation)
}

/// The header line of CSV files.
pub fn header() -> String {
    format!("{},{}", LEADING.join(","), csv::header())
}

/// One line.
pub fn line(link: &Link) -> String {
    let own = [link.link.to_string(), link.angle_deg.to_string(), link.motion_s.to_string()];
    csv::line_after(&own, &link.row)
}

/// A table of the links by scene: those that choose their start grasp, and those that begin where the last plan ended.
pub fn table(links: &[Link]) -> String {
    let mut scenes: Vec<&str> = Vec::new();
    for link in links {
        if !scenes.contains(&link.row.scene.as_str()) {
            scenes.push(&link.row.scene);
        }
    }
    let mut text = String::from(
        "scene                     start grasp  solved    accepted  cpu median    mean     max  relocations  motion per 90 deg\n",
    );
    for scene in scenes {
        for (name, is_first) in [("chosen", true), ("given", false)] {
            let of_scene = || links.iter().filter(|link| link.row.scene == scene && (link.link == 0) == is_first);
            let solved = || of_scene().filter(|link| link.row.status == "solved");
            let spread = |value: &dyn Fn(&Link) -> f64| Spread::of(solved().map(value));
            let Some(cpu) = spread(&|link| link.row.plan_cpu_s) else { continue };
            let relocations = spread(&|link| link.row.relocations as f64).map_or(0.0, |spread| spread.median);
            let motion = spread(&|link| link.motion_s * 90.0 / link.angle_deg).map_or(0.0, |spread| spread.median);
            let n_accepted = solved().filter(|link| link.row.accepted != Some(false)).count();
            let _ = writeln!(
                text,
                "{scene:<24}  {name:<11}  {:>3}/{:<4}  {n_accepted:>8}  {:>8.3} s {:>6.2} s {:>6.2} s  {relocations:>11.1}  {motion:>14.1} s",
                solved().count(),
                of_scene().count(),
                cpu.median,
                cpu.mean,
                cpu.max,
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_near_home_and_within_a_quarter_turn() {
        let mut rng = Rng::keyed(1, "goals", 0);
        let center = Point::new(0.01, -0.02, 0.005);
        let mut from = Pose::from_parts(Vector::new(0.1, 0.0, 0.05).into(), Default::default());
        let home = from * center;
        let mut angles = Vec::new();
        for _ in 0..200 {
            let goal = draw_goal(&from, &center, &home, &mut rng);
            angles.push(frame::rotation_between(&from, &goal).norm());
            assert!((goal * center - home).norm() <= LARGEST_SHIFT + 1e-12);
            from = goal;
        }
        assert!(angles.iter().all(|angle| *angle <= LARGEST_TURN + 1e-9));
        assert!(angles.iter().any(|angle| *angle > 1.3) && angles.iter().any(|angle| *angle < 0.3));
    }
}
