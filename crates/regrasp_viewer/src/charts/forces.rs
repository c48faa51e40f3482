//! Normal forces.

use super::svg::{Anchor, LIMIT, SOFT, Scale, Svg, cut};
use super::time_axis::{self, LEFT, RIGHT, SHEET, TOP};
use crate::palette;
use crate::timeline::{self, TimelineStep};
use regrasp_geometry::Vector;
use regrasp_plan::Plan;

const HEIGHT: f64 = 150.0;
const KEY: f64 = 22.0;

/// Normal force of every finger over time, with the least and the largest allowed; none in plans without forces.
pub fn forces(plan: &Plan) -> Option<String> {
    let [least, largest] = plan.promises.forces.as_ref()?.normal_force;
    let steps = timeline::steps(plan);
    let series: Vec<Vec<Option<f64>>> = (0..plan.fingers.len()).map(|f| normal_forces(&steps, f)).collect();
    let highest = series.iter().flatten().flatten().copied().fold(least, f64::max);
    // The cap is drawn where it is near enough to matter.
    let shows_cap = largest <= 2.0 * highest;
    let time = time_axis::scale(plan);
    let bottom = TOP + HEIGHT;
    let top_value = if shows_cap { largest.max(highest) } else { highest };
    let values = Scale::new(0.0, top_value * 1.06, bottom, TOP).rounded(5);
    let mut svg = Svg::new(SHEET, bottom + time_axis::AXIS + KEY);
    time_axis::heading(&mut svg, "Normal forces", "of the fingers on the object; grey: the object moves");
    time_axis::shade_transfers(&mut svg, plan, &time, TOP, bottom);
    time_axis::draw_values(&mut svg, &values, 5, "force [N]");
    let cap = |svg: &mut Svg, value: f64| {
        svg.line([LEFT, values.at(value)], [RIGHT, values.at(value)], LIMIT, 1.5, "stroke-dasharray=\"6 3\"");
    };
    cap(&mut svg, least);
    if shows_cap {
        cap(&mut svg, largest);
    }
    for (finger, forces) in series.iter().enumerate() {
        let point =
            |(step, force): (&TimelineStep, &Option<f64>)| Some([time.at(step.waypoint.time), values.at((*force)?)]);
        let points: Vec<Option<[f64; 2]>> = with_gaps(&steps, forces).into_iter().map(|p| p.and_then(point)).collect();
        svg.path(&points, palette::color(finger), 1.7, "");
    }
    time_axis::frame(&mut svg, TOP, bottom);
    time_axis::draw(&mut svg, &time, bottom);
    let y = bottom + time_axis::AXIS + 8.0;
    let room = (RIGHT - LEFT - 210.0) / plan.fingers.len().max(1) as f64;
    for (finger, name) in plan.fingers.iter().enumerate() {
        let x = LEFT + room * finger as f64;
        svg.line([x, y], [x + 18.0, y], palette::color(finger), 2.5, "");
        svg.text(&cut(name, (room / 7.0) as usize), [x + 23.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
    }
    let allowed = format!("allowed: {} to {} N", super::svg::short(least), super::svg::short(largest));
    svg.text(&allowed, [RIGHT, y + 4.0], Anchor::End, LIMIT, "font-size=\"11\"");
    Some(svg.finish("Normal forces over time"))
}

/// Normal force of a finger at every step, in newtons; none while it is free or has no force.
fn normal_forces(steps: &[TimelineStep], finger: usize) -> Vec<Option<f64>> {
    let force = |step: &TimelineStep| {
        let contact = step.waypoint.contacts.get(finger)?;
        let (force, normal) = (Vector::from(contact.force_in_object?), Vector::from(contact.normal_in_object?));
        // It pushes against the outward normal.
        Some(-force.dot(&normal))
    };
    steps.iter().map(force).collect()
}

/// Steps with their forces, broken where the finger is free.
fn with_gaps<'s, 'p>(
    steps: &'s [TimelineStep<'p>],
    forces: &'s [Option<f64>],
) -> Vec<Option<(&'s TimelineStep<'p>, &'s Option<f64>)>> {
    steps.iter().zip(forces).map(|(step, force)| force.is_some().then_some((step, force))).collect()
}
