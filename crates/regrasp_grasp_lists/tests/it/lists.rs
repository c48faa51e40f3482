//! Lists are accepted, the same on any number of threads, and end with a reason where there is no grasp.

use crate::sample::{bundled, check, list, settings, with_horse};
use regrasp_base::Budget;
use regrasp_grasp::list::format::to_json;
use regrasp_grasp_lists::{FailureKind, GraspSettings, list_grasps};

#[test]
fn the_checker_accepts_every_grasp() {
    for (hand, object) in [
        ("wide_four_finger", "box_90x.toml"),
        ("wide_four_finger", "sphere_90x.toml"),
        ("wide_four_finger", "pencil.toml"),
        ("six_finger", "six_finger_box_90x.toml"),
    ] {
        let scene = bundled(hand, object);
        let list = list(&scene, &settings(15), 1).unwrap_or_else(|failure| panic!("{hand} {object}: {failure}"));
        let report = check(&scene, &list);
        assert!(report.accepted(), "{hand} {object}: {:?}", report.violations.first());
        assert_eq!(report.n_grasps, list.grasps.len());
        assert!(list.grasps.len() >= 5, "{hand} {object}: {}", list.grasps.len());
        assert!(list.grasps.windows(2).all(|pair| pair[0].score >= pair[1].score), "best score first");
        assert!(list.grasps.iter().all(|grasp| grasp.margin >= list.promises.required_margin));
    }
}

/// Large fingertips that slide open by centimetres swept through the folds of the horse between looks.
#[test]
fn large_fingertips_open_beside_folds() {
    let scene = with_horse("four_fingertips");
    let list = list(&scene, &settings(100), 0).unwrap();
    let report = check(&scene, &list);
    assert!(report.accepted(), "{:?}", report.violations.first());
    assert_eq!(list.grasps.len(), 100);
}

#[test]
fn threads_change_nothing_and_seeds_do() {
    let scene = bundled("wide_four_finger", "box_90x.toml");
    let with = |n_threads: usize, seed: u64| {
        let settings = GraspSettings { n_threads, ..settings(10) };
        to_json(&list(&scene, &settings, seed).unwrap())
    };
    let one = with(1, 5);
    assert_eq!(one, with(2, 5));
    assert_eq!(one, with(8, 5));
    assert_ne!(one, with(2, 6));
}

#[test]
fn no_grasp_is_a_failure_with_causes_and_the_nearest_miss() {
    let scene = bundled("wide_four_finger", "box_90x.toml");
    let demanding = GraspSettings { margin: 0.9, frames: 2_000, ..settings(10) };
    let failure = list(&scene, &demanding, 0).unwrap_err();
    assert!(failure.message.contains("the best contacts seen have margin 0."), "{failure}");
    assert!(failure.causes.iter().any(|cause| cause.reason.contains("do not close")), "{:?}", failure.causes);
    let (hand, object) = (&scene.scene.hands[0].hand, &scene.scene.objects[0]);
    let none = list_grasps(hand, object, &settings(10), 0, &Budget::work(0)).unwrap_err();
    assert_eq!(none.kind, FailureKind::WorkSpent);
    let bad = GraspSettings { friction_margin: f64::NAN, ..settings(10) };
    assert_eq!(
        list_grasps(hand, object, &bad, 0, &Budget::unlimited()).unwrap_err().kind,
        FailureKind::SettingsInvalid
    );
}

#[test]
fn a_caller_who_stops_the_search_gets_a_list_that_says_so() {
    let scene = bundled("wide_four_finger", "box_90x.toml");
    let (hand, object) = (&scene.scene.hands[0].hand, &scene.scene.objects[0]);
    let budget = Budget::unlimited();
    let stop = |progress: regrasp_grasp_lists::Progress| {
        if progress.found > 0 {
            budget.cancelled.store(true, std::sync::atomic::Ordering::Relaxed);
        }
    };
    let many = settings(100_000);
    let cut = regrasp_grasp_lists::list_grasps_telling(hand, object, &many, 0, &budget, &stop).unwrap();
    assert!(cut.statistics.cut_by_time && !cut.grasps.is_empty() && cut.grasps.len() < 100_000);
    let cut = regrasp_grasp::GraspList { inputs: list(&scene, &settings(1), 0).unwrap().inputs, ..cut };
    let report = check(&scene, &regrasp_grasp::GraspList { grasps: cut.grasps[..5].to_vec(), ..cut });
    assert!(report.accepted(), "{:?}", report.violations.first());
}

/// Refinement raises margins; the other terms of the score, together, do not fall.
#[test]
fn refinement_raises_margins_and_lowers_nothing() {
    let scene = bundled("wide_four_finger", "box_90x.toml");
    let with = |refinement_trials: usize| {
        let settings = GraspSettings { refinement_trials, ..settings(30) };
        list(&scene, &settings, 2).unwrap()
    };
    let (plain, refined) = (with(0), with(GraspSettings::default().refinement_trials));
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    let before = sorted(refined.grasps.iter().map(|g| g.margin_before_refinement.unwrap_or(g.margin)).collect());
    let unrefined = sorted(plain.grasps.iter().map(|g| g.margin).collect());
    assert_eq!(before, unrefined, "the same grasps");
    let after = sorted(refined.grasps.iter().map(|g| g.margin).collect());
    let gain = after[15] / before[15];
    assert!(gain > 1.2, "{gain}");
    let weights = &GraspSettings::default().weights;
    let others = |list: &regrasp_grasp::GraspList| {
        let of = |scores: &regrasp_grasp::list::Scores| {
            regrasp_grasp::list::Scores { closure: 0.0, ..*scores }.mean(weights)
        };
        list.grasps.iter().map(|grasp| of(&grasp.scores)).sum::<f64>()
    };
    assert!(others(&refined) >= others(&plain) - 1e-6);
    assert!(check(&scene, &refined).accepted());
}

/// More frames show more of what there is.
#[test]
fn more_frames_give_more_grasps() {
    let scene = bundled("wide_four_finger", "pencil.toml");
    let found = |frames: u64| {
        let settings = GraspSettings { frames, refinement_trials: 0, ..settings(1_000) };
        list(&scene, &settings, 0).map_or(0, |list| list.statistics.found)
    };
    let counts = [500, 2_000, 8_000].map(found);
    assert!(counts.windows(2).all(|pair| pair[0] < pair[1]), "{counts:?}");
}
