//! Plans that allow themselves more than the scene does, or leave out what holds the object.

use super::Breeder;
use super::choice::{any_drive, waypoints_mut};
use regrasp_base::Rng;
use regrasp_geometry::Vector;
use regrasp_plan::check::allowance::friction_margin;
use regrasp_plan::check::violation::ViolationKind::{
    ForcesAbsent, FrictionMarginTooSmall, LimitExceeded, PromiseBroken,
};
use regrasp_plan::plan::Plan;

impl Breeder<'_> {
    pub(super) fn break_limits(&mut self) {
        let (limits, model) = (self.task.scene.limits, self.model);
        self.add("speed promised above the scene's", &[LimitExceeded], |plan, rng| {
            plan.promises.motion.largest_speed = limits.largest_speed * log_uniform(rng, 1.001, 1e7);
            Some(())
        });
        self.add("joint acceleration promised above the scene's", &[LimitExceeded], |plan, rng| {
            let accelerations = &mut plan.promises.motion.joint_accelerations;
            let k = rng.below(accelerations.len());
            accelerations[k] = limits.joint_acceleration * log_uniform(rng, 1.001, 1e7);
            Some(())
        });
        self.add("joint velocity promised above the scene's", &[LimitExceeded], |plan, rng| {
            let drive = any_drive(model, rng, |drive| {
                !model.drives.iter().any(|other| {
                    drive.own_coordinate().is_some_and(|k| other.drive.is_driven_by(k)) && other.velocity.is_some()
                })
            })?;
            plan.promises.motion.joint_velocities[drive.own_coordinate()?] =
                limits.joint_velocity * log_uniform(rng, 1.001, 1e6);
            Some(())
        });
        self.add("normal force promised above the scene's", &[LimitExceeded], |plan, rng| {
            plan.promises.forces.as_mut()?.normal_force[1] = limits.normal_force * log_uniform(rng, 1.001, 1e7);
            Some(())
        });
        let friction = self.task.object().friction;
        let margin = friction_margin(&self.task, self.plan);
        self.add("friction margin given up", &[FrictionMarginTooSmall], |plan, rng| {
            plan.promises.friction_margin = rng.uniform(1.0, 0.5 * (1.0 + margin));
            plan.promises.friction = friction / plan.promises.friction_margin;
            (margin > 1.01 && friction > 0.0).then_some(())
        });
        self.break_gravity();
        self.add("all forces left out", &[ForcesAbsent], |plan, _| {
            plan.promises.forces.take()?;
            strip_forces(plan);
            Some(())
        });
    }

    fn break_gravity(&mut self) {
        let has_direction = self.task.scene.gravity().in_world().is_some();
        self.add("gravity turned aside", &[PromiseBroken], |plan, rng| {
            let gravity = plan.promises.forces.as_mut()?.gravity_in_world.as_mut()?;
            let down = Vector::from(*gravity);
            let side = down.cross(&Vector::from(rng.direction())).try_normalize(1e-3)?;
            let turned = nalgebra::Rotation3::new(side * log_uniform(rng, 1e-5, 3.0)) * down;
            *gravity = turned.into();
            Some(())
        });
        self.add("gravity of any direction where the scene has one", &[PromiseBroken], |plan, _| {
            plan.promises.forces.as_mut()?.gravity_in_world.take()?;
            has_direction.then_some(())
        });
    }
}

/// A number drawn evenly over the orders of magnitude from `low` to `high`.
fn log_uniform(rng: &mut Rng, low: f64, high: f64) -> f64 {
    rng.uniform(low.ln(), high.ln()).exp()
}

/// Takes every force and torque out of the waypoints.
fn strip_forces(plan: &mut Plan) {
    for waypoint in waypoints_mut(plan) {
        waypoint.joint_torques.clear();
        for contact in &mut waypoint.contacts {
            (contact.force_in_object, contact.torsion) = (None, None);
        }
    }
}
