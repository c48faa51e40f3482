//! Roadmaps of robots: what `roadmap build`, `roadmap info`, `roadmap picture` and `plan` do with them.

use crate::args::{self, Common};
use crate::commands::written::Limits;
use crate::commands::{pictures, task_grasps};
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{duration, grouped};
use regrasp::base::{Diagnostic, Place, files};
use regrasp::pictures::wrist_graph_of;
use regrasp::planners::FailureKind;
use regrasp::robot_roadmap::{Asked, RobotAnswer, RobotRoadmap};
use regrasp::scene::LoadedScene;
use regrasp::tasks::RoadmapBuildSettings;
use regrasp::viewer::robots::wrist_graph;
use regrasp::{Budget, PlannerSettings, Query};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Builds the roadmap of the robot of a scene's first task and saves it.
pub fn build(
    arguments: &args::RoadmapBuild,
    loaded: &LoadedScene,
    limits: &Limits,
    common: &Common,
    talk: &Talk,
) -> Result<(), Stop> {
    let query = loaded.task().query(arguments.seed);
    let settings = load::settings_in(arguments.settings.as_deref(), loaded.task())?;
    let of_build =
        arguments.build_settings.as_deref().map_or_else(|| Ok(RoadmapBuildSettings::default()), load::settings_file)?;
    let lists = match &query {
        Query::PickAndPlace(of_task) => {
            task_grasps::lists(&arguments.scene, (loaded, of_task), arguments.seed, limits, common, talk)?
        }
        _ => Vec::new(),
    };
    let asked = Asked { scene: &loaded.scene, state: &loaded.state, query: &query, lists: &lists };
    let started = Instant::now();
    let budget = Budget { cancelled: Arc::clone(&limits.cancelled), ..Budget::unlimited() };
    let roadmap =
        RobotRoadmap::build(&asked, &settings, &of_build, arguments.seed, &budget).map_err(
            |failure| match failure.kind {
                FailureKind::Interrupted => Stop::Interrupted,
                _ => Stop::NoPlan(Box::new(failure)),
            },
        )?;
    let seconds = started.elapsed().as_secs_f64();
    talk.say(format!("graph  {}   {}", roadmap.in_words(), duration(seconds)));
    save(&roadmap, &arguments.output, seconds, talk)
}

/// Writes a roadmap whole or not at all; `seconds` is how long it took to make.
fn save(roadmap: &RobotRoadmap, path: &Path, seconds: f64, talk: &Talk) -> Result<(), Stop> {
    let text = roadmap.to_json();
    files::write_atomic(path, text.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
    let sha256 = files::sha256(text.as_bytes());
    talk.say(format!("wrote  {}   {} bytes   sha256 {sha256}", path.display(), grouped(text.len() as u64)));
    talk.event(
        "written",
        json!({ "format": "roadmap", "path": path, "bytes": text.len(), "sha256": sha256, "seconds": seconds }),
    );
    Ok(())
}

/// A roadmap, and what it becomes by an answer.
pub struct Grown {
    path: PathBuf,
    before: String,
    /// None where the answer has nothing new.
    now: Option<RobotRoadmap>,
    seconds: f64,
}

impl Grown {
    /// The roadmap with what an answer has and it has not.
    pub fn by(
        (path, roadmap): (PathBuf, RobotRoadmap),
        (asked, settings): (&Asked, &PlannerSettings),
        answer: &RobotAnswer,
    ) -> Result<Self, Stop> {
        let started = Instant::now();
        let now = roadmap.grown_by(asked, settings, answer).map_err(|failure| Stop::NoPlan(Box::new(failure)))?;
        Ok(Grown { path, before: roadmap.in_words(), now, seconds: started.elapsed().as_secs_f64() })
    }

    /// Saves it. Says so where there is nothing new, and writes nothing.
    pub fn save(self, talk: &Talk) -> Result<(), Stop> {
        let Grown { path, before, now, seconds } = self;
        talk.event("grown", json!({ "path": path, "is_new": now.is_some() }));
        let Some(now) = now else {
            talk.say("grown  by nothing: the plan has no way and no exchange that is new to the roadmap");
            return Ok(());
        };
        talk.say(format!("grown  {}, before {before}   {}", now.in_words(), duration(seconds)));
        save(&now, &path, seconds, talk)
    }
}

/// True where a file holds the roadmap of a robot: those of hands are binary.
pub fn is_of_robot(path: &Path) -> bool {
    std::fs::File::open(path).is_ok_and(|mut file| {
        let mut first = [0];
        std::io::Read::read_exact(&mut file, &mut first).is_ok() && first[0] == b'{'
    })
}

/// Says what such a roadmap holds.
pub fn info(path: &Path, talk: &Talk) -> Result<(), Stop> {
    let roadmap = RobotRoadmap::load(path)?;
    let kind = match roadmap {
        RobotRoadmap::Motion(_) => "motion",
        RobotRoadmap::Task(_) => "pick_and_place",
    };
    if talk.is_json() {
        talk.event("roadmap", json!({ "path": path, "task": kind, "holds": roadmap.in_words() }));
    } else {
        talk.data(&format!("file        {}\ntask        {kind}\nholds       {}\n", path.display(), roadmap.in_words()));
    }
    Ok(())
}

/// Draws such a roadmap in the scene that it was built for.
///
/// Errors: no scene (`A507`); a scene of a single hand, or whose robot lacks a joint of the roadmap (`R616`).
pub fn picture(arguments: &args::RoadmapPicture, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let path = &arguments.roadmap;
    let Some(scene) = &arguments.scene else {
        let problem = "is the roadmap of a robot, and no scene is named";
        let fix = "name the scene that it was built for: regrasp roadmap picture ROADMAP SCENE -o FILE.svg";
        return Err(Stop::BadInput(Diagnostic::new("A507", Place::file(path), problem).fix(fix).into()));
    };
    let roadmap = RobotRoadmap::load(path)?;
    let loaded = load::scene_by(scene, common, None, talk)?;
    let query = loaded.task().query(arguments.seed);
    let Some(graph) = wrist_graph_of(&roadmap, &loaded.scene, &query) else {
        return Err(Stop::BadInput(roadmap.refuse_other(path, "the robot")));
    };
    let title = format!("Roadmap of {}: {}", loaded.scene.name, roadmap.in_words());
    pictures::put(&arguments.output, wrist_graph(&graph, &title).as_bytes(), talk)
}

/// The roadmap that a plan uses, with its path: the one that was named, or the one beside the scene. One beside the scene that was built with other
/// inputs is left out, with a note.
///
/// Errors: a file that is no roadmap; one that was named, built with other inputs (`R616`).
pub fn find(
    scene: &Path,
    named: Option<&Path>,
    (asked, settings): (&Asked, &PlannerSettings),
    talk: &Talk,
) -> Result<Option<(PathBuf, RobotRoadmap)>, Stop> {
    let path: PathBuf = match named {
        Some(path) => path.to_owned(),
        None => scene.with_extension("roadmap.json"),
    };
    if named.is_none() && !path.is_file() {
        return Ok(None);
    }
    let started = Instant::now();
    let roadmap = RobotRoadmap::load(&path)?;
    let differs = roadmap.differs(asked, settings).map_err(|failure| Stop::NoPlan(Box::new(failure)))?;
    let Some(what) = differs else {
        let seconds = started.elapsed().as_secs_f64();
        talk.say(format!("graph  {}   {}   loaded in {}", path.display(), roadmap.in_words(), duration(seconds)));
        talk.event("roadmap", json!({ "path": path, "seconds": seconds }));
        return Ok(Some((path, roadmap)));
    };
    if named.is_some() {
        return Err(Stop::BadInput(roadmap.refuse_other(&path, what)));
    }
    talk.note(&format!("{} was built with other inputs and is not used: {what} differs", path.display()));
    Ok(None)
}
