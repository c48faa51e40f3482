//! What to write where a hand cannot be made of its fingers: lines to be pasted, each of which leads on.

use super::other_form::shell_word;
use super::spec::{Carried, FingerSpec, HandSpec};
use crate::robot::{JointId, LinkId, Robot};
use std::collections::BTreeMap;
use std::path::Path;

/// Most files beside a hand file that are looked at for a URDF.
const MAX_FILES: usize = 1_000;

/// For a hand file at `path` without a URDF: the one beside it, where there is one.
pub(super) fn add_urdf(path: &Path) -> String {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let files = std::fs::read_dir(folder).into_iter().flatten().take(MAX_FILES).filter_map(Result::ok);
    let mut names: Vec<String> = files.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.retain(|name| name.ends_with(".urdf"));
    match names.as_slice() {
        [only] => format!("add urdf = \"{only}\""),
        _ => "add urdf = \"hand.urdf\"".into(),
    }
}

/// For a hand file at `path` without fingers: what writes them.
pub(super) fn inspect_command(urdf: Option<&str>, path: &Path) -> String {
    let urdf = urdf.filter(|name| !name.contains("://")).unwrap_or("hand.urdf");
    let urdf = path.parent().unwrap_or(Path::new("")).join(urdf);
    format!("regrasp inspect {} -o {}    # writes the fingers that it finds", shell_word(&urdf), shell_word(path))
}

/// For a finger without a tip link.
pub(super) fn add_tip_link(robot: &Robot) -> String {
    let name = |link: &LinkId| format!("\"{}\"", robot.links[link.0].name);
    let ends: Vec<String> = crate::inspect::guess::tip_links(robot).iter().map(name).collect();
    match ends.as_slice() {
        [] => "add tip_link = \"...\", the link that touches".into(),
        [only] => format!("add tip_link = {only}"),
        [first, others @ ..] => format!("add tip_link = {first}, or another end: {}", others.join(", ")),
    }
}

/// For a tip that the base link does not carry: another tip link, or another base link.
pub(super) fn tip_elsewhere(robot: &Robot, spec: &HandSpec, finger: usize) -> String {
    let tip = spec.fingers[finger].tip_link;
    let (to_base, to_tip) = (robot.joints_to(spec.base), robot.joints_to(tip));
    if to_base.starts_with(&to_tip) {
        // The tip link carries the base; the end of a finger that no table has is meant.
        let is_free = |link: &LinkId| {
            robot.joints_to(*link).starts_with(&to_base) && spec.fingers.iter().all(|other| other.tip_link != *link)
        };
        let ends = crate::inspect::guess::tip_links(robot);
        return match ends.iter().find(|link| is_free(link)) {
            Some(end) => format!("tip_link = \"{}\"", robot.links[end.0].name),
            None => "remove this [[fingers]] table".into(),
        };
    }
    let n_shared = to_base.iter().zip(&to_tip).take_while(|(a, b)| a == b).count();
    let common = n_shared.checked_sub(1).map_or(robot.root, |last| robot.joints[to_base[last].0].child);
    format!("base_link = \"{}\"", robot.links[common.0].name)
}

/// For a first joint that is not on the way to the tip: `below` is the way.
pub(super) fn first_joint(robot: &Robot, below: &[JointId]) -> String {
    match below.iter().find(|joint| robot.joints[joint.0].moves()) {
        Some(joint) => format!("first_joint = \"{}\"", robot.joints[joint.0].name),
        None => "remove first_joint".into(),
    }
}

/// For two fingers that share joints: the base link below these where it carries all fingers, else chains that begin below them.
pub(super) fn shared_joint(robot: &Robot, spec: &HandSpec, fingers: [usize; 2], chains: [&[JointId]; 2]) -> String {
    let [first, second] = chains;
    let Some(last_shared) = second.iter().rev().find(|joint| first.contains(joint)) else { return String::new() };
    let below = robot.joints[last_shared.0].child;
    let is_below = |finger: &FingerSpec| robot.joints_to(finger.tip_link).contains(last_shared);
    let moves_after = |chain: &[JointId]| chain.last() != Some(last_shared);
    if spec.fingers.iter().all(is_below) && chains.iter().all(|chain| moves_after(chain)) {
        return format!("base_link = \"{}\", so that shared joints belong to no finger", robot.links[below.0].name);
    }
    let mut lines = Vec::new();
    for (finger, chain) in fingers.into_iter().zip(chains) {
        let name = &spec.fingers[finger].name;
        let after = chain.iter().skip_while(|joint| *joint != last_shared).nth(1);
        match after {
            Some(joint) => lines.push(format!("first_joint = \"{}\" in finger \"{name}\"", robot.joints[joint.0].name)),
            None => {
                return format!(
                    "remove the [[fingers]] table of \"{name}\", which ends where \"{}\" goes on",
                    spec.fingers[if finger == fingers[0] { fingers[1] } else { fingers[0] }].name
                );
            }
        }
    }
    format!("{}, so that shared joints are held", lines.join(" and "))
}

/// For joint `follower` of the chain `joints` whose `leader` is not on it.
pub(super) fn leader_elsewhere(
    robot: &Robot,
    joints: &[JointId],
    follower: JointId,
    leader: JointId,
    carried: &BTreeMap<LinkId, Carried>,
) -> String {
    let is_above = joints.first().is_some_and(|first| robot.joints_to(robot.joints[first.0].parent).contains(&leader));
    if is_above && carried.contains_key(&robot.joints[leader.0].child) {
        return format!("first_joint = \"{}\"", robot.joints[leader.0].name);
    }
    hold_in_urdf(&robot.joints[follower.0].name)
}

/// For a follower that cannot be driven.
pub(super) fn hold_in_urdf(joint: &str) -> String {
    format!("hold it, in the URDF: <joint name=\"{joint}\" type=\"fixed\">")
}
