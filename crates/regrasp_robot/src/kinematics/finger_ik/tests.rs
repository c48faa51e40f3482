//! Inverse kinematics against brute force: a dense grid of seeds, each polished by plain Newton steps.

use super::*;
use crate::coupling::{Coupling, LinearLimit};
use crate::kinematics::samples::*;
use crate::places::shared_models;
use nalgebra::{DVector, Matrix3};
use regrasp_geometry::{Vector, frame};

/// Every solution strictly inside the limits that Newton steps find from a grid of `n` values per coordinate.
fn brute_force(chain: &Chain, center: &Point, target: &Point, n: usize) -> Vec<DVector<f64>> {
    let mut found: Vec<DVector<f64>> = Vec::new();
    let mut poses = Vec::new();
    for cell in 0..n.pow(3) {
        let mut q = DVector::from_fn(3, |k, _| {
            let i = (cell / n.pow(k as u32)) % n;
            chain.lower[k] + (chain.upper[k] - chain.lower[k]) * (i as f64 + 0.5) / n as f64
        });
        for _ in 0..12 {
            chain.forward(q.as_slice(), &mut poses);
            let tip = poses[2] * center;
            let error = target - tip;
            if error.norm() < 1e-11 {
                break;
            }
            let jacobian = chain.jacobian(&poses, &tip);
            let square = Matrix3::from_columns(&[jacobian.column(0), jacobian.column(1), jacobian.column(2)]);
            let Some(step) = square.try_inverse().map(|inverse| inverse * error) else { break };
            if step.norm() > 1.0 {
                break;
            }
            q += step;
        }
        chain.forward(q.as_slice(), &mut poses);
        let solved = (poses[2] * center - target).norm() < 1e-10 && chain.within_limits(q.as_slice(), 1e-6);
        if solved && !found.iter().any(|other| (other - &q).amax() < 1e-5) {
            found.push(q);
        }
    }
    found
}

fn check_solution(ik: &FingerIk, target: &Point, solution: &[f64], margin: f64) {
    let mut poses = Vec::new();
    ik.chain.forward(solution, &mut poses);
    let tip = poses[poses.len() - 1] * ik.center_in_body;
    assert!((tip - target).norm() < POSITION_TOLERANCE, "tip off by {:e}", (tip - target).norm());
    assert!(
        ik.chain.within_limits(solution, margin - 1e-12),
        "{solution:?} beyond {:?}",
        ik.chain.limit_distance(solution)
    );
}

/// Compares with brute force over random targets; returns the most branches seen.
fn compare(chain: &Chain, center: &Point, n_targets: usize, rng: &mut Rng) -> usize {
    let ik = FingerIk::new(chain, center);
    assert!(ik.is_closed_form());
    let mut most = 0;
    for _ in 0..n_targets {
        let q = random_coordinates(chain, rng);
        let target = ik.tip(&q);
        let mut solutions = Vec::new();
        ik.solve_all(&target, &IkSettings::default(), &mut solutions);
        most = most.max(solutions.len());
        for solution in &solutions {
            check_solution(&ik, &target, solution, 0.0);
        }
        let has = |wanted: &[f64]| solutions.iter().any(|s| s.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-4));
        assert!(has(&q), "{q:?} is not among {solutions:?}");
        let brute = brute_force(chain, center, &target, 10);
        for other in &brute {
            assert!(has(other.as_slice()), "brute force found {other:?} besides {solutions:?}");
        }
    }
    most
}

#[test]
fn closed_form_misses_no_branch_of_random_geometries() {
    let mut rng = Rng::keyed(1, "random_3r", 0);
    let most = (0..40)
        .map(|_| {
            let (chain, center) = random_turning(3, 3.0, &mut rng);
            compare(&chain, &center, 4, &mut rng)
        })
        .max();
    assert_eq!(most, Some(4), "no geometry had four branches: the test is too easy");
}

#[test]
fn closed_form_misses_no_branch_of_special_geometries() {
    let mut rng = Rng::keyed(2, "special_3r", 0);
    let z = Vector::zeros();
    let limits = 3.1;
    let link = |x: f64, y: f64, w: f64| Vector::new(x, y, w);
    // First two meeting and the last two parallel; the same with offsets; first two parallel; nearly meeting;
    // nearly parallel; last two meeting.
    let arms: [[(Vector, Vector); 3]; 7] = [
        [(z, Vector::x()), (z, Vector::y()), (link(0.0, 0.0, 0.05), Vector::y())],
        [(z, Vector::x()), (link(0.0, 0.0, 0.016), Vector::y()), (link(0.003, 0.01, 0.05), Vector::y())],
        [(z, Vector::x()), (link(0.0, 0.03, 0.0), Vector::x()), (link(0.0, 0.02, 0.04), Vector::y())],
        [(z, Vector::x()), (link(0.0, 0.0, 1e-6), Vector::y()), (link(0.0, 0.0, 0.05), Vector::y())],
        [(z, Vector::x()), (link(0.0, 0.03, 0.0), link(1.0, 1e-6, 0.0)), (link(0.0, 0.02, 0.04), Vector::y())],
        [(z, Vector::x()), (link(0.0, 0.0, 2e-9), link(1e-9, 1.0, 0.0)), (link(0.0, 0.0, 0.05), Vector::y())],
        [(z, Vector::z()), (link(0.01, 0.02, 0.04), Vector::x()), (z, Vector::y())],
    ];
    for arm in &arms {
        let joints: Vec<_> = arm.iter().map(|(origin, axis)| (*origin, z, *axis, -limits, limits)).collect();
        compare(&turning(&joints), &Point::new(0.004, 0.01, 0.05), 6, &mut rng);
    }
    let (chain, center) = wide_finger();
    compare(&chain, &center, 20, &mut rng);
}

#[test]
fn closed_form_misses_no_branch_of_real_hands() {
    let Some(models) = shared_models() else { return };
    let mut rng = Rng::keyed(3, "real_3r", 0);
    for (file, tip) in [
        ("dclaw/dclaw.urdf", "link_f1_head"),
        ("dclaw/dclaw.urdf", "link_f2_head"),
        ("trifingerpro/trifingerpro.urdf", "finger_tip_link_0"),
        ("trifingerpro/trifingerpro.urdf", "finger_tip_link_120"),
        ("trifingeredu/trifingeredu.urdf", "finger_tip_link_0"),
    ] {
        let (chain, center) = urdf_chain(&models.join("hands").join(file), tip, Point::origin());
        compare(&chain, &center, 10, &mut rng);
    }
}

#[test]
fn a_driven_coordinate_order_and_ratio_is_respected() {
    let mut rng = Rng::keyed(4, "ratio", 0);
    let (chain, center) = wide_finger();
    let mut joints = chain.joints.clone();
    joints[0].drive = Coupling::independent(2);
    joints[2].drive = Coupling::independent(0);
    joints[1].drive = Coupling::one(1, -0.5, 0.2);
    let chain = Chain::new(joints, chain.names.clone(), vec![-1.0, -1.5, -0.5], vec![1.5, 1.5, 0.6]);
    compare(&chain, &center, 20, &mut rng);
}

#[test]
fn a_margin_removes_what_is_too_near_to_the_limits() {
    let (chain, center) = wide_finger();
    let ik = FingerIk::new(&chain, &center);
    let near_limit = [0.0, 0.0, chain.upper[2] - 0.01];
    let target = ik.tip(&near_limit);
    let solve = |limit_margin| {
        let mut solutions = Vec::new();
        ik.solve_all(&target, &IkSettings { limit_margin, ..IkSettings::default() }, &mut solutions);
        solutions.len()
    };
    assert_eq!((solve(0.0), solve(0.005), solve(0.02)), (1, 1, 0));
    let mut nothing = Vec::new();
    ik.solve_all(&Point::new(f64::NAN, 0.0, 0.0), &IkSettings::default(), &mut nothing);
    ik.solve_all(&Point::new(1.0, 0.0, 0.0), &IkSettings::default(), &mut nothing);
    assert!(nothing.is_empty());
}

#[test]
fn tracking_stays_on_the_branch_or_refuses() {
    let mut rng = Rng::keyed(5, "track", 0);
    let mut n_reached = 0;
    for _ in 0..60 {
        let (chain, center) = random_turning(3, 2.5, &mut rng);
        let ik = FingerIk::new(&chain, &center);
        let (from, to) = (random_coordinates(&chain, &mut rng), random_coordinates(&chain, &mut rng));
        let targets: Vec<Point> = (1..=40)
            .map(|i| {
                let share = f64::from(i) / 40.0;
                let q: Vec<f64> = from.iter().zip(&to).map(|(a, b)| a + share * (b - a)).collect();
                ik.tip(&q)
            })
            .collect();
        let mut path = Vec::new();
        let outcome = ik.track(&from, &targets, &IkSettings::default(), &mut path);
        for (i, q) in path.iter().enumerate() {
            check_solution(&ik, &targets[i], q, 0.0);
            // The joint line itself is the continuous answer until it meets a singularity, where tracking refuses.
            let share = (i + 1) as f64 / 40.0;
            let known = from.iter().zip(&to).map(|(a, b)| a + share * (b - a));
            assert!(known.zip(q).all(|(a, b)| (a - b).abs() < 1e-6), "left the branch; {outcome:?}");
        }
        n_reached += path.len();
    }
    assert!(n_reached > 1200, "{n_reached} of 2400 waypoints before a singularity");
}

/// Share of random reachable targets that are solved, with `preference` or not.
fn success(ik: &FingerIk, n_targets: usize, preference: bool, rng: &mut Rng) -> f64 {
    let mut n_solved = 0;
    for _ in 0..n_targets {
        let target = ik.tip(&random_coordinates(ik.chain(), rng));
        let tip_axis_in_base = UnitVector::new_normalize(Vector::from(rng.direction()));
        let preference = preference.then_some(Preference { tip_axis_in_base, weight: 1.0, damping: 0.0 });
        if let Some(found) = ik.solve_random(&target, &IkSettings { preference, ..IkSettings::default() }, rng) {
            check_solution(ik, &target, &found, 0.0);
            n_solved += 1;
        }
    }
    f64::from(n_solved) / n_targets as f64
}

#[test]
fn numeric_solves_nearly_all_reachable_targets_of_allegro() {
    let Some(models) = shared_models() else { return };
    let mut rng = Rng::keyed(6, "allegro", 0);
    for tip in ["link_3.0_tip", "link_7.0_tip", "link_11.0_tip", "link_15.0_tip"] {
        let path = models.join("hands/allegro/allegro_right.urdf");
        let (chain, center) = urdf_chain(&path, tip, Point::new(0.0, 0.0, -0.012));
        let ik = FingerIk::new(&chain, &center);
        assert!(!ik.is_closed_form() && ik.is_redundant());
        let (plain, turned) = (success(&ik, 2000, false, &mut rng), success(&ik, 2000, true, &mut rng));
        assert!(plain >= 0.97 && turned >= 0.99, "{tip}: {plain} {turned}");
    }
}

#[test]
fn numeric_solves_nearly_all_reachable_targets_of_random_chains() {
    let mut rng = Rng::keyed(7, "random_4r", 0);
    let mut worst: f64 = 1.0;
    for n in [4, 4, 4, 5, 7] {
        let (chain, center) = random_turning(n, 1.0, &mut rng);
        let share = success(&FingerIk::new(&chain, &center), 400, false, &mut rng);
        worst = worst.min(share);
    }
    assert!(worst > 0.9, "{worst}");
}

/// `chain` with joint `which` sliding, by 35 mm.
fn with_slide(chain: &Chain, which: usize) -> Chain {
    let (mut joints, mut lower, mut upper) = (chain.joints.clone(), chain.lower.clone(), chain.upper.clone());
    joints[which].motion = JointMotion::Slide;
    (lower[which], upper[which]) = (-0.01, 0.025);
    Chain::new(joints, chain.names.clone(), lower, upper)
}

#[test]
fn numeric_solves_nearly_all_reachable_targets_of_chains_with_slides() {
    let mut rng = Rng::keyed(19, "slides", 0);
    for (n, which) in [(4, 0), (4, 2), (5, 1), (3, 0)] {
        let (turning, center) = random_turning(n, 1.0, &mut rng);
        let ik = FingerIk::new(&with_slide(&turning, which), &center);
        let (plain, turned) = (success(&ik, 400, false, &mut rng), success(&ik, 400, true, &mut rng));
        assert!(plain > 0.9 && turned > 0.9, "{n} joints, {which} slides: {plain} {turned}");
    }
}

#[test]
fn numeric_finds_the_branches_of_the_closed_form() {
    let mut rng = Rng::keyed(8, "both", 0);
    let (mut n_known, mut n_found) = (0, 0);
    for _ in 0..10 {
        let (chain, center) = random_turning(3, 1.5, &mut rng);
        let closed = FingerIk::new(&chain, &center);
        let numeric = FingerIk {
            method: Method::Numeric(Box::new(NumericIk::new(&chain, &center))),
            chain,
            center_in_body: center,
            reaches_points: true,
        };
        for _ in 0..20 {
            let target = closed.tip(&random_coordinates(closed.chain(), &mut rng));
            let (mut known, mut found) = (Vec::new(), Vec::new());
            closed.solve_all(&target, &IkSettings::default(), &mut known);
            numeric.solve_all(&target, &IkSettings::default(), &mut found);
            for q in &found {
                check_solution(&numeric, &target, q, 0.0);
                assert!(known.iter().any(|k| k.iter().zip(q).all(|(a, b)| (a - b).abs() < 1e-4)), "{q:?} {known:?}");
            }
            n_known += known.len();
            n_found += found.len();
        }
    }
    assert!(n_found as f64 > 0.97 * n_known as f64, "numeric found {n_found} of {n_known} branches");
}

#[test]
fn the_null_space_turns_the_tip_to_the_preference() {
    let mut rng = Rng::keyed(9, "preference", 0);
    let (mut plain_sum, mut turned_sum, mut best_sum, mut n_compared) = (0.0, 0.0, 0.0, 0);
    let (chain, center) = random_turning(4, 1.0, &mut rng);
    let ik = FingerIk::new(&chain, &center);
    let tip_axis = |q: &[f64]| ik.chain.last_frame(q).vector(&center.coords.normalize());
    for _ in 0..200 {
        let q = random_coordinates(&chain, &mut rng);
        let target = ik.tip(&q);
        let wish = Vector::from(rng.direction());
        let preference =
            Some(Preference { tip_axis_in_base: UnitVector::new_normalize(wish), weight: 1.0, damping: 0.0 });
        let settings = IkSettings { preference, ..IkSettings::default() };
        let Some(turned) = ik.solve_random(&target, &settings, &mut rng) else { continue };
        let Some(plain) = ik.solve_random(&target, &IkSettings::default(), &mut rng) else { continue };
        let mut all = Vec::new();
        ik.solve_all(&target, &IkSettings::default(), &mut all);
        plain_sum += tip_axis(&plain).dot(&wish);
        turned_sum += tip_axis(&turned).dot(&wish);
        best_sum += all.iter().map(|q| tip_axis(q).dot(&wish)).fold(-1.0, f64::max);
        n_compared += 1;
    }
    let n = f64::from(n_compared);
    let (plain, turned, best) = (plain_sum / n, turned_sum / n, best_sum / n);
    let told =
        format!("mean cosine to the preference: {plain:.3} without, {turned:.3} with, {best:.3} best of all seeds");
    assert!(turned > plain + 0.5 * (best - plain), "{told}");
}

#[test]
fn solve_many_gives_different_solutions() {
    let mut rng = Rng::keyed(10, "many", 0);
    let (chain, center) = random_turning(4, 1.5, &mut rng);
    let ik = FingerIk::new(&chain, &center);
    let mut n_solutions = 0;
    for _ in 0..50 {
        let target = ik.tip(&random_coordinates(&chain, &mut rng));
        let mut solutions = Vec::new();
        ik.solve_many(&target, 5, &IkSettings::default(), &mut rng, &mut solutions);
        assert!(solutions.len() <= 5);
        for (i, a) in solutions.iter().enumerate() {
            check_solution(&ik, &target, a, 0.0);
            assert!(solutions[..i].iter().all(|b| a.iter().zip(b).any(|(x, y)| (x - y).abs() >= 0.05)));
        }
        n_solutions += solutions.len();
    }
    assert!(n_solutions >= 150, "{n_solutions} solutions of 250 asked");
}

#[test]
fn redundant_tracking_moves_little_and_stays_on_target() {
    let mut rng = Rng::keyed(11, "track_4r", 0);
    let (mut n_reached, mut n_wanted, mut largest): (usize, usize, f64) = (0, 0, 0.0);
    for _ in 0..40 {
        let (chain, center) = random_turning(4, 1.0, &mut rng);
        let ik = FingerIk::new(&chain, &center);
        let (from, to) = (random_coordinates(&chain, &mut rng), random_coordinates(&chain, &mut rng));
        let at = |share: f64| -> Vec<f64> { from.iter().zip(&to).map(|(a, b)| a + share * (b - a)).collect() };
        let targets: Vec<Point> = (1..=60).map(|i| ik.tip(&at(f64::from(i) / 60.0))).collect();
        let mut path = Vec::new();
        let _ = ik.track(&from, &targets, &IkSettings::default(), &mut path);
        let mut previous: Coordinates = from.iter().copied().collect();
        for (target, q) in targets.iter().zip(&path) {
            check_solution(&ik, target, q, 0.0);
            largest = q.iter().zip(&previous).map(|(a, b)| (a - b).abs()).fold(largest, f64::max);
            previous.clone_from(q);
        }
        n_reached += path.len();
        n_wanted += targets.len();
    }
    let told = format!("{n_reached} of {n_wanted} waypoints, largest step {largest:.3} rad");
    assert!(largest <= 0.4 && n_reached * 10 >= n_wanted * 8, "{told}");
}

/// A point of the last body is moved and the body is turned about an axis at once; both come out, by the frames alone.
#[test]
fn chains_with_a_joint_to_spare_turn_as_asked_while_they_move() {
    let mut rng = Rng::keyed(11, "turns", 0);
    let mut n_made = 0;
    for n in [4, 5, 6] {
        for _ in 0..60 {
            let (chain, center) = random_turning(n, 0.12, &mut rng);
            let start = random_coordinates(&chain, &mut rng);
            let ik = FingerIk::new(&chain, &center);
            let from = chain.last_frame(&start);
            let (axis, angle) = (Vector::from(rng.direction()), rng.uniform(-0.01, 0.01));
            let target = from.point(&center) + Vector::from(rng.direction()) * 0.0005;
            let about = |link: &BodyFrame| frame::turn_between(&from.rotation, &link.rotation).dot(&axis);
            let asked = |link: &BodyFrame| {
                let turn = Some(AskedTurn { axis, left: angle - about(link) });
                Some(Asked { error: target - link.point(&center), arm: Vector::zeros(), travel: None, turn })
            };
            let Some(found) = ik.follow(&start, &IkSettings::default(), asked) else { continue };
            let link = chain.last_frame(&found);
            assert!((link.point(&center) - target).norm() < 1e-8);
            assert!((about(&link) - angle).abs() < 1e-6);
            n_made += 1;
        }
    }
    assert!(n_made > 90, "too few steps were made: {n_made} of 180");
}

/// Against a small step of [`FingerIk::follow`] of a chain that has no choice.
#[test]
fn the_turn_per_motion_is_that_of_a_small_step() {
    let (chain, center) = wide_finger();
    let ik = FingerIk::new(&chain, &center);
    let mut rng = Rng::keyed(12, "turn per motion", 0);
    let mut n_compared = 0;
    for _ in 0..100 {
        let start = random_coordinates(&chain, &mut rng);
        let (axis, shift) = (Vector::from(rng.direction()), Vector::from(rng.direction()) * 1e-6);
        let Some(gradient) = ik.turn_per_motion(&start, &Vector::zeros(), &axis) else { continue };
        let Some(end) = ik.solve_near(&(ik.tip(&start) + shift), &start, &IkSettings::default()) else { continue };
        let (from, to) = (chain.last_frame(&start), chain.last_frame(&end));
        let turn = frame::turn_between(&from.rotation, &to.rotation).dot(&axis);
        if gradient.norm() < 100.0 {
            assert!((turn - gradient.dot(&shift)).abs() < 1e-7, "{turn} {}", gradient.dot(&shift));
            n_compared += 1;
        }
    }
    assert!(n_compared > 50, "too little was compared: {n_compared}");
}

/// A planar finger of four joints whose last joint keeps its link level: `q4 = -q1 - q2 - q3`, within limits of its own.
fn levelled_finger(range: [f64; 2]) -> (Chain, Point) {
    let lengths = [0.05, 0.04, 0.03, 0.02];
    let mut origins = vec![(Vector::zeros(), Vector::zeros(), Vector::x(), -1.5, 1.5)];
    for length in &lengths[..3] {
        origins.push((Vector::new(0.0, 0.0, *length), Vector::zeros(), Vector::y(), -1.5, 1.5));
    }
    let wide = turning(&origins);
    let mut joints = wide.joints.clone();
    joints.push(joints[3].clone());
    joints[4].parent_from_joint.translation.vector = Vector::new(0.0, 0.0, lengths[3]);
    let terms = [(1, -1.0), (2, -1.0), (3, -1.0)];
    joints[4].drive = Coupling { terms: terms.into_iter().collect(), offset: 0.1 };
    let limit = LinearLimit::new("last".into(), &joints[4].drive, range);
    let chain = Chain::new(joints, wide.names.clone(), wide.lower.clone(), wide.upper.clone());
    (chain.with_linear_limits(vec![limit]), Point::new(0.0, 0.0, 0.03))
}

#[test]
fn limits_of_a_joint_with_several_leaders_are_kept_and_reached() {
    let mut rng = Rng::keyed(11, "levelled", 0);
    let range = [-0.4, 0.9];
    let (chain, center) = levelled_finger(range);
    let ik = FingerIk::new(&chain, &center);
    let inside = |q: &[f64]| {
        let last = 0.1 - q[1] - q[2] - q[3];
        (range[0]..=range[1]).contains(&last) && q.iter().all(|q| q.abs() <= 1.5)
    };
    let (mut found, mut on_limit, mut asked) = (0, 0, 0);
    while asked < 200 {
        let q: Vec<f64> = (0..4).map(|_| rng.uniform(-1.5, 1.5)).collect();
        if !inside(&q) {
            continue;
        }
        asked += 1;
        let target = ik.tip(&q);
        for settings in [0.0, 0.02].map(|limit_margin| IkSettings { limit_margin, ..IkSettings::default() }) {
            let Some(joints) = ik.solve_random(&target, &settings, &mut rng) else { continue };
            assert!(inside(&joints) && (ik.tip(&joints) - target).norm() < POSITION_TOLERANCE);
            assert!(chain.linear_limits[0].room(&joints) >= settings.limit_margin);
            if settings.limit_margin == 0.0 {
                found += 1;
                on_limit += usize::from(chain.linear_limits[0].room(&joints) < 1e-6);
            }
        }
    }
    // Some targets are met with the sum on its limit, where clamping alone would have lost them.
    assert!(found >= 195 && on_limit >= 8, "{found} of 200 found, {on_limit} of them on the limit");
}

#[test]
fn jacobians_with_several_leaders_agree_with_finite_differences() {
    let mut rng = Rng::keyed(12, "levelled jacobian", 0);
    let (chain, center) = levelled_finger([-9.0, 9.0]);
    let ik = FingerIk::new(&chain, &center);
    for _ in 0..50 {
        let q: Vec<f64> = (0..4).map(|_| rng.uniform(-1.5, 1.5)).collect();
        let mut poses = Vec::new();
        chain.forward(&q, &mut poses);
        let tip = ik.tip(&q);
        assert!((poses[4] * center - tip).norm() < 1e-15);
        let columns = ik.tip_jacobian(&q);
        let of_chain = chain.jacobian(&poses, &tip);
        let twists = crate::kinematics::whole_pose::twists(&chain, &q, &tip);
        for k in 0..4 {
            let [low, high] = [-1e-6, 1e-6].map(|step| {
                let mut moved = q.clone();
                moved[k] += step;
                ik.tip(&moved)
            });
            let difference = (high - low) / 2e-6;
            for column in [columns[k], of_chain.column(k).into_owned(), twists[k][0]] {
                assert!((column - difference).norm() < 1e-9);
            }
        }
    }
}
