//! Files of graphs: JSON, so that every number comes back as it was.

use super::{Graph, SuperGraph};
use regrasp_base::files;
use regrasp_base::{Diagnostic, InputError, Place};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What every file says.
const FORMAT: &str = "regrasp-arm-roadmap";
const VERSION: u32 = 1;
/// Most nodes.
const MOST_NODES: usize = 1 << 22;

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileData {
    format: String,
    format_version: u32,
    joints: Vec<String>,
    robot: String,
    world: String,
    clearance: f64,
    seed: u64,
    nodes: Vec<Vec<f64>>,
    edges: Vec<[u32; 2]>,
}

impl SuperGraph {
    /// The file of the graph.
    pub fn to_json(&self) -> String {
        let data = FileData {
            format: FORMAT.into(),
            format_version: VERSION,
            joints: self.joints.clone(),
            robot: self.robot.clone(),
            world: self.world.clone(),
            clearance: self.clearance,
            seed: self.seed,
            nodes: self.graph.nodes.clone(),
            edges: self.graph.edges.clone(),
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

    /// As [`SuperGraph::load`], of `text`.
    pub fn from_json(path: &Path, text: &str) -> Result<Self, InputError> {
        let wrong = |code, message: String, fix: &str| {
            InputError::from(Diagnostic::new(code, Place::file(path), message).fix(fix))
        };
        let again = "build the roadmap again";
        let data: FileData = serde_json::from_str(text)
            .map_err(|error| wrong("R601", format!("is no roadmap of arms: {error}"), again))?;
        if data.format != FORMAT {
            return Err(wrong("R601", format!("has the format \"{}\", not \"{FORMAT}\"", data.format), again));
        }
        if data.format_version != VERSION {
            let message = format!("has version {} of the format; this program reads {VERSION}", data.format_version);
            return Err(wrong("R602", message, again));
        }
        let n = data.nodes.len();
        let is_whole = |node: &Vec<f64>| node.len() == data.joints.len() && node.iter().all(|q| q.is_finite());
        let is_edge = |edge: &[u32; 2]| edge[0] < edge[1] && (edge[1] as usize) < n;
        let is_sorted = data.edges.windows(2).all(|pair| pair[0] < pair[1]);
        if n > MOST_NODES || !data.nodes.iter().all(is_whole) || !data.edges.iter().all(is_edge) || !is_sorted {
            return Err(wrong("R606", "contradicts itself: nodes and edges do not fit".into(), again));
        }
        if !(0.0..=1.0).contains(&data.clearance) {
            return Err(wrong("R606", format!("has the clearance {} m", data.clearance), again));
        }
        let FileData { joints, robot, world, clearance, seed, nodes, edges, .. } = data;
        Ok(SuperGraph { joints, robot, world, clearance, seed, graph: Graph { nodes, edges } })
    }
}
