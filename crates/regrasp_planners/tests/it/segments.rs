//! Segments of plans meet to the last bit, and each plan is proven again from its waypoints alone, forwards and backwards.

use crate::in_hand_methods::scene;
use crate::places::shared_models;
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_plan::check::CheckSettings;
use regrasp_plan::{ContactMode, Plan, Waypoint};
use regrasp_planners::in_hand::BaselineSettings;
use regrasp_planners::in_hand::SearchSettings;
use regrasp_planners::in_hand::{InHandSettings, Method, plan_in_hand, validate_once};
use regrasp_robot::import::{LoadOptions, ResolveOptions};
use regrasp_scene::{LoadedScene, load_scene};
use std::path::Path;

fn assert_meets(plan: &Plan, which: &str) {
    for (s, pair) in plan.segments.windows(2).enumerate() {
        let (before, after) = (pair[0].waypoints.last(), pair[1].waypoints.first());
        assert_eq!(before.map(at_rest), after.map(at_rest), "{which}: between segments {s} and {}", s + 1);
    }
}

/// All of a waypoint that stays while forces change and fingertips that roll come to rest.
fn at_rest(waypoint: &Waypoint) -> Waypoint {
    let mut rest = Waypoint { time: 0.0, joint_torques: Vec::new(), ..waypoint.clone() };
    for contact in &mut rest.contacts {
        (contact.force_in_object, contact.torsion) = (None, None);
        if contact.holds() {
            contact.mode = ContactMode::Fixed;
        }
    }
    rest
}

/// The plan gone backwards: motions can be.
fn backwards(plan: &Plan) -> Plan {
    let mut back = plan.clone();
    back.segments.reverse();
    back.segments.iter_mut().for_each(|segment| segment.waypoints.reverse());
    back
}

/// Plans each seed within `max_work` and judges what is found; the number of plans.
fn judge(loaded: &LoadedScene, settings: &InHandSettings, seeds: std::ops::Range<u64>, max_work: u64) -> usize {
    let mut n_plans = 0;
    for seed in seeds {
        let query = loaded.in_hand(seed);
        let which = format!("{}, {:?}, seed {seed}", loaded.scene.name, settings.method);
        let found = plan_in_hand(&loaded.view(), &query, settings, seed, &Budget::work(max_work), &|_| {});
        let Ok(plan) = found else { continue };
        n_plans += 1;
        assert_meets(&plan, &which);
        assert_eq!(validate_once(&loaded.view(), &plan, settings), Ok(()), "{which}");
        assert_eq!(validate_once(&loaded.view(), &backwards(&plan), settings), Ok(()), "{which}, backwards");
        let strict = CheckSettings { meeting_tolerance: 0.0, ..CheckSettings::default() };
        let report = loaded.judge(&query, &plan, &strict);
        assert!(report.accepted(), "{which}: {:#?}", report.violations);
    }
    n_plans
}

/// Many shortcuts, so that plans are cut and joined as much as they can be.
fn much_cut(method: Method) -> InHandSettings {
    InHandSettings {
        method,
        search: SearchSettings { shortcuts: 40, ..SearchSettings::default() },
        ..InHandSettings::default()
    }
}

#[test]
fn segments_of_the_gait_meet_exactly() {
    assert!(judge(&scene("sphere_180z.toml"), &much_cut(Method::Gait), 0..40, 100_000) >= 35);
    assert!(judge(&scene("box_180z.toml"), &much_cut(Method::Gait), 0..30, 100_000) >= 25);
    assert!(judge(&scene("tight_box_90x.toml"), &much_cut(Method::Gait), 0..4, 300_000) >= 2);
}

#[test]
fn segments_of_the_papers_methods_meet_exactly() {
    let uniform = InHandSettings {
        baselines: BaselineSettings { guided_share: 0.0, ..much_cut(Method::Visibility).baselines },
        ..much_cut(Method::Visibility)
    };
    assert!(judge(&scene("tight_sphere_180z.toml"), &uniform, 0..20, 100_000) >= 18);
    assert!(judge(&scene("sphere_180x.toml"), &much_cut(Method::Classic), 0..10, 100_000) >= 5);
}

#[test]
fn segments_of_a_hand_with_redundant_fingers_meet_exactly() {
    let Some(models) = shared_models() else { return };
    let packages = vec![("models".into(), models)];
    let options = LoadOptions { resolve: ResolveOptions { packages, search_paths: vec![] }, ..LoadOptions::default() };
    let mut n_plans = 0;
    for (name, seeds) in [("cylinder20_x", 6..8), ("cylinder20_z", 0..4), ("sphere32_x", 0..8), ("cube57_z", 0..3)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/allegro/{name}.toml"));
        let loaded = load_scene(&path, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        n_plans += judge(&loaded, &much_cut(Method::Gait), seeds, 250_000);
    }
    assert!(n_plans >= 12, "{n_plans} plans");
}

/// Transfers of the tree from the goal are proven from their ends. With tips that are hulls and roll, a step may be proven one way only.
#[test]
fn plans_of_hands_with_rolling_hulls_are_proven_again() {
    let Some(models) = shared_models() else { return };
    let packages = vec![("models".into(), models)];
    let options = LoadOptions { resolve: ResolveOptions { packages, search_paths: vec![] }, ..LoadOptions::default() };
    let mut n_plans = 0;
    for name in ["dclaw/soft_sphere32_y", "dclaw/soft_sphere32_x", "dclaw/soft_sphere32_z"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.toml"));
        let loaded = load_scene(&path, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        let settings = InHandSettings::default();
        for seed in 0..8 {
            let query = loaded.in_hand(seed);
            let found = plan_in_hand(&loaded.view(), &query, &settings, seed, &Budget::work(100_000), &|_| {});
            let Ok(plan) = found else { continue };
            n_plans += 1;
            assert_eq!(validate_once(&loaded.view(), &plan, &settings), Ok(()), "{name}, seed {seed}");
        }
    }
    assert!(n_plans >= 8, "{n_plans} plans");
}
