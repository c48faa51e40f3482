//! `regrasp export`: a plan in the formats of other tools.
//!
//! What is exported may be sent to a robot: a plan that the checker rejects is refused, unless `--no-check` is given.

use crate::args::{self, Common};
use crate::commands::check::scene_of;
use crate::commands::plan::{refuse_input, refuse_unwritable};
use crate::interrupt;
use crate::judge;
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::{Diagnostic, Place, files};
use regrasp::export;
use regrasp::plan::format;
use regrasp::{Plan, Scene};
use serde_json::json;
use std::path::Path;

/// How a plan becomes the bytes of a file; the scene is there for formats that need it, and where the plan is judged.
type Write = fn(&Plan, Option<&Scene>, &Talk) -> Result<Vec<u8>, Stop>;

/// Reads, judges, writes.
pub fn run(arguments: &args::Export, common: &Common, talk: &Talk) -> Result<(), Stop> {
    // The flag is not asked here: the process ends by itself shortly after Ctrl-C.
    interrupt::flag()?;
    let formats: [(&str, Option<&Path>, Write); 3] = [
        ("npz", arguments.npz.as_deref(), |plan, _, _| Ok(export::to_npz(plan))),
        ("ros2", arguments.ros2.as_deref(), |plan, _, _| Ok(export::to_ros2(plan).into_bytes())),
        ("mjcf", arguments.mjcf.as_deref(), mjcf),
    ];
    let wanted: Vec<(&str, &Path, Write)> =
        formats.into_iter().filter_map(|(name, path, write)| Some((name, path?, write))).collect();
    for (k, &(name, path, _)) in wanted.iter().enumerate() {
        refuse_unwritable(path)?;
        refuse_input(path, [arguments.plan.as_path()].into_iter().chain(arguments.scene.as_deref()))?;
        if wanted[..k].iter().any(|&(_, other, _)| other == path) {
            let problem = format!("is {}, which another format is written to", path.display());
            return Err(Stop::argument("A505", &format!("--{name}"), problem, "one file for each format"));
        }
    }
    let plan = format::from_json(&arguments.plan, &files::read(&arguments.plan)?)?;
    let mut scene = None;
    if !arguments.no_check || arguments.mjcf.is_some() {
        let scene_path = scene_of(&arguments.plan, &plan, arguments.scene.as_deref())?;
        let loaded = arguments.judging.scene(load::scene(&scene_path, common, talk)?);
        for &(_, path, _) in &wanted {
            refuse_input(path, loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
        }
        if !arguments.no_check && !judge::judge(&loaded, &plan, &arguments.judging, talk)?.accepted() {
            return Err(Stop::Rejected);
        }
        scene = Some(loaded.scene);
    }
    for (name, path, write) in wanted {
        let bytes = write(&plan, scene.as_ref(), talk)?;
        files::write_atomic(path, &bytes).map_err(|error| Stop::unwritable(path, &error))?;
        let sha256 = files::sha256(&bytes);
        talk.event("written", json!({ "format": name, "path": path, "sha256": sha256 }));
        talk.say(format!("wrote  {}   sha256 {sha256}", path.display()));
    }
    Ok(())
}

/// The MuJoCo model. Errors: the plan is for another hand (`C408`).
fn mjcf(plan: &Plan, scene: Option<&Scene>, talk: &Talk) -> Result<Vec<u8>, Stop> {
    let Some(scene) = scene else {
        return Err(Stop::Internal("a MuJoCo model was asked for without a scene".into()));
    };
    let model = export::to_mjcf(scene, plan).map_err(|error| {
        let diagnostic = Diagnostic::new("C408", Place::file("plan"), error.to_string());
        Stop::BadInput(diagnostic.fix("name the scene that the plan was made for: --scene FILE").into())
    })?;
    for note in &model.notes {
        talk.note(note);
    }
    Ok(model.xml.into_bytes())
}
