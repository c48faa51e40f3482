//! Models from disk, with what the environment says about packages: libraries read no environment.

use crate::args::{Common, Search};
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::base::{Diagnostic, Place};
use regrasp::geometry::Shape;
use regrasp::planners::FailureKind;
use regrasp::robot::Manipulator;
use regrasp::robot::import::{LoadOptions, OUT_OF_TIME, ResolveOptions};
use regrasp::scene::motion::MOTION;
use regrasp::scene::pick_and_place::PICK_AND_PLACE;
use regrasp::scene::query::IN_HAND;
use regrasp::scene::{InputFile, LoadedScene, Task, load_scene};
use regrasp::settings::{Argument, Overrides, SettingsError, read, settings_for};
use regrasp::{Failure, InHandSettings, InputError, PlannerSettings};
use serde_json::json;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How files are read: the packages given, then `ROS_PACKAGE_PATH`, then `AMENT_PREFIX_PATH`.
pub fn options(common: &Common) -> LoadOptions {
    let entries = |value: Option<OsString>| -> Vec<PathBuf> {
        value.map(|value| std::env::split_paths(&value).collect()).unwrap_or_default()
    };
    let mut search_paths = entries(std::env::var_os("ROS_PACKAGE_PATH"));
    search_paths.extend(entries(std::env::var_os("AMENT_PREFIX_PATH")));
    search_paths.retain(|path| !path.as_os_str().is_empty());
    LoadOptions {
        resolve: ResolveOptions { packages: common.packages.clone(), search_paths },
        lenient: common.lenient,
        ..LoadOptions::default()
    }
}

/// Reads a scene and says what was read. Errors: its task is one of a whole robot (`A507`).
pub fn scene(path: &Path, common: &Common, talk: &Talk) -> Result<LoadedScene, Stop> {
    refuse_motion(scene_by(path, common, None, talk)?, path)
}

/// A scene for what deals with one hand and one object. Errors: its task is one of a whole robot (`A507`).
fn refuse_motion(loaded: LoadedScene, path: &Path) -> Result<LoadedScene, Stop> {
    match loaded.task().of_robot {
        None => Ok(loaded),
        Some(_) => {
            let problem = format!("{} asks a whole robot to move", path.display());
            let fix = "name another scene or --task; regrasp plan, check, view and export take tasks of robots";
            Err(Stop::argument("A507", "SCENE", problem, fix))
        }
    }
}

/// The scene file at `path` for a plan of a whole robot that answers the task called `query`. Errors: the task is of another kind
/// (`A507`).
pub fn motion_scene(path: &Path, query: &str, common: &Common) -> Result<LoadedScene, Stop> {
    let loaded = load_scene(path, &options(common))?;
    let loaded = match &common.task {
        Some(name) => choose(loaded, name, path)?,
        None => loaded.for_query(query),
    };
    match loaded.task().of_robot {
        Some(_) => Ok(loaded),
        None => {
            let problem = format!("{} asks for a task of kind \"{}\"", path.display(), loaded.task().kind_name());
            Err(Stop::argument("A507", "SCENE", problem, "a task of a whole robot, as the plan's"))
        }
    }
}

/// As [`scene`], with the task that `plan` answers as its first.
pub fn scene_of_plan(
    path: &Path,
    plan: &regrasp::Plan,
    common: &Common,
    deadline: Option<Instant>,
    talk: &Talk,
) -> Result<LoadedScene, Stop> {
    let started = Instant::now();
    let loaded = load_scene(path, &LoadOptions { deadline, ..options(common) })?;
    refuse_motion(asked_for(loaded, path, &plan.query, started, common, talk)?, path)
}

/// As [`scene`], but reading is given up when `deadline` has passed: there is no plan then.
pub fn scene_by(path: &Path, common: &Common, deadline: Option<Instant>, talk: &Talk) -> Result<LoadedScene, Stop> {
    let started = Instant::now();
    let loaded = load_scene(path, &LoadOptions { deadline, ..options(common) }).map_err(in_time_or_no_plan)?;
    asked_for(loaded, path, "", started, common, talk)
}

/// The scene, read since `started`, with the task that `--task` names, else the one of `plan_query`. Says what was read.
fn asked_for(
    loaded: LoadedScene,
    path: &Path,
    plan_query: &str,
    started: Instant,
    common: &Common,
    talk: &Talk,
) -> Result<LoadedScene, Stop> {
    let loaded = match &common.task {
        Some(name) => choose(loaded, name, path)?,
        None => loaded.for_query(plan_query),
    };
    say_loaded(&loaded, started.elapsed().as_secs_f64(), talk);
    Ok(loaded)
}

/// Says what was read, and what was noted.
pub fn say_loaded(loaded: &LoadedScene, seconds: f64, talk: &Talk) {
    for note in &loaded.notes {
        talk.note(note);
    }
    say_scene(loaded, seconds, talk);
}

/// The scene with the task asked for as its first. Errors: it has none of that name (`A508`).
fn choose(loaded: LoadedScene, name: &str, path: &Path) -> Result<LoadedScene, Stop> {
    let names: Vec<String> = loaded.tasks.iter().map(|task| format!("\"{}\"", task.name)).collect();
    loaded.choosing(name).ok_or_else(|| {
        let problem = format!("{} has no task \"{name}\"", path.display());
        Stop::argument("A508", "--task", problem, format!("one of {}", names.join(", ")))
    })
}

/// Why reading stopped: bad input, or the time limit, within which no plan was found.
fn in_time_or_no_plan(error: InputError) -> Stop {
    match error.diagnostics.iter().find(|diagnostic| diagnostic.code == OUT_OF_TIME) {
        None => Stop::BadInput(error),
        Some(late) => Stop::NoPlan(Box::new(Failure {
            kind: FailureKind::TimeLimit,
            message: format!("{}: {}", late.place, late.problem),
            advice: format!("--time-limit: {}", late.fix),
            causes: Vec::new(),
            leg: None,
            nearest_miss: None,
            robot_miss: None,
            reached: None,
            statistics: Default::default(),
        })),
    }
}

/// Settings of the in-hand planner: defaults, then the settings file, then the flags.
pub fn settings(search: &Search, n_threads: usize) -> Result<InHandSettings, Stop> {
    Ok(merged(IN_HAND, search.settings.as_deref(), &overrides(search, n_threads))?.in_hand)
}

/// Settings for a task of this kind: those of a tracking task are the file's, but for the method (`A507`: a flag that has no meaning
/// there).
pub fn for_task(task: &Task, search: &Search, n_threads: usize) -> Result<PlannerSettings, Stop> {
    merged(task.kind_name(), search.settings.as_deref(), &overrides(search, n_threads))
}

/// Settings for a task of this kind: defaults, then the file.
pub fn settings_in(file: Option<&Path>, task: &Task) -> Result<PlannerSettings, Stop> {
    merged(task.kind_name(), file, &Overrides { n_threads: 1, ..Overrides::default() })
}

/// Settings of the in-hand planner: defaults, then the file, then the margin.
pub fn planner_settings(file: Option<&Path>, margin: Option<f64>, n_threads: usize) -> Result<InHandSettings, Stop> {
    Ok(merged(IN_HAND, file, &Overrides { margin, n_threads, ..Overrides::default() })?.in_hand)
}

fn overrides(search: &Search, n_threads: usize) -> Overrides {
    Overrides {
        method: search.method.clone(),
        margin: search.margin,
        improves_for_a_time: search.improve.is_some(),
        improve_work: search.improve_work,
        n_threads,
    }
}

/// Settings for tasks of a kind. Errors: what keeps them from being some, at its place.
fn merged(kind: &str, file: Option<&Path>, asked: &Overrides) -> Result<PlannerSettings, Stop> {
    let text = file.map(regrasp::base::files::read_text).transpose()?;
    settings_for(kind, text.as_deref(), asked).map_err(|error| match (error, file) {
        (SettingsError::NotForTracking { argument, why }, _) => {
            let flag = match argument {
                Argument::Margin => "--margin",
                Argument::Improve => "--improve",
                Argument::ImproveWork => "--improve-work",
            };
            not_for_tracking(flag, why, "leave it out; --settings has all of tracking (docs/reference/tracking.md)")
        }
        (SettingsError::OtherMethod { name, problem }, _) => other_method(&name, &problem),
        (SettingsError::Unreadable { problem, line, column }, Some(path)) => {
            settings_error(path, line, column, &problem)
        }
        (SettingsError::Invalid(problem), Some(path)) => {
            Stop::BadInput(Diagnostic::new("A503", Place::file(path), problem).into())
        }
        (SettingsError::Invalid(problem) | SettingsError::Unreadable { problem, .. }, None) => {
            Stop::argument("A503", "--margin", problem, "a number in [0, 1)")
        }
    })
}

/// An argument of in-hand tasks, given for a scene with a task of kind `tracking` (`A507`).
fn not_for_tracking(argument: &str, why: &str, fix: &str) -> Stop {
    let problem = format!("is not for a task of kind \"tracking\": {why}");
    let diagnostic = Diagnostic::new("A507", Place::file("command line"), problem).element("argument", argument);
    Stop::BadInput(diagnostic.expected("a task of kind \"in_hand\"").fix(fix).into())
}

/// Reads a scene, as [`scene`], that `what` can do something with in-hand tasks of only (`A507`).
pub fn in_hand_scene(path: &Path, what: &str, common: &Common, talk: &Talk) -> Result<LoadedScene, Stop> {
    let loaded = scene(path, common, talk)?;
    refuse_other_task(&loaded, path, what)?;
    Ok(loaded)
}

/// Refuses a task that is not of a hand with a goal pose (`A507`).
pub fn refuse_other_task(loaded: &LoadedScene, path: &Path, what: &str) -> Result<(), Stop> {
    match loaded.task().kind_name() {
        IN_HAND => Ok(()),
        _ => {
            let why = format!("{what} of in-hand tasks only ({})", path.display());
            Err(not_for_tracking("SCENE", &why, "name another scene; regrasp plan and bench plan this one"))
        }
    }
}

/// Reads a scene for a campaign of mutations: its task is one of a hand with a goal pose, or one of a whole robot (`A507`).
pub fn scene_with_mutants(path: &Path, common: &Common, talk: &Talk) -> Result<LoadedScene, Stop> {
    let loaded = scene_by(path, common, None, talk)?;
    match loaded.task().kind_name() {
        IN_HAND | MOTION | PICK_AND_PLACE => Ok(loaded),
        _ => {
            let why = format!("campaigns make plans of other tasks ({})", path.display());
            Err(not_for_tracking("SCENE", &why, "name another scene; regrasp plan and bench plan this one"))
        }
    }
}

/// A method that does not plan tasks of this kind (`A507`). The argument parser lets only spellings of some planner through; a test
/// holds the lists together.
fn other_method(name: &str, problem: &str) -> Stop {
    let problem = format!("is \"{name}\", which does not plan tasks of this kind: {problem}");
    let diagnostic = Diagnostic::new("A507", Place::file("command line"), problem).element("argument", "--method");
    Stop::BadInput(diagnostic.expected("a method of the scene's task").fix("leave it out, or name one of these").into())
}

/// A JSON file of settings. Errors: as [`regrasp::base::files::read_text`], and not such settings (`A504`).
pub fn settings_file<T: Default + serde::de::DeserializeOwned>(path: &Path) -> Result<T, Stop> {
    let text = regrasp::base::files::read_text(path)?;
    read(Some(&text)).map_err(|error| match error {
        SettingsError::Unreadable { problem, line, column } => settings_error(path, line, column, &problem),
        other => unreachable!("{other:?} where a text is read only"),
    })
}

fn settings_error(path: &Path, line: usize, column: usize, problem: &str) -> Stop {
    let place = Place { file: path.to_owned(), line: Some(line as u32), column: Some(column as u32) };
    let diagnostic = Diagnostic::new("A504", place, problem);
    Stop::BadInput(diagnostic.expected("a JSON object like \"settings\" in a plan file").into())
}

/// Says what a scene in which a robot moves is made of.
fn say_motion_scene(loaded: &LoadedScene, robot: &Manipulator, seconds: f64, talk: &Talk) {
    let scene = &loaded.scene;
    talk.say(format!(
        "robot  {}   {}   {}, {}   loaded in {}",
        robot.name,
        counted(robot.layout.len(), "joint"),
        counted(robot.arms.len(), "arm"),
        counted(robot.hands.len(), "hand"),
        duration(seconds),
    ));
    let around =
        [(scene.objects.len(), "object"), (scene.supports.len(), "support"), (scene.obstacles.len(), "obstacle")];
    let around: Vec<String> = around.iter().filter(|(n, _)| *n > 0).map(|&(n, what)| counted(n, what)).collect();
    if !around.is_empty() {
        talk.say(format!("world  {}", around.join(", ")));
    }
    if loaded.tasks.len() > 1 {
        talk.say(format!("task   \"{}\", one of {}", loaded.task().name, loaded.tasks.len()));
    }
    talk.event(
        "loaded",
        json!({
            "scene": scene.name,
            "robot": robot.name,
            "joints": robot.layout.names(),
            "obstacles": scene.obstacles.len(),
            "task": loaded.task().name,
            "tasks": loaded.tasks.iter().map(|task| task.name.as_str()).collect::<Vec<_>>(),
            "hands": scene.hands.iter().map(|hand| hand.name.as_str()).collect::<Vec<_>>(),
            "objects": scene.objects.iter().map(|object| object.name.as_str()).collect::<Vec<_>>(),
            "supports": scene.supports.iter().map(|support| support.body.name.as_str()).collect::<Vec<_>>(),
            "seconds": seconds,
            "inputs": inputs(loaded),
        }),
    );
}

/// The files that were read, for an event.
fn inputs(loaded: &LoadedScene) -> Vec<serde_json::Value> {
    let input = |input: &InputFile| json!({ "role": input.role, "name": input.name, "path": input.path, "sha256": input.sha256 });
    loaded.scene.inputs.iter().map(input).collect()
}

/// Says what a scene is made of.
fn say_scene(loaded: &LoadedScene, seconds: f64, talk: &Talk) {
    if let Some(robot) = loaded.task().of_robot.as_ref().and_then(|query| query.robot()) {
        return say_motion_scene(loaded, &loaded.scene.robots[robot], seconds, talk);
    }
    let (scene, task) = (&loaded.scene, loaded.manipulation());
    let hand = task.hand();
    let n_mimic = hand.robot.joints.iter().filter(|joint| joint.coupling.is_some()).count();
    let n_shapes = hand.palm.len() + hand.fingers.iter().map(|finger| finger.shapes.len()).sum::<usize>();
    talk.say(format!(
        "hand   {}   {} ({n_mimic} mimic)   {}   {}   loaded in {}",
        hand.robot.name,
        counted(hand.n_joints(), "joint"),
        counted(hand.fingers.len(), "finger"),
        counted(n_shapes, "collision shape"),
        duration(seconds),
    ));
    let object = task.object();
    talk.say(format!(
        "object {}   {}   {:.3} kg   friction {}",
        object.name,
        shape_text(&object.shape) + if object.hull.is_some() { ", its hull for collision" } else { "" },
        object.mass,
        object.friction
    ));
    let others = [
        (scene.hands.len() - 1, "other hand"),
        (scene.objects.len() - 1, "other object"),
        (scene.supports.len(), "support"),
        (scene.obstacles.len(), "obstacle"),
    ];
    let others: Vec<String> = others.iter().filter(|(n, _)| *n > 0).map(|&(n, what)| counted(n, what)).collect();
    if !others.is_empty() {
        talk.say(format!("world  {}", others.join(", ")));
    }
    if loaded.tasks.len() > 1 {
        talk.say(format!("task   \"{}\", one of {}", loaded.task().name, loaded.tasks.len()));
    }
    talk.event(
        "loaded",
        json!({
            "scene": scene.name,
            "hand": hand.robot.name,
            "joints": hand.joint_names(),
            "fingers": hand.fingers.iter().map(|finger| finger.name.as_str()).collect::<Vec<_>>(),
            "object": object.name,
            "shape": object.shape.kind(),
            "obstacles": scene.obstacles.len(),
            "task": loaded.task().name,
            "tasks": loaded.tasks.iter().map(|task| task.name.as_str()).collect::<Vec<_>>(),
            "hands": scene.hands.iter().map(|hand| hand.name.as_str()).collect::<Vec<_>>(),
            "objects": scene.objects.iter().map(|object| object.name.as_str()).collect::<Vec<_>>(),
            "supports": scene.supports.iter().map(|support| support.body.name.as_str()).collect::<Vec<_>>(),
            "seconds": seconds,
            "inputs": inputs(loaded),
        }),
    );
}

/// A shape in words, with its size in centimetres.
pub fn shape_text(shape: &Shape) -> String {
    let cm = |length: f64| format!("{:.1}", 100.0 * length);
    match shape {
        Shape::Sphere { radius } => format!("sphere, diameter {} cm", cm(2.0 * radius)),
        Shape::Capsule { half_length, radius } => {
            format!("capsule, {} cm long, diameter {} cm", cm(2.0 * (half_length + radius)), cm(2.0 * radius))
        }
        Shape::Cuboid { half_extents: h } => {
            format!("box, {} x {} x {} cm", cm(2.0 * h.x), cm(2.0 * h.y), cm(2.0 * h.z))
        }
        Shape::Cylinder { half_length, radius } => {
            format!("cylinder, {} cm high, diameter {} cm", cm(2.0 * half_length), cm(2.0 * radius))
        }
        Shape::Ellipsoid { radii: r } => {
            format!("ellipsoid, {} x {} x {} cm", cm(2.0 * r.x), cm(2.0 * r.y), cm(2.0 * r.z))
        }
        Shape::Convex(hull) => format!("convex, {}", counted(hull.vertices().len(), "corner")),
        Shape::Mesh(mesh) => {
            let (low, high) = mesh.bounds();
            let size = high - low;
            format!(
                "{} triangles, {}, {} x {} x {} cm",
                grouped(mesh.triangles().len() as u64),
                if mesh.statistics().is_watertight() { "watertight" } else { "not watertight" },
                cm(size.x),
                cm(size.y),
                cm(size.z)
            )
        }
    }
}

/// Scene files named directly, and those in folders named (`*.toml` directly inside, by name).
pub fn scene_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Stop> {
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            found.push(path.clone());
            continue;
        }
        let entries = std::fs::read_dir(path)
            .and_then(|entries| entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>());
        let mut inside = match entries {
            Ok(inside) => inside,
            Err(error) => {
                return Err(Stop::argument("A501", "SCENE", format!("{}: {error}", path.display()), "a folder"));
            }
        };
        inside.retain(|file| file.is_file() && file.extension().is_some_and(|extension| extension == "toml"));
        inside.sort();
        if inside.is_empty() {
            let problem = format!("{} holds no scene files", path.display());
            return Err(Stop::argument("A502", "SCENE", problem, "a folder with *.toml in it"));
        }
        found.extend(inside);
    }
    Ok(found)
}
