//! Links and joints that a file names.

use crate::robot::{JointId, LinkId, Robot};
use regrasp_base::diagnostic::did_you_mean;
use regrasp_base::toml_table::{Entry, Found};

pub(super) fn known_link(entry: &Entry, robot: &Robot, found: &mut Found) -> Option<LinkId> {
    let name = entry.text(found)?;
    let link = robot.link_named(name);
    if link.is_none() {
        refuse_name(entry, "link", name, robot.links.iter().map(|link| link.name.as_str()), found);
    }
    link
}

pub(super) fn known_joint(entry: &Entry, robot: &Robot, found: &mut Found) -> Option<JointId> {
    let name = entry.text(found)?;
    let joint = robot.joint_named(name);
    if joint.is_none() {
        refuse_name(entry, "joint", name, robot.joints.iter().map(|joint| joint.name.as_str()), found);
    }
    joint
}

fn refuse_name<'n>(entry: &Entry, kind: &str, name: &str, names: impl Iterator<Item = &'n str>, found: &mut Found) {
    if found.diagnostics.counted_only() {
        return;
    }
    let meant = did_you_mean(name, names);
    let diagnostic = entry
        .error("U205", found, format!("the robot has no {kind} \"{name}\""))
        .expected(format!("the name of a {kind} of the URDF"))
        .fix(meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?")));
    found.diagnostics.push(diagnostic);
}
