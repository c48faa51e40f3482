//! A grasp that was found.

use regrasp_geometry::Vector;
use regrasp_grasp::list::Scores;
use regrasp_grasp::wrench::BalancedForces;
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};

/// The way of the hand to a grasp.
#[derive(Debug, Clone, PartialEq)]
pub struct WayIn {
    /// Joints of the open hand.
    pub open: HandJoints,
    /// Direction in which the hand comes, in the object frame.
    pub direction: Vector,
}

/// A grasp with all that a list says about it. Poses are in the hand frame, which stands still.
#[derive(Debug, Clone)]
pub struct Found {
    /// Index of its frame.
    pub frame: u64,
    /// Object pose in the hand frame, contacts and joints.
    pub state: GraspState,
    /// Closure margin with the friction margin.
    pub margin: f64,
    /// The margin before refinement.
    pub margin_before: Option<f64>,
    /// Terms of the score.
    pub scores: Scores,
    /// Their weighted mean.
    pub score: f64,
    /// Forces of the fingers that hold, in order.
    pub forces: BalancedForces,
    /// The way in.
    pub way: WayIn,
    /// Stable poses in which the hand stays above the support.
    pub stable_poses: Vec<usize>,
}

/// Why a frame gives no grasp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// The palm is in the object.
    Palm,
    /// Too few fingers reach a contact.
    TooFewContacts,
    /// A finger without a contact has no place.
    FreeFinger(usize),
    /// The contacts do not close the object with the margin.
    NotClosed,
    /// The fingers hit each other.
    Fingers,
    /// No forces hold the weight in every direction.
    Forces,
    /// The hand cannot open.
    NotOpened,
    /// The open hand cannot come.
    NoWayIn,
}

impl Reason {
    /// In words; `fingers` are the names.
    pub fn in_words(self, fingers: &[&str]) -> String {
        match self {
            Reason::Palm => "the palm is in the object".into(),
            Reason::TooFewContacts => "too few fingers reach a contact".into(),
            Reason::FreeFinger(f) => format!("finger \"{}\" reaches no contact and has no room at rest", fingers[f]),
            Reason::NotClosed => "the contacts do not close the object with the margin".into(),
            Reason::Fingers => "the fingers hit each other or the object".into(),
            Reason::Forces => "no contact forces hold the weight in every direction".into(),
            Reason::NotOpened => "the fingers cannot open".into(),
            Reason::NoWayIn => "the open hand has no straight way in".into(),
        }
    }
}
