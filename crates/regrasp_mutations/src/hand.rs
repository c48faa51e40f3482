//! Good plans in hands of other contacts and couplings than they were made for, and coupled joints gone wrong.

use super::Breeder;
use super::choice::{any_waypoint, waypoints, waypoints_mut};
use regrasp_geometry::{Pose, UnitVector, Vector};
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::check::violation::ViolationKind::{
    ClosureLost, ContactOffPad, ContactOffTip, JointLimit, WrongScene,
};
use regrasp_plan::plan::{SegmentKind, Waypoint};
use regrasp_robot::tip::Pad;
use regrasp_robot::{ContactModel, JointKind};
use std::sync::Arc;

impl Breeder<'_> {
    pub(super) fn break_contact_models(&mut self) {
        // Sets of fingers that hold somewhere, and the torsion that they count on.
        let holding: Vec<Vec<usize>> = waypoints(self.plan).map(holders).collect();
        let fingers = &self.task.hand().fingers;
        let is_soft = |f: usize| matches!(fingers[f].tip.contact, ContactModel::SoftFinger { .. });
        let pair = holding.iter().find(|set| set.len() == 2 && set.iter().any(|&f| is_soft(f))).cloned();
        let promises = &self.plan.promises;
        let (required, friction, scale) = (promises.required_margin, promises.friction, promises.torque_scale);
        self.add_hand("torsion that two fingers hold by is absent", &[ClosureLost], |hand, _| {
            pair.as_ref()?.iter().for_each(|&f| hand.fingers[f].tip.contact = ContactModel::Point);
            Some(())
        });
        self.add_hand("torsion that two fingers hold by is a thousandth", &[ClosureLost], |hand, _| {
            // A twist about the line of the two is resisted by their torsion alone: no margin is larger than this.
            let mut most = 0.0;
            for &f in pair.as_ref()? {
                if let ContactModel::SoftFinger { torsion_radius } = &mut hand.fingers[f].tip.contact {
                    *torsion_radius *= 1e-3;
                    most += friction * *torsion_radius / scale;
                }
            }
            if most >= required {
                return None;
            }
            Some(())
        });
        let model = self.model;
        let touching = self.plan.segments.iter().flat_map(|segment| &segment.waypoints).find_map(|waypoint| {
            let f = *holders(waypoint).first()?;
            let contact = contact_of(&waypoint.contacts[f])?;
            let normal = Pose::from(&waypoint.world_from_object) * contact.normal_in_object.into_inner();
            let link = model.fingers[f].path.world_from_link(&waypoint.joints);
            Some((f, -link.fixed_view::<3, 3>(0, 0).tr_mul(&normal)))
        });
        self.add_hand("pad that ends beside the contact", &[ContactOffPad], |hand, rng| {
            let (f, outward) = touching?;
            let angle = rng.uniform(0.2f64, 1.0);
            let aside = outward.cross(&Vector::from(rng.direction())).try_normalize(1e-3)?;
            let axis = nalgebra::Rotation3::new(aside * (angle + 0.01)) * outward;
            hand.fingers[f].tip.pad = Some(Pad { axis_in_body: UnitVector::new_normalize(axis), cosine: angle.cos() });
            Some(())
        });
        let is_closed = self.plan.segments.iter().any(|segment| segment.kind != SegmentKind::Tracking);
        self.add_hand("fingertips without friction", &[ClosureLost], |hand, _| {
            // Fewer than seven contacts without friction hold nothing.
            hand.fingers.iter_mut().for_each(|finger| finger.tip.contact = ContactModel::Frictionless);
            (is_closed && hand.fingers.len() < 7).then_some(())
        });
    }

    pub(super) fn break_couplings(&mut self) {
        let moving = &self.plan.segments;
        let coupled: Vec<usize> = (0..self.task.hand().robot.joints.len())
            .filter(|&joint| self.task.hand().robot.joints[joint].coupling.is_some())
            .filter(|&joint| self.model.fingers.iter().any(|finger| finger.moving_joints.contains(&joint)))
            .collect();
        let is_held = moving.iter().any(|segment| segment.kind == SegmentKind::Transfer);
        self.add_hand("coupling broken by three degrees", &[ContactOffTip], |hand, rng| {
            let joint = *coupled.get(rng.below(coupled.len().max(1)))?;
            let coupling = Arc::make_mut(&mut hand.robot).joints[joint].coupling.as_mut()?;
            coupling.offset += 3f64.to_radians();
            is_held.then_some(())
        });
        self.add_hand("coupling left out", &[ContactOffTip], |hand, rng| {
            let joint = *coupled.get(rng.below(coupled.len().max(1)))?;
            let joint = &mut Arc::make_mut(&mut hand.robot).joints[joint];
            // It rests. A joint that moves and belongs to no finger would be one that the plan has to name.
            (joint.coupling, joint.kind) = (None, JointKind::Fixed);
            is_held.then_some(())
        });
        let (model, robot) = (self.model, &self.task.hand().robot);
        self.add("coupled joint beyond its limit", &[JointLimit], |plan, rng| {
            let is_follower =
                |name: &str| robot.joint_named(name).is_some_and(|id| robot.joints[id.0].coupling.is_some());
            let rows: Vec<_> = model.limits.iter().filter(|row| is_follower(&row.name)).collect();
            let row = rows.get(rng.below(rows.len().max(1)))?;
            let position = row.upper + rng.uniform(0.5f64, 1.0).to_radians();
            row.put(&mut any_waypoint(plan, rng)?.joints, position);
            Some(())
        });
        self.add("coupled joint named as if it were free", &[WrongScene], |plan, rng| {
            let joint = *coupled.get(rng.below(coupled.len().max(1)))?;
            plan.joint_names.push(robot.joints[joint].name.clone());
            waypoints_mut(plan).for_each(|w| w.joints.push(0.1));
            Some(())
        });
    }
}

/// Fingers that hold at a waypoint.
fn holders(waypoint: &Waypoint) -> Vec<usize> {
    (0..waypoint.contacts.len()).filter(|&f| waypoint.contacts[f].holds()).collect()
}
