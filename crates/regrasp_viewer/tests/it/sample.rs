//! Scenes, plans and their stories.

use crate::places::{repository, shared_models};
use regrasp_base::Budget;
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, Report, check};
use regrasp_planners::{PlannerSettings, plan};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, Manipulation, Query, load_scene};
use regrasp_viewer::story::{FailureStory, Outcome, Story, Telling, tell};

/// A scene with a plan that the checker accepts.
pub struct Sample {
    pub options: LoadOptions,
    pub loaded: LoadedScene,
    pub query: Query,
    pub plan: Plan,
    pub report: Report,
}

/// How models are found; none where the shared ones are absent.
pub fn options_with_models() -> Option<LoadOptions> {
    let mut options = LoadOptions::default();
    options.resolve.packages.push(("models".into(), shared_models()?));
    Some(options)
}

/// The story of a task for which there is no plan.
pub fn story_without_plan(task: Manipulation, options: &LoadOptions) -> Story {
    let failure = FailureStory {
        kind: "time_limit".into(),
        message: String::new(),
        advice: String::new(),
        causes: Vec::new(),
        nearest_miss: None,
    };
    let telling = Telling {
        task,
        query: None,
        outcome: Outcome::Failed(failure),
        title: None,
        facts: Vec::new(),
        roadmap: None,
        packages: &options.resolve,
    };
    tell(&telling).expect("a story")
}

impl Sample {
    pub fn new(scene: &str, options: LoadOptions) -> Self {
        let loaded = load_scene(&repository().join(scene), &options).unwrap_or_else(|error| panic!("{error}"));
        let query = loaded.task().query(0);
        let budget = Budget::work(5_000_000);
        let plan = plan((&loaded.scene, &loaded.state), &query, &PlannerSettings::default(), 0, &budget, &|_| {})
            .unwrap_or_else(|failure| panic!("{failure}"));
        let report = check((&loaded.scene, &loaded.state), Some(&query), &plan, &CheckSettings::default());
        assert!(report.accepted(), "{:?}", report.violations);
        Sample { options, loaded, query, plan, report }
    }

    /// The sphere in the wide hand.
    pub fn sphere() -> Self {
        Sample::new("scenes/sphere_90x.toml", LoadOptions::default())
    }

    /// The football, turned by tracking.
    pub fn football() -> Self {
        Sample::new("scenes/football.toml", LoadOptions::default())
    }

    pub fn story(&self) -> Story {
        self.story_of(&self.plan, &self.report)
    }

    pub fn story_of(&self, plan: &Plan, report: &Report) -> Story {
        let telling = Telling {
            task: self.loaded.manipulation(),
            query: Some(&self.query),
            outcome: Outcome::Planned { plan, report },
            title: None,
            facts: Vec::new(),
            roadmap: None,
            packages: &self.options.resolve,
        };
        tell(&telling).expect("a story")
    }
}
