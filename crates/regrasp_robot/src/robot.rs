//! Links and joints of a robot, as read.

use crate::coupling::Coupling;
pub use crate::ids::{JointId, LinkId};
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, UnitVector, Vector};
use std::path::PathBuf;

/// A rigid body.
#[derive(Debug, Clone)]
pub struct Link {
    /// Name, unique in the robot.
    pub name: String,
    /// Collision geometry, placed in the link frame. Meshes are kept as read.
    pub collision: Vec<PlacedShape>,
    /// What it looks like: for pictures, and never looked at in planning.
    pub visual: Vec<Visual>,
    /// True when [`Self::collision`] was read from the visual elements, because the link has no collision elements.
    pub collision_from_visuals: bool,
    /// The joint that carries this link; none for the root.
    pub parent_joint: Option<JointId>,
}

/// A part of what a link looks like.
#[derive(Debug, Clone, PartialEq)]
pub struct Visual {
    /// Pose of the geometry's frame in the link frame.
    pub parent_from_visual: Pose,
    /// The geometry.
    pub geometry: VisualGeometry,
}

/// Geometry of a [`Visual`].
#[derive(Debug, Clone, PartialEq)]
pub enum VisualGeometry {
    /// A shape.
    Shape(Shape),
    /// A mesh file, which loading a robot does not open.
    Mesh(VisualMesh),
    /// What could not be understood, in words.
    Unreadable(String),
}

/// A mesh file that a robot file names: [`VisualMesh::load`] reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct VisualMesh {
    /// As the robot file names it.
    pub name: String,
    /// The robot file.
    pub model: PathBuf,
    /// Scale along the axes.
    pub scale: Vector,
}

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Turns about its axis, within limits.
    Revolute,
    /// Turns about its axis, without limits.
    Continuous,
    /// Slides along its axis, within limits.
    Prismatic,
}

/// What a joint may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lowest position, in radians or metres.
    pub lower: f64,
    /// Highest position, in radians or metres.
    pub upper: f64,
    /// Highest speed, in rad/s or m/s, where given.
    pub velocity: Option<f64>,
    /// Highest torque or force, in N m or N, where given.
    pub effort: Option<f64>,
}

/// A joint between two links.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Name, unique in the robot.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// The link that carries it.
    pub parent: LinkId,
    /// The link that it carries.
    pub child: LinkId,
    /// Pose of the joint frame (the child's frame at position zero) in the parent link's frame.
    pub parent_from_joint: Pose,
    /// Axis, in the joint frame.
    pub axis: UnitVector,
    /// Limits; always present for revolute and prismatic joints.
    pub limits: Option<Limits>,
    /// What it follows, for a joint that is not independent. Leaders are independent joints: loading resolves followers of
    /// followers.
    pub coupling: Option<Coupling>,
}

impl Joint {
    /// False for a fixed joint.
    pub fn moves(&self) -> bool {
        self.kind != JointKind::Fixed
    }

    /// The position nearest to zero that its limits allow.
    pub fn nearest_to_zero(&self) -> f64 {
        self.limits.map_or(0.0, |limits| 0.0f64.clamp(limits.lower, limits.upper))
    }

    /// Pose of the child's frame in the joint frame at `position`; the identity for a fixed joint.
    pub fn motion(&self, position: f64) -> Pose {
        match self.kind {
            JointKind::Fixed => Pose::identity(),
            JointKind::Prismatic => {
                Pose::from_parts(Translation3::from(self.axis.into_inner() * position), UnitQuaternion::identity())
            }
            JointKind::Revolute | JointKind::Continuous => {
                Pose::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&self.axis, position))
            }
        }
    }
}

/// A tree of links and joints, as read.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Name.
    pub name: String,
    /// Links in document order.
    pub links: Vec<Link>,
    /// Joints in document order.
    pub joints: Vec<Joint>,
    /// The link that no joint carries.
    pub root: LinkId,
}

impl Robot {
    /// The link called `name`.
    pub fn link_named(&self, name: &str) -> Option<LinkId> {
        self.links.iter().position(|link| link.name == name).map(LinkId)
    }

    /// The joint called `name`.
    pub fn joint_named(&self, name: &str) -> Option<JointId> {
        self.joints.iter().position(|joint| joint.name == name).map(JointId)
    }

    /// Joints from the root to `link`, root first.
    pub fn joints_to(&self, link: LinkId) -> Vec<JointId> {
        let mut joints = Vec::new();
        let mut current = link;
        while let Some(joint) = self.links[current.0].parent_joint {
            joints.push(joint);
            current = self.joints[joint.0].parent;
        }
        joints.reverse();
        joints
    }

    /// Those of [`Robot::joints_to`] that are not fixed: of two links with the same ones, none moves over the other.
    pub fn moving_joints_to(&self, link: LinkId) -> Vec<JointId> {
        self.joints_to(link).into_iter().filter(|id| self.joints[id.0].moves()).collect()
    }

    /// Pose of `link` in the frame of the last moving link on the way to it (or of the root), which it is fixed to.
    pub fn fixed_pose_in_body(&self, link: LinkId) -> Pose {
        let joints = self.joints_to(link).into_iter().rev();
        joints
            .map(|joint| &self.joints[joint.0])
            .take_while(|joint| joint.kind == JointKind::Fixed)
            .fold(Pose::identity(), |pose, joint| joint.parent_from_joint * pose)
    }

    /// Joints carried by `link`, in document order.
    pub fn joints_from(&self, link: LinkId) -> impl Iterator<Item = JointId> + '_ {
        self.joints.iter().enumerate().filter(move |(_, joint)| joint.parent == link).map(|(i, _)| JointId(i))
    }
}
