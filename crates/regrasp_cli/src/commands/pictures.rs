//! Pictures made without a browser: the storyboard, the charts and the graph.

use super::bench::make_folder_of;
use super::plan::{refuse_input, refuse_unwritable};
use crate::args;
use crate::stop::Stop;
use crate::talk::{Talk, grouped};
use regrasp::base::{Diagnostic, Place, files};
use regrasp::told;
use regrasp::viewer::story::{RoadmapStory, Story};
use regrasp::viewer::storyboard::{StoryboardError, StoryboardSettings, storyboard};
use regrasp::viewer::{charts, roadmap_picture::roadmap_picture};
use regrasp::{Failure, InHandQuery};
use serde_json::json;
use std::path::Path;

/// Refuses what cannot be written, before anything is made; `inputs` are the files that the command reads.
pub fn refuse<'a>(arguments: &args::View, inputs: impl Iterator<Item = &'a Path> + Clone) -> Result<(), Stop> {
    if let Some(path) = &arguments.png {
        refuse_unwritable(path)?;
        refuse_input(path, inputs)?;
    }
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
            put(&folder.join("roadmap.svg"), picture.as_bytes(), talk)?;
        }
    }
    Ok(())
}

/// Writes what there is to be seen of a failure: the causes as bars, and the graph that the search had reached.
pub fn write_failure(folder: &Path, failure: &Failure, query: &InHandQuery, talk: &Talk) -> Result<(), Stop> {
    std::fs::create_dir_all(folder).map_err(|error| Stop::unwritable(folder, &error))?;
    if let Some(chart) = charts::causes(&told::failure_story(failure)) {
        put(&folder.join("causes.svg"), chart.as_bytes(), talk)?;
    }
    if let Some(reached) = told::reached_story(failure, &query.world_from_object_goal) {
        let picture = roadmap_picture(&reached, "Grasps that the search reached");
        put(&folder.join("reached.svg"), picture.as_bytes(), talk)?;
    }
    Ok(())
}

/// Writes the picture of a graph.
pub fn write_roadmap(path: &Path, roadmap: &RoadmapStory, title: &str, talk: &Talk) -> Result<(), Stop> {
    make_folder_of(path)?;
    put(path, roadmap_picture(roadmap, title).as_bytes(), talk)
}

/// Writes a file and says where it is.
fn put(path: &Path, bytes: &[u8], talk: &Talk) -> Result<(), Stop> {
    files::write_atomic(path, bytes).map_err(|error| Stop::unwritable(path, &error))?;
    let sha256 = files::sha256(bytes);
    talk.event("written", json!({ "picture": path, "bytes": bytes.len(), "sha256": sha256 }));
    talk.say(format!("wrote  {}   {} bytes", path.display(), grouped(bytes.len() as u64)));
    Ok(())
}
