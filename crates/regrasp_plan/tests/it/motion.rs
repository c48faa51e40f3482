//! Kinematics against the planner's, motion bounds against sampling, certificates against brute force.

use crate::sample;
use regrasp_base::Rng;
use regrasp_geometry::reference::{Clearance, distance};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, Vector};
use regrasp_plan::check::bodies::{Bodies, Owner};
use regrasp_plan::check::far::Looked;
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::motion::{WaypointStep, certify};
use regrasp_plan::plan::PoseData;
use regrasp_plan::{Plan, Waypoint};
use regrasp_scene::Scene;
use regrasp_scene::scene::Obstacle;

fn random_joints(scene: &Scene, rng: &mut Rng) -> Vec<f64> {
    let chains = scene.hands[0].hand.fingers.iter().map(|finger| &finger.chain);
    chains.flat_map(|chain| chain.lower.iter().zip(&chain.upper)).map(|(low, high)| rng.uniform(*low, *high)).collect()
}

#[test]
fn tips_are_where_the_chains_say() {
    let scene = sample::scene();
    let model = sample::with_task(&scene, CheckedHand::new).unwrap();
    let mut rng = Rng::keyed(1, "tips", 0);
    for _ in 0..200 {
        let joints = random_joints(&scene, &mut rng);
        for (finger, ours) in scene.hands[0].hand.fingers.iter().zip(&model.fingers) {
            let theirs = sample::world_from_hand()
                * finger.chain.tip(&joints[ours.coordinates.clone()], &finger.tip.center_in_body);
            assert!((ours.center_in_world(&joints) - theirs).norm() < 1e-12);
        }
    }
}

/// A waypoint near another one: joints within `turn`, object within `turn` too.
fn neighbour(waypoint: &Waypoint, turn: f64, rng: &mut Rng) -> Waypoint {
    let mut other = waypoint.clone();
    other.joints.iter_mut().for_each(|q| *q += rng.uniform(-turn, turn));
    let pose = Pose::from(&waypoint.world_from_object);
    let mut small = || Vector::from_fn(|_, _| rng.uniform(-turn, turn));
    let moved = pose * Pose::new(small() * 0.05, small());
    other.world_from_object = PoseData::from(&moved);
    other
}

fn samples(plan: &Plan) -> Vec<Waypoint> {
    plan.segments.iter().flat_map(|segment| segment.waypoints.iter().step_by(5).cloned()).collect()
}

#[test]
fn chords_and_strays_bound_the_true_motion() {
    let scene = sample::scene();
    let model = sample::with_task(&scene, CheckedHand::new).unwrap();
    let bodies = sample::with_task(&scene, |task| Bodies::new(task, &model)).unwrap();
    let mut rng = Rng::keyed(2, "motion", 0);
    let mut tightest: f64 = 0.0;
    for waypoint in samples(&sample::plan(&scene)) {
        let other = neighbour(&waypoint, 0.3, &mut rng);
        let mut step = WaypointStep::new(&bodies, &waypoint, &other);
        for pair in &bodies.pairs {
            let (a, b) = (&bodies.items[pair.a], &bodies.items[pair.b]);
            let stray = step.stray(pair);
            let (t0, t1) = (0.3, 0.3 + rng.uniform(0.05, 0.6));
            let chord = step.chord(pair, t0, t1);
            // Relative position of a point of each, seen from b, may not leave the chord's neighbourhood.
            let point_a = a.center + Vector::from(rng.direction()) * a.spin_radius;
            let point_b = b.center + Vector::from(rng.direction()) * b.spin_radius;
            let mut gap = |t: f64| step.pose(a.carrier, t) * point_a - step.pose(b.carrier, t) * point_b;
            let (first, last) = (gap(t0).norm(), gap(t1).norm());
            assert!((first - last).abs() <= chord + 1e-12, "{} {}", a.name, b.name);
            let h = t1 - t0;
            for k in 0..=20 {
                let share = k as f64 / 20.0;
                let now = gap(t0 + share * h).norm();
                let bound = (first - share * chord).max(last - (1.0 - share) * chord) - stray * h * h;
                assert!(now >= bound - 1e-12, "{} {}: {now} < {bound}", a.name, b.name);
                tightest = tightest.max(bound / now);
            }
        }
    }
    assert!(tightest > 0.9, "the bounds are loose everywhere: {tightest}");
}

#[test]
fn what_is_certified_is_clear_and_what_is_clear_is_certified() {
    let mut scene = sample::scene();
    // A needle that the fingers pass: 0.2 mm thick.
    scene.obstacles.push(Obstacle {
        name: "needle".into(),
        mesh_body: None,
        placed: PlacedShape {
            parent_from_shape: sample::world_from_hand() * Pose::translation(0.055, 0.01, 0.07),
            shape: Shape::Capsule { half_length: 0.02, radius: 0.1e-3 },
        },
    });
    let model = sample::with_task(&scene, CheckedHand::new).unwrap();
    let bodies = sample::with_task(&scene, |task| Bodies::new(task, &model)).unwrap();
    let mut rng = Rng::keyed(3, "motion", 0);
    let resolution = 0.05e-3;
    let (mut certified, mut refused, mut in_between) = (0, 0, 0);
    let waypoints = samples(&sample::plan(&scene));
    for round in 0..30 {
        let waypoint = &waypoints[round % waypoints.len()];
        let other = neighbour(waypoint, 0.4, &mut rng);
        let mut step = WaypointStep::new(&bodies, waypoint, &other);
        for pair in bodies.pairs.iter().filter(|pair| pair.tip_of.is_none()) {
            let (a, b) = (&bodies.items[pair.a], &bodies.items[pair.b]);
            let mut smallest = f64::INFINITY;
            let mut ends = f64::INFINITY;
            for k in 0..=400 {
                let t = k as f64 / 400.0;
                let pose_a = step.pose(a.carrier, t) * a.carrier_from_shape;
                let pose_b = step.pose(b.carrier, t) * b.carrier_from_shape;
                let signed = match distance(&a.shape, &pose_a, &b.shape, &pose_b, 0.5) {
                    Clearance::SeparatedBy(d) => d,
                    Clearance::Penetrating(d) => -d,
                    Clearance::Unresolved => panic!("unresolved"),
                };
                smallest = smallest.min(signed);
                if k == 0 || k == 400 {
                    ends = ends.min(signed);
                }
            }
            match certify(&mut step, pair, (0.0, 1.0), f64::NEG_INFINITY, 0.0, resolution) {
                Ok(_) => {
                    certified += 1;
                    assert!(smallest > 0.0, "{} and {} certified, but {smallest}", a.name, b.name);
                }
                Err(breach) => {
                    refused += 1;
                    assert!(smallest < resolution, "{} and {} refused at {smallest}: {breach:?}", a.name, b.name);
                    in_between += usize::from(ends > 0.0);
                }
            }
        }
    }
    assert!(bodies.items.iter().any(|item| item.owner == Owner::Obstacle));
    assert!(certified > 500 && refused > 30 && in_between > 5, "{certified} {refused} {in_between}");
}

/// Specks, balls, boxes and a few walls around the hand.
fn obstacles(n: usize, rng: &mut Rng) -> Vec<Obstacle> {
    let obstacle = |index: usize| {
        let size = [1e-5, 0.004, 0.01, 3.0][rng.below(4).min(rng.below(8))];
        let shape = match rng.below(2) {
            0 => Shape::Sphere { radius: size },
            _ => Shape::Cuboid { half_extents: Vector::new(size, 0.5 * size, 0.3 * size) },
        };
        let away = rng.uniform(0.11, 0.4) + if size > 1.0 { shape.bounding_sphere().1 } else { 0.0 };
        let middle = sample::world_from_hand() * Pose::translation(0.0, 0.0, 0.06);
        let position = middle.translation.vector + Vector::from(rng.direction()) * away;
        let parent_from_shape = regrasp_geometry::pose_from(position.into(), rng.quat_xyzw());
        Obstacle {
            name: format!("obstacle {index}"),
            mesh_body: None,
            placed: PlacedShape { parent_from_shape, shape },
        }
    };
    (0..n).map(obstacle).collect()
}

#[test]
fn pairs_that_are_left_out_stay_apart_all_the_time() {
    let mut scene = sample::scene();
    let mut rng = Rng::keyed(4, "motion", 0);
    scene.obstacles = obstacles(150, &mut rng);
    let model = sample::with_task(&scene, CheckedHand::new).unwrap();
    let bodies = sample::with_task(&scene, |task| Bodies::new(task, &model)).unwrap();
    let mut looked = Looked::new(&bodies);
    let waypoints = samples(&sample::plan(&scene));
    let mut was_out = vec![false; bodies.pairs.len()];
    let (mut n_out, mut n_in, mut n_back) = (0, 0, 0);
    for round in 0..60 {
        // Small steps, leaps, and steps of nothing.
        let (from, turn) = (&waypoints[round / 4 % waypoints.len()], [0.02, 0.3, 0.0][round % 3]);
        let to = neighbour(from, turn, &mut rng);
        let mut step = WaypointStep::new(&bodies, from, &to);
        let keep = [0.0, 0.001, 0.02][rng.below(3)];
        let mut told = Vec::new();
        let near = looked.in_step(&bodies, &mut step, keep, |index| told.push(index)).to_vec();
        assert!(near.is_sorted_by(|a, b| a < b));
        for (index, pair) in bodies.pairs.iter().enumerate() {
            let is_out = near.binary_search(&index).is_err();
            assert_eq!(told.contains(&index), is_out && !was_out[index], "told once, when it is first left out");
            n_back += usize::from(was_out[index] && !is_out);
            was_out[index] = is_out;
            if !is_out {
                n_in += 1;
                continue;
            }
            n_out += 1;
            assert!(bodies.items[pair.b].owner == Owner::Obstacle);
            for k in 0..=4 {
                let distance = step.measure(pair, k as f64 / 4.0).unwrap();
                assert!(distance > keep, "{distance} at least {keep}, round {round}");
            }
        }
    }
    assert!(n_out > 10_000 && n_in > 5_000 && n_back > 30, "{n_out} {n_in} {n_back}");
}

#[test]
fn the_smallest_clearance_among_many_obstacles_is_that_of_all_pairs() {
    let mut scene = sample::scene();
    let mut rng = Rng::keyed(5, "motion", 0);
    let plan = sample::plan(&scene);
    scene.obstacles = obstacles(150, &mut rng);
    // Half a millimetre over where the object, a ball, is highest: nearer than a lifted finger is to it.
    let centers = plan.segments.iter().flat_map(|segment| &segment.waypoints).map(|w| Pose::from(&w.world_from_object));
    let highest = centers.map(|pose| pose.translation.vector).max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
    let over = highest + Vector::z() * (sample::OBJECT_RADIUS + 0.002 + 0.0005);
    scene.obstacles[70].name = "obstacle over the object".into();
    scene.obstacles[70].placed = PlacedShape {
        parent_from_shape: Pose::translation(over.x, over.y, over.z),
        shape: Shape::Sphere { radius: 0.002 },
    };
    let model = sample::with_task(&scene, CheckedHand::new).unwrap();
    let bodies = sample::with_task(&scene, |task| Bodies::new(task, &model)).unwrap();
    let is_obstacle = |item: usize| bodies.items[item].owner == Owner::Obstacle;
    let mut smallest = f64::INFINITY;
    for segment in &plan.segments {
        for ends in segment.waypoints.windows(2) {
            let mut step = WaypointStep::new(&bodies, &ends[0], &ends[1]);
            for pair in bodies.pairs.iter().filter(|pair| is_obstacle(pair.b)) {
                smallest = smallest.min(step.measure(pair, 0.0).unwrap());
            }
        }
    }
    let report = regrasp_plan::check::check(
        (&scene, &sample::state(&scene)),
        Some(&sample::query(&plan)),
        &plan,
        &Default::default(),
    );
    let clearance = report.min_clearance.expect("something was measured");
    assert_eq!(clearance.pair[1], "obstacle over the object");
    assert!(clearance.distance == smallest && (smallest - 0.0005).abs() < 1e-9, "{clearance:?}, {smallest}");
}
