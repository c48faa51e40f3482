//! Every method's plans against the checker, which shares nothing with the planner, and against themselves when
//! planned again.

use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, Level};
use regrasp_planners::in_hand::BaselineSettings;
use regrasp_planners::in_hand::SearchSettings;
use regrasp_planners::in_hand::{Alpha, InHandSettings, Method, Progress, ReleaseRule, plan_in_hand, validate_once};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use std::path::Path;

const METHODS: [Method; 3] = [Method::Gait, Method::Visibility, Method::Classic];
const SEEDS: std::ops::Range<u64> = 0..3;

pub fn scene(name: &str) -> LoadedScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

pub fn settings(method: Method, n_threads: usize) -> InHandSettings {
    // Alpha as in Saut 2011's box example.
    let alpha = Alpha::Decreasing { start: 0.5, step: 0.005, end: 0.3 };
    InHandSettings {
        method,
        n_threads,
        baselines: BaselineSettings { alpha, ..BaselineSettings::default() },
        ..InHandSettings::default()
    }
}

fn plan(loaded: &LoadedScene, settings: &InHandSettings, seed: u64) -> Plan {
    let ignore = |_: Progress| {};
    let budget = Budget::work(20_000_000);
    plan_in_hand(&loaded.view(), &loaded.in_hand(seed), settings, seed, &budget, &ignore)
        .unwrap_or_else(|failure| panic!("{:?}, seed {seed}: {failure}", settings.method))
}

fn is_judged_valid_and_reproducible(name: &str) {
    let loaded = scene(name);
    for method in METHODS {
        for seed in SEEDS {
            let one_thread = settings(method, 1);
            let first = plan(&loaded, &one_thread, seed);
            assert_eq!(validate_once(&loaded.view(), &first, &one_thread), Ok(()), "{method:?}, seed {seed}");
            let query = loaded.in_hand(seed);
            let report = loaded.judge(&query, &first, &CheckSettings::default());
            assert!(report.accepted(), "{method:?}, seed {seed}: {report:#?}");
            assert!(first == plan(&loaded, &one_thread, seed), "{method:?}, seed {seed}: another plan the second time");
            assert!(
                first == plan(&loaded, &settings(method, 4), seed),
                "{method:?}, seed {seed}: another plan on four threads"
            );
        }
    }
}

#[test]
fn plans_for_the_sphere_are_accepted_and_reproducible() {
    is_judged_valid_and_reproducible("sphere_90x.toml");
}

#[test]
fn plans_for_the_box_are_accepted_and_reproducible() {
    is_judged_valid_and_reproducible("box_90x.toml");
}

/// Saut 2011's own sampling, without poses near the way: the plate asks for long looks for a finger's way, the box for contacts
/// that change their faces.
#[test]
fn the_method_of_the_paper_solves_box_and_plate_with_its_own_sampling() {
    for name in ["box_90x.toml", "ellipsoid_obstacle.toml"] {
        let loaded = scene(name);
        let asked = InHandSettings {
            baselines: BaselineSettings { guided_share: 0.0, ..settings(Method::Visibility, 1).baselines },
            ..InHandSettings { method: Method::Visibility, ..InHandSettings::plain() }
        };
        for seed in 0..2 {
            let plan = plan(&loaded, &asked, seed);
            assert!(plan.statistics.work < 2_000_000, "{name}, seed {seed}: {}", plan.statistics.work);
            let geometry = CheckSettings { level: Level::Geometry, ..CheckSettings::default() };
            let report = loaded.judge(&loaded.in_hand(seed), &plan, &geometry);
            assert!(report.accepted(), "{name}, seed {seed}: {report:#?}");
        }
    }
}

#[test]
fn methods_of_the_paper_have_its_release_rule_and_say_so() {
    let loaded = scene("sphere_90x.toml");
    for method in [Method::Visibility, Method::Classic] {
        let asked = InHandSettings {
            search: SearchSettings { release_rule: ReleaseRule::WhereOthersHold, ..settings(method, 1).search },
            ..settings(method, 1)
        };
        let plan = plan(&loaded, &asked, 5);
        let recorded: InHandSettings = serde_json::from_value(plan.settings).expect("settings as they were written");
        assert_eq!(recorded.search.release_rule, ReleaseRule::EverywhereEveryFinger);
    }
}

#[test]
fn a_spent_budget_is_told_with_its_causes() {
    let loaded = scene("tight_box_90x.toml");
    let query = loaded.in_hand(0);
    for method in [Method::Visibility, Method::Classic] {
        let failure = plan_in_hand(&loaded.view(), &query, &settings(method, 1), 0, &Budget::work(3000), &|_| {})
            .expect_err("3000 configurations are too few for the tight hand");
        assert_eq!(failure.kind, regrasp_planners::FailureKind::WorkSpent);
        assert!(!failure.causes.is_empty() && failure.statistics.nodes >= 2, "{failure:?}");
        assert!(failure.nearest_miss.is_some());
        // Work is looked at now and then: the overrun is one step of the search.
        assert!(failure.statistics.work < 6000, "{method:?}: {}", failure.statistics.work);
    }
}
