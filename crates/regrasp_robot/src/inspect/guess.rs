//! Fingers and tips guessed from a robot alone.
//!
//! A finger ends at a moving joint below which nothing moves. Its tip link is the one whose collision geometry reaches
//! farthest from that joint.

use super::crowded::{crowded_note, crowded_pairs, stuck_note, stuck_pairs};
use super::enclosing::{enclosing_links, enclosing_note};
use super::finger_names::{End, finger_names};
use super::rigid::rigid_links;
use super::tip_sphere::fit_tip;
use crate::hand::Hand;
use crate::import::options::LoadOptions;
use crate::import::shared_motors;
use crate::import::spec::{FingerSpec, HandSpec, PadSpec, TipSpec};
use crate::robot::{JointId, JointKind, LinkId, Robot};
use regrasp_base::diagnostic::did_you_mean;
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_geometry::{Point, Pose};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The hand that `robot` seems to be, on the base link that `options` name or else on the one that all fingers share.
///
/// Errors: nothing in it moves (`U214`), an unknown base link (`U205`).
pub(crate) fn guess_hand(robot: &Robot, options: &LoadOptions, file: &Path) -> Result<HandSpec, InputError> {
    let mut last_joints = last_moving_joints(robot);
    let stated = options.base.as_deref().map(|name| stated_base(robot, name, file)).transpose()?;
    if let Some(base) = stated {
        let above = robot.joints_to(base);
        let is_below = |joint: &JointId| robot.joints_to(robot.joints[joint.0].parent).starts_with(&above);
        last_joints.retain(is_below);
    }
    if last_joints.is_empty() {
        let below = stated.map_or(String::new(), |base| format!(" below link \"{}\"", robot.links[base.0].name));
        return Err(Diagnostic::new(
            "U214",
            Place::file(file),
            format!("has no joint that moves{below}, so no finger"),
        )
        .expected("a hand with moving fingers")
        .into());
    }
    let base = stated.unwrap_or_else(|| base_link(robot, &last_joints));
    let paths = paths_below(robot, base, &last_joints);
    if stated.is_none() {
        refuse_several_hands(robot, base, &paths, file)?;
    }
    let tips: Vec<_> = last_joints.iter().map(|last| guess_tip(robot, robot.joints[last.0].child)).collect();
    let ends: Vec<End> = last_joints.iter().zip(&tips).map(|(&last, (tip, _))| End { last, tip: *tip }).collect();
    let names = finger_names(robot, base, &ends);
    let fingers = tips.into_iter().zip(names).enumerate().map(|(index, ((tip_link, (tip, pad)), name))| FingerSpec {
        name,
        tip_link,
        first_joint: [first_own_joint(&paths, index), shared_motors::first_uncoupled_joint(robot, &paths, index)]
            .into_iter()
            .flatten()
            .max_by_key(|first| paths[index].iter().position(|joint| joint == first)),
        tip,
        pad,
        contact: options.contact,
        rest: Vec::new(),
        place: Place::file(file),
    });
    let fingers = fingers.collect();
    let mut spec = HandSpec {
        base,
        fingers,
        mount: None,
        allow: BTreeSet::new(),
        held: BTreeMap::new(),
        without_geometry: BTreeSet::new(),
    };
    shared_motors::place_held_leaders(robot, &mut spec);
    Ok(spec)
}

/// Writes into `spec` what would keep the fingers of `hand`, which was made of it, from holding anything: volumes around the fingertips, and pairs
/// of links that are always near each other, of one finger mostly. What is said of it.
pub(crate) fn leave_out_what_blocks(robot: &Robot, hand: &Hand, spec: &mut HandSpec) -> Vec<String> {
    spec.without_geometry = enclosing_links(hand);
    let mut notes: Vec<String> = spec.without_geometry.iter().map(|&link| enclosing_note(robot, link)).collect();
    let crowded = crowded_pairs(hand);
    if !crowded.is_empty() {
        notes.push(crowded_note(robot, &crowded));
    }
    let is_left_out = |link: &LinkId| spec.without_geometry.contains(link);
    let mut stuck = stuck_pairs(hand);
    stuck.retain(|pair| !crowded.contains(pair) && ![pair.0, pair.1].iter().any(is_left_out));
    if !stuck.is_empty() {
        notes.push(stuck_note(robot, &stuck));
    }
    spec.allow.extend(crowded.into_iter().chain(stuck));
    notes
}

/// The moving joints of each finger, from `base` on.
fn paths_below(robot: &Robot, base: LinkId, last_joints: &[JointId]) -> Vec<Vec<JointId>> {
    let above = robot.joints_to(base).len();
    let path = |last: &JointId| -> Vec<JointId> {
        let joints = robot.joints_to(robot.joints[last.0].child);
        joints.into_iter().skip(above).filter(|joint| robot.joints[joint.0].moves()).collect()
    };
    last_joints.iter().map(path).collect()
}

/// The first joint of a finger that no other finger has, where others have joints before it: those are held, as folds of the palm.
fn first_own_joint(paths: &[Vec<JointId>], finger: usize) -> Option<JointId> {
    let is_shared = |joint: &JointId| paths.iter().enumerate().any(|(k, path)| k != finger && path.contains(joint));
    let last_shared = paths[finger].iter().rposition(is_shared)?;
    paths[finger].get(last_shared + 1).copied()
}

/// Most joints that some fingers of one hand share: folds of a palm. More are an arm.
const MAX_FOLDS: usize = 2;

/// Refuses a robot of which a part, or several parts, are hands (`U208`).
fn refuse_several_hands(robot: &Robot, base: LinkId, paths: &[Vec<JointId>], file: &Path) -> Result<(), InputError> {
    let palms = palms(robot, base, paths.iter().map(Vec::as_slice).collect());
    if palms == [base] {
        return Ok(());
    }
    let mut choices: Vec<String> = palms.iter().map(|palm| format!("--base {}", robot.links[palm.0].name)).collect();
    let shares = |k: usize| paths[..k].iter().any(|other| n_shared(other, &paths[k]) > 0);
    let problem = match (0..paths.len()).any(shares) {
        true => "is a robot with more on it than one hand: fingers share joints with others",
        false => {
            choices.push(format!("--base {} for one hand of all fingers", robot.links[base.0].name));
            "is a robot with more on it than one hand: several links carry three fingers or more each"
        }
    };
    Err(Diagnostic::new("U208", Place::file(file), problem)
        .expected("one hand")
        .fix(format!("regrasp inspect with {}", choices.join(", or ")))
        .into())
}

/// The links that fingers with the joints of `paths` after `base` seem to stand on.
fn palms(robot: &Robot, base: LinkId, paths: Vec<&[JointId]>) -> Vec<LinkId> {
    let n_common = paths.iter().skip(1).map(|path| n_shared(path, paths[0])).min().unwrap_or(0);
    let here = n_common.checked_sub(1).map_or(base, |last| robot.joints[paths[0][last].0].child);
    let mut groups: BTreeMap<JointId, Vec<&[JointId]>> = BTreeMap::new();
    for path in &paths {
        // A finger always has a joint of its own at the end.
        if let Some(next) = path.get(n_common) {
            groups.entry(*next).or_default().push(&path[n_common..]);
        }
    }
    let is_on_arm = |group: &&Vec<&[JointId]>| {
        let longest = |k: usize| group[..k].iter().map(|other| n_shared(other, group[k])).max().unwrap_or(0);
        (0..group.len()).any(|k| longest(k) > MAX_FOLDS)
    };
    let mut hands: Vec<&Vec<&[JointId]>> = groups.values().filter(is_on_arm).collect();
    if hands.is_empty() {
        hands = groups.values().filter(|group| group.len() >= 3).collect();
        if hands.len() < 2 {
            let mounted = mounted_palms(robot, paths.iter().filter_map(|path| path.get(n_common)));
            return if mounted.len() < 2 { vec![here] } else { mounted };
        }
    }
    hands.into_iter().flat_map(|group| palms(robot, here, group.clone())).collect()
}

/// Links that carry three fingers or more each, of fingers that begin with the joints `first`.
fn mounted_palms<'a>(robot: &Robot, first: impl Iterator<Item = &'a JointId>) -> Vec<LinkId> {
    let mut n_fingers: BTreeMap<LinkId, usize> = BTreeMap::new();
    for joint in first {
        *n_fingers.entry(robot.joints[joint.0].parent).or_default() += 1;
    }
    n_fingers.into_iter().filter(|(_, n)| *n >= 3).map(|(link, _)| link).collect()
}

/// How many joints two paths have in common.
fn n_shared(a: &[JointId], b: &[JointId]) -> usize {
    a.iter().zip(b).take_while(|(x, y)| x == y).count()
}

/// The links that end the fingers which `robot` seems to have.
pub(crate) fn tip_links(robot: &Robot) -> Vec<LinkId> {
    last_moving_joints(robot).iter().map(|last| guess_tip(robot, robot.joints[last.0].child).0).collect()
}

/// The link called `name`.
fn stated_base(robot: &Robot, name: &str, file: &Path) -> Result<LinkId, InputError> {
    robot.link_named(name).ok_or_else(|| {
        let meant = did_you_mean(name, robot.links.iter().map(|link| link.name.as_str()));
        Diagnostic::new("U205", Place::file(file), format!("the robot has no link \"{name}\""))
            .element("argument", "--base")
            .expected("the name of a link of the URDF")
            .fix(meant.map_or(String::new(), |meant| format!("--base {meant}")))
            .into()
    })
}

/// Radius of the ball around shapes that only stand in for missing geometry, in metres: the motors of the Hey5 hand have links with balls of
/// a millimetre.
const STAND_IN: f64 = 0.002;

/// Moving joints below which nothing moves, in document order; not those of fingers without any geometry, or with nothing but stand-ins
/// for it, unless no finger has any.
pub(super) fn last_moving_joints(robot: &Robot) -> Vec<JointId> {
    let last_joints = all_last_moving_joints(robot);
    let path = |last: &JointId| robot.joints_to(robot.joints[last.0].child);
    let paths: Vec<Vec<JointId>> = last_joints.iter().map(path).collect();
    let has_geometry = |joint: &JointId| {
        let links = rigid_links(robot, robot.joints[joint.0].child);
        links.iter().map(|(link, _)| &robot.links[link.0]).any(|link| match link.collision.is_empty() {
            true => !link.visual.is_empty(),
            false => link.collision.iter().any(|placed| placed.shape.bounding_sphere().1 > STAND_IN),
        })
    };
    let is_there = |finger: usize| {
        let is_own = |joint: &&JointId| !paths.iter().enumerate().any(|(k, path)| k != finger && path.contains(joint));
        paths[finger].iter().rev().take_while(is_own).any(has_geometry)
    };
    let there: Vec<JointId> = (0..paths.len()).filter(|&finger| is_there(finger)).map(|k| last_joints[k]).collect();
    if there.is_empty() { last_joints } else { there }
}

/// Moving joints below which nothing moves, in document order.
fn all_last_moving_joints(robot: &Robot) -> Vec<JointId> {
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
fn guess_tip(robot: &Robot, child: LinkId) -> (LinkId, (TipSpec, Option<PadSpec>)) {
    let links = rigid_links(robot, child);
    let mut farthest: Option<(f64, LinkId, usize, Point)> = None;
    for (link, body_from_link) in &links {
        for (element, placed) in robot.links[link.0].collision.iter().enumerate() {
            let body_from_shape = body_from_link * placed.parent_from_shape;
            let from_joint = body_from_shape.inverse() * Point::origin();
            let point = body_from_shape * super::tip_sphere::farthest_point(&placed.shape, &from_joint);
            let reach = point.coords.norm();
            if farthest.is_none_or(|(best, ..)| reach > best) {
                farthest = Some((reach, *link, element, point));
            }
        }
    }
    if let Some((_, link, element, point)) = farthest {
        let body_from_link = links.iter().find(|(other, _)| *other == link).map_or(Pose::identity(), |(_, pose)| *pose);
        let point_in_link = body_from_link.inverse() * point;
        let joint_in_link = body_from_link.inverse() * Point::origin();
        return (link, fit_tip(&robot.links[link.0].collision, &joint_in_link, element, &point_in_link));
    }
    // Without geometry the frame farthest from the joint is the tip.
    let far = links.iter().fold(None, |best: Option<(f64, LinkId)>, (link, pose)| {
        let reach = pose.translation.vector.norm();
        if best.is_none_or(|(most, _)| reach > most) { Some((reach, *link)) } else { best }
    });
    (far.map_or(child, |(_, link)| link), (TipSpec::Point { position: Point::origin() }, None))
}
