//! `regrasp demo`: plan and check a turn of a bundled object in a bundled hand; no files needed.

use super::plan::{say_query, search};
use super::written::{Limits, available_threads};
use crate::args::{self, Common};
use crate::interrupt;
use crate::judge;
use crate::load;
use crate::pages::Page;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::files;
use regrasp::plan::format;
use regrasp::viewer::charts;
use regrasp::{InHandSettings, PlannerSettings};
use serde_json::json;
use std::path::Path;

/// Work that the demo may do: hundreds of times what it needs.
const MAX_WORK: u64 = 5_000_000;
/// The scene, relative to the output folder.
const SCENE: &str = "scenes/sphere_180z.toml";
/// The files that the demo needs, so that an installed binary needs no repository: copies, which a test of `xtask` compares.
const FILES: [(&str, &str); 3] = [
    (SCENE, include_str!("../../demo/scenes/sphere_180z.toml")),
    ("assets/hands/wide_four_finger/hand.toml", include_str!("../../demo/assets/hands/wide_four_finger/hand.toml")),
    ("assets/hands/wide_four_finger/hand.urdf", include_str!("../../demo/assets/hands/wide_four_finger/hand.urdf")),
];

/// Writes the bundled files, plans, checks, writes plan, picture and page.
pub fn run(arguments: &args::Demo, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let cancelled = interrupt::flag()?;
    let folder = &arguments.output;
    talk.say(format!("demo   a four-finger hand turns a ball by 180 degrees; everything goes to {}", folder.display()));
    for (name, text) in FILES {
        write(&folder.join(name), text.as_bytes())?;
    }
    let scene_path = folder.join(SCENE);
    let loaded = load::scene(&scene_path, common, talk)?;
    let query = loaded.task().query(arguments.seed);
    let n_threads = available_threads();
    let in_hand = InHandSettings { n_threads, ..InHandSettings::default() };
    let settings = PlannerSettings { in_hand, ..PlannerSettings::default() };
    say_query(&query, arguments.seed, n_threads, talk);
    let limits = Limits { max_work: MAX_WORK, time_limit: None, improve_for: None, cancelled };
    let plan = search(&loaded.manipulation(), &query, &settings, arguments.seed, &limits, talk)?;
    let bytes = format::to_json(&plan);
    let (plan_path, chart_path) = (folder.join("plan.json"), folder.join("gait.svg"));
    let options = load::options(common);
    let report =
        judge::judge_bytes(&plan_path, bytes.as_bytes(), &scene_path, common, &args::Judging::default(), talk)?;
    if !report.accepted() {
        return Err(Stop::Rejected);
    }
    write(&plan_path, bytes.as_bytes())?;
    write(&chart_path, charts::gait(&plan).as_bytes())?;
    let sha256 = files::sha256(bytes.as_bytes());
    talk.event("written", json!({ "path": plan_path, "sha256": sha256, "chart": chart_path }));
    talk.say(format!("wrote  {}   sha256 {sha256}", plan_path.display()));
    talk.say(format!("chart  {}   which finger holds when; open it in a browser", chart_path.display()));
    talk.say(format!("next   regrasp check {}", plan_path.display()));
    let page_path = folder.join("plan.html");
    Page::new(&page_path, loaded.manipulation(), &query, &options.resolve).write_plan(&plan, &report, talk)
}

/// Writes a file and the folders above it.
fn write(path: &Path, bytes: &[u8]) -> Result<(), Stop> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| Stop::unwritable(folder, &error))?;
    }
    files::write_atomic(path, bytes).map_err(|error| Stop::unwritable(path, &error))
}
