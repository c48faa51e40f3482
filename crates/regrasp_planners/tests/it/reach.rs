//! How far tips may be from where they rest, and what is said where nothing is found.

use crate::in_hand_methods::scene;
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_plan::check::CheckSettings;
use regrasp_planners::FailureKind;
use regrasp_planners::in_hand::PhysicsSettings;
use regrasp_planners::in_hand::{InHandSettings, Progress, plan_in_hand};
use regrasp_scene::{GraspRequest, InHandQuery, LoadedScene};
use std::sync::Mutex;

fn within(name: &str, reach: f64) -> LoadedScene {
    let mut loaded = scene(&format!("{name}.toml"));
    loaded.scene.hands[0].reach = Some(reach);
    loaded
}

/// Tips of the wide hand go up to 60 mm for these turns where nothing holds them back.
#[test]
fn plans_keep_the_reach_of_the_scene_and_are_accepted() {
    for (name, reach) in [("sphere_180z", 0.04), ("sphere_180z", 0.05), ("box_90x", 0.05), ("six_finger_box_90x", 0.06)]
    {
        let loaded = within(name, reach);
        let mut n_plans = 0;
        for seed in 0..6 {
            let query = loaded.in_hand(seed);
            let settings = InHandSettings::default();
            let found = plan_in_hand(&loaded.view(), &query, &settings, seed, &Budget::work(400_000), &|_| {});
            let Ok(plan) = found else { continue };
            n_plans += 1;
            let report = loaded.judge(&query, &plan, &CheckSettings::default());
            assert!(report.accepted(), "{name}, reach {reach}, seed {seed}: {:#?}", report.violations);
        }
        assert!(n_plans >= 4, "{name}, reach {reach}: {n_plans} of 6 seeds");
    }
}

#[test]
fn an_object_out_of_reach_is_refused_before_the_search() {
    let loaded = within("sphere_180z", 0.002);
    let query = loaded.in_hand(0);
    let settings = InHandSettings::default();
    let failure = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(100_000), &|_| {}).unwrap_err();
    assert_eq!(failure.kind, FailureKind::StartInvalid);
    assert_eq!(failure.statistics.work, 0);
    assert!(failure.message.contains("reach of 0.002 m that the scene allows"), "{failure}");
}

#[test]
fn a_given_grasp_out_of_reach_is_refused_before_the_search() {
    let mut loaded = scene("sphere_180z.toml");
    let (query, settings) = (loaded.in_hand(0), InHandSettings::default());
    let plan = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(400_000), &|_| {}).unwrap();
    let joints = plan.segments[0].waypoints[0].joints.clone();
    let query = InHandQuery { start_grasp: GraspRequest::Joints(joints), ..query };
    // The least reach, by millimetres, with which fingers can touch the sphere somewhere is not enough for this grasp.
    let failure = (20..60).find_map(|millimetres| {
        loaded.scene.hands[0].reach = Some(1e-3 * f64::from(millimetres));
        let found = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(100_000), &|_| {});
        found.err().filter(|failure| !failure.message.contains("fingers can touch"))
    });
    let failure = failure.expect("a reach that lets fingers touch and not hold like this");
    assert_eq!((failure.kind, failure.statistics.work), (FailureKind::StartInvalid, 0), "{failure}");
    assert!(failure.message.contains("m from where it rests, its reach is 0.03"), "{failure}");
}

#[test]
fn what_is_advised_is_what_was_short_and_friction_is_that_of_the_scene() {
    let loaded = scene("sphere_180z.toml");
    let query = loaded.in_hand(0);
    let settings = InHandSettings::default();
    let spent = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(0), &|_| {}).unwrap_err();
    assert!(spent.advice.contains("more work") && !spent.advice.contains("time"), "{}", spent.advice);
    let now = Budget::work(100_000).with_deadline(std::time::Instant::now());
    let late = plan_in_hand(&loaded.view(), &query, &settings, 0, &now, &|_| {}).unwrap_err();
    assert!(late.advice.contains("more time"), "{}", late.advice);
    let plan = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(400_000), &|_| {}).unwrap();
    let joints = plan.segments[0].waypoints[0].joints.clone();
    let query = InHandQuery { start_grasp: GraspRequest::Joints(joints), ..query };
    let strict = InHandSettings { physics: PhysicsSettings { closure_margin: 0.9, ..settings.physics }, ..settings };
    let failure = plan_in_hand(&loaded.view(), &query, &strict, 0, &Budget::work(1000), &|_| {}).unwrap_err();
    assert!(failure.message.ends_with("at friction 0.8 of the scene over a margin of 1.5"), "{failure}");
}

/// Before anything is reached, what is left is the turn asked for.
#[test]
fn progress_says_no_more_than_the_turn_asked_for() {
    let loaded = scene("out_of_reach.toml");
    let query = loaded.in_hand(0);
    let asked = query.world_from_object_start.rotation.angle_to(&query.world_from_object_goal.rotation);
    let seen = Mutex::new(Vec::new());
    let note = |progress: Progress| seen.lock().unwrap().push(progress.angle_left);
    let _ = plan_in_hand(&loaded.view(), &query, &InHandSettings::default(), 0, &Budget::work(100_000), &note);
    let seen = seen.into_inner().unwrap();
    assert!(!seen.is_empty() && seen.iter().all(|left| *left <= asked + 1e-9), "{seen:?} of {asked}");
}

/// A mesh of ten thousand triangles so thin that fingertips hardly fit: drawing contacts is what takes the time, and work counts it.
#[test]
fn work_counts_draws_of_contacts_that_do_not_fit() {
    let mut loaded = scene("sphere_90x.toml");
    loaded.scene.objects[0] = thin_object();
    let query = loaded.in_hand(0);
    let settings = InHandSettings { n_threads: 1, ..InHandSettings::default() };
    let max_work = 2_000;
    let found = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(max_work), &|_| {});
    let statistics = found.map_or_else(|failure| failure.statistics, |plan| plan.statistics);
    let work = statistics.work;
    assert!(work < 2 * max_work, "{work} units of {max_work}");
    // One place at which a finger finds no contact costs hundreds of draws.
    let n_vain = statistics.failures.get("no_contact").copied().unwrap_or(0);
    assert!(n_vain > 0 && work >= 100 * n_vain, "{work} units for {n_vain} places without a contact");
}

/// A flat, finely corrugated plate: every ball of a fingertip's size slides from groove to groove.
fn thin_object() -> regrasp_scene::Object {
    let folder = tempfile::tempdir().unwrap();
    let (n, pitch, depth) = (70usize, 0.0006, 0.0008);
    let mut text = String::new();
    for side in [0.0, 1.0] {
        for i in 0..=n {
            for j in 0..=n {
                let [x, y] = [i, j].map(|k| (k as f64 - n as f64 / 2.0) * pitch);
                let wave = if (i + j) % 2 == 0 { 0.0 } else { depth };
                let z = if side == 0.0 { -0.002 - wave } else { 0.002 + wave };
                text += &format!("v {x} {y} {z}\n");
            }
        }
    }
    let at = |side: usize, i: usize, j: usize| 1 + side * (n + 1) * (n + 1) + i * (n + 1) + j;
    let mut quad = |a: usize, b: usize, c: usize, d: usize| text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    for i in 0..n {
        for j in 0..n {
            quad(at(1, i, j), at(1, i + 1, j), at(1, i + 1, j + 1), at(1, i, j + 1));
            quad(at(0, i, j), at(0, i, j + 1), at(0, i + 1, j + 1), at(0, i + 1, j));
        }
        quad(at(0, i, 0), at(0, i + 1, 0), at(1, i + 1, 0), at(1, i, 0));
        quad(at(0, i, n), at(1, i, n), at(1, i + 1, n), at(0, i + 1, n));
        quad(at(0, 0, i), at(1, 0, i), at(1, 0, i + 1), at(0, 0, i + 1));
        quad(at(0, n, i), at(0, n, i + 1), at(1, n, i + 1), at(1, n, i));
    }
    std::fs::write(folder.path().join("plate.obj"), text).unwrap();
    let hand = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/hands/wide_four_finger/hand.toml");
    let scene = format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\nfile = \"{hand}\"\n\
         [object]\nname = \"plate\"\nmesh = {{ file = \"plate.obj\" }}\nmass = 0.1\nfriction = 0.8\n\
         [start]\nposition = [0.0, 0.0, 0.078]\n[goal]\nturn = {{ axis = \"x\", angle_deg = 90 }}\n"
    );
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let options = regrasp_robot::LoadOptions::default();
    regrasp_scene::load_scene(&folder.path().join("scene.toml"), &options).unwrap().scene.objects.remove(0)
}
