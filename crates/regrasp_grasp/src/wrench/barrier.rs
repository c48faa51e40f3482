//! Minimum of a quadratic over balanced forces, with a logarithmic barrier before every limit.
//!
//! Every limit is about one contact, so that the Hessian is block-diagonal and a Newton step costs one small Cholesky
//! factorisation per contact and one of 6 x 6 (Boyd, Vandenberghe, *Convex Optimization*, 2004: 10.4.2 elimination, 11.3
//! barrier, 11.4 phase I). The barrier's weight is fixed: its minimum is unique, lies strictly inside all limits, and
//! depends analytically on the data.

/// That no forces balance, shown by a direction.
mod certificate;
/// What the friction that a contact needs counts.
mod needed_friction;
/// One Newton step.
mod newton_step;

use arrayvec::ArrayVec;
use needed_friction::NeededFriction;
use newton_step::NewtonStep;

/// Most contacts.
pub const MAX_GRIPS: usize = 6;
/// Most joints of one finger that have a limit.
pub const MAX_ROWS: usize = 12;

/// Coordinates of the forces of one contact: normal, two tangential, torsion over torsion radius; in newtons.
pub type Coordinates<const D: usize> = [f64; D];
/// Forces of all contacts.
pub type Forces<const D: usize> = ArrayVec<Coordinates<D>, MAX_GRIPS>;

/// A contact and its limits. Those on joints are scaled so that they are newtons too.
#[derive(Debug, Clone)]
pub struct Block<const D: usize> {
    /// Wrench of a unit of each coordinate; zero for those that the contact does not transmit.
    pub map: [[f64; 6]; D],
    /// What each coordinate should be.
    pub wish: [f64; D],
    /// Slope of the cone; zero for contacts without friction, of which only the normal force is limited.
    pub friction: f64,
    /// What the cone is narrower by, in newtons.
    pub shift: f64,
    /// Least normal force.
    pub least: f64,
    /// Largest normal force.
    pub largest: f64,
    /// Joint torques per unit of each coordinate.
    pub rows: ArrayVec<[f64; D], MAX_ROWS>,
    /// Limits of these, either way.
    pub limits: ArrayVec<f64, MAX_ROWS>,
}

/// Which limit of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// The cone.
    Cone,
    /// The least normal force.
    Least,
    /// The largest normal force.
    Largest,
    /// A joint, by its index among the rows.
    Joint(usize),
}

/// Minimise `sum |f_t - wish_t|^2 + weight (f_n - wish_n)^2 + cones needed` subject to `sum map f = balance` and all limits, with the friction that
/// is needed as [`NeededFriction`] counts it.
#[derive(Debug, Clone)]
pub struct Program<const D: usize> {
    /// Contacts. Their maps are orthonormal row by row, but for the rows from `rank` on, which are zero.
    pub blocks: ArrayVec<Block<D>, MAX_GRIPS>,
    /// What the maps must add up to.
    pub balance: [f64; 6],
    /// Number of rows.
    rank: usize,
    /// Size of the forces: what the barrier and the band go by.
    pub squeeze: f64,
    /// Weight of the wish for normal forces.
    pub weight: f64,
    /// Weight of the friction that contacts need, in newtons.
    cones: f64,
}

/// No forces inside the limits: which limits of each kind stand most in the way, by the multipliers of phase I.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Infeasible {
    /// Contact with the least normal force most in the way.
    pub least: usize,
    /// Contact with the largest normal force most in the way.
    pub largest: usize,
    /// Contact and row of the joint most in the way, if there is one.
    pub joint: Option<(usize, usize)>,
}

/// What is wanted where there are no forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Which limits stand most in the way: phase I is brought to its end.
    Explained,
    /// Nothing: phase I ends as soon as a direction shows it. The limits that are told mean nothing.
    Bare,
}

/// Weight of the barrier in squares of the squeeze: forces then keep some hundredths of a newton inside limits that bind.
const BARRIER: f64 = 1e-3;
/// Square of the Newton decrement below which the next step is the last: the error left is of its square.
const CENTERED: f64 = 1e-12;
/// The same in phase I, where only the bound matters.
const NEARLY_CENTERED: f64 = 0.1;
/// Square of the Newton decrement of a start that is far from the minimum.
const FAR: f64 = 30.0;
/// Forces that keep less from some limit count as none, in shares of the squeeze.
const BAND: f64 = 1e-4;
/// Relative length below which a row of the grasp map counts as combined of the others.
const RANK: f64 = 1e-10;
/// Newton steps: no feasible program of the tests takes a third of them.
const MAX_STEPS: usize = 100;

impl<const D: usize> Program<D> {
    /// The program of these contacts, whose maps are not orthonormal yet. None where no forces whatever balance, as some
    /// wrench is out of reach of all. Weights: of the wish for normal forces, and of the friction that contacts
    /// need, in squeezes.
    pub fn new(
        mut blocks: ArrayVec<Block<D>, MAX_GRIPS>,
        mut balance: [f64; 6],
        squeeze: f64,
        weight: f64,
        cone_weight: f64,
    ) -> Option<Self> {
        let scale = balance.iter().fold(squeeze, |most, b| most.max(b.abs()));
        let rank = orthonormalise(&mut blocks, &mut balance);
        let is_reached = balance[rank..].iter().all(|rest| rest.abs() <= 1e-9 * scale);
        balance[rank..].fill(0.0);
        let cones = cone_weight * squeeze;
        is_reached.then_some(Program { blocks, balance, rank, squeeze, weight, cones })
    }

    /// The minimum. `warm` may be any forces; those near the minimum save time.
    pub fn minimum(&self, warm: Option<Forces<D>>, refusal: Refusal) -> Result<Forces<D>, Infeasible> {
        if let Some(start) = warm.and_then(|warm| self.balanced(warm))
            && let Some(found) = self.center(start)
        {
            return Ok(found);
        }
        let start = self.strictly_inside(refusal)?;
        let undecided = self.infeasible(&start);
        self.center(start).ok_or(undecided)
    }

    /// Balanced forces inside all limits by more than the band.
    pub fn strictly_inside(&self, refusal: Refusal) -> Result<Forces<D>, Infeasible> {
        let start = self.without_limits();
        if self.slack(&start) > self.band() { Ok(start) } else { self.phase_one(start, refusal) }
    }

    /// The same; `warm` may be any forces, and those inside save time.
    pub fn strictly_inside_near(&self, warm: Option<Forces<D>>) -> Option<Forces<D>> {
        let start = warm.and_then(|warm| self.balanced(warm)).filter(|start| self.slack(start) > self.band());
        start.or_else(|| self.strictly_inside(Refusal::Bare).ok())
    }

    /// The minimum without any limits but balance.
    fn without_limits(&self) -> Forces<D> {
        let mut step = NewtonStep::<D>::default();
        for block in &self.blocks {
            let mut hessian = [[0.0; D]; D];
            (0..D).for_each(|i| hessian[i][i] = if i == 0 { self.weight } else { 1.0 });
            step.push(&block.map, &hessian);
        }
        step.factor(self.rank);
        let weighted = |block: &Block<D>| {
            let mut wish = block.wish;
            wish[0] *= self.weight;
            wish
        };
        let wish = self.blocks.iter().map(weighted).collect();
        step.solve(&wish, &self.balance).0
    }

    /// `forces` moved to where they balance, in the metric of the barrier there; None where that leaves the limits.
    fn balanced(&self, forces: Forces<D>) -> Option<Forces<D>> {
        if forces.len() != self.blocks.len() || !(self.slack(&forces) > 0.0) {
            return None;
        }
        let mut point = Point::new(self);
        point.at(self, &forces, 0.0, 1.0 / self.barrier());
        let rest = self.rest(&forces);
        let zero = self.blocks.iter().map(|_| [0.0; D]).collect();
        let (step, _) = point.step.solve(&zero, &rest);
        let moved = moved(&forces, &step, 1.0);
        (self.slack(&moved) > 0.0).then_some(moved)
    }

    fn band(&self) -> f64 {
        BAND * self.squeeze
    }

    fn barrier(&self) -> f64 {
        BARRIER * self.squeeze * self.squeeze
    }

    /// Newton's method from balanced forces strictly inside. None where it does not come to an end.
    ///
    /// Far from the minimum the barrier first counts more, so that the way there does not run along the limits.
    fn center(&self, mut forces: Forces<D>) -> Option<Forces<D>> {
        let last_wish = 1.0 / self.barrier();
        let mut wish = last_wish;
        let mut point = Point::new(self);
        for count in 0..MAX_STEPS {
            point.at(self, &forces, 0.0, wish);
            let (mut step, mut decrement) = point.step.solve(&point.descent, &self.rest(&forces));
            if count == 0 && decrement > FAR {
                wish = last_wish * FAR / decrement;
                point.at(self, &forces, 0.0, wish);
                (step, decrement) = point.step.solve(&point.descent, &self.rest(&forces));
            }
            if wish < last_wish && decrement < 1.0 {
                wish = (10.0 * wish).min(last_wish);
                continue;
            }
            if decrement < CENTERED {
                let mut last = moved(&forces, &step, 1.0);
                self.refine(&point.step, &mut last);
                return (self.slack(&last) > 0.0).then_some(last);
            }
            let value = self.value(&forces, 0.0, wish)?;
            let mut length = 1.0;
            forces = loop {
                let next = moved(&forces, &step, length);
                if let Some(there) = self.value(&next, 0.0, wish)
                    && (there <= value - 0.1 * length * decrement || decrement < 1e-6)
                {
                    break next;
                }
                length *= 0.5;
                if length < 1e-12 {
                    return None;
                }
            };
        }
        None
    }

    /// Takes what is left of the balance by rounding away.
    fn refine(&self, step: &NewtonStep<D>, forces: &mut Forces<D>) {
        let zero = self.blocks.iter().map(|_| [0.0; D]).collect();
        let (correction, _) = step.solve(&zero, &self.rest(forces));
        *forces = moved(forces, &correction, 1.0);
    }

    /// Phase I: gives way at all limits alike, as little as can be.
    fn phase_one(&self, mut forces: Forces<D>, refusal: Refusal) -> Result<Forces<D>, Infeasible> {
        let mut give = -self.slack(&forces) + 0.25 * self.squeeze;
        let degree: f64 = self.blocks.iter().map(|block| 4.0 + 2.0 * block.rows.len() as f64).sum();
        let mut weight = degree / give;
        let mut point = Point::new(self);
        for _ in 0..MAX_STEPS {
            point.at(self, &forces, give, 0.0);
            let rest = self.rest(&forces);
            // The bordered system of forces and give: 10.4.2 again.
            let (straight, _, dual) = point.step.solve_both(&point.descent, &rest);
            let (across, _, dual_across) = point.step.solve_both(&point.mixed, &[0.0; 6]);
            let slope = point.give_slope - weight;
            let curvature = point.give_curvature - dot(&point.mixed, &across);
            let by = (slope - dot(&point.mixed, &straight)) / curvature;
            if refusal == Refusal::Bare && self.is_refused_by(&std::array::from_fn(|k| dual[k] - by * dual_across[k])) {
                return Err(self.infeasible(&forces));
            }
            let step = moved(&straight, &across, -by);
            let decrement = dot(&point.descent, &step) + slope * by;
            if !(decrement > NEARLY_CENTERED) {
                let gap = 2.0 * degree / weight;
                if !(gap < give + self.band()) && !(gap < self.band()) {
                    weight *= 10.0;
                    continue;
                }
                return Err(self.infeasible(&forces));
            }
            let value = weight * give + self.value(&forces, give, 0.0).unwrap_or(f64::INFINITY);
            let mut length = 1.0;
            loop {
                let next = moved(&forces, &step, length);
                let there = give + length * by;
                if let Some(barrier) = self.value(&next, there, 0.0)
                    && weight * there + barrier <= value - 0.1 * length * decrement
                {
                    (forces, give) = (next, there);
                    break;
                }
                length *= 0.5;
                if length < 1e-9 {
                    return Err(self.infeasible(&forces));
                }
            }
            if self.slack(&forces) > self.band() {
                return Ok(forces);
            }
        }
        Err(self.infeasible(&forces))
    }

    fn infeasible(&self, forces: &Forces<D>) -> Infeasible {
        let mut infeasible = Infeasible { least: 0, largest: 0, joint: None };
        // Multipliers are the reciprocals of the slacks: the least slack of a kind is the largest multiplier.
        let (mut least, mut largest, mut joint) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
        for (index, (block, f)) in self.blocks.iter().zip(forces).enumerate() {
            block.slacks(f, |limit, slack| match limit {
                Limit::Least if slack < least => (least, infeasible.least) = (slack, index),
                Limit::Largest if slack < largest => (largest, infeasible.largest) = (slack, index),
                Limit::Joint(row) if slack < joint => (joint, infeasible.joint) = (slack, Some((index, row))),
                _ => {}
            });
        }
        infeasible
    }

    /// Smallest distance from a limit.
    pub fn slack(&self, forces: &Forces<D>) -> f64 {
        let mut least = f64::INFINITY;
        for (block, f) in self.blocks.iter().zip(forces) {
            // NaN must not pass: `min` would drop it.
            block.slacks(f, |_, slack| least = if slack > least { least } else { slack });
        }
        least
    }

    /// What is missing to the balance.
    fn rest(&self, forces: &Forces<D>) -> [f64; 6] {
        let mut rest = self.balance;
        for (block, f) in self.blocks.iter().zip(forces) {
            for (column, x) in block.map.iter().zip(f) {
                (0..6).for_each(|k| rest[k] -= column[k] * x);
            }
        }
        rest
    }

    /// Objective times `wish`, and the barrier with all limits moved out by `give`; None outside.
    fn value(&self, forces: &Forces<D>, give: f64, wish: f64) -> Option<f64> {
        let mut value = 0.0;
        for (block, f) in self.blocks.iter().zip(forces) {
            let across: f64 = f[1..].iter().map(|x| x * x).sum();
            let off: f64 = f[1..].iter().zip(&block.wish[1..]).map(|(x, wished)| (x - wished) * (x - wished)).sum();
            value += wish * (off + self.weight * (f[0] - block.wish[0]) * (f[0] - block.wish[0]));
            // One logarithm of the product: factors are newtons, far from under- and overflow.
            let mut product = 1.0;
            let mut is_inside = true;
            let mut factor = |slack: f64| {
                is_inside &= slack > 0.0;
                product *= slack;
            };
            factor(f[0] - block.least + give);
            factor(block.largest - f[0] + give);
            if block.friction > 0.0 {
                let along = block.friction * f[0] - block.shift + give;
                factor(if along > 0.0 { along * along - across } else { -1.0 });
            }
            for (row, limit) in block.rows.iter().zip(&block.limits) {
                let torque: f64 = row.iter().zip(f).map(|(a, b)| a * b).sum();
                factor(limit - torque + give);
                factor(limit + torque + give);
            }
            if !is_inside {
                return None;
            }
            value -= product.ln();
            if block.friction > 0.0 && wish * self.cones > 0.0 {
                value += wish * self.cones * NeededFriction::of(block, f).value;
            }
        }
        value.is_finite().then_some(value)
    }
}

impl<const D: usize> Block<D> {
    /// Distances from all limits; that from the cone along its axis, times the slope.
    fn slacks(&self, f: &Coordinates<D>, mut tell: impl FnMut(Limit, f64)) {
        tell(Limit::Least, f[0] - self.least);
        tell(Limit::Largest, self.largest - f[0]);
        if self.friction > 0.0 {
            let across: f64 = f[1..].iter().map(|x| x * x).sum::<f64>();
            tell(Limit::Cone, self.friction * f[0] - self.shift - across.sqrt());
        }
        for (joint, (row, limit)) in self.rows.iter().zip(&self.limits).enumerate() {
            let torque: f64 = row.iter().zip(f).map(|(a, b)| a * b).sum();
            tell(Limit::Joint(joint), limit - torque.abs());
        }
    }
}

fn dot<const D: usize>(a: &Forces<D>, b: &Forces<D>) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
}

fn moved<const D: usize>(from: &Forces<D>, step: &Forces<D>, length: f64) -> Forces<D> {
    let mut to = from.clone();
    to.iter_mut().flatten().zip(step.iter().flatten()).for_each(|(x, d)| *x += length * d);
    to
}

/// Rows of the grasp map made orthonormal, the longest first (Gram-Schmidt with pivoting); their number.
fn orthonormalise<const D: usize>(blocks: &mut ArrayVec<Block<D>, MAX_GRIPS>, balance: &mut [f64; 6]) -> usize {
    let product = |blocks: &ArrayVec<Block<D>, MAX_GRIPS>, a: usize, b: usize| -> f64 {
        blocks.iter().flat_map(|block| &block.map).map(|column| column[a] * column[b]).sum()
    };
    let mut longest = 0.0;
    for row in 0..6 {
        let mut pivot = (row, 0.0);
        for other in row..6 {
            let square = product(blocks, other, other);
            if square > pivot.1 {
                pivot = (other, square);
            }
        }
        let length = pivot.1.sqrt();
        if row == 0 {
            longest = length;
        }
        if !(length > RANK * longest) {
            blocks.iter_mut().flat_map(|block| &mut block.map).for_each(|column| column[row..].fill(0.0));
            return row;
        }
        balance.swap(row, pivot.0);
        balance[row] /= length;
        for column in blocks.iter_mut().flat_map(|block| &mut block.map) {
            column.swap(row, pivot.0);
            column[row] /= length;
        }
        for other in row + 1..6 {
            let along = product(blocks, row, other);
            balance[other] -= along * balance[row];
            for column in blocks.iter_mut().flat_map(|block| &mut block.map) {
                column[other] -= along * column[row];
            }
        }
    }
    6
}

/// Derivatives at a point.
struct Point<const D: usize> {
    /// Minus the gradient.
    descent: Forces<D>,
    /// Second derivatives by forces and give.
    mixed: Forces<D>,
    /// Minus the derivative by give.
    give_slope: f64,
    /// Second derivative by give.
    give_curvature: f64,
    step: NewtonStep<D>,
}

impl<const D: usize> Point<D> {
    fn new(program: &Program<D>) -> Self {
        let zero: Forces<D> = program.blocks.iter().map(|_| [0.0; D]).collect();
        Point { descent: zero.clone(), mixed: zero, give_slope: 0.0, give_curvature: 0.0, step: NewtonStep::default() }
    }

    /// Derivatives of [`Program::value`] at `forces` and `give`.
    fn at(&mut self, program: &Program<D>, forces: &Forces<D>, give: f64, wish: f64) {
        self.step.clear();
        (self.give_slope, self.give_curvature) = (0.0, 0.0);
        for (index, (block, f)) in program.blocks.iter().zip(forces).enumerate() {
            let mut descent = [0.0; D];
            let mut mixed = [0.0; D];
            let mut hessian = [[0.0; D]; D];
            for i in 0..D {
                let weight = if i == 0 { program.weight } else { 1.0 };
                descent[i] = -2.0 * wish * weight * (f[i] - block.wish[i]);
                hessian[i][i] = 2.0 * wish * weight + TINY;
            }
            for (slack, slope) in [(f[0] - block.least + give, 1.0), (block.largest - f[0] + give, -1.0)] {
                let pull = 1.0 / slack;
                descent[0] += slope * pull;
                hessian[0][0] += pull * pull;
                mixed[0] += slope * pull * pull;
                self.give_slope += pull;
                self.give_curvature += pull * pull;
            }
            if block.friction > 0.0 {
                self.cone(block, f, give, &mut descent, &mut mixed, &mut hessian);
                if wish * program.cones > 0.0 {
                    NeededFriction::of(block, f).add(wish * program.cones, block, f, &mut descent, &mut hessian);
                }
            }
            for (row, limit) in block.rows.iter().zip(&block.limits) {
                let torque: f64 = row.iter().zip(f).map(|(a, b)| a * b).sum();
                let (low, high) = (1.0 / (limit + torque + give), 1.0 / (limit - torque + give));
                let (first, second) = (low - high, low * low + high * high);
                let cross = low * low - high * high;
                for i in 0..D {
                    descent[i] += first * row[i];
                    mixed[i] += cross * row[i];
                    for j in 0..=i {
                        hessian[i][j] += second * row[i] * row[j];
                    }
                }
                self.give_slope += low + high;
                self.give_curvature += second;
            }
            self.descent[index] = descent;
            self.mixed[index] = mixed;
            self.step.push(&block.map, &hessian);
        }
        self.step.factor(program.rank);
    }

    /// The barrier `-log(u^2 - |v|^2)` with `u = friction f_n - shift + give`.
    #[inline]
    fn cone(
        &mut self,
        block: &Block<D>,
        f: &Coordinates<D>,
        give: f64,
        descent: &mut [f64; D],
        mixed: &mut [f64; D],
        hessian: &mut [[f64; D]; D],
    ) {
        let along = block.friction * f[0] - block.shift + give;
        let across: f64 = f[1..].iter().map(|x| x * x).sum();
        let depth = 1.0 / (along * along - across);
        // Gradient of the depth, by u and v, over the depth.
        let mut pull = [0.0; D];
        pull[0] = 2.0 * along * depth;
        (1..D).for_each(|i| pull[i] = -2.0 * f[i] * depth);
        let by_give = pull[0];
        let twice = by_give * by_give - 2.0 * depth;
        descent[0] += block.friction * by_give;
        hessian[0][0] += block.friction * block.friction * twice;
        mixed[0] += block.friction * twice;
        self.give_slope += by_give;
        self.give_curvature += twice;
        for i in 1..D {
            descent[i] += pull[i];
            mixed[i] += pull[i] * by_give;
            hessian[i][0] += block.friction * pull[i] * by_give;
            for j in 1..=i {
                hessian[i][j] += pull[i] * pull[j];
            }
            hessian[i][i] += 2.0 * depth;
        }
    }
}

/// Keeps coordinates that nothing depends on in their place.
const TINY: f64 = 1e-12;
