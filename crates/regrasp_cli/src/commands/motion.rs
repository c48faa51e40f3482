//! Motions of whole robots: what the commands `plan`, `check` and `export` do with tasks of kind `motion` and their plans.

use crate::args::{self, Common};
use crate::commands::robot_roadmap::Grown;
use crate::commands::written::{self, Limits, available_threads};
use crate::commands::{pictures, robot_roadmap, task_grasps};
use crate::judge;
use crate::load;
use crate::outputs::Outputs;
use crate::pages;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::base::{Diagnostic, Place, files};
use regrasp::geometry::frame::rotation_between;
use regrasp::plan::check::{Report, RobotAlong, find_scene_among, robot_along};
use regrasp::plan::format;
use regrasp::planners::FailureKind;
use regrasp::robot_roadmap::{Asked, RobotAnswer};
use regrasp::scene::{LoadedScene, MotionGoal, MotionQuery, PickAndPlaceQuery};
use regrasp::viewer::render::png_file;
use regrasp::viewer::robots::{RobotStoryboard, RobotTelling, robot_charts, robot_page, robot_storyboard};
use regrasp::{AnyPlan, Budget, Query, RobotPlan, export, plan_any, plan_task};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Plans the motion of the first task, judges it and writes it; a page and pictures of a failure where they are asked for.
pub fn plan(
    arguments: &args::Plan,
    common: &Common,
    loaded: &LoadedScene,
    query: &Query,
    limits: &Limits,
    talk: &Talk,
) -> Result<(), Stop> {
    refuse_in_hand_arguments(arguments)?;
    say_query(loaded, query, arguments.seed, talk);
    let found = search(arguments, common, loaded, query, limits, talk);
    if let Err(Stop::NoRobotPlan(failure) | Stop::NoGrasp(failure)) = &found {
        let asked = (arguments.failure.as_deref(), arguments.report.as_deref());
        pictures::write_robot_failure(asked, loaded, query, failure, talk)?;
    }
    let (plan, grown) = found?;
    write(&plan, arguments, &arguments.judging.after_search(limits.time_limit), common, talk)?;
    grown.map_or(Ok(()), |grown| grown.save(talk))
}

/// The plan, with what is said of it, and the roadmap that grew by it where that is asked for.
fn search(
    arguments: &args::Plan,
    common: &Common,
    loaded: &LoadedScene,
    query: &Query,
    limits: &Limits,
    talk: &Talk,
) -> Result<(RobotPlan, Option<Grown>), Stop> {
    let started = Instant::now();
    let budget = Budget {
        max_work: limits.max_work,
        deadline: limits.time_limit.map(|limit| started + limit),
        improve_for: limits.improve_for,
        cancelled: Arc::clone(&limits.cancelled),
    };
    let around = (&loaded.scene, &loaded.state);
    let settings = load::for_task(loaded.task(), &arguments.search, available_threads())?;
    let lists = match query {
        Query::PickAndPlace(query) => {
            task_grasps::lists(&arguments.scene, (loaded, query), arguments.seed, limits, common, talk)?
        }
        _ => Vec::new(),
    };
    let asked = Asked { scene: &loaded.scene, state: &loaded.state, query, lists: &lists };
    let with = (&asked, &settings);
    let roadmap = robot_roadmap::find(&arguments.scene, arguments.roadmap.as_deref(), with, talk)?;
    if arguments.grow && roadmap.is_none() {
        let problem = "has no roadmap to add to";
        return Err(Stop::argument("A507", "--grow", problem, "--roadmap FILE, of `regrasp roadmap build`"));
    }
    // Lists and roadmaps are no part of the search.
    let started = Instant::now();
    let budget = Budget { deadline: limits.time_limit.map(|limit| started + limit), ..budget };
    let any = |plan: RobotPlan| AnyPlan::Robot(Box::new(plan));
    let mut answer: Option<RobotAnswer> = None;
    let found = match (&roadmap, query) {
        (Some((_, roadmap)), _) => roadmap
            .plan(&asked, &settings, arguments.seed, &budget)
            .map(|found| any(answer.insert(found).plan().clone())),
        (None, Query::PickAndPlace(query)) => {
            plan_task(around, query, &lists, &settings, arguments.seed, &budget).map(any)
        }
        (None, _) => plan_any(around, query, &settings, arguments.seed, &budget, &|_| {}),
    };
    let plan = match found {
        Ok(AnyPlan::Robot(plan)) => plan,
        Ok(AnyPlan::InHand(_)) => return Err(Stop::Internal("a motion was answered by a plan of one hand".into())),
        Err(failure) if failure.kind == FailureKind::Interrupted => return Err(Stop::Interrupted),
        Err(failure) => return Err(Stop::NoRobotPlan(Box::new(failure))),
    };
    let seconds = started.elapsed().as_secs_f64();
    talk.say(format!(
        "plan   {}, {} waypoints, {:.2} s of motion   {}",
        counted(plan.segments.len(), "segment"),
        grouped(plan.waypoints().count() as u64),
        plan.duration(),
        duration(seconds),
    ));
    talk.event("plan", json!({ "seconds": seconds, "statistics": plan.statistics, "duration": plan.duration() }));
    let grown = match (roadmap, answer) {
        (Some(known), Some(answer)) if arguments.grow => Some(Grown::by(known, with, &answer)?),
        _ => None,
    };
    Ok((*plan, grown))
}

/// Arguments that have no meaning for a robot that moves (`A507`).
fn refuse_in_hand_arguments(arguments: &args::Plan) -> Result<(), Stop> {
    let given = [
        ("--margin", arguments.search.margin.is_some()),
        ("--improve", arguments.search.improve.is_some()),
        ("--improve-work", arguments.search.improve_work.is_some()),
        ("--hold", arguments.judging.hold),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) => {
            Err(Stop::argument("A507", flag, "is not for a task of a whole robot", "a task of kind \"in_hand\""))
        }
        None => Ok(()),
    }
}

/// Judges what will be written, in a scene read afresh; writes it where it is accepted.
fn write(
    plan: &RobotPlan,
    arguments: &args::Plan,
    judging: &args::Judging,
    common: &Common,
    talk: &Talk,
) -> Result<(), Stop> {
    let bytes = format::robot_to_json(plan);
    let output = arguments.output.as_deref();
    let plan_path = output.unwrap_or(Path::new("plan.json"));
    let read = format::robot_from_json(plan_path, bytes.as_bytes())
        .map_err(|error| Stop::Internal(format!("a plan just made is not a plan file: {error}")))?;
    let again = load::motion_scene(&arguments.scene, &read.query, common)?;
    let again = judging.scene(again);
    let report = judge::judge_robot(&again, &read, judging, talk);
    if let Some(page) = &arguments.report {
        let problem = |problem: String| Stop::Internal(format!("a plan just made cannot be drawn: {problem}"));
        let along = robot_along((&again.scene, &again.state), &read, MOMENTS).map_err(problem)?;
        let html = robot_page(&telling((&again, &read), (&report, &along), None), &RobotStoryboard::default());
        pages::write_html(page, &html.map_err(problem)?, talk)?;
    }
    if !report.accepted() {
        return Err(written::rejected(output, &bytes, talk));
    }
    written::write(output, &bytes, talk)
}

/// Says what is asked.
fn say_query(loaded: &LoadedScene, query: &Query, seed: u64, talk: &Talk) {
    match query {
        Query::Motion(query) => say_motion(loaded, query, seed, talk),
        Query::PickAndPlace(query) => say_pick_and_place(loaded, query, seed, talk),
        Query::InHand(_) | Query::Tracking(_) => {}
    }
}

fn say_pick_and_place(loaded: &LoadedScene, query: &PickAndPlaceQuery, seed: u64, talk: &Talk) {
    let (robot, object) = (&loaded.scene.robots[query.robot], &loaded.scene.objects[query.object]);
    let way = query.world_from_object_goal.translation.vector - query.world_from_object_start.translation.vector;
    let turn = rotation_between(&query.world_from_object_start, &query.world_from_object_goal).norm();
    talk.say(format!(
        "query  robot \"{}\" brings \"{}\" {:.2} m away, turned by {:.0} deg, seed {seed}, {}",
        robot.name,
        object.name,
        way.norm(),
        turn.to_degrees(),
        counted(available_threads(), "thread")
    ));
    talk.event("query", json!({ "robot": robot.name, "object": object.name, "seed": seed }));
}

fn say_motion(loaded: &LoadedScene, query: &MotionQuery, seed: u64, talk: &Talk) {
    let robot = &loaded.scene.robots[query.robot];
    let goal = match &query.goal {
        MotionGoal::Joints(joints) => {
            let way = joints.iter().zip(&query.start).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            format!("to joints {way:.2} rad away")
        }
        MotionGoal::Wrists(wrists) => {
            let names: Vec<&str> = wrists.iter().map(|wrist| robot.arms[wrist.arm].name.as_str()).collect();
            format!("to poses of {} ({})", counted(wrists.len(), "wrist"), names.join(", "))
        }
    };
    let carried = match query.carried.len() {
        0 => String::new(),
        n => format!(", carrying {}", counted(n, "object")),
    };
    talk.say(format!(
        "query  robot \"{}\" goes {goal}{carried}, seed {seed}, {}",
        robot.name,
        counted(available_threads(), "thread")
    ));
    talk.event("query", json!({ "robot": robot.name, "carried": query.carried.len(), "seed": seed }));
}

/// The scene of a plan of a whole robot, with the task that the plan answers as its first.
pub fn scene_of(
    plan_path: &Path,
    plan: &RobotPlan,
    named: Option<&Path>,
    common: &Common,
) -> Result<LoadedScene, Stop> {
    let path: PathBuf = match named {
        Some(path) => path.to_owned(),
        None => find_scene_among(plan_path, &plan.inputs, std::env::current_dir().ok().as_deref())?,
    };
    load::motion_scene(&path, &plan.query, common)
}

/// `regrasp check` of such a plan.
pub fn check(
    arguments: &args::Check,
    judging: &args::Judging,
    bytes: &[u8],
    common: &Common,
    talk: &Talk,
) -> Result<(), Stop> {
    let plan = format::robot_from_json(&arguments.plan, bytes)?;
    let loaded = scene_of(&arguments.plan, &plan, arguments.scene.as_deref(), common)?;
    load::say_loaded(&loaded, 0.0, talk);
    let report = judge::judge_robot(&judging.scene(loaded), &plan, judging, talk);
    if report.accepted() { Ok(()) } else { Err(Stop::Rejected) }
}

fn telling<'a>(
    (loaded, plan): (&'a LoadedScene, &'a RobotPlan),
    (report, along): (&'a Report, &'a RobotAlong),
    title: Option<&'a str>,
) -> RobotTelling<'a> {
    RobotTelling { scene: &loaded.scene, state: &loaded.state, plan, report, along, title }
}

/// Moments of the chart of clearance.
const MOMENTS: usize = 400;

/// `regrasp view` of such a plan.
pub fn view(arguments: &args::View, bytes: &[u8], written: &Outputs, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let given = [
        ("--story", arguments.story.is_some()),
        ("--with-roadmap", arguments.with_roadmap.is_some()),
        ("--collision", arguments.collision),
    ];
    if let Some((flag, _)) = given.into_iter().find(|(_, is_given)| *is_given) {
        let problem = format!("is not for plans of whole robots, and {} is one", arguments.plan.display());
        return Err(Stop::argument("A507", flag, problem, "--output, --png or --svg"));
    }
    let plan = format::robot_from_json(&arguments.plan, bytes)?;
    let loaded = arguments.judging.scene(scene_of(&arguments.plan, &plan, arguments.scene.as_deref(), common)?);
    written.refuse_inputs(loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
    let report = judge::judge_robot(&loaded, &plan, &arguments.judging, talk);
    let unfit = |problem: String| Stop::BadInput(Diagnostic::new("C408", Place::file(&arguments.plan), problem).into());
    let along = robot_along((&loaded.scene, &loaded.state), &plan, MOMENTS).map_err(unfit)?;
    let telling = telling((&loaded, &plan), (&report, &along), arguments.title.as_deref());
    let settings = RobotStoryboard { frames: arguments.frames, width: arguments.width, columns: arguments.columns };
    let put = |path: &Path, bytes: &[u8]| -> Result<(), Stop> {
        files::write_atomic(path, bytes).map_err(|error| Stop::unwritable(path, &error))?;
        talk.event("written", json!({ "path": path }));
        talk.say(format!("wrote  {}   {} bytes", path.display(), grouped(bytes.len() as u64)));
        Ok(())
    };
    if let Some(path) = &arguments.png {
        let picture = robot_storyboard(&loaded.scene, &loaded.state, &plan, &settings).map_err(unfit)?;
        put(path, &png_file::encode(&picture))?;
    }
    if let Some(folder) = &arguments.svg {
        for (name, chart) in robot_charts(&telling) {
            put(&folder.join(name).with_extension("svg"), chart.as_bytes())?;
        }
    }
    if let Some(path) = &arguments.output {
        put(path, robot_page(&telling, &settings).map_err(unfit)?.as_bytes())?;
    }
    Ok(())
}

/// `regrasp export` of such a plan.
pub fn export(
    arguments: &args::Export,
    bytes: &[u8],
    written: &Outputs,
    common: &Common,
    talk: &Talk,
) -> Result<(), Stop> {
    let path = arguments.plan.as_path();
    let plan = format::robot_from_json(path, bytes)?;
    let mut scene = None;
    if !arguments.no_check || arguments.mjcf.is_some() || arguments.ros2.is_some() {
        let loaded = arguments.judging.scene(scene_of(path, &plan, arguments.scene.as_deref(), common)?);
        written.refuse_inputs(loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
        if !arguments.no_check && !judge::judge_robot(&loaded, &plan, &arguments.judging, talk).accepted() {
            return Err(Stop::Rejected);
        }
        scene = Some(loaded);
    }
    let unfit = |wrong: export::ExportError| {
        let (expected, fix) = wrong.expected_and_fix();
        let diagnostic = Diagnostic::new(wrong.code(), Place::file(path), wrong.to_string());
        Stop::BadInput(diagnostic.expected(expected).fix(fix).into())
    };
    let no_scene = || Stop::Internal("a format that needs the scene was asked for without it".into());
    let mut made: Vec<(&str, &Path, Vec<u8>)> = Vec::new();
    if let Some(to) = &arguments.npz {
        made.push(("npz", to, export::robot_to_npz(&plan).map_err(unfit)?));
    }
    if let Some(to) = &arguments.ros2 {
        let loaded = scene.as_ref().ok_or_else(no_scene)?;
        let robot = loaded.scene.robots.iter().find(|robot| plan.robots.iter().any(|own| own.name == robot.name));
        let groups = robot.map(export::controller_groups).unwrap_or_default();
        made.push(("ros2", to, export::robot_to_ros2(&plan, &groups).map_err(unfit)?.into_bytes()));
    }
    if let Some(to) = &arguments.mjcf {
        let loaded = scene.as_ref().ok_or_else(no_scene)?;
        let model = export::robot_to_mjcf((&loaded.scene, &loaded.state), &plan).map_err(|problem| {
            let diagnostic = Diagnostic::new("C408", Place::file(path), problem);
            Stop::BadInput(diagnostic.fix("name the scene that the plan was made for: --scene FILE").into())
        })?;
        model.notes.iter().for_each(|note| talk.note(note));
        made.push(("mjcf", to, model.xml.into_bytes()));
    }
    for (name, path, bytes) in made {
        files::write_atomic(path, &bytes).map_err(|error| Stop::unwritable(path, &error))?;
        let sha256 = files::sha256(&bytes);
        talk.event("written", json!({ "format": name, "path": path, "sha256": sha256 }));
        talk.say(format!("wrote  {}   sha256 {sha256}", path.display()));
    }
    Ok(())
}
