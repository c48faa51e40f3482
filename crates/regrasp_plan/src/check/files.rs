//! `regrasp check plan.json`: everything is read afresh from files.

use crate::check::{CheckSettings, Report, check, query_of};
use crate::format::from_json;
use crate::plan::Plan;
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::load_scene;
use std::path::{Component, Path, PathBuf};

/// A plan file, judged.
#[derive(Debug, Clone)]
pub struct CheckedFiles {
    /// The plan.
    pub plan: Plan,
    /// The scene file that was read.
    pub scene_path: PathBuf,
    /// What the checker says.
    pub report: Report,
    /// Things worth knowing that the reader of the scene noted.
    pub notes: Vec<String>,
}

/// Reads and judges the plan at `plan_path`.
///
/// The scene file is `scene_path` if given; else the one that the plan names first, beside the plan file.
/// Errors: files that cannot be read or understood; the scene file is not found (`C420`). A scene file or another input
/// that is not the one of the plan is no error but a violation.
pub fn check_files(
    plan_path: &Path,
    scene_path: Option<&Path>,
    options: &LoadOptions,
    settings: &CheckSettings,
) -> Result<CheckedFiles, InputError> {
    let plan = from_json(plan_path, &regrasp_base::files::read(plan_path)?)?;
    let scene_path = match scene_path {
        Some(path) => path.to_owned(),
        None => scene_beside(plan_path, &plan)?,
    };
    let loaded = load_scene(&scene_path, options)?;
    let query = query_of(&loaded.scene, loaded.task_for(&plan.query), &plan);
    let report = check((&loaded.scene, &loaded.state), Some(&query), &plan, settings);
    Ok(CheckedFiles { plan, scene_path, report, notes: loaded.notes })
}

/// The scene file that the plan names, in the plan's folder.
fn scene_beside(plan_path: &Path, plan: &Plan) -> Result<PathBuf, InputError> {
    let fail = |problem: String| {
        Diagnostic::new("C420", Place::file(plan_path), problem)
            .element("key", "inputs")
            .expected("the scene file beside the plan file")
            .fix("regrasp check PLAN --scene SCENE")
    };
    let Some(input) = plan.inputs.first().filter(|input| input.role == "scene") else {
        return Err(fail("names no scene file first".into()).into());
    };
    let name = Path::new(&input.name);
    if !name.components().all(|part| matches!(part, Component::Normal(_))) {
        return Err(fail(format!("names the scene \"{}\", which is not below the plan's folder", input.name)).into());
    }
    let path = plan_path.parent().unwrap_or(Path::new("")).join(name);
    if !path.is_file() {
        return Err(
            fail(format!("was made from the scene \"{}\", which is not at {}", input.name, path.display())).into()
        );
    }
    Ok(path)
}
