//! Contact forces while the object rests in a hand, and while it moves.

use crate::context::{Context, Grasp};
use regrasp_arms::times::TimedPath;
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::ContactForce;
use regrasp_grasp::wrench::{BalancedForces, Wrench};

/// Share of the weight that contact forces may be off, at any moment. Plans promise twice as much
/// (`docs/reference/plan-format.md`, Plans of pick and place).
const LARGEST_SHARE: f64 = 0.01;
/// Time between the poses that accelerations are taken from, in seconds.
const SHORT: f64 = 1e-3;
/// The weight that inertia is compared with is that on Earth, in m/s^2.
const STANDARD_GRAVITY: f64 = 9.80665;
/// Places of a step at which forces are compared.
const LOOKS: usize = 8;

/// The load of the object at rest at a pose.
pub fn weight(context: &Context, world_from_object: &Pose) -> Wrench {
    let force = context.gravity * context.object.mass;
    Wrench::at_center_of_mass(world_from_object.rotation.inverse() * force)
}

/// Forces of a hand under a load.
pub fn under(context: &Context, hand: usize, grasp: &Grasp, load: Wrench) -> Option<BalancedForces> {
    let model = context.hands[hand].model;
    let forces = model.forces.as_ref()?;
    grasp.held.forces_under(model, forces, load, None).ok()
}

/// True when the hand holds the object at rest at a pose.
pub fn holds(context: &Context, hand: usize, grasp: &Grasp, world_from_object: &Pose) -> bool {
    let model = context.hands[hand].model;
    let Some(forces) = &model.forces else { return false };
    grasp.held.is_balanced_under(model, forces, weight(context, world_from_object))
}

/// The largest contact force of a hand that holds the object at rest at a pose, over the object's weight. None where it does not hold it.
///
/// Two fingers that press against each other while the others hardly touch need large forces, and the object turns between them as soon
/// as servos give way.
pub fn strain(context: &Context, hand: usize, grasp: &Grasp, world_from_object: &Pose) -> Option<f64> {
    let load = weight(context, world_from_object);
    let forces = under(context, hand, grasp, load)?;
    let largest = forces.iter().map(|own| own.force.norm()).fold(0.0, f64::max);
    Some(if largest > 0.0 { largest / load.force.norm() } else { 0.0 })
}

/// What a hand carries.
#[derive(Clone)]
pub struct Carried<'g> {
    /// The hand.
    pub hand: usize,
    /// Its grasp.
    pub grasp: &'g Grasp,
    /// The object in the frame of the hand's base.
    pub hand_from_object: Pose,
}

impl Carried<'_> {
    /// Where the object is in a state.
    pub fn world_from_object(&self, context: &Context, state: &[f64]) -> Pose {
        context.world_from_hand(self.hand, state) * self.hand_from_object
    }

    /// The load at a moment of a step: weight and inertia, in the object frame.
    fn load(&self, context: &Context, timed: &TimedPath, step: usize, share: f64) -> Wrench {
        let track = timed.track(step);
        let span = timed.points[step + 1].time - timed.points[step].time;
        let h = SHORT.min(0.1 * span);
        let at = |offset: f64| self.world_from_object(context, &track.at(share + offset / span));
        let poses = [at(-2.0 * h), at(-h), at(0.0), at(h), at(2.0 * h)];
        let now = &poses[2];
        // Differences of fourth order.
        let first = |x: &[Vector; 5]| (x[0] - x[1] * 8.0 + x[3] * 8.0 - x[4]) / (12.0 * h);
        let second = |x: &[Vector; 5]| (x[1] * 16.0 - x[0] - x[2] * 30.0 + x[3] * 16.0 - x[4]) / (12.0 * h * h);
        let acceleration = second(&poses.map(|pose| (pose * context.object.center_of_mass).coords));
        // Turns are small: their first and second derivative at zero are angular velocity and acceleration.
        let turns = poses.map(|pose| (pose.rotation * now.rotation.inverse()).scaled_axis());
        let into_object = now.rotation.inverse();
        let (spin, spin_up) = (into_object * first(&turns), into_object * second(&turns));
        let inertia = &context.inertia;
        Wrench {
            force: into_object * ((context.gravity - acceleration) * context.object.mass),
            torque: -(inertia * spin_up + spin.cross(&(inertia * spin))),
        }
    }

    /// The largest inertia of the object along a motion, as a share of its weight on Earth ([`TaskSettings::carried_inertia`]).
    ///
    /// [`TaskSettings::carried_inertia`]: regrasp_manipulation::task_settings::TaskSettings::carried_inertia
    pub fn inertia_share(&self, context: &Context, timed: &TimedPath) -> f64 {
        let frame = &context.hands[self.hand].model.frame;
        let heavy = context.object.mass * STANDARD_GRAVITY;
        let share = |step: usize, look: usize| {
            let share = look as f64 / LOOKS as f64;
            let state = timed.track(step).at(share);
            let rests = weight(context, &self.world_from_object(context, &state));
            let load = self.load(context, timed, step, share);
            let torque = (load.torque - rests.torque).norm() / frame.torque_scale;
            (load.force - rests.force).norm().max(torque) / heavy
        };
        let looks = (0..timed.corners.len()).flat_map(|step| (0..=LOOKS).map(move |look| (step, look)));
        looks.map(|(step, look)| share(step, look)).fold(0.0, f64::max)
    }

    /// Forces at every point of a motion. Errors: what is wrong.
    pub fn along(&self, context: &Context, timed: &TimedPath) -> Result<Vec<BalancedForces>, Off> {
        let model = context.hands[self.hand].model;
        let Some(forces) = &model.forces else { return Err(Off::NotHeld) };
        let n_steps = timed.corners.len();
        let mut found: Vec<BalancedForces> = Vec::with_capacity(n_steps + 1);
        for k in 0..=n_steps {
            // Accelerations differ a little before and after a waypoint.
            let mut load = self.load(context, timed, k.min(n_steps - 1), if k < n_steps { 0.0 } else { 1.0 });
            if k == 0 || k == n_steps {
                // From rest to rest: as in the moments of rest before and behind.
                load = weight(context, &self.world_from_object(context, &timed.points[k].joints));
            } else {
                let before = self.load(context, timed, k - 1, 1.0);
                load = Wrench { force: (load.force + before.force) * 0.5, torque: (load.torque + before.torque) * 0.5 };
            }
            let own = self.grasp.held.forces_under(model, forces, load, found.last()).map_err(|_| Off::NotHeld)?;
            found.push(own);
        }
        let most = LARGEST_SHARE * context.object.mass * context.gravity.norm();
        for step in 0..n_steps {
            for look in 0..=LOOKS {
                let share = look as f64 / LOOKS as f64;
                let load = self.load(context, timed, step, share);
                let between: Vec<ContactForce> =
                    found[step].iter().zip(&found[step + 1]).map(|(a, b)| mixed(a, b, share)).collect();
                let left = load.with_forces(self.grasp.held.grips(), &between, &model.frame);
                if left.force.norm() > most || left.torque.norm() > most * model.frame.torque_scale {
                    return Err(Off::Coarse);
                }
            }
        }
        Ok(found)
    }
}

/// Why there are no forces along a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Off {
    /// It is too fast for the hand.
    NotHeld,
    /// Waypoints are too far apart.
    Coarse,
}

fn mixed(a: &ContactForce, b: &ContactForce, share: f64) -> ContactForce {
    ContactForce { force: a.force + (b.force - a.force) * share, torsion: a.torsion + share * (b.torsion - a.torsion) }
}
