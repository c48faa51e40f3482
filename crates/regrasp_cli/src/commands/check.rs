//! `regrasp check`: judge a plan from the files alone.

use crate::args::{self, Common};
use crate::interrupt;
use crate::judge;
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::files;
use regrasp::plan::check::find_scene;
use regrasp::plan::{Plan, format};
use std::path::{Path, PathBuf};

/// Judges; exit code 1 when the plan is rejected.
pub fn run(arguments: &args::Check, common: &Common, talk: &Talk) -> Result<(), Stop> {
    // The flag is not asked here: the process ends by itself shortly after Ctrl-C.
    interrupt::flag()?;
    let plan = format::from_json(&arguments.plan, &files::read(&arguments.plan)?)?;
    let scene_path = scene_of(&arguments.plan, &plan, arguments.scene.as_deref(), "--scene FILE")?;
    let loaded = arguments.judging.scene(load::scene_of_plan(&scene_path, &plan, common, talk)?);
    if judge::judge(&loaded, &plan, &arguments.judging, talk)?.accepted() { Ok(()) } else { Err(Stop::Rejected) }
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
