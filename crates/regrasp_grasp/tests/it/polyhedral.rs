//! Closure with linearised cones, by linear programs: cones inside and outside the exact ones bracket the answer.

use crate::sample::{self, FRAME, columns, grips, models};
use microlp::{ComparisonOp, LinearExpr, OptimizationDirection, Problem};
use nalgebra::DMatrix;
use regrasp_base::Rng;
use regrasp_grasp::closure::general;
use regrasp_grasp::{GraspFrame, Grip, Verdict};

/// Unit vectors of the plane or of space whose hull comes near the unit ball, and the radius of the ball inside it.
fn rim(dimension: usize) -> (Vec<Vec<f64>>, f64) {
    match dimension {
        0 => (vec![vec![]], 1.0),
        2 => {
            let n = 16;
            let angle = |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
            ((0..n).map(|k| vec![angle(k).cos(), angle(k).sin()]).collect(), (std::f64::consts::PI / n as f64).cos())
        }
        3 => latitudes(9, 16),
        _ => unreachable!("cones have two or three directions across their axis"),
    }
}

/// Rings of points on the unit sphere. Every point of a spherical rectangle between neighbours of two rings is within
/// the angle `reach` of a corner, so that the hull contains the ball of radius `cos(reach)`.
fn latitudes(n_rings: usize, n_points: usize) -> (Vec<Vec<f64>>, f64) {
    let (step, turn) = (std::f64::consts::PI / n_rings as f64, std::f64::consts::TAU / n_points as f64);
    let mut points = Vec::new();
    for i in 0..=n_rings {
        let (z, r) = ((step * i as f64).cos(), (step * i as f64).sin());
        let n = if i == 0 || i == n_rings { 1 } else { n_points };
        points.extend((0..n).map(|j| vec![r * (turn * j as f64).cos(), r * (turn * j as f64).sin(), z]));
    }
    let reach = 0.5 * (step * step + turn * turn).sqrt();
    (points, reach.cos())
}

/// Wrenches of the edges of cones whose slope is `scale` of the exact one's at the rim.
fn edges(grips: &[Grip], frame: &GraspFrame, outer: bool) -> Vec<[f64; 6]> {
    let mut wrenches = Vec::new();
    for grip in grips {
        let columns = columns(grip, frame);
        let (rim, inner_radius) = rim(columns.len() - 1);
        let slope = if outer { frame.friction / inner_radius } else { frame.friction };
        for point in rim {
            let mut wrench = columns[0];
            for (weight, column) in point.iter().zip(&columns[1..]) {
                (0..6).for_each(|k| wrench[k] += slope * weight * column[k]);
            }
            wrenches.push(wrench);
        }
    }
    wrenches
}

/// Largest `s` for which some wrench of components within `[-1, 1]` does work of at least `s` on every edge; zero if and
/// only if the edges do not lie strictly on one side of a plane through zero.
fn one_sided(wrenches: &[[f64; 6]]) -> f64 {
    let mut problem = Problem::new(OptimizationDirection::Maximize);
    let work = problem.add_var(1.0, (0.0, 10.0));
    let direction: Vec<_> = (0..6).map(|_| problem.add_var(0.0, (-1.0, 1.0))).collect();
    for wrench in wrenches {
        let mut row = LinearExpr::empty();
        row.add(work, -1.0);
        direction.iter().zip(wrench).for_each(|(&x, &w)| row.add(x, w));
        problem.add_constraint(row, ComparisonOp::Ge, 0.0);
    }
    problem.solve().expect("zero is feasible").solution().expect("no limit was set").objective()
}

fn is_closed(wrenches: &[[f64; 6]]) -> bool {
    let map = DMatrix::from_fn(6, wrenches.len(), |row, column| wrenches[column][row]);
    let full = map.svd(false, false).singular_values.iter().filter(|&&s| s > 1e-6).count() == 6;
    full && one_sided(wrenches) < 1e-7
}

#[test]
fn inner_and_outer_cones_bracket_the_exact_answer() {
    let mut rng = Rng::keyed(1, "polyhedral", 0);
    let (mut n_closed, mut n_open, mut n_between) = (0, 0, 0);
    for trial in 0..1_000 {
        let n = 1 + trial % 7;
        let models = models(n, &mut rng);
        let grips = grips(&models, &mut rng);
        let found = general::prove(&grips, &FRAME, 0.0);
        let inner = is_closed(&edges(&grips, &FRAME, false));
        let outer = is_closed(&edges(&grips, &FRAME, true));
        assert!(outer || !inner, "trial {trial}: the bracket is one");
        match &found {
            Verdict::Closed(_) => assert!(outer, "trial {trial}: {models:?} closed, but not with larger cones"),
            Verdict::NotProved(_) => {
                assert!(!inner, "trial {trial}: {models:?} not proved, but closed with smaller cones")
            }
        }
        match (inner, outer) {
            (true, _) => n_closed += 1,
            (_, false) => n_open += 1,
            _ => n_between += 1,
        }
    }
    assert!(n_closed > 60 && n_open > 150 && n_between < 60, "{n_closed} closed, {n_open} open, {n_between} between");
}

#[test]
fn frictionless_contacts_agree_with_the_linear_program_exactly() {
    let mut rng = Rng::keyed(2, "polyhedral", 0);
    let (mut n_closed, mut n_open) = (0, 0);
    for trial in 0..600 {
        let n = 6 + trial % 7;
        let grips = grips(&vec![regrasp_grasp::ContactModel::Frictionless; n], &mut rng);
        // Without friction the frame's coefficient does not matter.
        let found = matches!(general::prove(&grips, &FRAME, 0.0), Verdict::Closed(_));
        let expected = is_closed(&edges(&grips, &FRAME, false));
        let radius = sample::least_support(&grips, &FRAME, &mut rng);
        assert!(found == expected || radius < 1e-6, "trial {trial}: {found}, program {expected}, radius {radius}");
        if expected { n_closed += 1 } else { n_open += 1 }
    }
    assert!(n_closed > 20 && n_open > 100, "{n_closed} {n_open}");
}
