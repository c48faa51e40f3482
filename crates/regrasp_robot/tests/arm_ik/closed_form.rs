//! Arms with spherical shoulder and wrist: as published ones are, and with axes at any angle and elbows with an offset.

use super::{difference, miss};
use nalgebra::{SMatrix, SVector};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_robot::kinematics::arm_ik::{ArmIk, Family, IkBudget, Unreachable};
use regrasp_robot::kinematics::whole_pose::twists;
use regrasp_robot::{Chain, ChainJoint, Coupling, JointMotion};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// An S-R-S arm: right angles and no offsets for `kind` 0, an offset at the elbow for 1, any angles between axes for 2.
fn arm(kind: u64, rng: &mut Rng) -> (Chain, Pose) {
    let turned = |x: f64, rng: &mut Rng| match kind {
        2 => Vector::new(x + rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), rng.uniform(-PI, PI)),
        _ => Vector::new(x, 0.0, 0.0),
    };
    let offset = if kind == 0 { 0.0 } else { rng.uniform(-0.08, 0.08) };
    let (upper, fore) = (rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5));
    // Joint k turns about z of its frame. Axes 2 and 3 meet in the shoulder, 5 and 6 in the wrist.
    let places = [
        Pose::new(Vector::new(0.1, -0.2, 0.3), Vector::new(0.3, 0.2, -0.1)),
        Pose::new(Vector::zeros(), turned(-FRAC_PI_2, rng)),
        Pose::new(Vector::zeros(), turned(FRAC_PI_2, rng)),
        Pose::new(Vector::new(offset, 0.0, upper), turned(FRAC_PI_2, rng)),
        // The wrist's first axis is along z of its frame and passes the wrist, wherever that is.
        Pose::new(Vector::new(-offset, fore, 0.0), turned(-FRAC_PI_2, rng)),
        Pose::new(Vector::zeros(), turned(-FRAC_PI_2, rng)),
        Pose::new(Vector::zeros(), turned(FRAC_PI_2, rng)),
    ];
    let joints = places.into_iter().enumerate().map(|(k, parent_from_joint)| ChainJoint {
        parent_from_joint,
        axis: UnitVector::new_normalize(Vector::z()),
        motion: JointMotion::Turn,
        drive: Coupling::independent(k),
    });
    let names = (1..=7).map(|k| format!("j{k}")).collect();
    let (mut lower, mut upper_limits) = (Vec::new(), Vec::new());
    for k in 0..7 {
        let (low, high) = match (k + kind as usize) % 4 {
            0 => (-2.967, 2.967),
            1 => (-rng.uniform(1.0, 2.5), rng.uniform(1.0, 2.5)),
            2 => (-rng.uniform(1.0, 4.0), rng.uniform(1.0, 4.0)),
            _ if kind == 1 => (f64::NEG_INFINITY, f64::INFINITY),
            _ => (-0.785, 2.356),
        };
        lower.push(low);
        upper_limits.push(high);
    }
    let mount = Pose::new(Vector::new(0.01, 0.118, -0.02), Vector::new(0.5, -1.0, 2.0));
    (Chain::new(joints.collect(), names, lower, upper_limits), mount)
}

fn random_joints(chain: &Chain, rng: &mut Rng) -> Vec<f64> {
    let ends = chain.lower.iter().zip(&chain.upper);
    ends.map(|(&low, &high)| rng.uniform(low.max(-PI), high.min(PI))).collect()
}

fn pose_of(chain: &Chain, mount: &Pose, joints: &[f64]) -> Pose {
    let mut poses = Vec::new();
    chain.forward(joints, &mut poses);
    poses[6] * mount
}

/// True where an interval holds the angle, or comes within `slack` of it.
fn holds(family: &Family, angle: f64, slack: f64) -> bool {
    let has = |angle: f64| family.intervals.iter().any(|[start, end]| (start - slack..=end + slack).contains(&angle));
    has(angle) || has(angle + TAU) || has(angle - TAU)
}

/// The family that has the posture at its own free angle, within one of its intervals.
fn covers(ik: &ArmIk, families: &[Family], joints: &[f64]) -> bool {
    families.iter().any(|family| {
        let free = ik.free_angle(family, joints);
        holds(family, free, 1e-7)
            && ik.posture(family, free, joints).is_some_and(|found| difference(&found, joints) < 1e-4)
    })
}

fn every_posture_is_found(n_poses: u64) {
    let mut worst: f64 = 0.0;
    let mut n_checked = 0u64;
    let per_arm = 500;
    for index in 0..n_poses / per_arm {
        let mut rng = Rng::keyed(7, "S-R-S", index);
        let (chain, mount) = arm(index % 3, &mut rng);
        let ik = ArmIk::of_chain(&chain, &mount).expect("seven joints");
        assert!(ik.has_closed_form(), "arm {index}");
        for pose in 0..per_arm {
            let joints = random_joints(&chain, &mut rng);
            let target = pose_of(&chain, &mount, &joints);
            let families = ik.families(&target).expect("a closed form");
            let families = families.unwrap_or_else(|error| panic!("arm {index} pose {pose}: {error}"));
            assert!(covers(&ik, &families, &joints), "arm {index} pose {pose}: {joints:?} is not found");
            // Postures inside of the intervals reach the pose and keep the limits.
            for family in &families {
                for [start, end] in &family.intervals {
                    assert!(*start >= -PI - 1e-12 && *start < PI && end > start && *end <= start + TAU + 1e-12);
                    let free = start + (end - start) * rng.uniform(0.01, 0.99);
                    let found = ik.posture(family, free, &joints);
                    let found = found.unwrap_or_else(|| panic!("arm {index} pose {pose}: nothing at {free}"));
                    assert!(chain.within_limits(&found, 0.0));
                    worst = worst.max(miss(&chain, &mount, &found, &target));
                    n_checked += 1;
                }
            }
        }
    }
    assert!(worst < 1e-9, "{worst:e}");
    assert!(n_checked > n_poses, "{n_checked}");
}

#[test]
fn every_posture_is_found_and_every_found_one_reaches_the_pose() {
    every_posture_is_found(30_000);
}

#[test]
#[ignore = "long: a million poses"]
fn every_posture_of_a_million_is_found() {
    every_posture_is_found(1_000_000);
}

/// The branches at a free angle by brute force: a grid of signs of a second way to write the three-axis decomposition would share its
/// algebra, so this walks along the self-motion of the arm by its Jacobian alone.
#[test]
fn walks_along_the_self_motion_stay_inside_the_intervals() {
    let (mut n_inside, mut n_at_limits) = (0, 0);
    for index in 0..60 {
        let mut rng = Rng::keyed(3, "self-motion", index);
        let (chain, mount) = arm(index % 3, &mut rng);
        let ik = ArmIk::of_chain(&chain, &mount).unwrap();
        let mut joints = random_joints(&chain, &mut rng);
        let target = pose_of(&chain, &mount, &joints);
        let families = ik.families(&target).unwrap().unwrap();
        let mut way: Option<SVector<f64, 7>> = None;
        for _ in 0..1500 {
            let last = pose_of(&chain, &Pose::identity(), &joints);
            let columns = twists(&chain, &joints, &Point::from(last.translation.vector));
            let jacobian = SMatrix::<f64, 6, 7>::from_fn(|row, k| columns[k][row / 3][row % 3]);
            let square = jacobian * jacobian.transpose();
            let Some(inverse) = square.try_inverse().filter(|inverse| inverse.amax() < 1e6) else { break };
            let start = way.unwrap_or_else(|| SVector::from_fn(|_, _| rng.uniform(-1.0, 1.0)));
            let null = start - jacobian.transpose() * (inverse * (jacobian * start));
            let step = null / null.norm();
            way = Some(step);
            joints.iter_mut().zip(step.iter()).for_each(|(joint, step)| *joint += 0.01 * step);
            // Back to the pose.
            for _ in 0..3 {
                let now = pose_of(&chain, &mount, &joints);
                let moved = target.translation.vector - now.translation.vector;
                let turned = regrasp_geometry::frame::rotation_between(&now, &target);
                let at_mount = Point::from(now.translation.vector);
                let columns = twists(&chain, &joints, &at_mount);
                let jacobian = SMatrix::<f64, 6, 7>::from_fn(|row, k| columns[k][row / 3][row % 3]);
                let error = SVector::<f64, 6>::new(moved.x, moved.y, moved.z, turned.x, turned.y, turned.z);
                let Some(inverse) = (jacobian * jacobian.transpose()).try_inverse() else { break };
                let back = jacobian.transpose() * (inverse * error);
                joints.iter_mut().zip(back.iter()).for_each(|(joint, back)| *joint += back);
            }
            if miss(&chain, &mount, &joints, &target) > 1e-9 {
                break;
            }
            let room = chain.limit_distance(&joints);
            if room > 1e-6 {
                assert!(covers(&ik, &families, &joints), "arm {index}: {joints:?}");
                n_inside += 1;
            } else if room < -1e-6 {
                // Another turn of the same joints may be within the limits.
                let has_turn = |k: usize| {
                    let turns = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|n| joints[k] + TAU * n);
                    turns.iter().any(|&q| q > chain.lower[k] - 1e-6 && q < chain.upper[k] + 1e-6)
                };
                assert_eq!(covers(&ik, &families, &joints), (0..7).all(has_turn), "arm {index}: {joints:?}");
                n_at_limits += 1;
            }
        }
    }
    assert!(n_inside > 10_000 && n_at_limits > 1_000, "{n_inside} {n_at_limits}");
}

#[test]
fn intervals_are_those_of_a_fine_grid_over_the_free_angle() {
    let mut n_borders = 0;
    for index in 0..300 {
        let mut rng = Rng::keyed(5, "grid", index);
        let (chain, mount) = arm(index % 3, &mut rng);
        let ik = ArmIk::of_chain(&chain, &mount).unwrap();
        let target = pose_of(&chain, &mount, &random_joints(&chain, &mut rng));
        let families = ik.families(&target).unwrap().unwrap();
        for family in &families {
            n_borders += family.intervals.len();
            for k in 0..2000 {
                let free = -PI + TAU * f64::from(k) / 2000.0;
                let is_feasible = ik.posture(family, free, &[0.0; 7]).is_some();
                // Near a border rounding may decide either way.
                let (inside, near) = (holds(family, free, -1e-7), holds(family, free, 1e-7));
                assert!(if is_feasible { near } else { !inside }, "arm {index} at {free}");
            }
        }
    }
    assert!(n_borders > 500, "{n_borders}");
}

#[test]
fn solutions_come_nearest_first_and_keep_the_limits() {
    for index in 0..200 {
        let mut rng = Rng::keyed(9, "solve", index);
        let (chain, mount) = arm(index % 3, &mut rng);
        let ik = ArmIk::of_chain(&chain, &mount).unwrap();
        let joints = random_joints(&chain, &mut rng);
        let target = pose_of(&chain, &mount, &joints);
        let found = ik.solve(&target, &joints, &IkBudget::default()).unwrap();
        // The posture itself is among them, because its own free angle is looked at.
        assert!(difference(&found[0].joints, &joints) < 1e-6, "arm {index}");
        let distances: Vec<f64> = found
            .iter()
            .map(|one| one.joints.iter().zip(&joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
            .collect();
        assert!(distances.is_sorted() && found.len() > 1);
        for one in &found {
            assert!(miss(&chain, &mount, &one.joints, &target) < 1e-9 && chain.within_limits(&one.joints, 0.0));
        }
        assert_eq!(ik.solve(&target, &joints, &IkBudget::default()).unwrap(), found);
    }
}

#[test]
fn what_is_out_of_reach_says_by_how_much() {
    let mut rng = Rng::keyed(1, "reach", 0);
    let (chain, mount) = arm(0, &mut rng);
    let ik = ArmIk::of_chain(&chain, &mount).unwrap();
    let joints = [0.3, 0.4, 0.1, 0.0, 0.2, 0.3, 0.1];
    let stretched = pose_of(&chain, &mount, &joints);
    let shoulder = Vector::new(0.1, -0.2, 0.3);
    let mut poses = Vec::new();
    chain.forward(&joints, &mut poses);
    let wrist = poses[4].translation.vector;
    assert!(ik.solve(&stretched, &joints, &IkBudget::default()).is_ok());
    let out = 0.05 * (wrist - shoulder).normalize();
    let farther = nalgebra::Translation3::from(out) * stretched;
    match ik.solve(&farther, &joints, &IkBudget::default()) {
        Err(Unreachable::TooFar { by }) => assert!((by - 0.05).abs() < 1e-9, "{by}"),
        other => panic!("{other:?}"),
    }
    let inside = nalgebra::Translation3::from(shoulder - wrist) * stretched;
    assert!(matches!(ik.solve(&inside, &joints, &IkBudget::default()), Err(Unreachable::TooNear { by }) if by > 0.0));
    // A last joint that may not turn: the pose turned about its axis by 0.2 rad is out of its limits by as much at most.
    let (mut lower, mut upper) = (chain.lower.clone(), chain.upper.clone());
    for k in 0..7 {
        (lower[k], upper[k]) = (joints[k] - 1e-3, joints[k] + 1e-3);
    }
    let narrow = Chain::new(chain.joints.clone(), chain.names.clone(), lower, upper);
    let narrow = ArmIk::of_chain(&narrow, &mount).unwrap();
    let axis = UnitVector::new_normalize(poses[6].rotation * Vector::z());
    let about = Pose::from_parts(
        (wrist - Vector::from(nalgebra::UnitQuaternion::from_axis_angle(&axis, 0.2) * wrist)).into(),
        nalgebra::UnitQuaternion::from_axis_angle(&axis, 0.2),
    );
    match narrow.solve(&(about * stretched), &joints, &IkBudget::default()) {
        Err(Unreachable::Limits { by, .. }) => assert!(by > 0.0 && by < 0.2, "{by}"),
        other => panic!("{other:?}"),
    }
    let five = Chain::new(chain.joints[..5].to_vec(), chain.names[..5].to_vec(), vec![-1.0; 5], vec![1.0; 5]);
    assert!(ArmIk::of_chain(&five, &mount).is_none());
}
