//! Trees of links: of a hand, of a part of a robot.

use super::{HandStory, LeaderStory, LinkKind, LinkStory, PoseData};
use regrasp_geometry::{Pose, UnitVector, Vector};
use regrasp_robot::{Coupling, Hand, Joint, JointId, JointKind, LinkId, Robot};

/// Which joints drive a body, and where all others are held.
pub(super) struct Drives<'a> {
    /// Names of the joints that drive the body.
    pub names: &'a [String],
    /// For each of them, the finger that it moves or -1; none for a body without fingers.
    pub fingers: &'a [i32],
    /// Position of any other joint.
    pub held: &'a dyn Fn(JointId) -> f64,
}

/// Links of a body in an order in which parents come first.
pub(super) struct Tree {
    pub(super) links: Vec<LinkStory>,
    /// The robot's link of each.
    pub(super) ids: Vec<LinkId>,
    /// By the robot's link: where it is in `links`, if the body has it.
    place_of: Vec<Option<usize>>,
}

impl Tree {
    /// The links of `robot` that are the body's `own`. Frames of links whose parents are not are in those parents.
    pub(super) fn new(robot: &Robot, own: &dyn Fn(LinkId) -> bool, drives: &Drives) -> Self {
        let mut tree = Tree { links: Vec::new(), ids: Vec::new(), place_of: vec![None; robot.links.len()] };
        if own(robot.root) {
            tree.add(robot, robot.root, None, fixed_link(&Pose::identity()));
        }
        let mut order = vec![robot.root];
        let mut next = 0;
        while next < order.len() {
            let parent = order[next];
            for id in robot.joints_from(parent) {
                let joint = &robot.joints[id.0];
                order.push(joint.child);
                if own(joint.child) {
                    let mut link = carried_link(robot, id, drives);
                    if let Some(of_parent) = tree.place_of[parent.0].map(|k| tree.links[k].finger).filter(|f| *f >= 0) {
                        link.finger = of_parent;
                    }
                    tree.add(robot, joint.child, tree.place_of[parent.0], link);
                }
            }
            next += 1;
        }
        tree
    }

    fn add(&mut self, robot: &Robot, id: LinkId, parent: Option<usize>, link: LinkStory) {
        let parent = parent.map_or(-1, |k| k as i32);
        self.place_of[id.0] = Some(self.links.len());
        self.ids.push(id);
        self.links.push(LinkStory { name: robot.links[id.0].name.clone(), parent, ..link });
    }

    /// Where a link of the robot is in `links`. It has to be one of the body.
    pub(super) fn place_of(&self, id: LinkId) -> usize {
        self.place_of[id.0].expect("a link of the body")
    }

    /// Places a hand of which the base stands at `world_from_hand`. No joint of the hand moves its base.
    pub(super) fn place_hand(&mut self, hand: &Hand, world_from_hand: &Pose) {
        self.links[0] = LinkStory { name: std::mem::take(&mut self.links[0].name), ..fixed_link(&Pose::identity()) };
        let root_from_link = world_from_links(&self.links, &vec![0.0; hand.n_joints()]);
        let world_from_root = world_from_hand * root_from_link[self.place_of(hand.base)].inverse();
        self.links[0].parent_from_joint = PoseData::from(&world_from_root);
    }

    /// Places a part of `robot`, whose links stand at `world_from_link`, and whose root stands at `world_from_root`.
    pub(super) fn place_part(&mut self, robot: &Robot, world_from_link: &[Pose], world_from_root: &Pose) {
        for (link, id) in self.links.iter_mut().zip(&self.ids).filter(|(link, _)| link.parent < 0) {
            let joint = robot.joints.iter().find(|joint| joint.child == *id);
            let world_from_parent = joint.map_or(world_from_root, |joint| &world_from_link[joint.parent.0]);
            link.parent_from_joint = PoseData::from(&(world_from_parent * Pose::from(&link.parent_from_joint)));
        }
    }
}

fn fixed_link(parent_from_joint: &Pose) -> LinkStory {
    LinkStory {
        name: String::new(),
        parent: -1,
        kind: LinkKind::Fixed,
        parent_from_joint: PoseData::from(parent_from_joint),
        axis: [0.0, 0.0, 1.0],
        joint: -1,
        multiplier: 0.0,
        offset: 0.0,
        others: Vec::new(),
        finger: -1,
    }
}

/// The link that a joint carries, without name and parent; fixed where the joint is held if nothing drives it.
fn carried_link(robot: &Robot, id: JointId, drives: &Drives) -> LinkStory {
    let joint: &Joint = &robot.joints[id.0];
    let drive = joint.coupling.clone().unwrap_or_else(|| Coupling::independent(id));
    let (mut driven, mut offset) = (Vec::new(), drive.offset);
    for &(leader, multiplier) in drive.terms.iter().filter(|_| joint.kind != JointKind::Fixed) {
        match drives.names.iter().position(|name| *name == robot.joints[leader.0].name) {
            Some(joint) => driven.push(LeaderStory { joint, multiplier }),
            None if drive.terms.len() > 1 => offset += multiplier * (drives.held)(leader),
            None => {}
        }
    }
    let slides = joint.kind == JointKind::Prismatic;
    let Some(first) = driven.first().copied() else {
        let held = || joint.parent_from_joint * motion(&joint.axis, slides, drive.position(drives.held));
        let parent_from_link = if joint.kind == JointKind::Fixed { joint.parent_from_joint } else { held() };
        return LinkStory { axis: joint.axis.into_inner().into(), ..fixed_link(&parent_from_link) };
    };
    LinkStory {
        kind: if slides { LinkKind::Prismatic } else { LinkKind::Revolute },
        axis: joint.axis.into_inner().into(),
        joint: first.joint as i32,
        multiplier: first.multiplier,
        offset,
        others: driven[1..].to_vec(),
        finger: drives.fingers.get(first.joint).copied().unwrap_or(-1),
        ..fixed_link(&joint.parent_from_joint)
    }
}

/// Pose of the child frame in the joint frame at `position`.
fn motion(axis: &UnitVector, slides: bool, position: f64) -> Pose {
    let along = axis.into_inner() * position;
    if slides { Pose::new(along, Vector::zeros()) } else { Pose::new(Vector::zeros(), along) }
}

/// Poses of links in the world, at these joint positions.
pub fn world_from_links(links: &[LinkStory], joints: &[f64]) -> Vec<Pose> {
    let mut poses: Vec<Pose> = Vec::with_capacity(links.len());
    for link in links {
        let others: f64 = link.others.iter().map(|other| other.multiplier * joints[other.joint]).sum();
        let position = usize::try_from(link.joint).map_or(0.0, |k| link.multiplier * joints[k] + others + link.offset);
        let axis = UnitVector::new_unchecked(Vector::from(link.axis));
        let moved = motion(&axis, link.kind == LinkKind::Prismatic, position);
        let parent_from_joint = Pose::from(&link.parent_from_joint);
        let world_from_joint = usize::try_from(link.parent).map_or(parent_from_joint, |k| poses[k] * parent_from_joint);
        poses.push(world_from_joint * moved);
    }
    poses
}

impl HandStory {
    /// Poses of its links in the world at `joints`, one value per entry of `joints`.
    pub fn world_from_links(&self, joints: &[f64]) -> Vec<Pose> {
        world_from_links(&self.links, joints)
    }
}
