//! The nearest miss of a task of a whole robot: what pictures of a failure draw.

use regrasp_plan::plan::PoseData;
use serde::Serialize;

/// What a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MetKind {
    /// A link of the robot.
    Link,
    /// The object that the robot carries, or shall carry.
    Carried,
    /// Something that rests: a support, an obstacle, another object or robot.
    Resting,
}

/// A body that meets another one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MetBody {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: MetKind,
}

/// Two bodies that are not proved to keep the clearance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Meeting {
    /// The two.
    pub bodies: [MetBody; 2],
    /// How deep they overlap, in metres; negative where they are apart. None where one of them is not convex.
    pub overlap: Option<f64>,
}

/// A hand that no posture brings to where it should be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WantedHand {
    /// Its name in the scene.
    pub hand: String,
    /// Where its base should be.
    pub world_from_hand: PoseData,
    /// Finger joints there.
    pub joints: Vec<f64>,
    /// Where the wrist gets, and where it should be, in the world.
    pub wrist: [[f64; 3]; 2],
}

/// How far exchanges came at a place, from far to near.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ExchangeOutcome {
    /// No pair of grasps was tried there: in each the two hands touch, wherever the object is.
    HandsTouch,
    /// One of the arms does not get there.
    OutOfReach,
    /// Arm, hand or object collides.
    InCollision,
    /// A hand cannot come, close, open or leave.
    NoWay,
}

/// A place of the exchange that was tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TriedExchange {
    /// Position of the object's centre of mass, in the world.
    pub position: [f64; 3],
    /// The furthest that any pair of grasps came there.
    pub outcome: ExchangeOutcome,
}

/// The nearest miss of a task of a whole robot, as a posture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RobotMiss {
    /// What failed there: `place: hands in collision`.
    pub reason: String,
    /// The robot's joints, in the order of its joint vector. Where a hand is wanted, the arm is stretched towards it as far as
    /// nothing meets, by a local search.
    pub joints: Vec<f64>,
    /// The object's pose there; none for motions without an object.
    pub world_from_object: Option<PoseData>,
    /// The two that meet, where it is a collision.
    pub meeting: Option<Meeting>,
    /// Hands that are not where they should be.
    pub wanted: Vec<WantedHand>,
    /// Places of the exchange, the best first.
    pub exchanges: Vec<TriedExchange>,
}

impl RobotMiss {
    /// A posture without a collision.
    pub fn at(reason: String, joints: Vec<f64>) -> Self {
        RobotMiss { reason, joints, world_from_object: None, meeting: None, wanted: Vec::new(), exchanges: Vec::new() }
    }
}

impl Meeting {
    /// `"left_elbow" meets "lamp", 4.0 mm deep`.
    pub fn in_words(&self) -> String {
        let [first, second] = &self.bodies;
        let deep = match self.overlap {
            Some(overlap) if overlap > 0.0 => format!(", {:.1} mm deep", 1e3 * overlap),
            _ => String::new(),
        };
        format!("\"{}\" meets \"{}\"{deep}", first.name, second.name)
    }
}
