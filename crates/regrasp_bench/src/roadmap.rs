//! One random query on a roadmap: answer, judge, measure.

use crate::row::{Problem, Row, RunSettings, measure, status_of};
use cpu_time::ProcessTime;
use regrasp_base::Budget;
use regrasp_planners::in_hand::roadmap::{QueryMemory, RoadmapPlanner};
use std::sync::Arc;
use std::time::Instant;

/// Answers one query, judges the plan, and measures both. Times are of the query alone: the roadmap is open.
pub fn run(planner: &RoadmapPlanner, problem: Problem, settings: &RunSettings, memory: &mut QueryMemory) -> Row {
    let mut row =
        Row { scene: problem.scene.name.clone(), method: "roadmap".into(), seed: problem.seed, ..Row::default() };
    let started = (Instant::now(), ProcessTime::now());
    let budget = Budget {
        max_work: settings.max_work,
        deadline: settings.time_limit.map(|limit| started.0 + limit),
        improve_for: None,
        cancelled: Arc::clone(&settings.cancelled),
    };
    let outcome = planner.plan(problem.query, problem.seed, &budget, memory);
    row.plan_s = started.0.elapsed().as_secs_f64();
    row.plan_cpu_s = started.1.elapsed().as_secs_f64();
    match outcome {
        Ok(answer) => {
            let plan = &answer.plan;
            row.status = "solved".into();
            row.nodes = plan.statistics.nodes;
            row.samples = plan.statistics.samples;
            row.work = plan.statistics.work;
            measure(problem, plan, planner.settings(), settings.judge, &mut row);
        }
        Err(failure) => {
            row.status = status_of(&failure);
            row.work = failure.statistics.work;
            row.cause = failure.message;
        }
    }
    row
}
