//! `regrasp grasps --pair A.json B.json`: double grasps of two lists.

use crate::args::{self, Common};
use crate::commands::check::grasp_scene;
use crate::commands::written::available_threads;
use crate::load;
use crate::outputs::{Output, Outputs};
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::base::files;
use regrasp::geometry::Point;
use regrasp::grasp::GraspList;
use regrasp::grasp::list::double::{FORMAT, FORMAT_VERSION};
use regrasp::grasp::list::{DoubleGraspList, DoubleGraspSide, format};
use regrasp::grasp_lists::pairs::{Context, Pairs, Side, pair_grasps};
use regrasp::scene::load_scene;
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

/// Pairs that a table shows.
const SHOWN: usize = 20;

/// Reads two lists, pairs their grasps, writes the pairs.
pub fn run(arguments: &args::Grasps, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let outputs = Outputs::new(arguments.output.iter().map(|path| Output::new("--output", path)))?;
    let paths = [arguments.hand.as_path(), arguments.object.as_path()];
    let scenes = [arguments.start.as_deref(), arguments.goal.as_deref()];
    outputs.refuse_inputs(paths.into_iter().chain(scenes.into_iter().flatten()))?;
    let started = Instant::now();
    let (first, second) = (read(paths[0], common)?, read(paths[1], common)?);
    let contexts = [context(scenes[0], arguments, common)?, context(scenes[1], arguments, common)?];
    let n_threads = arguments.threads.unwrap_or_else(available_threads);
    let pairs = pair_grasps(&first.side(&contexts[0]), &second.side(&contexts[1]), n_threads)
        .map_err(|failure| Stop::NoGrasp(Box::new(failure)))?;
    let list = listed(&pairs, [&first, &second]);
    let seconds = started.elapsed().as_secs_f64();
    for (name, side) in [("first", &list.first), ("second", &list.second)] {
        talk.say(format!("{name:<6} {}, {} clear of the surroundings", counted(side.grasps, "grasp"), side.clear));
    }
    talk.say(format!(
        "pairs  {} double grasps; in {} the hands hit each other   {}",
        grouped(list.pairs.len() as u64),
        grouped(list.hands_touch as u64),
        duration(seconds)
    ));
    let summary = json!({
        "seconds": seconds, "pairs": list.pairs.len(), "hands_touch": list.hands_touch, "first": list.first, "second": list.second,
    });
    talk.event("pairs", summary);
    let bytes = list.to_json();
    match &arguments.output {
        Some(path) => {
            files::write_atomic(path, bytes.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
            let sha256 = files::sha256(bytes.as_bytes());
            talk.event("written", json!({ "path": path, "sha256": sha256 }));
            talk.say(format!("wrote  {}   sha256 {sha256}", path.display()));
        }
        None if talk.is_json() => talk.event("list", json!({ "list": list })),
        None => talk.data(&table(&list)),
    }
    if list.pairs.is_empty() { Err(Stop::Rejected) } else { Ok(()) }
}

/// A list with what was read for it.
struct Read {
    list: GraspList,
    scene: regrasp::scene::GraspScene,
    name: String,
    sha256: String,
}

impl Read {
    fn side<'a>(&'a self, context: &'a Context) -> Side<'a> {
        let scene = &self.scene.scene;
        Side { hand: &scene.hands[0].hand, object: &scene.objects[0], list: &self.list, context }
    }
}

fn read(path: &Path, common: &Common) -> Result<Read, Stop> {
    let bytes = files::read_at_most(path, format::MAX_BYTES)?;
    let list = format::from_json(path, &bytes)?;
    let scene = grasp_scene(path, &list, [&None, &None], common)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Read { list, scene, name, sha256: files::sha256(&bytes) })
}

/// What is around the object: obstacles and supports of a scene file, with its first object where its first task has it.
fn context(path: Option<&Path>, arguments: &args::Grasps, common: &Common) -> Result<Context, Stop> {
    let robot_base = arguments.robot_base.map(Point::from);
    let Some(path) = path else { return Ok(Context { robot_base, ..Context::default() }) };
    let loaded = load_scene(path, &load::options(common))?;
    let bodies = loaded.scene.obstacles.iter().chain(loaded.scene.supports.iter().map(|support| &support.body));
    Ok(Context {
        world_from_object: loaded.state.world_from_objects[0],
        surroundings: bodies.map(|body| body.placed.clone()).collect(),
        stable_pose: None,
        robot_base,
    })
}

fn listed(pairs: &Pairs, read: [&Read; 2]) -> DoubleGraspList {
    let side = |index: usize| DoubleGraspSide {
        list: read[index].name.clone(),
        sha256: read[index].sha256.clone(),
        grasps: read[index].list.grasps.len(),
        clear: pairs.clear[index],
    };
    DoubleGraspList {
        format: FORMAT.into(),
        format_version: FORMAT_VERSION,
        tool: concat!("regrasp ", env!("CARGO_PKG_VERSION")).into(),
        first: side(0),
        second: side(1),
        hands_touch: pairs.hands_touch,
        pairs: pairs.pairs.clone(),
    }
}

fn table(list: &DoubleGraspList) -> String {
    let mut out = String::from("first  second  score   quality  robot\n");
    for pair in list.pairs.iter().take(SHOWN) {
        let _ = writeln!(
            out,
            "{:>5}  {:>6}  {:.4}  {:.4}   {:.4}",
            pair.first, pair.second, pair.score, pair.quality, pair.robot
        );
    }
    if list.pairs.len() > SHOWN {
        let _ = writeln!(out, "and {} more; -o writes them all", list.pairs.len() - SHOWN);
    }
    out
}
