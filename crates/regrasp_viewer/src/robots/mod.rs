//! Pictures of plans in which a whole robot moves: key frames with the swept paths of the wrists, charts, and one page with both.

/// Charts over time.
mod charts;
/// Key frames in one picture.
mod frames;

pub use frames::{RobotStoryboard, robot_storyboard};

use crate::page::escape_text;
use crate::render::png_file;
use crate::story::pack::base64;
use regrasp_plan::RobotPlan;
use regrasp_plan::check::{Report, RobotAlong};
use regrasp_scene::{Scene, State};

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
    let mut charts = vec![("joints", charts::joints(telling.plan, telling.scene))];
    charts.extend(charts::clearance(telling.plan, telling.along).map(|chart| ("clearance", chart)));
    charts
}

/// One HTML file that opens from disk: facts, key frames with the paths of the wrists, charts. The same input gives the same bytes.
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
    let charts: String =
        robot_charts(telling).into_iter().map(|(_, chart)| format!("<figure>{chart}</figure>\n")).collect();
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; img-src data:; \
         base-uri 'none'; form-action 'none'\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style>body{{font-family:sans-serif;max-width:1540px;margin:1em auto;padding:0 1em;color:#222;background:#fff}}\
         th{{text-align:left;padding-right:1em;font-weight:normal;color:#555;vertical-align:top}}\
         figure{{margin:1em 0}}img,svg{{max-width:100%;height:auto}}</style>\n</head>\n<body>\n<h1>{title}</h1>\n\
         <table>\n{facts}</table>\n<figure><img alt=\"Key frames; lines are the paths of the wrists\" \
         src=\"data:image/png;base64,{}\"></figure>\n{charts}</body>\n</html>\n",
        base64(&picture)
    ))
}
