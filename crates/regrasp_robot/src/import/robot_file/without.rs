//! Links that a model does without: a gripper that another hand replaces.

use super::super::names::known_link;
use crate::robot::{JointId, JointKind, LinkId, Robot};
use regrasp_base::toml_table::{Entry, Found};
use std::collections::BTreeSet;

/// Takes the geometry of the links that `entry` names, and of all links below them, and fixes the joints above and below. The links stay
/// in the tree as frames, so that names in an SRDF and in a sphere model keep their meaning.
///
/// Errors: unknown links (`U205`), the root (`U206`), a joint that follows a joint taken away (`U209`).
pub(super) fn take_away(entry: &Entry, robot: &mut Robot, found: &mut Found) -> Option<()> {
    let mut taken: BTreeSet<LinkId> = BTreeSet::new();
    for item in entry.entries(found, "a list of links")? {
        let link = known_link(&item, robot, found)?;
        if link == robot.root {
            let diagnostic = item.error("U206", found, "is the root of the model, and the model does without it");
            found.diagnostics.push(diagnostic.expected("a link below the root").fix("leave out the model"));
            return None;
        }
        let mut waiting = vec![link];
        while let Some(link) = waiting.pop() {
            if taken.insert(link) {
                waiting.extend(robot.joints_from(link).map(|joint| robot.joints[joint.0].child));
            }
        }
    }
    let is_taken = |robot: &Robot, joint: JointId| taken.contains(&robot.joints[joint.0].child);
    for joint in (0..robot.joints.len()).map(JointId).filter(|&joint| !is_taken(robot, joint)) {
        let Some(coupling) = &robot.joints[joint.0].coupling else { continue };
        if let Some((leader, _)) = coupling.terms.iter().find(|(leader, _)| is_taken(robot, *leader)) {
            let [own, leader] = [joint, *leader].map(|joint| robot.joints[joint.0].name.as_str());
            let problem = format!("takes away joint \"{leader}\", which joint \"{own}\" follows");
            let diagnostic = entry.error("U209", found, problem);
            found.diagnostics.push(diagnostic.expected("links of which no joint elsewhere follows a joint"));
            return None;
        }
    }
    for link in &taken {
        let link = &mut robot.links[link.0];
        link.collision.clear();
        link.visual.clear();
        if let Some(joint) = link.parent_joint {
            let joint = &mut robot.joints[joint.0];
            (joint.kind, joint.limits, joint.coupling) = (JointKind::Fixed, None, None);
        }
    }
    Some(())
}
