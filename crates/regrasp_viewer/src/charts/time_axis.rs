//! The time axis, and a panel over it.

use super::svg::{Anchor, GRID, INK, SHADE, SOFT, Scale, Svg, fixed};
use crate::timeline;
use regrasp_plan::Plan;
use regrasp_plan::plan::SegmentKind;

/// Left and right edge of all panels over time, and the width of the sheet.
pub const LEFT: f64 = 112.0;
pub const RIGHT: f64 = 812.0;
pub const SHEET: f64 = 836.0;
/// Height of title line and of the axis with its numbers.
pub const TOP: f64 = 32.0;
pub const AXIS: f64 = 40.0;

/// The scale of time of a plan.
pub fn scale(plan: &Plan) -> Scale {
    let (first, last) = timeline::span(plan);
    Scale::new(first, last, LEFT, RIGHT)
}

/// A name in bold over the panel, and further words behind it.
pub fn heading(svg: &mut Svg, name: &str, more: &str) {
    svg.text(name, [LEFT, 19.0], Anchor::Start, INK, "font-weight=\"bold\"");
    if !more.is_empty() {
        svg.text(more, [RIGHT, 19.0], Anchor::End, SOFT, "font-size=\"11\"");
    }
}

/// Grey where the object moves.
pub fn shade_transfers(svg: &mut Svg, plan: &Plan, time: &Scale, top: f64, bottom: f64) {
    for segment in plan.segments.iter().filter(|segment| segment.kind == SegmentKind::Transfer) {
        let (from, until) = timeline::segment_span(segment);
        let (x, end) = (time.at(from), time.at(until));
        svg.rect([x, top], [end - x, bottom - top], SHADE, "");
    }
}

/// Numbers and name of the time axis under a panel that ends at `bottom`.
pub fn draw(svg: &mut Svg, time: &Scale, bottom: f64) {
    svg.line([LEFT, bottom], [RIGHT, bottom], SOFT, 1.0, "");
    let (ticks, decimals) = time.ticks(9);
    for tick in ticks {
        let x = time.at(tick);
        svg.line([x, bottom], [x, bottom + 4.0], SOFT, 1.0, "");
        svg.text(&fixed(tick, decimals), [x, bottom + 16.0], Anchor::Middle, SOFT, "font-size=\"11\"");
    }
    svg.text("time [s]", [(LEFT + RIGHT) / 2.0, bottom + 31.0], Anchor::Middle, SOFT, "font-size=\"11\"");
}

/// Lines and numbers of a panel's vertical axis, with its name along it.
pub fn draw_values(svg: &mut Svg, values: &Scale, n_ticks: usize, name: &str) {
    let (ticks, decimals) = values.ticks(n_ticks);
    for tick in ticks {
        let y = values.at(tick);
        svg.line([LEFT, y], [RIGHT, y], GRID, 1.0, "");
        svg.text(&fixed(tick, decimals), [LEFT - 6.0, y + 4.0], Anchor::End, SOFT, "font-size=\"11\"");
    }
    let (x, y) = (LEFT - 60.0, (values.from + values.to) / 2.0);
    let turn = format!("font-size=\"11\" transform=\"rotate(-90 {} {})\"", super::svg::short(x), super::svg::short(y));
    svg.text(name, [x, y], Anchor::Middle, SOFT, &turn);
}

/// A frame around a panel.
pub fn frame(svg: &mut Svg, top: f64, bottom: f64) {
    svg.rect([LEFT, top], [RIGHT - LEFT, bottom - top], "none", "stroke=\"#9a9a9a\" stroke-width=\"1\"");
}
