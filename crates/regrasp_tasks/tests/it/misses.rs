//! The nearest misses of tasks without a plan. What is said to meet is measured again by parry.

use crate::Case;
use regrasp_geometry::reference::{Clearance, ReferenceShape, distance};
use regrasp_geometry::{Point, Pose};
use regrasp_manipulation::robot_miss::{ExchangeOutcome, MetBody, MetKind, RobotMiss};
use regrasp_robot::LinkId;
use regrasp_tasks::{Failure, TaskSettings};

fn failure(case: &Case, settings: &TaskSettings) -> Failure {
    case.plan(settings, 0).expect_err("no plan")
}

fn miss(case: &Case, settings: &TaskSettings) -> RobotMiss {
    let found = failure(case, settings);
    let miss = *found.robot_miss.clone().unwrap_or_else(|| panic!("no nearest miss: {found}"));
    assert_eq!(miss.joints.len(), case.loaded.scene.robots[0].layout.len());
    assert!(case.loaded.scene.robots[0].layout.within_limits(&miss.joints, 1e-9), "{}", miss.reason);
    miss
}

/// Shapes of a body of a miss, in the world.
fn shapes(case: &Case, miss: &RobotMiss, body: &MetBody) -> Vec<(ReferenceShape, Pose)> {
    let scene = &case.loaded.scene;
    let robot = &scene.robots[0];
    let mut poses = Vec::new();
    robot.link_poses(&miss.joints, &mut poses);
    let object = || scene.object_named(&body.name).expect("an object");
    let here = || Pose::from(miss.world_from_object.as_ref().expect("the object is somewhere"));
    let fixed = scene.supports.iter().map(|support| &support.body).chain(&scene.obstacles);
    let found: Vec<(regrasp_geometry::Shape, Pose)> = match body.kind {
        // What is carried counts as its hull.
        MetKind::Carried => {
            let solid = scene.objects[object()].solid();
            vec![(regrasp_robot::hand::convex_of(solid).unwrap_or_else(|_| solid.clone()), here())]
        }
        MetKind::Link => {
            let link = robot.robot.links.iter().position(|link| link.name == body.name).expect("a link");
            let own = robot.robot.links[link].collision.iter();
            let mut all: Vec<_> =
                own.map(|placed| (placed.shape.clone(), poses[link] * placed.parent_from_shape)).collect();
            for finger in robot.hands.iter().flat_map(|hand| &hand.hand.fingers) {
                if let Some(tip) = finger.tip.own_shape().filter(|_| finger.tip.link.0 == link) {
                    let from_body = robot.robot.fixed_pose_in_body(finger.tip.link).inverse();
                    all.push((tip.shape.clone(), poses[link] * from_body * tip.parent_from_shape));
                }
            }
            all
        }
        MetKind::Resting => match fixed.into_iter().find(|other| other.name == body.name) {
            Some(other) => vec![(other.placed.shape.clone(), other.placed.parent_from_shape)],
            None => vec![(scene.objects[object()].solid().clone(), here())],
        },
    };
    found.into_iter().map(|(shape, pose)| (ReferenceShape::new(&shape).expect("a shape"), pose)).collect()
}

/// How deep the two of a miss overlap, negative where they are apart.
fn overlap(case: &Case, miss: &RobotMiss) -> f64 {
    let bodies = &miss.meeting.as_ref().unwrap_or_else(|| panic!("nothing meets: {}", miss.reason)).bodies;
    let [first, second] = [0, 1].map(|k| shapes(case, miss, &bodies[k]));
    let mut deepest = f64::NEG_INFINITY;
    for (a, at_a) in &first {
        for (b, at_b) in &second {
            deepest = deepest.max(match distance(a, at_a, b, at_b, 1.0) {
                Clearance::SeparatedBy(apart) => -apart,
                Clearance::Penetrating(depth) => depth,
                Clearance::Unresolved => panic!("undecided"),
            });
        }
    }
    deepest
}

/// Asserts that the two of a miss meet, and that the depth that it states is no smaller than what parry measures.
fn they_meet(case: &Case, miss: &RobotMiss) {
    let clearance = TaskSettings::default().clearance;
    let measured = overlap(case, miss);
    let meeting = miss.meeting.as_ref().expect("a meeting");
    assert!(measured > -clearance - 1e-9, "{}: they are {} m apart", meeting.in_words(), -measured);
    if let Some(stated) = meeting.overlap {
        // Ours is a search over directions, parry's the depth by EPA: both are bounds of the least way apart, and good ones.
        assert!((stated - measured).abs() < 2e-3, "{}: parry says {measured}", meeting.in_words());
    }
}

#[test]
fn what_is_refused_before_any_search_has_a_posture() {
    let start = miss(&Case::new("impossible_start.toml"), &TaskSettings::default());
    let case = Case::new("impossible_start.toml");
    assert_eq!(start.reason, "start: in collision");
    assert_eq!(start.joints, case.query.start);
    let names = start.meeting.as_ref().expect("a meeting").bodies.clone().map(|body| body.name);
    assert!(names.contains(&"post".to_owned()) && names.iter().any(|name| name.starts_with("right_")), "{names:?}");
    they_meet(&case, &start);

    let mut case = Case::new("justin_horse.toml");
    let aside = case.loaded.scene.obstacles[0].placed.parent_from_shape.translation.vector;
    let mut goal = case.query.world_from_object_goal;
    (goal.translation.vector.x, goal.translation.vector.y) = (aside.x, aside.y);
    case.query.world_from_object_goal = goal;
    let overlapping = miss(&case, &TaskSettings::default());
    assert_eq!((overlapping.reason.as_str(), &overlapping.joints), ("goal: overlap", &case.query.end));
    they_meet(&case, &overlapping);
}

/// True where parry says that no link meets a support or a link that it may not touch, in a state.
fn is_free(case: &Case, state: &[f64]) -> bool {
    let scene = &case.loaded.scene;
    let robot = &scene.robots[0];
    let mut poses = Vec::new();
    robot.link_poses(state, &mut poses);
    let links: Vec<(usize, ReferenceShape, Pose)> = (robot.robot.links.iter().enumerate())
        .flat_map(|(link, of)| {
            let at = poses[link];
            let shape = move |placed: &regrasp_geometry::shape::PlacedShape| {
                (link, ReferenceShape::new(&placed.shape).expect("a shape"), at * placed.parent_from_shape)
            };
            of.collision.iter().map(shape)
        })
        .collect();
    let apart = |(a, at_a): (&ReferenceShape, &Pose), (b, at_b): (&ReferenceShape, &Pose)| {
        matches!(distance(a, at_a, b, at_b, 1e-3), Clearance::SeparatedBy(_))
    };
    let supports: Vec<(ReferenceShape, Pose)> = (scene.supports.iter())
        .map(|support| &support.body.placed)
        .map(|placed| (ReferenceShape::new(&placed.shape).expect("a shape"), placed.parent_from_shape))
        .collect();
    links.iter().enumerate().all(|(k, (link, own, at))| {
        supports.iter().all(|(other, pose)| apart((own, at), (other, pose)))
            && links[k + 1..].iter().all(|(second, other, pose)| {
                let may = link == second || robot.may_touch(LinkId(*link), LinkId(*second));
                may || apart((own, at), (other, pose))
            })
    })
}

/// The arm is stretched towards what it does not reach: no posture of many drawn ones that parry finds free comes much nearer.
#[test]
fn what_is_out_of_reach_has_a_stretched_arm() {
    let case = Case::new("impossible_reach.toml");
    let far = miss(&case, &TaskSettings::default());
    assert_eq!(far.reason, "goal: out of reach");
    let [wanted] = far.wanted.as_slice() else { panic!("one hand: {:?}", far.wanted) };
    let robot = &case.loaded.scene.robots[0];
    let hand = case.loaded.scene.hands[case.loaded.scene.hand_named(&wanted.hand).unwrap()].carrier.unwrap().hand;
    let mount = robot.arms[robot.hands[hand].arm.unwrap()].mount;
    let mut poses = Vec::new();
    let mut wrist = |state: &[f64]| {
        robot.link_poses(state, &mut poses);
        Point::from(poses[mount.0].translation.vector)
    };
    let [reached, asked] = wanted.wrist.map(Point::from);
    assert!((wrist(&far.joints) - reached).norm() < 1e-9, "the arm is where the miss says");
    assert!(is_free(&case, &far.joints));
    let least = (reached - asked).norm();
    let mut rng = regrasp_base::Rng::keyed(0, "postures", 0);
    for _ in 0..20_000 {
        let mut state = case.query.start.clone();
        for &k in &robot.coordinates_above(mount) {
            let limits = &robot.layout.coordinates[k];
            state[k] = rng.uniform(limits.lower.max(-3.2), limits.upper.min(3.2));
        }
        if robot.layout.within_limits(&state, 0.0) {
            let drawn = (wrist(&state) - asked).norm();
            let is_worse = drawn > least - 0.02 || !is_free(&case, &state);
            assert!(is_worse, "a drawn posture comes {drawn} m near, the stretched arm {least}");
        }
    }
}

#[test]
fn failed_searches_have_what_meets() {
    let mut case = Case::new("impossible_double_grasp.toml");
    // Its lists lie beside the scene.
    for hand in ["right", "left"] {
        let name = format!("../../scenes/two_arms/impossible_double_grasp.{hand}.die.grasps.json");
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let list = regrasp_grasp::list::format::from_json(&path, &std::fs::read(&path).unwrap()).unwrap();
        case.lists.push((case.loaded.scene.hand_named(hand).unwrap(), list));
    }
    let touch = miss(&case, &TaskSettings::default());
    assert_eq!(touch.reason, "exchange: hands touch");
    they_meet(&case, &touch);
    let of_hand = |body: &MetBody| body.kind == MetKind::Link;
    assert!(touch.meeting.as_ref().unwrap().bodies.iter().all(of_hand), "{:?}", touch.meeting);
    assert!(!touch.exchanges.is_empty());
    assert!(touch.exchanges.iter().all(|at| at.outcome == ExchangeOutcome::HandsTouch));

    let case = Case::new("impossible_place.toml");
    let hood = miss(&case, &TaskSettings::default());
    assert!(hood.reason.starts_with("place: "), "{}", hood.reason);
    they_meet(&case, &hood);

    // The same again.
    assert_eq!(hood, miss(&case, &TaskSettings::default()));
    // Exchanges that are tried at few places only.
    let none = TaskSettings { exchange_turns: 1, exchange_draws: 0, put_down: false, ..TaskSettings::default() };
    let case = Case::new("justin_horse_wall.toml");
    let settings = TaskSettings { exchange_places: 3, in_hand: false, ..none };
    let found = miss(&case, &settings);
    assert!(found.reason.starts_with("exchange: ") && !found.exchanges.is_empty(), "{}", found.reason);
    if found.meeting.is_some() {
        they_meet(&case, &found);
    }
}
