//! `regrasp place`: where to hold an object, as a scene that `regrasp plan` takes.

use super::pictures::write_storyboard;
use crate::args::{self, Common};
use crate::file_names::name_from;
use crate::interrupt;
use crate::load;
use crate::outputs::{Output, Outputs, refuse_no_folder};
use crate::pages;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::base::files;
use regrasp::plan::check::{CheckSettings, check};
use regrasp::planners::FailureKind;
use regrasp::planners::in_hand::placing::{Place, Places, place};
use regrasp::robot::ResolveOptions;
use regrasp::scene::{LoadedScene, load_scene_text};
use regrasp::scene_text::{SceneText, mesh, object_of_scene, primitive};
use regrasp::viewer::story::{Outcome, Telling};
use regrasp::{Budget, InHandQuery, InHandSettings, Plan, Query, plan_in_hand};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use toml::{Table, Value};

/// Poses that are drawn.
const DRAWN: usize = 5;
/// Mass and friction of an object of which nobody says any.
const USUAL: [(&str, f64); 2] = [("mass", 0.1), ("friction", 0.8)];
/// Work of the grasp that is drawn for a pose from which no turn was found.
const HOLD_WORK: u64 = 100_000;

/// Looks for poses, prints what was tried, writes scenes.
pub fn run(arguments: &args::Place, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let n_scenes = 1 + usize::from(arguments.alternatives);
    let scene_paths: Vec<PathBuf> = (0..n_scenes).map(|k| scene_path(&arguments.output, k)).collect();
    let pictures: Vec<PathBuf> = match &arguments.pictures {
        Some(folder) => (1..=DRAWN).map(|k| folder.join(format!("place-{k}.png"))).collect(),
        None => Vec::new(),
    };
    let outputs = scene_paths.iter().map(|path| Output::new("--output", path));
    let written = Outputs::new(outputs.chain(pictures.iter().map(|path| Output::beside("--pictures", path.clone()))))?;
    arguments.pictures.as_deref().map_or(Ok(()), refuse_no_folder)?;
    let cancelled = interrupt::flag()?;
    let deadline = arguments.time_limit.and_then(|limit| Instant::now().checked_add(limit));

    let scene = SceneText {
        hand: name_from(&arguments.output, &arguments.hand, &common.packages),
        torsion_radius: arguments.torsion_radius,
        object: object(arguments, common)?,
        turns: arguments.turns.clone(),
        comment: vec!["Written by `regrasp place`; edit freely. Metres and radians.".into()],
    };
    let started = Instant::now();
    let draft = scene.text(None).into_bytes();
    let loaded = load_scene_text(&arguments.output, draft, &load::options(common))?;
    load::say_loaded(&loaded, started.elapsed().as_secs_f64(), talk);
    let of_files = loaded.scene.inputs.iter().skip(1).map(|input| input.path.as_path());
    written
        .refuse_inputs(of_files.chain(arguments.object.ends_with(".toml").then_some(Path::new(&arguments.object))))?;

    let queries: Vec<InHandQuery> =
        loaded.tasks.iter().filter_map(|task| task.query(arguments.seed).as_in_hand().cloned()).collect();
    let settings = InHandSettings { n_threads: 1, ..InHandSettings::default() };
    let budget = Budget { deadline, cancelled: Arc::clone(&cancelled), ..Budget::work(arguments.max_work) };
    let started = Instant::now();
    let wanted = if pictures.is_empty() { n_scenes } else { n_scenes.max(DRAWN) };
    let found = place(&loaded.view(), &queries, &settings, (arguments.seed, wanted), &budget, &|_| {});
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
    talk.say(format!("next   regrasp plan {} -o plan.json", arguments.output.display()));
    Ok(())
}

/// The scene of the best pose, of the second best, and so on: `scene.toml`, `scene.2.toml`.
fn scene_path(output: &Path, index: usize) -> PathBuf {
    if index == 0 {
        return output.to_owned();
    }
    let stem = output.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let extension = output.extension().map_or_else(|| "toml".into(), |extension| extension.to_string_lossy());
    output.with_file_name(format!("{stem}.{}.{extension}", index + 1))
}

/// The object as a scene file has it: from a primitive, a scene file or a mesh file.
fn object(arguments: &args::Place, common: &Common) -> Result<Table, Stop> {
    let asked = arguments.object.as_str();
    let path = Path::new(asked);
    let named = |file: &Path| name_from(&arguments.output, file, &common.packages);
    let mut object = if let Some(read) = primitive(asked) {
        read.map_err(|expected| Stop::argument("A505", "OBJECT", format!("is \"{asked}\""), expected))?
    } else if path.extension().is_some_and(|extension| extension == "toml") {
        let folder = path.parent().unwrap_or(Path::new(""));
        let renamed = |file: &str| if file.contains("://") { file.to_owned() } else { named(&folder.join(file)) };
        object_of_scene(path, &files::read_text(path)?, None, renamed)?
    } else {
        let name = path.file_stem().map_or_else(|| "object".into(), |stem| stem.to_string_lossy());
        mesh(&if asked.contains("://") { asked.to_owned() } else { named(path) }, &name)
    };
    if let Some(scale) = &arguments.scale {
        let Some(inside) = object.get_mut("mesh").and_then(Value::as_table_mut) else {
            return Err(Stop::argument("A505", "--scale", "is for meshes", "a mesh file as OBJECT"));
        };
        let numbers: Option<Vec<f64>> = scale.split(',').map(|part| part.trim().parse().ok()).collect();
        let value = match numbers.as_deref() {
            Some([factor]) => Value::Float(*factor),
            Some(factors) => Value::Array(factors.iter().map(|factor| Value::Float(*factor)).collect()),
            None => Value::String(scale.clone()),
        };
        inside.insert("scale".into(), value);
    }
    let given = [arguments.mass, arguments.friction];
    for ((key, usual), given) in USUAL.into_iter().zip(given) {
        let is_said = object.contains_key(key) || (key == "mass" && object.contains_key("density"));
        if given.is_some() && key == "mass" {
            object.remove("density");
        }
        if given.is_some() || !is_said {
            object.insert(key.into(), Value::Float(given.unwrap_or(usual)));
        }
    }
    Ok(object)
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
    let names: Vec<&str> = arguments.turns.iter().map(regrasp::scene_text::Turn::name).collect();
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
        let probe = |probe: &regrasp::planners::in_hand::placing::probe::Probe| json!({ "solved": probe.is_solved(), "work": probe.work });
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
