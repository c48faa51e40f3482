//! Fingers and tips guessed from a robot alone.
//!
//! A finger ends at a moving joint below which nothing moves. Its tip link is the one whose collision geometry reaches
//! farthest from that joint.

use super::finger_names::{End, finger_names};
use super::rigid::rigid_links;
use super::tip_sphere::fit_tip;
use crate::contact_model::ContactModel;
use crate::import::spec::{FingerSpec, HandSpec, TipSpec};
use crate::robot::{JointId, JointKind, LinkId, Robot};
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_geometry::{Point, Pose};
use std::collections::BTreeSet;
use std::path::Path;

/// The hand that `robot` seems to be, with fingertips of one `contact` model. Errors: nothing in it moves (`U214`).
pub(crate) fn guess_hand(robot: &Robot, contact: ContactModel, file: &Path) -> Result<HandSpec, InputError> {
    let last_joints = last_moving_joints(robot);
    if last_joints.is_empty() {
        return Err(Diagnostic::new("U214", Place::file(file), "has no joint that moves, so no finger")
            .expected("a hand with moving fingers")
            .into());
    }
    let base = base_link(robot, &last_joints);
    let tips: Vec<(LinkId, TipSpec)> =
        last_joints.iter().map(|last| guess_tip(robot, robot.joints[last.0].child)).collect();
    let ends: Vec<End> = last_joints.iter().zip(&tips).map(|(&last, (tip, _))| End { last, tip: *tip }).collect();
    let names = finger_names(robot, base, &ends);
    let fingers = tips.into_iter().zip(names).map(|((tip_link, tip), name)| FingerSpec {
        name,
        tip_link,
        first_joint: None,
        tip,
        pad: None,
        contact,
        rest: Vec::new(),
        place: Place::file(file),
    });
    let fingers = fingers.collect();
    Ok(HandSpec { base, fingers, mount: None, allow: BTreeSet::new() })
}

/// Moving joints below which nothing moves, in document order.
fn last_moving_joints(robot: &Robot) -> Vec<JointId> {
    let moves = |id: JointId| robot.joints[id.0].kind != JointKind::Fixed;
    let mut above_another: BTreeSet<JointId> = BTreeSet::new();
    for link in 0..robot.links.len() {
        let path: Vec<JointId> = robot.joints_to(LinkId(link)).into_iter().filter(|&j| moves(j)).collect();
        if let Some((_, above)) = path.split_last() {
            above_another.extend(above);
        }
    }
    (0..robot.joints.len()).map(JointId).filter(|&j| moves(j) && !above_another.contains(&j)).collect()
}

/// The root, or the link after the last moving joint that all fingers share.
fn base_link(robot: &Robot, last_joints: &[JointId]) -> LinkId {
    let paths: Vec<Vec<JointId>> =
        last_joints.iter().map(|joint| robot.joints_to(robot.joints[joint.0].child)).collect();
    let Some((first, others)) = paths.split_first() else { return robot.root };
    let shared = first
        .iter()
        .take(first.len().saturating_sub(1))
        .enumerate()
        .take_while(|&(k, joint)| !others.is_empty() && others.iter().all(|path| path.get(k) == Some(joint)))
        .map(|(_, &joint)| joint)
        .filter(|joint| robot.joints[joint.0].kind != JointKind::Fixed)
        .last();
    shared.map_or(robot.root, |joint| robot.joints[joint.0].child)
}

/// The tip link of the body that `child` is the first link of, and its tip in the link's frame.
fn guess_tip(robot: &Robot, child: LinkId) -> (LinkId, TipSpec) {
    let links = rigid_links(robot, child);
    let mut farthest: Option<(f64, LinkId, Point)> = None;
    for (link, body_from_link) in &links {
        for placed in &robot.links[link.0].collision {
            let body_from_shape = body_from_link * placed.parent_from_shape;
            let from_joint = body_from_shape.inverse() * Point::origin();
            let point = body_from_shape * super::tip_sphere::farthest_point(&placed.shape, &from_joint);
            let reach = point.coords.norm();
            if farthest.is_none_or(|(best, _, _)| reach > best) {
                farthest = Some((reach, *link, point));
            }
        }
    }
    if let Some((_, link, point)) = farthest {
        let body_from_link = links.iter().find(|(other, _)| *other == link).map_or(Pose::identity(), |(_, pose)| *pose);
        let point_in_link = body_from_link.inverse() * point;
        let joint_in_link = body_from_link.inverse() * Point::origin();
        return (link, fit_tip(&robot.links[link.0].collision, &joint_in_link, &point_in_link));
    }
    // Without geometry the frame farthest from the joint is the tip.
    let far = links.iter().fold(None, |best: Option<(f64, LinkId)>, (link, pose)| {
        let reach = pose.translation.vector.norm();
        if best.is_none_or(|(most, _)| reach > most) { Some((reach, *link)) } else { best }
    });
    (far.map_or(child, |(_, link)| link), TipSpec::Point { position: Point::origin() })
}
