//! The checker of plans of pick and place, on plans that were made without a planner.

use crate::made_by_hand::{MadeByHand, hand_over, one_arm};
use regrasp_plan::check::{CheckSettings, Level, Report, ViolationKind as Kind, check_any, check_pick_and_place};
use regrasp_plan::format::{read_any, robot_to_json};
use regrasp_plan::plan::ContactMode;
use regrasp_plan::robot_plan::RobotSegmentKind as Segment;
use regrasp_plan::{AnyPlan, RobotPlan};
use regrasp_scene::{Query, Scene};
use std::path::Path;

fn judge(made: &MadeByHand, plan: &RobotPlan) -> Report {
    let around = (&made.loaded.scene, &made.loaded.state);
    check_pick_and_place(around, Some(&made.query), plan, &CheckSettings::default())
}

fn kinds(report: &Report) -> Vec<Kind> {
    let mut kinds: Vec<Kind> = report.violations.iter().map(|violation| violation.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

#[track_caller]
fn accepted(report: &Report) {
    let said: Vec<String> = report.violations.iter().map(ToString::to_string).collect();
    assert!(report.accepted(), "{}\n{:?}", said.join("\n"), report.left_out);
}

#[test]
fn plans_of_one_arm_and_of_a_hand_over_are_accepted_and_read_back() {
    for (made, n_segments) in [(one_arm(), 11), (hand_over(), 16)] {
        assert_eq!(made.plan.segments.len(), n_segments);
        let report = judge(&made, &made.plan);
        accepted(&report);
        assert_eq!(report.assumed.len(), 2);
        assert!(report.min_margin.is_some_and(|margin| margin > 0.01), "{report:?}");
        assert!(report.max_force_residual.is_some_and(|off| off > 0.0 && off < 1e-6), "{report:?}");
        assert!(report.max_half_way_imbalance.is_some_and(|share| share > 0.0 && share < 0.05), "{report:?}");
        let around = (&made.loaded.scene, &made.loaded.state);
        accepted(&check_pick_and_place(around, None, &made.plan, &CheckSettings::default()));
        let text = robot_to_json(&made.plan);
        let read = read_any(Path::new("plan.json"), text.as_bytes()).unwrap();
        assert_eq!(read, AnyPlan::Robot(Box::new(made.plan.clone())));
        let query = Query::PickAndPlace(made.query.clone());
        accepted(&check_any(around, Some(&query), &read, &CheckSettings::default()));
    }
}

/// The plan with one thing changed, and the kinds of violation that it then has.
#[track_caller]
fn broken(made: &MadeByHand, change: impl FnOnce(&mut RobotPlan), expected: &[Kind]) {
    let mut plan = made.plan.clone();
    change(&mut plan);
    let report = judge(made, &plan);
    assert_eq!(kinds(&report), expected, "{:#?}", report.violations);
    assert!(!report.accepted());
}

/// The index of the first segment of a kind, held by these.
#[track_caller]
fn segment(plan: &RobotPlan, kind: Segment, holders: &[&str]) -> usize {
    let found = plan.segments.iter().position(|one| one.kind == kind && one.held_by["bar"] == holders);
    found.expect("a segment of this kind")
}

#[test]
fn every_rule_can_be_broken_alone() {
    let made = hand_over();
    let of = |kind: Segment, holders: &[&str]| segment(&made.plan, kind, holders);
    let exchange = of(Segment::Carry, &["right", "left"]);
    let carry = of(Segment::Carry, &["right"]);
    let grasp = of(Segment::Grasp, &["table"]);
    broken(&made, |plan| plan.task = "motion".into(), &[Kind::WrongScene]);
    broken(&made, |plan| plan.hands.swap(0, 1), &[Kind::WrongScene]);
    broken(&made, |plan| plan.promises.holding = None, &[Kind::PromiseBroken]);
    broken(&made, |plan| plan.promises.holding.as_mut().unwrap().contact_tolerance = 0.6e-3, &[Kind::PromiseBroken]);
    broken(
        &made,
        |plan| plan.promises.holding.as_mut().unwrap().friction_margin = 1.4,
        &[Kind::FrictionMarginTooSmall],
    );
    broken(&made, |plan| plan.promises.holding.as_mut().unwrap().required_margin = 0.9, &[Kind::ClosureLost]);
    broken(&made, |plan| plan.promises.holding.as_mut().unwrap().normal_force[1] = 5.0, &[Kind::NormalForceOutOfRange]);
    broken(&made, |plan| plan.promises.clearance = 0.1, &[Kind::Collision]);
    broken(&made, |plan| plan.segments[exchange].held_by.get_mut("bar").unwrap().clear(), &[Kind::WrongHolder]);
    broken(
        &made,
        |plan| plan.segments[carry].kind = Segment::Retreat,
        &[Kind::WrongHolder, Kind::Collision, Kind::ForceUnbalanced, Kind::ObjectMovesAtRest, Kind::JointMovesAtRest],
    );
    broken(
        &made,
        |plan| plan.segments[carry].waypoints[3].world_from_objects[0].position[2] += 2e-9,
        &[Kind::GraspChanges],
    );
    broken(
        &made,
        |plan| plan.segments[grasp].waypoints[2].world_from_objects[0].position[0] += 2e-9,
        &[Kind::ObjectMovesAtRest],
    );
    broken(&made, |plan| plan.segments[grasp].waypoints[2].joints[1] += 2e-9, &[Kind::JointMovesAtRest]);
    broken(
        &made,
        |plan| plan.segments[carry].waypoints[2].contacts[1].point_in_object[2] += 2e-9,
        &[Kind::GraspChanges],
    );
    broken(&made, |plan| plan.segments[carry].waypoints[2].contacts[1].force_in_object = None, &[Kind::ForceMissing]);
    broken(
        &made,
        |plan| plan.segments[exchange].waypoints[2].contacts[1].force_in_object.as_mut().unwrap()[2] += 1e-5,
        &[Kind::ForceUnbalanced],
    );
}

/// The report of the plan in a scene that was changed.
fn in_scene(made: &MadeByHand, change: impl FnOnce(&mut Scene)) -> Report {
    let mut scene = made.loaded.scene.clone();
    change(&mut scene);
    check_pick_and_place((&scene, &made.loaded.state), Some(&made.query), &made.plan, &CheckSettings::default())
}

#[test]
fn supports_carry_what_stands_on_them_and_nothing_else() {
    let made = one_arm();
    let table = |scene: &mut Scene, by: f64| {
        scene.supports[0].body.placed.parent_from_shape.translation.vector.z += by;
    };
    // A tenth of a millimetre into the table and a little above it are rounding; more is not.
    accepted(&in_scene(&made, |scene| table(scene, 0.9e-4)));
    accepted(&in_scene(&made, |scene| table(scene, -4e-4)));
    assert_eq!(kinds(&in_scene(&made, |scene| table(scene, 2e-4))), [Kind::Collision]);
    // What does not touch carries nothing either.
    let expected = [Kind::ForceUnbalanced, Kind::Unsupported];
    assert_eq!(kinds(&in_scene(&made, |scene| table(scene, -2e-3))), expected);
    let round = in_scene(&made, |scene| {
        scene.supports[0].body.placed.shape = regrasp_geometry::Shape::Sphere { radius: 0.01 };
    });
    assert!(kinds(&round).contains(&Kind::Unsupported), "{round:#?}");
    assert!(round.violations.iter().any(|violation| violation.message.contains("is round")), "{round:#?}");
}

#[test]
fn forces_hold_the_objects_weight_and_inertia() {
    let made = one_arm();
    let heavier = in_scene(&made, |scene| scene.objects[0].mass *= 1.0 + 1e-4);
    assert_eq!(kinds(&heavier), [Kind::ForceUnbalanced]);
    // Faster takes more acceleration: forces that fitted no longer do, though every speed is allowed.
    let mut fast = made.plan.clone();
    for waypoint in fast.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
        waypoint.time *= 0.95;
        waypoint.joint_velocities.iter_mut().for_each(|velocity| *velocity /= 0.95);
    }
    assert_eq!(kinds(&judge(&made, &fast)), [Kind::ForceUnbalanced]);
    let weak = in_scene(&made, |scene| {
        let robot = &mut scene.robots[0];
        let mut changed = (*robot.robot).clone();
        for joint in changed.joints.iter_mut().filter(|joint| joint.name.contains("flexion")) {
            joint.limits.as_mut().unwrap().effort = Some(0.1);
        }
        robot.robot = std::sync::Arc::new(changed);
    });
    assert_eq!(kinds(&weak), [Kind::TorqueLimit]);
    // Nothing is asked of forces where only geometry counts.
    let mut bare = made.plan.clone();
    let contacts = bare.segments.iter_mut().flat_map(|segment| &mut segment.waypoints).flat_map(|w| &mut w.contacts);
    contacts.for_each(|contact| contact.force_in_object = None);
    let settings = CheckSettings { level: Level::Geometry, ..CheckSettings::default() };
    let around = (&made.loaded.scene, &made.loaded.state);
    accepted(&check_pick_and_place(around, Some(&made.query), &bare, &settings));
    assert_eq!(kinds(&judge(&made, &bare)), [Kind::ForceMissing]);
}

#[test]
fn readers_refuse_what_no_plan_of_pick_and_place_is() {
    let made = hand_over();
    let exchange = segment(&made.plan, Segment::Carry, &["right", "left"]);
    let carry = segment(&made.plan, Segment::Carry, &["right"]);
    type Change<'a> = Box<dyn Fn(&mut RobotPlan) + 'a>;
    let changes: Vec<(&str, Change)> = vec![
        ("C411", Box::new(|plan| plan.hands.clear())),
        ("C411", Box::new(|plan| plan.objects.push("other".into()))),
        ("C409", Box::new(|plan| plan.promises.holding = None)),
        ("C409", Box::new(|plan| plan.promises.holding.as_mut().unwrap().friction_margin = 0.5)),
        ("C409", Box::new(|plan| plan.promises.holding.as_mut().unwrap().normal_force = [3.0, 2.0])),
        ("C408", Box::new(|plan| plan.segments[0].held_by.clear())),
        (
            "C407",
            Box::new(|plan| {
                plan.segments[exchange].held_by.insert("bar".into(), vec!["right".into()]);
            }),
        ),
        ("C407", Box::new(|plan| plan.segments[carry].waypoints[1].contacts[0].mode = ContactMode::Rolling)),
        (
            "C408",
            Box::new(|plan| {
                let contacts = &mut plan.segments[carry].waypoints[1].contacts;
                contacts[1] = contacts[0].clone();
            }),
        ),
        (
            "C410",
            Box::new(|plan| {
                let contacts = &mut plan.segments[carry].waypoints[1].contacts;
                let many = vec![contacts[0].clone(); 9];
                contacts.extend(many);
            }),
        ),
        ("C408", Box::new(|plan| plan.task = "motion".into())),
    ];
    for (k, (code, change)) in changes.into_iter().enumerate() {
        let mut plan = made.plan.clone();
        change(&mut plan);
        let error = read_any(Path::new("plan.json"), robot_to_json(&plan).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(code), "{k}: {code}\n{error}");
    }
}
