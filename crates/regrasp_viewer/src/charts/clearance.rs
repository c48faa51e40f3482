//! Distance of what must not touch.

use super::margin::significant;
use super::svg::{LIMIT, Scale, Svg, cut};
use super::time_axis::{self, LEFT, RIGHT, SHEET, TOP};
use crate::story::Judged;
use crate::timeline;
use regrasp_plan::Plan;

const HEIGHT: f64 = 130.0;

/// The smallest distance of two things that must not touch, over time, with the pair at the smallest of all; none when nothing
/// was measured.
pub fn clearance(plan: &Plan, judged: &Judged) -> Option<String> {
    let steps = timeline::steps(plan);
    let measured: Vec<(f64, f64, usize)> = steps
        .iter()
        .zip(&judged.clearance)
        .enumerate()
        .filter_map(|(k, (step, value))| Some((step.waypoint.time, 1e3 * (*value)?, k)))
        .collect();
    let worst = measured.iter().copied().reduce(|worst, found| if found.1 < worst.1 { found } else { worst })?;
    let highest = measured.iter().map(|found| found.1).fold(0.0, f64::max);
    let time = time_axis::scale(plan);
    let bottom = TOP + HEIGHT;
    let values = Scale::new(worst.1.min(0.0), highest * 1.08, bottom, TOP).rounded(4);
    let mut svg = Svg::new(SHEET, bottom + time_axis::AXIS);
    let pair = judged.pair.get(worst.2).and_then(|pair| judged.pairs.get(*pair));
    let names = pair.map_or_else(String::new, |(a, b)| format!(", {} and {}", cut(a, 24), cut(b, 24)));
    let dot = format!("dot: smallest, {} mm at {:.2} s{names}; grey: the object moves", significant(worst.1), worst.0);
    time_axis::heading(&mut svg, "Clearance", &dot);
    time_axis::shade_transfers(&mut svg, plan, &time, TOP, bottom);
    time_axis::draw_values(&mut svg, &values, 4, "distance [mm]");
    svg.line([LEFT, values.at(0.0)], [RIGHT, values.at(0.0)], LIMIT, 1.5, "stroke-dasharray=\"6 3\"");
    let points: Vec<Option<[f64; 2]>> = steps
        .iter()
        .zip(&judged.clearance)
        .map(|(step, value)| Some([time.at(step.waypoint.time), values.at(1e3 * (*value)?)]))
        .collect();
    svg.path(&points, "#009e73", 1.8, "class=\"clearance\"");
    let place = [time.at(worst.0), values.at(worst.1)];
    svg.disc(place, 4.0, "#009e73", "stroke=\"#ffffff\" stroke-width=\"1.5\"");
    time_axis::frame(&mut svg, TOP, bottom);
    time_axis::draw(&mut svg, &time, bottom);
    Some(svg.finish("Clearance over time"))
}
