//! `regrasp check`: judge a plan or a grasp list from the files alone.

use crate::args::{self, Common, JudgingLimits};
use crate::commands::motion;
use crate::commands::written::available_threads;
use crate::interrupt;
use crate::judge;
use crate::judge_grasps;
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::files;
use regrasp::grasp::GraspList;
use regrasp::grasp::list::format::{from_json, is_list};
use regrasp::plan::check::find_scene;
use regrasp::plan::check::grasps::{GraspPaths, load_grasp_files};
use regrasp::plan::{Plan, format};
use regrasp::scene::GraspScene;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Judges; exit code 1 when the plan is rejected.
pub fn run(arguments: &args::Check, common: &Common, talk: &Talk) -> Result<(), Stop> {
    // The flag is not asked here: the process ends by itself shortly after Ctrl-C.
    interrupt::flag()?;
    // Reading counts too: a mesh of a million triangles takes seconds.
    let deadline = arguments.time_limit.and_then(|limit| Instant::now().checked_add(limit));
    let judging = arguments.judging.within(JudgingLimits { max_work: arguments.max_work, deadline });
    let bytes = files::read(&arguments.plan)?;
    if is_list(&bytes) {
        refuse_limits(arguments)?;
        return run_list(arguments, &bytes, common, talk);
    }
    if arguments.hand.is_some() || arguments.object.is_some() {
        let problem = format!("stands beside {}, which is no grasp list", arguments.plan.display());
        return Err(Stop::argument("A512", "--hand, --object", problem, "a grasp list; plans take --scene"));
    }
    if format::is_robot_plan(&bytes) {
        return motion::check(arguments, &judging, &bytes, common, talk);
    }
    let plan = format::from_json(&arguments.plan, &bytes)?;
    let scene_path = scene_of(&arguments.plan, &plan, arguments.scene.as_deref(), "--scene FILE")?;
    let loaded = judging.scene(load::scene_of_plan(&scene_path, &plan, common, deadline, talk)?);
    if judge::judge(&loaded, &plan, &judging, talk)?.accepted() { Ok(()) } else { Err(Stop::Rejected) }
}

/// Refuses limits for a grasp list, whose size bounds the work (`A507`).
fn refuse_limits(arguments: &args::Check) -> Result<(), Stop> {
    let given = [("--max-work", arguments.max_work.is_some()), ("--time-limit", arguments.time_limit.is_some())];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) => {
            let problem = format!("is for plans, and {} is a grasp list", arguments.plan.display());
            Err(Stop::argument("A507", flag, problem, "no such flag"))
        }
        None => Ok(()),
    }
}

/// Judges a grasp list.
fn run_list(arguments: &args::Check, bytes: &[u8], common: &Common, talk: &Talk) -> Result<(), Stop> {
    let path = &arguments.plan;
    let list = from_json(path, bytes)?;
    let scene = grasp_scene(path, &list, [&arguments.hand, &arguments.object], common)?;
    scene.notes.iter().for_each(|note| talk.note(note));
    if judge_grasps::judge(&scene, &list, available_threads(), talk).accepted() { Ok(()) } else { Err(Stop::Rejected) }
}

/// Hand and object of a grasp list at `path`: those named, else those that the list names, in its folder or in the current one.
pub fn grasp_scene(
    path: &Path,
    list: &GraspList,
    [hand, object]: [&Option<PathBuf>; 2],
    common: &Common,
) -> Result<GraspScene, Stop> {
    let own = path.parent().map_or_else(PathBuf::new, Path::to_owned);
    let paths = GraspPaths { hand: hand.clone(), object: object.clone(), folders: vec![own, PathBuf::new()] };
    Ok(load_grasp_files(path, list, &paths, &load::options(common))?)
}

/// The scene file of `plan`, which was read from `plan_path`: `named`, what `--scene` says, whatever the plan says; without
/// it the one that [`find_scene`] finds, with the current folder as the last to look in. `how` is the way to name one.
///
/// Errors: without `named`, the plan names no scene file, or none is found (`C420`).
pub fn scene_of(plan_path: &Path, plan: &Plan, named: Option<&Path>, how: &str) -> Result<PathBuf, Stop> {
    if let Some(path) = named {
        return Ok(path.to_owned());
    }
    find_scene(plan_path, plan, std::env::current_dir().ok().as_deref()).map_err(|mut error| {
        error.diagnostics.iter_mut().for_each(|one| one.fix = format!("name the scene file: {how}"));
        Stop::BadInput(error)
    })
}
