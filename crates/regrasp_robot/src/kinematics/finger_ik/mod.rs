//! Finger inverse kinematics to a point: joints that bring the tip's centre to a target (Saut 2011, sec. 3.1).
//!
//! Chains of three independent turning joints have a closed form with all branches; every other chain is solved by
//! damped Newton steps from a table of seeds.

/// Damped Newton steps from a table of seeds, with a preferred direction of the last body in the null space.
mod numeric;
/// Motions of the tip of fingers that cannot go in every direction.
mod push;
/// Real roots of polynomials of degree four and less.
mod quartic;
/// Cells of space that a tip can reach.
mod reach_map;
/// Closed form for chains of three turning joints.
mod three_r;

use super::body_frame::BodyFrame;
use super::chain::{Chain, JointLine, JointMotion};
use arrayvec::ArrayVec;
use nalgebra::Matrix3;
use numeric::NumericIk;
use regrasp_base::Rng;
use regrasp_geometry::{Point, UnitVector, Vector};
use three_r::ThreeR;

/// Most coordinates that a finger may have.
pub const MAX_COORDINATES: usize = 12;

/// Values of a finger's coordinates, in radians or metres.
pub type Coordinates = ArrayVec<f64, MAX_COORDINATES>;

/// Distance of the tip's centre from the target, in metres, that a solution never exceeds.
pub const POSITION_TOLERANCE: f64 = 1e-8;

/// Where the last body should point, for chains that can choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preference {
    /// Wanted direction, in the base frame, of the line from the last joint to the tip's centre. For a contact: the
    /// inward normal of the object there, so that the distal link stays on the outer side.
    pub tip_axis_in_base: UnitVector,
    /// Share of the full correction made in each step, `0..=1`.
    pub weight: f64,
    /// What a joint's way for it costs, against what is left of the direction: 0 where only the direction counts. With more, joints stay
    /// where turning them hardly turns the tip that way (Levenberg 1944).
    pub damping: f64,
}

/// What is asked of a solution besides reaching the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IkSettings {
    /// Distance kept from the limits, in the coordinate's unit.
    pub limit_margin: f64,
    /// Where the last body should point; only chains with more than three coordinates can follow.
    pub preference: Option<Preference>,
    /// Largest change of a coordinate that still counts as the same branch, in the coordinate's unit; for
    /// [`FingerIk::solve_near`] and [`FingerIk::track`]. Default 0.4 (by measurement on a prototype).
    pub max_step: f64,
}

impl Default for IkSettings {
    fn default() -> Self {
        IkSettings { limit_margin: 0.0, preference: None, max_step: 0.4 }
    }
}

/// What [`FingerIk::follow`] is asked for, in the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// How far a point of the last body has still to go, in metres.
    pub error: Vector,
    /// That point as seen from the tip's centre, in metres.
    pub arm: Vector,
    /// How that point moves over the last body when the body turns.
    pub travel: Option<AskedTravel>,
    /// A turn of the last body, where one is asked for too.
    pub turn: Option<AskedTurn>,
}

/// How the point of a curved fingertip that faces a fixed normal moves over it, in the base frame: by `radii` times the
/// velocity that the normal has seen from the tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AskedTravel {
    /// Radii of curvature as a matrix, in metres.
    pub radii: Matrix3<f64>,
    /// The outward normal of the object.
    pub normal: Vector,
}

/// A turn of the last body about an axis, in the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AskedTurn {
    /// The axis, a unit vector.
    pub axis: Vector,
    /// Angle that is still to go, in radians.
    pub left: f64,
}

/// Inverse kinematics of one finger, prepared.
#[derive(Debug, Clone)]
pub struct FingerIk {
    chain: Chain,
    center_in_body: Point,
    method: Method,
    reaches_points: bool,
}

#[derive(Debug, Clone)]
enum Method {
    ClosedForm(Box<ThreeR>),
    Numeric(Box<NumericIk>),
}

impl FingerIk {
    /// Prepares the inverse kinematics of `center_in_body`, a point of the chain's last body.
    ///
    /// Panics if the chain has more than [`MAX_COORDINATES`] coordinates or twice as many joints.
    pub fn new(chain: &Chain, center_in_body: &Point) -> Self {
        assert!(chain.n_coordinates() <= MAX_COORDINATES, "a finger of more than {MAX_COORDINATES} coordinates");
        assert!(chain.joints.len() <= 2 * MAX_COORDINATES, "a finger of more than {} joints", 2 * MAX_COORDINATES);
        let method = match ThreeR::new(chain, center_in_body) {
            Some(closed_form) => Method::ClosedForm(Box::new(closed_form)),
            None => Method::Numeric(Box::new(NumericIk::new(chain, center_in_body))),
        };
        let reaches_points = push::reaches_points(chain, center_in_body);
        FingerIk { chain: chain.clone(), center_in_body: *center_in_body, method, reaches_points }
    }

    /// The chain solved.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// True for chains solved in closed form: [`FingerIk::solve_all`] then misses no branch.
    pub fn is_closed_form(&self) -> bool {
        matches!(self.method, Method::ClosedForm(_))
    }

    /// False when the tip surely cannot come to `target_in_base`; costs a look. True says nothing.
    #[inline]
    pub fn may_reach(&self, target_in_base: &Point) -> bool {
        match &self.method {
            Method::ClosedForm(_) => true,
            Method::Numeric(ik) => ik.may_reach(target_in_base),
        }
    }

    /// True when the tip's centre can move in three independent directions, at some posture at least. Without that it moves on a surface or
    /// a line: it comes to no point that is chosen beforehand, and can follow no motion that is.
    #[inline]
    pub fn reaches_points(&self) -> bool {
        self.reaches_points
    }

    /// Coordinates with which the tip's centre has moved by `length` metres along `direction` (a unit vector in the base frame), to first
    /// order, and beside it as little as the finger can. None where that leaves the limits by less than `limit_margin`, or the tip would
    /// move by more than `largest_slope` beside the direction per metre along it.
    pub fn push(
        &self,
        coordinates: &[f64],
        direction: &Vector,
        length: f64,
        (limit_margin, largest_slope): (f64, f64),
    ) -> Option<Coordinates> {
        let there = push::step(&self.tip_jacobian(coordinates), coordinates, direction, (length, largest_slope))?;
        self.chain.within_limits(&there, limit_margin).then_some(there)
    }

    /// True when a target leaves freedom: more than three coordinates.
    pub fn is_redundant(&self) -> bool {
        self.chain.n_coordinates() > 3
    }

    /// All solutions within the limits, appended to `solutions`. In closed form every branch, in a fixed order; for
    /// other chains what a search from all seeds finds, best first (one per self-motion branch at most roughly).
    pub fn solve_all(&self, target_in_base: &Point, settings: &IkSettings, solutions: &mut Vec<Coordinates>) {
        match &self.method {
            Method::ClosedForm(ik) => {
                solutions.extend(ik.solve_all(&self.chain, target_in_base, settings.limit_margin))
            }
            Method::Numeric(ik) => ik.solve_all(target_in_base, settings, solutions),
        }
    }

    /// One solution, at random among the branches; none when no branch was found.
    pub fn solve_random(&self, target_in_base: &Point, settings: &IkSettings, rng: &mut Rng) -> Option<Coordinates> {
        match &self.method {
            Method::ClosedForm(ik) => {
                let branches = ik.solve_all(&self.chain, target_in_base, settings.limit_margin);
                match branches.len() {
                    0 => None,
                    1 => branches.into_iter().next(),
                    n_branches => branches.into_iter().nth(rng.below(n_branches)),
                }
            }
            Method::Numeric(ik) => ik.solve_random(target_in_base, settings, rng),
        }
    }

    /// Up to `n_wanted` different solutions at random, appended to `solutions`: branches, and for redundant chains
    /// also different values along the null space.
    pub fn solve_many(
        &self,
        target_in_base: &Point,
        n_wanted: usize,
        settings: &IkSettings,
        rng: &mut Rng,
        solutions: &mut Vec<Coordinates>,
    ) {
        match &self.method {
            Method::ClosedForm(ik) => {
                let mut branches = ik.solve_all(&self.chain, target_in_base, settings.limit_margin);
                rng.shuffle(&mut branches);
                solutions.extend(branches.into_iter().take(n_wanted));
            }
            Method::Numeric(ik) => ik.solve_many(target_in_base, n_wanted, settings, rng, solutions),
        }
    }

    /// The solution continuous with `seed`: same branch, no coordinate moved by more than `settings.max_step`.
    ///
    /// None when there is no such solution, and near a singularity where it can't be told from its neighbour.
    pub fn solve_near(&self, target_in_base: &Point, seed: &[f64], settings: &IkSettings) -> Option<Coordinates> {
        match &self.method {
            Method::ClosedForm(ik) => ik.solve_near(&self.chain, target_in_base, seed, settings),
            Method::Numeric(ik) => ik.solve_near(target_in_base, seed, settings),
        }
    }

    /// The coordinates near `start` at which nothing is asked any more: Newton steps of a point of the last body that
    /// changes from one to the next. `asked` is given the frame of the last body in the base frame. This is what a
    /// fingertip needs that rolls: the point that touches depends on where the finger is.
    ///
    /// None where the limits, `settings.max_step` or a singularity are in the way, or `asked` says None.
    pub fn follow(
        &self,
        start: &[f64],
        settings: &IkSettings,
        asked: impl FnMut(&BodyFrame) -> Option<Asked>,
    ) -> Option<Coordinates> {
        numeric::follow(&self.chain, &self.center_in_body, start, settings, asked)
    }

    /// How fast the last body turns about `axis` for each velocity of the point at `arm` from the tip's centre: a vector in
    /// the base frame, in radians per metre. Of the joint velocities that move the point so, the least count. None near a
    /// singularity.
    pub fn turn_per_motion(&self, coordinates: &[f64], arm: &Vector, axis: &Vector) -> Option<Vector> {
        numeric::turn_per_motion(&self.chain, &self.center_in_body, coordinates, arm, axis)
    }

    /// The tip's centre, in the frame of the last body.
    pub fn center_in_body(&self) -> &Point {
        &self.center_in_body
    }

    /// Follows `targets` from `start` with [`FingerIk::solve_near`], appending one solution per target.
    ///
    /// Errors: index of the first target that can't be reached on the branch; the solutions before it are kept.
    pub fn track(
        &self,
        start: &[f64],
        targets_in_base: &[Point],
        settings: &IkSettings,
        solutions: &mut Vec<Coordinates>,
    ) -> Result<(), usize> {
        let mut current: Coordinates = start.iter().copied().collect();
        for (i, target) in targets_in_base.iter().enumerate() {
            current = self.solve_near(target, &current, settings).ok_or(i)?;
            solutions.push(current.clone());
        }
        Ok(())
    }

    /// The tip's centre at `coordinates`, in the base frame.
    #[inline]
    pub fn tip(&self, coordinates: &[f64]) -> Point {
        self.chain.last_frame(coordinates).point(&self.center_in_body)
    }

    /// How far points of the finger move, to first order, when the coordinates change by `changes`, at most: joints, the tip's centre,
    /// and what is no farther than `radius` from the lines between them.
    pub fn displacement(&self, coordinates: &[f64], changes: &[f64], radius: f64) -> f64 {
        let mut lines: ArrayVec<JointLine, { 2 * MAX_COORDINATES }> = ArrayVec::new();
        let tip = self.chain.joint_lines(coordinates, &mut lines).point(&self.center_in_body).coords;
        // The bodies so far move by `shift + turn x point`.
        let (mut shift, mut turn, mut most) = (Vector::zeros(), Vector::zeros(), 0.0f64);
        for (i, (joint, line)) in self.chain.joints.iter().zip(&lines).enumerate() {
            let moved = joint.drive.terms.iter().map(|&(k, multiplier)| multiplier * changes[k]);
            let change = line.axis * moved.reduce(|sum, moved| sum + moved).unwrap_or(0.0);
            match joint.motion {
                JointMotion::Turn => {
                    turn += change;
                    shift -= change.cross(&line.origin);
                }
                JointMotion::Slide => shift += change,
            }
            let end = lines.get(i + 1).map_or(tip, |next| next.origin);
            let moved = |point: &Vector| (shift + turn.cross(point)).norm();
            most = most.max(moved(&line.origin).max(moved(&end)) + radius * turn.norm());
        }
        most
    }

    /// Columns of the Jacobian of the tip's centre, one per coordinate, in the base frame.
    pub fn tip_jacobian(&self, coordinates: &[f64]) -> ArrayVec<Vector, MAX_COORDINATES> {
        let mut lines: ArrayVec<JointLine, { 2 * MAX_COORDINATES }> = ArrayVec::new();
        let tip = self.chain.joint_lines(coordinates, &mut lines).point(&self.center_in_body).coords;
        let mut columns: ArrayVec<Vector, MAX_COORDINATES> =
            (0..self.chain.n_coordinates()).map(|_| Vector::zeros()).collect();
        for (joint, line) in self.chain.joints.iter().zip(&lines) {
            let column = match joint.motion {
                JointMotion::Turn => line.axis.cross(&(tip - line.origin)),
                JointMotion::Slide => line.axis,
            };
            for &(k, multiplier) in &joint.drive.terms {
                columns[k] += multiplier * column;
            }
        }
        columns
    }
}

#[cfg(test)]
mod tests;
