//! `regrasp bench` of scenes whose tasks are pick and place.

use super::rows::{make_folder_of, of_rows};
use crate::args::{self, Common};
use crate::commands::task_grasps;
use crate::commands::written::Limits;
use crate::interrupt;
use crate::load;
use crate::outputs::Outputs;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::Diagnostic;
use regrasp::base::Place;
use regrasp::planners::FailureKind;
use regrasp::robot_roadmap::{Asked, RobotAnswer, RobotRoadmap};
use regrasp::scene::pick_and_place::PICK_AND_PLACE;
use regrasp::scene::{LoadedScene, Query, load_scene};
use regrasp::tasks::RoadmapBuildSettings;
use regrasp::{Budget, Failure, GraspList, PlannerSettings, RobotPlan, plan_task};
use regrasp_bench::csv;
use regrasp_bench::row::Judge;
use regrasp_bench::task::{self, TaskRow};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Seeds per task where none are given.
const DEFAULT_SEEDS: u64 = 20;

/// True where every task of every scene is one of pick and place. Scenes that cannot be read have no task.
pub fn is_for(files: &[PathBuf], common: &Common) -> bool {
    let options = load::options(common);
    let is_task = |path: &PathBuf| {
        load_scene(path, &options).is_ok_and(|scene| scene.tasks.iter().all(|task| task.kind_name() == PICK_AND_PLACE))
    };
    !files.is_empty() && files.iter().all(is_task)
}

/// Runs every seed of every task.
pub fn run(files: &[PathBuf], arguments: &args::Bench, common: &Common, talk: &Talk) -> Result<(), Stop> {
    refuse_other_arguments(arguments)?;
    let cancelled = interrupt::flag()?;
    let limits = Limits {
        max_work: arguments.search.max_work,
        time_limit: arguments.search.time_limit,
        improve_for: None,
        cancelled: Arc::clone(&cancelled),
    };
    let mut writer = match &arguments.csv {
        Some(path) => {
            make_folder_of(path)?;
            Outputs::new(of_rows(path))?.refuse_inputs(files.iter().map(PathBuf::as_path))?;
            Some(csv::Writer::with_text(path, task::header()).map_err(|error| Stop::unwritable(path, &error))?)
        }
        None => None,
    };
    let judge = if arguments.no_check { Judge::Skip } else { Judge::Checker(arguments.judging.level()) };
    let mut rows = Vec::new();
    for path in files {
        let loaded = load::scene_by(path, common, None, talk)?;
        let n_tasks = if common.task.is_some() { 1 } else { loaded.tasks.len() };
        let names: Vec<String> = loaded.tasks.iter().take(n_tasks).map(|task| task.name.clone()).collect();
        for name in &names {
            let loaded = arguments.judging.scene(loaded.clone().for_query(name));
            let settings = load::for_task(loaded.task(), &arguments.search, arguments.threads)?;
            let lists = lists_of(path, &loaded, &limits, common, talk)?;
            let prepared = match (arguments.prepare, &lists) {
                (true, Ok(lists)) => prepare(&loaded, lists, &settings, &cancelled)?,
                _ => None,
            };
            let n_seeds = arguments.seeds.unwrap_or(DEFAULT_SEEDS).min(u64::MAX - arguments.first_seed);
            for seed in arguments.first_seed..arguments.first_seed + n_seeds {
                let plan = |query: &Query| -> Result<RobotPlan, Failure> {
                    let deadline = limits.time_limit.map(|limit| Instant::now() + limit);
                    let cancelled = Arc::clone(&cancelled);
                    let budget = Budget { deadline, cancelled, ..Budget::work(limits.max_work) };
                    let lists = lists.as_ref().map_err(Clone::clone)?;
                    if let Some((roadmap, _)) = &prepared {
                        let asked = Asked { scene: &loaded.scene, state: &loaded.state, query, lists };
                        return roadmap.plan(&asked, &settings, seed, &budget).map(RobotAnswer::into_plan);
                    }
                    let query = query.as_pick_and_place().expect("the scene asks for pick and place");
                    plan_task((&loaded.scene, &loaded.state), query, lists, &settings, seed, &budget)
                };
                let mut row = task::run(&loaded, seed, judge, &plan);
                row.offline_cpu_s = prepared.as_ref().map(|(_, seconds)| *seconds);
                if cancelled.load(Ordering::Relaxed) {
                    return Err(Stop::Interrupted);
                }
                say(&row, talk);
                if let (Some(writer), Some(path)) = (&mut writer, &arguments.csv) {
                    writer.push_line(&task::line(&row)).map_err(|error| Stop::unwritable(path, &error))?;
                }
                rows.push(row);
            }
        }
    }
    if let (Some(writer), Some(path)) = (writer, &arguments.csv) {
        writer.finish().map_err(|error| Stop::unwritable(path, &error))?;
    }
    if !talk.is_json() {
        talk.data(&task::table(&rows));
    }
    Ok(())
}

/// The roadmap of the first task, with the processor time that it took. None where none can be built, as of tasks without a plan.
fn prepare(
    loaded: &LoadedScene,
    lists: &[(usize, GraspList)],
    settings: &PlannerSettings,
    cancelled: &Arc<AtomicBool>,
) -> Result<Option<(RobotRoadmap, f64)>, Stop> {
    let query = loaded.task().query(0);
    let asked = Asked { scene: &loaded.scene, state: &loaded.state, query: &query, lists };
    let budget = Budget { cancelled: Arc::clone(cancelled), ..Budget::unlimited() };
    let of_build = RoadmapBuildSettings::default();
    let (built, seconds) = task::with_cpu_seconds(|| RobotRoadmap::build(&asked, settings, &of_build, 0, &budget));
    match built {
        Ok(roadmap) => Ok(Some((roadmap, seconds))),
        Err(failure) if failure.kind == FailureKind::Interrupted => Err(Stop::Interrupted),
        Err(_) => Ok(None),
    }
}

/// The lists of the first task. Where no hand can have a grasp, every seed of the task fails for that reason.
fn lists_of(
    path: &Path,
    loaded: &LoadedScene,
    limits: &Limits,
    common: &Common,
    talk: &Talk,
) -> Result<Result<Vec<(usize, GraspList)>, Failure>, Stop> {
    let query = loaded.task().query(0);
    let Some(query) = query.as_pick_and_place() else {
        let problem = format!("has a task of kind \"{}\" beside others", loaded.task().kind_name());
        return Err(Stop::BadInput(Diagnostic::new("A505", Place::file(path), problem).into()));
    };
    match task_grasps::lists(path, (loaded, query), 0, limits, common, talk) {
        Ok(lists) => Ok(Ok(lists)),
        Err(Stop::NoGrasp(failure) | Stop::NoPlan(failure) | Stop::NoRobotPlan(failure)) => Ok(Err(*failure)),
        Err(stop) => Err(stop),
    }
}

/// One line per miss or rejection; other solved seeds stay silent but for `--json`.
fn say(row: &TaskRow, talk: &Talk) {
    talk.event("row", json!(row));
    if row.status != "solved" {
        talk.say(format!("miss   {} seed {}: {}; {}", row.scene, row.seed, row.status, row.cause));
    } else if row.accepted == Some(false) {
        talk.say(format!("REJECTED   {} seed {}: {}", row.scene, row.seed, row.cause));
    }
}

/// Arguments that have no meaning for tasks of a whole robot (`A507`).
fn refuse_other_arguments(arguments: &args::Bench) -> Result<(), Stop> {
    let given = [
        ("--margin", arguments.search.margin.is_some()),
        ("--improve", arguments.search.improve.is_some()),
        ("--improve-work", arguments.search.improve_work.is_some()),
        ("--chain", arguments.chain.is_some()),
        ("--hold", arguments.judging.hold),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) => Err(Stop::argument(
            "A507",
            flag,
            "is not for tasks of whole robots",
            "scenes of in-hand tasks, or leave it out",
        )),
        None => Ok(()),
    }
}
