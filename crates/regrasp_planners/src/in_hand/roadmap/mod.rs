//! Many queries on one roadmap (Sahbani 2007, sec. IV-D): built once for a hand and an object, saved, asked often.
//!
//! The manipulation graph of Sahbani 2007 keeps paths in GS_n, which every query would have to decompose. This one keeps
//! grasps, transfers and relocations, proven when it is built, so that a path in it is a plan.

/// Linking an object pose to the graph.
mod anchor;
/// Building.
mod build;
/// Bytes of a file, with nothing believed.
mod bytes;
/// The file format.
mod file;
/// The tables.
mod graph;
/// The grasps that it is made of.
mod grasps;
/// What a roadmap was built for.
mod identity;
/// What the tables are searched with.
mod index;
/// Lower bounds for A*.
mod landmarks;
/// Answering queries.
mod query;
/// The poses covered.
mod region;
/// A graph that grows.
mod registry;
/// Transfers in which fingertips roll.
mod rolling;
/// Motions along a path in the graph.
mod route;
/// What stages of building look at and find.
mod stage;
/// Motions with contacts, forces and times, as numbers.
mod track;

pub use build::{BuildSettings, BuildStage, build_roadmap};
pub use file::seal;
pub use identity::{Digest, Identity};
pub use query::{QueryMemory, RoadmapAnswer, RoadmapPlanner};
pub use region::Region;

use crate::settings::InHandSettings;
use graph::Graph;
use index::{Costs, Index};
use landmarks::Landmarks;
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_manipulation::in_world::outline_in_world;
use regrasp_manipulation::outline::{Outline, OutlineEdge};
use regrasp_robot::ContactModel;
use regrasp_scene::HandView;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What a roadmap says about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct About {
    /// What it was built for.
    pub identity: Identity,
    /// The poses that it covers.
    pub region: Region,
    /// Settings of the planner that its motions were proven with.
    pub settings: InHandSettings,
    /// Settings that it was built with.
    pub build: BuildSettings,
    /// Seed that it was built with.
    pub seed: u64,
    /// Queries that it has grown by.
    pub n_grown: u64,
    /// What motions cost.
    costs: Costs,
    /// What forces and times of its motions depend on; empty where it has none.
    dynamics: Vec<f64>,
}

impl About {
    /// All of it as JSON, as the file has it.
    pub fn summary(&self) -> serde_json::Value {
        file::about_json(self)
    }
}

/// A graph of grasps and proven motions of one hand and one object.
#[derive(Debug, Clone)]
pub struct GraspRoadmap {
    about: About,
    graph: Graph,
    landmarks: Landmarks,
    index: Index,
}

/// Numbers about a roadmap.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Census {
    /// Object poses.
    pub places: usize,
    /// Grasps.
    pub nodes: usize,
    /// Transfers.
    pub transfers: usize,
    /// Relocations.
    pub relocations: usize,
    /// Contacts on the object.
    pub contacts: usize,
    /// Footholds of all fingers.
    pub footholds: usize,
    /// Sizes of the connected components, largest first.
    pub components: Vec<usize>,
    /// Places with a grasp of the largest component.
    pub places_covered: usize,
}

impl GraspRoadmap {
    fn new(about: About, graph: Graph) -> Self {
        let index = Index::new(&graph, about.costs);
        let landmarks = Landmarks::choose(&graph, &index);
        GraspRoadmap { about, graph, landmarks, index }
    }

    /// What it was built for, and how.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Counts it.
    pub fn census(&self) -> Census {
        let n_transfers = self.graph.edges.iter().filter(|edge| edge.passage.is_transfer()).count();
        let components = index::components(&self.graph);
        let sizes = index::component_sizes(&components);
        let largest = sizes.first().map(|&(node, _)| node);
        let is_covered = |place: usize| {
            let mut nodes = self.index.nodes_at(place).iter();
            nodes.any(|&node| Some(components.representative(node as usize)) == largest)
        };
        Census {
            places: self.graph.places.len(),
            nodes: self.graph.nodes.len(),
            transfers: n_transfers,
            relocations: self.graph.edges.len() - n_transfers,
            contacts: self.graph.contacts.len(),
            footholds: self.graph.footholds.iter().map(|footholds| footholds.contacts.len()).sum(),
            components: sizes.iter().map(|&(_, size)| size).collect(),
            places_covered: (0..self.graph.places.len()).filter(|&place| is_covered(place)).count(),
        }
    }

    /// What it looks like: one node for all grasps of a component at a place, which relocations join, and transfers between
    /// places.
    /// Poses are in the frame of the hand that it was built for; [`GraspRoadmap::outline_in_world`] has them in the world.
    pub fn outline(&self) -> Outline {
        let components = index::components(&self.graph);
        let mut nodes: BTreeMap<(u32, usize), usize> = BTreeMap::new();
        let mut poses = Vec::new();
        let node_of: Vec<usize> = (0..self.graph.nodes.len())
            .map(|node| {
                let key = (self.graph.nodes[node].place, components.representative(node));
                *nodes.entry(key).or_insert_with(|| {
                    poses.push(*self.graph.pose(node));
                    poses.len() - 1
                })
            })
            .collect();
        let ends = self.graph.edges.iter().map(|edge| [edge.from, edge.to].map(|node| node_of[node as usize]));
        let edges: BTreeSet<OutlineEdge> = ends
            .filter(|[a, b]| a != b)
            .map(|[a, b]| OutlineEdge { nodes: [a.min(b), a.max(b)], changes_grasp: false })
            .collect();
        Outline::new(poses, edges.into_iter().collect())
    }

    /// As [`GraspRoadmap::outline`], in the world of `view`.
    pub fn outline_in_world(&self, view: &HandView) -> Outline {
        outline_in_world(view, self.outline())
    }

    /// Refuses a scene that the roadmap was not built for; `path` is where the roadmap came from.
    ///
    /// Errors: another hand (`R610`), object (`R611`), friction (`R612`), set of obstacles (`R613`) or contact model of a
    /// fingertip (`R614`), all that differ; tables that are not of the hand it names (`R606`).
    pub fn refuse_other_scene(&self, path: &Path, view: &HandView) -> Result<(), InputError> {
        let (built, asked) = (&self.about.identity, Identity::of(view));
        let rebuild = "build a roadmap for this scene: regrasp roadmap build SCENE -o FILE";
        let mut diagnostics = Vec::new();
        let mut differs = |code, what: &str, was: String, is: String| {
            let problem = format!("was built for another {what}: {was}; the scene has {is}");
            diagnostics.push(Diagnostic::new(code, Place::file(path), problem).fix(rebuild));
        };
        let named =
            |name: &str, digest: &Digest| format!("\"{name}\", {}", &regrasp_base::files::hex(digest)[..SHOWN_DIGITS]);
        if built.hand != asked.hand {
            differs(
                "R610",
                "hand, or the same one placed otherwise",
                named(&built.hand_name, &built.hand),
                named(&asked.hand_name, &asked.hand),
            );
        }
        if built.object != asked.object {
            differs(
                "R611",
                "object",
                named(&built.object_name, &built.object),
                named(&asked.object_name, &asked.object),
            );
        }
        if built.friction != asked.friction {
            differs("R612", "friction", built.friction.to_string(), asked.friction.to_string());
        }
        if built.obstacles != asked.obstacles {
            let digits = |digest: &Digest| regrasp_base::files::hex(digest)[..SHOWN_DIGITS].to_owned();
            differs("R613", "set of obstacles", digits(&built.obstacles), digits(&asked.obstacles));
        }
        if built.hand == asked.hand {
            let fingers = built.fingers.iter().zip(built.contacts.iter().zip(&asked.contacts));
            for (name, (was, is)) in fingers.filter(|(_, (was, is))| was != is) {
                let what = format!("contact model of finger \"{name}\"");
                differs("R614", &what, contact_text(was), contact_text(is));
            }
        }
        if diagnostics.is_empty() && !self.has_joints_of(view) {
            let problem = "has tables of other fingers than the hand that it names";
            diagnostics.push(Diagnostic::new("R606", Place::file(path), problem).fix(rebuild));
        }
        if diagnostics.is_empty() { Ok(()) } else { Err(InputError { diagnostics, n_more: 0 }) }
    }

    /// Refuses settings that other motions are feasible with than those of the roadmap: a larger closure margin, another release rule,
    /// other steps and distances. What only steers a search may differ. `path` is where the roadmap came from.
    ///
    /// Errors: `R615`, one for each such setting.
    pub fn refuse_other_settings(&self, path: &Path, asked: &InHandSettings) -> Result<(), InputError> {
        let mut asked = asked.clone();
        let kept = self.about.settings.physics.closure_margin;
        if asked.physics.closure_margin < kept {
            // Who keeps more keeps that as well.
            asked.physics.closure_margin = kept;
        }
        let (built, asked) = (feasibility(&self.about.settings), feasibility(&asked));
        let differing = built.iter().zip(&asked).filter(|((_, was), (_, is))| was != is);
        let diagnostics: Vec<Diagnostic> = differing
            .map(|((name, was), (_, is))| {
                let problem = format!("was built with another {name}: {was}; asked for is {is}");
                Diagnostic::new("R615", Place::file(path), problem)
                    .fix("build a roadmap with these settings: regrasp roadmap build --settings FILE.json, or --margin")
            })
            .collect();
        if diagnostics.is_empty() { Ok(()) } else { Err(InputError { diagnostics, n_more: 0 }) }
    }

    fn has_joints_of(&self, view: &HandView) -> bool {
        let fingers = &view.hand.fingers;
        let footholds = &self.graph.footholds;
        fingers.len() == footholds.len()
            && fingers.iter().zip(footholds).all(|(finger, table)| finger.chain.n_coordinates() == table.n_coordinates)
    }
}

/// The settings that decide what is feasible, by name.
fn feasibility(settings: &InHandSettings) -> [(&'static str, serde_json::Value); 9] {
    use serde_json::json;
    [
        ("closure_margin", json!(settings.physics.closure_margin)),
        ("friction_margin", json!(settings.physics.friction_margin)),
        ("release_rule", json!(settings.search.release_rule)),
        ("step", json!(settings.physics.step)),
        ("clearance", json!(settings.physics.clearance)),
        ("edge_margin", json!(settings.physics.edge_margin)),
        ("contact_allowance", json!(settings.physics.contact_allowance)),
        ("limit_margin", json!(settings.physics.limit_margin)),
        ("joint_step", json!(settings.physics.joint_step)),
    ]
}

fn contact_text(model: &ContactModel) -> String {
    match model {
        ContactModel::SoftFinger { torsion_radius } => {
            format!("\"{}\" with torsion_radius {torsion_radius}", model.name())
        }
        ContactModel::Frictionless | ContactModel::Point => format!("\"{}\"", model.name()),
    }
}

/// Hexadecimal digits of a digest that messages show.
const SHOWN_DIGITS: usize = 12;
