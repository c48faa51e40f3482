//! A session: many queries of one scene, which is read once. A robot asks it again and again where to go from where it really is.
//!
//! [`Session::project`] makes a start of what was observed, [`Session::plan`] plans from it, [`Session::check`] judges the plan.
//! Nothing is read meanwhile, and nothing is kept from one query to the next but what the checker has prepared of the scene's shapes: the
//! same query has the same answer.
//!
//! A session may have a roadmap: it is asked first ([`Session::with_roadmap`]), and a search where it has no answer that the checker
//! accepts.

use regrasp_base::{Budget, Diagnostic, InputError, Place};
use regrasp_geometry::Pose;
use regrasp_grasp::record::PoseData;
use regrasp_plan::Plan;
use regrasp_plan::check::prepared::Prepared;
use regrasp_plan::check::{CheckSettings, OwnQuery, Report, check_prepared, query_of};
use regrasp_plan::plan::Asked;
use regrasp_planners::in_hand::roadmap::{GraspRoadmap, QueryMemory, RoadmapPlanner};
use regrasp_planners::in_hand::starting::{self, Observation, ProjectionLimits, Start};
use regrasp_planners::{Failure, FailureKind, InHandSettings, Progress, plan_in_hand};
use regrasp_scene::{GraspRequest, HandView, InHandQuery, LoadedScene, Query, Task};
use std::path::Path;
use std::sync::Arc;

pub use regrasp_planners::in_hand::starting::{Moved, ObservedVelocities, Touching};

/// A scene that is open for queries of one of its tasks: its hand and its object, under its limits. Start and goal are asked anew
/// each time.
#[derive(Debug, Clone)]
pub struct Session<'a> {
    loaded: &'a LoadedScene,
    task: &'a Task,
    view: HandView<'a>,
    settings: InHandSettings,
    roadmap: Option<&'a SessionRoadmap>,
    prepared: Arc<Prepared>,
}

/// A roadmap that agrees with a session in hand, object, friction, obstacles, fingertips, and in the settings that decide what is
/// feasible.
#[derive(Debug, Clone)]
pub struct SessionRoadmap {
    roadmap: GraspRoadmap,
}

/// Share of a query's work that its roadmap may take; the search gets what is left. By hand.
const ROADMAP_SHARE: u64 = 2;

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
        Ok(Session {
            loaded,
            task,
            view: HandView::of(&loaded.manipulation_of(task)),
            settings,
            roadmap: None,
            prepared: Arc::default(),
        })
    }

    /// A roadmap, which came from `path`, as this session may ask it.
    ///
    /// Errors: it was built for another scene (`R610` to `R614`, `R606`), or with settings that other motions are feasible with
    /// (`R615`).
    pub fn agreed_roadmap(&self, path: &Path, roadmap: GraspRoadmap) -> Result<SessionRoadmap, InputError> {
        roadmap.refuse_other_scene(path, &self.view)?;
        roadmap.refuse_other_settings(path, &self.settings)?;
        Ok(SessionRoadmap { roadmap })
    }

    /// The same session, which asks a roadmap first. `roadmap` is of a session of the same scene, task and settings.
    #[must_use]
    pub fn with_roadmap(self, roadmap: &'a SessionRoadmap) -> Self {
        Session { roadmap: Some(roadmap), ..self }
    }

    /// The same session, whose checker prepares no shape and no fingertip that is in `prepared`, and adds to it: for sessions that share a
    /// scene.
    #[must_use]
    pub fn sharing(self, prepared: &Arc<Prepared>) -> Self {
        Session { prepared: prepared.clone(), ..self }
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

    /// A plan from `start` to `goal`, a pose of the object in the world. The plan says what it was asked ([`Plan::asked`]). Its method
    /// is `roadmap` where the session's roadmap had it, and the checker accepts it.
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
        let mut left = budget.clone();
        match self.ask_roadmap(start, goal, seed, budget) {
            Some(Ok(plan)) => {
                if self.check_asked(&plan, start, goal, &CheckSettings::default()).accepted() {
                    return Ok(plan);
                }
                left.max_work = left.max_work.saturating_sub(plan.statistics.work);
            }
            Some(Err(failure)) if failure.kind == FailureKind::Interrupted => return Err(failure),
            Some(Err(failure)) => left.max_work = left.max_work.saturating_sub(failure.statistics.work),
            None => {}
        }
        self.search(start, goal, seed, &left, progress)
    }

    /// What the session's roadmap says to the query of [`Session::plan`], with half of its work at most. None where the session has no
    /// roadmap, or a finger is free at the start: graphs are of grasps of all fingers.
    ///
    /// Errors: the graph does not lead there. A plan of a graph is not judged yet.
    pub fn ask_roadmap(&self, start: &Start, goal: &Pose, seed: u64, budget: &Budget) -> Option<Result<Plan, Failure>> {
        let SessionRoadmap { roadmap } = self.roadmap.filter(|_| start.holds.iter().all(|holds| *holds))?;
        let planner = RoadmapPlanner::of_agreed(roadmap, &self.view, &self.settings.physics.speed);
        let budget = Budget { max_work: budget.max_work / ROADMAP_SHARE, ..budget.clone() };
        let query = self.query(start, goal);
        let answer = planner.plan(&query, seed, &budget, &mut QueryMemory::default());
        Some(answer.map(|answer| self.asked(start, &query, answer.plan)))
    }

    /// A plan by search, whatever the session's roadmap says; as [`Session::plan`].
    ///
    /// Errors: as [`plan_in_hand`].
    pub fn search(
        &self,
        start: &Start,
        goal: &Pose,
        seed: u64,
        budget: &Budget,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Plan, Failure> {
        let query = self.query(start, goal);
        let plan = plan_in_hand(&self.view, &query, &self.settings, seed, budget, progress)?;
        Ok(self.asked(start, &query, plan))
    }

    /// The plan, which says what it was asked.
    fn asked(&self, start: &Start, query: &InHandQuery, plan: Plan) -> Plan {
        let fingers = self.view.hand.fingers.iter().zip(&start.holds);
        let asked = Asked {
            start: PoseData::from(&query.world_from_object_start),
            goal: PoseData::from(&query.world_from_object_goal),
            joints: start.joints.clone(),
            free: fingers.filter(|(_, holds)| !**holds).map(|(finger, _)| finger.name.clone()).collect(),
        };
        Plan { asked: Some(Box::new(asked)), ..plan }
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
        check_prepared(&self.prepared, (&self.loaded.scene, &self.loaded.state), Some(&query), plan, &settings)
    }

    /// Judges a plan against what was asked from `start` to `goal`, whatever the plan says.
    pub fn check_asked(&self, plan: &Plan, start: &Start, goal: &Pose, settings: &CheckSettings) -> Report {
        let query = Query::InHand(self.query(start, goal));
        let settings = CheckSettings { own_query: OwnQuery::Allowed, ..settings.clone() };
        check_prepared(&self.prepared, (&self.loaded.scene, &self.loaded.state), Some(&query), plan, &settings)
    }
}
