//! Plans with free fingers, hands that can never let go, and hands of more fingers than an object needs.

use crate::in_hand_methods::scene;
use crate::queries::Queries;
use regrasp_base::{Budget, Rng};
use regrasp_mutations::mutants;
use regrasp_plan::check::{CheckSettings, check};
use regrasp_plan::{ContactMode, Plan, Waypoint};
use regrasp_planners::in_hand::PhysicsSettings;
use regrasp_planners::in_hand::SearchSettings;
use regrasp_planners::in_hand::{InHandSettings, plan_in_hand, validate_once};
use regrasp_planners::{Failure, FailureKind};
use regrasp_scene::LoadedScene;
use std::collections::BTreeSet;

/// Settings with which fingers are left free as often as can be.
fn eager(least_holding: usize) -> InHandSettings {
    let usual = InHandSettings {
        search: SearchSettings { first_try: None, ..SearchSettings::default() },
        ..InHandSettings::default()
    };
    InHandSettings {
        search: SearchSettings { least_holding, free_after: 0, free_share: 1.0, shortcuts: 0, ..usual.search },
        ..usual
    }
}

fn try_plan(loaded: &LoadedScene, settings: &InHandSettings, seed: u64) -> Result<Plan, Failure> {
    plan_in_hand(&loaded.view(), &loaded.in_hand(seed), settings, seed, &Budget::work(3_000_000), &|_| {})
}

/// A plan that was found, accepted, and proven again forwards and backwards.
fn plan(loaded: &LoadedScene, settings: &InHandSettings, seed: u64) -> Plan {
    let which = format!("{}, seed {seed}", loaded.scene.name);
    let plan = try_plan(loaded, settings, seed).unwrap_or_else(|failure| panic!("{which}: {failure}"));
    let strict = CheckSettings { meeting_tolerance: 0.0, ..CheckSettings::default() };
    let report = loaded.judge(&loaded.in_hand(seed), &plan, &strict);
    assert!(report.accepted(), "{which}: {:#?}", report.violations);
    assert_eq!(validate_once(&loaded.view(), &plan, settings), Ok(()), "{which}");
    let mut back = plan.clone();
    back.segments.reverse();
    back.segments.iter_mut().for_each(|segment| segment.waypoints.reverse());
    assert_eq!(validate_once(&loaded.view(), &back, settings), Ok(()), "{which}, backwards");
    plan
}

fn n_holding(waypoint: &Waypoint) -> usize {
    waypoint.contacts.iter().filter(|contact| contact.mode != ContactMode::Free).count()
}

/// Least number of fingers that hold while the object moves.
fn least_holding(plan: &Plan) -> usize {
    let transfers = plan.segments.iter().filter(|segment| segment.moving_finger.is_none());
    transfers.flat_map(|segment| &segment.waypoints).map(n_holding).min().unwrap_or(usize::MAX)
}

#[test]
fn as_many_fingers_hold_as_the_setting_says() {
    let mut fewest = usize::MAX;
    for (name, n_fingers) in [("six_finger_sphere_90x.toml", 6), ("six_finger_box_90x.toml", 6), ("box_180x.toml", 4)] {
        let loaded = scene(name);
        for wanted in [n_fingers, n_fingers - 1, 3] {
            let found: Vec<Plan> = (0..8).map(|seed| plan(&loaded, &eager(wanted), seed)).collect();
            let least = found.iter().map(least_holding).min().unwrap();
            assert!(least >= wanted, "{name}: {least} fingers hold, at least {wanted} must");
            let n_free: u64 = found.iter().map(|plan| plan.statistics.transfers_with_free_fingers).sum();
            assert_eq!(n_free > 0, least < n_fingers, "{name}: {n_free} transfers with free fingers");
            fewest = fewest.min(least);
        }
    }
    assert_eq!(fewest, 3, "the box is turned by three fingers now and then");
}

#[test]
fn plans_with_free_fingers_are_the_same_on_any_number_of_threads() {
    let loaded = scene("box_90x.toml");
    for seed in 0..2 {
        let one = plan(&loaded, &eager(3), seed);
        assert!(one == plan(&loaded, &InHandSettings { n_threads: 3, ..eager(3) }, seed), "seed {seed}");
    }
}

#[test]
fn mutants_of_plans_with_free_fingers_are_rejected() {
    let loaded = scene("box_180x.toml");
    let mut names = BTreeSet::new();
    for seed in 0..6 {
        let plan = plan(&loaded, &eager(3), seed);
        let query = loaded.task().query(seed);
        for mutant in mutants(&plan, loaded.manipulation(), &mut Rng::keyed(seed, "free fingers", 0)) {
            let judged_in = mutant.scene.as_ref().unwrap_or(&loaded.scene);
            let report = check((judged_in, &loaded.state), Some(&query), &mutant.plan, &CheckSettings::default());
            let fits = report.violations.iter().any(|violation| mutant.expected.contains(&violation.kind));
            assert!(fits, "seed {seed}, {}: {report:#?}", mutant.name);
            names.insert(mutant.name);
        }
    }
    for wanted in [
        "finger declared free whom the others need",
        "free finger touches the object",
        "finger declared holding that is away",
        "free finger holds for a moment",
    ] {
        assert!(names.contains(wanted), "{wanted} is not among {names:?}");
    }
}

#[test]
fn two_soft_fingers_roll_an_object_by_a_transfer_alone() {
    let loaded = scene("soft_pair_roll.toml");
    // Not turning about the normals leaves few ways, and some seeds find none.
    let mut n_plans = 0;
    for seed in 0..8 {
        let settings = InHandSettings::default();
        if try_plan(&loaded, &settings, seed).is_err() {
            continue;
        }
        n_plans += 1;
        let plan = plan(&loaded, &settings, seed);
        assert!(plan.segments.iter().all(|segment| segment.moving_finger.is_none()), "seed {seed}");
    }
    assert!(n_plans >= 4, "{n_plans} of 8 seeds");
}

#[test]
fn what_a_transfer_alone_cannot_do_is_refused_after_a_search() {
    let mut loaded = scene("soft_pair_roll.toml");
    // Out of reach of both fingers.
    let mut query = loaded.in_hand(0);
    query.world_from_object_goal.translation.z += 0.08;
    let settings = InHandSettings::default();
    let found = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(3_000_000), &|_| {});
    let failure = found.expect_err("no transfer leads there");
    assert_eq!(failure.kind, FailureKind::Impossible);
    for words in ["can never change its grasp", "no transfer alone was found", "degrees"] {
        assert!(failure.message.contains(words), "{words} is missing: {}", failure.message);
    }
    assert!(failure.nearest_miss.is_some() && !failure.causes.is_empty());
    // Two hard fingertips hold nothing at all: no search.
    let hard = regrasp_robot::ContactModel::Point;
    loaded.scene.hands[0].hand.fingers.iter_mut().for_each(|finger| finger.tip.contact = hard);
    let failure = try_plan(&loaded, &settings, 0).expect_err("nothing holds");
    assert_eq!((failure.kind, failure.statistics.work), (FailureKind::Impossible, 0));
    assert!(failure.message.contains("all of them together cannot hold"), "{}", failure.message);
}

#[test]
fn a_failure_names_the_fingers_that_could_never_be_released() {
    // Three fingers so little soft that two of them never have the margin, which three have.
    let mut loaded = scene("box_90x.toml");
    loaded.scene.hands[0].hand.fingers.truncate(3);
    let soft = regrasp_robot::ContactModel::SoftFinger { torsion_radius: 0.0005 };
    loaded.scene.hands[0].hand.fingers.iter_mut().for_each(|finger| finger.tip.contact = soft);
    let settings = InHandSettings {
        physics: PhysicsSettings { closure_margin: 0.02, ..PhysicsSettings::default() },
        ..InHandSettings::default()
    };
    let query = loaded.in_hand(0);
    let found = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(60_000), &|_| {});
    let failure = found.expect_err("no finger can be released");
    assert_eq!(failure.kind, FailureKind::WorkSpent);
    for words in ["fingers that can never lift", "\"east\"", "hold in none of", "nearest: margin", "of 0.02", "degrees"]
    {
        assert!(failure.message.contains(words), "{words} is missing: {}", failure.message);
    }
}
