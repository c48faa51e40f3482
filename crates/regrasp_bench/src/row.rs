//! One seed of one scene: plan, judge, measure.

use cpu_time::{ProcessTime, ThreadTime};
use regrasp_base::Budget;
use regrasp_plan::check::{CheckSettings, Level, check};
use regrasp_plan::plan::Improvement;
use regrasp_plan::{Plan, format};
use regrasp_planners::in_hand::{NotProven, validate_once};
use regrasp_planners::{Failure, InHandSettings, PlannerSettings, Progress, TrackingMethod, TrackingSettings, plan};
use regrasp_scene::{HandView, Manipulation, Query, Scene, State};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// One query in a scene.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The hand and the object of the query, in their scene.
    pub task: Manipulation<'a>,
    /// Query of this seed.
    pub query: &'a Query,
    /// Seed.
    pub seed: u64,
}

impl<'a> Problem<'a> {
    /// Name of the scene, with that of the task where the scene has several.
    pub fn name(&self) -> String {
        match self.query.name() {
            "" => self.task.scene.name.clone(),
            name => format!("{}:{name}", self.task.scene.name),
        }
    }

    /// The scene, and where everything that the query does not name rests.
    pub fn in_state(&self) -> (&'a Scene, &'a State) {
        (self.task.scene, self.task.state)
    }
}

/// How to run.
#[derive(Debug, Clone)]
pub struct RunSettings {
    /// Settings of the in-hand planner, with its number of threads.
    pub planner: InHandSettings,
    /// Settings for tracking tasks.
    pub tracking: TrackingSettings,
    /// Work allowed per seed.
    pub max_work: u64,
    /// Wall-clock time allowed per seed.
    pub time_limit: Option<Duration>,
    /// Whether plans are judged.
    pub judge: Judge,
    /// Wall-clock time allowed per seed for a better plan after the first.
    pub improve_for: Option<Duration>,
    /// Set from outside to stop.
    pub cancelled: Arc<AtomicBool>,
}

/// Whether plans are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Judge {
    /// By the independent checker, for this level.
    Checker(Level),
    /// Not at all.
    Skip,
}

/// What came of one seed of one scene. Times in seconds, lengths in metres.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Scene.
    pub scene: String,
    /// Method.
    pub method: String,
    /// Seed.
    pub seed: u64,
    /// `solved`, or the kind of failure.
    pub status: String,
    /// Wall-clock time of the planner.
    pub plan_s: f64,
    /// Processor time of planning: of the thread where one searches, else of the process.
    pub plan_cpu_s: f64,
    /// Processor time to validate the final plan once at the planner's resolution; none for a solved seed whose plan does
    /// not pass, which is a defect: `cause` says what.
    pub floor_s: Option<f64>,
    /// Wall-clock time of the checker.
    pub check_s: Option<f64>,
    /// The checker's verdict, for the level that was asked for.
    pub accepted: Option<bool>,
    /// The highest level at which the checker finds nothing wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<Level>,
    /// Nodes of the search.
    pub nodes: u64,
    /// Configurations sampled; in tracking, sub-goals tried.
    pub samples: u64,
    /// Configurations looked at.
    pub work: u64,
    /// Restarts.
    pub restarts: u64,
    /// Transfers in the plan; in tracking, sub-goals on its path.
    pub transfers: u64,
    /// Single-finger relocations in the plan.
    pub relocations: u64,
    /// Smallest closure margin that the checker found.
    pub min_margin: Option<f64>,
    /// Smallest clearance that the checker found.
    pub min_clearance: Option<f64>,
    /// Angle left at the nearest miss, in degrees.
    pub angle_left_deg: Option<f64>,
    /// What became of the first plan, where a better one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub improvement: Option<Improvement>,
    /// True when a wall-clock limit cut the search or the improvement; not in CSV files without improvement.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cut_by_time: bool,
    /// Commonest cause of a failure, first violation of a rejected plan, or what has no floor.
    pub cause: String,
}

impl Row {
    /// True for a row of finger tracking: `samples` then counts the sub-goals tried, `transfers` those on the path.
    pub fn is_tracking(&self) -> bool {
        is_tracking(&self.method)
    }

    /// True for a solved seed whose plan was not proven again at the planner's resolution; tracking has no floor.
    pub fn lacks_floor(&self) -> bool {
        self.status == "solved" && self.floor_s.is_none() && !self.is_tracking()
    }
}

/// True for the name of finger tracking's method, also where it is part of another's.
pub fn is_tracking(method: &str) -> bool {
    method.split('+').next() == Some(TrackingMethod::Tracking.name())
}

/// The word for a failure's kind, as its JSON spells it.
pub fn status_of(failure: &Failure) -> String {
    serde_json::to_value(failure.kind).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

/// The word for a method, as settings spell it.
pub fn method_name(settings: &InHandSettings) -> String {
    serde_json::to_value(settings.method).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

/// Plans one seed, judges the plan, and measures both.
pub fn run(problem: Problem, settings: &RunSettings) -> Row {
    measured(problem, plan_only(problem, settings), &settings.planner, settings.judge)
}

/// The row of what was planned, with the plan measured and judged, if there is one.
pub(crate) fn measured(
    problem: Problem,
    (mut row, plan): (Row, Option<Plan>),
    planned_with: &InHandSettings,
    judge: Judge,
) -> Row {
    if let Some(plan) = &plan {
        measure(problem, plan, planned_with, judge, &mut row);
    }
    row
}

/// Plans one seed: the plan, if there is one, is neither measured nor judged yet.
pub(crate) fn plan_only(problem: Problem, settings: &RunSettings) -> (Row, Option<Plan>) {
    let mut row = Row {
        scene: problem.name(),
        method: match problem.query {
            Query::InHand(_) => method_name(&settings.planner),
            Query::Tracking(_) => settings.tracking.method.name().into(),
            Query::Motion(_) | Query::PickAndPlace(_) => problem.query.task().into(),
        },
        seed: problem.seed,
        ..Row::default()
    };
    let started = (Instant::now(), ProcessTime::now(), ThreadTime::now());
    let budget = Budget {
        max_work: settings.max_work,
        deadline: settings.time_limit.map(|limit| started.0 + limit),
        improve_for: settings.improve_for,
        cancelled: Arc::clone(&settings.cancelled),
    };
    let silent = |_: Progress| {};
    let planner = PlannerSettings {
        in_hand: settings.planner.clone(),
        tracking: settings.tracking.clone(),
        ..PlannerSettings::default()
    };
    let outcome = plan(problem.in_state(), problem.query, &planner, problem.seed, &budget, &silent);
    row.plan_s = started.0.elapsed().as_secs_f64();
    // Other trials may run beside this one: only several threads of one search need the time of all.
    let cpu = if settings.planner.n_threads == 1 { started.2.elapsed() } else { started.1.elapsed() };
    row.plan_cpu_s = cpu.as_secs_f64();
    let statistics = match &outcome {
        Ok(plan) => &plan.statistics,
        Err(failure) => &failure.statistics,
    };
    row.nodes = statistics.nodes;
    row.samples = statistics.samples;
    row.work = statistics.work;
    row.restarts = statistics.restarts;
    row.cut_by_time = statistics.cut_by_time;
    row.improvement = statistics.improvement.as_deref().cloned();
    match outcome {
        Ok(plan) => {
            row.status = "solved".into();
            (row, Some(plan))
        }
        Err(failure) => {
            row.status = status_of(&failure);
            row.angle_left_deg = failure.nearest_miss.as_ref().map(|miss| miss.angle_left.to_degrees());
            row.cause = failure.causes.first().map_or(failure.message.clone(), |cause| cause.reason.clone());
            (row, None)
        }
    }
}

/// Enters what a plan is like: its motions, its floor and, if asked, the checker's verdict.
pub(crate) fn measure(problem: Problem, plan: &Plan, settings: &InHandSettings, asked: Judge, row: &mut Row) {
    row.transfers = plan.statistics.transfers;
    row.relocations = plan.n_relocations();
    if problem.query.as_in_hand().is_some() {
        match floor(&HandView::of(&problem.task), plan, settings) {
            Ok(seconds) => row.floor_s = Some(seconds),
            Err(not_proven) => row.cause = not_proven.to_string(),
        }
    }
    if let Judge::Checker(level) = asked {
        judge(problem, plan, level, row);
    }
}

/// Judges a plan, as it reads from the file that `regrasp plan` would write, and enters what came of it.
fn judge(problem: Problem, plan: &Plan, level: Level, row: &mut Row) {
    let plan = match format::from_json(Path::new("plan.json"), format::to_json(plan).as_bytes()) {
        Ok(plan) => plan,
        Err(error) => {
            row.accepted = Some(false);
            row.cause = error.diagnostics.first().map_or_else(String::new, ToString::to_string);
            return;
        }
    };
    let started = Instant::now();
    let settings = CheckSettings { level, ..CheckSettings::default() };
    let report = check(problem.in_state(), Some(problem.query), &plan, &settings);
    row.check_s = Some(started.elapsed().as_secs_f64());
    row.accepted = Some(report.accepted());
    row.level = report.reached;
    row.min_margin = report.min_margin;
    row.min_clearance = report.min_clearance.as_ref().map(|clearance| clearance.distance);
    if let Some(violation) = report.violations.first() {
        row.cause = violation.to_string();
    }
}

/// Processor time to validate `plan` once at the planner's resolution, the least of three.
fn floor(view: &HandView, plan: &Plan, settings: &InHandSettings) -> Result<f64, NotProven> {
    let mut least = f64::INFINITY;
    for _ in 0..3 {
        let started = ThreadTime::now();
        validate_once(view, plan, settings)?;
        least = least.min(started.elapsed().as_secs_f64());
    }
    Ok(least)
}
