//! The finger gait of a plan as an SVG picture: one row per finger, a bar while it holds, one colour per contact.
//!
//! The same plan gives the same bytes. The horizontal axis counts waypoints: a plan has no clock.

use regrasp::plan::{ContactMode, Plan, SegmentKind};
use std::fmt::Write;

const ROW: f64 = 26.0;
const LEFT: f64 = 90.0;
const WIDTH: f64 = 720.0;
const TOP: f64 = 34.0;
/// Colours that also differ in lightness (Okabe and Ito 2008).
const COLORS: [&str; 7] = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999933"];

/// The picture.
pub fn svg(plan: &Plan) -> String {
    // A waypoint shared by two segments is counted once.
    let n_steps: usize = plan.segments.iter().map(|segment| segment.waypoints.len().saturating_sub(1)).sum();
    let step = WIDTH / n_steps.max(1) as f64;
    let height = TOP + ROW * plan.fingers.len() as f64 + 44.0;
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0} {height:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>",
        LEFT + WIDTH + 20.0
    );
    let _ = writeln!(out, "<text x=\"{LEFT}\" y=\"18\" font-weight=\"bold\">{}</text>", escaped(&title(plan)));
    shade_transfers(plan, step, &mut out);
    for finger in 0..plan.fingers.len() {
        let y = TOP + ROW * finger as f64;
        let _ = writeln!(
            out,
            "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{}</text>",
            LEFT - 8.0,
            y + 16.0,
            escaped(&plan.fingers[finger])
        );
        for (contact, hold) in holds(plan, finger).iter().enumerate() {
            let _ = writeln!(
                out,
                "<rect x=\"{:.2}\" y=\"{:.1}\" width=\"{:.2}\" height=\"{:.1}\" rx=\"2\" fill=\"{}\"/>",
                LEFT + step * hold.0 as f64,
                y + 4.0,
                (step * (hold.1 - hold.0) as f64).max(0.5),
                ROW - 8.0,
                COLORS[contact % COLORS.len()]
            );
        }
    }
    let y = TOP + ROW * plan.fingers.len() as f64 + 16.0;
    let _ = writeln!(
        out,
        "<text x=\"{LEFT}\" y=\"{y:.0}\" fill=\"#555555\">bars: finger holds, one colour per contact; grey: the object moves; \
         {n_steps} steps</text>\n</svg>"
    );
    out
}

fn title(plan: &Plan) -> String {
    let start = regrasp::geometry::Pose::from(&plan.start);
    let goal = regrasp::geometry::Pose::from(&plan.goal);
    let angle = start.rotation.angle_to(&goal.rotation).to_degrees();
    format!(
        "{angle:.0} degrees in {} transfers and {} relocations, seed {}",
        plan.statistics.transfers, plan.statistics.relocations, plan.seed
    )
}

fn shade_transfers(plan: &Plan, step: f64, out: &mut String) {
    let mut at = 0;
    for segment in &plan.segments {
        let length = segment.waypoints.len().saturating_sub(1);
        if segment.kind == SegmentKind::Transfer {
            let _ = writeln!(
                out,
                "<rect x=\"{:.2}\" y=\"{TOP}\" width=\"{:.2}\" height=\"{:.0}\" fill=\"#e8e8e8\"/>",
                LEFT + step * at as f64,
                step * length as f64,
                ROW * plan.fingers.len() as f64
            );
        }
        at += length;
    }
}

/// Stretches of steps in which `finger` holds one contact: first and last step.
fn holds(plan: &Plan, finger: usize) -> Vec<(usize, usize)> {
    let mut found: Vec<(usize, usize, Option<[f64; 3]>)> = Vec::new();
    let mut at = 0;
    for (i, segment) in plan.segments.iter().enumerate() {
        for (j, waypoint) in segment.waypoints.iter().enumerate() {
            if i > 0 && j == 0 {
                continue;
            }
            let Some(contact) = waypoint.contacts.get(finger) else { continue };
            if contact.mode != ContactMode::Free {
                let point = contact.point_in_object;
                match found.last_mut() {
                    Some(last) if last.1 + 1 == at && (last.2 == point || contact.mode == ContactMode::Rolling) => {
                        last.1 = at
                    }
                    _ => found.push((at, at, point)),
                }
            }
            at += 1;
        }
    }
    found.into_iter().map(|(from, to, _)| (from, to)).collect()
}

/// `text` with what means something in SVG escaped, and control characters replaced.
fn escaped(text: &str) -> String {
    regrasp::base::diagnostic::printable(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_leave_their_element() {
        assert_eq!(escaped("</text><script>\u{1b}"), "&lt;/text&gt;&lt;script&gt;\u{fffd}");
    }
}
