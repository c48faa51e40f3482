//! Files of roadmaps: JSON, so that every number comes back as it was.

use super::{DoubleGrasps, Origin, TaskRoadmap};
use crate::exchange::Give;
use crate::timing::Smooth;
use regrasp_arms::roadmap::{Roads, SuperGraph};
use regrasp_base::files;
use regrasp_base::{Diagnostic, InputError, Place};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What every file says.
pub const FORMAT: &str = "regrasp-task-roadmap";
const VERSION: u32 = 1;
/// Most hands and grasps of a hand.
const MOST: usize = 1 << 20;

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileData {
    format: String,
    format_version: u32,
    robot: String,
    world: String,
    grasps: String,
    settings: String,
    seed: u64,
    double_grasps: Vec<PairsData>,
    exchanges: Vec<GiveData>,
    #[serde(skip_serializing_if = "Option::is_none", default)]
    graph: Option<serde_json::Value>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PairsData {
    hands: [usize; 2],
    pairs: Vec<[usize; 2]>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GiveData {
    giver: [usize; 2],
    taker: [usize; 2],
    way_in: WayData,
    way_out: WayData,
}

/// A straight way of a hand: its arm moves, all else rests.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WayData {
    /// The first state of the robot.
    state: Vec<f64>,
    /// Index of the arm's first joint in states.
    first: usize,
    /// The arm's joints in the states after that.
    joints: Vec<Vec<f64>>,
}

impl WayData {
    fn of(way: &Smooth) -> Self {
        let nodes = way.nodes();
        let n = nodes[0].len();
        let moves = |k: &usize| nodes.iter().any(|node| node[*k] != nodes[0][*k]);
        let first = (0..n).find(moves).unwrap_or(0);
        let end = (first..n).rev().find(moves).map_or(first, |last| last + 1);
        let joints = nodes[1..].iter().map(|node| node[first..end].to_vec()).collect();
        WayData { state: nodes[0].clone(), first, joints }
    }

    fn is_whole(&self, width: usize) -> bool {
        let n = self.joints.first().map_or(0, Vec::len);
        let is_finite = |values: &Vec<f64>| values.iter().all(|q| q.is_finite());
        self.state.len() == width
            && !self.joints.is_empty()
            && self.first.checked_add(n).is_some_and(|end| end <= width)
            && is_finite(&self.state)
            && self.joints.iter().all(|joints| joints.len() == n && is_finite(joints))
    }

    fn way(self) -> Smooth {
        let with = |joints: Vec<f64>| {
            let mut state = self.state.clone();
            state[self.first..self.first + joints.len()].copy_from_slice(&joints);
            state
        };
        let mut nodes = vec![self.state.clone()];
        nodes.extend(self.joints.into_iter().map(with));
        Smooth::through(nodes)
    }
}

impl TaskRoadmap {
    /// The file of the roadmap.
    pub fn to_json(&self) -> String {
        let Origin { robot, world, grasps, settings } = self.origin.clone();
        let data = FileData {
            format: FORMAT.into(),
            format_version: VERSION,
            robot,
            world,
            grasps,
            settings,
            seed: self.seed,
            double_grasps: self
                .double_grasps
                .iter()
                .map(|of| PairsData { hands: of.hands, pairs: of.pairs.clone() })
                .collect(),
            exchanges: self
                .exchanges
                .iter()
                .map(|give| GiveData {
                    giver: give.giver,
                    taker: give.taker,
                    way_in: WayData::of(&give.way_in),
                    way_out: WayData::of(&give.way_out),
                })
                .collect(),
            graph: self.roads.as_ref().and_then(|roads| serde_json::from_str(&roads.graph.to_json()).ok()),
        };
        // Numbers and strings alone.
        serde_json::to_string(&data).unwrap_or_default()
    }

    /// Reads the file at `path`.
    ///
    /// Errors: not such a file (`R601`), another version (`R602`), what contradicts itself (`R606`).
    pub fn load(path: &Path) -> Result<Self, InputError> {
        let text = files::read_text(path)?;
        Self::from_json(path, &text)
    }

    /// As [`TaskRoadmap::load`], of `text`.
    pub fn from_json(path: &Path, text: &str) -> Result<Self, InputError> {
        let wrong = |code, message: String| {
            let fix = "build the roadmap again";
            InputError::from(Diagnostic::new(code, Place::file(path), message).fix(fix))
        };
        let data: FileData = serde_json::from_str(text)
            .map_err(|error| wrong("R601", format!("is no roadmap of pick and place: {error}")))?;
        if data.format != FORMAT {
            return Err(wrong("R601", format!("has the format \"{}\", not \"{FORMAT}\"", data.format)));
        }
        if data.format_version != VERSION {
            let message = format!("has version {} of the format; this program reads {VERSION}", data.format_version);
            return Err(wrong("R602", message));
        }
        let is_small = |pair: &[usize; 2]| pair[0] < MOST && pair[1] < MOST;
        let is_sorted = |of: &PairsData| of.hands[0] < of.hands[1] && of.pairs.windows(2).all(|pair| pair[0] < pair[1]);
        let width = data.exchanges.first().map_or(0, |give| give.way_in.state.len());
        let is_give = |give: &GiveData| {
            is_small(&give.giver)
                && is_small(&give.taker)
                && give.way_in.is_whole(width)
                && give.way_out.is_whole(width)
        };
        let is_pairs = |of: &PairsData| is_sorted(of) && is_small(&of.hands) && of.pairs.iter().all(is_small);
        if !data.double_grasps.iter().all(is_pairs) || !data.exchanges.iter().all(is_give) {
            return Err(wrong("R606", "contradicts itself: pairs of grasps or exchanges do not fit".into()));
        }
        let graph = data.graph.map(|graph| SuperGraph::from_json(path, &graph.to_string())).transpose()?;
        let exchange = |give: GiveData| Give {
            giver: give.giver,
            taker: give.taker,
            way_in: give.way_in.way(),
            way_out: give.way_out.way(),
        };
        let FileData { robot, world, grasps, settings, seed, double_grasps, exchanges, .. } = data;
        Ok(TaskRoadmap {
            origin: Origin { robot, world, grasps, settings },
            seed,
            roads: graph.map(Roads::new),
            double_grasps: double_grasps
                .into_iter()
                .map(|of| DoubleGrasps { hands: of.hands, pairs: of.pairs })
                .collect(),
            exchanges: exchanges.into_iter().map(exchange).collect(),
        })
    }
}
