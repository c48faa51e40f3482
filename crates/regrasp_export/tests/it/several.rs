//! MuJoCo models of a scene of two hands, two objects and a support.

use crate::mjcf::values;
use crate::two_hands::SCENE;
use regrasp_base::Budget;
use regrasp_export::{Mjcf, to_mjcf};
use regrasp_geometry::Pose;
use regrasp_plan::Plan;
use regrasp_planners::{PlannerSettings, plan};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use std::collections::BTreeSet;
use std::path::Path;

fn load(text: &str) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let hand = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/wide_four_finger/hand.toml");
    let path = folder.path().join("two_hands.toml");
    let name = format!("{:?}", hand.canonicalize().unwrap().display().to_string());
    std::fs::write(&path, text.replace("\"hand.toml\"", &name)).unwrap();
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn planned(loaded: &LoadedScene, task: &str) -> (Plan, Mjcf) {
    let task = loaded.task_named(task).expect("a task of the scene");
    let world = (&loaded.scene, &loaded.state);
    let (settings, budget) = (PlannerSettings::default(), Budget::work(3_000_000));
    let plan =
        plan(world, &task.query(0), &settings, 0, &budget, &|_| {}).unwrap_or_else(|failure| panic!("{failure}"));
    let model = to_mjcf(&loaded.manipulation_of(task), &plan).expect("a plan of this scene");
    (plan, model)
}

fn numbers(text: &str) -> Vec<f64> {
    text.split(' ').map(|number| number.parse().expect("a number")).collect()
}

fn coordinates(pose: &Pose) -> [f64; 7] {
    let q = pose.rotation.coords;
    let [x, y, z]: [f64; 3] = pose.translation.vector.into();
    [x, y, z, q.w, q.x, q.y, q.z]
}

#[test]
fn the_whole_scene_is_there_and_every_name_is_one_of_its_own() {
    let loaded = load(SCENE);
    for task in ["turn_ball", "turn_box"] {
        let (_, Mjcf { xml, .. }) = planned(&loaded, task);
        for kind in ["body", "joint", "geom", "site", "motor", "position", "mesh", "weld", "touch"] {
            let names = values(&xml, kind, "name");
            assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len(), "{task}: two {kind} share a name");
        }
        let bodies = values(&xml, "body", "name");
        for name in ["right/palm", "left/palm", "ball/object", "box/object"] {
            assert!(bodies.contains(&name), "{task}: no body {name} in {bodies:?}");
        }
        let geoms = values(&xml, "geom", "name");
        for name in ["support:table", "obstacle:lamp", "right/east:tip", "left/east:tip"] {
            assert!(geoms.contains(&name), "{task}: no geom {name} in {geoms:?}");
        }
        assert_eq!(values(&xml, "freejoint", "name"), ["ball/object", "box/object"]);
    }
}

#[test]
fn the_hand_of_the_plan_has_motors_and_servos_hold_the_other() {
    let loaded = load(SCENE);
    let names = loaded.scene.hands[0].hand.joint_names();
    let n = names.len();
    for (task, moved) in [("turn_ball", 0), ("turn_box", 1)] {
        let (plan, Mjcf { xml, .. }) = planned(&loaded, task);
        let prefixed = |hand: &str| -> Vec<String> { names.iter().map(|name| format!("{hand}/{name}")).collect() };
        let [hand, other] = [&loaded.scene.hands[moved].name, &loaded.scene.hands[1 - moved].name];
        assert_eq!(values(&xml, "motor", "joint"), prefixed(hand));
        assert_eq!(values(&xml, "position", "joint"), prefixed(other));
        let waypoints: Vec<_> = plan.segments.iter().flat_map(|segment| &segment.waypoints).collect();
        let (qpos, ctrl) = (values(&xml, "key", "qpos"), values(&xml, "key", "ctrl"));
        assert_eq!((qpos.len(), ctrl.len()), (waypoints.len(), waypoints.len()));
        for (k, waypoint) in waypoints.iter().enumerate() {
            let (qpos, ctrl) = (numbers(qpos[k]), numbers(ctrl[k]));
            assert_eq!((qpos.len(), ctrl.len()), (2 * n + 14, 2 * n));
            // What moves is where the plan has it, what rests is where the scene has it.
            let at_rest = &loaded.state.hand_joints[1 - moved];
            assert_eq!(qpos[moved * n..(moved + 1) * n], waypoint.joints);
            assert_eq!(qpos[(1 - moved) * n..(2 - moved) * n], *at_rest);
            assert_eq!(ctrl[moved * n..(moved + 1) * n], waypoint.joint_torques);
            assert_eq!(ctrl[(1 - moved) * n..(2 - moved) * n], *at_rest);
            let object = 2 * n + 7 * moved;
            assert_eq!(qpos[object..object + 3], waypoint.world_from_object.position);
            let other = 2 * n + 7 * (1 - moved);
            assert_eq!(qpos[other..other + 7], coordinates(&loaded.state.world_from_objects[1 - moved]));
        }
    }
}

#[test]
fn an_object_that_nothing_holds_is_pinned_and_one_on_a_support_stands() {
    let (_, model) = planned(&load(SCENE), "turn_ball");
    assert_eq!(values(&model.xml, "weld", "name"), ["ball/pin", "box/pin"]);
    assert_eq!(values(&model.xml, "weld", "active"), ["false", "true"]);
    let [note] = &model.notes[..] else { panic!("{:?}", model.notes) };
    assert!(note.contains("\"box\" stands on no support") && note.contains("box/pin"), "{note}");
    let on_table = |xml: &str| {
        let pairs = values(xml, "pair", "geom1").into_iter().zip(values(xml, "pair", "geom2"));
        pairs
            .filter(|pair| *pair == ("box/object", "support:table") || *pair == ("support:table", "box/object"))
            .count()
    };
    assert_eq!(on_table(&model.xml), 0, "what is pinned does not collide with what is fixed");

    // Half of the box is 30 mm and half of the table 10 mm.
    let standing = SCENE.replace(
        "position = [0.5, -0.07488, 0.07184]\nquat_xyzw = [0.6, 0.0, 0.0, 0.8]",
        "position = [0.25, 0.3, -0.16]",
    );
    assert_ne!(standing, SCENE);
    let start = "start = { position = [0.5, -0.07488, 0.07184], quat_xyzw = [0.6, 0.0, 0.0, 0.8] }\n";
    let standing = standing.replace("object = \"box\"\n", &format!("object = \"box\"\n{start}"));
    let (_, model) = planned(&load(&standing), "turn_ball");
    assert_eq!(values(&model.xml, "weld", "active"), ["false", "false"]);
    assert_eq!(model.notes, Vec::<String>::new());
    assert_eq!(on_table(&model.xml), 1);

    // Below the table, touching it, it would fall.
    let hanging = standing.replace("[0.25, 0.3, -0.16]", "[0.25, 0.3, -0.24]");
    let (_, model) = planned(&load(&hanging), "turn_ball");
    assert_eq!(values(&model.xml, "weld", "active"), ["false", "true"]);
}
