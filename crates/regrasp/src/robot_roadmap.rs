//! Roadmaps of robots among what rests around them: made before queries, saved, and used by plans.

use regrasp_arms::plan::{GraphAnswer, build_graph, graph_differs, grow_graph, plan_with_graph};
use regrasp_arms::roadmap::{BuildSettings, Roads, SuperGraph};
use regrasp_base::{Budget, Diagnostic, InputError, Place, files};
use regrasp_grasp::GraspList;
use regrasp_plan::RobotPlan;
use regrasp_planners::{Failure, FailureKind, PlannerSettings};
use regrasp_scene::{Query, Scene, State};
use regrasp_tasks::{RoadmapBuildSettings, TaskAnswer, TaskRoadmap, build_roadmap, plan_with_roadmap};
use std::path::Path;

/// A roadmap of a robot.
#[derive(Debug, Clone)]
pub enum RobotRoadmap {
    /// For motions: the super graph.
    Motion(Box<Roads>),
    /// For pick and place: the super graph, double grasps, exchanges.
    Task(Box<TaskRoadmap>),
}

/// What was planned with a roadmap; the roadmap can grow by it ([`RobotRoadmap::grown_by`]).
#[derive(Debug, Clone)]
pub enum RobotAnswer {
    /// Of a motion.
    Motion(Box<GraphAnswer>),
    /// Of pick and place.
    Task(Box<TaskAnswer>),
}

impl RobotAnswer {
    /// The plan.
    pub fn plan(&self) -> &RobotPlan {
        match self {
            RobotAnswer::Motion(answer) => &answer.plan,
            RobotAnswer::Task(answer) => &answer.plan,
        }
    }

    /// The plan alone.
    pub fn into_plan(self) -> RobotPlan {
        match self {
            RobotAnswer::Motion(answer) => answer.plan,
            RobotAnswer::Task(answer) => answer.plan,
        }
    }
}

/// Where a roadmap is used: scene, state, query, and the lists of grasps of a task of pick and place.
pub struct Asked<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// All that the query does not name rests in it.
    pub state: &'a State,
    /// What is asked.
    pub query: &'a Query,
    /// By index of the hand in `Scene::hands`.
    pub lists: &'a [(usize, GraspList)],
}

impl RobotRoadmap {
    /// Makes the roadmap of a query's robot.
    ///
    /// Errors: a robot that has no super graph, a query of one hand; as planning before any search.
    pub fn build(
        asked: &Asked,
        settings: &PlannerSettings,
        of_build: &RoadmapBuildSettings,
        seed: u64,
        budget: &Budget,
    ) -> Result<Self, Failure> {
        let around = (asked.scene, asked.state);
        match asked.query {
            Query::PickAndPlace(query) => {
                let settings = (&settings.task, of_build);
                let built = build_roadmap(around, query, asked.lists, settings, (seed, budget))?;
                Ok(RobotRoadmap::Task(Box::new(built)))
            }
            Query::Motion(query) => {
                of_build.validate().map_err(|problem| Failure::of_settings(&problem))?;
                let of_graph = BuildSettings {
                    nodes_per_arm: of_build.nodes_per_arm,
                    clearance: settings.motion.clearance + settings.motion.search_margin,
                    ..BuildSettings::default()
                };
                let graph = build_graph(around, query, &of_graph, seed).ok_or_else(|| {
                    let message = "a super graph is of a robot with one arm or two".to_owned();
                    Failure::bare(FailureKind::Impossible, message, "plan without a roadmap")
                })?;
                Ok(RobotRoadmap::Motion(Box::new(Roads::new(graph))))
            }
            Query::InHand(_) | Query::Tracking(_) => {
                let message = "the task is of one hand".to_owned();
                Err(Failure::bare(FailureKind::Impossible, message, "take a scene with a robot"))
            }
        }
    }

    /// The file of the roadmap.
    pub fn to_json(&self) -> String {
        match self {
            RobotRoadmap::Motion(roads) => roads.graph.to_json(),
            RobotRoadmap::Task(roadmap) => roadmap.to_json(),
        }
    }

    /// Reads the file at `path`.
    ///
    /// Errors: not such a file (`R601`), another version (`R602`), what contradicts itself (`R606`).
    pub fn load(path: &Path) -> Result<Self, InputError> {
        Self::from_json(path, &files::read_text(path)?)
    }

    /// As [`RobotRoadmap::load`], of `text`.
    pub fn from_json(path: &Path, text: &str) -> Result<Self, InputError> {
        #[derive(serde::Deserialize)]
        struct Named {
            format: String,
        }
        let named = serde_json::from_str::<Named>(text);
        match named.is_ok_and(|named| named.format == regrasp_tasks::roadmap::FORMAT) {
            true => TaskRoadmap::from_json(path, text).map(|roadmap| RobotRoadmap::Task(Box::new(roadmap))),
            false => SuperGraph::from_json(path, text).map(|graph| RobotRoadmap::Motion(Box::new(Roads::new(graph)))),
        }
    }

    /// What differs from what the roadmap was made for, in words. None where nothing does.
    ///
    /// Errors: as planning before any search.
    pub fn differs(&self, asked: &Asked, settings: &PlannerSettings) -> Result<Option<&'static str>, Failure> {
        let around = (asked.scene, asked.state);
        match (self, asked.query) {
            (RobotRoadmap::Task(roadmap), Query::PickAndPlace(query)) => {
                roadmap.differs_from(around, query, asked.lists, &settings.task)
            }
            (RobotRoadmap::Motion(roads), Query::Motion(query)) => Ok(graph_differs(around, query, &roads.graph)),
            _ => Ok(Some("the kind of task")),
        }
    }

    /// Refuses a roadmap that was made for something else; `path` is where it came from.
    ///
    /// Errors: the robot, what rests around it, a list, the object or a setting differs (`R616`).
    pub fn refuse_other(&self, path: &Path, what: &str) -> InputError {
        let problem = format!("was built with other inputs: {what} differs");
        let fix = "build a roadmap for this scene: regrasp roadmap build SCENE -o FILE";
        Diagnostic::new("R616", Place::file(path), problem).fix(fix).into()
    }

    /// Plans with the roadmap.
    ///
    /// Errors: why there is no plan; a roadmap of something else.
    pub fn plan(
        &self,
        asked: &Asked,
        settings: &PlannerSettings,
        seed: u64,
        budget: &Budget,
    ) -> Result<RobotAnswer, Failure> {
        let around = (asked.scene, asked.state);
        match (self, asked.query) {
            (RobotRoadmap::Task(roadmap), Query::PickAndPlace(query)) => {
                plan_with_roadmap(around, query, asked.lists, &settings.task, (seed, budget), Some(roadmap))
                    .map(|answer| RobotAnswer::Task(Box::new(answer)))
            }
            (RobotRoadmap::Motion(roads), Query::Motion(query)) => {
                if let Some(what) = graph_differs(around, query, &roads.graph) {
                    let message = format!("the roadmap was made with other inputs: {what} differs");
                    return Err(Failure::bare(FailureKind::SettingsInvalid, message, "build the roadmap again"));
                }
                plan_with_graph(around, query, &settings.motion, (seed, budget), roads)
                    .map(|answer| RobotAnswer::Motion(Box::new(answer)))
            }
            _ => {
                let message = "the roadmap is of another kind of task".to_owned();
                Err(Failure::bare(FailureKind::SettingsInvalid, message, "build the roadmap again"))
            }
        }
    }

    /// The roadmap with what an answer has and it has not. None where it had all that the answer needed. `asked` and `settings` are
    /// those of the answer.
    ///
    /// Errors: as planning before any search; an answer of another kind of task.
    pub fn grown_by(
        &self,
        asked: &Asked,
        settings: &PlannerSettings,
        answer: &RobotAnswer,
    ) -> Result<Option<RobotRoadmap>, Failure> {
        let around = (asked.scene, asked.state);
        let grown = match (self, asked.query, answer) {
            (RobotRoadmap::Task(roadmap), Query::PickAndPlace(query), RobotAnswer::Task(answer)) => {
                let grown = roadmap.grown_by(around, query, asked.lists, &settings.task, answer)?;
                RobotRoadmap::Task(Box::new(grown))
            }
            (RobotRoadmap::Motion(roads), Query::Motion(query), RobotAnswer::Motion(answer)) => {
                let (grown, _) = grow_graph(around, query, roads, answer.new_way.as_slice());
                RobotRoadmap::Motion(Box::new(grown))
            }
            _ => {
                let message = "roadmap, query and answer are not of the same kind of task".to_owned();
                return Err(Failure::bare(FailureKind::SettingsInvalid, message, "build the roadmap again"));
            }
        };
        Ok((grown.sizes() != self.sizes()).then_some(grown))
    }

    /// Nodes, edges, double grasps, exchanges.
    fn sizes(&self) -> [usize; 4] {
        let of_graph = |roads: &Roads| [roads.graph.graph.nodes.len(), roads.graph.graph.edges.len()];
        match self {
            RobotRoadmap::Motion(roads) => {
                let [nodes, edges] = of_graph(roads);
                [nodes, edges, 0, 0]
            }
            RobotRoadmap::Task(roadmap) => {
                let [nodes, edges] = roadmap.roads.as_ref().map_or([0, 0], of_graph);
                let n_pairs = roadmap.double_grasps.iter().map(|of| of.pairs.len()).sum();
                [nodes, edges, n_pairs, roadmap.n_exchanges()]
            }
        }
    }

    /// What the roadmap holds, in words.
    pub fn in_words(&self) -> String {
        let [nodes, edges, n_pairs, exchanges] = self.sizes();
        let graph = format!("{nodes} nodes, {edges} edges");
        match self {
            RobotRoadmap::Motion(_) => graph,
            RobotRoadmap::Task(roadmap) => {
                let graph = if roadmap.roads.is_some() { graph } else { "no graph".to_owned() };
                format!("{graph}, {n_pairs} double grasps, {exchanges} exchanges")
            }
        }
    }
}
