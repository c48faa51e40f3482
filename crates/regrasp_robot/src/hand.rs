//! A hand: a palm and serial fingers, with everything the planners ask for prepared once.

use crate::coupling::Coupling;
use crate::kinematics::chain::Chain;
use crate::kinematics::finger_ik::FingerIk;
use crate::robot::{Joint, JointId, LinkId, Robot};
use crate::tip::Tip;
use regrasp_geometry::Shape;
use regrasp_geometry::shape::PlacedShape;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Most fingers of a hand: more are a mistake in the file. Planners may take fewer.
pub const MAX_FINGERS: usize = 64;
/// Most joints of a finger, those that follow others among them.
pub const MAX_FINGER_JOINTS: usize = 16;

/// Index of a finger in [`Hand::fingers`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FingerId(pub usize);

/// A collision shape of a finger.
#[derive(Debug, Clone)]
pub struct FingerShape {
    /// Moving body that carries it: `0` is the body after the first joint.
    pub body: usize,
    /// The link it belongs to.
    pub link: LinkId,
    /// The shape, placed in the frame of its body. Convex.
    pub placed: PlacedShape,
    /// True for the shapes of the tip link, the only ones that may touch the object.
    pub is_tip: bool,
}

/// A serial finger.
#[derive(Debug, Clone)]
pub struct Finger {
    /// Name, unique in the hand.
    pub name: String,
    /// The chain from the hand's base to the last moving body.
    pub chain: Chain,
    /// The tip.
    pub tip: Tip,
    /// Collision shapes of the moving bodies.
    pub shapes: Vec<FingerShape>,
    /// Posture the finger takes when nothing else is asked of it: one value per coordinate.
    pub rest: Vec<f64>,
    /// Inverse kinematics of the tip's centre.
    pub ik: FingerIk,
}

impl Finger {
    /// A finger with its inverse kinematics prepared.
    pub fn new(name: String, chain: Chain, tip: Tip, shapes: Vec<FingerShape>, rest: Vec<f64>) -> Self {
        let ik = FingerIk::new(&chain, &tip.center_in_body);
        Finger { name, chain, tip, shapes, rest, ik }
    }
}

/// A shape of the palm (everything that no finger joint moves).
#[derive(Debug, Clone)]
pub struct PalmShape {
    /// The link it belongs to.
    pub link: LinkId,
    /// The shape, placed in the hand's base frame. Convex.
    pub placed: PlacedShape,
}

/// A joint of one finger that follows joints of other fingers. For its finger it is a coordinate like any other; whoever moves the
/// hand keeps it where the coupling says.
#[derive(Debug, Clone, PartialEq)]
pub struct Tie {
    /// The joint.
    pub follower: JointId,
    /// What it follows.
    pub coupling: Coupling,
}

/// A palm and serial fingers. All poses are in the hand's own frame, that of its base: where the hand stands in the world is
/// not part of it.
#[derive(Debug, Clone)]
pub struct Hand {
    /// The robot it was made from.
    pub robot: Arc<Robot>,
    /// The link whose frame is the hand frame.
    pub base: LinkId,
    /// Fingers, in the order of the hand file.
    pub fingers: Vec<Finger>,
    /// The palm.
    pub palm: Vec<PalmShape>,
    /// Pairs of links (smaller index first) that are never tested against each other.
    pub allowed_pairs: BTreeSet<(LinkId, LinkId)>,
    /// Joints that belong to no finger and were given a position, in radians or metres.
    pub held: Vec<(JointId, f64)>,
    /// Links whose collision geometry was left out: it is no longer in `robot`.
    pub without_geometry: BTreeSet<LinkId>,
    /// Joints that follow those of other fingers. Empty where those could be held still, unless the hand was loaded for them
    /// ([`crate::import::LoadOptions::untie`]).
    pub ties: Vec<Tie>,
}

impl Hand {
    /// Names of the independent joints, finger by finger: the order of every joint vector.
    pub fn joint_names(&self) -> Vec<String> {
        self.fingers.iter().flat_map(|finger| finger.chain.names.iter().cloned()).collect()
    }

    /// Independent joints of its URDF that belong to no finger, by name, and the positions at which they stand while the fingers move,
    /// in radians or metres: what the hand file says, else as near to zero as their limits let them.
    ///
    /// Of a hand that no robot carries: on a robot they are coordinates of the robot.
    pub fn held_joints(&self) -> BTreeMap<String, f64> {
        let of_fingers: BTreeSet<&String> = self.fingers.iter().flat_map(|finger| &finger.chain.names).collect();
        let joints = self.robot.joints.iter().enumerate();
        let stand = joints.filter(|(_, joint)| joint.moves() && joint.coupling.is_none());
        let stand = stand.filter(|(_, joint)| !of_fingers.contains(&joint.name));
        let position = |index: usize, joint: &Joint| {
            // Joints with a position of their own have their zero there.
            let zero = self.held.iter().find(|(held, _)| held.0 == index).map_or(0.0, |(_, position)| *position);
            zero + joint.nearest_to_zero()
        };
        stand.map(|(index, joint)| (joint.name.clone(), position(index, joint))).collect()
    }

    /// Number of independent joints.
    pub fn n_joints(&self) -> usize {
        self.fingers.iter().map(|finger| finger.chain.n_coordinates()).sum()
    }

    /// The finger called `name`.
    pub fn finger_named(&self, name: &str) -> Option<FingerId> {
        self.fingers.iter().position(|finger| finger.name == name).map(FingerId)
    }

    /// True when links `a` and `b` are never tested against each other.
    pub fn may_touch(&self, a: LinkId, b: LinkId) -> bool {
        a == b || self.allowed_pairs.contains(&(a.min(b), a.max(b)))
    }
}

/// The convex shape that stands for `shape` in the hand: a mesh becomes its hull, which contains it.
///
/// Errors: a mesh without an inside.
pub fn convex_of(shape: &Shape) -> Result<Shape, regrasp_geometry::hull::HullError> {
    match shape {
        Shape::Mesh(mesh) => Ok(Shape::Convex(Arc::new(regrasp_geometry::ConvexHull::new(mesh.vertices())?))),
        convex => Ok(convex.clone()),
    }
}
