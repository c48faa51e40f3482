//! What a hand is to be made of, by the ids of a robot.

use crate::contact_model::ContactModel;
use crate::robot::{JointId, LinkId, Robot};
use nalgebra::UnitQuaternion;
use regrasp_base::Place;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use std::collections::{BTreeMap, BTreeSet};

/// What is a finger of a hand, by the ids of a robot.
#[derive(Debug, Clone)]
pub(crate) struct HandSpec {
    /// The link whose frame is the hand frame.
    pub base: LinkId,
    /// The fingers.
    pub fingers: Vec<FingerSpec>,
    /// The link that the hand is mounted on and that is not part of it. Without one, all that is fixed to the base is the hand's.
    pub mount: Option<LinkId>,
    /// Pairs of links that are never tested, smaller id first.
    pub allow: BTreeSet<(LinkId, LinkId)>,
    /// Positions of joints that belong to no finger, in radians or metres; others are held as near to zero as their limits let them.
    pub held: BTreeMap<JointId, f64>,
    /// Links whose collision geometry is left out; the robot has none of it.
    pub without_geometry: BTreeSet<LinkId>,
}

/// Takes the collision geometry of `links` out of `robot`.
pub(crate) fn leave_geometry_out(robot: &mut Robot, links: impl IntoIterator<Item = LinkId>) {
    links.into_iter().for_each(|link| robot.links[link.0].collision.clear());
}

/// Positions by name of joint, each with its place.
pub(crate) type Positions = Vec<(String, f64, Place)>;

/// A finger to be made.
#[derive(Debug, Clone)]
pub(crate) struct FingerSpec {
    pub name: String,
    pub tip_link: LinkId,
    /// First joint of the chain; moving joints before it are held. The first after the base where none is given.
    pub first_joint: Option<JointId>,
    pub tip: TipSpec,
    /// Where the tip may touch; anywhere without one.
    pub pad: Option<PadSpec>,
    pub contact: ContactModel,
    /// Rest posture by joint name, with the place of each name; the rest in the middle of the limits.
    pub rest: Positions,
    /// Where it stands, for messages.
    pub place: Place,
}

/// A tip to be made; points are in the frame of the tip link.
#[derive(Debug, Clone)]
pub(crate) enum TipSpec {
    Sphere {
        radius: f64,
        center: Point,
    },
    Ellipsoid {
        radii: Vector,
        center: Point,
        link_from_ellipsoid: UnitQuaternion<f64>,
    },
    Point {
        position: Point,
    },
    /// The hull of the `<collision>` elements of these indices; of all where there are none.
    Hull {
        center: Point,
        elements: Vec<usize>,
    },
}

impl TipSpec {
    /// True when the `<collision>` element of this index belongs to the tip.
    pub fn is_made_of(&self, element: usize) -> bool {
        match self {
            TipSpec::Hull { elements, .. } => elements.is_empty() || elements.contains(&element),
            TipSpec::Sphere { .. } | TipSpec::Ellipsoid { .. } | TipSpec::Point { .. } => true,
        }
    }
}

/// The part of a tip that may touch; the axis is in the frame of the tip link.
#[derive(Debug, Clone)]
pub(crate) struct PadSpec {
    pub axis: UnitVector,
    pub angle: f64,
}

/// A rigid body of a hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum RigidBody {
    /// What no finger joint moves.
    Palm,
    /// What a finger's joint carries.
    Finger {
        /// Index of the finger.
        finger: usize,
        /// Index of the joint on the finger's chain.
        body: usize,
    },
}

/// Where a link is: its body, and its pose in the body's frame (the base frame, for the palm).
#[derive(Debug, Clone, Copy)]
pub(super) struct Carried {
    pub(super) body: RigidBody,
    pub(super) body_from_link: Pose,
}
