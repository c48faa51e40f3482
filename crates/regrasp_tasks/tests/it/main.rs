//! Tests of pick and place. Every plan goes through the checker.

/// Tasks that have no plan.
mod failures;
/// Where failed tasks came nearest.
mod misses;
/// Tasks with plans.
mod plans;
/// Roadmaps that are made before.
mod roadmap;

use regrasp_base::Budget;
use regrasp_grasp::list::GraspList;
use regrasp_grasp::list::format::from_json;
use regrasp_plan::check::{CheckSettings, ViolationKind, check_any};
use regrasp_plan::{AnyPlan, RobotPlan};
use regrasp_robot::LoadOptions;
use regrasp_scene::{LoadedScene, PickAndPlaceQuery, load_scene};
use regrasp_tasks::{Failure, TaskSettings, plan_pick_and_place};
use std::path::Path;

/// A scene of the repository with its lists of grasps.
pub struct Case {
    /// The scene.
    pub loaded: LoadedScene,
    /// Its first task.
    pub query: PickAndPlaceQuery,
    /// Lists by hand.
    pub lists: Vec<(usize, GraspList)>,
}

impl Case {
    /// Of `scenes/two_arms`.
    pub fn new(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/two_arms").join(name);
        let loaded = load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let query = loaded.task().query(0).as_pick_and_place().expect("a task of pick and place").clone();
        let list = |file: &regrasp_scene::GraspFile| {
            let bytes = std::fs::read(&file.path).unwrap();
            (file.hand, from_json(&file.path, &bytes).unwrap_or_else(|error| panic!("{error}")))
        };
        let lists = loaded.scene.grasp_files.iter().map(list).collect();
        Case { loaded, query, lists }
    }

    /// Plans it.
    pub fn plan(&self, settings: &TaskSettings, seed: u64) -> Result<RobotPlan, Failure> {
        let world = (&self.loaded.scene, &self.loaded.state);
        plan_pick_and_place(world, &self.query, &self.lists, settings, seed, &Budget::work(20_000_000))
    }

    /// A plan that the checker accepts.
    pub fn accepted(&self, settings: &TaskSettings, seed: u64) -> RobotPlan {
        let plan = self.plan(settings, seed).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        accepted_by_checker(self, &plan, seed);
        plan
    }

    /// What the checker finds wrong.
    pub fn violations(&self, plan: &RobotPlan) -> Vec<ViolationKind> {
        let world = (&self.loaded.scene, &self.loaded.state);
        let any = AnyPlan::Robot(Box::new(plan.clone()));
        let report = check_any(world, Some(&self.query.clone().into()), &any, &CheckSettings::default());
        report.violations.iter().map(|violation| violation.kind).collect()
    }
}

/// Panics unless a plan is the same after it was written and read, and the checker accepts it.
pub fn accepted_by_checker(case: &Case, plan: &RobotPlan, seed: u64) {
    let world = (&case.loaded.scene, &case.loaded.state);
    let query = case.query.clone().into();
    let any = AnyPlan::Robot(Box::new(plan.clone()));
    let read = regrasp_plan::read_any(std::path::Path::new("plan.json"), any.to_json().as_bytes());
    assert!(read.expect("a plan file") == any, "seed {seed}: reading loses something");
    let report = check_any(world, Some(&query), &any, &CheckSettings::default());
    assert!(report.accepted(), "seed {seed}: {:?}", report.violations.first());
}

/// Hands that hold the object, in order.
pub fn holders(plan: &RobotPlan) -> Vec<String> {
    let hands: Vec<&str> = plan.hands.iter().map(|hand| hand.name.as_str()).collect();
    let mut all: Vec<String> = Vec::new();
    for segment in &plan.segments {
        if let [holder] = segment.held_by.values().next().expect("an object").as_slice()
            && hands.contains(&holder.as_str())
            && all.last() != Some(holder)
        {
            all.push(holder.clone());
        }
    }
    all
}
