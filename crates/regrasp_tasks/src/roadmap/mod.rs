//! What is made before any query: a robot, what rests around it, and lists of grasps (Saut 2010, sec. V-A and IV-B).
//!
//! A roadmap holds the super graph of the arms, the pairs of grasps in which two hands do not hit each other, and exchanges: postures
//! in which one hand gives the object to another one, with straight ways in and out. None of these depends on where the object is.
//! Motions of a plan are certified as without a roadmap.

/// How it is made.
mod build;
/// Its file.
mod file;

pub use build::{RoadmapBuildSettings, build_roadmap};
pub use file::FORMAT;

use crate::context::{Context, Prepared};
use crate::exchange::Give;
use crate::{Failure, TaskSettings};
use regrasp_arms::model::ArmModel;
use regrasp_arms::roadmap::{Roads, fingerprint_of_robot, fingerprint_of_world};
use regrasp_base::Budget;
use regrasp_base::files::sha256;
use regrasp_grasp::list::GraspList;
use regrasp_manipulation::task_settings::PostureWeights;
use regrasp_plan::RobotPlan;
use regrasp_scene::{PickAndPlaceQuery, Scene, State};
use std::fmt::Write as _;

/// What a roadmap was made for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// Stands for the robot.
    pub robot: String,
    /// Stands for what rests, the object left out.
    pub world: String,
    /// Stands for the lists of grasps and the object.
    pub grasps: String,
    /// Stands for the settings that exchanges depend on.
    pub settings: String,
}

/// Pairs of grasps in which two hands do not hit each other.
#[derive(Debug, Clone, PartialEq)]
pub struct DoubleGrasps {
    /// Indices of the hands among those of the task, the smaller first.
    pub hands: [usize; 2],
    /// Indices of their grasps, in rising order.
    pub pairs: Vec<[usize; 2]>,
}

/// A plan, and what a roadmap can learn from it.
#[derive(Debug, Clone)]
pub struct TaskAnswer {
    /// The plan.
    pub plan: RobotPlan,
    /// States at the corners of paths that the super graph was asked for and did not have.
    pub(crate) new_ways: Vec<Vec<Vec<f64>>>,
    /// Exchanges of the plan.
    pub(crate) exchanges: Vec<Give>,
}

/// A roadmap of pick and place.
#[derive(Debug, Clone)]
pub struct TaskRoadmap {
    /// What it was made for.
    pub origin: Origin,
    /// Seed.
    pub seed: u64,
    /// The super graph, of robots with one arm or two.
    pub roads: Option<Roads>,
    /// By pair of hands.
    pub double_grasps: Vec<DoubleGrasps>,
    /// Exchanges.
    pub(crate) exchanges: Vec<Give>,
}

impl TaskRoadmap {
    /// Number of exchanges.
    pub fn n_exchanges(&self) -> usize {
        self.exchanges.len()
    }

    /// The state of the robot at each exchange: both hands are at the object.
    pub fn exchange_states(&self) -> impl Iterator<Item = &[f64]> {
        self.exchanges.iter().map(|give| give.way_in.ends()[0].as_slice())
    }

    /// The roadmap with what `answer` has and it has not: ways of the arms where they are free for the robot and the rest as the super
    /// graph knows them, and exchanges of pairs of grasps that had none. Scene, query, lists and settings are those of the answer.
    ///
    /// Errors: as `plan_pick_and_place` before any search.
    pub fn grown_by(
        &self,
        (scene, state): (&Scene, &State),
        query: &PickAndPlaceQuery,
        lists: &[(usize, GraspList)],
        settings: &TaskSettings,
        answer: &TaskAnswer,
    ) -> Result<TaskRoadmap, Failure> {
        let prepared = Prepared::new(scene, query, lists, settings)?;
        let models = prepared.models();
        let budget = Budget::unlimited();
        let context = Context::new((scene, state), query, (&prepared, &models), settings, (0, &budget))?;
        let mut grown = self.clone();
        if let Some(roads) = &self.roads {
            grown.roads = Some(roads.grown_by(&answer.new_ways, &graph_model(&context), &context.fixed).0);
        }
        for give in &answer.exchanges {
            let is_same = |own: &Give| own.giver == give.giver && own.taker == give.taker;
            if !grown.exchanges.iter().any(is_same) {
                grown.exchanges.push(give.clone());
            }
        }
        grown.exchanges.sort_by_key(|give| (give.giver, give.taker));
        Ok(grown)
    }

    /// What differs from what the roadmap was made for, in words. None where nothing does.
    ///
    /// Errors: as `plan_pick_and_place` before any search.
    pub fn differs_from(
        &self,
        (scene, state): (&Scene, &State),
        query: &PickAndPlaceQuery,
        lists: &[(usize, GraspList)],
        settings: &TaskSettings,
    ) -> Result<Option<&'static str>, Failure> {
        let prepared = Prepared::new(scene, query, lists, settings)?;
        let models = prepared.models();
        let budget = Budget::unlimited();
        let context = Context::new((scene, state), query, (&prepared, &models), settings, (0, &budget))?;
        Ok(self.differs(&context))
    }

    /// The same of a prepared task.
    pub(crate) fn differs(&self, context: &Context) -> Option<&'static str> {
        let now = origin(context, &graph_model(context));
        let pairs = [
            ("the robot", &self.origin.robot, &now.robot),
            ("what rests around the robot", &self.origin.world, &now.world),
            ("the object or a list of its grasps", &self.origin.grasps, &now.grasps),
            ("a setting that exchanges depend on", &self.origin.settings, &now.settings),
        ];
        let differs = pairs.into_iter().find(|(_, own, other)| own != other).map(|(what, _, _)| what);
        let n = context.robot.layout.len();
        let is_whole = |give: &Give| [&give.way_in, &give.way_out].iter().all(|way| way.ends()[0].len() == n);
        differs.or_else(|| (!self.exchanges.iter().all(is_whole)).then_some("the number of joints of an exchange"))
    }

    /// True where the roadmap knows that two hands do not hit each other.
    pub(crate) fn is_apart(&self, a: [usize; 2], b: [usize; 2]) -> bool {
        let [a, b] = if a[0] <= b[0] { [a, b] } else { [b, a] };
        let of_hands = self.double_grasps.iter().find(|pairs| pairs.hands == [a[0], b[0]]);
        of_hands.is_some_and(|of| of.pairs.binary_search(&[a[1], b[1]]).is_ok())
    }
}

/// The robot of the graph: arms and torso move, fingers rest where the robot file has them.
pub(crate) fn graph_model(context: &Context) -> ArmModel {
    let rest = context.robot.layout.rest();
    ArmModel::new(context.robot, &context.covers.links, &[], &rest, &context.arms_and_torso)
}

/// What stands for a task.
pub(crate) fn origin(context: &Context, model: &ArmModel) -> Origin {
    let object = context.object;
    let mut grasps = format!(
        "{} {:?} {:?} {:?} {:?} {:?}\n",
        object.name, object.mass, object.friction, object.center_of_mass, context.gravity, context.promises
    );
    for hand in &context.hands {
        let listed = regrasp_grasp::list::format::to_json(hand.list);
        let kept: Vec<usize> = hand.grasps.iter().map(|grasp| grasp.index).collect();
        let _ = writeln!(grasps, "{} {} {kept:?}", context.scene.hands[hand.index].name, sha256(listed.as_bytes()));
    }
    let of = context.settings;
    let mut settings = format!(
        "{:?} {:?} {:?} {:?} {:?} {:?}",
        of.clearance, of.line_step, of.exchange_turns, of.exchange_draws, of.exchange_spread, of.forces
    );
    // Roadmaps of before these weights keep their fingerprint.
    if of.posture != PostureWeights::NONE {
        let _ = write!(settings, " {:?}", of.posture);
    }
    Origin {
        robot: fingerprint_of_robot(model),
        world: fingerprint_of_world(&context.fixed),
        grasps: sha256(grasps.as_bytes()),
        settings: sha256(settings.as_bytes()),
    }
}
