//! A [`Hand`] from a robot and the choice of its fingers.
//!
//! Fixed joints are folded into bodies. A finger is the serial chain from the base to its tip link. What no finger
//! joint moves is palm, links above the base too where no arm carries the hand; moving joints that belong to no finger
//! are held at the position nearest to zero.

use super::chain::{ChainOwner, make_chain, middle_of_limits, remarks_on_stuck_leaders, rest_posture};
use super::fixes;
use super::hull_tip::HullTips;
use super::hulls::Hulls;
use super::spec::{Carried, FingerSpec, HandSpec, RigidBody, TipSpec};
use super::tip_split;
use crate::coupling::Coupling;
use crate::hand::{Finger, FingerShape, Hand, MAX_FINGERS, PalmShape};
use crate::inspect::crowded::{inseparable_note, inseparable_pairs};
use crate::robot::{JointId, JointKind, LinkId, Robot};
use crate::tip::{Pad, Tip, TipEllipsoid, TipShape};
use regrasp_base::diagnostic::Diagnostics;
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_geometry::Pose;
use regrasp_geometry::shape::PlacedShape;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;
use std::sync::Arc;

/// The hand, and remarks. Errors: `U206`..`U212`, too many fingers (`U221`) or joints of a finger (`U222`).
pub(crate) fn assemble(robot: &Arc<Robot>, spec: &HandSpec, file: &Path) -> Result<(Hand, Vec<String>), InputError> {
    let mut found = Diagnostics::default();
    let mut notes = Vec::new();
    if spec.fingers.len() > MAX_FINGERS {
        let problem = format!("has {} fingers", spec.fingers.len());
        return Err(Diagnostic::new("U221", Place::file(file), problem)
            .expected(format!("at most {MAX_FINGERS}"))
            .fix(format!("write a hand file that names at most {MAX_FINGERS} of them (docs/reference/hand-format.md)"))
            .into());
    }
    let moving = moving_joints(robot, spec, &mut found);
    // Every later step needs the chains.
    std::mem::take(&mut found).into_result(())?;
    let owner: BTreeMap<JointId, (usize, usize)> = moving
        .iter()
        .enumerate()
        .flat_map(|(finger, joints)| joints.iter().enumerate().map(move |(body, &joint)| (joint, (finger, body))))
        .collect();
    let carried = carry(robot, spec, &owner, file, &mut found, &mut notes);
    let (mut hulls, mut hull_tips) = (Hulls::new(robot, file), HullTips::default());
    let mut fingers = Vec::new();
    for (index, (finger, joints)) in spec.fingers.iter().zip(&moving).enumerate() {
        fingers.extend(make_finger(robot, index, finger, joints, &carried, (&mut hulls, &mut hull_tips), &mut found));
    }
    notes.extend(fingers.iter().flat_map(|finger| remarks_on_stuck_leaders(robot, &finger.chain)));
    // An arm that carries the hand moves, and is no part of it.
    let above = match spec.mount {
        Some(_) => BTreeMap::new(),
        None => above_base((robot, spec), &carried, &owner, file, &mut found),
    };
    let of_palm =
        carried.iter().filter(|(_, at)| at.body == RigidBody::Palm).map(|(&link, at)| (link, at.body_from_link));
    let mut palm = Vec::new();
    for (link, base_from_link) in of_palm.chain(above.iter().map(|(&link, &pose)| (link, pose))) {
        let shapes = hulls.of_link(link, &base_from_link, &mut found);
        palm.extend(shapes.into_iter().map(|placed| PalmShape { link, placed }));
    }
    let neighbours = neighbours(robot, &carried, &moving);
    let mut allowed_pairs = spec.allow.clone();
    allowed_pairs.extend(neighbours.adjacent);
    if !above.is_empty() {
        let base = &robot.links[spec.base.0].name;
        let names: Vec<String> = above.keys().map(|link| format!("\"{}\"", robot.links[link.0].name)).collect();
        notes.push(format!(
            "what is above base link \"{base}\" stands still with it, its joints as near to zero as their limits let them: {}",
            some_of(&names)
        ));
    }
    for finger in &spec.fingers {
        let link = &robot.links[finger.tip_link.0];
        if link.collision.is_empty() {
            notes.push(format!("finger \"{}\": tip link \"{}\" has no collision geometry", finger.name, link.name));
        }
    }
    notes.extend(drawn_only_note(robot, spec, carried.keys().copied()));
    let held =
        spec.held.iter().filter(|(joint, _)| !owner.contains_key(joint)).map(|(&joint, &at)| (joint, at)).collect();
    let mut hand = Hand {
        robot: robot.clone(),
        base: spec.base,
        fingers,
        palm,
        allowed_pairs,
        held,
        without_geometry: spec.without_geometry.clone(),
        ties: Vec::new(),
    };
    let inseparable = inseparable_pairs(&hand, &neighbours.across);
    if !inseparable.is_empty() {
        notes.push(inseparable_note(robot, &inseparable));
        hand.allowed_pairs.extend(inseparable);
    }
    found.into_result((hand, notes))
}

/// Links that are named at most.
const MOST_NAMED: usize = 8;

/// What is said of those of `links` that are drawn and have no collision geometry; fingertips have a remark of their own.
fn drawn_only_note(robot: &Robot, spec: &HandSpec, links: impl Iterator<Item = LinkId>) -> Option<String> {
    let is_tip = |link: LinkId| spec.fingers.iter().any(|finger| finger.tip_link == link);
    let is_drawn_only = |link: &LinkId| {
        let of = &robot.links[link.0];
        of.collision.is_empty() && !of.visual.is_empty() && !is_tip(*link) && !spec.without_geometry.contains(link)
    };
    let drawn: Vec<String> =
        links.filter(is_drawn_only).map(|link| format!("\"{}\"", robot.links[link.0].name)).collect();
    (!drawn.is_empty()).then(|| {
        format!(
            "links that are drawn but have no collision geometry, so that plans do not keep clear of them (unless `collision_from_visuals` \
             in the hand file names them): {}",
            some_of(&drawn)
        )
    })
}

/// The first of `names`, and how many more there are.
pub(crate) fn some_of(names: &[String]) -> String {
    let more = match names.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    names[..names.len().min(MOST_NAMED)].join(", ") + &more
}

/// The moving joints of each finger, base first.
fn moving_joints(robot: &Robot, spec: &HandSpec, found: &mut Diagnostics) -> Vec<Vec<JointId>> {
    let base_path = robot.joints_to(spec.base);
    let mut chains: Vec<Vec<JointId>> = Vec::new();
    for (index, finger) in spec.fingers.iter().enumerate() {
        let say = |code, problem: String, expected: &str, fix: String| {
            Diagnostic::new(code, finger.place.clone(), problem)
                .element("finger", &finger.name)
                .expected(expected)
                .fix(fix)
        };
        if finger.name.is_empty() || spec.fingers[..index].iter().any(|other| other.name == finger.name) {
            found.push(say("U211", "the name is empty or used twice".into(), "a name of its own", String::new()));
        }
        let path = robot.joints_to(finger.tip_link);
        let base_name = &robot.links[spec.base.0].name;
        let tip_name = &robot.links[finger.tip_link.0].name;
        let mut joints = Vec::new();
        if !path.starts_with(&base_path) {
            let problem = format!("tip link \"{tip_name}\" is not carried by base link \"{base_name}\"");
            found.push(say(
                "U206",
                problem,
                "a tip link below the base link",
                fixes::tip_elsewhere(robot, spec, index),
            ));
        } else {
            let below = &path[base_path.len()..];
            let first = finger.first_joint.map(|joint| below.iter().position(|&other| other == joint));
            if let Some(None) = first {
                let joint = finger.first_joint.map_or("", |joint| &robot.joints[joint.0].name);
                let problem = format!("first joint \"{joint}\" is not between \"{base_name}\" and \"{tip_name}\"");
                found.push(say("U206", problem, "a joint of the finger", fixes::first_joint(robot, below)));
            }
            let from = first.flatten().unwrap_or(0);
            joints.extend(below[from..].iter().copied().filter(|j| robot.joints[j.0].kind != JointKind::Fixed));
            if joints.is_empty() {
                let problem = format!("no joint moves between \"{base_name}\" and \"{tip_name}\"");
                found.push(say("U207", problem, "at least one moving joint", String::new()));
            }
        }
        if let Some((other, shared)) = chains
            .iter()
            .enumerate()
            .find_map(|(other, chain)| joints.iter().find(|joint| chain.contains(joint)).map(|&joint| (other, joint)))
        {
            let problem =
                format!("joint \"{}\" moves finger \"{}\" too", robot.joints[shared.0].name, spec.fingers[other].name);
            let fix = fixes::shared_joint(robot, spec, [other, index], [&chains[other], &joints]);
            found.push(say("U208", problem, "fingers that share no joint", fix));
        }
        chains.push(joints);
    }
    chains
}

/// Walks from the base over all joints that are not on the way to another part of the robot.
fn carry(
    robot: &Robot,
    spec: &HandSpec,
    owner: &BTreeMap<JointId, (usize, usize)>,
    file: &Path,
    found: &mut Diagnostics,
    notes: &mut Vec<String>,
) -> BTreeMap<LinkId, Carried> {
    let base = spec.base;
    let mut carried = BTreeMap::from([(base, Carried { body: RigidBody::Palm, body_from_link: Pose::identity() })]);
    let mut waiting = VecDeque::from([base]);
    while let Some(link) = waiting.pop_front() {
        let at = carried[&link];
        if let Some(up) = robot.links[link.0].parent_joint {
            let joint = &robot.joints[up.0];
            let is_mount = spec.mount == Some(joint.parent);
            if !joint.moves() && !is_mount && !carried.contains_key(&joint.parent) {
                let body_from_link = at.body_from_link * joint.parent_from_joint.inverse();
                carried.insert(joint.parent, Carried { body: at.body, body_from_link });
                waiting.push_back(joint.parent);
            }
        }
        for id in robot.joints_from(link) {
            let joint = &robot.joints[id.0];
            if carried.contains_key(&joint.child) {
                continue;
            }
            let child = match owner.get(&id) {
                Some(&(finger, body)) => {
                    Carried { body: RigidBody::Finger { finger, body }, body_from_link: Pose::identity() }
                }
                None => {
                    let held = held_at((robot, spec), id, owner, file, found, notes);
                    let body_from_link = at.body_from_link * joint.parent_from_joint * held;
                    Carried { body: at.body, body_from_link }
                }
            };
            carried.insert(joint.child, child);
            waiting.push_back(joint.child);
        }
    }
    carried
}

/// Poses in the base frame of the links that no link in `carried` carries: those above the base, and their other branches.
fn above_base(
    (robot, spec): (&Robot, &HandSpec),
    carried: &BTreeMap<LinkId, Carried>,
    owner: &BTreeMap<JointId, (usize, usize)>,
    file: &Path,
    found: &mut Diagnostics,
) -> BTreeMap<LinkId, Pose> {
    // One remark for all of them is enough.
    let mut notes = Vec::new();
    let mut above: BTreeMap<LinkId, Pose> = BTreeMap::new();
    let mut waiting: VecDeque<(LinkId, Pose)> = carried
        .iter()
        .filter(|(_, at)| at.body == RigidBody::Palm)
        .map(|(&link, at)| (link, at.body_from_link))
        .collect();
    while let Some((link, base_from_link)) = waiting.pop_front() {
        let up = robot.links[link.0].parent_joint.map(|id| (id, robot.joints[id.0].parent));
        let down = robot.joints_from(link).map(|id| (id, robot.joints[id.0].child));
        for (id, next) in up.into_iter().chain(down) {
            if carried.contains_key(&next) || above.contains_key(&next) {
                continue;
            }
            let parent_from_child =
                robot.joints[id.0].parent_from_joint * held_at((robot, spec), id, owner, file, found, &mut notes);
            let is_up = Some(id) == robot.links[link.0].parent_joint;
            let link_from_next = if is_up { parent_from_child.inverse() } else { parent_from_child };
            above.insert(next, base_from_link * link_from_next);
            waiting.push_back((next, base_from_link * link_from_next));
        }
    }
    above
}

/// The motion of a joint that belongs to no finger, at the position where it is held.
fn held_at(
    (robot, spec): (&Robot, &HandSpec),
    id: JointId,
    owner: &BTreeMap<JointId, (usize, usize)>,
    file: &Path,
    found: &mut Diagnostics,
    notes: &mut Vec<String>,
) -> Pose {
    let joint = &robot.joints[id.0];
    if joint.kind == JointKind::Fixed {
        return Pose::identity();
    }
    let on_finger = |coupling: &Coupling| coupling.terms.iter().find(|(leader, _)| owner.contains_key(leader)).copied();
    let position = match &joint.coupling {
        Some(coupling) if let Some((leader, _)) = on_finger(coupling) => {
            let problem = format!(
                "follows finger joint \"{}\" but is on no finger: linkages are not supported",
                robot.joints[leader.0].name
            );
            found.push(
                Diagnostic::new("U209", Place::file(file), problem)
                    .element("joint", &joint.name)
                    .expected("followers on the chain of the joint they follow")
                    .fix(fixes::hold_in_urdf(&joint.name)),
            );
            return Pose::identity();
        }
        Some(coupling) => coupling.position(|leader| robot.joints[leader.0].nearest_to_zero()),
        None => joint.nearest_to_zero(),
    };
    // Where the hand file holds a joint is its zero here.
    let told = spec.held.get(&id).map_or(position, |held| held + position);
    notes.push(format!("joint \"{}\" belongs to no finger; held at {told}", joint.name));
    joint.motion(position)
}

fn make_finger(
    robot: &Robot,
    index: usize,
    spec: &FingerSpec,
    joints: &[JointId],
    carried: &BTreeMap<LinkId, Carried>,
    (hulls, hull_tips): (&mut Hulls, &mut HullTips),
    found: &mut Diagnostics,
) -> Option<Finger> {
    let owner = ChainOwner { kind: "finger", name: &spec.name, place: &spec.place, rest_key: "rest" };
    let chain = make_chain(robot, &owner, joints, carried, found)?;
    let body_from_link = carried.get(&spec.tip_link)?.body_from_link;
    let pad = spec.pad.as_ref().map(|pad| Pad { axis_in_body: body_from_link * pad.axis, cosine: pad.angle.cos() });
    let tip = |shape, center_in_body| Tip { link: spec.tip_link, shape, center_in_body, pad, contact: spec.contact };
    let round = match &spec.tip {
        TipSpec::Sphere { radius, center } => Some(tip(TipShape::Sphere { radius: *radius }, body_from_link * center)),
        TipSpec::Ellipsoid { radii, center, link_from_ellipsoid } => {
            let ellipsoid = TipEllipsoid::new(*radii, body_from_link.rotation * link_from_ellipsoid);
            Some(tip(TipShape::Ellipsoid(ellipsoid), body_from_link * center))
        }
        TipSpec::Point { .. } | TipSpec::Hull { .. } => None,
    };
    let own = round.as_ref().and_then(Tip::own_shape);
    let mut shapes = Vec::new();
    for (&link, at) in carried {
        let RigidBody::Finger { finger, body } = at.body else { continue };
        if finger != index {
            continue;
        }
        let placed = hulls.of_link(link, &at.body_from_link, found);
        match &own {
            Some(own) if link == spec.tip_link => shapes.extend(tip_split::split(placed, link, body, own)),
            _ => {
                let is_tip = |element: usize| link == spec.tip_link && spec.tip.is_made_of(element);
                let shape = |(k, placed)| FingerShape { body, link, placed, is_tip: is_tip(k) };
                shapes.extend(placed.into_iter().enumerate().map(shape));
            }
        }
    }
    shapes.sort_by_key(|shape| (shape.body, shape.link));
    let tip = match (&spec.tip, round) {
        (_, Some(tip)) => tip,
        (TipSpec::Hull { center, elements }, None) => {
            let n_elements = robot.links[spec.tip_link.0].collision.len();
            if let Some(missing) = elements.iter().find(|&&element| element >= n_elements) {
                let problem = format!("the tip is to be made of <collision> element {missing} of {n_elements}");
                let diagnostic = Diagnostic::new("U210", spec.place.clone(), problem).element("finger", &spec.name);
                found.push(diagnostic.expected("indices from 0 of collision elements of the tip link"));
                return None;
            }
            let own: Vec<&PlacedShape> =
                shapes.iter().filter(|shape| shape.is_tip).map(|shape| &shape.placed).collect();
            // Geometry without a hull has been refused above.
            if own.is_empty() && n_elements > 0 {
                return None;
            }
            match hull_tips.make(&own, &(body_from_link * center), pad.as_ref(), elements) {
                Ok((center, shape)) => tip(shape, center),
                Err((problem, expected, fix)) => {
                    let diagnostic = Diagnostic::new("U210", spec.place.clone(), problem).element("finger", &spec.name);
                    found.push(diagnostic.expected(expected).fix(fix));
                    return None;
                }
            }
        }
        (TipSpec::Point { position }, None) => tip(TipShape::Point, body_from_link * position),
        (TipSpec::Sphere { .. } | TipSpec::Ellipsoid { .. }, None) => unreachable!("made above"),
    };
    let rest = rest_posture(&owner, &spec.rest, &chain, middle_of_limits(&chain), found);
    Some(Finger::new(spec.name.clone(), chain, tip, shapes, rest))
}

/// Distance within which joints are in one place, in metres.
const ONE_PLACE: f64 = 0.001;

/// Pairs of links that are next to each other.
#[derive(Default)]
struct Neighbours {
    /// Of one body, or of two that one joint connects, or several in one place: they meet there.
    adjacent: BTreeSet<(LinkId, LinkId)>,
    /// With bodies without shapes between them, or joints that are held: they may meet or not.
    across: BTreeSet<(LinkId, LinkId)>,
}

/// The neighbours among the links that have collision geometry.
fn neighbours(robot: &Robot, carried: &BTreeMap<LinkId, Carried>, moving: &[Vec<JointId>]) -> Neighbours {
    let mut links_of: BTreeMap<RigidBody, Vec<LinkId>> = BTreeMap::new();
    for (&link, at) in carried.iter().filter(|(link, _)| !robot.links[link.0].collision.is_empty()) {
        links_of.entry(at.body).or_default().push(link);
    }
    // Links with the same one are joined by fixed joints.
    let rigid_root = |link: LinkId| {
        let mut at = link;
        while let Some(joint) = robot.links[at.0].parent_joint.map(|joint| &robot.joints[joint.0])
            && joint.kind == JointKind::Fixed
        {
            at = joint.parent;
        }
        at
    };
    let ordered = |a: LinkId, b: LinkId| (a.min(b), a.max(b));
    let offset = |joint: JointId| {
        let joint = &robot.joints[joint.0];
        (robot.fixed_pose_in_body(joint.parent) * joint.parent_from_joint).translation.vector.norm()
    };
    let mut found = Neighbours::default();
    for links in links_of.values() {
        let pairs = links.iter().enumerate().flat_map(|(k, &a)| links[..k].iter().map(move |&b| ordered(a, b)));
        found.adjacent.extend(pairs);
    }
    for (finger, joints) in moving.iter().enumerate() {
        let root = joints.first().map(|first| rigid_root(robot.joints[first.0].parent));
        let bodies = (0..joints.len()).map(|body| RigidBody::Finger { finger, body });
        let with_shapes: Vec<(usize, &Vec<LinkId>)> = std::iter::once(RigidBody::Palm)
            .chain(bodies)
            .enumerate()
            .filter_map(|(depth, body)| Some((depth, links_of.get(&body)?)))
            .collect();
        for pair in with_shapes.windows(2) {
            let [(depth, above), (next, below)] = [pair[0], pair[1]];
            // Joints in one place, as those of a knuckle that turns both ways, are as one.
            let is_one_place = joints[depth..next].iter().skip(1).all(|joint| offset(*joint) < ONE_PLACE);
            for &a in above {
                let is_held_off = depth == 0 && Some(rigid_root(a)) != root;
                let kind = if is_held_off || !is_one_place { &mut found.across } else { &mut found.adjacent };
                kind.extend(below.iter().map(|&b| ordered(a, b)));
            }
        }
    }
    found
}
