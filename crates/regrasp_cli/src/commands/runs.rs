//! Pages of runs of the executor, with the plans of their legs where these stand beside the run.

use crate::args;
use crate::outputs::Outputs;
use crate::pages;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::Plan;
use regrasp::base::files;
use regrasp::plan::format;
use regrasp::viewer::runs::format::{from_json, leg_path};
use regrasp::viewer::runs::html;
use std::path::Path;

/// Writes the page of a run.
pub fn view(arguments: &args::View, bytes: &[u8], written: &Outputs, talk: &Talk) -> Result<(), Stop> {
    let path = &arguments.plan;
    let others = [
        ("--story", &arguments.story),
        ("--png", &arguments.png),
        ("--svg", &arguments.svg),
        ("--with-roadmap", &arguments.with_roadmap),
        ("SCENE", &arguments.scene),
    ];
    if let Some((flag, _)) = others.into_iter().find(|(_, asked)| asked.is_some()) {
        let problem = format!("is for plans; {} is a run", path.display());
        return Err(Stop::argument("A512", flag, problem, "-o FILE.html; plans of legs stand beside the run"));
    }
    let run = from_json(path, bytes)?;
    let plans =
        (0..run.legs.len()).map(|index| plan_of_leg(&leg_path(path, index), written)).collect::<Result<Vec<_>, _>>()?;
    let Some(to) = &arguments.output else { return Ok(()) };
    talk.say(format!(
        "run    {} of {} goals reached, {} legs, {} events",
        run.n_reached(),
        run.goals.len(),
        run.legs.len(),
        run.events.len()
    ));
    pages::write_html(to, &html(&run, &plans, arguments.title.as_deref()), talk)
}

/// The plan of a leg, where its file is there.
fn plan_of_leg(path: &Path, written: &Outputs) -> Result<Option<Plan>, Stop> {
    if !path.exists() {
        return Ok(None);
    }
    written.refuse_inputs([path])?;
    Ok(Some(format::from_json(path, &files::read(path)?)?))
}
