//! Grasp lists in the formats of other tools, and their gallery.

use crate::args::{self, Common};
use crate::commands::check::grasp_scene;
use crate::commands::written::available_threads;
use crate::judge_grasps;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::{Diagnostic, Place, files};
use regrasp::export::grasps::{to_isaac, to_mjcf, to_moveit, to_npz};
use regrasp::grasp::GraspList;
use regrasp::grasp::list::format::from_json;
use regrasp::plan::check::GraspReport;
use regrasp::scene::GraspScene;
use regrasp::viewer::gallery::{self, SheetSettings};
use regrasp::viewer::storyboard::StoryboardSettings;
use serde_json::json;
use std::path::Path;

/// Judges a list, then writes it in the formats asked for.
pub fn export(arguments: &args::Export, bytes: &[u8], common: &Common, talk: &Talk) -> Result<(), Stop> {
    let path = &arguments.plan;
    for (flag, asked) in [("--ros2", &arguments.ros2), ("--scene", &arguments.scene)] {
        refuse(flag, asked.as_deref(), path)?;
    }
    let list = from_json(path, bytes)?;
    let scene = match arguments.no_check {
        true => None,
        false => {
            let (scene, report) = judged(path, &list, common, talk)?;
            if !report.accepted() {
                return Err(Stop::Rejected);
            }
            Some(scene)
        }
    };
    let mut made: Vec<(&str, &Path, Vec<u8>)> = Vec::new();
    if let Some(to) = &arguments.isaac {
        made.push(("isaac", to, to_isaac(&list).into_bytes()));
    }
    if let Some(to) = &arguments.moveit {
        made.push(("moveit", to, to_moveit(&list).into_bytes()));
    }
    if let Some(to) = &arguments.npz {
        let arrays = to_npz(&list).map_err(|wrong| {
            let (expected, fix) = wrong.expected_and_fix();
            let diagnostic = Diagnostic::new(wrong.code(), Place::file(path), wrong.to_string());
            Stop::BadInput(diagnostic.expected(expected).fix(fix).into())
        })?;
        made.push(("npz", to, arrays));
    }
    if let Some(to) = &arguments.mjcf {
        let scene = scene.map_or_else(|| grasp_scene(path, &list, [&None, &None], common), Ok)?;
        let model = to_mjcf(&scene, &list).map_err(|wrong| Stop::Internal(wrong.to_string()))?;
        model.notes.iter().for_each(|note| talk.note(note));
        made.push(("mjcf", to, model.xml.into_bytes()));
    }
    // All are made before any is written.
    made.into_iter().try_for_each(|(name, to, bytes)| write(name, to, &bytes, talk))
}

/// Judges a list, then writes its gallery and the picture; one that is rejected gets its page too: it says so.
pub fn view(arguments: &args::View, bytes: &[u8], common: &Common, talk: &Talk) -> Result<(), Stop> {
    let path = &arguments.plan;
    let pictures = [("--story", &arguments.story), ("--svg", &arguments.svg)];
    for (flag, asked) in pictures.into_iter().chain([("--with-roadmap", &arguments.with_roadmap)]) {
        refuse(flag, asked.as_deref(), path)?;
    }
    refuse("SCENE", arguments.scene.as_deref(), path)?;
    let list = from_json(path, bytes)?;
    let (scene, report) = judged(path, &list, common, talk)?;
    if let Some(to) = &arguments.png {
        let settings = SheetSettings {
            grasps: arguments.frames,
            width: arguments.width,
            columns: arguments.columns,
            supersampling: StoryboardSettings::default().supersampling,
        };
        let picture = gallery::png(&scene, &list, &settings);
        let refused = |problem| Stop::argument("A505", "--png", problem, "a picture that fits");
        write("png", to, &picture.map_err(refused)?, talk)?;
    }
    match &arguments.output {
        Some(to) => write_gallery(to, &scene, &list, &report, talk),
        None => Ok(()),
    }
}

/// Writes the gallery of a list.
pub fn write_gallery(
    path: &Path,
    scene: &GraspScene,
    list: &GraspList,
    report: &GraspReport,
    talk: &Talk,
) -> Result<(), Stop> {
    write("page", path, gallery::html(scene, list, report).as_bytes(), talk)
}

/// Hand and object of a list, and what the checker says of it.
fn judged(path: &Path, list: &GraspList, common: &Common, talk: &Talk) -> Result<(GraspScene, GraspReport), Stop> {
    let scene = grasp_scene(path, list, [&None, &None], common)?;
    let report = judge_grasps::judge(&scene, list, available_threads(), talk);
    Ok((scene, report))
}

/// Refuses an argument that means nothing for grasp lists (`A512`).
fn refuse(flag: &str, asked: Option<&Path>, list: &Path) -> Result<(), Stop> {
    match asked {
        None => Ok(()),
        Some(_) => {
            let problem = format!("is for plans; {} is a grasp list", list.display());
            Err(Stop::argument(
                "A512",
                flag,
                problem,
                "-o and --png of view; --isaac, --moveit, --npz or --mjcf of export",
            ))
        }
    }
}

fn write(format: &str, path: &Path, bytes: &[u8], talk: &Talk) -> Result<(), Stop> {
    files::write_atomic(path, bytes).map_err(|error| Stop::unwritable(path, &error))?;
    let sha256 = files::sha256(bytes);
    talk.event("written", json!({ "format": format, "path": path, "sha256": sha256 }));
    talk.say(format!("wrote  {}   sha256 {sha256}", path.display()));
    Ok(())
}
