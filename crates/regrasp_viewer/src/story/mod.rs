//! What a page is told. `page/src/story.ts` is the same contract, seen from the page.
//!
//! SI units, radians. Nothing that follows from the plan is stored beside it.

/// What rests in the scene.
mod at_rest;
/// Lines of facts about a plan.
mod facts;
/// Margin and clearance along a plan.
mod judged;
/// The links of a hand.
mod links;
/// Numbers of meshes as text.
pub mod pack;
/// Plans in stories as in plan files.
mod plan_file;
/// The hand and the object of a plan, and everything around them.
mod scene;
/// Shapes as packed meshes.
mod shapes;
/// Meshes of fewer triangles.
mod simplify;
/// A story from scene, query and plan.
mod telling;
/// Triangles of shapes.
pub mod tessellate;

pub use telling::{Outcome, Telling, tell};

pub use regrasp_plan::plan::PoseData;

use regrasp_plan::Plan;
use regrasp_plan::check::Level;
use serde::{Deserialize, Serialize};

/// Value of [`Story::format`].
pub const FORMAT: &str = "regrasp-story";
/// Value of [`Story::version`].
pub const VERSION: u32 = 1;

/// Everything that a page shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Story {
    /// Always `regrasp-story`.
    pub format: String,
    /// Version of the contract.
    pub version: u32,
    /// Name of the scene, as text.
    pub title: String,
    /// Label and value of each line of facts, in order of display: text, never markup.
    pub facts: Vec<(String, String)>,
    /// Hands, objects, supports and obstacles.
    pub scene: SceneStory,
    /// Poses asked for: start, then way poses, then goal; in the world. Empty when unknown.
    pub asked: Vec<PoseData>,
    /// The plan, or none when none was found. In JSON as in a plan file (`docs/reference/plan-format.md`).
    #[serde(with = "plan_file")]
    pub plan: Option<Plan>,
    /// What the checker measured; none when there is no plan.
    pub judged: Option<Judged>,
    /// Why no plan was found; none when there is one.
    pub failure: Option<FailureStory>,
    /// The manipulation graph, when asked for.
    pub roadmap: Option<RoadmapStory>,
}

/// The hand and the object of the plan, and everything around them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneStory {
    /// Names of all hands of the scene.
    pub hands: Vec<String>,
    /// Index in `hands` of the one that moves: links, joints and fingers are its own.
    pub moving_hand: usize,
    /// Names of all objects of the scene.
    pub objects: Vec<String>,
    /// Index in `objects` of the one that is moved.
    pub moved_object: usize,
    /// Links of the robot of the hand that moves, every parent before its children.
    pub links: Vec<LinkStory>,
    /// Where the root link stands.
    pub world_from_root: PoseData,
    /// Same order as `Plan::joint_names`.
    pub joints: Vec<JointStory>,
    /// Same order as `Plan::fingers`.
    pub fingers: Vec<FingerStory>,
    /// Friction coefficient of the scene.
    pub friction: f64,
    /// Gravity in the world, m/s^2; none when any direction must hold.
    pub gravity_in_world: Option<[f64; 3]>,
    /// Meshes used by `pieces`, each stored once.
    pub meshes: Vec<MeshStory>,
    /// Shapes on links, on the object and in the world.
    pub pieces: Vec<PieceStory>,
}

/// A coordinate of the joint vector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointStory {
    /// Name.
    pub name: String,
    /// Lowest value, radians or metres; none for joints without limits.
    pub lower: Option<f64>,
    /// Highest value.
    pub upper: Option<f64>,
    /// Highest torque or force, N m or N, where the robot says one.
    pub effort: Option<f64>,
}

/// A finger and its tip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FingerStory {
    /// Name.
    pub name: String,
    /// Index of the link that carries the tip.
    pub tip_link: usize,
    /// Centre of the tip, in the frame of that link.
    pub tip_center_in_link: [f64; 3],
    /// Radius of the tip; zero for a sharp one.
    pub tip_radius: f64,
}

/// How a link moves against its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
pub struct LinkStory {
    /// Name.
    pub name: String,
    /// Index in `links`; -1 for the root.
    pub parent: i32,
    /// Kind of the joint. A joint that no coordinate drives is fixed, where it is held.
    pub kind: LinkKind,
    /// Frame of the joint in the parent link, at joint position 0.
    pub parent_from_joint: PoseData,
    /// Axis in that frame.
    pub axis: [f64; 3],
    /// Index in `joints` of what drives it, -1 for fixed ones. Position = `multiplier * joints[joint] + offset`, plus the same
    /// product for each of `others`.
    pub joint: i32,
    /// See `joint`.
    pub multiplier: f64,
    /// See `joint`.
    pub offset: f64,
    /// More joints that drive it; none for nearly all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<LeaderStory>,
    /// Index in `fingers` of the finger that it belongs to, -1 for the palm.
    pub finger: i32,
}

/// A joint that drives another together with more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LeaderStory {
    /// Index in `joints`.
    pub joint: usize,
    /// Its multiplier.
    pub multiplier: f64,
}

/// A mesh with quantised vertices; [`pack`] writes and reads it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

/// What a piece moves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Carrier {
    /// A link, by its index.
    Link(usize),
    /// Something else.
    Other(OtherCarrier),
}

/// What a piece can move with that is no link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OtherCarrier {
    /// The object.
    Object,
    /// Nothing: a hand or an object at rest, a support, an obstacle.
    World,
}

/// What a piece is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// What planner and checker keep apart.
    Collision,
    /// What it looks like. If there are visual pieces, they are complete: links, object and obstacles.
    Visual,
}

/// Which kind of body a piece is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// A hand.
    Hand,
    /// An object.
    Object,
    /// A support.
    Support,
    /// An obstacle.
    Obstacle,
}

/// A mesh at its place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PieceStory {
    /// What it moves with.
    pub on: Carrier,
    /// Which kind of body it is of.
    pub part: Part,
    /// Name to show: of the object, support or obstacle; of the link, and before it that of a hand at rest and a slash.
    pub name: String,
    /// What it is for.
    pub role: Role,
    /// Index in `meshes`.
    pub mesh: usize,
    /// Frame of the mesh in the link, the object or the world.
    pub from_mesh: PoseData,
    /// Fingertip that may touch the object.
    pub is_tip: bool,
}

/// What the checker measured: one number per waypoint, all segments joined in order (the waypoint that two segments share
/// counts twice).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Verdict.
    pub accepted: bool,
    /// What the plan was judged for: `geometry`, `forces` or `motion`.
    pub level: Level,
    /// First violations, as text.
    pub violations: Vec<String>,
    /// Closure margin of the holding fingers; none where it could not be judged.
    pub margin: Vec<Option<f64>>,
    /// Margin that the plan promises.
    pub required_margin: f64,
    /// Smallest distance of things that must not touch, metres.
    pub clearance: Vec<Option<f64>>,
    /// Index in `pairs` of the pair at that distance.
    pub pair: Vec<usize>,
    /// Names of pairs.
    pub pairs: Vec<(String, String)>,
}

/// Why no plan was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FailureStory {
    /// Kind, as the planner spells it.
    pub kind: String,
    /// What happened.
    pub message: String,
    /// What to try; may be empty.
    pub advice: String,
    /// Causes, commonest first.
    pub causes: Vec<CauseStory>,
    /// The nearest that the search came to the goal.
    pub nearest_miss: Option<NearestMissStory>,
}

/// One reason for which attempts failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CauseStory {
    /// In words.
    pub reason: String,
    /// Attempts.
    pub count: u64,
    /// Share of all failed attempts.
    pub share: f64,
}

/// The pose nearest to the goal that was reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NearestMissStory {
    /// The object there.
    pub world_from_object: PoseData,
    /// The joints there, in the order of `SceneStory::joints`.
    pub joints: Vec<f64>,
    /// Angle left, radians.
    pub angle_left: f64,
    /// Distance left, metres.
    pub distance_left: f64,
}

/// A manipulation graph.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RoadmapStory {
    /// Object orientation of each node.
    pub nodes: Vec<RoadmapNode>,
    /// Edges.
    pub edges: Vec<RoadmapEdge>,
    /// Nodes of the solution, in order; empty when there is none.
    pub solution: Vec<usize>,
}

/// A node of a manipulation graph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoadmapNode {
    /// Orientation of the object in the world.
    pub quat_xyzw: [f64; 4],
    /// Number of the connected component, 0 the largest (or the start's, in a search).
    pub component: usize,
    /// Order of growth.
    pub grown: usize,
    /// Angle to the goal, radians.
    pub angle_to_goal: f64,
}

/// An edge of a manipulation graph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoadmapEdge {
    /// Its two nodes.
    pub nodes: [usize; 2],
    /// Its kind.
    pub kind: RoadmapEdgeKind,
}

/// Kind of an edge of a manipulation graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RoadmapEdgeKind {
    /// The object moves, contacts stay.
    Transfer,
    /// Contacts change on the way.
    TransferRegrasp,
}

impl Story {
    /// The story as JSON in one line; the same story gives the same bytes.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("plain data becomes JSON")
    }
}
