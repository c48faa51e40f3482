//! Links above the base of a hand that stands by itself: a forearm with a peg that reaches over the object.

use crate::places::repository;
use regrasp_base::Budget;
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::check::{CheckSettings, ViolationKind, check};
use regrasp_planners::{FailureKind, PlannerSettings, plan};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};

/// Where the wrist is held: the limits of its joint leave nothing nearer to zero.
const WRIST: f64 = 0.2;

/// The bundled box turned by 90 degrees about z in the wide hand, which hangs on a wrist. The peg hangs over the point `peg` of the palm, in
/// metres; its lower end is at the height 100 mm, 8 mm below the top of the box.
fn scene(peg: [f64; 2]) -> LoadedScene {
    let assets = repository().join("assets/hands/wide_four_finger");
    let read = |path| std::fs::read_to_string(path).unwrap();
    // The wrist lifts the palm by 100 mm and turns it about z.
    let (sin, cos) = WRIST.sin_cos();
    let in_forearm = [cos * peg[0] - sin * peg[1], sin * peg[0] + cos * peg[1]];
    let above = format!(
        r#"<link name="forearm"><collision><origin xyz="{} {} 0.22"/><geometry><cylinder radius="0.002" length="0.04"/></geometry></collision></link>
<joint name="wrist" type="revolute"><parent link="forearm"/><child link="palm"/><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>
<limit lower="{WRIST}" upper="1" effort="1" velocity="1"/></joint></robot>"#,
        in_forearm[0], in_forearm[1]
    );
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    write("hand.urdf", read(assets.join("hand.urdf")).replace("</robot>", &above));
    write("hand.toml", read(assets.join("hand.toml")));
    let scene = read(repository().join("scenes/box_90x.toml"));
    let scene = scene.replace("../assets/hands/wide_four_finger/", "").replace("axis = \"x\"", "axis = \"z\"");
    write("scene.toml", scene);
    load_scene(&folder.path().join("scene.toml"), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_planner_keeps_clear_of_what_hangs_above_the_base() {
    // The corners of the box reach 35 mm, its sides 25 mm: the peg stands beside them at the start and at the goal, not between.
    let azimuth = 22f64.to_radians();
    let loaded = scene([0.031 * azimuth.cos(), 0.031 * azimuth.sin()]);
    let hand = &loaded.scene.hands[0].hand;
    let peg = hand.palm.iter().find(|shape| hand.robot.links[shape.link.0].name == "forearm").unwrap();
    let expected = Vector::new(0.031 * azimuth.cos(), 0.031 * azimuth.sin(), 0.12);
    let at: &Pose = &peg.placed.parent_from_shape;
    assert!((at.translation.vector - expected).norm() < 1e-12, "{at}");

    let query = loaded.tasks[0].query(0);
    let world = (&loaded.scene, &loaded.state);
    // The same scene with the peg in the way of these plans.
    let other = scene([0.02 * azimuth.cos(), 0.02 * azimuth.sin()]);
    let mut n_plans = 0;
    for seed in 0..4 {
        let budget = Budget::work(2_000_000);
        let Ok(plan) = plan(world, &query, &PlannerSettings::default(), seed, &budget, &|_| {}) else { continue };
        let report = check(world, Some(&query), &plan, &CheckSettings::default());
        assert!(report.accepted(), "seed {seed}: {:#?}", report.violations);
        n_plans += 1;
        let report = check((&other.scene, &other.state), Some(&query), &plan, &CheckSettings::default());
        assert!(report.violations.iter().any(|violation| violation.kind == ViolationKind::Collision), "seed {seed}");
    }
    assert!(n_plans > 0);
}

#[test]
fn an_object_in_the_forearm_is_refused_before_the_search() {
    let loaded = scene([0.0, 0.0]);
    let (world, query) = ((&loaded.scene, &loaded.state), loaded.tasks[0].query(0));
    let failure = plan(world, &query, &PlannerSettings::default(), 0, &Budget::work(2_000_000), &|_| {}).unwrap_err();
    assert_eq!(failure.kind, FailureKind::StartInvalid, "{failure}");
    assert!(failure.to_string().contains("forearm"), "{failure}");
}
