//! The way of the object's orientation.

use super::svg::{Anchor, INK, SOFT, Svg};
use crate::palette;
use crate::story::RoadmapStory;
use crate::timeline;
use nalgebra::{Quaternion, UnitQuaternion};
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::Plan;
use std::f64::consts::{PI, TAU};

const WIDTH: f64 = 836.0;
const HEIGHT: f64 = 366.0;
const RADIUS: f64 = 128.0;
const CENTERS: [[f64; 2]; 2] = [[196.0, 190.0], [520.0, 190.0]];
/// Two of the ball's three axes in each view: to the right, up.
const VIEWS: [([usize; 2], &str); 2] = [([0, 2], "seen along y"), ([0, 1], "seen along z")];
/// Stretches between waypoints are divided into turns of at most this angle, so that jumps to the antipode are near the rim.
const LARGEST_TURN: f64 = PI / 90.0;

/// Orientations of the object in the axis-angle ball: direction = axis of the turn since the start, distance from the middle =
/// angle, up to 180 degrees at the rim, where opposite points are the same orientation. Two views, along y and along z. With
/// the nodes of a roadmap, coloured by component, when there is one. None for a plan without waypoints.
pub fn orientation(plan: &Plan, roadmap: Option<&RoadmapStory>) -> Option<String> {
    let steps = timeline::steps(plan);
    let rotations: Vec<UnitQuaternion<f64>> =
        steps.iter().map(|step| Pose::from(&step.waypoint.world_from_object).rotation).collect();
    let start = *rotations.first()?;
    let way = way_in_ball(&rotations, &start);
    let goal = Pose::from(&plan.goal).rotation;
    let goals = in_ball_both(&(goal * start.inverse()));
    let mut svg = Svg::new(WIDTH, HEIGHT);
    svg.text("Orientation of the object", [24.0, 19.0], Anchor::Start, INK, "font-weight=\"bold\"");
    let more = "axis-angle ball: out from the middle along the axis of the turn since the start";
    svg.text(more, [WIDTH - 24.0, 19.0], Anchor::End, SOFT, "font-size=\"11\"");
    for (center, (axes, name)) in CENTERS.iter().zip(VIEWS) {
        let place = |v: &Vector| [center[0] + RADIUS / PI * v[axes[0]], center[1] - RADIUS / PI * v[axes[1]]];
        ball(&mut svg, center, axes, name);
        for node in roadmap.iter().flat_map(|roadmap| &roadmap.nodes) {
            let [x, y, z, w] = node.quat_xyzw;
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)) * start.inverse();
            let color = palette::color(node.component);
            svg.disc(place(&in_ball(&turn)), 1.6, color, "fill-opacity=\"0.45\"");
        }
        let points: Vec<Option<[f64; 2]>> = way.iter().map(|v| v.as_ref().map(&place)).collect();
        svg.path(&points, INK, 2.2, "class=\"orientation\"");
        for pair in way.windows(3).filter(|w| w[1].is_none()) {
            for end in [&pair[0], &pair[2]].into_iter().flatten() {
                svg.disc(place(end), 3.0, "#ffffff", "stroke=\"#222222\" stroke-width=\"1.2\"");
            }
        }
        for v in &goals {
            svg.disc(place(v), 5.5, "#d55e00", "stroke=\"#ffffff\" stroke-width=\"1.2\"");
        }
        svg.disc(place(&Vector::zeros()), 4.5, "#0072b2", "stroke=\"#ffffff\" stroke-width=\"1.2\"");
    }
    key(&mut svg, goals.len(), way.iter().any(Option::is_none), roadmap.is_some());
    Some(svg.finish("Orientation of the object in the axis-angle ball"))
}

fn ball(svg: &mut Svg, center: &[f64; 2], axes: [usize; 2], name: &str) {
    svg.disc(*center, RADIUS, "#fafafa", "stroke=\"#888888\" stroke-width=\"1.2\"");
    for degrees in [60.0, 120.0] {
        let radius = RADIUS * degrees / 180.0;
        svg.disc(*center, radius, "none", "stroke=\"#d8d8d8\" stroke-width=\"1\"");
        let at = [center[0] + radius * 0.707 + 2.0, center[1] + radius * 0.707 + 10.0];
        svg.text(&format!("{degrees:.0}\u{b0}"), at, Anchor::Start, SOFT, "font-size=\"9\"");
    }
    let letter = |axis: usize| ["x", "y", "z"][axis];
    svg.line([center[0] - RADIUS, center[1]], [center[0] + RADIUS, center[1]], "#d8d8d8", 1.0, "");
    svg.line([center[0], center[1] - RADIUS], [center[0], center[1] + RADIUS], "#d8d8d8", 1.0, "");
    svg.text(letter(axes[0]), [center[0] + RADIUS + 6.0, center[1] + 4.0], Anchor::Start, SOFT, "");
    svg.text(letter(axes[1]), [center[0], center[1] - RADIUS - 6.0], Anchor::Middle, SOFT, "");
    svg.text(name, [center[0], center[1] + RADIUS + 20.0], Anchor::Middle, SOFT, "font-size=\"11\"");
}

fn key(svg: &mut Svg, n_goals: usize, jumps: bool, has_roadmap: bool) {
    let x = CENTERS[1][0] + RADIUS + 40.0;
    let mut y = 120.0;
    let mut entry = |svg: &mut Svg, fill: &str, stroke: &str, text: &str| {
        svg.disc([x, y], 4.5, fill, &format!("stroke=\"{stroke}\" stroke-width=\"1.2\""));
        svg.text(text, [x + 12.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
        y += 20.0;
    };
    entry(svg, "#0072b2", "#ffffff", "start");
    entry(svg, "#d55e00", "#ffffff", if n_goals > 1 { "goal (both points)" } else { "goal" });
    if jumps {
        entry(svg, "#ffffff", INK, "goes on opposite");
    }
    if has_roadmap {
        entry(svg, palette::color(0), "#ffffff", "grasps, by component");
    }
    svg.text("rim: 180\u{b0}", [x - 5.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
}

/// Rotation vector of a turn: its axis, as long as its angle in 0..=pi.
fn in_ball(turn: &UnitQuaternion<f64>) -> Vector {
    let w = turn.w.clamp(-1.0, 1.0);
    let sine = turn.imag().norm();
    if sine < 1e-12 {
        return Vector::zeros();
    }
    let angle = 2.0 * libm::atan2(sine, w.abs());
    turn.imag() * (angle / sine * if w < 0.0 { -1.0 } else { 1.0 })
}

/// The place of a turn, and for one by 180 degrees the opposite place too.
fn in_ball_both(turn: &UnitQuaternion<f64>) -> Vec<Vector> {
    let v = in_ball(turn);
    if v.norm() > PI - 1e-3 { vec![v, -v] } else { vec![v] }
}

/// Places of all rotations, as turns since `start`, with what lies between them; none where the way leaves the ball and comes
/// back opposite.
fn way_in_ball(rotations: &[UnitQuaternion<f64>], start: &UnitQuaternion<f64>) -> Vec<Option<Vector>> {
    let mut way: Vec<Option<Vector>> = Vec::new();
    let mut push = |v: Vector| {
        if let Some(Some(last)) = way.last() {
            if (v - last).norm() > PI {
                way.push(None);
            } else if (v - last).norm() < 1e-9 {
                return;
            }
        }
        way.push(Some(v));
    };
    let turns: Vec<UnitQuaternion<f64>> = rotations.iter().map(|rotation| rotation * start.inverse()).collect();
    for pair in turns.windows(2) {
        let angle = pair[0].angle_to(&pair[1]);
        let n = (angle / LARGEST_TURN).ceil().clamp(1.0, 360.0) as usize;
        let step = pair[1] * pair[0].inverse();
        let axis = step.axis();
        for k in 0..n {
            let part = axis.map_or_else(UnitQuaternion::identity, |axis| {
                UnitQuaternion::from_axis_angle(&axis, angle.min(TAU) * k as f64 / n as f64)
            });
            push(in_ball(&(part * pair[0])));
        }
    }
    turns.last().into_iter().for_each(|turn| push(in_ball(turn)));
    way
}
