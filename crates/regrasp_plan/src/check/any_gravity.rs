//! Room for the object's weight in every direction, where a plan does not say which.
//!
//! `K` are the force columns of the least-norm right inverse of the grasp map. Forces `f` that balance nothing, less `w K d`,
//! balance a weight of `w` newtons along the unit vector `d`. Over all `d`, a row `k` of `K` changes by at most `w |k|`, rows
//! `T` together by at most `w` times their largest singular value, and what is linear in them alike: what is kept free by as
//! much is enough for every direction (`docs/reference/plan-format.md`, forces).

use crate::check::Log;
use crate::check::closure::{grasp_map, right_inverse};
use crate::check::forces::{Exerted, GRAVITY, Judge};
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::plan::Waypoint;
use nalgebra::{DMatrix, RowVector3};
use regrasp_geometry::frame::tangents;
use regrasp_geometry::{UnitVector, Vector};
use regrasp_grasp::{Contact, Grip};

impl Judge<'_> {
    /// Judges the room that the forces of the holding fingers leave for the object's weight, as great as promised.
    pub(super) fn check_room(&self, waypoint: &Waypoint, exerted: &[Exerted], at: Moment, log: &mut Log) {
        let weight = self.promises.mass * GRAVITY;
        let grips: Vec<Grip> = exerted.iter().map(|one| self.grip(one)).collect();
        let (map, cones) = grasp_map(&grips, &self.body);
        let Some(inverse) = right_inverse(&map) else {
            let message = "the contacts do not balance a weight of every direction";
            log.push(Violation::new(Kind::ForceUnbalanced, message).when(at).subjects(["object"]));
            return;
        };
        for (one, cone) in exerted.iter().zip(&cones) {
            let answer = inverse.view((cone.start, 0), (cone.len(), 3)) * weight;
            self.check_contact_room(one, &answer, at, log);
            self.check_torque_room(waypoint, one, &answer, at, log);
        }
    }

    fn grip(&self, one: &Exerted) -> Grip {
        let normal_in_object = UnitVector::new_unchecked(one.normal);
        let contact = Contact { point_in_object: one.point, normal_in_object };
        Grip { contact, model: self.model.fingers[one.finger].contact }
    }

    /// `answer`: what each coordinate of the contact takes of a weight along each axis of the object frame.
    fn check_contact_room(&self, one: &Exerted, answer: &DMatrix<f64>, at: Moment, log: &mut Log) {
        let name = self.model.fingers[one.finger].name.as_str();
        let tolerance = self.settings.force_tolerance;
        let [least, largest] = self.promises.normal_force;
        let (pressing, normal_room) = (one.pressing(), answer.row(0).norm());
        if pressing - normal_room < least - tolerance || pressing + normal_room > largest + tolerance {
            let message = format!(
                "finger \"{name}\" presses with {pressing:.6} N, the weight of some direction changes that by {normal_room:.6} N, beyond {least} to {largest} N"
            );
            let violation = Violation::new(Kind::NormalForceOutOfRange, message).when(at);
            log.push(
                violation
                    .subjects([name])
                    .amount(pressing, if pressing < 0.5 * (least + largest) { least } else { largest }),
            );
        }
        let across_room = match answer.nrows() {
            1 => 0.0,
            n_rows => answer.rows(1, n_rows - 1).singular_values().max(),
        };
        let across = self.across(one) + across_room;
        let room = self.body.friction * (pressing - normal_room);
        if answer.nrows() > 1 && across > room + tolerance {
            let message = format!(
                "finger \"{name}\" may have to exert {across:.4e} N across the normal for the weight of some direction, {room:.4e} N are left by friction"
            );
            let violation = Violation::new(Kind::ForceOutsideCone, message).when(at);
            log.push(violation.subjects([name]).amount(across, room));
        }
    }

    /// `answer` as in [`Judge::check_contact_room`]; of the joints only this finger's change with it. A torque may be above
    /// its limit by the share `torque_tolerance` of the limit.
    fn check_torque_room(&self, waypoint: &Waypoint, one: &Exerted, answer: &DMatrix<f64>, at: Moment, log: &mut Log) {
        let (x, y) = tangents(&UnitVector::new_unchecked(one.normal));
        let radius = self.torsion_radius(one);
        let units = [
            (-one.normal, Vector::zeros()),
            (x.into_inner(), Vector::zeros()),
            (y.into_inner(), Vector::zeros()),
            (Vector::zeros(), one.normal * radius),
        ];
        let mut changes = vec![RowVector3::zeros(); waypoint.joint_torques.len()];
        for (j, (force, couple)) in units.iter().enumerate().take(answer.nrows()) {
            for work in self.torques(waypoint, one, force, couple) {
                changes[work.coordinate] += answer.fixed_view::<1, 3>(j, 0) * work.torque;
            }
        }
        for (k, change) in changes.iter().enumerate().filter(|(_, change)| change.norm() > 0.0) {
            let Some(limit) = self.promises.joint_torques[k] else { continue };
            let most = waypoint.joint_torques[k].abs() + change.norm();
            if most > limit * (1.0 + self.settings.torque_tolerance) {
                let name = self.plan.joint_names[k].as_str();
                let message = format!(
                    "joint \"{name}\" may need torque {most:.4} for the weight of some direction, {limit:.4} is allowed"
                );
                let violation = Violation::new(Kind::TorqueLimit, message).when(at);
                log.push(violation.subjects([name]).amount(most, limit));
            }
        }
    }
}
