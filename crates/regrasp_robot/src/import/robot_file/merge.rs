//! Several robots as one tree.

use crate::coupling::Coupling;
use crate::robot::{Joint, JointId, JointKind, Link, LinkId, Robot};
use regrasp_geometry::{Pose, UnitVector, Vector};

/// Where the links and joints of a robot stand in the tree that it became part of.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// Put in front of its names.
    pub prefix: String,
    first_link: usize,
    first_joint: usize,
}

impl Place {
    /// The place of a robot that is the whole tree.
    pub(super) fn whole() -> Self {
        Place { prefix: String::new(), first_link: 0, first_joint: 0 }
    }

    pub(super) fn link(&self, link: LinkId) -> LinkId {
        LinkId(self.first_link + link.0)
    }

    pub(super) fn joint(&self, joint: JointId) -> JointId {
        JointId(self.first_joint + joint.0)
    }

    pub(super) fn name(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }

    pub(super) fn coupling(&self, coupling: &Coupling) -> Coupling {
        let terms = coupling.terms.iter().map(|&(leader, multiplier)| (self.joint(leader), multiplier)).collect();
        Coupling { terms, offset: coupling.offset }
    }
}

/// A tree of one link without geometry, for robots to be mounted on.
pub(super) fn empty(name: &str) -> Robot {
    let root = Link {
        name: "root".into(),
        collision: Vec::new(),
        visual: Vec::new(),
        collision_from_visuals: false,
        parent_joint: None,
    };
    Robot { name: name.to_owned(), links: vec![root], joints: Vec::new(), root: LinkId(0) }
}

/// Adds `part`, its names behind `prefix`, with its root fixed at `mount_from_root` to link `mount` of `tree`.
pub(super) fn mount(tree: &mut Robot, part: &Robot, prefix: &str, mount: LinkId, mount_from_root: &Pose) -> Place {
    let place = Place { prefix: prefix.to_owned(), first_link: tree.links.len(), first_joint: tree.joints.len() };
    let joint_to_part = JointId(place.first_joint + part.joints.len());
    tree.links.extend(part.links.iter().map(|link| Link {
        name: place.name(&link.name),
        parent_joint: Some(link.parent_joint.map_or(joint_to_part, |joint| place.joint(joint))),
        ..link.clone()
    }));
    tree.joints.extend(part.joints.iter().map(|joint| Joint {
        name: place.name(&joint.name),
        parent: place.link(joint.parent),
        child: place.link(joint.child),
        coupling: joint.coupling.as_ref().map(|coupling| place.coupling(coupling)),
        ..joint.clone()
    }));
    tree.joints.push(Joint {
        name: place.name("mount"),
        kind: JointKind::Fixed,
        parent: mount,
        child: place.link(part.root),
        parent_from_joint: *mount_from_root,
        axis: UnitVector::new_unchecked(Vector::x()),
        limits: None,
        coupling: None,
    });
    place
}
