//! Joint angles within their limits.

use super::svg::{Anchor, GRID, INK, LIMIT, SOFT, Scale, Svg, cut};
use super::time_axis::{self, LEFT, RIGHT, SHEET, TOP};
use crate::palette;
use crate::story::SceneStory;
use crate::timeline;
use regrasp_plan::Plan;

const PANEL: f64 = 74.0;
const GAP: f64 = 12.0;
/// Dashes that tell the joints of a finger apart, from the palm outward.
const DASHES: [&str; 4] = ["", "stroke-dasharray=\"7 3\"", "stroke-dasharray=\"2 3\"", "stroke-dasharray=\"9 3 2 3\""];

/// Joint positions over time as a share of their range, one panel per finger; none when no joint is limited.
pub fn joints(plan: &Plan, scene: &SceneStory) -> Option<String> {
    let of_finger = |finger: usize| -> Vec<usize> {
        let driven = scene.hand().links.iter().filter(|link| usize::try_from(link.finger) == Ok(finger));
        let mut joints: Vec<usize> = driven.filter_map(|link| usize::try_from(link.joint).ok()).collect();
        joints.sort_unstable();
        joints.dedup();
        joints.retain(|&k| range(scene, k).is_some());
        joints
    };
    let fingers: Vec<(usize, Vec<usize>)> = (0..plan.fingers.len()).map(|finger| (finger, of_finger(finger))).collect();
    if fingers.iter().all(|(_, joints)| joints.is_empty()) {
        return None;
    }
    let time = time_axis::scale(plan);
    let bottom = TOP + (PANEL + GAP) * fingers.len() as f64 - GAP;
    let mut svg = Svg::new(SHEET, bottom + time_axis::AXIS);
    time_axis::heading(
        &mut svg,
        "Joint positions",
        "as share of the range between their limits; grey: the object moves",
    );
    for (row, (finger, joints)) in fingers.iter().enumerate() {
        let top = TOP + (PANEL + GAP) * row as f64;
        panel(&mut svg, plan, scene, *finger, joints, &time, top);
    }
    time_axis::draw(&mut svg, &time, bottom);
    Some(svg.finish("Joint positions over time"))
}

fn range(scene: &SceneStory, joint: usize) -> Option<(f64, f64)> {
    let joint = scene.hand().joints.get(joint)?;
    let (lower, upper) = (joint.lower?, joint.upper?);
    (upper > lower).then_some((lower, upper))
}

/// Length, in bytes, of what all names begin with, up to and with a character that separates words.
fn common_prefix(names: &[&str]) -> usize {
    let [first, rest @ ..] = names else { return 0 };
    let is_common = |end: usize| rest.iter().all(|name| name.as_bytes().starts_with(&first.as_bytes()[..end]));
    let ends = first.char_indices().filter(|(_, c)| "_-./ ".contains(*c)).map(|(at, c)| at + c.len_utf8());
    // A name of nothing but the prefix would have no name left.
    let leaves_names = |end: usize| names.iter().all(|name| name.len() > end);
    ends.filter(|&end| !rest.is_empty() && is_common(end) && leaves_names(end)).max().unwrap_or(0)
}

fn panel(svg: &mut Svg, plan: &Plan, scene: &SceneStory, finger: usize, joints: &[usize], time: &Scale, top: f64) {
    let bottom = top + PANEL;
    let values = Scale::new(-0.06, 1.06, bottom, top);
    time_axis::shade_transfers(svg, plan, time, top, bottom);
    for share in [0.0, 0.5, 1.0] {
        let y = values.at(share);
        let (color, width) = if share == 0.5 { (GRID, 1.0) } else { (LIMIT, 1.2) };
        svg.line([LEFT, y], [RIGHT, y], color, width, if share == 0.5 { "" } else { "stroke-dasharray=\"6 3\"" });
    }
    let color = palette::color(finger);
    let names: Vec<&str> = joints.iter().map(|&joint| scene.hand().joints[joint].name.as_str()).collect();
    let prefix = common_prefix(&names);
    let steps = timeline::steps(plan);
    for (k, &joint) in joints.iter().enumerate() {
        let Some((lower, upper)) = range(scene, joint) else { continue };
        let point = |step: &timeline::TimelineStep| {
            let position = *step.waypoint.joints.get(joint)?;
            Some([time.at(step.waypoint.time), values.at((position - lower) / (upper - lower))])
        };
        let points: Vec<Option<[f64; 2]>> = steps.iter().map(point).collect();
        svg.path(&points, color, 1.7, DASHES[k % DASHES.len()]);
        let y = top + 12.0 + 13.0 * k as f64;
        if k < 5 {
            svg.line([4.0, y + 14.0], [22.0, y + 14.0], color, 1.7, DASHES[k % DASHES.len()]);
            svg.text(
                &cut(&scene.hand().joints[joint].name[prefix..], 16),
                [25.0, y + 17.5],
                Anchor::Start,
                SOFT,
                "font-size=\"9\"",
            );
        }
    }
    svg.text(
        &cut(&plan.fingers[finger], 16),
        [4.0, top + 11.0],
        Anchor::Start,
        INK,
        "font-size=\"11\" font-weight=\"bold\"",
    );
    time_axis::frame(svg, top, bottom);
}
