//! Double grasps, and lists of other tools.

use crate::sample::{bundled, check, list, settings};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_grasp::list::{ForeignGrasps, GraspList, ListedGrasp};
use regrasp_grasp_lists::import::import_grasps;
use regrasp_grasp_lists::pairs::{Context, Side, pair_grasps};
use regrasp_scene::GraspScene;

fn side<'a>(scene: &'a GraspScene, list: &'a GraspList, context: &'a Context) -> Side<'a> {
    Side { hand: &scene.scene.hands[0].hand, object: &scene.scene.objects[0], list, context }
}

#[test]
fn hands_that_hit_each_other_or_the_surroundings_are_no_pair() {
    let (wide, long) = (bundled("wide_four_finger", "pencil.toml"), bundled("parallel_gripper", "pencil.toml"));
    let first = list(&wide, &settings(12), 1).unwrap();
    let gripper = regrasp_grasp_lists::GraspSettings {
        kind: regrasp_grasp::list::GraspKind::Gripper,
        frames: 20_000,
        ..settings(12)
    };
    let second = list(&long, &gripper, 1).unwrap();
    let anywhere = Context { robot_base: Some(Point::new(-1.0, 0.0, 0.0)), ..Context::default() };
    let free = pair_grasps(&side(&wide, &first, &anywhere), &side(&long, &second, &anywhere), 2).unwrap();
    assert_eq!(free.clear, [first.grasps.len(), second.grasps.len()]);
    assert_eq!(free.pairs.len() + free.hands_touch, first.grasps.len() * second.grasps.len());
    assert!(free.hands_touch > 0, "some hands are in each other's way");
    assert!(free.pairs.windows(2).all(|two| two[0].score >= two[1].score));
    for pair in &free.pairs {
        let scores = [first.grasps[pair.first].score, second.grasps[pair.second].score];
        assert_eq!(pair.quality, scores[0].min(scores[1]));
        assert!((-1.0..=1.0).contains(&pair.robot));
    }
    // The same hand twice at the same grasp is in its own way.
    let itself = pair_grasps(&side(&wide, &first, &anywhere), &side(&wide, &first, &anywhere), 1).unwrap();
    assert!(itself.pairs.iter().all(|pair| pair.first != pair.second));
    // Everything is in a wall.
    let wall = PlacedShape {
        parent_from_shape: Pose::identity(),
        shape: Shape::Cuboid { half_extents: Vector::new(2.0, 2.0, 2.0) },
    };
    let walled = Context { surroundings: vec![wall], ..Context::default() };
    let none = pair_grasps(&side(&wide, &first, &walled), &side(&long, &second, &anywhere), 1).unwrap();
    assert_eq!((none.clear, none.pairs.len()), ([0, second.grasps.len()], 0));
    let other = bundled("parallel_gripper", "box_90x.toml");
    let boxed = list(&other, &gripper, 1).unwrap();
    assert!(pair_grasps(&side(&wide, &first, &anywhere), &side(&other, &boxed, &anywhere), 1).is_err());
}

#[test]
fn grasps_of_other_tools_get_their_contacts_by_closing() {
    let scene = bundled("wide_four_finger", "box_90x.toml");
    let ours = list(&scene, &settings(12), 2).unwrap();
    let (hand, object) = (&scene.scene.hands[0].hand, &scene.scene.objects[0]);
    let mut foreign = ForeignGrasps::from(&ours);
    let imported = import_grasps(hand, object, &foreign, &settings(12)).unwrap();
    assert_eq!(imported.dropped, []);
    let read = GraspList { inputs: ours.inputs.clone(), ..imported.list };
    let report = check(&scene, &read);
    assert!(report.accepted(), "{:?}", report.violations.first());
    for grasp in &read.grasps {
        // Poses go through the frame of a link: they come back but for rounding.
        let apart = |one: &ListedGrasp| {
            let poses = one.object_from_hand.numbers().zip(grasp.object_from_hand.numbers());
            let joints = one.joints.iter().copied().zip(grasp.joints.iter().copied());
            poses.chain(joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let nearest = ours.grasps.iter().map(apart).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-6, "{nearest}");
    }
    // Fingers that press in, as grasps of generators do, come out again; a hand in the object is dropped.
    for grasp in &mut foreign.grasps {
        let open = grasp.open_joints.clone().unwrap();
        for (name, position) in &mut grasp.joints {
            *position += 0.05 * (*position - open[name]);
        }
    }
    foreign.grasps[0].object_from_link.position = object.center_of_mass.into();
    let imported = import_grasps(hand, object, &foreign, &settings(12)).unwrap();
    assert!(
        imported.dropped.iter().any(|one| one.name == "grasp_0" && one.reason.contains("palm")),
        "{:?}",
        imported.dropped
    );
    assert!(imported.list.grasps.len() >= 9, "{:?}", imported.dropped);
    let report = check(&scene, &GraspList { inputs: ours.inputs.clone(), ..imported.list });
    assert!(report.accepted(), "{:?}", report.violations.first());
    foreign.grasps[1].joints.insert("elbow".into(), 0.0);
    let failure = import_grasps(hand, object, &foreign, &settings(12)).unwrap_err();
    assert!(failure.message.contains("no joint \"elbow\""), "{failure}");
    foreign.hand_link = "nowhere".into();
    assert!(import_grasps(hand, object, &foreign, &settings(12)).unwrap_err().message.contains("no link \"nowhere\""));
}
