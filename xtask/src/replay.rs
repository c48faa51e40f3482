//! Replays in MuJoCo. They need the Python package with MuJoCo: `make python` makes it.

use crate::run::{Outcome, files, joined, models, number, out, package, regrasp, regrasp_with, run, words};
use std::fs;
use std::path::{Path, PathBuf};

const PYTHON: &str = "target/python/bin/python";
const RESULTS: &str = "docs/benchmarks/replay";
const SCENES: &str = "scenes/sphere_90x.toml scenes/sphere_180z.toml scenes/box_90x.toml";
const ALLEGRO: &str = "scenes/allegro/sphere32_x.toml scenes/allegro/cube57_y.toml scenes/allegro/cube57_z.toml";

fn campaign(line: &str) -> Outcome {
    run(PYTHON, &words(&format!("-m regrasp.simulate.campaign {line}")))
}

fn needs_python() -> Outcome {
    match Path::new(PYTHON).is_file() {
        true => Ok(()),
        false => Err(format!("{PYTHON} is not there; `make python` makes it")),
    }
}

/// 50 plans per scene and direction of gravity, with and without feedback of the object's pose; the negative controls; friction, mass
/// and speed other than planned; and 5 plans of every in-hand scene with gravity as planned. Some 50 minutes.
pub fn in_hand(_: &[String]) -> Outcome {
    needs_python()?;
    let folder = out("replay")?;
    let to = format!("-o {}", folder.display());
    let (seeds, few, scene_seeds) =
        (number("REPLAY_SEEDS", 50)?, number("CONTROL_SEEDS", 10)?, number("SCENE_SEEDS", 5)?);
    let with_models = models();
    let packages = with_models.as_deref().map(package).unwrap_or_default();
    let allegro = if with_models.is_some() { ALLEGRO } else { "" };
    campaign(&format!("{SCENES} {allegro} {packages} --seeds {seeds} {to} --name campaign"))?;
    campaign(&format!(
        "{SCENES} --gravity down --controllers B,A --variants default,no-rolling,no-margin --seeds {few} {to} --name controls"
    ))?;
    campaign(&format!("{SCENES} --gravity down --friction-scale 0.8,1,1.2 --seeds {few} {to} --name friction"))?;
    campaign(&format!("{SCENES} --gravity down --mass-scale 0.5,1,1.5 --seeds {few} {to} --name mass"))?;
    campaign(&format!("{SCENES} --gravity down --speed 1,2 --seeds {few} {to} --name speed"))?;
    // By work, not by time: the same plans on every machine.
    let work = number("SCENE_WORK", 1_000_000)?;
    let scenes = joined(&in_hand_scenes(with_models.is_some())?);
    campaign(&format!(
        "{scenes} {packages} --gravity plan --seeds {scene_seeds} --max-work {work} {to} --name scenes"
    ))?;
    keep(&folder)
}

/// Every in-hand scene that has a plan.
fn in_hand_scenes(real_hands: bool) -> Result<Vec<PathBuf>, String> {
    let mut found = files("scenes", ".toml")?;
    if real_hands {
        for folder in ["allegro", "shadow"] {
            found.extend(files(&format!("scenes/{folder}"), ".toml")?);
        }
        for folder in ["dclaw", "trifinger"] {
            let all = files(&format!("scenes/{folder}"), ".toml")?;
            let is_soft =
                |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("soft_"));
            found.extend(all.into_iter().filter(is_soft));
        }
    }
    let is_in_hand = |path: &PathBuf| {
        let text = fs::read_to_string(path).unwrap_or_default();
        text.contains("task = \"in_hand\"") && !path.ends_with("out_of_reach.toml")
    };
    found.retain(is_in_hand);
    Ok(found)
}

/// Plans of tracking: football and diamond with the defaults; the football as Cherif 1999 has it; the wide hand with gaits; six fingers.
/// An hour or more.
pub fn tracking(_: &[String]) -> Outcome {
    needs_python()?;
    let seeds = number("TRACKING_SEEDS", 20)?;
    let folder = out("replay-tracking")?;
    let runs = [
        ("paper", "football", "B,H", "tracking_paper", "tracking_paper"),
        ("football", "football", "B,H", "", "tracking"),
        ("diamond", "diamond", "B,H", "", "tracking_diamond"),
        ("gaiting", "tracking_sphere_wide", "B,C2,H", "gaiting_replay", "gaiting"),
        ("six", "tracking_sphere_six", "B,C2,H", "six_replay", "tracking_six"),
    ];
    for (part, scene, controllers, settings, name) in runs {
        let settings = match settings {
            "" => String::new(),
            file => format!("--settings docs/benchmarks/{file}.json"),
        };
        let part = folder.join(part);
        campaign(&format!(
            "scenes/{scene}.toml --gravity plan --controllers {controllers} {settings} --seeds {seeds} -o {} --name {name}",
            part.display()
        ))?;
        keep(&part)?;
    }
    Ok(())
}

/// Random queries of the roadmaps of these names, or all, with the defaults, replayed beside the same queries planned without the graph.
pub fn roadmaps(names: &[String]) -> Outcome {
    needs_python()?;
    let program = regrasp()?;
    let folder = out("replay-roadmap")?;
    let queries = number("ROADMAP_QUERIES", 50)?;
    let packages = models().map(|models| package(&models));
    let graphs = crate::bench::rolling_graphs(packages.as_deref()).collect();
    for (name, scene, packages, build) in crate::bench::named(graphs, names, |graph| graph.0)? {
        // Plans of another graph, and replays of these, do not count.
        let own = folder.join(name);
        if own.is_dir() {
            fs::remove_dir_all(&own).map_err(|error| format!("{}: {error}", own.display()))?;
        }
        let (graph, plans) = (folder.join(format!("{name}.roadmap")), own.join("plans"));
        let (graph, plans) = (graph.display(), plans.display());
        regrasp_with(&program, &format!("roadmap build scenes/{scene}.toml {packages} -o {graph} {build}"))?;
        regrasp_with(
            &program,
            &format!(
                "roadmap bench {graph} scenes/{scene}.toml {packages} --queries {queries} --single {queries} --plans {plans}"
            ),
        )?;
        let part = own.join("replays");
        campaign(&format!(
            "scenes/{scene}.toml {packages} --gravity plan --made {plans} --controllers B,C2 --seeds {queries} -o {} --name {name}",
            part.display()
        ))?;
        keep(&part)?;
    }
    Ok(())
}

/// Copies tables and rows of a campaign to the results.
fn keep(folder: &Path) -> Outcome {
    let failed = |error: std::io::Error| format!("{RESULTS}: {error}");
    fs::create_dir_all(RESULTS).map_err(failed)?;
    for ending in [".csv", ".md"] {
        for file in files(&folder.to_string_lossy(), ending)? {
            fs::copy(&file, Path::new(RESULTS).join(file.file_name().unwrap_or_default())).map_err(failed)?;
        }
    }
    crate::bench::pack()
}
