//! Which finger holds when.

use super::svg::{Anchor, INK, SHADE, SOFT, Scale, Svg, cut};
use super::time_axis::{self, LEFT, RIGHT, SHEET, TOP};
use crate::palette;
use crate::timeline::{self, Doing};
use regrasp_plan::Plan;

const ROW: f64 = 30.0;
/// Free room over and under a bar.
const GAP: f64 = 7.0;
/// Height of the strip under a bar, and its colour under the finger that the object rolls on.
const STRIP: f64 = 4.0;
const ROLLED_ON: &str = "#9a9a9a";
/// Height of the line that explains.
const KEY: f64 = 24.0;

/// The finger gait over time: one row per finger, a bar while it holds, striped while it rolls, lined while it slides, a thin line
/// while it moves through the air; a mark where it lifts and where it lands; grey while the object moves. In tracking, under the
/// bars, black while the finger is the moving one and grey while the object rolls on it.
pub fn gait(plan: &Plan) -> String {
    let time = time_axis::scale(plan);
    let bottom = TOP + ROW * plan.fingers.len() as f64;
    let mut svg = Svg::new(SHEET, bottom + time_axis::AXIS + KEY);
    time_axis::heading(&mut svg, "Finger gait", &super::title(plan));
    time_axis::shade_transfers(&mut svg, plan, &time, TOP, bottom);
    for (finger, name) in plan.fingers.iter().enumerate() {
        let top = TOP + ROW * finger as f64;
        let color = palette::color(finger);
        let stripes = svg.stripes(finger, color);
        let lines = svg.lines(finger, color);
        svg.text(&cut(name, 16), [LEFT - 8.0, top + ROW / 2.0 + 4.0], Anchor::End, INK, "");
        for stretch in timeline::stretches(plan, finger) {
            let (x, end) = (time.at(stretch.from), time.at(stretch.until));
            let middle = top + ROW / 2.0;
            match stretch.doing {
                Doing::Holds => svg.rect([x, top + GAP], [end - x, ROW - 2.0 * GAP], color, ""),
                Doing::Rolls => svg.rect([x, top + GAP], [end - x, ROW - 2.0 * GAP], &stripes, ""),
                Doing::Slides => svg.rect([x, top + GAP], [end - x, ROW - 2.0 * GAP], &lines, ""),
                Doing::Moves => svg.line([x, middle], [end, middle], color, 2.0, ""),
                Doing::Waits => svg.line([x, middle], [end, middle], color, 1.0, "stroke-dasharray=\"1 4\""),
            }
        }
        let marks = timeline::marks(plan, finger);
        marks.lifts.iter().for_each(|at| triangle(&mut svg, time.at(*at), top + GAP, true));
        marks.lands.iter().for_each(|at| triangle(&mut svg, time.at(*at), top + ROW - GAP, false));
    }
    roles(&mut svg, plan, &time);
    time_axis::frame(&mut svg, TOP, bottom);
    time_axis::draw(&mut svg, &time, bottom);
    key(&mut svg, bottom + time_axis::AXIS + 10.0, timeline::roles(plan).is_empty());
    svg.finish("Finger gait")
}

/// Strips under the bars: which finger moves and on which the object rolls, in tracking.
fn roles(svg: &mut Svg, plan: &Plan, time: &Scale) {
    for roles in timeline::roles(plan) {
        let (x, end) = (time.at(roles.from), time.at(roles.until));
        let moving = roles.moving.iter().map(|finger| (finger, INK, "moving"));
        for (finger, fill, class) in moving.chain(roles.rolling.iter().map(|finger| (finger, ROLLED_ON, "rolled-on"))) {
            let y = TOP + ROW * (finger + 1) as f64 - GAP + 1.0;
            svg.rect([x, y], [end - x, STRIP], fill, &format!("class=\"{class}\""));
        }
    }
}

/// A lift is a triangle that points up over the bar's end, a landing one that points down under the next bar's beginning.
fn triangle(svg: &mut Svg, x: f64, y: f64, up: bool) {
    let tip = if up { y - 6.0 } else { y + 6.0 };
    svg.polygon(&[[x - 3.6, y], [x + 3.6, y], [x, tip]], INK, "stroke=\"#ffffff\" stroke-width=\"0.6\"");
}

/// What bars and marks mean; tracking has strips where other plans have lifts and transfers.
fn key(svg: &mut Svg, y: f64, is_in_hand: bool) {
    let color = "#777777";
    let stripes = svg.stripes(99, color);
    let mut x = LEFT;
    let mut entry = |svg: &mut Svg, text: &str, draw: &dyn Fn(&mut Svg, f64)| {
        draw(svg, x);
        svg.text(text, [x + 26.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
        x += 42.0 + 5.6 * text.len() as f64;
    };
    let bar = |fill: &str| {
        let fill = fill.to_owned();
        move |svg: &mut Svg, x: f64| svg.rect([x, y - 6.0], [20.0, 12.0], &fill, "")
    };
    entry(svg, "holds at one point", &bar(color));
    entry(svg, "rolls", &bar(&stripes));
    if !is_in_hand {
        let lines = svg.lines(99, color);
        entry(svg, "slides", &bar(&lines));
        entry(svg, "moving finger", &|svg, x| svg.rect([x, y - 2.0], [20.0, STRIP], INK, ""));
        entry(svg, "object rolls on it", &|svg, x| svg.rect([x, y - 2.0], [20.0, STRIP], ROLLED_ON, ""));
        debug_assert!(x < RIGHT + 24.0, "the key fits its line");
        return;
    }
    entry(svg, "moves", &|svg, x| svg.line([x, y], [x + 20.0, y], color, 2.0, ""));
    entry(svg, "free", &|svg, x| svg.line([x, y], [x + 20.0, y], color, 1.0, "stroke-dasharray=\"1 4\""));
    entry(svg, "lifts", &|svg, x| triangle(svg, x + 12.0, y + 3.0, true));
    entry(svg, "lands", &|svg, x| triangle(svg, x + 12.0, y - 3.0, false));
    entry(svg, "object moves", &|svg, x| {
        svg.rect([x, y - 6.0], [20.0, 12.0], SHADE, "stroke=\"#c8c8c8\" stroke-width=\"0.6\"");
    });
    debug_assert!(x < RIGHT + 24.0, "the key fits its line");
}
