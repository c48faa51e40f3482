//! The links of a hand: how they move, what they collide with and what they look like.

use super::shapes::Shapes;
use super::{Carrier, LeaderStory, LinkKind, LinkStory, Part, PieceStory, PoseData, Role};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, UnitVector, Vector};
use regrasp_robot::tip::is_same_surface;
use regrasp_robot::{Coupling, Hand, Joint, JointId, JointKind, LinkId, ResolveOptions, Robot};

/// Links in an order in which parents come first.
pub(super) struct Tree {
    pub(super) links: Vec<LinkStory>,
    /// The robot's link of each.
    ids: Vec<LinkId>,
    /// By the robot's link: where it is in `links`.
    pub(super) place_of: Vec<usize>,
}

impl Tree {
    pub(super) fn new(hand: &Hand) -> Self {
        let robot: &Robot = &hand.robot;
        let names = hand.joint_names();
        let finger_of: Vec<i32> = (0i32..)
            .zip(&hand.fingers)
            .flat_map(|(f, finger)| std::iter::repeat_n(f, finger.chain.n_coordinates()))
            .collect();
        let root = LinkStory {
            name: robot.links[robot.root.0].name.clone(),
            parent: -1,
            kind: LinkKind::Fixed,
            parent_from_joint: PoseData::from(&Pose::identity()),
            axis: [0.0, 0.0, 1.0],
            joint: -1,
            multiplier: 0.0,
            offset: 0.0,
            others: Vec::new(),
            finger: -1,
        };
        let mut tree = Tree { links: vec![root], ids: vec![robot.root], place_of: vec![0; robot.links.len()] };
        let mut next = 0;
        while next < tree.ids.len() {
            for id in robot.joints_from(tree.ids[next]) {
                let joint = &robot.joints[id.0];
                let drive = joint.coupling.clone().unwrap_or_else(|| Coupling::independent(id));
                let held = |leader: JointId| {
                    let limits = robot.joints[leader.0].limits;
                    limits.map_or(0.0, |limits| 0f64.max(limits.lower).min(limits.upper))
                };
                let (mut driven, mut offset) = (Vec::new(), drive.offset);
                for &(leader, multiplier) in drive.terms.iter().filter(|_| joint.kind != JointKind::Fixed) {
                    match names.iter().position(|name| *name == robot.joints[leader.0].name) {
                        Some(joint) => driven.push(LeaderStory { joint, multiplier }),
                        None if drive.terms.len() > 1 => offset += multiplier * held(leader),
                        None => {}
                    }
                }
                let coordinate = driven.first().map(|first| first.joint);
                let mut link = carried_link(joint, &driven, offset, drive.position(held));
                link.name.clone_from(&robot.links[joint.child.0].name);
                link.parent = next as i32;
                link.finger = match tree.links[next].finger {
                    -1 => coordinate.map_or(-1, |k| finger_of[k]),
                    of_parent => of_parent,
                };
                tree.place_of[joint.child.0] = tree.ids.len();
                tree.ids.push(joint.child);
                tree.links.push(link);
            }
            next += 1;
        }
        tree
    }

    /// Where the root stands when the hand's base stands at `world_from_hand`. No coordinate of the hand moves its base.
    pub(super) fn world_from_root(&self, hand: &Hand, world_from_hand: &Pose) -> Pose {
        let poses = world_from_links(&self.links, &Pose::identity(), &vec![0.0; hand.n_joints()]);
        world_from_hand * poses[self.place_of[hand.base.0]].inverse()
    }
}

/// The link that `joint` carries, without name, parent and finger; fixed at `held` where no coordinate drives the joint.
fn carried_link(joint: &Joint, driven: &[LeaderStory], offset: f64, held: f64) -> LinkStory {
    let slides = joint.kind == JointKind::Prismatic;
    let first = driven.first();
    let (kind, at_zero) = match (first, joint.kind) {
        (Some(_), _) if slides => (LinkKind::Prismatic, joint.parent_from_joint),
        (Some(_), _) => (LinkKind::Revolute, joint.parent_from_joint),
        (None, JointKind::Fixed) => (LinkKind::Fixed, joint.parent_from_joint),
        (None, _) => (LinkKind::Fixed, joint.parent_from_joint * motion(&joint.axis, slides, held)),
    };
    LinkStory {
        name: String::new(),
        parent: -1,
        kind,
        parent_from_joint: PoseData::from(&at_zero),
        axis: joint.axis.into_inner().into(),
        joint: first.map_or(-1, |first| first.joint as i32),
        multiplier: first.map_or(0.0, |first| first.multiplier),
        offset: first.map_or(0.0, |_| offset),
        others: driven.iter().skip(1).copied().collect(),
        finger: -1,
    }
}

/// Pose of the child frame in the joint frame at `position`.
fn motion(axis: &UnitVector, slides: bool, position: f64) -> Pose {
    let along = axis.into_inner() * position;
    if slides { Pose::new(along, Vector::zeros()) } else { Pose::new(Vector::zeros(), along) }
}

/// Poses of links in the world, at these coordinates.
pub(super) fn world_from_links(links: &[LinkStory], world_from_root: &Pose, joints: &[f64]) -> Vec<Pose> {
    let mut poses: Vec<Pose> = Vec::with_capacity(links.len());
    for link in links {
        let parent = usize::try_from(link.parent).map_or(*world_from_root, |k| poses[k]);
        let others: f64 = link.others.iter().map(|other| other.multiplier * joints[other.joint]).sum();
        let position = usize::try_from(link.joint).map_or(0.0, |k| link.multiplier * joints[k] + others + link.offset);
        let axis = UnitVector::new_unchecked(Vector::from(link.axis));
        let moved = motion(&axis, link.kind == LinkKind::Prismatic, position);
        poses.push(parent * Pose::from(&link.parent_from_joint) * moved);
    }
    poses
}

/// What planner and checker keep apart of the links that are the hand's `own`: meshes as their hulls, and the balls of fingertips.
pub(super) fn link_pieces(
    hand: &Hand,
    tree: &Tree,
    own: &dyn Fn(LinkId) -> bool,
    shapes: &mut Shapes,
) -> Vec<PieceStory> {
    let mut pieces = Vec::new();
    for (place, id) in tree.ids.iter().enumerate().filter(|(_, id)| own(**id)) {
        let link = &hand.robot.links[id.0];
        let tip = hand.fingers.iter().find(|finger| finger.tip.link == *id);
        let mut add = |from_mesh: &Pose, mesh: usize| {
            pieces.push(PieceStory {
                on: Carrier::Link(place),
                part: Part::Hand,
                name: link.name.clone(),
                role: Role::Collision,
                mesh,
                from_mesh: PoseData::from(from_mesh),
                is_tip: tip.is_some(),
            });
        };
        for placed in &link.collision {
            let mesh = shapes.hull_of(&placed.shape);
            add(&placed.parent_from_shape, mesh);
        }
        if let Some(own) = tip.and_then(|finger| finger.tip.own_shape()) {
            let link_from_body = hand.robot.fixed_pose_in_body(*id).inverse();
            let own = PlacedShape { parent_from_shape: link_from_body * own.parent_from_shape, shape: own.shape };
            if !link.collision.iter().any(|placed| is_same_surface(placed, &own)) {
                add(&own.parent_from_shape, shapes.index_of(&own.shape));
            }
        }
    }
    pieces
}

/// The same piece as a look.
pub(super) fn as_look(piece: &PieceStory) -> PieceStory {
    PieceStory { role: Role::Visual, ..piece.clone() }
}

/// What hands look like.
pub(super) struct Looks {
    /// The pieces; where nothing is known of a link, those that collide.
    pub pieces: Vec<PieceStory>,
    /// True where a robot says how anything looks.
    pub are_known: bool,
    /// Remarks on what could not be read.
    pub notes: Vec<(String, String)>,
}

impl Looks {
    /// With those of another hand.
    pub(super) fn join(&mut self, other: Looks) {
        self.pieces.extend(other.pieces);
        self.are_known |= other.are_known;
        self.notes.extend(other.notes);
    }
}

/// What the links that are a hand's `own` look like, with the pieces of `collision` where nothing is known.
pub(super) fn link_looks(
    hand: &Hand,
    tree: &Tree,
    own: &dyn Fn(LinkId) -> bool,
    collision: &[PieceStory],
    packages: &ResolveOptions,
    shapes: &mut Shapes,
) -> Looks {
    let mut pieces = Vec::new();
    let mut notes = Vec::new();
    let mut are_known = false;
    for (place, id) in tree.ids.iter().enumerate().filter(|(_, id)| own(**id)) {
        let link = &hand.robot.links[id.0];
        let is_tip = hand.fingers.iter().any(|finger| finger.tip.link == *id);
        let found: Result<Vec<(Pose, usize)>, String> = link
            .visual
            .iter()
            .map(|visual| Ok((visual.parent_from_visual, shapes.visual(&visual.geometry, packages)?)))
            .collect();
        match found {
            Ok(found) if !found.is_empty() => {
                are_known = true;
                pieces.extend(found.into_iter().map(|(from_mesh, mesh)| PieceStory {
                    on: Carrier::Link(place),
                    part: Part::Hand,
                    name: link.name.clone(),
                    role: Role::Visual,
                    mesh,
                    from_mesh: PoseData::from(&from_mesh),
                    is_tip,
                }));
            }
            found => {
                if let Err(problem) = found {
                    notes.push((format!("Looks of {}", link.name), format!("collision geometry: {problem}")));
                }
                let on_link = collision.iter().filter(|piece| piece.on == Carrier::Link(place));
                pieces.extend(on_link.map(as_look));
            }
        }
    }
    Looks { pieces, are_known, notes }
}
