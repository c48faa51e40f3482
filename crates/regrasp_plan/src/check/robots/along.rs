//! Clearance over time, for charts.

use crate::check::robots::apart::{Placed, note_clearance};
use crate::check::robots::items::{Floors, Items};
use crate::check::robots::motion::RobotStep;
use crate::check::robots::question::Question;
use crate::check::robots::rules::check_form;
use crate::check::violation::Moment;
use crate::check::{CheckSettings, Log};
use crate::robot_plan::{RobotPlan, RobotSegment};
use regrasp_geometry::Pose;
use regrasp_scene::{Scene, State};

/// Most moments between two waypoints.
const MOST_PIECES: usize = 10_000;

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

impl RobotAlong {
    /// Adds the waypoints of segment `s` and moments between, about one each `step` seconds.
    pub fn add_segment(&mut self, placed: &mut Placed, segment: &RobotSegment, s: usize, step: f64) {
        let mut joints = Vec::new();
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            let motion = RobotStep::new(&pair[0], &pair[1]);
            let n_pieces = if step > 0.0 { ((motion.span / step).ceil() as usize).clamp(1, MOST_PIECES) } else { 1 };
            let last = usize::from(w + 2 == segment.waypoints.len());
            for piece in 0..n_pieces + last {
                let u = piece as f64 / n_pieces as f64;
                motion.joints_at(u, &mut joints);
                let mut clearance = None;
                note_clearance(placed, &joints, Moment::at(s, w), &mut clearance);
                self.times.push(pair[0].time + u * motion.span);
                self.clearance.push(clearance.as_ref().map(|found| found.distance));
                self.pair.push(clearance.map(|found| {
                    self.pairs.iter().position(|known| *known == found.pair).unwrap_or_else(|| {
                        self.pairs.push(found.pair);
                        self.pairs.len() - 1
                    })
                }));
            }
        }
    }
}

/// Clearance at every waypoint of a plan of a motion and at moments between, about `n_moments` in all.
///
/// Err with a message when the plan is not of this scene, or its form is broken.
pub fn motion_along(
    (scene, state): (&Scene, &State),
    plan: &RobotPlan,
    n_moments: usize,
) -> Result<RobotAlong, String> {
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
    let mut along = RobotAlong::default();
    let step = plan.duration() / n_moments.max(1) as f64;
    for (s, segment) in plan.segments.iter().enumerate() {
        along.add_segment(&mut placed, segment, s, step);
    }
    Ok(along)
}
