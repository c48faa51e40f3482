//! `regrasp check`: judge a plan from the files alone.

use crate::args::{self, Common};
use crate::interrupt;
use crate::judge;
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::{Diagnostic, Place, files};
use regrasp::plan::{Plan, format};
use std::path::{Path, PathBuf};

/// Judges; exit code 1 when the plan is rejected.
pub fn run(arguments: &args::Check, common: &Common, talk: &Talk) -> Result<(), Stop> {
    // The flag is not asked here: the process ends by itself shortly after Ctrl-C.
    interrupt::flag()?;
    let plan = format::from_json(&arguments.plan, &files::read(&arguments.plan)?)?;
    let scene_path = match &arguments.scene {
        Some(path) => path.clone(),
        None => find_scene(&arguments.plan, &plan)?,
    };
    let loaded = load::scene(&scene_path, common, talk)?;
    if judge::judge(&loaded, &plan, talk)?.accepted() { Ok(()) } else { Err(Stop::Rejected) }
}

/// The scene that the plan names: beside the plan, in one of the folders above it, or in the current folder.
///
/// Only the bytes decide: of the files of that name the first with the plan's hash is taken, else the first.
fn find_scene(plan_path: &Path, plan: &Plan) -> Result<PathBuf, Stop> {
    let fail = |problem: String| {
        let diagnostic = Diagnostic::new("C420", Place::file(plan_path), problem)
            .element("key", "inputs")
            .fix("name the scene file: --scene FILE");
        Err(Stop::BadInput(diagnostic.into()))
    };
    let Some(input) = plan.inputs.iter().find(|input| input.role == "scene") else {
        return fail("names no scene file".into());
    };
    let Some(name) = Path::new(&input.name).file_name() else {
        return fail(format!("names the scene file \"{}\", which is no file name", input.name));
    };
    let start = std::path::absolute(plan_path).unwrap_or_else(|_| plan_path.to_owned());
    let mut folders: Vec<PathBuf> = start.ancestors().skip(1).take(4).map(Path::to_owned).collect();
    if let Ok(current) = std::env::current_dir()
        && !folders.contains(&current)
    {
        folders.push(current);
    }
    let mut candidates: Vec<PathBuf> = Vec::new();
    for folder in &folders {
        for candidate in [folder.join(name), folder.join("scenes").join(name), folder.join("scenes/allegro").join(name)]
        {
            if candidate.is_file() && !candidates.contains(&candidate) {
                candidates.push(candidate);
            }
        }
    }
    let has_its_hash = |path: &&PathBuf| files::read(path).is_ok_and(|bytes| files::sha256(&bytes) == input.sha256);
    match candidates.iter().find(has_its_hash).or(candidates.first()) {
        Some(path) => Ok(path.clone()),
        None => {
            let folders: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
            fail(format!("names the scene \"{}\", which was not found in {}", input.name, folders.join(", ")))
        }
    }
}
