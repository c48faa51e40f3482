//! Pictures of plans in which a whole robot moves: key frames with the swept paths of the wrists, charts, and one page with both.

/// Charts over time.
mod charts;
/// What failed, in the scene.
mod failure;
/// Key frames in one picture.
mod frames;
/// Super graphs.
mod graph;
/// Who holds the object when.
mod holding;
/// What the interactive page is told.
mod replay;
/// The task chart.
mod task_chart;

pub use failure::{ExchangePlaces, Met, MissingHand, RobotFailure, robot_failure_page, robot_failure_picture};
pub use frames::{RobotStoryboard, robot_storyboard};
pub use graph::{WristGraph, corners, wrist_graph};
pub use replay::{ReplayAxis, ReplayBody, ReplayHolder, ReplayKind, ReplayPiece, ReplaySegment, RobotReplay};

use crate::page::{embedded, escape_json, escape_text, hash};
use crate::render::png_file;
use crate::story::pack::base64;
use regrasp_plan::RobotPlan;
use regrasp_plan::check::{Report, RobotAlong};
use regrasp_scene::pick_and_place::PICK_AND_PLACE;
use regrasp_scene::{Scene, State};

/// The page, built from `page/src` by `npm run build`.
const SCRIPT: &str = include_str!("../../page/dist/robot.js");
const STYLE: &str = include_str!("../../page/dist/robot.css");

/// What is told of a plan.
pub struct RobotTelling<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Where everything rests.
    pub state: &'a State,
    /// The plan.
    pub plan: &'a RobotPlan,
    /// What the checker says.
    pub report: &'a Report,
    /// Clearance over time.
    pub along: &'a RobotAlong,
    /// Title; the scene's name where none is given.
    pub title: Option<&'a str>,
}

/// Charts of a plan, each with the name of its file.
pub fn robot_charts(telling: &RobotTelling) -> Vec<(&'static str, String)> {
    let mut charts = Vec::new();
    if telling.plan.task == PICK_AND_PLACE {
        charts.push(("task", task_chart::task(telling.plan)));
        charts.extend(task_chart::fingers(telling.plan).map(|chart| ("fingers", chart)));
    }
    charts.push(("joints", charts::joints(telling.plan, telling.scene)));
    charts.extend(charts::clearance(telling.plan, telling.along).map(|chart| ("clearance", chart)));
    charts
}

/// A chart on the page; the rows of fingers are folded.
fn figure(name: &str, chart: &str) -> String {
    match name {
        "fingers" => format!(
            "<details class=\"card\"><summary>Fingers</summary><figure class=\"timed\">{chart}</figure></details>\n"
        ),
        _ => format!("<figure class=\"card timed\">{chart}</figure>\n"),
    }
}

/// One HTML file that opens from disk and fetches nothing: the robot replayed, charts with the time, key frames, facts. The same input
/// gives the same bytes.
///
/// Err with a message when there is nothing to draw, or settings make no sense.
pub fn robot_page(telling: &RobotTelling, settings: &RobotStoryboard) -> Result<String, String> {
    let RobotTelling { scene, plan, report, .. } = telling;
    let title = escape_text(telling.title.unwrap_or(&scene.name));
    let verdict = if report.accepted() { "accepted" } else { "REJECTED" };
    let clearance = report.min_clearance.as_ref().map_or("-".to_owned(), |clearance| {
        format!("{:.2} mm, {} and {}", 1e3 * clearance.distance, clearance.pair[0], clearance.pair[1])
    });
    let robots: Vec<&str> = plan.robots.iter().map(|robot| robot.name.as_str()).collect();
    let mut facts = vec![
        ("checker", verdict.to_owned()),
        ("robot", robots.join(", ")),
        ("task", plan.task.clone()),
        ("method, seed", format!("{}, {}", plan.method, plan.seed)),
        ("duration", format!("{:.2} s", plan.duration())),
        ("waypoints", plan.waypoints().count().to_string()),
        ("smallest clearance at a waypoint", clearance),
    ];
    facts.extend(report.assumed.iter().map(|assumed| ("taken for granted", assumed.clone())));
    facts.extend(report.violations.iter().map(|violation| ("violation", violation.to_string())));
    let rows = |(label, value): &(&str, String)| {
        format!("<tr><th>{}</th><td>{}</td></tr>\n", escape_text(label), escape_text(value))
    };
    let facts: String = facts.iter().map(rows).collect();
    let picture = png_file::encode(&robot_storyboard(telling.scene, telling.state, plan, settings)?);
    let charts: String = robot_charts(telling).into_iter().map(|(name, chart)| figure(name, &chart)).collect();
    let replay = RobotReplay::of(telling)?;
    let data = serde_json::to_string(&replay).map_err(|error| format!("the replay cannot be written: {error}"))?;
    let (script, style) = (embedded(SCRIPT, "script"), embedded(STYLE, "style"));
    let policy = format!(
        "default-src 'none'; script-src '{}'; style-src '{}'; img-src data:; base-uri 'none'; form-action 'none'",
        hash(&script),
        hash(&style)
    );
    let good = if report.accepted() { "good" } else { "bad" };
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n\
         <header class=\"top\"><h1>{title}</h1><span class=\"verdict {good}\"><strong>{verdict}</strong></span></header>\n\
         <main>\n<div class=\"left\" id=\"replay\"><noscript>The replay needs JavaScript, which is switched off.</noscript></div>\n\
         <div class=\"right\">\n{charts}<figure class=\"card\"><img alt=\"Key frames; lines are the paths of the wrists\" \
         src=\"data:image/png;base64,{}\"></figure>\n<section class=\"card facts\"><table>\n{facts}</table></section>\n</div>\n</main>\n\
         <script type=\"application/json\" id=\"story\">{}</script>\n<script>{script}</script>\n</body>\n</html>\n",
        base64(&picture),
        escape_json(&data)
    ))
}
