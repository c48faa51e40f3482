//! A finger's workspace as spheres (Saut 2010, algorithm 1). Contacts in large spheres are far from the joint limits.

use crate::frames::radical_inverse;
use crate::kd_tree::KdTree;
use regrasp_geometry::{Point, Vector};
use regrasp_robot::kinematics::finger_ik::FingerIk;
use std::f64::consts::PI;

/// Postures that the inside of a workspace is sampled with.
const N_INSIDE: u64 = 6_000;
/// Postures that the border of a workspace is found with.
const N_REACHED: u64 = 60_000;
/// Points along each side of a face of the joint limits: with 20 by 20 points 8 % of the spheres of a finger of three joints
/// are out of reach, with 40 by 40 one in a thousand.
const N_SIDE: u64 = 64;
/// Cells along the longest side of the workspace.
const N_CELLS: f64 = 28.0;
/// A cell with so many reached ones of 27 about it counts as reached.
const SURROUNDED: usize = 20;
/// Primes of the Halton sequence: a finger has at most so many coordinates.
const PRIMES: [u64; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];

/// A ball of places that the centre of a fingertip reaches, in the hand frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub center: Point,
    /// Its radius.
    pub radius: f64,
}

/// When Algorithm 1 ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereLimits {
    /// Most spheres (k_max).
    pub most: usize,
    /// Least radius (r_min).
    pub least_radius: f64,
}

/// The workspace of a finger.
#[derive(Debug, Clone)]
pub struct Workspheres {
    /// Spheres inside the workspace, in the order of Algorithm 1: nearly from the largest to the smallest.
    pub spheres: Vec<Sphere>,
    /// A ball around all places that were sampled.
    pub bound: Sphere,
    /// Sampled places.
    pub inside: Vec<Point>,
}

impl Workspheres {
    /// The workspace of a finger while its joints keep `limit_margin` from their limits.
    pub fn new(ik: &FingerIk, limit_margin: f64, limits: SphereLimits) -> Self {
        let ranges = ranges(ik, limit_margin);
        let n = ranges.len();
        let draw =
            |index: u64| -> Vec<f64> { (0..n).map(|k| at(ranges[k], radical_inverse(index + 1, PRIMES[k]))).collect() };
        let is_within = |joints: &[f64]| ik.chain().within_linear_limits(joints, limit_margin);
        let tips = |count: u64| -> Vec<Point> {
            (0..count).map(draw).filter(|joints| is_within(joints)).map(|joints| ik.tip(&joints)).collect()
        };
        let inside = tips(N_INSIDE);
        let Some(bound) = bound_of(&inside) else {
            return Workspheres { spheres: Vec::new(), bound: Sphere { center: Point::origin(), radius: 0.0 }, inside };
        };
        let mut faces = Vec::new();
        if n <= 3 {
            add_faces(ik, &ranges, &mut faces);
        }
        let (border, cell) = border_of(&tips(N_REACHED));
        let (faces, border) = (KdTree::new(&faces), KdTree::new(&border));
        // The border proper may be a cell before the centres of the cells beyond it.
        let free = |p: &Point| faces.nearest(p, bound.radius).min(border.nearest(p, bound.radius) - cell);
        let spheres = algorithm_1(inside.iter().map(|p| (*p, free(p))).collect(), limits);
        Workspheres { spheres, bound, inside }
    }

    /// True when `point`, in the hand frame, lies in a sphere.
    pub fn holds(&self, point: &Point) -> bool {
        self.spheres.iter().any(|sphere| (sphere.center - point).norm_squared() <= sphere.radius * sphere.radius)
    }
}

/// Ranges of the coordinates; half a turn either way for those without limits.
fn ranges(ik: &FingerIk, limit_margin: f64) -> Vec<(f64, f64)> {
    let chain = ik.chain();
    let range = |(lower, upper): (&f64, &f64)| {
        let (lower, upper) = (lower.max(-PI), upper.min(PI));
        let margin = limit_margin.min(0.5 * (upper - lower)).max(0.0);
        (lower + margin, upper - margin)
    };
    chain.lower.iter().zip(&chain.upper).map(range).collect()
}

fn at((lower, upper): (f64, f64), share: f64) -> f64 {
    lower + (upper - lower) * share
}

fn bound_of(points: &[Point]) -> Option<Sphere> {
    let center = points.iter().map(|p| p.coords).reduce(|a, b| a + b)? / points.len() as f64;
    let radius = points.iter().map(|p| (p.coords - center).norm()).fold(0.0, f64::max);
    Some(Sphere { center: center.into(), radius })
}

/// Places with one coordinate at a limit and the others anywhere.
fn add_faces(ik: &FingerIk, ranges: &[(f64, f64)], border: &mut Vec<Point>) {
    let n = ranges.len();
    let n_others = N_SIDE.pow(n as u32 - 1);
    for fixed in 0..n {
        for limit in [ranges[fixed].0, ranges[fixed].1] {
            for cell in 0..n_others {
                let mut rest = cell;
                let joints: Vec<f64> = (0..n)
                    .map(|k| {
                        if k == fixed {
                            return limit;
                        }
                        let place = rest % N_SIDE;
                        rest /= N_SIDE;
                        at(ranges[k], place as f64 / (N_SIDE - 1) as f64)
                    })
                    .collect();
                border.push(ik.tip(&joints));
            }
        }
    }
}

/// Centres of the cells beside those that the tip reaches, and their size. Where a singularity bounds the workspace no joint is
/// at a limit.
fn border_of(reached: &[Point]) -> (Vec<Point>, f64) {
    let first = reached.first().map_or_else(Vector::zeros, |p| p.coords);
    let (low, high) = reached.iter().fold((first, first), |(low, high), p| (low.inf(&p.coords), high.sup(&p.coords)));
    let cell = ((high - low).max() / N_CELLS).max(1e-6);
    // Two empty cells on every side.
    let low = low - Vector::repeat(2.0 * cell);
    let counts: [usize; 3] = std::array::from_fn(|k| ((high[k] - low[k]) / cell) as usize + 3);
    let index = |[i, j, k]: [usize; 3]| (i * counts[1] + j) * counts[2] + k;
    let mut is_reached = vec![false; counts.iter().product()];
    for point in reached {
        let at: [usize; 3] = std::array::from_fn(|k| ((point[k] - low[k]) / cell) as usize);
        is_reached[index(at)] = true;
    }
    let cells = (1..counts[0] - 1)
        .flat_map(|i| (1..counts[1] - 1).flat_map(move |j| (1..counts[2] - 1).map(move |k| [i, j, k])));
    let n_beside = |[i, j, k]: [usize; 3]| {
        (0..27).filter(|n| is_reached[index([i + n / 9 - 1, j + n / 3 % 3 - 1, k + n % 3 - 1])]).count()
    };
    // Cells that are missed by chance are surrounded.
    let is_border = |cell: &[usize; 3]| !is_reached[index(*cell)] && (1..SURROUNDED).contains(&n_beside(*cell));
    let centers =
        cells.filter(is_border).map(|at| Point::from(low + Vector::from(at.map(|n| (n as f64 + 0.5) * cell))));
    (centers.collect(), cell)
}

/// Algorithm 1 of Saut 2010: the place of the inside that is farthest from the border and from the spheres so far becomes
/// the centre of a sphere; places inside it are dropped. `places` come with their distance from the border.
fn algorithm_1(mut places: Vec<(Point, f64)>, limits: SphereLimits) -> Vec<Sphere> {
    let mut spheres = Vec::new();
    while spheres.len() < limits.most {
        let best = places.iter().copied().reduce(|best, place| if place.1 > best.1 { place } else { best });
        let Some((center, radius)) = best.filter(|(_, radius)| *radius >= limits.least_radius) else { break };
        spheres.push(Sphere { center, radius });
        places.retain_mut(|(place, free)| {
            let distance = (*place - center).norm() - radius;
            *free = free.min(distance);
            distance > 0.0
        });
    }
    spheres
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use regrasp_base::Rng;
    use regrasp_geometry::{Pose, UnitVector};
    use regrasp_robot::kinematics::finger_ik::IkSettings;
    use regrasp_robot::{Chain, ChainJoint, Coupling, JointMotion};

    /// The right fore finger of the hands of Saut 2010, by the numbers of its joints; the last joint follows the one before.
    fn fore_finger() -> FingerIk {
        let joint = |x: f64, roll: f64, terms: Vec<(usize, f64)>| ChainJoint {
            parent_from_joint: Pose::from_parts(
                nalgebra::Translation3::new(x, 0.0, 0.0),
                UnitQuaternion::from_euler_angles(roll, 0.0, 0.0),
            ),
            axis: UnitVector::new_unchecked(Vector::z()),
            motion: JointMotion::Turn,
            drive: Coupling { terms: terms.into_iter().collect(), offset: 0.0 },
        };
        let joints = vec![
            joint(0.0, 0.0, vec![(0, 1.0)]),
            joint(0.0, -std::f64::consts::FRAC_PI_2, vec![(1, 1.0)]),
            joint(0.0678, 0.0, vec![(2, 1.0)]),
            joint(0.03, 0.0, vec![(2, 1.0)]),
        ];
        let radians = |degrees: [f64; 3]| degrees.map(f64::to_radians).to_vec();
        let names = ["base", "prox", "mid"].map(str::to_owned).to_vec();
        let chain = Chain::new(joints, names, radians([-20.0, -19.0, 0.0]), radians([20.0, 90.0, 70.0]));
        FingerIk::new(&chain, &Point::new(0.029, 0.0, 0.0))
    }

    #[test]
    fn spheres_are_as_large_as_those_of_the_paper_and_all_of_them_is_in_reach() {
        let ik = fore_finger();
        let found = Workspheres::new(&ik, 0.0, SphereLimits { most: 60, least_radius: 0.003 });
        let largest = found.spheres[0].radius;
        assert!((0.016..0.028).contains(&largest), "{largest}: the authors' largest has 19.6 mm");
        assert!(found.spheres.len() >= 20, "{}", found.spheres.len());
        let mut rng = Rng::keyed(3, "inside spheres", 0);
        let (mut out_of_reach, n_points) = (0, 100_000);
        let mut solutions = Vec::new();
        for _ in 0..n_points {
            let sphere = found.spheres[rng.below(found.spheres.len())];
            let point = sphere.center + Vector::from(rng.direction()) * (sphere.radius * rng.unit().cbrt());
            solutions.clear();
            ik.solve_all(&point, &IkSettings::default(), &mut solutions);
            out_of_reach += usize::from(solutions.is_empty());
        }
        assert!(out_of_reach <= n_points / 1000, "{out_of_reach} of {n_points}");
    }
}
