//! `regrasp view`: a page of a plan, and pictures.
//!
//! Grasp lists get a gallery, runs of the executor the page of what happened.
//!
//! A plan that the checker rejects gets its page too: it says so, and shows where.

use crate::args::{self, Common};
use crate::commands::check::scene_of;
use crate::commands::grasp_files;
use crate::commands::motion;
use crate::commands::pictures;
use crate::commands::runs;
use crate::interrupt;
use crate::judge;
use crate::load;
use crate::outputs::{Output, Outputs};
use crate::pages;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::files;
use regrasp::grasp::list::format::is_list;
use regrasp::pictures::roadmap_story;
use regrasp::plan::format;
use regrasp::planners::in_hand::roadmap::GraspRoadmap;
use regrasp::viewer::runs::format::is_run;
use regrasp::viewer::story::{Outcome, Telling};
use serde_json::json;
use std::path::Path;

/// Reads, judges, writes.
pub fn run(arguments: &args::View, common: &Common, talk: &Talk) -> Result<(), Stop> {
    // The flag is not asked here: the process ends by itself shortly after Ctrl-C.
    interrupt::flag()?;
    let named = [("--output", &arguments.output), ("--story", &arguments.story)];
    let named = named.into_iter().filter_map(|(argument, path)| Some(Output::new(argument, path.as_deref()?)));
    let written = Outputs::new(named.chain(pictures::outputs(arguments)))?;
    let own = [Some(arguments.plan.as_path()), arguments.scene.as_deref(), arguments.with_roadmap.as_deref()];
    written.refuse_inputs(own.into_iter().flatten())?;
    arguments.output.as_deref().map_or(Ok(()), refuse_picture)?;
    pictures::make_folder(arguments)?;
    let bytes = files::read(&arguments.plan)?;
    if is_list(&bytes) {
        return grasp_files::view(arguments, &bytes, common, talk);
    }
    if is_run(&bytes) {
        return runs::view(arguments, &bytes, &written, talk);
    }
    if format::is_robot_plan(&bytes) {
        return motion::view(arguments, &bytes, &written, common, talk);
    }
    let plan = format::from_json(&arguments.plan, &bytes)?;
    let scene_path = scene_of(&arguments.plan, &plan, arguments.scene.as_deref(), "regrasp view PLAN SCENE")?;
    let loaded = arguments.judging.scene(load::scene_of_plan(&scene_path, &plan, common, None, talk)?);
    written.refuse_inputs(loaded.scene.inputs.iter().map(|input| input.path.as_path()))?;
    let roadmap = match &arguments.with_roadmap {
        Some(path) => {
            let roadmap = GraspRoadmap::read(path)?;
            roadmap.refuse_other_scene(path, &loaded.view())?;
            Some(roadmap_story(&roadmap, &loaded.view(), &plan))
        }
        None => None,
    };
    let report = judge::judge(&loaded, &plan, &arguments.judging, talk)?;
    let packages = load::options(common).resolve;
    let story = pages::story(&Telling {
        task: loaded.manipulation(),
        query: None,
        outcome: Outcome::Planned { plan: &plan, report: &report },
        title: arguments.title.as_deref(),
        facts: Vec::new(),
        roadmap,
        packages: &packages,
    })?;
    pictures::write(arguments, &story, talk)?;
    if let Some(path) = &arguments.story {
        files::write_atomic(path, story.to_json().as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
        talk.event("written", json!({ "story": path }));
        talk.say(format!("wrote  {}", path.display()));
    }
    if let Some(path) = &arguments.output {
        pages::write(path, &story, talk)?;
    }
    Ok(())
}

/// Refuses to write a page into a file that is named as a picture (`A505`).
fn refuse_picture(page: &Path) -> Result<(), Stop> {
    let suffix = page.extension().and_then(|suffix| suffix.to_str()).unwrap_or_default().to_ascii_lowercase();
    if !["png", "svg", "jpg", "jpeg", "gif"].contains(&suffix.as_str()) {
        return Ok(());
    }
    let problem = format!("is {}, but this argument writes a page of HTML", page.display());
    Err(Stop::argument("A505", "--output", problem, "FILE.html; pictures are written by --png FILE.png and --svg DIR"))
}
