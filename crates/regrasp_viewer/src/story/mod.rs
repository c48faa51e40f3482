//! What a page is told. `page/src/story_file.ts` is the same contract in TypeScript, generated from these types.
//!
//! SI units, radians. Nothing that follows from the plan is stored beside it.

/// The bodies of a scene and their shapes.
mod bodies;
/// Lines of facts about a plan.
mod facts;
/// Margin and clearance along a plan.
mod judged;
/// Trees of links.
mod links;
/// Numbers of meshes as text.
pub mod pack;
/// Shapes of bodies at their places.
mod pieces;
/// Plans in stories as in plan files.
mod plan_file;
/// A scene told body by body.
mod scene;
/// Shapes as packed meshes.
pub(crate) mod shapes;
/// Meshes of fewer triangles.
mod simplify;
/// A story from scene, query and plan.
mod telling;
/// Triangles of shapes.
pub mod tessellate;

/// `page/src/story_file.ts`.
#[cfg(test)]
mod typescript;

pub use bodies::{
    Carrier, FingerStory, HandStory, JointStory, LeaderStory, LinkKind, LinkStory, MeshStory, ObjectStory, PieceStory,
    RobotPartStory, Role, SceneStory,
};
pub use links::world_from_links;
pub use telling::{Outcome, Telling, tell};

pub use regrasp_plan::plan::PoseData;

use regrasp_plan::Plan;
use regrasp_plan::check::Level;
use serde::{Deserialize, Serialize};

/// Value of [`Story::format`].
pub const FORMAT: &str = "regrasp-story";
/// Value of [`Story::version`].
pub const VERSION: u32 = 2;

/// Everything that a page shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
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
    #[cfg_attr(test, ts(type = "PoseData[]"))]
    pub asked: Vec<PoseData>,
    /// The plan, or none when none was found. In JSON as in a plan file (`docs/reference/plan-format.md`).
    #[serde(with = "plan_file")]
    #[cfg_attr(test, ts(type = "FilePlan | null"))]
    pub plan: Option<Plan>,
    /// What the checker measured; none when there is no plan.
    pub judged: Option<Judged>,
    /// Why no plan was found; none when there is one.
    pub failure: Option<FailureStory>,
    /// The manipulation graph, when asked for.
    pub roadmap: Option<RoadmapStory>,
}

/// What the checker measured: one number per waypoint, all segments joined in order (the waypoint that two segments share
/// counts twice).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Judged {
    /// Verdict.
    pub accepted: bool,
    /// What the plan was judged for: `geometry`, `forces` or `motion`.
    #[cfg_attr(test, ts(type = "Level"))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct NearestMissStory {
    /// The object there.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub world_from_object: PoseData,
    /// The joints of the hand that moves, there, in the order of its `joints`.
    pub joints: Vec<f64>,
    /// Angle left, radians.
    pub angle_left: f64,
    /// Distance left, metres.
    pub distance_left: f64,
}

/// A manipulation graph.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RoadmapEdge {
    /// Its two nodes.
    pub nodes: [usize; 2],
    /// Its kind.
    pub kind: RoadmapEdgeKind,
}

/// Kind of an edge of a manipulation graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
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
