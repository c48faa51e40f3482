//! Queries with way poses, and the scenes of the papers: what they are said to force is shown to be forced.

use crate::in_hand_methods::{scene, settings};
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_geometry::{Point, Pose, interpolate_pose};
use regrasp_plan::check::{CheckSettings, ViolationKind};
use regrasp_plan::{Plan, SegmentKind};
use regrasp_planners::in_hand::{InHandSettings, Method, plan_in_hand};
use regrasp_planners::{Failure, FailureKind};
use regrasp_scene::{InHandQuery, LoadedScene};

fn try_plan(loaded: &LoadedScene, query: &InHandQuery, settings: &InHandSettings, work: u64) -> Result<Plan, Failure> {
    plan_in_hand(&loaded.view(), query, settings, 0, &Budget::work(work), &|_| {})
}

/// Accepted by the checker, and every way pose is where the object is when the plan says so.
fn is_accepted(loaded: &LoadedScene, query: &InHandQuery, plan: &Plan) {
    let report = loaded.judge(query, plan, &CheckSettings::default());
    assert!(report.accepted(), "{}: {:#?}", loaded.scene.name, report.violations);
    assert_eq!(plan.way_poses.len(), query.world_from_object_way.len());
}

#[test]
fn every_method_passes_the_way_poses_and_says_when() {
    let loaded = scene("sphere_90x.toml");
    let mut query = loaded.in_hand(0);
    let (start, goal) = (query.world_from_object_start, query.world_from_object_goal);
    let mut aside = interpolate_pose(&start, &goal, 0.5);
    aside.translation.vector.x += 0.006;
    query.world_from_object_way = vec![aside, start];
    for method in [Method::Gait, Method::Visibility, Method::Classic] {
        let plan = try_plan(&loaded, &query, &settings(method, 1), 20_000_000).unwrap();
        is_accepted(&loaded, &query, &plan);
        assert!(plan == try_plan(&loaded, &query, &settings(method, 3), 20_000_000).unwrap(), "{method:?}: threads");
        // The same motion answers neither a query with one way pose less nor one in another order.
        let mut others = [query.clone(), query.clone()];
        others[0].world_from_object_way.pop();
        others[1].world_from_object_way.reverse();
        for other in others {
            let report = loaded.judge(&other, &plan, &CheckSettings::default());
            assert!(report.violations.iter().any(|v| v.kind == ViolationKind::WayPoseMissed), "{report:#?}");
        }
    }
}

#[test]
fn a_way_pose_that_is_the_start_costs_nothing() {
    let loaded = scene("sphere_90x.toml");
    let mut query = loaded.in_hand(0);
    query.world_from_object_way = vec![query.world_from_object_start; 2];
    let plan = try_plan(&loaded, &query, &settings(Method::Gait, 1), 20_000_000).unwrap();
    is_accepted(&loaded, &query, &plan);
}

#[test]
fn a_leg_that_fails_is_named_and_a_buried_way_pose_is_refused_at_once() {
    let loaded = scene("sphere_90x.toml");
    let mut query = loaded.in_hand(0);
    // Out of everybody's reach: the first leg is easy, the second cannot be done.
    let mut away = query.world_from_object_goal;
    away.translation.vector.z += 0.2;
    let mut near = query.world_from_object_start;
    near.translation.vector.x += 0.003;
    query.world_from_object_way = vec![near, away];
    let work = 60_000;
    let failure = try_plan(&loaded, &query, &settings(Method::Gait, 1), work).unwrap_err();
    assert_eq!((failure.kind, failure.leg), (FailureKind::WorkSpent, Some(2)), "{failure:?}");
    assert!(failure.message.contains("leg 2 of 3 failed") && failure.message.contains("way pose 2"), "{failure}");
    let left = failure.nearest_miss.as_ref().unwrap().distance_left;
    assert!(left > 0.1 && left < 0.21, "measured to the end of the leg: {left}");
    assert!(failure.statistics.work < 2 * work, "legs share one budget: {}", failure.statistics.work);

    let mut buried = query.world_from_object_start;
    buried.translation.vector.z = 0.0;
    query.world_from_object_way[1] = buried;
    let failure = try_plan(&loaded, &query, &settings(Method::Gait, 1), work).unwrap_err();
    assert_eq!(failure.kind, FailureKind::WayInvalid);
    assert!(failure.message.contains("way pose 2") && failure.statistics.work == 0, "{failure:?}");
}

#[test]
fn the_cube_turns_all_the_way_round() {
    let loaded = scene("cubic.toml");
    for seed in 0..3 {
        let query = loaded.in_hand(seed);
        let plan =
            plan_in_hand(&loaded.view(), &query, &settings(Method::Gait, 1), seed, &Budget::work(20_000_000), &|_| {});
        let plan = plan.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        is_accepted(&loaded, &query, &plan);
        assert_eq!(plan.way_poses.len(), 2);
    }
}

/// Relocations of `finger`, with the points in the world that its tip's contact leaves and reaches.
fn jumps(plan: &Plan, finger: &str) -> Vec<(Point, Point)> {
    let which = plan.fingers.iter().position(|name| name == finger).expect("a finger of the hand");
    let of_finger = |segment: &&regrasp_plan::Segment| {
        segment.kind == SegmentKind::Regrasp && segment.moving_finger.as_deref() == Some(finger)
    };
    let contact = |waypoint: &regrasp_plan::Waypoint| {
        let point = waypoint.contacts[which].point_in_object.expect("both ends hold");
        Pose::from(&waypoint.world_from_object) * Point::from(point)
    };
    let ends = |segment: &regrasp_plan::Segment| {
        (contact(segment.waypoints.first().unwrap()), contact(segment.waypoints.last().unwrap()))
    };
    plan.segments.iter().filter(of_finger).map(ends).collect()
}

#[test]
fn the_plate_forces_the_east_finger_to_jump_over_it() {
    let (with_plate, without) = (scene("ellipsoid_obstacle.toml"), scene("ellipsoid_free.toml"));
    assert_eq!((with_plate.scene.obstacles.len(), without.scene.obstacles.len()), (1, 0));
    let mut n_without = 0;
    for seed in 0..10 {
        let settings = settings(Method::Gait, 1);
        let plan_of = |loaded: &LoadedScene| {
            let query = loaded.in_hand(seed);
            let plan = plan_in_hand(&loaded.view(), &query, &settings, seed, &Budget::work(20_000_000), &|_| {});
            let plan = plan.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
            is_accepted(loaded, &query, &plan);
            plan
        };
        // The plate stands in the plane y = 0: some relocation leads from one side of it to the other.
        let over = jumps(&plan_of(&with_plate), "east").iter().filter(|(from, to)| from.y < 0.0 && to.y > 0.0).count();
        assert!(over >= 1, "seed {seed}");
        n_without += usize::from(jumps(&plan_of(&without), "east").is_empty());
    }
    assert!(n_without >= 5, "without the plate most plans need no jump: {n_without}");
}

/// Brute force over joints: no posture of the west finger brings its tip onto the pencil, however this points at right angles
/// to how it lay at the start, its middle held still. So a rotation alone cannot reverse it with all fingers holding.
#[test]
fn the_pencil_cannot_be_reversed_by_rotation_alone() {
    let loaded = scene("pencil.toml");
    let query = loaded.in_hand(0);
    let (start, goal) = (query.world_from_object_start, query.world_from_object_goal);
    assert!((start.translation.vector - goal.translation.vector).norm() < 1e-12, "reversed in place");
    let along = start * nalgebra::Vector3::z();
    assert!((goal * nalgebra::Vector3::z() + along).norm() < 1e-12, "and end for end");
    let regrasp_geometry::Shape::Cylinder { half_length, radius } = loaded.scene.objects[0].shape else {
        panic!("a cylinder")
    };
    let west = loaded.scene.hands[0].hand.fingers.iter().find(|finger| finger.name == "west").expect("a west finger");
    let chain = &west.chain;
    let middle = Point::from(start.translation.vector);
    // All pencils at right angles to `along` about one middle fill a disc: the distance of the tip from it.
    let distance = |joints: &[f64; 3]| {
        let arm = chain.tip(joints, &west.tip.center_in_body) - middle;
        let within = arm - along * arm.dot(&along);
        arm.dot(&along).hypot((within.norm() - half_length).max(0.0))
    };
    let n_steps = 40;
    let step: [f64; 3] = std::array::from_fn(|q| (chain.upper[q] - chain.lower[q]) / f64::from(n_steps));
    let mut best: Vec<([f64; 3], f64)> = Vec::new();
    for i in 0..=n_steps {
        for j in 0..=n_steps {
            for k in 0..=n_steps {
                let joints = std::array::from_fn(|q| chain.lower[q] + step[q] * f64::from([i, j, k][q]));
                best.push((joints, distance(&joints)));
            }
        }
    }
    best.sort_by(|a, b| a.1.total_cmp(&b.1));
    let nearest =
        best[..200].iter().map(|(joints, _)| descend(*joints, step, chain, distance)).fold(f64::INFINITY, f64::min);
    let touching = radius + west.tip.radius();
    assert!(nearest > touching + 1e-4, "the tip comes as near as {nearest} m, touching is {touching} m");
    // The test can fail: at the start the finger does touch the pencil.
    let at_start = |joints: &[f64; 3]| {
        let arm = chain.tip(joints, &west.tip.center_in_body) - middle;
        let on_line = arm.dot(&along).clamp(-half_length, half_length);
        (arm - along * on_line).norm()
    };
    assert!(best.iter().any(|(joints, _)| at_start(joints) < touching));
}

/// The least `distance` that steps of single joints, ever shorter, find from `joints` within the limits.
fn descend(
    mut joints: [f64; 3],
    mut step: [f64; 3],
    chain: &regrasp_robot::Chain,
    distance: impl Fn(&[f64; 3]) -> f64,
) -> f64 {
    let mut least = distance(&joints);
    while step[0] > 1e-7 {
        let mut is_better = false;
        for (q, sign) in (0..3).flat_map(|q| [(q, 1.0), (q, -1.0)]) {
            let mut trial = joints;
            trial[q] = (trial[q] + sign * step[q]).clamp(chain.lower[q], chain.upper[q]);
            let there = distance(&trial);
            if there < least {
                (joints, least, is_better) = (trial, there, true);
            }
        }
        if !is_better {
            step = step.map(|s| 0.5 * s);
        }
    }
    least
}
