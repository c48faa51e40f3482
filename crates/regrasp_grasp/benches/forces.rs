//! Times of force distribution, best of several rounds, in nanoseconds per call.
#![allow(clippy::print_stdout)]

use regrasp_base::Rng;
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_grasp::wrench::{BalancedForces, JointRow, JointRows, can_balance, distribute};
use regrasp_grasp::{Contact, ContactForce, ContactModel, ForceLimits, ForceProblem, GraspFrame, Grip, Wrench};
use std::hint::black_box;
use std::time::Instant;

const FRAME: GraspFrame =
    GraspFrame { center_of_mass: Point::new(0.001, -0.002, 0.003), torque_scale: 0.03, friction: 0.53 };
const LIMITS: ForceLimits =
    ForceLimits { least: 2.0, largest: 15.0, squeeze: 4.0, squeeze_weight: 0.2, cone_weight: 1.0 };

/// A grasp and what it carries.
struct Set {
    grips: Vec<Grip>,
    joints: Vec<JointRows>,
    weight: Vector,
}

impl Set {
    /// With `more` newtons along x.
    fn problem(&self, more: f64) -> ForceProblem<'_> {
        let load = Wrench::at_center_of_mass(self.weight + Vector::new(more, 0.0, 0.0));
        ForceProblem {
            grips: &self.grips,
            joints: &self.joints,
            reserves: &[],
            rubbing: &[],
            frame: &FRAME,
            load,
            limits: LIMITS,
        }
    }
}

/// Contacts on a sphere, about `spread` away from being evenly opposed.
fn grips(n: usize, model: ContactModel, spread: f64, rng: &mut Rng) -> Vec<Grip> {
    let pole = Vector::from(rng.direction());
    let side = pole.cross(&Vector::from(rng.direction())).normalize();
    (0..n)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            let about = pole * angle.cos() + side * angle.sin();
            let normal = UnitVector::new_normalize(about + Vector::from(rng.direction()) * spread);
            let contact =
                Contact { point_in_object: Point::from(normal.into_inner() * 0.03), normal_in_object: normal };
            Grip { contact, model }
        })
        .collect()
}

fn best_of(mut round: impl FnMut()) -> f64 {
    (0..15)
        .map(|_| {
            let start = Instant::now();
            round();
            start.elapsed().as_nanos() as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn main() {
    let mut rng = Rng::keyed(1, "forces bench", 0);
    let soft = ContactModel::SoftFinger { torsion_radius: 0.005 };
    for (name, n, model, n_joints) in [
        ("3 points", 3, ContactModel::Point, 0),
        ("3 points, 4 joints each", 3, ContactModel::Point, 4),
        ("4 points", 4, ContactModel::Point, 0),
        ("4 points, 4 joints each", 4, ContactModel::Point, 4),
        ("3 soft, 4 joints each", 3, soft, 4),
        ("4 soft, 4 joints each", 4, soft, 4),
    ] {
        let joint = |rng: &mut Rng| JointRow {
            per_force: Vector::from(rng.direction()) * rng.uniform(0.02, 0.1),
            per_torsion: rng.uniform(-1.0, 1.0),
            limit: 0.7,
        };
        let set = |_| Set {
            joints: (0..n).map(|_| (0..n_joints).map(|_| joint(&mut rng)).collect()).collect(),
            weight: Vector::from(rng.direction()),
            grips: grips(n, model, 0.9, &mut rng),
        };
        let sets: Vec<Set> = (0..400).map(set).collect();
        let (good, bad): (Vec<Set>, Vec<Set>) = sets.into_iter().partition(|set| can_balance(&set.problem(0.0)));
        for (which, of) in [("balanced", good), ("not balanced", bad)] {
            let warm: Vec<Option<BalancedForces>> = of.iter().map(|s| distribute(&s.problem(0.0), None).ok()).collect();
            let time = |ask: fn(&ForceProblem, Option<&[ContactForce]>) -> bool, turn: f64| {
                let round = || {
                    for (set, warm) in of.iter().zip(&warm) {
                        black_box(ask(black_box(&set.problem(turn)), warm.as_ref().map(|warm| warm.as_slice())));
                    }
                };
                best_of(round) / of.len().max(1) as f64
            };
            // A twentieth of a newton: gravity turned by three degrees.
            println!(
                "{name:<26} {which:<13} can_balance {:>6.0} ns, cold {:>6.0} ns, warm {:>6.0} ns  ({} sets)",
                time(|problem, _| can_balance(problem), 0.0),
                time(|problem, _| distribute(problem, None).is_ok(), 0.0),
                time(|problem, warm| distribute(problem, warm).is_ok(), 0.05),
                of.len()
            );
        }
    }
}
