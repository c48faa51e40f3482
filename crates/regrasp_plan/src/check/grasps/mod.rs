//! The judge of grasp lists: own kinematics, surfaces, cones, distances and polygons, as for plans. It shares nothing with the
//! search.
//!
//! A grasp is judged as a waypoint at which fingers hold, and its way in as two steps between waypoints: the open hand comes on a
//! line, then the fingers close. The hand stands still and the object moves, so that all that judges plans judges grasps too.

/// Hand and object of a list, from files.
mod files;
/// Names, promises and inputs of a list.
mod heading;
/// What a grasp is judged by when it is held.
mod held;
/// Stable poses.
mod stable;
/// The way in.
mod way;
/// A list as waypoints.
mod waypoints;

pub use files::{CheckedGrasps, GraspPaths, check_grasp_files, load_grasp_files, source_of};

use crate::check::bodies::Bodies;
use crate::check::model::CheckedHand;
use crate::check::violation::{Violation, ViolationKind};
use crate::check::{CheckSettings, Log};
use regrasp_grasp::list::GraspList;
use regrasp_scene::GraspScene;
use schemars::JsonSchema;
use serde::Serialize;

/// One thing that is wrong with a list.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct GraspViolation {
    /// Index of the grasp, from 0; none for what is wrong with the whole list.
    pub grasp: Option<usize>,
    /// What kind of thing.
    pub kind: ViolationKind,
    /// Who: a joint, a finger, a file, or the two things of a pair.
    pub subjects: Vec<String>,
    /// In words, with the numbers.
    pub message: String,
    /// How much, in metres, radians or as the kind says.
    pub amount: Option<f64>,
    /// What would have been allowed, in the same unit.
    pub limit: Option<f64>,
}

impl std::fmt::Display for GraspViolation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.kind)?;
        if let Some(grasp) = self.grasp {
            write!(f, " of grasp {grasp}")?;
        }
        write!(f, ": {}", regrasp_base::diagnostic::printable(&self.message))
    }
}

/// What the checker says of a list.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct GraspReport {
    /// What is wrong, at most some of each kind; empty when the list is accepted.
    pub violations: Vec<GraspViolation>,
    /// How many violations were found, those not listed included.
    pub n_violations: usize,
    /// Indices of the grasps that are rejected.
    pub rejected: Vec<usize>,
    /// True when nothing is wrong with the list as a whole: files, names, promises, stable poses.
    pub heading_is_good: bool,
    /// What was not judged, and why; empty when everything was. Such a list is never accepted.
    pub left_out: Vec<String>,
    /// Grasps judged.
    pub n_grasps: usize,
    /// Smallest closure margin of a grasp.
    pub min_margin: Option<f64>,
    /// Smallest distance, in the grasps, of a pair that must not touch; on the ways in it is certified to be positive.
    pub min_clearance: Option<GraspClearance>,
    /// The shortest line on which an open hand comes, in metres.
    pub shortest_way_in: Option<f64>,
    /// Largest distance of a fingertip from its contact, in metres.
    pub max_contact_error: f64,
    /// Deepest that a fingertip presses into the object in a grasp, in metres.
    pub deepest_tip: f64,
    /// Distances measured.
    pub n_distances: u64,
}

/// The smallest distance found in a grasp between two things that must not touch.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct GraspClearance {
    /// Distance, in metres.
    pub distance: f64,
    /// The pair.
    pub pair: [String; 2],
    /// Index of the grasp.
    pub grasp: usize,
}

impl GraspReport {
    /// True when nothing is wrong, and everything was judged.
    pub fn accepted(&self) -> bool {
        self.n_violations == 0 && self.left_out.is_empty()
    }
}

/// What is judged, and by what.
struct Judged<'a> {
    scene: &'a GraspScene,
    list: &'a GraspList,
    model: &'a CheckedHand,
    bodies: &'a Bodies,
    /// Index of the plate below the first stable pose in `bodies`.
    first_plate: usize,
    /// The list as a plan with one waypoint for each grasp.
    plan: &'a crate::Plan,
    settings: &'a CheckSettings,
}

/// What was measured of some grasps.
#[derive(Default)]
struct Measured {
    margin: Option<f64>,
    shortest_way_in: Option<f64>,
    clearance: Option<GraspClearance>,
    contact_error: f64,
    deepest_tip: f64,
    n_distances: u64,
}

impl Measured {
    fn add(&mut self, other: Measured) {
        let least = |a: Option<f64>, b: Option<f64>| [a, b].into_iter().flatten().reduce(f64::min);
        self.margin = least(self.margin, other.margin);
        self.shortest_way_in = least(self.shortest_way_in, other.shortest_way_in);
        let clearances = [self.clearance.take(), other.clearance].into_iter().flatten();
        self.clearance = clearances.reduce(|a, b| if b.distance < a.distance { b } else { a });
        self.contact_error = self.contact_error.max(other.contact_error);
        self.deepest_tip = self.deepest_tip.max(other.deepest_tip);
        self.n_distances += other.n_distances;
    }
}

/// Judges `list`; `scene` must be loaded afresh from the files. The report is the same on any number of threads.
pub fn check_grasps(scene: &GraspScene, list: &GraspList, settings: &CheckSettings, n_threads: usize) -> GraspReport {
    let mut log = Log { most_per_kind: usize::MAX, ..Log::default() };
    let task = scene.manipulation();
    let prepared = CheckedHand::new(&task).and_then(|model| {
        let mut bodies = Bodies::new(&task, &model)?;
        let first_plate = bodies.items.len();
        stable::add_plates(&mut bodies, list)?;
        Ok((model, bodies, first_plate))
    });
    let (model, bodies, first_plate) = match prepared {
        Ok(prepared) => prepared,
        Err(message) => {
            log.push(Violation::new(ViolationKind::WrongScene, message));
            return report(log, list, Measured::default(), settings, vec!["all grasps".into()]);
        }
    };
    if !heading::check_names(&model, list, &mut log) {
        return report(log, list, Measured::default(), settings, vec!["all grasps".into()]);
    }
    let plan = waypoints::plan_of(list);
    heading::check_heading(scene, list, &model, &plan, settings, &mut log);
    stable::check_poses(task.object(), list, &mut log);
    let judged = Judged { scene, list, model: &model, bodies: &bodies, first_plate, plan: &plan, settings };
    let n_threads = n_threads.clamp(1, list.grasps.len().max(1));
    let size = list.grasps.len().div_ceil(n_threads).max(1);
    let parts: Vec<(Log, Measured)> = std::thread::scope(|threads| {
        let part = |first: usize| {
            let judged = &judged;
            threads.spawn(move || judge(judged, first..(first + size).min(judged.list.grasps.len())))
        };
        let running: Vec<_> = (0..list.grasps.len()).step_by(size).map(part).collect();
        running.into_iter().map(|one| one.join().expect("judging does not panic")).collect()
    });
    held::check_contacts(&judged, &mut log);
    let mut measured = Measured::default();
    for (part, of_part) in parts {
        part.found.into_iter().for_each(|violation| log.push(violation));
        measured.add(of_part);
    }
    report(log, list, measured, settings, Vec::new())
}

/// Judges some grasps.
fn judge(judged: &Judged, grasps: std::ops::Range<usize>) -> (Log, Measured) {
    let mut log = Log { most_per_kind: usize::MAX, ..Log::default() };
    let mut measured = Measured::default();
    for index in grasps {
        held::check_grasp(judged, index, &mut log, &mut measured);
        way::check_way(judged, index, &mut log, &mut measured);
        stable::check_grasp(judged, index, &mut log, &mut measured);
    }
    (log, measured)
}

/// The report of what was found; of each kind some are listed.
fn report(
    log: Log,
    list: &GraspList,
    measured: Measured,
    settings: &CheckSettings,
    left_out: Vec<String>,
) -> GraspReport {
    let mut rejected: Vec<usize> = log.found.iter().filter_map(grasp_of).collect();
    rejected.sort_unstable();
    rejected.dedup();
    let heading_is_good = log.found.iter().all(|violation| violation.at.is_some());
    let mut violations: Vec<GraspViolation> = Vec::new();
    let n_violations = log.found.len();
    for violation in log.found {
        if violations.iter().filter(|other| other.kind == violation.kind).count() < settings.most_per_kind {
            let grasp = grasp_of(&violation);
            let Violation { kind, subjects, message, amount, limit, .. } = violation;
            violations.push(GraspViolation { grasp, kind, subjects, message, amount, limit });
        }
    }
    violations.sort_by_key(|violation| violation.grasp);
    let n_judged = if left_out.is_empty() { list.grasps.len() } else { 0 };
    GraspReport {
        violations,
        n_violations,
        rejected,
        heading_is_good,
        left_out,
        n_grasps: n_judged,
        min_margin: measured.margin,
        min_clearance: measured.clearance,
        shortest_way_in: measured.shortest_way_in,
        max_contact_error: measured.contact_error,
        deepest_tip: measured.deepest_tip,
        n_distances: measured.n_distances,
    }
}

fn grasp_of(violation: &Violation) -> Option<usize> {
    violation.at.map(|at| at.waypoint)
}
