//! Force distribution against another solver, closed forms and finite differences.

use crate::sample::{FRAME, columns, grips, models, soft};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use regrasp_base::Rng;
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_grasp::wrench::any_direction::{answer, reserves};
use regrasp_grasp::wrench::{
    BalancedForces, JointRow, JointRows, Reserve, Rubbing, any_inside, can_balance, distribute,
};
use regrasp_grasp::{
    Contact, ContactForce, ContactModel, ForceLimits, ForceProblem, GraspFrame, Grip, NoForces, Wrench,
};

const LIMITS: ForceLimits =
    ForceLimits { least: 2.0, largest: 15.0, squeeze: 4.0, squeeze_weight: 0.2, cone_weight: 0.0 };
/// The barrier's weight, and the number of its logarithms per contact (cone, twice; two bounds) and joint (two bounds).
const BARRIER: f64 = 1e-3 * 16.0;

fn problem<'a>(grips: &'a [Grip], joints: &'a [JointRows], load: Wrench) -> ForceProblem<'a> {
    ForceProblem { grips, joints, reserves: &[], rubbing: &[], frame: &FRAME, load, limits: LIMITS }
}

fn weight(rng: &mut Rng) -> Wrench {
    Wrench::at_center_of_mass(Vector::from(rng.direction()) * rng.uniform(0.0, 3.0))
}

fn joints(n: usize, limit: f64, rng: &mut Rng) -> Vec<JointRows> {
    let row = |rng: &mut Rng| JointRow {
        per_force: Vector::from(rng.direction()) * rng.uniform(0.02, 0.12),
        per_torsion: rng.uniform(-1.0, 1.0),
        limit,
    };
    (0..n).map(|_| (0..4).map(|_| row(rng)).collect()).collect()
}

fn objective(grips: &[Grip], forces: &[ContactForce], friction: f64) -> f64 {
    grips
        .iter()
        .zip(forces)
        .map(|(grip, force)| {
            let c = grip.components(force, friction);
            let off = c.normal - LIMITS.squeeze;
            c.tangential.norm_squared() + c.torsion * c.torsion + LIMITS.squeeze_weight * off * off
        })
        .sum()
}

/// All that is promised of forces, looked at from outside.
fn assert_good(problem: &ForceProblem, forces: &BalancedForces) {
    let rest = problem.load.with_forces(problem.grips, forces, problem.frame);
    let size = 1.0 + forces.iter().map(|f| f.force.norm()).sum::<f64>();
    assert!(rest.force.norm() < 1e-11 * size, "{rest:?}");
    assert!(rest.torque.norm() < 1e-11 * size * problem.frame.torque_scale, "{rest:?}");
    for (i, (grip, force)) in problem.grips.iter().zip(forces).enumerate() {
        let c = grip.components(force, problem.frame.friction);
        assert!(grip.depth(&c, problem.frame.friction) > 0.0, "{c:?}");
        assert!(c.normal > problem.limits.least && c.normal < problem.limits.largest, "{c:?}");
        // Nothing is exerted that the model does not transmit.
        let back = grip.force(&c);
        assert!((back.force - force.force).norm() < 1e-12 && (back.torsion - force.torsion).abs() < 1e-12);
        for joint in problem.joints.get(i).into_iter().flatten() {
            assert!(joint.torque(force).abs() < joint.limit);
        }
    }
}

/// Columns of a contact of the problem: a single one where it slides.
fn columns_at(problem: &ForceProblem, index: usize) -> Vec<[f64; 6]> {
    let grip = &problem.grips[index];
    let Some(friction) = problem.rubbing.get(index).and_then(|rubbing| rubbing.sliding) else {
        return columns(grip, problem.frame);
    };
    let force = friction - grip.contact.normal_in_object.into_inner();
    let arm = grip.contact.point_in_object - problem.frame.center_of_mass;
    let moment = arm.cross(&force) / problem.frame.torque_scale;
    vec![[force.x, force.y, force.z, moment.x, moment.y, moment.z]]
}

/// The same program without a barrier, by clarabel: the least objective, or none. The other value is how far all limits
/// have to give for any forces at all: negative where they need not, infinite where no forces whatever balance.
fn by_clarabel(problem: &ForceProblem) -> (Option<f64>, f64) {
    (solve_by_clarabel(problem, false), solve_by_clarabel(problem, true).unwrap_or(f64::INFINITY))
}

fn solve_by_clarabel(problem: &ForceProblem, gives: bool) -> Option<f64> {
    let mu = problem.frame.friction;
    let columns: Vec<Vec<[f64; 6]>> = (0..problem.grips.len()).map(|index| columns_at(problem, index)).collect();
    let n: usize = columns.iter().map(Vec::len).sum();
    let width = n + 1;
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut rhs = Vec::new();
    let all: Vec<[f64; 6]> = columns.iter().flatten().copied().collect();
    let (f, t) = (problem.load.force, problem.load.torque / problem.frame.torque_scale);
    for (k, load) in [f.x, f.y, f.z, t.x, t.y, t.z].into_iter().enumerate() {
        rows.push(all.iter().map(|column| column[k]).chain([0.0]).collect());
        rhs.push(-load);
    }
    // The last unknown is what all limits give: fixed at zero, or minimised.
    let mut push = |entries: &[(usize, f64)], give: f64, bound: f64| {
        let mut row = vec![0.0; width];
        entries.iter().for_each(|&(i, value)| row[i] = value);
        row[n] = give;
        rows.push(row);
        rhs.push(bound);
    };
    let mut n_zero = 6;
    if !gives {
        push(&[(n, 1.0)], 1.0, 0.0);
        n_zero += 1;
    }
    let mut n_linear = 0;
    let mut start = 0;
    for (i, of_grip) in columns.iter().enumerate() {
        push(&[(start, -1.0)], -1.0, -problem.limits.least);
        push(&[(start, 1.0)], -1.0, problem.limits.largest);
        n_linear += 2;
        for joint in problem.joints.get(i).into_iter().flatten() {
            let scale = problem.limits.largest / joint.limit;
            let grip = &problem.grips[i];
            let torque = |k: usize| {
                let column = of_grip[k];
                let force = Vector::new(column[0], column[1], column[2]);
                let torsion = if k == 3 { grip.torsion_radius() } else { 0.0 };
                joint.torque(&ContactForce { force, torsion }) * scale
            };
            for sign in [1.0, -1.0] {
                let entries: Vec<_> = (0..of_grip.len()).map(|k| (start + k, sign * torque(k))).collect();
                push(&entries, -1.0, problem.limits.largest);
                n_linear += 1;
            }
        }
        start += of_grip.len();
    }
    let mut cones = vec![SupportedConeT::ZeroConeT(n_zero), SupportedConeT::NonnegativeConeT(n_linear)];
    start = 0;
    for of_grip in &columns {
        if of_grip.len() > 1 {
            push(&[(start, -mu)], -1.0, 0.0);
            for k in 1..of_grip.len() {
                push(&[(start + k, -1.0)], 0.0, 0.0);
            }
            cones.push(SupportedConeT::SecondOrderConeT(of_grip.len()));
        }
        start += of_grip.len();
    }
    let mut p = vec![vec![0.0; width]; width];
    let mut q = vec![0.0; width];
    let mut constant = 0.0;
    start = 0;
    for (i, of_grip) in columns.iter().enumerate().filter(|_| !gives) {
        // Less twice the force across the normal times that wished for.
        if let Some(rubbing) = problem.rubbing.get(i) {
            let normal = problem.grips[i].contact.normal_in_object.into_inner();
            let wish = rubbing.wish - normal * normal.dot(&rubbing.wish);
            for (k, column) in of_grip.iter().enumerate() {
                q[start + k] -= 2.0 * wish.dot(&Vector::new(column[0], column[1], column[2]));
            }
        }
        for k in 0..of_grip.len() {
            p[start + k][start + k] = 2.0 * if k == 0 { problem.limits.squeeze_weight } else { 1.0 };
        }
        q[start] -= 2.0 * problem.limits.squeeze_weight * problem.limits.squeeze;
        constant += problem.limits.squeeze_weight * problem.limits.squeeze.powi(2);
        start += of_grip.len();
    }
    if gives {
        q[n] = 1.0;
    }
    let settings = DefaultSettings::<f64> { verbose: false, ..DefaultSettings::default() };
    let (p, a) = (CscMatrix::from(&p), CscMatrix::from(&rows));
    let mut solver = DefaultSolver::new(&p, &q, &a, &rhs, &cones, settings).expect("a well-formed program");
    solver.solve();
    (solver.solution.status == SolverStatus::Solved).then_some(solver.solution.obj_val + constant)
}

#[test]
fn agrees_with_another_solver() {
    let mut rng = Rng::keyed(1, "forces", 0);
    let (mut n_solved, mut n_refused, mut n_band) = (0, 0, 0);
    for round in 0..3000 {
        let n = 2 + rng.below(5);
        let of_points = round % 2 == 0;
        let models = if of_points { vec![ContactModel::Point; n] } else { models(n, &mut rng) };
        let grips = grips(&models, &mut rng);
        let limit = rng.uniform(0.2, 1.0);
        let joints = if round % 3 == 0 { joints(n, limit, &mut rng) } else { Vec::new() };
        let problem = problem(&grips, &joints, weight(&mut rng));
        let ours = distribute(&problem, None);
        assert_eq!(can_balance(&problem), ours.is_ok());
        // Some forces are there where the best are, from any start.
        let cold = any_inside(&problem, None);
        assert_eq!(cold.is_some(), ours.is_ok());
        for found in [&cold, &any_inside(&problem, cold.as_deref()), &any_inside(&problem, ours.as_deref().ok())] {
            assert_eq!(found.is_some(), ours.is_ok());
            found.iter().for_each(|forces| assert_good(&problem, forces));
        }
        if let Ok(forces) = &ours {
            assert_good(&problem, forces);
        }
        let (theirs, give) = by_clarabel(&problem);
        if give.abs() < 2e-3 {
            n_band += 1;
            continue;
        }
        assert_eq!(ours.is_ok(), give < 0.0, "{round}: {ours:?} {theirs:?} {give}");
        match (&ours, theirs) {
            (Ok(forces), Some(theirs)) => {
                let ours = objective(&grips, forces, FRAME.friction);
                let degree = (4 * n + 2 * joints.iter().map(|j| j.len()).sum::<usize>()) as f64;
                assert!(ours > theirs - 1e-6 * (1.0 + theirs), "{ours} {theirs}");
                assert!(ours < theirs + degree * BARRIER + 1e-6, "{ours} {theirs}");
                n_solved += 1;
            }
            _ => n_refused += 1,
        }
    }
    assert!(n_solved > 300 && n_refused > 300 && n_band < 30, "{n_solved} {n_refused} {n_band}");
}

/// Friction of what slides has its full size and its direction; what does not slide is in its cone; wishes count.
#[test]
fn contacts_that_slide_agree_with_another_solver() {
    let mut rng = Rng::keyed(9, "forces", 0);
    let (mut n_solved, mut n_refused, mut n_band) = (0, 0, 0);
    for round in 0..3000 {
        let n = 3 + rng.below(3);
        let grips = grips(&vec![ContactModel::Point; n], &mut rng);
        let rubbing: Vec<Rubbing> = grips
            .iter()
            .map(|grip| {
                let normal = grip.contact.normal_in_object.into_inner();
                let mut across = || Vector::from(rng.direction()).cross(&normal);
                let (along, wish) = (across().normalize(), across() * 2.0);
                Rubbing { sliding: rng.chance(0.4).then_some(along * 0.6), wish }
            })
            .collect();
        let problem = ForceProblem { rubbing: &rubbing, ..problem(&grips, &[], weight(&mut rng)) };
        let ours = distribute(&problem, None);
        assert_eq!(can_balance(&problem), ours.is_ok());
        assert_eq!(any_inside(&problem, None).is_some(), ours.is_ok());
        let (theirs, give) = by_clarabel(&problem);
        if give.abs() < 2e-3 {
            n_band += 1;
            continue;
        }
        assert_eq!(ours.is_ok(), give < 0.0, "{round}: {ours:?} {theirs:?} {give}");
        let (Ok(forces), Some(theirs)) = (&ours, theirs) else {
            n_refused += 1;
            continue;
        };
        n_solved += 1;
        let rest = problem.load.with_forces(&grips, forces, problem.frame);
        assert!(rest.force.norm() < 1e-9 && rest.torque.norm() < 1e-10, "{rest:?}");
        let mut ours = 0.0;
        for ((grip, rubbing), force) in grips.iter().zip(&rubbing).zip(forces) {
            let c = grip.components(force, FRAME.friction);
            assert!(c.normal > LIMITS.least && c.normal < LIMITS.largest);
            ours += LIMITS.squeeze_weight * (c.normal - LIMITS.squeeze).powi(2) - 2.0 * c.tangential.dot(&rubbing.wish);
            match rubbing.sliding {
                Some(friction) => assert!((c.tangential - friction * c.normal).norm() < 1e-12 * c.normal),
                None => {
                    assert!(grip.depth(&c, FRAME.friction) > 0.0, "{c:?}");
                    ours += c.tangential.norm_squared();
                }
            }
        }
        assert!(ours > theirs - 1e-6 * (1.0 + theirs.abs()), "{ours} {theirs}");
        assert!(ours < theirs + 4.0 * n as f64 * BARRIER + 1e-6, "{ours} {theirs}");
    }
    assert!(n_solved > 100 && n_refused > 100 && n_band < 60, "{n_solved} {n_refused} {n_band}");
}

#[test]
fn forces_move_smoothly_with_the_load_and_start_anywhere() {
    let mut rng = Rng::keyed(2, "forces", 0);
    let mut n_paths = 0;
    while n_paths < 40 {
        let models = models(4, &mut rng);
        let grips = grips(&models, &mut rng);
        let joints = joints(4, 0.4, &mut rng);
        let (a, b) = (weight(&mut rng), weight(&mut rng));
        let at = |s: f64| Wrench::at_center_of_mass(a.force.lerp(&b.force, s));
        if distribute(&problem(&grips, &joints, a), None).is_err()
            || distribute(&problem(&grips, &joints, b), None).is_err()
        {
            continue;
        }
        n_paths += 1;
        let mut warm: Option<BalancedForces> = None;
        let solve = |s: f64, warm: Option<&BalancedForces>| {
            distribute(&problem(&grips, &joints, at(s)), warm.map(|w| w.as_slice())).expect("loads are convex")
        };
        let distance = |x: &BalancedForces, y: &BalancedForces| {
            x.iter().zip(y).map(|(x, y)| (x.force - y.force).norm()).fold(0.0, f64::max)
        };
        for k in 0..=20 {
            let s = f64::from(k) / 20.0;
            let here = solve(s, warm.as_ref());
            assert!(distance(&here, &solve(s, None)) < 1e-8, "where it starts does not matter");
            // Second differences fall with the square of the step.
            if k > 0 && k < 20 {
                let bend = |h: f64| {
                    let (low, high) = (solve(s - h, Some(&here)), solve(s + h, Some(&here)));
                    let mean: BalancedForces = low
                        .iter()
                        .zip(&high)
                        .map(|(l, h)| ContactForce { force: (l.force + h.force) / 2.0, torsion: 0.0 })
                        .collect();
                    distance(&mean, &here)
                };
                let (coarse, fine) = (bend(4e-3), bend(1e-3));
                assert!(fine < 0.15 * coarse + 1e-8, "{coarse} {fine}");
            }
            warm = Some(here);
        }
    }
}

fn grip(point: [f64; 3], model: ContactModel) -> Grip {
    let point = Vector::from(point);
    let contact = Contact { point_in_object: Point::from(point), normal_in_object: UnitVector::new_normalize(point) };
    Grip { contact, model }
}

const CENTERED: GraspFrame =
    GraspFrame { center_of_mass: Point::new(0.0, 0.0, 0.0), torque_scale: 0.03, friction: 0.5 };

fn centered<'a>(grips: &'a [Grip], joints: &'a [JointRows], load: Wrench) -> ForceProblem<'a> {
    ForceProblem { frame: &CENTERED, ..problem(grips, joints, load) }
}

#[test]
fn two_opposed_points_carry_a_weight_between_them() {
    let grips = [grip([0.03, 0.0, 0.0], ContactModel::Point), grip([-0.03, 0.0, 0.0], ContactModel::Point)];
    let problem = centered(&grips, &[], Wrench::at_center_of_mass(Vector::new(0.0, 0.0, -1.0)));
    let forces = distribute(&problem, None).expect("friction carries it");
    assert_good(&problem, &forces);
    for (force, side) in forces.iter().zip([-1.0, 1.0]) {
        // Half the weight each; the squeeze but for the barrier, whose pull is known: both bounds and the cone.
        let n = side * force.force.x;
        let cone = 0.5 * (0.25 * n * n - 0.25f64).recip() * n;
        let pull = 0.4 * (n - 4.0) - BARRIER * (1.0 / (n - 2.0) - 1.0 / (15.0 - n) + cone);
        assert!(pull.abs() < 1e-9, "{n} {pull}");
        assert!((force.force.z - 0.5).abs() < 1e-11 && force.force.y.abs() < 1e-11);
    }
    // About the line of the two nothing turns, and nothing presses along it but they.
    let twist = Wrench { force: Vector::zeros(), torque: Vector::new(0.01, 0.0, 0.0) };
    assert_eq!(distribute(&centered(&grips, &[], twist), None), Err(NoForces::NotBalanced));
    let heavy = Wrench::at_center_of_mass(Vector::new(0.0, 0.0, -16.0));
    assert!(matches!(distribute(&centered(&grips, &[], heavy), None), Err(NoForces::LargestNormalForce { .. })));
}

#[test]
fn three_points_around_share_alike() {
    let around = |k: f64| {
        let (y, x) = (k * std::f64::consts::TAU / 3.0).sin_cos();
        grip([0.03 * x, 0.03 * y, 0.0], ContactModel::Point)
    };
    let grips = [around(0.0), around(1.0), around(2.0)];
    let problem = centered(&grips, &[], Wrench::at_center_of_mass(Vector::new(0.0, 0.0, -1.5)));
    let forces = distribute(&problem, None).expect("friction carries it");
    assert_good(&problem, &forces);
    let normals: Vec<f64> = grips.iter().zip(&forces).map(|(g, f)| g.components(f, 0.5).normal).collect();
    for (force, normal) in forces.iter().zip(&normals) {
        assert!((force.force.z - 0.5).abs() < 1e-11);
        assert!((normal - normals[0]).abs() < 1e-9);
        let cone = 0.5 * (0.25 * normal * normal - 0.25f64).recip() * normal;
        let pull = 0.4 * (normal - 4.0) - BARRIER * (1.0 / (normal - 2.0) - 1.0 / (15.0 - normal) + cone);
        assert!(pull.abs() < 1e-9, "{normal}");
    }
}

#[test]
fn a_soft_pair_carries_torsion() {
    let grips = [grip([0.03, 0.0, 0.0], soft(0.006)), grip([-0.03, 0.0, 0.0], soft(0.006))];
    let twist = |moment: f64| Wrench { force: Vector::zeros(), torque: Vector::new(moment, 0.0, 0.0) };
    let held = centered(&grips, &[], twist(0.02));
    let forces = distribute(&held, None).expect("two patches hold 0.006 * 0.5 * 15 N m each");
    assert_good(&held, &forces);
    assert!((forces[0].torsion + 0.01).abs() < 1e-12 && (forces[1].torsion - 0.01).abs() < 1e-12);
    // 2 * 0.006 * 0.5 * 15 = 0.09.
    assert!(distribute(&centered(&grips, &[], twist(0.089)), None).is_ok());
    assert!(matches!(distribute(&centered(&grips, &[], twist(0.091)), None), Err(NoForces::LargestNormalForce { .. })));
}

#[test]
fn what_binds_is_named() {
    let grips = [grip([0.03, 0.0, 0.0], ContactModel::Point), grip([-0.03, 0.0, 0.0], ContactModel::Point)];
    let load = Wrench::at_center_of_mass(Vector::new(0.0, 0.0, -2.0));
    let row = |x: f64, limit: f64| JointRow { per_force: Vector::new(x, 0.0, 0.0), per_torsion: 0.0, limit };
    let of = |limit: f64| {
        let idle = JointRow { limit: f64::INFINITY, ..row(0.5, 1.0) };
        [JointRows::from_iter([row(0.1, 5.0)]), JointRows::from_iter([idle, row(0.1, limit)])]
    };
    // Friction needs 2 N of normal force at each, which is the least anyway: 0.2 N m.
    let ample = of(0.8);
    let free = distribute(&centered(&grips, &ample, load), None).expect("limits do not matter");
    let tight = of(0.25);
    let bound = centered(&grips, &tight, load);
    let forces = distribute(&bound, None).expect("a lighter squeeze");
    assert_good(&bound, &forces);
    assert!(free[1].force.x > 3.5 && forces[1].force.x < 2.5, "{free:?} {forces:?}");
    let none = distribute(&centered(&grips, &of(0.19), load), None);
    assert_eq!(none, Err(NoForces::JointTorque { grip: 1, joint: 1 }));
    // A finger below alone carries the weight, with whatever it is.
    let below = [grip([0.0, 0.0, -0.03], ContactModel::Point)];
    let weight = |w: f64| Wrench::at_center_of_mass(Vector::new(0.0, 0.0, -w));
    let forces = distribute(&centered(&below, &[], weight(3.0)), None).expect("it lies on the finger");
    assert!((forces[0].force.z - 3.0).abs() < 1e-12);
    let outcome = |w: f64| distribute(&centered(&below, &[], weight(w)), None);
    assert_eq!(outcome(1.0), Err(NoForces::LeastNormalForce { grip: 0 }));
    assert_eq!(outcome(20.0), Err(NoForces::LargestNormalForce { grip: 0 }));
    assert_eq!(outcome(-1.0), Err(NoForces::NotBalanced));
}

#[test]
fn reserves_are_kept_free() {
    let mut rng = Rng::keyed(3, "forces", 0);
    let mut n_found = 0;
    for _ in 0..200 {
        let models = models(5, &mut rng);
        let grips = grips(&models, &mut rng);
        let joints = joints(5, 0.5, &mut rng);
        let reserve = |rng: &mut Rng| Reserve {
            normal: rng.uniform(0.0, 1.0),
            tangential: rng.uniform(0.0, 0.5),
            joints: (0..4).map(|_| rng.uniform(0.0, 0.1)).collect(),
        };
        let reserves: Vec<Reserve> = (0..5).map(|_| reserve(&mut rng)).collect();
        let problem = ForceProblem { reserves: &reserves, ..problem(&grips, &joints, weight(&mut rng)) };
        let Ok(forces) = distribute(&problem, None) else { continue };
        n_found += 1;
        assert_good(&problem, &forces);
        for (((grip, force), reserve), joints) in grips.iter().zip(&forces).zip(&reserves).zip(&joints) {
            let c = grip.components(force, FRAME.friction);
            assert!(c.normal > LIMITS.least + reserve.normal && c.normal < LIMITS.largest - reserve.normal);
            if grip.model != ContactModel::Frictionless {
                let across = c.tangential.norm_squared() + c.torsion * c.torsion;
                let room = FRAME.friction * (c.normal - reserve.normal) - across.sqrt();
                assert!(room > reserve.tangential, "{room}");
            }
            for (joint, reserve) in joints.iter().zip(&reserve.joints) {
                assert!(joint.torque(force).abs() < joint.limit - reserve);
            }
        }
    }
    assert!(n_found > 20, "{n_found}");
}

#[test]
fn room_for_any_direction_is_enough_for_every_one() {
    let mut rng = Rng::keyed(4, "forces", 0);
    let (mut n_found, mut n_none, mut nearest) = (0, 0, f64::INFINITY);
    for _ in 0..150 {
        let n = 3 + rng.below(3);
        let models = models(n, &mut rng);
        let grips = grips(&models, &mut rng);
        let joints = joints(n, 0.7, &mut rng);
        let weight = rng.uniform(0.1, 1.5);
        let Some(reserves) = reserves(&grips, &joints, &FRAME, weight) else {
            n_none += 1;
            continue;
        };
        let held = ForceProblem { reserves: &reserves, ..problem(&grips, &joints, Wrench::ZERO) };
        let Ok(forces) = distribute(&held, None) else { continue };
        n_found += 1;
        for _ in 0..300 {
            let load = Vector::from(rng.direction()) * weight;
            let more = answer(&grips, &FRAME, &load).expect("there was a reserve");
            let sum: BalancedForces = forces
                .iter()
                .zip(&more)
                .map(|(a, b)| ContactForce { force: a.force + b.force, torsion: a.torsion + b.torsion })
                .collect();
            assert_good(&problem(&grips, &joints, Wrench::at_center_of_mass(load)), &sum);
            for (grip, force) in grips.iter().zip(&sum) {
                nearest = nearest.min(grip.components(force, FRAME.friction).normal - LIMITS.least);
            }
        }
    }
    // Not by far more than enough, either.
    assert!(n_found > 40 && n_none > 0 && nearest < 0.05, "{n_found} {n_none} {nearest}");
    // Two points cannot be turned anyhow.
    let pair = [grip([0.03, 0.0, 0.0], ContactModel::Point), grip([-0.03, 0.0, 0.0], ContactModel::Point)];
    assert!(reserves(&pair, &[], &CENTERED, 1.0).is_none());
}

#[test]
fn any_scale_of_forces_will_do() {
    let mut rng = Rng::keyed(5, "forces", 0);
    for (least, largest, squeeze, heaviest) in [
        (0.0, 1e4, 4.0, 3.0),
        (0.0, 15.0, 0.01, 0.1),
        (2.0, 2.5, 2.2, 0.3),
        (1e-3, 1e-2, 4e-3, 1e-3),
        (100.0, 1000.0, 300.0, 200.0),
    ] {
        let limits = ForceLimits { least, largest, squeeze, squeeze_weight: 0.2, cone_weight: 1.0 };
        let mut n_found = 0;
        for _ in 0..200 {
            let models = models(4, &mut rng);
            let grips = grips(&models, &mut rng);
            let joints = joints(4, 0.08 * largest, &mut rng);
            let load = Wrench::at_center_of_mass(Vector::from(rng.direction()) * rng.uniform(0.0, heaviest));
            let problem = ForceProblem { limits, ..problem(&grips, &joints, load) };
            let forces = distribute(&problem, None);
            assert_eq!(forces.is_ok(), can_balance(&problem), "{limits:?}");
            if let Ok(forces) = forces {
                assert_good(&problem, &forces);
                n_found += 1;
            }
        }
        assert!(n_found > 10, "{limits:?}: {n_found}");
    }
}

/// What forces make least: effort, friction that is needed, and small barriers before all limits (no joints).
fn with_barriers(problem: &ForceProblem, forces: &[ContactForce]) -> f64 {
    let (limits, mu) = (problem.limits, problem.frame.friction);
    let each = problem.grips.iter().zip(forces).map(|(grip, force)| {
        let c = grip.components(force, mu);
        let across = c.tangential.norm_squared() + c.torsion * c.torsion;
        let (cone, needed) = match grip.model {
            ContactModel::Frictionless => (1.0, 0.0),
            _ => {
                let share = across / (mu * c.normal).powi(2);
                ((mu * c.normal).powi(2) - across, -c.normal * (1.0 - share).ln())
            }
        };
        let bounds = (c.normal - limits.least) * (limits.largest - c.normal);
        let off = c.normal - limits.squeeze;
        let wishes = across + limits.squeeze_weight * off * off + limits.cone_weight * limits.squeeze * needed;
        wishes - 1e-3 * limits.squeeze.powi(2) * (cone * bounds).ln()
    });
    each.sum()
}

/// Largest share of the friction that any contact needs.
fn friction_needed(problem: &ForceProblem, forces: &[ContactForce]) -> f64 {
    let shares = problem.grips.iter().zip(forces).map(|(grip, force)| {
        let c = grip.components(force, problem.frame.friction);
        let across = c.tangential.norm_squared() + c.torsion * c.torsion;
        across.sqrt() / (problem.frame.friction * c.normal)
    });
    shares.fold(0.0, f64::max)
}

/// No forces that balance are better: towards none of those that other wishes lead to does the sum with all barriers fall.
/// And contacts need less friction, the more the cones weigh.
#[test]
fn forces_stay_away_from_the_cones_as_far_as_asked() {
    let mut rng = Rng::keyed(11, "forces", 0);
    let weights = [0.0, 0.1, 0.3, 1.0];
    let (mut n_solved, mut needed) = (0, [0.0; 4]);
    while n_solved < 300 {
        let models = if n_solved % 2 == 0 { vec![ContactModel::Point; 4] } else { models(4, &mut rng) };
        let grips = grips(&models, &mut rng);
        let load = weight(&mut rng);
        let of = |limits: ForceLimits| ForceProblem { limits, ..problem(&grips, &[], load) };
        if !can_balance(&of(LIMITS)) {
            continue;
        }
        n_solved += 1;
        let others: Vec<BalancedForces> =
            [(2.5, 0.05), (2.5, 5.0), (4.0, 1.0), (6.0, 0.3), (8.0, 0.1), (10.0, 3.0), (12.0, 0.02)]
                .into_iter()
                .map(|(squeeze, squeeze_weight)| ForceLimits { squeeze, squeeze_weight, cone_weight: 0.3, ..LIMITS })
                .map(|limits| distribute(&of(limits), None).expect("limits are the same"))
                .collect();
        for (cone_weight, needed) in weights.into_iter().zip(&mut needed) {
            let problem = of(ForceLimits { cone_weight, ..LIMITS });
            let forces = distribute(&problem, None).expect("limits are the same");
            assert_good(&problem, &forces);
            let least = with_barriers(&problem, &forces);
            for other in &others {
                for step in [1e-4, 1e-2, 0.3] {
                    let towards: BalancedForces = forces
                        .iter()
                        .zip(other)
                        .map(|(f, o)| ContactForce {
                            force: f.force.lerp(&o.force, step),
                            torsion: f.torsion + step * (o.torsion - f.torsion),
                        })
                        .collect();
                    let there = with_barriers(&problem, &towards);
                    assert!(there > least - 1e-9 * (1.0 + least.abs()), "{cone_weight}: {least} {there} at {step}");
                }
            }
            *needed += friction_needed(&problem, &forces) / 300.0;
        }
    }
    assert!(needed.is_sorted_by(|more, less| more > less), "{needed:?}");
    assert!(needed[2] < 0.93 * needed[0], "{needed:?}");
}
