//! A plan with a free finger in it, planned and accepted.

use regrasp_base::Budget;
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, check};
use regrasp_planners::{InHandSettings, plan_in_hand};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use std::path::Path;
use std::sync::LazyLock;

fn load() -> LoadedScene {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
    load_scene(&scene, &LoadOptions::default()).expect("a scene")
}

/// The scene that [`PLAN`] is for.
pub static LOADED: LazyLock<LoadedScene> = LazyLock::new(load);

/// The sphere of the bundled wide hand, turned about x.
pub static PLAN: LazyLock<Plan> = LazyLock::new(|| {
    let loaded = load();
    let query = loaded.task().query(3);
    let budget = Budget::work(1_000_000);
    let plan =
        plan_in_hand(&loaded.view(), query.as_in_hand().unwrap(), &InHandSettings::default(), 3, &budget, &|_| {})
            .expect("an easy query");
    let report = check((&loaded.scene, &loaded.state), Some(&query), &plan, &CheckSettings::default());
    assert!(report.accepted(), "{:?}", report.violations);
    plan
});
