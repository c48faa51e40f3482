//! Clearance over time, for charts.

use crate::check::robots::apart::{Placed, note_clearance};
use crate::check::robots::items::{Floors, Items};
use crate::check::robots::motion::RobotStep;
use crate::check::robots::question::Question;
use crate::check::robots::rules::check_form;
use crate::check::violation::Moment;
use crate::check::{CheckSettings, Log};
use crate::robot_plan::RobotPlan;
use regrasp_geometry::Pose;
use regrasp_scene::{Scene, State};

/// Clearance at moments of a plan, in order of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RobotAlong {
    /// Seconds from the start.
    pub times: Vec<f64>,
    /// Smallest distance of bodies that must not touch, in metres, negative where they overlap; none where all are 1 m apart or more.
    pub clearance: Vec<Option<f64>>,
    /// Index in `pairs` of the pair at that distance.
    pub pair: Vec<Option<usize>>,
    /// Names of pairs.
    pub pairs: Vec<[String; 2]>,
}

/// Clearance at every waypoint of `plan` and at moments between, about `n_moments` in all.
///
/// Err with a message when the plan is not of this scene, or its form is broken.
pub fn robot_along((scene, state): (&Scene, &State), plan: &RobotPlan, n_moments: usize) -> Result<RobotAlong, String> {
    let mut question = Question::new(scene, None, plan).map_err(|violation| violation.to_string())?;
    let mut log = Log { most_per_kind: 1, ..Log::default() };
    if !check_form(&question, plan, &mut log) {
        return Err(log.found.first().map_or_else(String::new, ToString::to_string));
    }
    let first = &plan.segments[0].waypoints[0];
    let held: Vec<Pose> = first.world_from_objects.iter().map(Pose::from).collect();
    question.take_hold(&first.joints, &held);
    let floors = Floors { apart: 0.0, held: -CheckSettings::default().largest_contact_tolerance };
    let items = Items::new((scene, state), &question, floors)?;
    let mut placed = Placed::new(&question.tree, &items);
    let (mut along, mut joints) = (RobotAlong::default(), Vec::new());
    let duration = plan.duration();
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            let step = RobotStep::new(&pair[0], &pair[1]);
            let share = if duration > 0.0 { (step.span / duration).clamp(0.0, 1.0) } else { 0.0 };
            let n_pieces = ((share * n_moments as f64).ceil() as usize).max(1);
            let last = usize::from(w + 2 == segment.waypoints.len());
            for piece in 0..n_pieces + last {
                let u = piece as f64 / n_pieces as f64;
                step.joints_at(u, &mut joints);
                let mut clearance = None;
                note_clearance(&mut placed, &joints, Moment::at(s, w), &mut clearance);
                along.times.push(pair[0].time + u * step.span);
                along.clearance.push(clearance.as_ref().map(|found| found.distance));
                along.pair.push(clearance.map(|found| {
                    along.pairs.iter().position(|known| *known == found.pair).unwrap_or_else(|| {
                        along.pairs.push(found.pair);
                        along.pairs.len() - 1
                    })
                }));
            }
        }
    }
    Ok(along)
}
