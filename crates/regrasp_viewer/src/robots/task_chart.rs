//! The task chart: who holds the object when, and which fingers touch it.

use super::holding::{EventKind, events, finger_bars, rows};
use super::replay::kind_name;
use crate::charts::svg::{Anchor, INK, SHADE, SOFT, Scale, Svg, cut};
use crate::charts::time_axis::{self, LEFT, RIGHT, SHEET, TOP};
use crate::palette;
use regrasp_plan::RobotPlan;

const ROW: f64 = 30.0;
/// Free room over and under a bar.
const GAP: f64 = 7.0;
/// Height of the rows of fingers, and the room over and under their bars.
const FINGER_ROW: f64 = 18.0;
const FINGER_GAP: f64 = 4.0;
/// Height of the strip with the kinds of segments, and of the line that explains.
const KINDS: f64 = 22.0;
const KEY: f64 = 24.0;
/// Width of a letter in the strip.
const LETTER: f64 = 5.4;

fn time_of(plan: &RobotPlan) -> Scale {
    let first = plan.waypoints().next().map_or(0.0, |waypoint| waypoint.time);
    Scale::new(first, first + plan.duration(), LEFT, RIGHT)
}

/// A row for every hand and support, a bar while it holds; marks where a hand takes the object, where hands exchange it, where it is put
/// down. The strip above names the segments.
pub fn task(plan: &RobotPlan) -> String {
    let (time, rows) = (time_of(plan), rows(plan));
    let top = TOP + KINDS;
    let bottom = top + ROW * rows.len() as f64;
    let mut svg = Svg::new(SHEET, bottom + time_axis::AXIS + KEY);
    let objects = plan.objects.join(", ");
    time_axis::heading(&mut svg, "Task", &format!("who holds {}, {:.1} s", cut(&objects, 30), plan.duration()));
    for (number, segment) in plan.segments.iter().enumerate() {
        let [first, last] = [segment.waypoints.first(), segment.waypoints.last()].map(|w| w.map_or(0.0, |w| w.time));
        let (x, end) = (time.at(first), time.at(last));
        let fill = if number % 2 == 0 { SHADE } else { "#ffffff" };
        svg.rect([x, TOP], [end - x, bottom - TOP], fill, &format!("class=\"{}\"", kind_name(segment.kind)));
        let name = kind_name(segment.kind);
        if end - x > LETTER * name.len() as f64 + 2.0 {
            svg.text(name, [(x + end) / 2.0, TOP + 15.0], Anchor::Middle, SOFT, "font-size=\"10\"");
        }
    }
    for (k, row) in rows.iter().enumerate() {
        let y = top + ROW * k as f64;
        let color = row.color(k);
        svg.text(&cut(&row.name, 16), [LEFT - 8.0, y + ROW / 2.0 + 4.0], Anchor::End, INK, "");
        svg.line([LEFT, y + ROW / 2.0], [RIGHT, y + ROW / 2.0], "#c8c8c8", 1.0, "stroke-dasharray=\"1 4\"");
        for [from, until] in &row.bars {
            let (x, end) = (time.at(*from), time.at(*until));
            svg.rect([x, y + GAP], [end - x, ROW - 2.0 * GAP], color, "");
        }
    }
    for event in events(plan) {
        let Some(k) = rows.iter().position(|row| row.name == event.holder) else { continue };
        mark(&mut svg, event.kind, [time.at(event.time), top + ROW * k as f64]);
    }
    time_axis::frame(&mut svg, TOP, bottom);
    time_axis::draw(&mut svg, &time, bottom);
    key(&mut svg, bottom + time_axis::AXIS + 10.0);
    svg.finish("Task: who holds the object")
}

/// A mark in a row that begins at `y`.
fn mark(svg: &mut Svg, kind: EventKind, [x, y]: [f64; 2]) {
    let (over, middle, under) = (y + GAP, y + ROW / 2.0, y + ROW - GAP);
    let rim = "stroke=\"#ffffff\" stroke-width=\"0.8\"";
    match kind {
        EventKind::Grasp => svg.polygon(&[[x - 4.5, over - 6.0], [x + 4.5, over - 6.0], [x, over + 2.0]], INK, rim),
        EventKind::Exchange => {
            svg.polygon(&[[x - 6.0, middle], [x, middle - 6.0], [x + 6.0, middle], [x, middle + 6.0]], INK, rim);
        }
        EventKind::Place => svg.rect([x - 4.0, middle - 4.0], [8.0, 8.0], INK, rim),
        EventKind::Release => {
            svg.polygon(
                &[[x - 4.5, under + 5.0], [x + 4.5, under + 5.0], [x, under - 2.0]],
                "#ffffff",
                "stroke=\"#222222\"",
            );
        }
        EventKind::Lift => {}
    }
}

fn key(svg: &mut Svg, y: f64) {
    let mut x = LEFT;
    let kinds = [
        ("grasp", EventKind::Grasp),
        ("exchange", EventKind::Exchange),
        ("place", EventKind::Place),
        ("release", EventKind::Release),
    ];
    for (name, kind) in kinds {
        // Where a row would begin for the mark to stand on the line of its name.
        let row = match kind {
            EventKind::Grasp => y - GAP + 2.0,
            EventKind::Release => y - ROW + GAP - 1.5,
            _ => y - ROW / 2.0,
        };
        mark(svg, kind, [x + 8.0, row]);
        svg.text(name, [x + 22.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
        x += 44.0 + 5.6 * name.len() as f64;
    }
}

/// A row for every finger of every hand that ever touches the object, a bar while it does; none where contacts are not planned.
pub fn fingers(plan: &RobotPlan) -> Option<String> {
    let mut rows = Vec::new();
    for (h, hand) in plan.hands.iter().enumerate() {
        let bars: Vec<_> = hand.fingers.iter().map(|finger| finger_bars(plan, &hand.name, finger)).collect();
        if bars.iter().any(|bars| !bars.is_empty()) {
            let names = hand.fingers.iter().map(|finger| format!("{}/{finger}", hand.name));
            rows.extend(names.zip(bars).map(|(name, bars)| (h, name, bars)));
        }
    }
    if rows.is_empty() {
        return None;
    }
    let (time, bottom) = (time_of(plan), TOP + FINGER_ROW * rows.len() as f64);
    let mut svg = Svg::new(SHEET, bottom + time_axis::AXIS);
    time_axis::heading(&mut svg, "Fingers", "a bar while the finger holds");
    for (k, (hand, name, bars)) in rows.iter().enumerate() {
        let y = TOP + FINGER_ROW * k as f64;
        svg.text(&cut(name, 18), [LEFT - 8.0, y + FINGER_ROW / 2.0 + 4.0], Anchor::End, INK, "font-size=\"10\"");
        for [from, until] in bars {
            let (x, end) = (time.at(*from), time.at(*until));
            svg.rect([x, y + FINGER_GAP], [end - x, FINGER_ROW - 2.0 * FINGER_GAP], palette::color(*hand), "");
        }
    }
    time_axis::frame(&mut svg, TOP, bottom);
    time_axis::draw(&mut svg, &time, bottom);
    Some(svg.finish("Fingers that hold"))
}
