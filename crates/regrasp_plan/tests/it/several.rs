//! Plans of one hand in a scene of two: all that names and places could hide. Both hands have the same joints and fingers, both
//! objects the same shape, so that names alone tell them apart.

use crate::sample;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, Vector};
use regrasp_plan::check::{CheckSettings, Level, Report, ViolationKind, check};
use regrasp_plan::{ContactState, Plan};
use regrasp_scene::{InHandQuery, Obstacle, Query, Scene, State, Support};

const FAR: Vector = Vector::new(0.5, 0.0, 0.0);

/// The sample's scene, and the same hand and ball half a metre aside; a table below both.
fn scene() -> (Scene, State) {
    let mut scene = sample::scene();
    let mut left = scene.hands[0].clone();
    left.name = "left".into();
    left.world_from_hand = Pose::from(FAR) * left.world_from_hand;
    scene.hands[0].name = "right".into();
    scene.hands.push(left);
    let mut second = scene.objects[0].clone();
    second.name = "other ball".into();
    scene.objects.push(second);
    let shape = Shape::Cuboid { half_extents: Vector::new(0.6, 0.4, 0.01) };
    let placed = PlacedShape { parent_from_shape: Pose::translation(0.3, -0.2, 0.05), shape };
    scene.supports.push(Support { body: Obstacle { name: "table".into(), placed, mesh_body: None } });
    let first = start();
    let state = State::at_rest(&scene, vec![first, Pose::from(FAR) * first]);
    (scene, state)
}

fn start() -> Pose {
    sample::world_from_hand() * Pose::translation(0.0, 0.0, 0.078)
}

/// The plan of the right hand, and its query.
fn plan(scene: &Scene) -> (Plan, Query) {
    let mut plan = sample::plan(scene);
    plan.query = "turn".into();
    let query = InHandQuery { name: "turn".into(), ..sample::in_hand_query(&plan) };
    (plan, query.into())
}

fn judge(world: (&Scene, &State), query: Option<&Query>, plan: &Plan) -> Report {
    let settings = CheckSettings { level: Level::Geometry, ..CheckSettings::default() };
    check(world, query, plan, &settings)
}

fn finds(report: &Report, kind: ViolationKind) -> bool {
    report.violations.iter().any(|violation| violation.kind == kind)
}

#[test]
fn a_plan_of_one_hand_is_judged_among_all_that_rests() {
    let (scene, state) = scene();
    let (plan, query) = plan(&scene);
    for asked in [Some(&query), None] {
        let report = judge((&scene, &state), asked, &plan);
        assert!(report.accepted(), "{:#?}", report.violations);
    }
}

/// With a query every name has to be the one asked for; without one the geometry tells.
#[test]
fn names_of_other_hands_objects_and_tasks_are_found() {
    use ViolationKind::{Collision, ContactOffTip, WrongHolder, WrongScene};
    let (scene, state) = scene();
    let (good, query) = plan(&scene);
    type Change = fn(&mut Plan);
    let held_by_left: Change =
        |plan| plan.segments.iter_mut().for_each(|segment| segment.held_by = vec!["left".into()]);
    let of_left: Change = |plan| {
        plan.hand = "left".into();
        plan.segments.iter_mut().for_each(|segment| segment.held_by = vec!["left".into()]);
    };
    let cases: [(&str, Change, ViolationKind, ViolationKind); 8] = [
        ("the other hand", of_left, WrongScene, ContactOffTip),
        ("the other hand, held by this one", |plan| plan.hand = "left".into(), WrongScene, WrongHolder),
        ("the other object", |plan| plan.object = "other ball".into(), WrongScene, Collision),
        ("a support for a hand", |plan| plan.hand = "table".into(), WrongScene, WrongScene),
        ("a hand for an object", |plan| plan.object = "left".into(), WrongScene, WrongScene),
        ("no object, of two", |plan| plan.object.clear(), WrongScene, WrongScene),
        ("held by the other hand", held_by_left, WrongHolder, WrongHolder),
        ("held by the support", |plan| plan.segments[1].held_by.push("table".into()), WrongHolder, WrongHolder),
    ];
    for (what, change, with_query, without) in cases {
        let mut plan = good.clone();
        change(&mut plan);
        for (asked, kind) in [(Some(&query), with_query), (None, without)] {
            let report = judge((&scene, &state), asked, &plan);
            assert!(finds(&report, kind), "{what}: wanted {kind:?} in {:#?}", report.violations);
        }
    }
    // Another task that asks for the same of the same hand and object.
    let mut other = good.clone();
    other.query = "turn again".into();
    assert!(finds(&judge((&scene, &state), Some(&query), &other), WrongScene));
}

/// An object that nobody touches is held by nobody, whatever the plan says.
#[test]
fn an_object_in_the_air_is_held_by_nobody() {
    let (scene, state) = scene();
    let (good, query) = plan(&scene);
    for said in [vec![], vec!["right".to_owned()], vec!["table".to_owned()]] {
        let mut plan = good.clone();
        plan.segments[0].held_by = said.clone();
        plan.segments[0].waypoints[4].contacts.fill(ContactState::FREE);
        let report = judge((&scene, &state), Some(&query), &plan);
        assert!(finds(&report, ViolationKind::WrongHolder), "{said:?}: {:#?}", report.violations);
    }
}

/// What rests counts: bodies of the scene, and the state in which they rest.
#[test]
fn what_rests_is_nowhere_in_the_way() {
    let (good_scene, good_state) = scene();
    let (plan, query) = plan(&good_scene);
    type Change = fn(&mut Scene, &mut State);
    let in_palm: Pose = sample::world_from_hand() * Pose::translation(0.0, 0.0, -0.045);
    let cases: [(&str, Change); 6] = [
        ("the other ball where the first one is", |_, state| state.world_from_objects[1] = start()),
        ("the other ball in the palm, where no finger goes", |_, state| {
            state.world_from_objects[1] = sample::world_from_hand() * Pose::translation(0.0, 0.0, -0.045);
        }),
        ("the other hand back to back, palm in palm", |scene, _| {
            let turned = Pose::translation(0.0, 0.0, -0.05) * Pose::rotation(Vector::x() * std::f64::consts::PI);
            scene.hands[1].world_from_hand = sample::world_from_hand() * turned;
        }),
        ("the other hand where the first one is", |scene, _| {
            scene.hands[1].world_from_hand = sample::world_from_hand();
        }),
        ("the table at the ball", |scene, _| scene.supports[0].body.placed.parent_from_shape = start()),
        ("an obstacle at the ball", |scene, _| {
            let mut obstacle = scene.supports[0].body.clone();
            obstacle.placed.parent_from_shape = start();
            scene.obstacles.push(obstacle);
        }),
    ];
    for (what, change) in cases {
        let (mut scene, mut state) = (good_scene.clone(), good_state.clone());
        change(&mut scene, &mut state);
        let report = judge((&scene, &state), Some(&query), &plan);
        assert!(finds(&report, ViolationKind::Collision), "{what}: {:#?}", report.violations);
    }
    // The palm may be mounted on an obstacle or a support.
    let mut mounted = good_scene.clone();
    mounted.supports[0].body.placed.parent_from_shape = in_palm;
    mounted.supports[0].body.placed.shape = Shape::Cuboid { half_extents: Vector::new(0.05, 0.05, 0.03) };
    assert!(judge((&mounted, &good_state), Some(&query), &plan).accepted());
}

/// Two hands may have robot files of one name in two folders. Which is which counts, and how many there are.
#[test]
fn files_of_the_same_name_are_told_apart() {
    let (mut scene, state) = scene();
    let mut second = scene.inputs[1].clone();
    second.sha256 = regrasp_base::files::sha256(b"another hand");
    scene.inputs.push(second);
    let (good, query) = plan(&scene);
    assert_eq!(good.inputs[1].name, good.inputs[2].name);
    assert!(judge((&scene, &state), Some(&query), &good).accepted());
    type Change = fn(&mut Plan);
    let changes: [Change; 4] = [
        |plan| plan.inputs.swap(1, 2),
        |plan| plan.inputs.truncate(2),
        |plan| plan.inputs.push(plan.inputs[2].clone()),
        |plan| plan.inputs[2] = plan.inputs[1].clone(),
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let mut plan = good.clone();
        change(&mut plan);
        let report = judge((&scene, &state), Some(&query), &plan);
        assert!(finds(&report, ViolationKind::InputHashMismatch), "change {index}: {:#?}", report.violations);
    }
}
