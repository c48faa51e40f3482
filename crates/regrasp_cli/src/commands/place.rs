//! `regrasp place`: where to hold an object, as a scene that `regrasp plan` takes.

use super::pictures::write_storyboard;
use super::written::available_threads;
use crate::args::{self, Common};
use crate::interrupt;
use crate::load;
use crate::outputs::{Output, Outputs, refuse_no_folder};
use crate::pages;
use crate::progress::PlaceLines;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::base::files;
use regrasp::placing::{Asked, of_draft};
use regrasp::plan::check::{CheckSettings, check};
use regrasp::planners::FailureKind;
use regrasp::planners::in_hand::placing::probe::Probe;
use regrasp::planners::in_hand::placing::{Place, Places, Tried, place};
use regrasp::robot::ResolveOptions;
use regrasp::scene::{LoadedScene, load_scene_text};
use regrasp::scene_text::Turn;
use regrasp::viewer::story::{Outcome, Telling};
use regrasp::{Budget, InHandQuery, InHandSettings, Plan, Query, plan_in_hand};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Poses that are drawn.
const DRAWN: usize = 5;
/// Work of the grasp that is drawn for a pose from which no turn was found.
const HOLD_WORK: u64 = 100_000;

/// Looks for poses, prints what was tried, writes scenes.
pub fn run(arguments: &args::Place, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let asked = Asked {
        output: &arguments.output,
        hand: &arguments.hand,
        object: &arguments.object,
        turns: &arguments.turns,
        mass: arguments.mass,
        friction: arguments.friction,
        scale: arguments.scale.as_deref(),
        solid: arguments.solid.as_deref(),
        torsion_radius: arguments.torsion_radius,
        packages: &common.packages,
    };
    let n_scenes = 1 + usize::from(arguments.alternatives);
    let scene_paths: Vec<PathBuf> = (0..n_scenes).map(|index| asked.path(index)).collect();
    let pictures: Vec<PathBuf> = match &arguments.pictures {
        Some(folder) => (1..=DRAWN).map(|k| folder.join(format!("place-{k}.png"))).collect(),
        None => Vec::new(),
    };
    let outputs = scene_paths.iter().map(|path| Output::new("--output", path));
    let written = Outputs::new(outputs.chain(pictures.iter().map(|path| Output::beside("--pictures", path.clone()))))?;
    arguments.pictures.as_deref().map_or(Ok(()), refuse_no_folder)?;
    let cancelled = interrupt::flag()?;
    let deadline = Instant::now().checked_add(arguments.time_limit);

    let scene = asked.scene()?;
    let started = Instant::now();
    let draft = scene.text(None);
    let loaded = load_scene_text(&arguments.output, draft.clone().into_bytes(), &load::options(common))
        .map_err(|error| of_draft(error, &arguments.output, &draft))?;
    load::say_loaded(&loaded, started.elapsed().as_secs_f64(), talk);
    let of_files = loaded.scene.inputs.iter().skip(1).map(|input| input.path.as_path());
    written
        .refuse_inputs(of_files.chain(arguments.object.ends_with(".toml").then_some(Path::new(&arguments.object))))?;

    let mut queries: Vec<InHandQuery> =
        loaded.tasks.iter().filter_map(|task| task.query(arguments.seed).as_in_hand().cloned()).collect();
    if arguments.hold {
        queries = queries.iter().take(1).map(InHandQuery::held).collect();
    }
    let settings = InHandSettings { n_threads: available_threads(), ..InHandSettings::default() };
    let budget = Budget { deadline, cancelled: Arc::clone(&cancelled), ..Budget::work(arguments.max_work) };
    let started = Instant::now();
    let wanted = if pictures.is_empty() { n_scenes } else { n_scenes.max(DRAWN) };
    let lines = PlaceLines::new(talk);
    let told = |tried: &Tried| lines.report(tried);
    let found = place(&loaded.view(), &queries, &settings, (arguments.seed, wanted), &budget, &told);
    let found = found.map_err(|failure| match failure.kind {
        FailureKind::Interrupted => Stop::Interrupted,
        _ => Stop::NoPlan(Box::new(failure)),
    })?;
    say_places(&found, arguments, started.elapsed().as_secs_f64(), talk);
    for (path, place) in scene_paths.iter().zip(&found.places) {
        let text = scene.text(Some(&place.world_from_object));
        files::write_atomic(path, text.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
        talk.event("written", json!({ "path": path, "start": place_pose(place) }));
        talk.say(format!("wrote  {}", path.display()));
    }
    if let Some(folder) = &arguments.pictures {
        std::fs::create_dir_all(folder).map_err(|error| Stop::unwritable(folder, &error))?;
        let packages = load::options(common).resolve;
        for (path, place) in pictures.iter().zip(&found.places) {
            draw(path, &loaded, &queries, place, (&settings, arguments.seed, &budget), &packages, talk)?;
        }
    }
    let was_cut = deadline.is_some_and(|deadline| Instant::now() >= deadline);
    say_next(&found, arguments, was_cut, talk);
    Ok(())
}

/// Says which turns nobody found from the pose of the first scene, and which command comes next.
fn say_next(found: &Places, arguments: &args::Place, was_cut: bool, talk: &Talk) {
    let names = names_of(arguments);
    let probes = found.places.first().map_or(&[][..], |place| &place.probes);
    let is_solved = |k: usize| probes.get(k).is_some_and(Probe::is_solved);
    let (solved, open): (Vec<usize>, Vec<usize>) = (0..names.len()).partition(|&k| is_solved(k));
    let named = |which: &[usize]| which.iter().map(|&k| names[k]).collect::<Vec<_>>().join(", ");
    let cut = match was_cut {
        true => format!("; --time-limit {} s stopped them", arguments.time_limit.as_secs_f64()),
        false => String::new(),
    };
    if solved.is_empty() {
        let what = if arguments.hold { "no grasp that is planned and judged" } else { "none of the turns" };
        talk.note(&format!(
            "short searches found {what} at any pose{cut}: the scene has the pose that seems best, and its plan may need minutes or fail"
        ));
    } else if !open.is_empty() {
        talk.note(&format!(
            "from the best pose short searches found {}, and not {}{cut}: a plan for that may need minutes or fail",
            named(&solved),
            named(&open)
        ));
    }
    let hold = if arguments.hold { " --hold" } else { "" };
    // Without a name `plan` takes the first task.
    let task = match solved.first() {
        Some(&k) if k > 0 => format!(" --task {}", names[k]),
        _ => String::new(),
    };
    talk.say(format!("next   regrasp plan {}{task}{hold} -o plan.json", arguments.output.display()));
}

/// Names of the tasks, in the order of the probes.
fn names_of(arguments: &args::Place) -> Vec<&str> {
    if arguments.hold { vec!["hold"] } else { arguments.turns.iter().map(Turn::name).collect() }
}

fn place_pose(place: &Place) -> serde_json::Value {
    json!(regrasp::plan::plan::PoseData::from(&place.world_from_object))
}

/// Says what was tried and found.
fn say_places(found: &Places, arguments: &args::Place, seconds: f64, talk: &Talk) {
    let tried = &found.tried;
    talk.say(format!(
        "place  {} poses estimated, {} looked at with all links, {} with a grasp; searched from {}, {} solved   {}",
        grouped(tried.poses),
        tried.looked_at,
        tried.with_grasp,
        tried.probed,
        tried.solved,
        duration(seconds)
    ));
    let names = names_of(arguments);
    talk.say(format!("       {:<24}  {:>6}  {:>9}  short searches", "position", "turned", "evidence"));
    for place in &found.places {
        let p = place.world_from_object.translation.vector;
        let position = format!("[{:.4}, {:.4}, {:.4}]", p.x, p.y, p.z);
        let searches: Vec<String> = names
            .iter()
            .zip(&place.probes)
            .map(|(name, probe)| {
                let what = if probe.is_solved() { "solved" } else { "not yet" };
                format!("{name} {what} after {}", counted(probe.work as usize, "configuration"))
            })
            .collect();
        let angle = place.world_from_object.rotation.angle().to_degrees();
        talk.say(format!("       {position:<24}  {angle:>5.1}°  {:>9.4}  {}", place.evidence, searches.join(", ")));
    }
    let of_place = |place: &Place| {
        let probe = |probe: &Probe| json!({ "solved": probe.n_solved, "work": probe.work });
        json!({
            "start": place_pose(place),
            "outlook": place.outlook,
            "evidence": place.evidence,
            "joints": place.joints,
            "searches": place.probes.iter().map(probe).collect::<Vec<_>>(),
        })
    };
    let places: Vec<_> = found.places.iter().map(of_place).collect();
    talk.event("places", json!({ "seconds": seconds, "tried": tried, "places": places }));
}

/// Draws a pose: the turn that a short search found, else a grasp.
fn draw(
    path: &Path,
    loaded: &LoadedScene,
    queries: &[InHandQuery],
    place: &Place,
    (settings, seed, budget): (&InHandSettings, u64, &Budget),
    packages: &ResolveOptions,
    talk: &Talk,
) -> Result<(), Stop> {
    let solved =
        queries.iter().zip(&place.probes).find_map(|(query, probe)| Some((query.clone(), probe.plan.clone()?)));
    let held = || -> Option<(InHandQuery, Box<Plan>)> {
        let query = queries.first()?.held().started_at(&place.world_from_object);
        let limits = Budget { max_work: HOLD_WORK, ..budget.clone() };
        let plan = plan_in_hand(&loaded.view(), &query, settings, seed, &limits, &|_| {}).ok()?;
        Some((query, Box::new(plan)))
    };
    let Some((query, plan)) = solved.or_else(held) else {
        talk.note(&format!("{} is not drawn: no grasp with forces was found there", path.display()));
        return Ok(());
    };
    let query = Query::InHand(query);
    let report = check((&loaded.scene, &loaded.state), Some(&query), &plan, &CheckSettings::default());
    let p = place.world_from_object.translation.vector;
    let title = format!("start at [{:.3}, {:.3}, {:.3}]", p.x, p.y, p.z);
    let story = pages::story(&Telling {
        task: loaded.manipulation(),
        query: None,
        outcome: Outcome::Planned { plan: &plan, report: &report },
        title: Some(&title),
        facts: Vec::new(),
        roadmap: None,
        packages,
    })?;
    write_storyboard(path, &story, talk)
}
