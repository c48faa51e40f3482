//! The scene file of a plan, where nobody says which it is.

use crate::plan::{Plan, PlanInput};
use regrasp_base::{Diagnostic, InputError, Place, files};
use std::path::{Path, PathBuf};

/// How many folders above the plan are looked at.
const FOLDERS_ABOVE: usize = 4;

/// The scene that `plan`, which is or will be at `plan_path`, names: beside it, in one of the folders above it, or in
/// `current`, the folder that relative paths start from.
///
/// Only the bytes decide: of the files of that name the first with the plan's hash is taken, else the first.
/// Errors: no scene is named, or none is found (`C420`).
pub fn find_scene(plan_path: &Path, plan: &Plan, current: Option<&Path>) -> Result<PathBuf, InputError> {
    find_scene_among(plan_path, &plan.inputs, current)
}

/// As [`find_scene`], of a plan of any kind that was made from these files.
pub fn find_scene_among(plan_path: &Path, inputs: &[PlanInput], current: Option<&Path>) -> Result<PathBuf, InputError> {
    let fail = |problem: String| {
        let diagnostic = Diagnostic::new("C420", Place::file(plan_path), problem)
            .element("key", "inputs")
            .fix("name the scene file: --scene FILE");
        Err(diagnostic.into())
    };
    let Some(input) = inputs.iter().find(|input| input.role == "scene") else {
        return fail("names no scene file".into());
    };
    let Some(name) = Path::new(&input.name).file_name() else {
        return fail(format!("names the scene file \"{}\", which is no file name", input.name));
    };
    let start = current.map_or_else(|| plan_path.to_owned(), |current| current.join(plan_path));
    let mut folders: Vec<&Path> = start.ancestors().skip(1).take(FOLDERS_ABOVE).collect();
    folders.extend(current.filter(|current| !folders.contains(current)));
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
