//! One transfer that arrives exactly where it should.
//!
//! Soft fingertips that do not turn about their normals leave the object fewer than six directions. Where it ends depends on the
//! contacts at the start and, less, on the way there (a nonholonomic system, as a ball that rolls on a plate). The object follows
//! a target that goes to the goal with offsets that vanish at both ends; Newton's method finds the contacts and offsets with
//! which it ends there.
//!
//! Hands that can never change their grasp shift the contacts at the start ([`arrive`]). Others keep the contacts, come near by
//! many transfers, and end with a loop ([`arrive_by_loop`]). A closed path of the target leaves the object displaced by the Lie
//! brackets of the allowed directions, in proportion to the square of the loop's size (steering by sinusoids: Murray and Sastry
//! 1993).

use crate::in_hand::moving::spin::{Conditions, Twist, moved, step, step_to, twist_between};
use nalgebra::{DMatrix, DVector};
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::frame::{PoseLine, tangents};
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::state::{GraspState, Moment};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::rolling::follow::follow_contact;

/// Waves of the offset, each of six numbers, beside shifts of the contacts.
const WAVES: usize = 1;
/// The same of a loop. Loops enclose an area only with two waves or more.
const WAVES_OF_LOOP: usize = 2;
/// Loops tried, and the standard deviation of their first numbers, in metres. By hand.
const LOOPS: usize = 4;
const SIZE_OF_LOOP: f64 = 0.005;
/// How far from the goal a loop is tried: a twist, in metres. By measurement: a loop of 20 to 40 mm closes 4 mm, and some close
/// 10 mm.
pub const LOOP_REACH: f64 = 0.010;
/// Way of the target along a loop, as a multiple of the norm of its numbers.
const WAY_OF_LOOP: f64 = 4.0;
/// Newton steps.
const MAX_ITERATIONS: usize = 12;
/// Distance from the goal from which on the last step is made to it, in metres.
const NEAR: f64 = 1e-6;
/// Change of a number for derivatives, in metres.
const PROBE: f64 = 1e-5;
/// Largest change of the numbers in one iteration, and largest numbers, in metres. By hand.
const LARGEST_CHANGE: f64 = 0.012;
const LARGEST: f64 = 0.08;
/// Least progress of an iteration: what remains of the error.
const PROGRESS: f64 = 0.8;
/// Largest error of the way without offsets that is worth the search, as a share of the way. By hand.
const LARGEST_ERROR: f64 = 0.15;

/// A transfer.
pub struct Arrival {
    /// Where it begins: near the grasp that was asked about.
    pub start: GraspState,
    /// Its moments after that; the last one is at the goal.
    pub moments: Vec<Moment>,
}

/// A transfer from a grasp near `near` that ends at exactly `goal`. Collisions and forces are not looked at. Steps of the
/// object count as `work`.
pub fn arrive(model: &Model, near: &GraspState, goal: &Pose, work: &mut u64) -> Option<Arrival> {
    let problem = Problem { model, near, goal, shifts: Shifts::AllContacts, waves: WAVES };
    let largest_error = LARGEST_ERROR * twist_between(model, &near.world_from_object, goal).norm();
    problem.solve(DVector::zeros(problem.n_numbers()), largest_error, work)
}

/// A transfer with the grasp `from` that makes a loop and ends at exactly `goal`, which is near. Collisions and forces are not
/// looked at. Steps of the object count as `work`.
pub fn arrive_by_loop(model: &Model, from: &GraspState, goal: &Pose, rng: &mut Rng, work: &mut u64) -> Option<Arrival> {
    let problem = Problem { model, near: from, goal, shifts: Shifts::None, waves: WAVES_OF_LOOP };
    (0..LOOPS).find_map(|_| {
        let numbers = DVector::from_fn(problem.n_numbers(), |_, _| SIZE_OF_LOOP * rng.normal());
        problem.solve(numbers, f64::INFINITY, work)
    })
}

/// Which contacts at the start are shifted, by two numbers each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shifts {
    AllContacts,
    None,
}

/// A transfer from about `near` to exactly `goal`, with the numbers that are sought: shifts of the contacts, then offsets.
struct Problem<'a> {
    model: &'a Model<'a>,
    near: &'a GraspState,
    goal: &'a Pose,
    shifts: Shifts,
    waves: usize,
}

impl Problem<'_> {
    fn n_shifts(&self) -> usize {
        match self.shifts {
            Shifts::AllContacts => 2 * self.model.n_fingers(),
            Shifts::None => 0,
        }
    }

    fn n_numbers(&self) -> usize {
        self.n_shifts() + 6 * self.waves
    }

    /// Newton's method from `numbers`, given up where the first error is larger than `largest_error`.
    fn solve(&self, mut numbers: DVector<f64>, largest_error: f64, work: &mut u64) -> Option<Arrival> {
        let n = numbers.len();
        let mut before = largest_error / PROGRESS;
        for _ in 0..MAX_ITERATIONS {
            let found = self.go(&numbers, work)?;
            let error = self.left(&found);
            if error.norm() < NEAR {
                return end_at(self.model, found, self.goal);
            }
            // Newton steps that lead nowhere: the goal is out of reach.
            if error.norm() > PROGRESS * before {
                return None;
            }
            before = error.norm();
            let mut slopes = DMatrix::zeros(6, n);
            for k in 0..n {
                let mut probe = numbers.clone();
                probe[k] += PROBE;
                let change = self.left(&self.go(&probe, work)?) - error;
                slopes.set_column(k, &(change / PROBE));
            }
            let square = &slopes * slopes.transpose();
            let damping = 1e-6 * square.trace();
            let error = DVector::from_column_slice(error.as_slice());
            let change = slopes.transpose() * (square + DMatrix::identity(6, 6) * damping).cholesky()?.solve(&error);
            numbers -= &change * (LARGEST_CHANGE / change.norm()).min(1.0);
            if numbers.norm() > LARGEST {
                return None;
            }
        }
        None
    }

    fn left(&self, found: &Arrival) -> Twist {
        let at = found.moments.last().map_or(found.start.world_from_object, |last| last.world_from_object);
        twist_between(self.model, &at, self.goal)
    }

    /// The transfer with these numbers.
    fn go(&self, numbers: &DVector<f64>, work: &mut u64) -> Option<Arrival> {
        let Problem { model, goal, .. } = *self;
        let offsets = numbers.rows(self.n_shifts(), 6 * self.waves);
        let (start, detour) = match self.shifts {
            Shifts::AllContacts => (shifted(model, self.near, numbers)?, 0.0),
            Shifts::None => (self.near.clone(), WAY_OF_LOOP * offsets.norm()),
        };
        let line = PoseLine::between(&start.world_from_object, goal);
        let whole = twist_between(model, &start.world_from_object, goal).norm() + detour;
        let n_steps = (1.5 * whole / model.settings.step).ceil() as usize + 1;
        let mut moments: Vec<Moment> = Vec::with_capacity(n_steps);
        let mut here = start.moment();
        for k in 1..=n_steps {
            let t = k as f64 / n_steps as f64;
            let mut offset = Twist::zeros();
            for wave in 0..self.waves {
                let height = ((wave + 1) as f64 * std::f64::consts::PI * t).sin();
                offset += Twist::from_fn(|i, _| height * offsets[6 * wave + i]);
            }
            let target = moved(model, &line.at(t), &offset);
            let conditions = Conditions::of(model, start.holding, &here)?;
            let way = conditions.project(&twist_between(model, &here.world_from_object, &target))?;
            *work += 1;
            here = step(model, start.holding, &here, &way, &conditions).ok()?;
            moments.push(here.clone());
        }
        Some(Arrival { start, moments })
    }
}

/// The grasp with its contacts shifted over the surface by two numbers each.
fn shifted(model: &Model, near: &GraspState, numbers: &DVector<f64>) -> Option<GraspState> {
    let placement = Placement::from(&near.world_from_object);
    let object = &model.view.object;
    let mut start = near.clone();
    for finger in (0..model.n_fingers()).filter(|&finger| near.holds(finger)) {
        let Contact { point_in_object, normal_in_object } = near.contacts[finger];
        let (x, y) = tangents(&normal_in_object);
        let shift: Vector = x.into_inner() * numbers[2 * finger] + y.into_inner() * numbers[2 * finger + 1];
        let foot = object.surface.project(&(point_in_object + shift));
        if !model.keeps_off_edges(&foot) {
            return None;
        }
        let contact = Contact { point_in_object: foot.point_in_object, normal_in_object: foot.normal_in_object };
        start.joints[finger] = follow_contact(model, finger, &contact, &placement, &near.joints[finger])?;
        start.contacts[finger] = contact;
    }
    Some(start)
}

/// The same transfer with its last moment at exactly `goal`.
fn end_at(model: &Model, mut found: Arrival, goal: &Pose) -> Option<Arrival> {
    found.moments.pop();
    let before = found.moments.last().cloned().unwrap_or_else(|| found.start.moment());
    found.moments.push(step_to(model, found.start.holding, &before, goal)?);
    Some(found)
}
