//! Closure margin.

use super::svg::{Anchor, LIMIT, Scale, Svg};
use super::time_axis::{self, LEFT, RIGHT, SHEET, TOP};
use crate::story::Judged;
use crate::timeline;
use regrasp_plan::Plan;

const HEIGHT: f64 = 130.0;

/// The closure margin of the fingers that hold, over time, with the level asked for and the worst moment; none when nothing
/// was judged.
pub fn margin(plan: &Plan, judged: &Judged) -> Option<String> {
    let steps = timeline::steps(plan);
    let judged_at = steps.iter().zip(&judged.margin).filter_map(|(step, value)| Some((step.waypoint.time, (*value)?)));
    // The first of the smallest.
    let worst = judged_at.clone().fold(None, |worst: Option<(f64, f64)>, found| match worst {
        Some(worst) if worst.1 <= found.1 => Some(worst),
        _ => Some(found),
    })?;
    let highest = judged_at.map(|(_, value)| value).fold(judged.required_margin, f64::max);
    let time = time_axis::scale(plan);
    let bottom = TOP + HEIGHT;
    let values = Scale::new(0.0, highest * 1.08, bottom, TOP).rounded(4);
    let mut svg = Svg::new(SHEET, bottom + time_axis::AXIS);
    let dot = format!("dot: smallest, {} at {:.2} s; grey: the object moves", significant(worst.1), worst.0);
    time_axis::heading(&mut svg, "Closure margin", &dot);
    time_axis::shade_transfers(&mut svg, plan, &time, TOP, bottom);
    time_axis::draw_values(&mut svg, &values, 4, "margin");
    let required = values.at(judged.required_margin);
    svg.line([LEFT, required], [RIGHT, required], LIMIT, 1.5, "stroke-dasharray=\"6 3\"");
    let points: Vec<Option<[f64; 2]>> = steps
        .iter()
        .zip(&judged.margin)
        .map(|(step, value)| Some([time.at(step.waypoint.time), values.at((*value)?)]))
        .collect();
    svg.path(&points, "#0072b2", 1.8, "class=\"margin\"");
    let label = format!("asked for: {}", significant(judged.required_margin));
    let place = [RIGHT - 6.0, if required + 14.0 < bottom { required + 13.0 } else { required - 5.0 }];
    svg.text_on_lines(&label, place, Anchor::End, LIMIT, "font-size=\"11\"");
    let place = [time.at(worst.0), values.at(worst.1)];
    svg.disc(place, 4.0, "#0072b2", "stroke=\"#ffffff\" stroke-width=\"1.5\"");
    time_axis::frame(&mut svg, TOP, bottom);
    time_axis::draw(&mut svg, &time, bottom);
    Some(svg.finish("Closure margin over time"))
}

/// A number with two significant digits, or more where they stand before the point.
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0".into();
    }
    let decimals = (1.0 - libm::floor(libm::log10(value.abs()))).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}
