//! The bodies of a scene: hands, parts of robots, objects, supports and obstacles, each with a name, and their shapes.

use super::PoseData;
use serde::{Deserialize, Serialize};

/// Everything that stands in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SceneStory {
    /// All hands.
    pub hands: Vec<HandStory>,
    /// Index in `hands` of the one that the plan moves; the others rest.
    pub moving_hand: usize,
    /// What carries hands: of each robot the common part, if it has links, and the arms.
    pub robot_parts: Vec<RobotPartStory>,
    /// All objects that hands can move.
    pub objects: Vec<ObjectStory>,
    /// Index in `objects` of the one that the plan moves; the others rest.
    pub moved_object: usize,
    /// Names of the supports.
    pub supports: Vec<String>,
    /// Names of the obstacles.
    pub obstacles: Vec<String>,
    /// Friction coefficient of the object that the plan moves.
    pub friction: f64,
    /// Gravity in the world, m/s^2; none when any direction must hold.
    pub gravity_in_world: Option<[f64; 3]>,
    /// Meshes used by `pieces`, each stored once.
    pub meshes: Vec<MeshStory>,
    /// The shapes of all bodies.
    pub pieces: Vec<PieceStory>,
}

/// A hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct HandStory {
    /// Name.
    pub name: String,
    /// Its links, every parent before its children. Links of an arm that no moving joint parts from the hand are among them: they
    /// count as palm.
    pub links: Vec<LinkStory>,
    /// Its joints. Of the hand that moves, in the order of the plan's `joint_names`.
    pub joints: Vec<JointStory>,
    /// Its fingers. Of the hand that moves, in the order of the plan's `fingers`.
    pub fingers: Vec<FingerStory>,
}

/// A part of a robot that carries hands: an arm, or what the arms stand on. It rests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RobotPartStory {
    /// Name: of the robot, and for an arm a slash and its own.
    pub name: String,
    /// Its links, every parent before its children, without those that count as a hand's palm.
    pub links: Vec<LinkStory>,
    /// Its joints.
    pub joints: Vec<JointStory>,
}

/// An object that hands can move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ObjectStory {
    /// Name.
    pub name: String,
    /// Where it stands while nothing moves it.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub world_from_object: PoseData,
}

/// A joint that other joints do not drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct JointStory {
    /// Name.
    pub name: String,
    /// Position at rest, radians or metres.
    pub at_rest: f64,
    /// Lowest position; none for joints without limits.
    pub lower: Option<f64>,
    /// Highest position.
    pub upper: Option<f64>,
    /// Highest torque or force, N m or N, where the robot says one.
    pub effort: Option<f64>,
}

/// A finger and its tip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FingerStory {
    /// Name.
    pub name: String,
    /// Index in the hand's `links` of the one that carries the tip.
    pub tip_link: usize,
    /// Centre of the tip, in the frame of that link.
    pub tip_center_in_link: [f64; 3],
    /// Radius of the tip; zero for a sharp one.
    pub tip_radius: f64,
}

/// How a link moves against its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum LinkKind {
    /// Not at all.
    Fixed,
    /// Turns about the axis.
    Revolute,
    /// Slides along the axis.
    Prismatic,
}

/// A link and the joint that carries it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LinkStory {
    /// Name.
    pub name: String,
    /// Index in the `links` of the same body; -1 for a link whose parent is the world, or a link of another body.
    pub parent: i32,
    /// Kind of the joint. A joint that no joint of the body drives is fixed, where it is held.
    pub kind: LinkKind,
    /// Frame of the joint at joint position 0: in the parent link, or in the world where `parent` is -1.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub parent_from_joint: PoseData,
    /// Axis in that frame.
    pub axis: [f64; 3],
    /// Index in the `joints` of the same body of what drives it, -1 for fixed ones. Position = `multiplier * joints[joint] + offset`,
    /// plus the same product for each of `others`.
    pub joint: i32,
    /// See `joint`.
    pub multiplier: f64,
    /// See `joint`.
    pub offset: f64,
    /// More joints that drive it; none for nearly all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<LeaderStory>,
    /// Index in `fingers` of the finger that it belongs to, -1 for a palm and for arms.
    pub finger: i32,
}

/// A joint that drives another together with more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LeaderStory {
    /// Index in `joints`.
    pub joint: usize,
    /// Its multiplier.
    pub multiplier: f64,
}

/// A mesh with quantised vertices; `story::pack` writes and reads it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MeshStory {
    /// Base64 of little-endian u16 x y z per vertex: coordinate = lower + (upper - lower) * value / 65535, per axis.
    pub vertices: String,
    /// Lowest coordinates.
    pub lower: [f64; 3],
    /// Highest coordinates.
    pub upper: [f64; 3],
    /// Base64 of little-endian indices, three per triangle, counter-clockwise seen from outside; u16 when there are at most
    /// 65,536 vertices, else u32.
    pub triangles: String,
    /// Angle below which neighbouring faces share a normal, in radians; 0 shades flat.
    pub smooth_below: f64,
}

/// The body that a piece is of, and what it moves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Carrier {
    /// A hand, and one of its links.
    Hand(usize, usize),
    /// A part of a robot, and one of its links.
    RobotPart(usize, usize),
    /// An object.
    Object(usize),
    /// A support: it stands in the world.
    Support(usize),
    /// An obstacle: it stands in the world.
    Obstacle(usize),
}

/// What a piece is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// What planner and checker keep apart.
    Collision,
    /// What it looks like. If there are visual pieces, they are complete: they show every body.
    Visual,
}

/// A mesh at its place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct PieceStory {
    /// What it is of.
    pub on: Carrier,
    /// What it is for.
    pub role: Role,
    /// Index in `meshes`.
    pub mesh: usize,
    /// Frame of the mesh in the link, the object or the world.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub from_mesh: PoseData,
    /// Fingertip that may touch the object.
    pub is_tip: bool,
}

impl SceneStory {
    /// The hand that the plan moves. Panics if `moving_hand` is no index of `hands`.
    pub fn hand(&self) -> &HandStory {
        &self.hands[self.moving_hand]
    }

    /// True for what is of the object that the plan moves.
    pub fn is_moved_object(&self, on: Carrier) -> bool {
        on == Carrier::Object(self.moved_object)
    }

    /// Name to show: of an object, support or obstacle; of a link, and before it that of a body at rest and a slash.
    pub fn name_of(&self, on: Carrier) -> Option<String> {
        let at_rest = |body: &str, link: &LinkStory| format!("{body}/{}", link.name);
        match on {
            Carrier::Hand(hand, link) if hand == self.moving_hand => {
                Some(self.hands.get(hand)?.links.get(link)?.name.clone())
            }
            Carrier::Hand(hand, link) => {
                self.hands.get(hand).and_then(|hand| Some(at_rest(&hand.name, hand.links.get(link)?)))
            }
            Carrier::RobotPart(part, link) => {
                self.robot_parts.get(part).and_then(|part| Some(at_rest(&part.name, part.links.get(link)?)))
            }
            Carrier::Object(object) => self.objects.get(object).map(|object| object.name.clone()),
            Carrier::Support(support) => self.supports.get(support).cloned(),
            Carrier::Obstacle(obstacle) => self.obstacles.get(obstacle).cloned(),
        }
    }
}
