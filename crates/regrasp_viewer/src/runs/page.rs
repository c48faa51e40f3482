//! The page of a run: how far the object was from the plans, what went wrong, what was done about it, which goals were reached. One HTML
//! file that opens from disk, fetches nothing and runs no script.

use super::chart::{Curve, curves, holding};
use super::{Run, Sample};
use crate::page::{embedded, escape_text, hash};
use crate::palette;
use regrasp_plan::Plan;
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;margin:1.5rem auto;max-width:72rem;padding:0 1rem}\
h1{font-size:1.4rem;margin:0}h2{font-size:1.1rem;margin:1.6rem 0 .3rem}\
svg{display:block;width:100%;height:auto;margin:.8rem 0;border-radius:4px}\
table{border-collapse:collapse;width:100%;font-size:13px}th,td{text-align:left;padding:.15rem .6rem .15rem 0;border-bottom:1px solid #8884}\
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}.no{color:#c1121f}.yes{color:#00703c}\
.replan{color:#d55e00}.hold{color:#e69f00}.give-up{color:#c1121f}";

/// The page of `run`; the same input gives the same bytes. `plans` has the plan of every leg, where it is known.
pub fn html(run: &Run, plans: &[Option<Plan>], title: Option<&str>) -> String {
    let title = escape_text(&title.map_or_else(|| format!("Run of {}", run.scene), str::to_owned));
    let style = embedded(STYLE, "style");
    let policy = format!("default-src 'none'; style-src '{}'; base-uri 'none'; form-action 'none'", hash(&style));
    let mut body = format!("<h1>{title}</h1>\n");
    add_summary(run, plans, &mut body);
    add_charts(run, plans, &mut body);
    add_goals(run, &mut body);
    add_events(run, &mut body);
    add_legs(run, plans, &mut body);
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

fn add_summary(run: &Run, plans: &[Option<Plan>], body: &mut String) {
    let (first, last) = run.span();
    let ended = match run.message.as_str() {
        "" => run.status.words().to_owned(),
        why => format!("{}: {}", run.status.words(), escape_text(why)),
    };
    let _ = writeln!(
        body,
        "<p>{} of {} goals reached, {} replans, {:.1} s; {ended}.</p>\n\
         <p>Grey: a leg moves the object; white: the hand holds. Vertical lines are events, coloured by what was done: \
         <span class=\"replan\">replan</span>, <span class=\"hold\">hold</span>, <span class=\"give-up\">give up</span>. Green \
         marks under a chart: a goal is reached.</p>",
        run.n_reached(),
        run.goals.len(),
        run.n_replans(),
        last - first,
    );
    let n_plans = plans.iter().flatten().count();
    if n_plans < run.legs.len() {
        let _ = writeln!(body, "<p>Plans of {} of {} legs were found beside the run.</p>", n_plans, run.legs.len());
    }
}

fn add_charts(run: &Run, plans: &[Option<Plan>], body: &mut String) {
    fn curve<'a>(name: &str, color: &'static str, value: impl Fn(&Sample) -> Option<f64> + 'a) -> Curve<'a> {
        Curve { name: name.into(), color, value: Box::new(value) }
    }
    let [estimated, real] = [palette::FINGERS[0], palette::FINGERS[5]];
    let knows_truth = run.samples.iter().any(|sample| sample.true_distance.is_some());
    let pair = |one: Curve<'static>, other: Curve<'static>| {
        if knows_truth { vec![one, other] } else { vec![one] }
    };
    body.extend(holding(run, plans));
    body.push_str(&curves(
        run,
        "Object: distance from the plan, mm",
        &pair(
            curve("estimated", estimated, |sample| Some(1e3 * sample.distance)),
            curve("real", real, |sample| sample.true_distance.map(|distance| 1e3 * distance)),
        ),
    ));
    body.push_str(&curves(
        run,
        "Object: angle from the plan, degrees",
        &pair(
            curve("estimated", estimated, |sample| Some(sample.angle.to_degrees())),
            curve("real", real, |sample| sample.true_angle.map(f64::to_degrees)),
        ),
    ));
    let slip = curve("slip", estimated, |sample| Some(1e3 * sample.slip));
    body.push_str(&curves(run, "Slip of the fingertip that slipped farthest, mm", &[slip]));
    let joint = curve("joint", estimated, |sample| Some(sample.joint_error.to_degrees()));
    body.push_str(&curves(run, "Joint farthest from its command, degrees", &[joint]));
    let n_fingers = run.samples.iter().find_map(|sample| sample.forces.as_ref().map(Vec::len)).unwrap_or(0);
    if n_fingers > 0 {
        let names = plans.iter().flatten().next().map(|plan| plan.fingers.clone()).unwrap_or_default();
        let fingers: Vec<Curve> = (0..n_fingers)
            .map(|finger| {
                let name = names.get(finger).cloned().unwrap_or_else(|| format!("finger {}", finger + 1));
                curve(&name, palette::color(finger), move |sample: &Sample| {
                    sample.forces.as_ref().and_then(|forces| forces.get(finger).copied())
                })
            })
            .collect();
        body.push_str(&curves(run, "Normal force felt, N", &fingers));
    }
}

/// A table; texts are escaped by the caller. Columns whose name ends with a unit hold numbers.
fn add_table(title: &str, heads: &[&str], rows: impl Iterator<Item = Vec<String>>, body: &mut String) {
    let _ = writeln!(body, "<h2>{title}</h2>");
    let mut rows = rows.peekable();
    if rows.peek().is_none() {
        body.push_str("<p>None.</p>\n");
        return;
    }
    let class = |head: &str| if head.contains(", ") { " class=\"n\"" } else { "" };
    body.push_str("<table>\n<tr>");
    for head in heads {
        let _ = write!(body, "<th{}>{head}</th>", class(head));
    }
    body.push_str("</tr>\n");
    for row in rows {
        body.push_str("<tr>");
        for (head, cell) in heads.iter().zip(row) {
            let _ = write!(body, "<td{}>{cell}</td>", class(head));
        }
        body.push_str("</tr>\n");
    }
    body.push_str("</table>\n");
}

fn millimetres(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{:.2}", 1e3 * value))
}

fn degrees(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{:.2}", value.to_degrees()))
}

fn add_goals(run: &Run, body: &mut String) {
    let heads = [
        "goal",
        "reached",
        "turn, deg",
        "legs",
        "time, s",
        "motion, s",
        "off, mm",
        "off, deg",
        "really, mm",
        "really, deg",
        "why not",
    ];
    let rows = run.goals.iter().enumerate().map(|(index, goal)| {
        vec![
            (index + 1).to_string(),
            if goal.reached { "<span class=\"yes\">yes</span>" } else { "<span class=\"no\">no</span>" }.to_owned(),
            format!("{:.0}", goal.turn.to_degrees()),
            goal.legs.to_string(),
            format!("{:.1}", goal.time - goal.start_time),
            format!("{:.1}", goal.motion_time),
            millimetres(Some(goal.distance)),
            degrees(Some(goal.angle)),
            millimetres(goal.true_distance),
            degrees(goal.true_angle),
            escape_text(&goal.why_not),
        ]
    });
    add_table("Goals", &heads, rows, body);
}

fn add_events(run: &Run, body: &mut String) {
    let rows = run.events.iter().map(|event| {
        vec![
            format!("{:.2}", event.time),
            escape_text(&event.kind),
            escape_text(&event.message),
            event.answer.words().to_owned(),
            (event.goal + 1).to_string(),
            if event.leg < 0 { String::new() } else { (event.leg + 1).to_string() },
        ]
    });
    add_table("Events", &["time, s", "event", "what", "answer", "goal", "leg"], rows, body);
}

fn add_legs(run: &Run, plans: &[Option<Plan>], body: &mut String) {
    let heads = [
        "leg",
        "goal",
        "begins, s",
        "motion, s",
        "relocations",
        "search, ms",
        "check, ms",
        "planned",
        "start moved, mm",
        "by, deg",
        "free fingers",
    ];
    let rows = run.legs.iter().enumerate().map(|(index, leg)| {
        let plan = plans.get(index).and_then(Option::as_ref);
        vec![
            (index + 1).to_string(),
            (leg.goal + 1).to_string(),
            format!("{:.2}", leg.start_time),
            format!("{:.2}", leg.duration),
            plan.map_or_else(String::new, |plan| plan.n_relocations().to_string()),
            format!("{:.0}", 1e3 * leg.search_seconds),
            format!("{:.0}", 1e3 * leg.check_seconds),
            if leg.prepared { "while the leg before ran" } else { "at rest" }.to_owned(),
            millimetres(Some(leg.moved.object)),
            degrees(Some(leg.moved.object_turn)),
            escape_text(&leg.free.join(", ")),
        ]
    });
    add_table("Legs", &heads, rows, body);
}
