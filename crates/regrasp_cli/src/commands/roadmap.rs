//! `regrasp roadmap`: many queries on one saved graph of a hand and an object.

use super::pictures;
use super::plan::{judge_and_write, say_plan, say_query};
use super::robot_roadmap;
use super::rows::{make_folder_of, of_rows, say_row};
use super::written::{Limits, available_threads, of_plan};
use crate::args::{self, Common, RoadmapAction};
use crate::interrupt;
use crate::judge;
use crate::load;
use crate::outputs::{Output, Outputs};
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::base::files;
use regrasp::pictures::{roadmap_from_first, roadmap_story};
use regrasp::plan::check::Level;
use regrasp::plan::{Plan, format, plan::Asked};
use regrasp::planners::FailureKind;
use regrasp::planners::in_hand::roadmap::{
    About, BuildSettings, BuildStage, Census, GraspRoadmap, QueryMemory, Region, RoadmapPlanner, build_roadmap,
};
use regrasp::planners::in_hand::{InHandSettings, TransferMode};
use regrasp::{Budget, InHandQuery, Query};
use regrasp_bench::row::{Judge, Row};
use regrasp_bench::{Problem, RunSettings, csv, roadmap as bench, summarise, summary};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Why a scene with another task is refused.
const ROADMAPS: &str = "roadmaps are graphs of grasps";

/// Does what is asked of a roadmap.
pub fn run(arguments: &args::Roadmap, common: &Common, talk: &Talk) -> Result<(), Stop> {
    match &arguments.action {
        RoadmapAction::Build(build) => run_build(build, common, talk),
        RoadmapAction::Query(query) => run_query(query, common, talk),
        RoadmapAction::Info { roadmap } if robot_roadmap::is_of_robot(roadmap) => robot_roadmap::info(roadmap, talk),
        RoadmapAction::Info { roadmap } => run_info(roadmap, talk),
        RoadmapAction::Picture(picture) if robot_roadmap::is_of_robot(&picture.roadmap) => {
            robot_roadmap::picture(picture, common, talk)
        }
        RoadmapAction::Picture(picture) => run_picture(picture, common, talk),
        RoadmapAction::Bench(bench) => run_bench(bench, common, talk),
    }
}

/// Builds and saves.
fn run_build(arguments: &args::RoadmapBuild, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let written = Outputs::new([Output::new("--output", &arguments.output)])?;
    written
        .refuse_inputs([&arguments.settings, &arguments.build_settings].into_iter().flatten().map(PathBuf::as_path))?;
    let cancelled = interrupt::flag()?;
    let loaded = load::scene_by(&arguments.scene, common, None, talk)?;
    written.refuse_inputs(loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
    if loaded.task().of_robot.is_some() {
        let limits = Limits { max_work: args::DEFAULT_MAX_WORK, time_limit: None, improve_for: None, cancelled };
        return robot_roadmap::build(arguments, &loaded, &limits, common, talk);
    }
    load::refuse_other_task(&loaded, &arguments.scene, ROADMAPS)?;
    let n_threads = arguments.threads.unwrap_or_else(available_threads);
    let settings = load::planner_settings(arguments.settings.as_deref(), arguments.margin, n_threads)?;
    let mut build: BuildSettings =
        arguments.build_settings.as_deref().map_or_else(|| Ok(BuildSettings::default()), load::settings_file)?;
    if let Some(places) = arguments.places {
        build.places = usize::try_from(places).unwrap_or(usize::MAX);
    }
    build.validate().map_err(|problem| Stop::argument("A505", "--build-settings", problem, "settings of a build"))?;
    let query = loaded.task().query(arguments.seed);
    let view = loaded.view();
    let poses = [query.start(), query.goal()].map(|pose| view.hand_from(pose));
    let center_of_mass = view.object.center_of_mass;
    let region = Region::around(&poses, &center_of_mass, arguments.within, arguments.angle.to_radians());

    let started = Instant::now();
    let budget = Budget { cancelled, ..Budget::unlimited() };
    let progress = |stage: BuildStage| {
        let seconds = started.elapsed().as_secs_f64();
        talk.say(format!(
            "build  {:<7} {} grasps, {} motions, {} configurations   {}",
            stage.name,
            grouped(stage.nodes as u64),
            grouped(stage.edges as u64),
            grouped(stage.work),
            duration(seconds)
        ));
        talk.event(
            "stage",
            json!({
                "name": stage.name, "nodes": stage.nodes, "edges": stage.edges, "work": stage.work, "seconds": seconds,
            }),
        );
    };
    let build = |settings: &InHandSettings| {
        build_roadmap(&view, &region, &build, settings, arguments.seed, &budget, &progress).map_err(|failure| {
            match failure.kind {
                FailureKind::Interrupted => Stop::Interrupted,
                _ => Stop::NoPlan(Box::new(failure)),
            }
        })
    };
    // Settings of a file are whole: a margin that it leaves out is the usual one.
    let roadmap = match (&settings.search.first_try, arguments.margin, &arguments.settings) {
        (Some(first), None, None) => careful_if_possible(&settings, first.closure_margin, build, talk)?,
        _ => build(&settings)?,
    };
    save(&roadmap, &arguments.output, talk)
}

/// Share of its places that a graph should connect.
const COVERED: f64 = 0.95;

/// A graph with the closure margin that a search for one plan asks for first: plans from graphs that keep less drop the object more often than
/// single plans do (docs/how-to/many-queries.md). Where it connects few of its places, one with the usual margin, if that connects more.
fn careful_if_possible(
    settings: &InHandSettings,
    first_margin: f64,
    build: impl Fn(&InHandSettings) -> Result<GraspRoadmap, Stop>,
    talk: &Talk,
) -> Result<GraspRoadmap, Stop> {
    let covered = |roadmap: &GraspRoadmap| {
        let census = roadmap.census();
        census.places_covered as f64 / census.places.max(1) as f64
    };
    let usual = settings.physics.closure_margin;
    let mut careful = settings.clone();
    careful.physics.closure_margin = first_margin.max(usual);
    let first = match build(&careful) {
        Ok(roadmap) if covered(&roadmap) >= COVERED => return Ok(roadmap),
        Ok(roadmap) => Ok(roadmap),
        Err(Stop::NoPlan(failure)) => Err(failure),
        Err(stop) => return Err(stop),
    };
    let (kept, share) = (careful.physics.closure_margin, first.as_ref().map_or(0.0, covered));
    talk.say(format!(
        "build  with a closure margin of {kept} only {:.0} % of the places are connected: again with {usual}",
        100.0 * share
    ));
    talk.event("again", json!({ "closure_margin": kept, "covered": share, "next_closure_margin": usual }));
    match (build(settings), first) {
        (Ok(roadmap), Ok(careful)) if covered(&roadmap) <= covered(&careful) => Ok(careful),
        (Err(Stop::NoPlan(_)), Ok(careful)) => Ok(careful),
        (result, _) => result,
    }
}

/// Writes a roadmap whole or not at all and says what it is.
fn save(roadmap: &GraspRoadmap, path: &Path, talk: &Talk) -> Result<(), Stop> {
    let bytes = roadmap.to_bytes();
    files::write_atomic(path, &bytes).map_err(|error| Stop::unwritable(path, &error))?;
    let sha256 = files::sha256(&bytes);
    say_census(&roadmap.census(), talk);
    talk.say(format!("wrote  {}   {} bytes   sha256 {sha256}", path.display(), grouped(bytes.len() as u64)));
    talk.event("written", json!({ "path": path, "bytes": bytes.len(), "sha256": sha256 }));
    Ok(())
}

/// Reads a roadmap and says how long it took.
fn open(path: &Path, talk: &Talk) -> Result<GraspRoadmap, Stop> {
    let started = Instant::now();
    let roadmap = GraspRoadmap::read(path)?;
    let seconds = started.elapsed().as_secs_f64();
    talk.say(format!("graph  {}   loaded in {}", path.display(), duration(seconds)));
    talk.event("roadmap", json!({ "path": path, "seconds": seconds }));
    Ok(roadmap)
}

/// Answers the query of a scene, checks the plan, writes it, and lets the roadmap grow if asked.
fn run_query(arguments: &args::RoadmapQuery, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let plan = Outputs::new(arguments.output.iter().flat_map(|path| of_plan(path)))?;
    plan.refuse_inputs([arguments.roadmap.as_path()].into_iter().chain(arguments.settings.as_deref()))?;
    let grown = Outputs::new(arguments.grow.then(|| Output::new("--grow", &arguments.roadmap)))?;
    let cancelled = interrupt::flag()?;
    let roadmap = open(&arguments.roadmap, talk)?;
    refuse_other_settings(&roadmap, arguments)?;
    let loaded = arguments.judging.scene(load::in_hand_scene(&arguments.scene, ROADMAPS, common, talk)?);
    for written in [plan, grown] {
        written.refuse_inputs(loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
    }
    let (query, view) = (loaded.task().query(arguments.seed), loaded.view());
    say_query(&query, arguments.seed, 1, talk);
    let mut planner = RoadmapPlanner::new(&arguments.roadmap, &roadmap, &view)?;
    if arguments.smooth {
        planner = planner.smoothing();
    }
    let budget = Budget { cancelled, ..Budget::work(arguments.max_work) };
    let started = Instant::now();
    let answer = match planner.plan(in_hand_of(&query), arguments.seed, &budget, &mut QueryMemory::default()) {
        Ok(answer) => answer,
        Err(failure) if failure.kind == FailureKind::Interrupted => return Err(Stop::Interrupted),
        Err(failure) => return Err(Stop::NoPlan(Box::new(failure))),
    };
    say_plan(&answer.plan, started.elapsed().as_secs_f64(), talk);
    let output = arguments.output.as_deref();
    judge_and_write(&answer.plan, output, &arguments.scene, None, common, &arguments.judging, talk)?;
    if arguments.grow {
        drop(planner);
        save(&roadmap.grown_by(&answer), &arguments.roadmap, talk)?;
    }
    Ok(())
}

/// Draws a graph; with a scene also the answer to its query, which is judged like any other.
fn run_picture(arguments: &args::RoadmapPicture, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let written = Outputs::new([Output::new("--output", &arguments.output)])?;
    written.refuse_inputs([arguments.roadmap.as_path()].into_iter().chain(arguments.scene.as_deref()))?;
    let cancelled = interrupt::flag()?;
    let roadmap = open(&arguments.roadmap, talk)?;
    let name = arguments.roadmap.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let Some(scene) = &arguments.scene else {
        let story = roadmap_from_first(&roadmap);
        let title = format!("Graph {name}, goal: its first pose");
        return pictures::write_roadmap(&arguments.output, &story, &title, talk);
    };
    let loaded = load::in_hand_scene(scene, ROADMAPS, common, talk)?;
    written.refuse_inputs(loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
    let (query, view) = (loaded.task().query(arguments.seed), loaded.view());
    say_query(&query, arguments.seed, 1, talk);
    let planner = RoadmapPlanner::new(&arguments.roadmap, &roadmap, &view)?;
    let budget = Budget { cancelled, ..Budget::work(arguments.max_work) };
    let started = Instant::now();
    let answer = match planner.plan(in_hand_of(&query), arguments.seed, &budget, &mut QueryMemory::default()) {
        Ok(answer) => answer,
        Err(failure) if failure.kind == FailureKind::Interrupted => return Err(Stop::Interrupted),
        Err(failure) => return Err(Stop::NoPlan(Box::new(failure))),
    };
    say_plan(&answer.plan, started.elapsed().as_secs_f64(), talk);
    // Motions whose contacts stay where they are are geometry.
    let is_fixed = roadmap.about().settings.physics.transfer == TransferMode::Fixed;
    let level = is_fixed.then(|| Level::Geometry.name().into());
    let judging = args::Judging { level, ..args::Judging::default() };
    if !judge::judge(&loaded, &answer.plan, &judging, talk)?.accepted() {
        return Err(Stop::Rejected);
    }
    // With start and goal of the query as nodes.
    let story = roadmap_story(&roadmap.grown_by(&answer), &view, &answer.plan);
    let title = format!("Graph {name}, goal of {}", loaded.scene.name);
    pictures::write_roadmap(&arguments.output, &story, &title, talk)
}

/// The in-hand query, of a scene whose task was looked at when it was read.
fn in_hand_of(query: &Query) -> &InHandQuery {
    query.as_in_hand().expect("scenes of other tasks were refused")
}

/// Refuses settings asked for that the roadmap was not built with; what is not asked for is as the roadmap has it.
fn refuse_other_settings(roadmap: &GraspRoadmap, arguments: &args::RoadmapQuery) -> Result<(), Stop> {
    if arguments.settings.is_none() && arguments.margin.is_none() {
        return Ok(());
    }
    let mut asked = match arguments.settings.as_deref() {
        Some(file) => load::planner_settings(Some(file), None, 1)?,
        None => roadmap.about().settings.clone(),
    };
    if let Some(margin) = arguments.margin {
        asked.physics.closure_margin = margin;
    }
    Ok(roadmap.refuse_other_settings(&arguments.roadmap, &asked)?)
}

/// Shows what a roadmap is of and how large.
fn run_info(path: &Path, talk: &Talk) -> Result<(), Stop> {
    let started = Instant::now();
    let bytes = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    let roadmap = GraspRoadmap::read(path)?;
    let seconds = started.elapsed().as_secs_f64();
    let (about, census) = (roadmap.about(), roadmap.census());
    if talk.is_json() {
        talk.event(
            "roadmap",
            json!({ "path": path, "bytes": bytes, "seconds": seconds, "census": census,
            "about": about.summary() }),
        );
        return Ok(());
    }
    talk.data(&info_text(path, bytes, seconds, about, &census));
    Ok(())
}

fn info_text(path: &Path, bytes: u64, seconds: f64, about: &About, census: &Census) -> String {
    let identity = &about.identity;
    let digits = files::hex;
    let mm = |metres: f64| format!("{:.1}", 1e3 * metres);
    let region = &about.region;
    let (center, half) = (region.center.map(mm), region.half_extents.map(mm));
    let angle = region.max_angle.to_degrees();
    let turned =
        if angle >= 180.0 { "any orientation".to_owned() } else { format!("turned by at most {angle:.0} deg") };
    let components: Vec<String> = census.components.iter().take(6).map(|&size| grouped(size as u64)).collect();
    let contacts: Vec<&str> = identity.contacts.iter().map(|contact| contact.name()).collect();
    let lines = [
        format!("file        {}   {} bytes, loaded in {}", path.display(), grouped(bytes), duration(seconds)),
        format!(
            "hand        {}   {}   sha256 {}",
            identity.hand_name,
            identity.fingers.join(", "),
            digits(&identity.hand)
        ),
        format!("object      {}   sha256 {}", identity.object_name, digits(&identity.object)),
        format!("contacts    {}", contacts.join(", ")),
        format!("friction    {}", identity.friction),
        format!("obstacles   sha256 {}", digits(&identity.obstacles)),
        format!("region      centre of mass {} mm, +- {} mm; {turned}", center.join(" "), half.join(" ")),
        format!("covered     {} of {}", grouped(census.places_covered as u64), counted(census.places, "place")),
        format!(
            "nodes       {} grasps; {} contacts, {} footholds",
            grouped(census.nodes as u64),
            grouped(census.contacts as u64),
            grouped(census.footholds as u64)
        ),
        format!(
            "edges       {}: {}, {}",
            grouped((census.transfers + census.relocations) as u64),
            counted(census.transfers, "transfer"),
            counted(census.relocations, "relocation")
        ),
        format!("components  {}: {}", census.components.len(), components.join(", ")),
        format!("margin      {} asked of every holding set", about.settings.physics.closure_margin),
        format!(
            "built       seed {}, grown by {}",
            about.seed,
            if about.n_grown == 1 { "1 query".into() } else { format!("{} queries", about.n_grown) }
        ),
    ];
    lines.join("\n") + "\n"
}

fn say_census(census: &Census, talk: &Talk) {
    talk.say(format!(
        "graph  {}, {}, {}, {}",
        counted(census.nodes, "grasp"),
        counted(census.transfers, "transfer"),
        counted(census.relocations, "relocation"),
        counted(census.components.len(), "component")
    ));
    talk.event("census", json!(census));
}

/// Random queries with the roadmap, and without it for comparison.
fn run_bench(arguments: &args::RoadmapBench, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let cancelled = interrupt::flag()?;
    for path in [&arguments.csv, &arguments.graph].into_iter().flatten() {
        make_folder_of(path)?;
    }
    let rows = arguments.csv.iter().flat_map(|path| of_rows(path));
    let facts = arguments.graph.iter().map(|path| Output::new("--graph", path));
    let written = Outputs::new(rows.chain(facts))?;
    written.refuse_inputs([arguments.roadmap.as_path()])?;
    let roadmap = open(&arguments.roadmap, talk)?;
    let loaded = arguments.judging.scene(load::in_hand_scene(&arguments.scene, ROADMAPS, common, talk)?);
    written.refuse_inputs(loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
    let view = loaded.view();
    let mut planner = RoadmapPlanner::new(&arguments.roadmap, &roadmap, &view)?;
    if arguments.smooth {
        planner = planner.smoothing();
    }
    let mut writer = match &arguments.csv {
        Some(path) => Some(csv::Writer::create(path).map_err(|error| Stop::unwritable(path, &error))?),
        None => None,
    };
    let settings = RunSettings {
        planner: planner.settings().clone(),
        tracking: Default::default(),
        max_work: 20_000_000,
        time_limit: None,
        judge: if arguments.no_check { Judge::Skip } else { Judge::Checker(arguments.judging.level()) },
        improve_for: None,
        cancelled: Arc::clone(&cancelled),
    };
    let mut memory = QueryMemory::default();
    let mut rows = Vec::new();
    let seeds: Vec<u64> = (0..arguments.queries).map(|number| arguments.first_seed.saturating_add(number)).collect();
    let mut n_single = usize::try_from(arguments.single).unwrap_or(usize::MAX);
    for block in seeds.chunks(bench::BLOCK) {
        let queries: Vec<_> = block.iter().map(|&seed| Query::from(planner.random_query(seed))).collect();
        let problem = |(query, &seed)| Problem { task: loaded.manipulation(), query, seed };
        let problems: Vec<Problem> = queries.iter().zip(block).map(problem).collect();
        let mut kept = Ok(());
        let mut keep = |problem: Problem, row: &Row, plan: &Plan| {
            if let (Some(folder), Ok(())) = (&arguments.plans, &kept) {
                kept = write_plan(folder, row, problem.query, plan);
            }
        };
        let found = bench::run(&planner, &problems, n_single, &settings, &mut memory, &mut keep);
        kept?;
        n_single = n_single.saturating_sub(block.len());
        if cancelled.load(Ordering::Relaxed) {
            return Err(Stop::Interrupted);
        }
        for row in found {
            say_row(&row, talk);
            if let (Some(writer), Some(path)) = (&mut writer, &arguments.csv) {
                writer.push(&row).map_err(|error| Stop::unwritable(path, &error))?;
            }
            rows.push(row);
        }
    }
    if let (Some(writer), Some(path)) = (writer, &arguments.csv) {
        writer.finish().map_err(|error| Stop::unwritable(path, &error))?;
    }
    if let Some(path) = &arguments.graph {
        let facts = bench::GraphFacts::of(&arguments.roadmap, &loaded.scene.name)?;
        let text = serde_json::to_string_pretty(&facts).expect("plain data becomes JSON") + "\n";
        files::write_atomic(path, text.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
        talk.say(format!("wrote  {}   loaded in {}", path.display(), duration(facts.load_s)));
    }
    let summaries = summarise(&rows);
    for summary in &summaries {
        talk.event("summary", json!(summary));
    }
    if !talk.is_json() {
        talk.data(&summary::table(&summaries));
    }
    Ok(())
}

/// Writes the plan of a random query. It says which: no scene file has its start and its goal.
fn write_plan(folder: &Path, row: &Row, query: &Query, plan: &Plan) -> Result<(), Stop> {
    let way = if row.method == bench::METHOD { "roadmap" } else { "single" };
    let path = folder.join(way).join(format!("{}.json", row.seed));
    let asked = plan.segments.first().and_then(|segment| segment.waypoints.first()).map(|first| {
        let fingers = plan.fingers.iter().zip(&first.contacts);
        Box::new(Asked {
            start: query.start().into(),
            goal: query.goal().into(),
            joints: first.joints.clone(),
            free: fingers.filter(|(_, contact)| !contact.holds()).map(|(finger, _)| finger.clone()).collect(),
        })
    });
    let text = format::to_json(&Plan { asked, ..plan.clone() });
    make_folder_of(&path)?;
    files::write_atomic(&path, text.as_bytes()).map_err(|error| Stop::unwritable(&path, &error))
}
