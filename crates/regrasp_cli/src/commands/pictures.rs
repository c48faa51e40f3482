//! Pictures made without a browser: the storyboard, the charts and the graph.

use super::rows::make_folder_of;
use crate::args;
use crate::outputs::Output;
use crate::pages;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::grouped;
use regrasp::base::{Diagnostic, Place, files};
use regrasp::pictures::{failure_facts, failure_story, reached_story, robot_failure};
use regrasp::scene::LoadedScene;
use regrasp::viewer::render::png_file;
use regrasp::viewer::robots::{robot_failure_page, robot_failure_picture};
use regrasp::viewer::story::{RoadmapStory, Story};
use regrasp::viewer::storyboard::{StoryboardError, StoryboardSettings, storyboard};
use regrasp::viewer::{charts, roadmap_picture::roadmap_picture};
use regrasp::{Failure, Query};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Names of the pictures of a failure: the causes; what the search of one hand had reached; the nearest miss of a robot in its scene.
pub const OF_FAILURE: [&str; 3] = ["causes.svg", "reached.svg", "scene.png"];
/// Name of the picture of a graph in a folder of charts.
const OF_ROADMAP: &str = "roadmap.svg";

/// The pictures that the arguments ask for.
pub fn outputs(arguments: &args::View) -> impl Iterator<Item = Output> {
    let storyboard = arguments.png.iter().map(|path| Output::new("--png", path));
    let names = || charts::NAMES.iter().map(|name| format!("{name}.svg")).chain([OF_ROADMAP.to_owned()]);
    let in_folder = move |folder: &PathBuf| {
        let folder = folder.clone();
        names().map(move |name| Output::beside("--svg", folder.join(name)))
    };
    storyboard.chain(arguments.svg.iter().flat_map(in_folder))
}

/// Makes the folder of the charts, before anything else is made.
pub fn make_folder(arguments: &args::View) -> Result<(), Stop> {
    match &arguments.svg {
        Some(folder) => std::fs::create_dir_all(folder).map_err(|error| Stop::unwritable(folder, &error)),
        None => Ok(()),
    }
}

/// Writes the storyboard and the charts that are asked for.
pub fn write(arguments: &args::View, story: &Story, talk: &Talk) -> Result<(), Stop> {
    if let Some(path) = &arguments.png {
        let settings = StoryboardSettings {
            frames: arguments.frames,
            width: arguments.width,
            columns: arguments.columns,
            collision: arguments.collision,
            ..StoryboardSettings::default()
        };
        let bytes = storyboard(story, &settings).map_err(|error| match error {
            StoryboardError::Settings(problem) => Stop::argument("A505", "--png", problem, "a picture that fits"),
            StoryboardError::Plan(problem) => {
                Stop::BadInput(Diagnostic::new("C408", Place::file(&arguments.plan), problem).into())
            }
        })?;
        put(path, &bytes, talk)?;
    }
    if let Some(folder) = &arguments.svg {
        for (name, chart) in charts::all(story) {
            put(&folder.join(name).with_extension("svg"), chart.as_bytes(), talk)?;
        }
        if let Some(roadmap) = &story.roadmap {
            let picture = roadmap_picture(roadmap, &format!("Graph of {}", story.title));
            put(&folder.join(OF_ROADMAP), picture.as_bytes(), talk)?;
        }
    }
    Ok(())
}

/// Writes a small storyboard of a story.
pub fn write_storyboard(path: &Path, story: &Story, talk: &Talk) -> Result<(), Stop> {
    let small = StoryboardSettings { frames: 4, width: 1000, supersampling: 2, ..StoryboardSettings::default() };
    let bytes = storyboard(story, &small).map_err(|error| Stop::Internal(error.to_string()))?;
    put(path, &bytes, talk)
}

/// Writes what there is to be seen of a failure: the causes as bars, and the graph that the search had reached.
pub fn write_failure(folder: &Path, failure: &Failure, query: &Query, talk: &Talk) -> Result<(), Stop> {
    std::fs::create_dir_all(folder).map_err(|error| Stop::unwritable(folder, &error))?;
    if let Some(chart) = charts::causes(&failure_story(failure)) {
        put(&folder.join(OF_FAILURE[0]), chart.as_bytes(), talk)?;
    }
    if let Some(reached) = reached_story(failure, query.goal()) {
        let picture = roadmap_picture(&reached, "Grasps that the search reached");
        put(&folder.join(OF_FAILURE[1]), picture.as_bytes(), talk)?;
    }
    Ok(())
}

/// Writes what there is to be seen of a failed task of a whole robot into a folder and onto a page, where they are asked for: the nearest
/// miss in its scene, and the causes as bars.
pub fn write_robot_failure(
    (folder, page): (Option<&Path>, Option<&Path>),
    loaded: &LoadedScene,
    query: &Query,
    failure: &Failure,
    talk: &Talk,
) -> Result<(), Stop> {
    let story = failure_story(failure);
    let around = (&loaded.scene, &loaded.state);
    let Some(drawn) = robot_failure(around, query, failure, &story) else { return Ok(()) };
    if let Some(page) = page {
        let html = robot_failure_page(&drawn, &failure_facts(failure), &loaded.scene.name).map_err(Stop::Internal)?;
        pages::write_html(page, &html, talk)?;
    }
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).map_err(|error| Stop::unwritable(folder, &error))?;
        if let Some(chart) = charts::causes(&story) {
            put(&folder.join(OF_FAILURE[0]), chart.as_bytes(), talk)?;
        }
        let picture = robot_failure_picture(&drawn).map_err(Stop::Internal)?;
        put(&folder.join(OF_FAILURE[2]), &png_file::encode(&picture), talk)?;
    }
    Ok(())
}

/// Writes the picture of a graph.
pub fn write_roadmap(path: &Path, roadmap: &RoadmapStory, title: &str, talk: &Talk) -> Result<(), Stop> {
    make_folder_of(path)?;
    put(path, roadmap_picture(roadmap, title).as_bytes(), talk)
}

/// Writes a file and says where it is.
pub fn put(path: &Path, bytes: &[u8], talk: &Talk) -> Result<(), Stop> {
    files::write_atomic(path, bytes).map_err(|error| Stop::unwritable(path, &error))?;
    let sha256 = files::sha256(bytes);
    talk.event("written", json!({ "picture": path, "bytes": bytes.len(), "sha256": sha256 }));
    talk.say(format!("wrote  {}   {} bytes", path.display(), grouped(bytes.len() as u64)));
    Ok(())
}
