//! Contacts that are not there, and forces that do not hold.

use super::{Breeder, log_uniform, one_of, sign};
use regrasp_base::Rng;
use regrasp_geometry::Vector;
use regrasp_plan::check::violation::ViolationKind::{self as Kind};
use regrasp_plan::plan::ContactMode;
use regrasp_plan::robot_plan::{RobotContact, RobotPlan};

/// A random waypoint with contacts, of one of these segments.
fn touching<'p>(plan: &'p mut RobotPlan, segments: &[usize], rng: &mut Rng) -> Option<&'p mut Vec<RobotContact>> {
    let s = one_of(rng, segments)?;
    let waypoints = &mut plan.segments[s].waypoints;
    let w = rng.below(waypoints.len());
    Some(&mut waypoints[w].contacts).filter(|contacts| !contacts.is_empty())
}

/// All entries of one finger.
fn entries<'p>(plan: &'p mut RobotPlan, rng: &mut Rng) -> Vec<&'p mut RobotContact> {
    let all = plan.segments.iter().flat_map(|segment| &segment.waypoints).flat_map(|waypoint| &waypoint.contacts);
    let mut fingers: Vec<(String, String)> =
        all.map(|contact| (contact.hand.clone(), contact.finger.clone())).collect();
    fingers.sort();
    fingers.dedup();
    let k = rng.below(fingers.len().max(1));
    let Some((hand, finger)) = fingers.get(k).cloned() else { return Vec::new() };
    let all = plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints);
    all.flat_map(|waypoint| &mut waypoint.contacts)
        .filter(|contact| contact.hand == hand && contact.finger == finger)
        .collect()
}

impl Breeder<'_> {
    pub(super) fn break_contacts(&mut self) {
        let held = self.segments(|s| !self.hands_in(s).is_empty());
        let free = self.segments(|s| self.hands_in(s).is_empty() && !self.kind(s).is_in_hand());
        self.add("a contact left out at one waypoint", &[Kind::GraspChanges], |plan, rng| {
            let contacts = touching(plan, &held, rng)?;
            contacts.remove(rng.below(contacts.len()));
            Some(())
        });
        self.add("a contact twice", &[Kind::WrongContactMode], |plan, rng| {
            let contacts = touching(plan, &held, rng)?;
            let k = rng.below(contacts.len());
            contacts.push(contacts[k].clone());
            Some(())
        });
        self.add("a contact that rolls", &[Kind::WrongContactMode], |plan, rng| {
            let contacts = touching(plan, &held, rng)?;
            let k = rng.below(contacts.len());
            contacts[k].mode = ContactMode::PureRolling;
            Some(())
        });
        self.add("a contact of a hand that holds nothing", &[Kind::WrongContactMode], |plan, rng| {
            let contact = touching(plan, &held, rng)?[0].clone();
            let s = one_of(rng, &free)?;
            let waypoints = &mut plan.segments[s].waypoints;
            let w = rng.below(waypoints.len());
            waypoints[w].contacts.push(contact);
            Some(())
        });
        self.add("a contact that moves at one waypoint", &[Kind::GraspChanges], |plan, rng| {
            let contacts = touching(plan, &held, rng)?;
            let k = rng.below(contacts.len());
            let shift = Vector::from(rng.direction()) * log_uniform(rng, 2e-9, 1e-2);
            (0..3).for_each(|i| contacts[k].point_in_object[i] += shift[i]);
            Some(())
        });
        let beside = [Kind::ContactOffTip, Kind::ContactOffSurface, Kind::ContactTooNearEdge, Kind::ContactNormalWrong];
        self.add("a contact beside its fingertip from grasp to release", &beside, |plan, rng| {
            let mut across = None;
            for contact in entries(plan, rng) {
                let shift = *across.get_or_insert_with(|| {
                    let normal = Vector::from(contact.normal_in_object);
                    let way = Vector::from(rng.direction()).cross(&normal).normalize();
                    way * log_uniform(rng, 1.1e-3, 5e-3)
                });
                (0..3).for_each(|i| contact.point_in_object[i] += shift[i]);
            }
            across.map(|_| ())
        });
        let off = [Kind::ContactOffSurface];
        self.add("a contact off the surface from grasp to release", &off, |plan, rng| {
            let depth = sign(rng) * log_uniform(rng, 1.1e-5, 1e-3);
            let found = entries(plan, rng);
            let is_any = !found.is_empty();
            for contact in found {
                (0..3).for_each(|i| contact.point_in_object[i] += depth * contact.normal_in_object[i]);
            }
            is_any.then_some(())
        });
        self.add("a normal that is not the surface's", &[Kind::ContactNormalWrong], |plan, rng| {
            let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector::from(rng.direction()) * 0.1);
            let found = entries(plan, rng);
            let is_any = !found.is_empty();
            for contact in found {
                let normal = Vector::from(contact.normal_in_object);
                let turned = turn * normal;
                if turned.angle(&normal) < 2e-3 {
                    return None;
                }
                contact.normal_in_object = turned.normalize().into();
            }
            is_any.then_some(())
        });
        self.add(
            "two fingers hold with each other's contacts",
            &[Kind::ContactOffTip, Kind::GraspChanges],
            |plan, rng| {
                let s = one_of(rng, &held)?;
                for waypoint in &mut plan.segments[s].waypoints {
                    let [first, second, ..] = waypoint.contacts.as_mut_slice() else { return None };
                    std::mem::swap(&mut first.finger, &mut second.finger);
                }
                Some(())
            },
        );
    }

    pub(super) fn break_forces(&mut self) {
        let held = self.segments(|s| !self.hands_in(s).is_empty());
        let is_support = |name: &String| !self.is_hand(name);
        let unsupported: Vec<usize> =
            held.iter().copied().filter(|s| !self.holders(&self.plan.segments[*s]).iter().any(is_support)).collect();
        self.add("a force left out", &[Kind::ForceMissing], |plan, rng| {
            let contacts = touching(plan, &held, rng)?;
            let k = rng.below(contacts.len());
            contacts[k].force_in_object.take().map(|_| ())
        });
        let wrong = [Kind::ForceUnbalanced, Kind::ForceOutsideCone, Kind::NormalForceOutOfRange];
        self.add("a force that is another one", &wrong, |plan, rng| {
            let contacts = touching(plan, &unsupported, rng)?;
            let k = rng.below(contacts.len());
            let change = Vector::from(rng.direction()) * log_uniform(rng, 1e-3, 10.0);
            let force = contacts[k].force_in_object.as_mut()?;
            (0..3).for_each(|i| force[i] += change[i]);
            Some(())
        });
        self.add("all forces of a waypoint weaker", &wrong, |plan, rng| {
            let share = rng.uniform(0.0, 0.99);
            for contact in touching(plan, &unsupported, rng)? {
                contact.force_in_object.as_mut()?.iter_mut().for_each(|force| *force *= share);
            }
            Some(())
        });
        self.add("a fingertip that pulls", &wrong, |plan, rng| {
            let contacts = touching(plan, &held, rng)?;
            let k = rng.below(contacts.len());
            let force = contacts[k].force_in_object.as_mut()?;
            force.iter_mut().for_each(|force| *force = -*force);
            Some(())
        });
        let turning = [Kind::ForceUnbalanced, Kind::ForceOutsideCone];
        self.add("a torsion that the contact does not transmit, or that nothing balances", &turning, |plan, rng| {
            let contacts = touching(plan, &unsupported, rng)?;
            let k = rng.below(contacts.len());
            contacts[k].torsion = Some(contacts[k].torsion.unwrap_or(0.0) + sign(rng) * log_uniform(rng, 0.01, 1.0));
            Some(())
        });
        self.add("normal forces promised below those there are", &[Kind::NormalForceOutOfRange], |plan, rng| {
            let pressing = |contact: &RobotContact| {
                let force = Vector::from(contact.force_in_object?);
                Some(-force.dot(&Vector::from(contact.normal_in_object)))
            };
            // Motions in a hand have promises of their own.
            let outside = plan.segments.iter().filter(|segment| !segment.kind.is_in_hand());
            let waypoints = outside.flat_map(|segment| &segment.waypoints);
            let most = waypoints.flat_map(|waypoint| &waypoint.contacts).filter_map(pressing).fold(0.0, f64::max);
            let range = &mut plan.promises.holding.as_mut()?.normal_force;
            range[1] = most * rng.uniform(0.5, 0.999);
            range[0] = range[0].min(range[1]);
            (most > 0.0).then_some(())
        });
    }
}
