//! Plans in which the object turns though nothing drives it: the joints stand still, and everything but slip is right.

use super::Breeder;
use nalgebra::UnitQuaternion;
use regrasp_geometry::{Pose, Shape, Vector};
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::check::rolling::Roll;
use regrasp_plan::check::violation::ViolationKind::Slip;
use regrasp_plan::plan::{ContactMode, ContactState, Plan, Segment, SegmentKind, Waypoint};
use regrasp_robot::ContactModel;

/// Slip of a segment of the plans made here, as a share of the slip that a segment may have.
const SHARE: f64 = 0.9;

impl Breeder<'_> {
    pub(super) fn break_drive(&mut self) {
        let (model, object) = (self.model, self.task.object());
        let Shape::Sphere { radius } = object.shape else { return self.break_softness() };
        let is_centered = object.center_of_mass.coords.norm() < 1e-9;
        self.add("sphere turns between fingers that stand still", &[Slip], |plan, rng| {
            let first =
                plan.segments.iter().find(|segment| segment.kind == SegmentKind::Transfer)?.waypoints[0].clone();
            let holding: Vec<usize> = (0..model.fingers.len()).filter(|&f| first.contacts[f].holds()).collect();
            let round = holding.iter().all(|&f| model.fingers[f].radius > 0.0);
            let axis = Vector::from(rng.direction());
            let n_segments = 20 + rng.below(60);
            turn_between_still_fingers(plan, &first, &axis, n_segments, radius);
            (is_centered && round && holding.len() >= 2).then_some(())
        });
        self.break_softness();
    }

    /// The plan of hard fingertips, which may turn about the normals, in a hand of soft ones, which resist it.
    fn break_softness(&mut self) {
        let limit = 5.0 * regrasp_plan::check::CheckSettings::default().largest_slip;
        let twists: Vec<f64> = (0..self.model.fingers.len()).map(|f| self.twist_of(f)).collect();
        self.add_hand("fingertips that turn about the normal are soft", &[Slip], |hand, rng| {
            let torsion_radius = rng.uniform(0.004, 0.01);
            let is_hard = hand.fingers.iter().all(|finger| finger.tip.contact == ContactModel::Point);
            for finger in &mut hand.fingers {
                finger.tip.contact = ContactModel::SoftFinger { torsion_radius };
            }
            (is_hard && twists.iter().any(|twist| twist * torsion_radius > limit)).then_some(())
        });
    }

    /// The largest turn of a finger's tip about its contact's normal in a transfer in which it rolls, in radians.
    fn twist_of(&self, f: usize) -> f64 {
        let shape = &self.model.shape;
        let of = |segment: &Segment| -> f64 {
            let pairs = segment.waypoints.windows(2).filter(|pair| pair[0].contacts[f].mode == ContactMode::Rolling);
            let roll =
                |pair: &[Waypoint]| Roll::new((f, &self.model.fingers[f]), &pair[0], &pair[1], shape, 1e-3).turning();
            pairs.filter_map(roll).map(|turning| turning.twist).sum()
        };
        let transfers = self.plan.segments.iter().filter(|segment| segment.kind == SegmentKind::Transfer);
        transfers.map(of).fold(0.0, f64::max)
    }
}

/// Replaces all segments by ones of two waypoints each. The object turns about `axis`, in the world, through its centre; joints,
/// tips, forces and torques are those of `first` in the world.
fn turn_between_still_fingers(plan: &mut Plan, first: &Waypoint, axis: &Vector, n_segments: usize, radius: f64) {
    let step = SHARE * plan.promises.slip_tolerance / radius;
    let span = 2.0 * step * radius / plan.promises.motion.largest_speed;
    let start = Pose::from(&first.world_from_object);
    let at = |k: usize, time: f64| {
        let mut pose = start;
        pose.rotation = UnitQuaternion::new(axis * (step * k as f64)) * start.rotation;
        let back = pose.inverse() * start;
        let mut waypoint = first.clone();
        (waypoint.time, waypoint.world_from_object) = (time, (&pose).into());
        waypoint.joint_velocities.fill(0.0);
        waypoint.contacts.iter_mut().for_each(|contact| carry(contact, &back));
        waypoint
    };
    plan.segments.clear();
    let mut now = first.time;
    for k in 0..n_segments {
        let waypoints = vec![at(k, now), at(k + 1, now + span)];
        plan.segments.push(Segment::transfer(waypoints));
        now += span + 0.01;
    }
    plan.way_poses.clear();
    plan.goal = plan.segments[n_segments - 1].waypoints[1].world_from_object;
}

/// A contact that stays where it is in the world, in the frame of an object that was turned.
fn carry(contact: &mut ContactState, object_from_before: &Pose) {
    let Some(at) = contact_of(contact) else { return };
    contact.mode = ContactMode::Rolling;
    contact.point_in_object = Some((object_from_before * at.point_in_object).into());
    contact.normal_in_object = Some((object_from_before * at.normal_in_object.into_inner()).into());
    contact.force_in_object = contact.force_in_object.map(|force| (object_from_before * Vector::from(force)).into());
}
