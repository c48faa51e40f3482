//! Contact forces, torques and what is promised of them, gone wrong.

use super::choice::{any_drive, any_segment, any_waypoint, pick, waypoints, waypoints_mut};
use super::{Breeder, Mutant};
use regrasp_base::Rng;
use regrasp_geometry::{Pose, UnitVector, Vector};
use regrasp_grasp::ContactModel;
use regrasp_plan::check::forces::torques_of;
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::roles::{contact_of, moving_finger};
use regrasp_plan::check::violation::ViolationKind::{
    ForceMissing, ForceOutsideCone, ForceUnbalanced, FrictionAboveScene, MovingFingerPresses, NormalForceOutOfRange,
    NotANumber, PromiseBroken, TorqueLimit, TorqueWrong, WrongScene,
};
use regrasp_plan::plan::{ContactState, ForcePromises, Plan, SegmentKind, Waypoint};
use regrasp_scene::Gravity;

impl Breeder<'_> {
    pub(super) fn break_forces(&mut self) {
        self.break_friction_margin();
        self.break_force_promises();
        self.break_balance();
        self.break_cones();
        self.break_torques();
    }

    fn break_friction_margin(&mut self) {
        let scene_friction = self.task.object().friction;
        self.add("friction margin invented", &[FrictionAboveScene], |plan, rng| {
            plan.promises.friction_margin *= rng.uniform(1.01, 1.2);
            (plan.promises.friction * plan.promises.friction_margin > scene_friction * 1.0001).then_some(())
        });
        self.add("friction margin below one", &[PromiseBroken], |plan, rng| {
            plan.promises.friction_margin = rng.uniform(0.5, 0.99);
            Some(())
        });
    }

    fn break_force_promises(&mut self) {
        let model = self.model;
        self.add("mass promised lighter", &[PromiseBroken], |plan, rng| {
            promises(plan)?.mass *= rng.uniform(0.9, 0.9999);
            Some(())
        });
        let mut scene = self.task.scene.clone();
        if self.plan.promises.forces.is_some() {
            scene.objects[self.task.object_index].mass *= self.rng.uniform(1.001, 1.1);
            let plan = self.plan.clone();
            let name = "object heavier than it was";
            self.found.push(Mutant { name, plan, scene: Some(scene), expected: vec![PromiseBroken] });
        }
        self.add("gravity promised weaker", &[PromiseBroken], |plan, rng| {
            let gravity = promises(plan)?.gravity_in_world.as_mut()?;
            let factor = rng.uniform(0.9, 0.9999);
            gravity.iter_mut().for_each(|x| *x *= factor);
            Some(())
        });
        if let Some(gravity) = self.plan.promises.forces.as_ref().and_then(|forces| forces.gravity_in_world) {
            let tilt = nalgebra::Rotation3::new(Vector::from(self.rng.direction()) * self.rng.uniform(1e-3, 0.1));
            let mut scene = self.task.scene.clone();
            scene.gravity = Some(Gravity::Direction(UnitVector::new_normalize(tilt * Vector::from(gravity))));
            let turned = (Vector::from(gravity) - tilt * Vector::from(gravity)).norm() > 1e-3;
            if turned {
                let (plan, expected) = (self.plan.clone(), vec![PromiseBroken]);
                self.found.push(Mutant { name: "gravity from elsewhere", plan, scene: Some(scene), expected });
            }
        }
        self.add("gravity promised from elsewhere", &[ForceUnbalanced, PromiseBroken], |plan, rng| {
            let gravity = promises(plan)?.gravity_in_world.as_mut()?;
            let turn = nalgebra::Rotation3::new(Vector::from(rng.direction()) * rng.uniform(1e-3, 0.1));
            let before = Vector::from(*gravity);
            *gravity = (turn * before).into();
            ((before - Vector::from(*gravity)).norm() > 1e-3).then_some(())
        });
        self.add("torque limit promised above the robot's", &[PromiseBroken], |plan, rng| {
            let drive = any_drive(model, rng, |drive| drive.effort.is_some())?;
            promises(plan)?.joint_torques[drive.own_coordinate()?] = Some(drive.effort? * rng.uniform(1.001, 1.1));
            Some(())
        });
        self.add("torque limit left out", &[PromiseBroken], |plan, rng| {
            let drive = any_drive(model, rng, |drive| drive.effort.is_some())?;
            promises(plan)?.joint_torques[drive.own_coordinate()?] = None;
            Some(())
        });
        self.add("torque limit below a torque", &[TorqueLimit], |plan, rng| {
            let k = rng.below(model.joint_names.len());
            let largest = largest_torque(plan, k);
            promises(plan)?.joint_torques[k] = Some(largest * rng.uniform(0.95, 0.999));
            (largest > 1e-3).then_some(())
        });
        self.add("normal forces promised smaller", &[NormalForceOutOfRange], |plan, rng| {
            let largest = pressing(plan, model).fold(0.0, f64::max);
            let range = &mut promises(plan)?.normal_force;
            range[1] = largest * rng.uniform(0.99, 0.9999);
            (range[0] < range[1]).then_some(())
        });
        self.add("normal forces promised larger", &[NormalForceOutOfRange], |plan, rng| {
            let least = pressing(plan, model).fold(f64::INFINITY, f64::min);
            let range = &mut promises(plan)?.normal_force;
            range[0] = least * rng.uniform(1.0001, 1.01);
            (range[0] < range[1] && least > 0.1).then_some(())
        });
        self.add("no torque left for the weight of some direction", &[TorqueLimit], |plan, rng| {
            let k = rng.below(model.joint_names.len());
            let largest = largest_torque(plan, k);
            let forces = promises(plan).filter(|forces| forces.gravity_in_world.is_none())?;
            forces.joint_torques[k] = Some(largest * rng.uniform(1.0001, 1.001));
            (largest > 0.05).then_some(())
        });
        self.add(
            "squeezed too little for the weight of some direction",
            &[NormalForceOutOfRange, ForceOutsideCone],
            |plan, rng| {
                // Nothing is lifted, so forces stay in balance when all are smaller.
                promises(plan).filter(|forces| forces.gravity_in_world.is_none())?.normal_force[0] = 0.0;
                let factor = rng.uniform(0.001, 0.01);
                for waypoint in waypoints_mut(plan) {
                    for contact in &mut waypoint.contacts {
                        contact.force_in_object.iter_mut().flatten().for_each(|x| *x *= factor);
                        contact.torsion.iter_mut().for_each(|x| *x *= factor);
                    }
                    make_torques(model, waypoint);
                }
                Some(())
            },
        );
        self.add("limits for one joint too few", &[WrongScene], |plan, _| {
            promises(plan)?.joint_torques.pop().map(|_| ())
        });
    }

    fn break_balance(&mut self) {
        let model = self.model;
        self.add("contact force larger by a thousandth", &[ForceUnbalanced], |plan, rng| {
            let force = pick_loaded(plan, rng)?.force_in_object.as_mut()?;
            let factor = 1.0 + rng.uniform(1e-4, 1e-3);
            force.iter_mut().for_each(|x| *x *= factor);
            (Vector::from(*force).norm() > 0.1).then_some(())
        });
        self.add("contact force off by some millionths of a newton", &[ForceUnbalanced], |plan, rng| {
            let force = pick_loaded(plan, rng)?.force_in_object.as_mut()?;
            let off = Vector::from(rng.direction()) * rng.uniform(3e-6, 1e-5);
            *force = (Vector::from(*force) + off).into();
            Some(())
        });
        self.add("moments out of balance, forces in balance", &[ForceUnbalanced], |plan, rng| {
            let waypoint = any_waypoint(plan, rng)?;
            let (a, b) = two_loaded(waypoint, rng)?;
            let off = Vector::from(rng.direction()) * rng.uniform(2e-5, 1e-4);
            let arm = exert(waypoint, a, &off)? - exert(waypoint, b, &-off)?;
            make_torques(model, waypoint);
            (arm.cross(&off).norm() > 2e-7).then_some(())
        });
        self.add("torsion off by a ten-millionth", &[ForceUnbalanced], |plan, rng| {
            *pick_loaded(plan, rng)?.torsion.as_mut()? += rng.uniform(2e-7, 1e-6);
            Some(())
        });
        self.add("forces of another moment", &[ForceUnbalanced], |plan, rng| {
            let gravity = Vector::from(promises(plan)?.gravity_in_world?) * promises(plan)?.mass;
            let waypoints = &mut any_segment(plan, rng, SegmentKind::Transfer)?.waypoints;
            let (first, other) = (waypoints[0].clone(), rng.below(waypoints.len()));
            let weight = |waypoint: &Waypoint| Pose::from(&waypoint.world_from_object).rotation.inverse() * gravity;
            let differs = (weight(&first) - weight(&waypoints[other])).norm() > 1e-4;
            for (contact, before) in waypoints[other].contacts.iter_mut().zip(&first.contacts) {
                (contact.force_in_object, contact.torsion) = (before.force_in_object, before.torsion);
            }
            make_torques(model, &mut waypoints[other]);
            differs.then_some(())
        });
        self.add("force missing", &[ForceMissing], |plan, rng| {
            pick_loaded(plan, rng)?.force_in_object = None;
            Some(())
        });
        self.add("forces in a plan that promises none", &[ForceMissing], |plan, _| {
            plan.promises.forces.take().map(|_| ())
        });
        self.add("forces promised and left out", &[ForceMissing], |plan, _| {
            promises(plan)?;
            for waypoint in waypoints_mut(plan) {
                waypoint.joint_torques.clear();
                waypoint.contacts.iter_mut().for_each(|c| (c.force_in_object, c.torsion) = (None, None));
            }
            Some(())
        });
        self.add("force is not a number", &[NotANumber], |plan, rng| {
            pick_loaded(plan, rng)?.force_in_object.as_mut()?[rng.below(3)] = f64::NAN;
            Some(())
        });
        self.add("force of a free finger", &[NotANumber], |plan, rng| {
            promises(plan)?;
            let waypoint = any_waypoint(plan, rng)?;
            let mut free: Vec<_> = waypoint.contacts.iter_mut().filter(|contact| !contact.holds()).collect();
            pick(&mut free, rng)?.force_in_object = Some([0.0; 3]);
            Some(())
        });
        self.add("moving finger presses when it lifts or lands", &[MovingFingerPresses], |plan, rng| {
            promises(plan)?;
            let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
            let f = moving_finger(model, segment)?;
            let waypoint = if rng.chance(0.5) { segment.waypoints.first_mut() } else { segment.waypoints.last_mut() }?;
            // Two others take the opposite halves: forces stay in balance.
            let push = -contact_of(&waypoint.contacts[f])?.normal_in_object.into_inner() * rng.uniform(1e-5, 1e-2);
            let (a, b) = two_loaded(waypoint, rng)?;
            exert(waypoint, f, &push)?;
            exert(waypoint, a, &(push * -0.5))?;
            exert(waypoint, b, &(push * -0.5))?;
            make_torques(model, waypoint);
            Some(())
        });
    }

    fn break_cones(&mut self) {
        let (model, friction) = (self.model, self.plan.promises.friction);
        self.add("two fingers squeezed beyond their cones", &[ForceOutsideCone, NormalForceOutOfRange], |plan, rng| {
            // Along the line between two contacts: everything stays in balance.
            let waypoint = any_waypoint(plan, rng)?;
            let (a, b) = two_loaded(waypoint, rng)?;
            if [a, b].iter().any(|&f| waypoint.contacts[f].mode.slides()) {
                return None;
            }
            let line = exert(waypoint, a, &Vector::zeros())? - exert(waypoint, b, &Vector::zeros())?;
            let step = line.normalize() * if rng.chance(0.5) { 0.05 } else { -0.05 };
            let inside = |waypoint: &Waypoint| [a, b].into_iter().all(|f| in_cone(waypoint, f, friction));
            for _ in 0..2000 {
                exert(waypoint, a, &step)?;
                exert(waypoint, b, &-step)?;
                if !inside(waypoint) {
                    make_torques(model, waypoint);
                    return Some(());
                }
            }
            None
        });
        self.add("force turned out of its cone", &[ForceOutsideCone], |plan, rng| {
            let contact = pick_loaded(plan, rng)?;
            let normal = contact_of(contact)?.normal_in_object;
            let (side, _) = regrasp_geometry::frame::tangents(&normal);
            let size = Vector::from(contact.force_in_object?).norm();
            let slope = friction * rng.uniform(1.01, 1.1);
            let turned = (side.into_inner() * slope - normal.into_inner()).normalize() * size;
            contact.force_in_object = Some(turned.into());
            (size > 0.1 && friction > 0.0 && !contact.mode.slides()).then_some(())
        });
        self.add("soft fingertip twists harder than it can", &[ForceOutsideCone], |plan, rng| {
            let mut soft: Vec<(usize, f64)> = Vec::new();
            for (f, finger) in model.fingers.iter().enumerate() {
                if let ContactModel::SoftFinger { torsion_radius } = finger.contact {
                    soft.push((f, torsion_radius));
                }
            }
            promises(plan)?;
            let &mut (f, radius) = pick(&mut soft, rng)?;
            let waypoint = any_waypoint(plan, rng)?;
            let pressing = pressing_of(&waypoint.contacts[f])?;
            waypoint.contacts[f].torsion = Some(friction * pressing * radius * rng.uniform(1.001, 1.1));
            (pressing > 0.1 && !waypoint.contacts[f].mode.slides()).then_some(())
        });
        self.add("hard fingertip exerts torsion", &[ForceOutsideCone], |plan, rng| {
            promises(plan)?;
            let waypoint = any_waypoint(plan, rng)?;
            let is_hard = |f: &usize| model.fingers[*f].contact == ContactModel::Point;
            let mut hard: Vec<usize> = (0..model.fingers.len()).filter(is_hard).collect();
            let contact = &mut waypoint.contacts[*pick(&mut hard, rng)?];
            contact.torsion = Some(rng.uniform(1e-8, 1e-3));
            (pressing_of(contact)? > 0.1 && !contact.mode.slides()).then_some(())
        });
    }

    fn break_torques(&mut self) {
        let model = self.model;
        self.add("torque wrong by a little", &[TorqueWrong], |plan, rng| {
            let waypoint = any_waypoint(plan, rng)?;
            *pick(&mut waypoint.joint_torques, rng)? += rng.uniform(1e-5, 1e-4);
            Some(())
        });
        self.add("torques with the other sign", &[TorqueWrong], |plan, rng| {
            let torques = &mut any_waypoint(plan, rng)?.joint_torques;
            torques.iter_mut().for_each(|torque| *torque = -*torque);
            torques.iter().any(|torque| torque.abs() > 1e-3).then_some(())
        });
        self.add("torques of the waypoint before", &[TorqueWrong], |plan, rng| {
            let waypoints = &mut any_segment(plan, rng, SegmentKind::Transfer)?.waypoints;
            let w = 1 + rng.below(waypoints.len() - 1);
            let before = waypoints[w - 1].joint_torques.clone();
            let differs = before.iter().zip(&waypoints[w].joint_torques).any(|(a, b)| (a - b).abs() > 1e-5);
            waypoints[w].joint_torques = before;
            differs.then_some(())
        });
        self.add("torques missing", &[ForceMissing], |plan, rng| {
            promises(plan)?;
            any_waypoint(plan, rng)?.joint_torques.clear();
            Some(())
        });
        self.add("all forces scaled beyond a torque limit", &[TorqueLimit, ForceUnbalanced], |plan, rng| {
            let limits = promises(plan)?.joint_torques.clone();
            let waypoint = any_waypoint(plan, rng)?;
            let share = |(torque, limit): (&f64, &Option<f64>)| limit.map_or(0.0, |limit| torque.abs() / limit);
            let most = waypoint.joint_torques.iter().zip(&limits).map(share).fold(0.0, f64::max);
            let factor = 1.01 / most;
            for contact in &mut waypoint.contacts {
                contact.force_in_object.iter_mut().flatten().for_each(|x| *x *= factor);
            }
            make_torques(model, waypoint);
            (most > 1e-3).then_some(())
        });
    }
}

fn promises(plan: &mut Plan) -> Option<&mut ForcePromises> {
    plan.promises.forces.as_mut()
}

/// The largest torque, either way, of joint `k` in the plan.
fn largest_torque(plan: &Plan, k: usize) -> f64 {
    waypoints(plan)
        .filter_map(|waypoint| waypoint.joint_torques.get(k))
        .fold(0.0, |most, torque| torque.abs().max(most))
}

fn pressing_of(contact: &ContactState) -> Option<f64> {
    Some(-contact_of(contact)?.normal_in_object.dot(&Vector::from(contact.force_in_object?)))
}

/// Normal forces of the fingers that hold, those that lift and land left out.
fn pressing<'a>(plan: &'a Plan, model: &'a CheckedHand) -> impl Iterator<Item = f64> + 'a {
    plan.segments.iter().flat_map(move |segment| {
        let moving = moving_finger(model, segment);
        let contacts = segment.waypoints.iter().flat_map(|waypoint| waypoint.contacts.iter().enumerate());
        contacts.filter(move |(f, _)| Some(*f) != moving).filter_map(|(_, contact)| pressing_of(contact))
    })
}

fn is_loaded(contact: &ContactState) -> bool {
    contact.force_in_object.is_some_and(|force| Vector::from(force).norm() > 1e-3)
}

/// Some contact with a force above a thousandth of a newton.
fn pick_loaded<'a>(plan: &'a mut Plan, rng: &mut Rng) -> Option<&'a mut ContactState> {
    let waypoint = any_waypoint(plan, rng)?;
    let mut loaded: Vec<usize> = (0..waypoint.contacts.len()).filter(|&f| is_loaded(&waypoint.contacts[f])).collect();
    let f = *pick(&mut loaded, rng)?;
    Some(&mut waypoint.contacts[f])
}

/// Two fingers that press.
fn two_loaded(waypoint: &Waypoint, rng: &mut Rng) -> Option<(usize, usize)> {
    let mut loaded: Vec<usize> = (0..waypoint.contacts.len()).filter(|&f| is_loaded(&waypoint.contacts[f])).collect();
    let first = *pick(&mut loaded, rng)?;
    loaded.retain(|f| *f != first);
    Some((first, *pick(&mut loaded, rng)?))
}

/// Adds to the force of finger `f`; its point, from the object's origin.
fn exert(waypoint: &mut Waypoint, f: usize, more: &Vector) -> Option<Vector> {
    let force = waypoint.contacts[f].force_in_object.as_mut()?;
    *force = (Vector::from(*force) + more).into();
    waypoint.contacts[f].point_in_object.map(Vector::from)
}

/// True when the force alone, its torsion not counted, is not clearly outside the friction cone.
fn in_cone(waypoint: &Waypoint, f: usize, friction: f64) -> bool {
    let (Some(contact), Some(force)) = (contact_of(&waypoint.contacts[f]), waypoint.contacts[f].force_in_object) else {
        return true;
    };
    let (force, normal) = (Vector::from(force), contact.normal_in_object.into_inner());
    let pressing = -force.dot(&normal);
    (force + normal * pressing).norm() <= friction * pressing + 1e-3
}

/// Gives the joints the torques that make the contact forces.
fn make_torques(model: &CheckedHand, waypoint: &mut Waypoint) {
    let mut torques = vec![0.0; model.joint_names.len()];
    for (finger, state) in model.fingers.iter().zip(&waypoint.contacts) {
        let (Some(contact), Some(force)) = (contact_of(state), state.force_in_object) else { continue };
        let normal = contact.normal_in_object.into_inner();
        let couple = normal * state.torsion.unwrap_or(0.0);
        for work in torques_of(finger, waypoint, &normal, &Vector::from(force), &couple) {
            torques[work.coordinate] += work.torque;
        }
    }
    waypoint.joint_torques = torques;
}
