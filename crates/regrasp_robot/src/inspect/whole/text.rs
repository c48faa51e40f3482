//! A robot as the text of a `robot.toml`.

use super::super::hand_text::{comment, number, quoted};
use super::WholeRobot;
use crate::import::robot_file::{FORMAT, VERSION};
use crate::robot::{JointId, LinkId, Robot};
use std::fmt::Write;

/// How a robot file names the files beside it.
#[derive(Debug, Clone, Default)]
pub struct FileNames {
    /// The URDF.
    pub urdf: String,
    /// The SRDF, where there is one.
    pub srdf: Option<String>,
    /// The hand file of each hand of [`WholeRobot::hands`]; none for hands that are left out.
    pub hands: Vec<Option<String>>,
}

/// The text of a robot file for `whole`, found in `robot`.
pub fn robot_file_text(robot: &Robot, whole: &WholeRobot, names: &FileNames) -> String {
    let link = |link: LinkId| quoted(&robot.links[link.0].name);
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "# Robot \"{}\": written by `regrasp inspect`; edit freely. Metres and radians.",
        comment(&robot.name)
    );
    let _ = writeln!(text, "format = {}\nformat_version = {VERSION}\nname = {}", quoted(FORMAT), quoted(&robot.name));
    if !whole.pairs.always_ids.is_empty() {
        let _ = writeln!(
            text,
            "\n# Pairs of links that touched in all of {} random postures. They are never tested.\nallow = [",
            whole.pairs.n_postures
        );
        for &(a, b) in &whole.pairs.always_ids {
            let _ = writeln!(text, "    [{}, {}],", link(a), link(b));
        }
        let _ = writeln!(text, "]");
    }
    let _ = writeln!(text, "\n[[models]]\nname = \"body\"\nurdf = {}", quoted(&names.urdf));
    if let Some(srdf) = &names.srdf {
        let _ = writeln!(text, "srdf = {}", quoted(srdf));
    }
    for arm in &whole.guess.arms {
        let (name, base, mount) = (quoted(&arm.name), link(arm.base), link(arm.mount));
        let _ = writeln!(text, "\n[[arms]]\nname = {name}\nbase_link = {base}\nmount_link = {mount}");
    }
    for (hand, file) in whole.hands.iter().zip(&names.hands) {
        let Some(file) = file else { continue };
        let arm = quoted(&whole.guess.arms[hand.guess.arm].name);
        let name = quoted(&hand.guess.name);
        let _ = writeln!(text, "\n[[hands]]\nname = {name}\nhand = {}\narm = {arm}\nmodel = \"body\"", quoted(file));
    }
    let joint = |joint: &JointId| quoted(&robot.joints[joint.0].name);
    if !whole.guess.common.is_empty() || !whole.guess.others.is_empty() {
        let common: Vec<String> = whole.guess.common.iter().map(joint).collect();
        let _ = writeln!(text, "\n# What carries the arms.\n[common]\njoints = [{}]", common.join(", "));
    }
    if !whole.guess.others.is_empty() {
        let _ =
            writeln!(text, "\n# Joints that carry no arm are held. To move one, name it in [common] joints.\n[held]");
        for id in &whole.guess.others {
            let at = robot.joints[id.0].limits.map_or(0.0, |limits| 0f64.clamp(limits.lower, limits.upper));
            let _ = writeln!(text, "{} = {}", joint(id), number(at));
        }
    }
    text
}
