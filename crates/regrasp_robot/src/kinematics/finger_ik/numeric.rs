//! Damped Newton steps from a table of seeds, with a preferred direction of the last body in the null space.
//!
//! Levenberg-Marquardt with the damping tied to the squared error (Fan, Yuan 2005), which keeps the quadratic
//! convergence; coordinates that would leave their limits are set on them and taken out of the step. The null-space
//! term is Liegeois' gradient projection (1977) with the Gauss-Newton length.
//!
//! The inner functions are compiled for each usual number of coordinates; chains with other numbers run in the next
//! larger one, with coordinates that move nothing.

/// Small steps of a finger towards what is asked at every configuration.
mod following;
/// Steps of chains whose limits bind several coordinates at once.
mod linear;

pub(super) use following::{follow, turn_per_motion};

use super::reach_map::{ReachMap, halton};
use super::{Coordinates, IkSettings, MAX_COORDINATES, POSITION_TOLERANCE, Preference};
use crate::kinematics::body_frame::BodyFrame;
use crate::kinematics::chain::{Chain, JointLine, JointMotion};
use arrayvec::ArrayVec;
use nalgebra::Matrix3;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Vector};

/// Seeds in the table.
const N_SEEDS: usize = 96;
/// Seeds tried for one solution before giving up.
const N_TRIES: usize = 4;
/// Seeds tried after that without the preference.
const N_LAST_TRIES: usize = 2;
/// Newton steps from one seed.
const MAX_STEPS: usize = 16;
/// Newton steps of a warm start.
const MAX_WARM_STEPS: usize = 8;
/// First steps of each solution that also follow the preference, from a seed and from a warm start.
const PREFERENCE_STEPS: [usize; 2] = [3, 1];
/// First steps that may make little headway.
const CRAWL_STEPS: usize = 3;
/// Longest change of a coordinate in one step, in radians or metres.
const LONGEST_STEP: f64 = 0.6;
/// Solutions closer than this in every coordinate are one; for redundant chains, and for others.
const SAME: [f64; 2] = [0.05, 1e-5];

/// A configuration tried first for targets near its tip.
#[derive(Debug, Clone)]
struct Seed {
    tip: Vector,
    tip_axis: Vector,
    coordinates: Coordinates,
}

/// The tip and how it moves with each coordinate.
struct State<const N: usize> {
    tip: Vector,
    tip_axis: Vector,
    /// Derivative of the tip by each coordinate.
    slides: [Vector; N],
    /// Rotation of the last body by each coordinate.
    spins: [Vector; N],
}

/// Numeric inverse kinematics of one chain, prepared.
#[derive(Debug, Clone)]
pub struct NumericIk {
    chain: Chain,
    center_in_body: Point,
    tip_axis_in_body: Vector,
    /// Length that a deviation of one radian from the preferred direction counts for when seeds are chosen.
    length: f64,
    /// Bound on the tip's distance from any joint of the chain; infinite with sliding joints. In metres.
    reach: f64,
    /// How far joints turn per unit of each coordinate, all together, for chains whose joints may turn against each other.
    opposed_turns: Option<Coordinates>,
    seeds: Vec<Seed>,
    reach_map: ReachMap,
}

/// What one solution may use.
struct Effort {
    max_steps: usize,
    preference_steps: usize,
}

impl NumericIk {
    /// Prepares the seed table.
    pub fn new(chain: &Chain, center_in_body: &Point) -> Self {
        let tip_axis_in_body = tip_axis(center_in_body);
        let length = center_in_body.coords.norm();
        let links = chain.joints.iter().skip(1).map(|joint| joint.parent_from_joint.translation.vector.norm());
        let slides = chain.joints.iter().any(|joint| joint.motion == JointMotion::Slide);
        let reach = if slides { f64::INFINITY } else { links.sum::<f64>() + length };
        let mut ik = NumericIk {
            chain: chain.clone(),
            center_in_body: *center_in_body,
            tip_axis_in_body,
            length,
            reach,
            opposed_turns: linear::opposed_turns(chain),
            seeds: vec![],
            reach_map: ReachMap::new(chain, center_in_body, search_range),
        };
        for i in 0..N_SEEDS {
            let sample: Coordinates = (0..chain.n_coordinates())
                .map(|k| {
                    let (lower, upper) = search_range(chain.lower[k], chain.upper[k]);
                    lower + (upper - lower) * halton(i + 1, k)
                })
                .collect();
            let coordinates = chain.bring_within_limits(&sample).map_or(sample, |kept| kept.into_iter().collect());
            let state = ik.state::<MAX_COORDINATES>(&coordinates);
            ik.seeds.push(Seed { tip: state.tip, tip_axis: state.tip_axis, coordinates });
        }
        ik
    }

    /// False when the tip surely cannot come to `target`.
    pub fn may_reach(&self, target: &Point) -> bool {
        self.reach_map.may_reach(target)
    }

    /// Different solutions from all seeds, nearest seed first.
    pub fn solve_all(&self, target: &Point, settings: &IkSettings, solutions: &mut Vec<Coordinates>) {
        if !self.reach_map.may_reach(target) {
            return;
        }
        let first = solutions.len();
        for seed in self.nearest_seeds::<N_SEEDS>(target, settings.preference.as_ref(), N_SEEDS) {
            if let Some(found) = self.solve_from_seed(target, seed, settings.preference.as_ref(), settings) {
                self.push_new(found, first, solutions);
            }
        }
    }

    /// A solution from one of the nearest seeds, in random order.
    pub fn solve_random(&self, target: &Point, settings: &IkSettings, rng: &mut Rng) -> Option<Coordinates> {
        if !self.reach_map.may_reach(target) {
            return None;
        }
        let preference = settings.preference.as_ref();
        let mut nearest = self.nearest_seeds::<N_TRIES>(target, preference, N_TRIES);
        // Only the better half competes for the first try: the far seeds are there for hard targets.
        let half = nearest.len().div_ceil(2);
        rng.shuffle(&mut nearest[..half]);
        let found = nearest.into_iter().find_map(|seed| self.solve_from_seed(target, seed, preference, settings));
        if found.is_some() || preference.is_none() {
            return found;
        }
        // The preference chose seeds too far from the target: reaching it comes first.
        let nearest = self.nearest_seeds::<N_LAST_TRIES>(target, None, N_LAST_TRIES);
        nearest.into_iter().find_map(|seed| self.solve_from_seed(target, seed, None, settings))
    }

    /// Different solutions: the first follows the preference, the others are where random seeds led.
    pub fn solve_many(
        &self,
        target: &Point,
        n_wanted: usize,
        settings: &IkSettings,
        rng: &mut Rng,
        solutions: &mut Vec<Coordinates>,
    ) {
        if !self.reach_map.may_reach(target) {
            return;
        }
        let first = solutions.len();
        let mut preference = settings.preference.as_ref();
        let mut nearest = self.nearest_seeds::<32>(target, preference, (4 * n_wanted).clamp(N_TRIES, 32));
        let half = nearest.len().div_ceil(2);
        rng.shuffle(&mut nearest[1..half]);
        for seed in nearest {
            if solutions.len() - first >= n_wanted {
                break;
            }
            if let Some(found) = self.solve_from_seed(target, seed, preference, settings) {
                self.push_new(found, first, solutions);
                preference = None;
            }
        }
    }

    /// The solution that Newton steps reach from `seed`, if no coordinate moves further than allowed.
    pub fn solve_near(&self, target: &Point, seed: &[f64], settings: &IkSettings) -> Option<Coordinates> {
        let effort = Effort { max_steps: MAX_WARM_STEPS, preference_steps: PREFERENCE_STEPS[1] };
        let found = self.refine(target, seed, settings.preference.as_ref(), settings, &effort)?;
        if found.iter().zip(seed).any(|(a, b)| (a - b).abs() > settings.max_step) {
            return None;
        }
        // Without redundancy the branches are separated by the sign of the Jacobian's determinant.
        if found.len() == 3 {
            let determinant = |state: State<3>| Matrix3::from_columns(&state.slides).determinant();
            if determinant(self.state(&found)) * determinant(self.state(seed)) <= 0.0 {
                return None;
            }
        }
        Some(found)
    }

    fn solve_from_seed(
        &self,
        target: &Point,
        seed: usize,
        preference: Option<&Preference>,
        settings: &IkSettings,
    ) -> Option<Coordinates> {
        let effort = Effort { max_steps: MAX_STEPS, preference_steps: PREFERENCE_STEPS[0] };
        self.refine(target, &self.seeds[seed].coordinates, preference, settings, &effort)
    }

    fn push_new(&self, found: Coordinates, first: usize, solutions: &mut Vec<Coordinates>) {
        let same = if self.chain.n_coordinates() > 3 { SAME[0] } else { SAME[1] };
        let known = solutions[first..].iter().any(|other| other.iter().zip(&found).all(|(a, b)| (a - b).abs() < same));
        if !known {
            solutions.push(found);
        }
    }

    /// Indices of the `n` seeds nearest to the target, nearest first.
    fn nearest_seeds<const N: usize>(
        &self,
        target: &Point,
        preference: Option<&Preference>,
        n: usize,
    ) -> ArrayVec<usize, N> {
        let mut nearest: ArrayVec<(f64, usize), N> = ArrayVec::new();
        let n = n.min(N);
        for (i, seed) in self.seeds.iter().enumerate() {
            let mut score = (seed.tip - target.coords).norm_squared();
            if let Some(wish) = preference {
                score += self.length * self.length * wish.weight * (1.0 - seed.tip_axis.dot(&wish.tip_axis_in_base));
            }
            if nearest.len() == n {
                if nearest.last().is_none_or(|last| score >= last.0) {
                    continue;
                }
                nearest.pop();
            }
            let place = nearest.partition_point(|other| other.0 <= score);
            nearest.insert(place, (score, i));
        }
        nearest.into_iter().map(|(_, i)| i).collect()
    }

    fn state<const N: usize>(&self, coordinates: &[f64]) -> State<N> {
        state_of(&self.chain, &self.center_in_body, &self.tip_axis_in_body, coordinates).0
    }

    /// Newton steps from `start` until the tip is on the target.
    fn refine(
        &self,
        target: &Point,
        start: &[f64],
        preference: Option<&Preference>,
        settings: &IkSettings,
        effort: &Effort,
    ) -> Option<Coordinates> {
        match self.chain.n_coordinates() {
            ..=3 => self.refine_in::<3>(target, start, preference, settings, effort),
            4 => self.refine_in::<4>(target, start, preference, settings, effort),
            5 => self.refine_in::<5>(target, start, preference, settings, effort),
            _ => self.refine_in::<MAX_COORDINATES>(target, start, preference, settings, effort),
        }
    }

    fn refine_in<const N: usize>(
        &self,
        target: &Point,
        start: &[f64],
        preference: Option<&Preference>,
        settings: &IkSettings,
        effort: &Effort,
    ) -> Option<Coordinates> {
        let n = self.chain.n_coordinates();
        let mut limits = [(0.0, 0.0); N];
        let mut coordinates = [0.0; N];
        for k in 0..n {
            let (lower, upper) =
                (self.chain.lower[k] + settings.limit_margin, self.chain.upper[k] - settings.limit_margin);
            if lower > upper {
                return None;
            }
            limits[k] = (lower, upper);
            coordinates[k] = start[k].clamp(lower, upper);
        }
        let linear = linear::kept(&self.chain, settings.limit_margin, None);
        let mut error_before = f64::INFINITY;
        for i in 0..effort.max_steps {
            let state = self.state::<N>(&coordinates);
            let error = target.coords - state.tip;
            // Newton steps at least halve the error once they are near; what still crawls is out of reach.
            let error_now = error.norm();
            if i > CRAWL_STEPS && error_now > 0.5 * error_before {
                return None;
            }
            error_before = error_now;
            let wish = preference.filter(|_| n > 3 && i < effort.preference_steps);
            // Where something slides no bound proves it below, and what is there must not count as crawling.
            if wish.is_none() && self.reach.is_infinite() && error_now < 0.5 * POSITION_TOLERANCE {
                return linear::keeps(&linear, &coordinates).then(|| coordinates[..n].iter().copied().collect());
            }
            let step = match linear.as_slice() {
                [] => bounded_step(&state, &error, wish, &coordinates, &limits)?,
                sums => linear::limited_step(&state, &error, wish, &coordinates, (&limits, sums))?,
            };
            let (mut left, mut turned) = (error, 0.0);
            for k in 0..N {
                coordinates[k] = (coordinates[k] + step[k]).clamp(limits[k].0, limits[k].1);
                left -= state.slides[k] * step[k];
                turned += step[k].abs()
                    * match &self.opposed_turns {
                        None => state.spins[k].norm(),
                        Some(turns) => turns.get(k).copied().unwrap_or(0.0),
                    };
            }
            // The rest of a linear step is at most half the square of the turn times the reach: no need to look.
            if wish.is_none() && left.norm() + 0.5 * turned * turned * self.reach < 0.5 * POSITION_TOLERANCE {
                return linear::keeps(&linear, &coordinates).then(|| coordinates[..n].iter().copied().collect());
            }
        }
        let error = target.coords - self.state::<N>(&coordinates).tip;
        let is_solved = error.norm() < POSITION_TOLERANCE && linear::keeps(&linear, &coordinates);
        is_solved.then(|| coordinates[..n].iter().copied().collect())
    }
}

/// Direction of the last body: from its joint to the tip's centre, in its frame.
fn tip_axis(center_in_body: &Point) -> Vector {
    center_in_body.coords.try_normalize(0.0).unwrap_or_else(Vector::z)
}

/// The tip and how it moves with each coordinate; the frame of the last body.
fn state_of<const N: usize>(
    chain: &Chain,
    center_in_body: &Point,
    tip_axis_in_body: &Vector,
    coordinates: &[f64],
) -> (State<N>, BodyFrame) {
    let mut lines: ArrayVec<JointLine, { 2 * MAX_COORDINATES }> = ArrayVec::new();
    let last = chain.joint_lines(coordinates, &mut lines);
    let tip = last.point(center_in_body).coords;
    let tip_axis = last.vector(tip_axis_in_body);
    let mut state = State { tip, tip_axis, slides: [Vector::zeros(); N], spins: [Vector::zeros(); N] };
    for (joint, line) in chain.joints.iter().zip(&lines) {
        for &(k, multiplier) in &joint.drive.terms {
            let axis = line.axis * multiplier;
            match joint.motion {
                JointMotion::Turn => {
                    state.slides[k] += axis.cross(&(tip - line.origin));
                    state.spins[k] += axis;
                }
                JointMotion::Slide => state.slides[k] += axis,
            }
        }
    }
    (state, last)
}

/// The step to the target, with coordinates that would leave their limits set on them.
#[inline]
fn bounded_step<const N: usize>(
    state: &State<N>,
    error: &Vector,
    preference: Option<&Preference>,
    coordinates: &[f64; N],
    limits: &[(f64, f64); N],
) -> Option<[f64; N]> {
    let mut step = [0.0; N];
    // Columns of coordinates that are set on a limit become zero: they don't move any more.
    let mut slides = state.slides;
    let mut spins = state.spins;
    let mut free = [true; N];
    let mut left = *error;
    loop {
        let moved = free_step(&slides, &spins, &state.tip_axis, &left, preference)?;
        let mut worst = None;
        let mut worst_excess = 0.0;
        for k in 0..N {
            if free[k] {
                step[k] = moved[k];
                let goal = coordinates[k] + step[k];
                let excess = (limits[k].0 - goal).max(goal - limits[k].1);
                if excess > worst_excess {
                    (worst, worst_excess) = (Some(k), excess);
                }
            }
        }
        let Some(k) = worst else { return Some(step) };
        free[k] = false;
        step[k] = (coordinates[k] + step[k]).clamp(limits[k].0, limits[k].1) - coordinates[k];
        left -= slides[k] * step[k];
        slides[k] = Vector::zeros();
        spins[k] = Vector::zeros();
    }
}

/// Damped least-squares step, with the preference in its null space.
#[inline]
fn free_step<const N: usize>(
    slides: &[Vector; N],
    spins: &[Vector; N],
    tip_axis: &Vector,
    error: &Vector,
    preference: Option<&Preference>,
) -> Option<[f64; N]> {
    let (mut xx, mut xy, mut xz, mut yy, mut yz, mut zz) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for s in slides {
        xx += s.x * s.x;
        xy += s.x * s.y;
        xz += s.x * s.z;
        yy += s.y * s.y;
        yz += s.y * s.z;
        zz += s.z * s.z;
    }
    let damping = 0.01 * error.norm_squared() + 1e-10 * (xx + yy + zz);
    let (xx, yy, zz) = (xx + damping, yy + damping, zz + damping);
    let (c_xx, c_xy, c_xz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
    let determinant = xx * c_xx + xy * c_xy + xz * c_xz;
    // Also false for NaN, from a target that is none.
    if determinant.is_nan() || determinant <= 0.0 {
        return None;
    }
    let (c_yy, c_yz, c_zz) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
    let solve = |e: &Vector| {
        Vector::new(
            c_xx * e.x + c_xy * e.y + c_xz * e.z,
            c_xy * e.x + c_yy * e.y + c_yz * e.z,
            c_xz * e.x + c_yz * e.y + c_zz * e.z,
        ) / determinant
    };
    let pull = solve(error);
    let mut step: [f64; N] = std::array::from_fn(|k| slides[k].dot(&pull));
    let longest = longest_of(&step);
    if longest > LONGEST_STEP {
        step.iter_mut().for_each(|change| *change *= LONGEST_STEP / longest);
    }
    if let Some(wish) = preference {
        let turn = tip_axis.cross(&wish.tip_axis_in_base);
        let gradient: [f64; N] = std::array::from_fn(|k| spins[k].dot(&turn));
        let moved = slides.iter().zip(&gradient).fold(Vector::zeros(), |sum, (slide, g)| sum + slide * *g);
        let back = solve(&moved);
        let projected: [f64; N] = std::array::from_fn(|k| gradient[k] - slides[k].dot(&back));
        let gain: f64 = gradient.iter().zip(&projected).map(|(g, p)| g * p).sum();
        let spin = spins.iter().zip(&projected).fold(Vector::zeros(), |sum, (spin, p)| sum + spin * *p);
        let curvature = spin.cross(tip_axis).norm_squared();
        if curvature > 1e-12 && gain > 0.0 {
            let way: f64 = projected.iter().map(|change| change * change).sum();
            let length = wish.weight * gain / (curvature + wish.damping * way);
            let length = length.min(LONGEST_STEP / longest_of(&projected));
            for k in 0..N {
                step[k] += length * projected[k];
            }
        }
    }
    Some(step)
}

fn longest_of<const N: usize>(step: &[f64; N]) -> f64 {
    step.iter().fold(0.0, |longest, change| change.abs().max(longest))
}

/// The limits, or one turn where there are none.
fn search_range(lower: f64, upper: f64) -> (f64, f64) {
    use std::f64::consts::PI;
    match (lower.is_finite(), upper.is_finite()) {
        (true, true) => (lower, upper),
        (true, false) => (lower, lower + 2.0 * PI),
        (false, true) => (upper - 2.0 * PI, upper),
        (false, false) => (-PI, PI),
    }
}
