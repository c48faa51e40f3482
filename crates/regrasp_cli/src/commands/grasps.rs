//! `regrasp grasps`: find grasps of an object, check them, then write the list.

use crate::args::{self, Common};
use crate::commands::written::available_threads;
use crate::commands::{grasp_files, grasp_import, pair};
use crate::interrupt;
use crate::judge_grasps;
use crate::load;
use crate::outputs::{Output, Outputs};
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::base::files;
use regrasp::grasp::GraspList;
use regrasp::grasp::list::{GraspKind, format};
use regrasp::grasp::record::PlanInput;
use regrasp::grasp_lists::{GraspSettings, Progress, list_grasps_telling};
use regrasp::plan::check::grasps::source_of;
use regrasp::robot::ContactModel;
use regrasp::robot::import::LoadOptions;
use regrasp::scene::{GraspScene, MeshObject, ObjectSource, load_grasp_scene};
use regrasp::{Budget, planners::FailureKind};
use serde_json::json;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Mass and friction of a mesh of which nobody says any.
const USUAL: [f64; 2] = [0.1, 0.8];

/// Loads, searches, judges, writes.
pub fn run(arguments: &args::Grasps, common: &Common, talk: &Talk) -> Result<(), Stop> {
    if arguments.pair {
        return pair::run(arguments, common, talk);
    }
    if arguments.import.is_some() {
        grasp_import::refuse_flags(arguments)?;
    }
    let outputs = arguments.output.iter().map(|path| Output::new("--output", path));
    let pages = arguments.report.iter().map(|path| Output::new("--report", path));
    let written = Outputs::new(outputs.chain(pages))?;
    let cancelled = interrupt::patient_flag()?;
    let deadline = arguments.time_limit.and_then(|limit| Instant::now().checked_add(limit));
    let settings = settings(arguments)?;
    let source = source(arguments)?;
    let options = options(arguments, common);
    let started = Instant::now();
    let scene = load_grasp_scene(&arguments.hand, &source, &LoadOptions { deadline, ..options.clone() })?;
    let read = scene.scene.inputs.iter().map(|input| input.path.as_path());
    written.refuse_inputs(read.chain(arguments.settings.as_deref()).chain(arguments.import.as_deref()))?;
    say_scene(&scene, started.elapsed().as_secs_f64(), talk);

    let budget = Budget { deadline, cancelled: Arc::clone(&cancelled), ..Budget::work(arguments.max_work) };
    let list = match &arguments.import {
        Some(path) => grasp_import::import(path, &scene, &settings, talk)?,
        None => search(&scene, &settings, arguments.seed, &budget, talk)?,
    };
    let list = GraspList {
        source: Some(source_of(&arguments.hand, &source, arguments.torsion_radius)),
        inputs: scene.scene.inputs.iter().map(input).collect(),
        ..list
    };
    // Judged is what will be written, in a scene read afresh: the checker starts from files.
    let afresh = load_grasp_scene(&arguments.hand, &source, &options)?;
    let (list, report) = judge_grasps::accepted(list, &afresh, settings.n_threads, talk)?;
    if let Some(path) = &arguments.report {
        grasp_files::write_gallery(path, &afresh, &list, &report, talk)?;
    }
    write(&list, arguments.output.as_deref(), talk)?;
    if is_set(&cancelled) { Err(Stop::Interrupted) } else { Ok(()) }
}

fn is_set(flag: &AtomicBool) -> bool {
    flag.load(std::sync::atomic::Ordering::Relaxed)
}

fn input(input: &regrasp::scene::scene::InputFile) -> PlanInput {
    PlanInput { role: input.role.clone(), name: input.name.clone(), sha256: input.sha256.clone() }
}

/// Defaults, then the settings file, then the flags.
fn settings(arguments: &args::Grasps) -> Result<GraspSettings, Stop> {
    let mut settings = match &arguments.settings {
        Some(path) => load::settings_file::<GraspSettings>(path)?,
        None => GraspSettings::default(),
    };
    if let Some(kind) = arguments.kind.as_deref() {
        settings.kind = GraspKind::ALL.into_iter().find(|known| known.name() == kind).unwrap_or(settings.kind);
    }
    settings.grasps = arguments.grasps.map_or(settings.grasps, |n| usize::try_from(n).unwrap_or(usize::MAX));
    settings.frames = arguments.frames.unwrap_or(settings.frames);
    settings.margin = arguments.margin.unwrap_or(settings.margin);
    settings.friction_margin = arguments.friction_margin.unwrap_or(settings.friction_margin);
    settings.n_threads = arguments.threads.unwrap_or_else(available_threads);
    settings.validate().map_err(|problem| {
        let place = arguments.settings.as_deref().unwrap_or(Path::new("command line"));
        Stop::BadInput(regrasp::base::Diagnostic::new("A503", regrasp::base::Place::file(place), problem).into())
    })?;
    Ok(settings)
}

/// How files are read.
fn options(arguments: &args::Grasps, common: &Common) -> LoadOptions {
    let options = load::options(common);
    let contact = arguments
        .torsion_radius
        .filter(|radius| *radius > 0.0)
        .map_or(options.contact, |torsion_radius| ContactModel::SoftFinger { torsion_radius });
    LoadOptions { contact, ..options }
}

/// The object. Errors: a flag of meshes beside a scene file (`A511`).
fn source(arguments: &args::Grasps) -> Result<ObjectSource, Stop> {
    let path = arguments.object.clone();
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Ok(ObjectSource::Mesh(MeshObject {
            path,
            scale: arguments.scale.unwrap_or(1.0),
            mass: arguments.mass.unwrap_or(USUAL[0]),
            friction: arguments.friction.unwrap_or(USUAL[1]),
            edge_distance: arguments.edge_distance,
            crease_angle_deg: arguments.crease_angle,
        }));
    }
    let flags = [
        ("--mass", arguments.mass),
        ("--friction", arguments.friction),
        ("--scale", arguments.scale),
        ("--edge-distance", arguments.edge_distance),
        ("--crease-angle", arguments.crease_angle),
    ];
    match flags.into_iter().find(|(_, value)| value.is_some()) {
        Some((flag, _)) => {
            let problem = format!("stands beside the scene file {}, which says it itself", path.display());
            Err(Stop::argument("A511", flag, problem, "a mesh, or no such flag"))
        }
        None => Ok(ObjectSource::Scene(path)),
    }
}

fn say_scene(scene: &GraspScene, seconds: f64, talk: &Talk) {
    for note in &scene.notes {
        talk.note(note);
    }
    let task = scene.manipulation();
    let (hand, object) = (task.hand(), task.object());
    talk.say(format!(
        "hand   {}   {}   {}   loaded in {}",
        hand.robot.name,
        counted(hand.n_joints(), "joint"),
        counted(hand.fingers.len(), "finger"),
        duration(seconds)
    ));
    talk.say(format!(
        "object {}   {}   {:.3} kg   friction {}",
        object.name,
        load::shape_text(&object.shape),
        object.mass,
        object.friction
    ));
    talk.event(
        "loaded",
        json!({
            "hand": hand.robot.name,
            "fingers": hand.fingers.iter().map(|finger| finger.name.as_str()).collect::<Vec<_>>(),
            "object": object.name,
            "seconds": seconds,
        }),
    );
}

fn search(
    scene: &GraspScene,
    settings: &GraspSettings,
    seed: u64,
    budget: &Budget,
    talk: &Talk,
) -> Result<GraspList, Stop> {
    let started = Instant::now();
    let last = std::sync::Mutex::new(started);
    let report = |progress: Progress| {
        let Ok(mut last) = last.lock() else { return };
        let interval = if talk.is_watched() { 0.5 } else { 5.0 };
        if last.elapsed().as_secs_f64() < interval {
            return;
        }
        *last = Instant::now();
        let elapsed = started.elapsed().as_secs_f64();
        talk.say(format!("{elapsed:>5.1} s   {} frames, {} grasps", grouped(progress.frames), grouped(progress.found)));
        talk.event("progress", json!({ "elapsed": elapsed, "frames": progress.frames, "found": progress.found }));
    };
    let (hand, object) = (&scene.scene.hands[0].hand, &scene.scene.objects[0]);
    let list =
        list_grasps_telling(hand, object, settings, seed, budget, &report).map_err(|failure| match failure.kind {
            FailureKind::Interrupted => Stop::Interrupted,
            _ => Stop::NoGrasp(Box::new(failure)),
        })?;
    let seconds = started.elapsed().as_secs_f64();
    let statistics = &list.statistics;
    talk.say(format!(
        "grasps {} of {} found in {} of {} frames{}   {}",
        grouped(list.grasps.len() as u64),
        grouped(statistics.found),
        grouped(statistics.frames_tried),
        grouped(statistics.frames),
        if statistics.cut_by_time { ", cut short" } else { "" },
        duration(seconds)
    ));
    talk.event("grasps", json!({ "seconds": seconds, "grasps": list.grasps.len(), "statistics": statistics }));
    Ok(list)
}

fn write(list: &GraspList, output: Option<&Path>, talk: &Talk) -> Result<(), Stop> {
    let bytes = format::to_json(list);
    let sha256 = files::sha256(bytes.as_bytes());
    let Some(path) = output else {
        if talk.is_json() {
            let as_in_file: serde_json::Value = serde_json::from_str(&bytes).unwrap_or_default();
            talk.event("written", json!({ "sha256": sha256, "list": as_in_file }));
        } else {
            talk.data(&bytes);
        }
        return Ok(());
    };
    files::write_atomic(path, bytes.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
    talk.event("written", json!({ "path": path, "sha256": sha256 }));
    talk.say(format!("wrote  {}   sha256 {sha256}", path.display()));
    Ok(())
}
