//! A session: many queries of one scene, which is read once. A robot asks it again and again where to go from where it really is.
//!
//! [`Session::project`] makes a start of what was observed, [`Session::plan`] plans from it, [`Session::check`] judges the plan.
//! Nothing is read meanwhile, and nothing is kept from one query to the next: the same query has the same answer.

use regrasp_base::{Budget, Diagnostic, InputError, Place};
use regrasp_geometry::Pose;
use regrasp_grasp::record::PoseData;
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, OwnQuery, Report, check, query_of};
use regrasp_plan::plan::Asked;
use regrasp_planners::in_hand::starting::{self, Observation, ProjectionLimits, Start};
use regrasp_planners::{Failure, InHandSettings, Progress, plan_in_hand};
use regrasp_scene::{GraspRequest, HandView, InHandQuery, LoadedScene, Query, Task};

pub use regrasp_planners::in_hand::starting::{Moved, ObservedVelocities, Touching};

/// A scene that is open for queries of one of its tasks: its hand and its object, under its limits. Start and goal are asked anew
/// each time.
#[derive(Debug, Clone)]
pub struct Session<'a> {
    loaded: &'a LoadedScene,
    task: &'a Task,
    view: HandView<'a>,
    settings: InHandSettings,
}

impl<'a> Session<'a> {
    /// Opens `loaded` for the hand and the object of the task called `task`, of its first task where none is named.
    ///
    /// Errors (`A510`, `A503`): no task of this name, a task of finger tracking, settings that make no sense.
    pub fn open(loaded: &'a LoadedScene, task: Option<&str>, settings: InHandSettings) -> Result<Self, InputError> {
        let bad = |code, element: &str, problem: String| {
            Diagnostic::new(code, Place::file("session"), problem).element("argument", element)
        };
        let found = match task {
            None => Some(loaded.task()),
            Some(name) => loaded.task_named(name),
        };
        let names = || loaded.tasks.iter().map(|task| task.name.as_str()).collect::<Vec<_>>().join(", ");
        let task = found.ok_or_else(|| bad("A510", "task", "names no task of the scene".into()).expected(names()))?;
        if task.kind_name() != regrasp_scene::query::IN_HAND {
            let problem = format!("is of kind \"{}\"", task.kind_name());
            return Err(bad("A510", "task", problem).expected("a task of kind \"in_hand\"").into());
        }
        settings.validate().map_err(|problem| bad("A503", "settings", problem))?;
        Ok(Session { loaded, task, view: HandView::of(&loaded.manipulation_of(task)), settings })
    }

    /// The hand and the object.
    pub fn view(&self) -> &HandView<'a> {
        &self.view
    }

    /// The valid start that is nearest to what was observed.
    ///
    /// Errors: there is none within `limits`, and why.
    pub fn project(&self, observed: &Observation, limits: &ProjectionLimits) -> Result<Start, Failure> {
        starting::nearest_start(&self.view, &self.settings, observed, limits)
    }

    /// A plan from `start` to `goal`, a pose of the object in the world. The plan says what it was asked ([`Plan::asked`]).
    ///
    /// Errors: as [`plan_in_hand`].
    pub fn plan(
        &self,
        start: &Start,
        goal: &Pose,
        seed: u64,
        budget: &Budget,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Plan, Failure> {
        let query = self.query(start, goal);
        let plan = plan_in_hand(&self.view, &query, &self.settings, seed, budget, progress)?;
        let fingers = self.view.hand.fingers.iter().zip(&start.holds);
        let asked = Asked {
            start: PoseData::from(&query.world_from_object_start),
            goal: PoseData::from(&query.world_from_object_goal),
            joints: start.joints.clone(),
            free: fingers.filter(|(_, holds)| !**holds).map(|(finger, _)| finger.name.clone()).collect(),
        };
        Ok(Plan { asked: Some(Box::new(asked)), ..plan })
    }

    /// What [`Session::plan`] asks.
    pub fn query(&self, start: &Start, goal: &Pose) -> InHandQuery {
        // As a file has them: who judges the file asks for the same numbers.
        let as_written = |pose: &Pose| Pose::from(&PoseData::from(pose));
        InHandQuery {
            name: self.task.name.clone(),
            hand: self.task.hand,
            object: self.task.object,
            world_from_object_start: as_written(&start.world_from_object),
            world_from_object_way: Vec::new(),
            world_from_object_goal: as_written(goal),
            start_grasp: start.grasp(),
            goal_grasp: GraspRequest::Automatic,
            open_start: None,
        }
    }

    /// Judges a plan: against the query that it brings, or, where it brings none, against that of the session's task.
    pub fn check(&self, plan: &Plan, settings: &CheckSettings) -> Report {
        let query = query_of(&self.loaded.scene, self.task, plan);
        let settings = CheckSettings { own_query: OwnQuery::Allowed, ..settings.clone() };
        check((&self.loaded.scene, &self.loaded.state), Some(&query), plan, &settings)
    }

    /// Judges a plan against what was asked from `start` to `goal`, whatever the plan says.
    pub fn check_asked(&self, plan: &Plan, start: &Start, goal: &Pose, settings: &CheckSettings) -> Report {
        let query = Query::InHand(self.query(start, goal));
        let settings = CheckSettings { own_query: OwnQuery::Allowed, ..settings.clone() };
        check((&self.loaded.scene, &self.loaded.state), Some(&query), plan, &settings)
    }
}
