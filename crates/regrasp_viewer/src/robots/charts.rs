//! Charts over time of plans of whole robots.

use crate::charts::svg::{Anchor, INK, LIMIT, SOFT, Scale, Svg, cut, fixed};
use crate::charts::time_axis::{self, LEFT, RIGHT, SHEET, TOP};
use crate::palette;
use regrasp_plan::RobotPlan;
use regrasp_plan::check::RobotAlong;
use regrasp_plan::robot_plan::RobotWaypoint;
use regrasp_scene::Scene;

const HEIGHT: f64 = 150.0;
/// Pieces that a step between two waypoints is drawn in.
const PIECES: usize = 12;
/// Joints that move by less are not drawn, in radians or metres.
const STILL: f64 = 1e-6;

/// The scale of time of a plan.
fn time_of(plan: &RobotPlan) -> Scale {
    let first = plan.waypoints().next().map_or(0.0, |waypoint| waypoint.time);
    Scale::new(first, first + plan.duration(), LEFT, RIGHT)
}

/// Smallest distance of bodies that must not touch; none where nothing is near.
pub fn clearance(plan: &RobotPlan, along: &RobotAlong) -> Option<String> {
    let measured: Vec<(usize, f64)> =
        along.clearance.iter().enumerate().filter_map(|(k, distance)| Some((k, 1e3 * (*distance)?))).collect();
    let worst = measured.iter().copied().reduce(|worst, found| if found.1 < worst.1 { found } else { worst })?;
    let highest = measured.iter().map(|found| found.1).fold(0.0, f64::max);
    let (time, bottom) = (time_of(plan), TOP + HEIGHT);
    let values = Scale::new(worst.1.min(0.0), highest * 1.08, bottom, TOP).rounded(4);
    let mut svg = Svg::new(SHEET, bottom + time_axis::AXIS);
    let names = along.pair[worst.0].map_or_else(String::new, |pair| {
        let [a, b] = &along.pairs[pair];
        format!(", {} and {}", cut(a, 24), cut(b, 24))
    });
    let more = format!("dot: smallest, {} mm at {:.2} s{names}", fixed(worst.1, 2), along.times[worst.0]);
    time_axis::heading(&mut svg, "Clearance", &more);
    time_axis::draw_values(&mut svg, &values, 4, "distance [mm]");
    let promised = 1e3 * plan.promises.clearance;
    svg.line([LEFT, values.at(promised)], [RIGHT, values.at(promised)], LIMIT, 1.5, "stroke-dasharray=\"6 3\"");
    let points: Vec<Option<[f64; 2]>> = (along.times.iter().zip(&along.clearance))
        .map(|(at, distance)| Some([time.at(*at), values.at(1e3 * (*distance)?)]))
        .collect();
    svg.path(&points, "#009e73", 1.8, "class=\"clearance\"");
    svg.disc(
        [time.at(along.times[worst.0]), values.at(worst.1)],
        4.0,
        "#009e73",
        "stroke=\"#ffffff\" stroke-width=\"1.5\"",
    );
    time_axis::frame(&mut svg, TOP, bottom);
    time_axis::draw(&mut svg, &time, bottom);
    Some(svg.finish("Clearance over time"))
}

/// Value of joint `k` at share `u` of the step from one waypoint to the next: the cubic of the plan format.
fn joint_at([from, to]: [&RobotWaypoint; 2], k: usize, u: f64) -> f64 {
    let span = to.time - from.time;
    let (first, last) = (from.joint_velocities[k] * span, to.joint_velocities[k] * span);
    let change = to.joints[k] - from.joints[k];
    from.joints[k] + u * (first + u * (3.0 * change - 2.0 * first - last + u * (first + last - 2.0 * change)))
}

/// All joints between two waypoints.
pub fn joints_at(ends: [&RobotWaypoint; 2], u: f64) -> Vec<f64> {
    (0..ends[0].joints.len()).map(|k| joint_at(ends, k, u)).collect()
}

/// The joints that move, part by part.
pub fn joints(plan: &RobotPlan, scene: &Scene) -> String {
    let names = plan.joint_names();
    let moves = |k: &usize| {
        let values = || plan.waypoints().map(|waypoint| waypoint.joints[*k]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min) > STILL
    };
    let robot = scene.robots.iter().find(|robot| plan.robots.iter().any(|own| own.name == robot.name));
    let mut panels: Vec<Vec<usize>> = Vec::new();
    let part_of = |k: usize| robot.and_then(|robot| robot.layout.coordinates.get(k)).map(|coordinate| coordinate.part);
    for k in (0..names.len()).filter(moves) {
        match panels.last_mut().filter(|panel| part_of(panel[0]) == part_of(k)) {
            Some(panel) => panel.push(k),
            None => panels.push(vec![k]),
        }
    }
    let (time, legend) = (time_of(plan), 18.0);
    let pitch = TOP + HEIGHT + legend;
    let bottom = |panel: usize| panel as f64 * pitch + TOP + HEIGHT;
    let mut svg = Svg::new(SHEET, panels.len().max(1) as f64 * pitch + time_axis::AXIS);
    time_axis::heading(&mut svg, "Joints that move", "radians or metres");
    for (number, panel) in panels.iter().enumerate() {
        let (top, bottom) = (bottom(number) - HEIGHT, bottom(number));
        let values = || plan.waypoints().flat_map(|waypoint| panel.iter().map(|&k| waypoint.joints[k]));
        let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let scale = Scale::new(low, high, bottom, top).rounded(4);
        time_axis::draw_values(&mut svg, &scale, 4, "position");
        for (line, &k) in panel.iter().enumerate() {
            let mut points = Vec::new();
            for pair in plan.segments.iter().flat_map(|segment| segment.waypoints.windows(2)) {
                let at = |piece: usize| {
                    let u = piece as f64 / PIECES as f64;
                    let x = time.at(pair[0].time + u * (pair[1].time - pair[0].time));
                    Some([x, scale.at(joint_at([&pair[0], &pair[1]], k, u))])
                };
                points.extend((0..=PIECES).map(at));
            }
            let color = palette::color(line);
            svg.path(&points, color, 1.5, "");
            let x = LEFT + (RIGHT - LEFT) * line as f64 / panel.len() as f64;
            svg.disc([x + 4.0, bottom + 10.0], 3.5, color, "");
            svg.text(&cut(&names[k], 22), [x + 11.0, bottom + 14.0], Anchor::Start, INK, "font-size=\"10\"");
        }
        time_axis::frame(&mut svg, top, bottom);
    }
    let end = panels.len().max(1) as f64 * pitch;
    if panels.is_empty() {
        svg.text("no joint moves", [LEFT, TOP + 20.0], Anchor::Start, SOFT, "");
    }
    time_axis::draw(&mut svg, &time, end);
    svg.finish("Joints over time")
}
