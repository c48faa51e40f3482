//! Fingers of one or two independent joints: they find contacts by closing, hold and let go while the object stands still, and are free
//! while it moves. Hands that cannot turn objects with the other fingers are refused before any search.

use crate::places::shared_models;
use crate::queries::Queries;
use regrasp_base::{Budget, Rng};
use regrasp_geometry::collision::Placement;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::contact::draw_footholds;
use regrasp_manipulation::model::Model;
use regrasp_manipulation::workspace::Workspace;
use regrasp_mutations::mutants;
use regrasp_plan::check::{CheckSettings, ViolationKind, check};
use regrasp_plan::{ContactMode, Plan};
use regrasp_planners::FailureKind;
use regrasp_planners::in_hand::{InHandSettings, Method, plan_in_hand, validate_once};
use regrasp_robot::import::{LoadOptions, ResolveOptions};
use regrasp_robot::kinematics::finger_ik::Coordinates;
use regrasp_scene::{GraspRequest, InHandQuery, LoadedScene, Query, load_scene};
use std::fmt::Write;
use std::path::Path;

const FINGERS: [&str; 4] = ["east", "north", "west", "south"];

/// The wide four-finger hand, with the last joint of some fingers coupled to the one before it: two joints are left to them.
fn wide_hand(coupled: &[&str]) -> String {
    let urdf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/wide_four_finger/hand.urdf");
    let mut text = format!(
        "format = \"regrasp-hand\"\nformat_version = 1\nurdf = {:?}\nbase_link = \"palm\"\n",
        urdf.canonicalize().unwrap()
    );
    for name in coupled {
        let _ = write!(
            text,
            "[[couplings]]\njoint = \"{name}_distal_flexion\"\nleader = \"{name}_proximal_flexion\"\nmultiplier = 0.5\noffset = 1.2\n"
        );
    }
    for name in FINGERS {
        let distal = if coupled.contains(&name) { String::new() } else { format!(", {name}_distal_flexion = 1.2") };
        let _ = write!(
            text,
            "[[fingers]]\nname = \"{name}\"\ntip_link = \"{name}_tip\"\ntip = {{ shape = \"sphere\", radius = 0.005, center = [0, 0, 0] }}\n\
             rest = {{ {name}_abduction = 0.0, {name}_proximal_flexion = -0.8{distal} }}\n"
        );
    }
    text
}

/// A scene of a hand and an object of 0.1 kg at `position`, turned by 90 degrees about `axis`.
fn scene(hand: &str, object: &str, position: [f64; 3], axis: &str) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("hand.toml"), hand).unwrap();
    let text = format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\nfile = \"hand.toml\"\n[object]\nname = \"object\"\n\
         {object}\nmass = 0.1\nfriction = 0.8\n[start]\nposition = {position:?}\n[goal]\nturn = {{ axis = \"{axis}\", angle_deg = 90 }}\n"
    );
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let packages = shared_models().map(|models| ("models".to_owned(), models)).into_iter().collect();
    let resolve = ResolveOptions { packages, search_paths: vec![] };
    let options = LoadOptions { resolve, ..LoadOptions::default() };
    load_scene(&folder.path().join("scene.toml"), &options).unwrap_or_else(|error| panic!("{error}"))
}

const SPHERE: &str = "sphere = { radius = 0.032 }";
const BOX: &str = "box = { size = [0.05, 0.05, 0.05] }";
const IN_WIDE_HAND: [f64; 3] = [0.0, 0.0, 0.078];

fn accepted(loaded: &LoadedScene, query: &InHandQuery, plan: &Plan, settings: &InHandSettings, which: &str) {
    let asked = query.clone().into();
    let report = check((&loaded.scene, &loaded.state), Some(&asked), plan, &CheckSettings::default());
    assert!(report.accepted(), "{which}: {:#?}", report.violations);
    assert_eq!(validate_once(&loaded.view(), plan, settings), Ok(()), "{which}");
}

/// Three hard fingers can never change their grasp: it is the fourth, of two joints, that makes these turns possible.
#[test]
fn a_finger_of_two_joints_holds_while_others_relocate_and_is_free_while_the_object_moves() {
    let settings = InHandSettings::default();
    let mut n_holds = 0;
    for (object, axis) in [(SPHERE, "x"), (SPHERE, "z"), (BOX, "z")] {
        let loaded = scene(&wide_hand(&["south"]), object, IN_WIDE_HAND, axis);
        for seed in 0..2 {
            let which = format!("{object}, {axis}, seed {seed}");
            let query = loaded.in_hand(seed);
            let plan = plan_in_hand(&loaded.view(), &query, &settings, seed, &Budget::work(10_000_000), &|_| {})
                .unwrap_or_else(|failure| panic!("{which}: {failure}"));
            accepted(&loaded, &query, &plan, &settings, &which);
            for segment in &plan.segments {
                let is_free = |index: usize| segment.waypoints[index].contacts[3].mode == ContactMode::Free;
                let last = segment.waypoints.len() - 1;
                let moves = segment.waypoints[0].world_from_object != segment.waypoints[last].world_from_object;
                assert!(!moves || (is_free(0) && is_free(last)), "{which}: held while the object moved");
                n_holds += usize::from(!moves && segment.moving_finger.as_deref() != Some("south") && !is_free(0));
            }
            if seed == 0 {
                let asked = query.clone().into();
                for mutant in mutants(&plan, loaded.manipulation(), &mut Rng::keyed(seed, "closing fingers", 0)) {
                    let scene = mutant.scene.as_ref().unwrap_or(&loaded.scene);
                    let report = check((scene, &loaded.state), Some(&asked), &mutant.plan, &CheckSettings::default());
                    let fits = report.violations.iter().any(|violation| mutant.expected.contains(&violation.kind));
                    assert!(fits, "{which}, {}: {report:#?}", mutant.name);
                }
            }
        }
    }
    assert!(n_holds > 0, "the finger of two joints never held while another one relocated");
}

/// Contacts found by closing, against the closed form of the ball's surface and a plain look at the box.
#[test]
fn contacts_by_closing_lie_where_the_tip_touches() {
    for object in [SPHERE, BOX] {
        let loaded = scene(&wide_hand(&FINGERS), object, IN_WIDE_HAND, "x");
        let view = loaded.view();
        let settings = InHandSettings::default();
        let model = Model::new(&view, &settings.physics);
        assert_eq!(model.closing_fingers(), 0b1111);
        let pose = loaded.in_hand(0).world_from_object_start;
        let placement = Placement::from(&pose);
        let mut workspace = Workspace::new(&model);
        workspace.place_object(&pose);
        let mut rng = Rng::keyed(1, "closing contacts", 0);
        for finger in 0..4 {
            let mut n_found = 0;
            let mut look = |contact: Contact, joints: Coordinates| {
                n_found += 1;
                let tip = pose.inverse() * model.fingers[finger].ik.tip(&joints);
                let distance = match object {
                    SPHERE => tip.coords.norm() - 0.032,
                    _ => tip.coords.map(|c| (c.abs() - 0.025).max(0.0)).norm(),
                };
                assert!((distance - 0.005).abs() < 1e-7, "{object}: {distance}");
                let back = tip - contact.normal_in_object.into_inner() * 0.005;
                assert!((back - contact.point_in_object).norm() < 1e-7);
            };
            for _ in 0..20 {
                draw_footholds(&mut workspace, finger, &placement, 4, &mut rng, &mut look);
            }
            assert!(n_found >= 10, "{object}, finger {finger}: {n_found}");
        }
    }
}

#[test]
fn hands_that_cannot_turn_objects_are_refused_before_any_search() {
    let loaded = scene(&wide_hand(&["south", "west"]), SPHERE, IN_WIDE_HAND, "x");
    let (query, settings) = (loaded.in_hand(0), InHandSettings::default());
    let budget = Budget::work(1_000_000);
    let failure = plan_in_hand(&loaded.view(), &query, &settings, 0, &budget, &|_| {}).unwrap_err();
    assert_eq!((failure.kind, failure.statistics.work), (FailureKind::Impossible, 0));
    assert_eq!(
        failure.message,
        "the hand cannot turn objects: a fingertip needs three independent joints that move it in three directions to follow a turning \
         object. Of its 4 fingers 2 can, and cannot hold an object without the others: \"east\" has 3, \"north\" has 3, \"west\" has 2, \
         \"south\" has 2"
    );
    // Whether it can hold the object is another question.
    let held = query.held();
    let plan = plan_in_hand(&loaded.view(), &held, &settings, 0, &budget, &|_| {}).unwrap();
    accepted(&loaded, &held, &plan, &settings, "hold");
    // In methods of papers all fingers hold while the object moves.
    let loaded = scene(&wide_hand(&["south"]), SPHERE, IN_WIDE_HAND, "x");
    let settings = InHandSettings { method: Method::Visibility, ..settings };
    let failure = plan_in_hand(&loaded.view(), &loaded.in_hand(0), &settings, 0, &budget, &|_| {}).unwrap_err();
    assert!(failure.message.starts_with("all fingers are to hold while the object moves"), "{failure}");
}

/// A grasp that was observed with encoders that are off by a milliradian: every finger comes to touch nearby.
#[test]
fn a_given_grasp_of_closing_fingers_is_taken() {
    let loaded = scene(&wide_hand(&FINGERS), SPHERE, IN_WIDE_HAND, "x");
    let (settings, budget) = (InHandSettings::default(), Budget::work(1_000_000));
    let held = loaded.in_hand(0).held();
    let plan = plan_in_hand(&loaded.view(), &held, &settings, 0, &budget, &|_| {}).unwrap();
    let first = &plan.segments[0].waypoints[0];
    let holds: Vec<bool> = first.contacts.iter().map(|contact| contact.mode != ContactMode::Free).collect();
    for off in [0.0, 1e-3, -1e-3] {
        let joints: Vec<f64> = first.joints.iter().map(|joint| joint + off).collect();
        let given = InHandQuery {
            start_grasp: GraspRequest::Posture { joints: joints.clone(), holds: holds.clone() },
            ..held.clone()
        };
        let plan = plan_in_hand(&loaded.view(), &given, &settings, 1, &budget, &|_| {})
            .unwrap_or_else(|failure| panic!("{off}: {failure}"));
        accepted(&loaded, &given, &plan, &settings, "given grasp");
        let found = &plan.segments[0].waypoints[0].joints;
        assert!(found.iter().zip(&joints).all(|(a, b)| (a - b).abs() < 0.02), "{off}: {found:?} {joints:?}");
    }
}

/// A hand of nine motors and twenty joints, coupled within and across fingers: spread and opposition are held, the rest closes.
#[test]
fn a_hand_of_nine_motors_holds_and_is_told_that_it_cannot_turn() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/nine_motors/hand.urdf");
    let hand = regrasp_robot::load_hand(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")).hand;
    let mut held: Vec<(&str, f64)> =
        hand.held.iter().map(|&(joint, position)| (hand.robot.joints[joint.0].name.as_str(), position)).collect();
    held.sort_by(|a, b| a.0.cmp(b.0));
    assert_eq!(held, [("finger_spread", 0.29), ("thumb_opposition", 0.49)]);
    assert_eq!(hand.fingers.iter().map(|finger| finger.chain.n_coordinates()).sum::<usize>(), 7);
    let text = regrasp_robot::inspect::hand_file_text(&hand, path.to_str().unwrap(), &Default::default());
    let loaded = scene(&text, "sphere = { radius = 0.06 }", [0.0821, 0.0279, 0.1264], "z");
    let (query, settings) = (loaded.in_hand(0), InHandSettings::default());
    let failure = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(1_000_000), &|_| {}).unwrap_err();
    assert_eq!((failure.kind, failure.statistics.work), (FailureKind::Impossible, 0), "{failure}");
    assert!(failure.message.contains("Of its 5 fingers none can"), "{failure}");
    let held = query.held();
    let plan = plan_in_hand(&loaded.view(), &held, &settings, 0, &Budget::work(1_000_000), &|_| {}).unwrap();
    accepted(&loaded, &held, &plan, &settings, "nine motors");
    // Whoever carries it out has to know where the other two motors stand.
    let stand = [("finger_spread", 0.29), ("thumb_opposition", 0.49)].map(|(name, at)| (name.to_owned(), at));
    assert_eq!(plan.held_joints, std::collections::BTreeMap::from(stand));
    for damage in [
        |plan: &mut Plan| plan.held_joints.clear(),
        |plan: &mut Plan| {
            *plan.held_joints.get_mut("finger_spread").unwrap() += 1e-3;
        },
    ] {
        let mut broken = plan.clone();
        damage(&mut broken);
        let query = Query::InHand(held.clone());
        let report = check((&loaded.scene, &loaded.state), Some(&query), &broken, &CheckSettings::default());
        let kinds: Vec<ViolationKind> = report.violations.iter().map(|violation| violation.kind).collect();
        assert_eq!(kinds, [ViolationKind::WrongScene]);
    }
}

/// The Barrett hand with its couplings: one motor spreads two fingers, one closes each.
#[test]
fn a_barrett_hand_holds_a_ball() {
    if shared_models().is_none() {
        return;
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/barrett/hand.toml");
    let text = std::fs::read_to_string(file).unwrap();
    let loaded = scene(&text, "sphere = { radius = 0.045 }", [0.0394, 0.009, 0.1639], "z");
    assert_eq!(loaded.view().hand.n_joints(), 3);
    let (query, settings) = (loaded.in_hand(0), InHandSettings::default());
    let failure = plan_in_hand(&loaded.view(), &query, &settings, 0, &Budget::work(1_000_000), &|_| {}).unwrap_err();
    assert_eq!((failure.kind, failure.statistics.work), (FailureKind::Impossible, 0), "{failure}");
    let held = query.held();
    let plan = plan_in_hand(&loaded.view(), &held, &settings, 0, &Budget::work(1_000_000), &|_| {}).unwrap();
    accepted(&loaded, &held, &plan, &settings, "Barrett");
}
