//! `regrasp export`: a plan or a grasp list in the formats of other tools.
//!
//! What is exported may be sent to a robot: a plan that the checker rejects is refused, unless `--no-check` is given.

use crate::args::{self, Common};
use crate::commands::check::scene_of;
use crate::commands::grasp_files;
use crate::commands::motion;
use crate::interrupt;
use crate::judge;
use crate::load;
use crate::outputs::{Output, Outputs};
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::{Diagnostic, Place, files};
use regrasp::export;
use regrasp::grasp::list::format::is_list;
use regrasp::plan::format;
use regrasp::{Manipulation, Plan};
use serde_json::json;
use std::path::Path;

/// How a plan becomes the bytes of a file; the scene is there for formats that need it, and where the plan is judged.
type Write = fn(&Path, &Plan, Option<&Manipulation>, &Talk) -> Result<Vec<u8>, Stop>;

/// Reads, judges, writes.
pub fn run(arguments: &args::Export, common: &Common, talk: &Talk) -> Result<(), Stop> {
    // The flag is not asked here: the process ends by itself shortly after Ctrl-C.
    interrupt::flag()?;
    let path = arguments.plan.as_path();
    let formats: [(&'static str, Option<&Path>, Write); 3] = [
        ("--npz", arguments.npz.as_deref(), |path, plan, _, _| {
            export::to_npz(plan).map_err(|wrong| unfit(path, &wrong))
        }),
        ("--ros2", arguments.ros2.as_deref(), |path, plan, _, _| {
            Ok(export::to_ros2(plan).map_err(|wrong| unfit(path, &wrong))?.into_bytes())
        }),
        ("--mjcf", arguments.mjcf.as_deref(), mjcf),
    ];
    let wanted: Vec<(&'static str, &Path, Write)> =
        formats.into_iter().filter_map(|(name, path, write)| Some((name, path?, write))).collect();
    let written = Outputs::new(wanted.iter().map(|&(format, path, _)| Output::new(format, path)))?;
    written.refuse_inputs([arguments.plan.as_path()].into_iter().chain(arguments.scene.as_deref()))?;
    let bytes = files::read(&arguments.plan)?;
    if is_list(&bytes) {
        return grasp_files::export(arguments, &bytes, common, talk);
    }
    if let Some((flag, _)) =
        [("--isaac", &arguments.isaac), ("--moveit", &arguments.moveit)].iter().find(|f| f.1.is_some())
    {
        let problem = format!("is a format of grasp lists; {} is none", arguments.plan.display());
        return Err(Stop::argument("A512", flag, problem, "a grasp list, or a format of plans"));
    }
    if format::is_robot_plan(&bytes) {
        return motion::export(arguments, &bytes, &written, common, talk);
    }
    let plan = format::from_json(&arguments.plan, &bytes)?;
    let mut scene = None;
    if !arguments.no_check || arguments.mjcf.is_some() {
        let scene_path = scene_of(&arguments.plan, &plan, arguments.scene.as_deref(), "--scene FILE")?;
        let loaded = arguments.judging.scene(load::scene_of_plan(&scene_path, &plan, common, None, talk)?);
        written.refuse_inputs(loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
        if !arguments.no_check && !judge::judge(&loaded, &plan, &arguments.judging, talk)?.accepted() {
            return Err(Stop::Rejected);
        }
        scene = Some(loaded);
    }
    let task = scene.as_ref().map(|loaded| loaded.manipulation());
    // All are made before any is written: what one format cannot hold leaves no files of the others.
    let made = wanted.into_iter().map(|(name, to, write)| Ok((name, to, write(path, &plan, task.as_ref(), talk)?)));
    for (name, path, bytes) in made.collect::<Result<Vec<_>, Stop>>()? {
        files::write_atomic(path, &bytes).map_err(|error| Stop::unwritable(path, &error))?;
        let sha256 = files::sha256(&bytes);
        talk.event("written", json!({ "format": name.trim_start_matches('-'), "path": path, "sha256": sha256 }));
        talk.say(format!("wrote  {}   sha256 {sha256}", path.display()));
    }
    Ok(())
}

/// A plan that a format cannot hold (`C421`, `C422`).
fn unfit(path: &Path, wrong: &export::ExportError) -> Stop {
    let (expected, fix) = wrong.expected_and_fix();
    Stop::BadInput(
        Diagnostic::new(wrong.code(), Place::file(path), wrong.to_string()).expected(expected).fix(fix).into(),
    )
}

/// The MuJoCo model. Errors: the plan is for another hand (`C408`).
fn mjcf(path: &Path, plan: &Plan, task: Option<&Manipulation>, talk: &Talk) -> Result<Vec<u8>, Stop> {
    let Some(task) = task else {
        return Err(Stop::Internal("a MuJoCo model was asked for without a scene".into()));
    };
    let model = export::to_mjcf(task, plan).map_err(|error| {
        let diagnostic = Diagnostic::new("C408", Place::file(path), error.to_string());
        Stop::BadInput(diagnostic.fix("name the scene that the plan was made for: --scene FILE").into())
    })?;
    for note in &model.notes {
        talk.note(note);
    }
    Ok(model.xml.into_bytes())
}
