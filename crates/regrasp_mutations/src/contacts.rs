//! Contacts that are elsewhere, and fingers that do what they should not.

use super::Breeder;
use super::choice::{any_closed, any_segment, any_waypoint, pick, pick_waypoint};
use super::edit::{move_tip, replace_contact};
use regrasp_geometry::{Point, Pose, Shape, UnitVector, Vector};
use regrasp_plan::check::roles::{contact_of, moving_finger};
use regrasp_plan::check::violation::ViolationKind::{
    ClosureLost, Collision, ContactNormalWrong, ContactOffSurface, ContactOffTip, ContactTooNearEdge, GraspChanges,
    NotANumber, WrongContactMode, WrongMovingFinger,
};
use regrasp_plan::plan::{ContactMode, ContactState, SegmentKind};

impl Breeder<'_> {
    pub(super) fn break_contacts(&mut self) {
        let (model, task) = (self.model, self.task);
        // The tip of one holding finger leaves its contact at one waypoint of a transfer: lifted, pressed in, or aside.
        for (name, along) in [("contact lifted early", 1.0), ("tip pressed into the object", -1.0), ("tip slides", 0.0)]
        {
            self.add(name, &[ContactOffTip, Collision], |plan, rng| {
                let tolerance = plan.promises.contact_tolerance;
                let (s, w) = pick_waypoint(plan, rng, SegmentKind::Transfer)?;
                let f = rng.below(model.fingers.len());
                let waypoint = &mut plan.segments[s].waypoints[w];
                let contact = contact_of(&waypoint.contacts[f])?;
                let object = Pose::from(&waypoint.world_from_object);
                let side = regrasp_geometry::frame::tangents(&contact.normal_in_object).0;
                let way = if along == 0.0 { side } else { contact.normal_in_object };
                let sign = if along == 0.0 { 1.0 } else { along };
                let off = way.into_inner() * (sign * tolerance * rng.uniform(2.1, 4.0));
                let normal = contact.normal_in_object.into_inner();
                let center = contact.point_in_object + model.fingers[f].center_from_contact(waypoint, &normal);
                move_tip(model, f, &mut waypoint.joints, &(object * (center + off)))
            });
        }
        // A contact is replaced consistently: contact, tip and joints at every waypoint that has it.
        self.add("contact 0.7 mm off the surface", &[ContactOffSurface], |plan, rng| {
            let amount = if rng.chance(0.5) { 0.7e-3 } else { -0.7e-3 };
            replace_contact(plan, model, rng, |point, normal, _| (point + normal.into_inner() * amount, normal))
        });
        self.add("contact normal tilted", &[ContactNormalWrong], |plan, rng| {
            let angle = rng.uniform(0.5f64, 2.0).to_radians();
            replace_contact(plan, model, rng, |point, normal, rng| {
                let axis = normal.cross(&Vector::from(rng.direction())).normalize();
                let turned = nalgebra::Rotation3::new(axis * angle) * normal.into_inner();
                (point, UnitVector::new_normalize(turned))
            })
        });
        if let Shape::Cuboid { half_extents } = task.object().shape
            && task.object().edge_distance > 1e-4
        {
            let distance = task.object().edge_distance;
            let may_cross = self.plan.promises.tracking.is_some();
            self.add("contact at an edge", &[ContactTooNearEdge], |plan, rng| {
                if may_cross {
                    return None;
                }
                let inset = distance * rng.uniform(0.3, 0.9);
                replace_contact(plan, model, rng, |mut point, normal, _| {
                    let k = if normal.x.abs() < 0.5 { 0 } else { 1 };
                    point[k] = (half_extents[k] - inset).copysign(point[k]);
                    (point, normal)
                })
            });
        }
        self.add("all contacts in one place", &[ClosureLost], |plan, rng| {
            let segment = any_closed(plan, rng)?;
            for waypoint in &mut segment.waypoints {
                let first = *waypoint.contacts.iter().find(|contact| contact.holds())?;
                let others = waypoint.contacts.iter_mut().filter(|contact| contact.holds());
                others.for_each(|contact| *contact = first);
            }
            Some(())
        });
        self.add("all contacts on one side", &[ClosureLost], |plan, rng| {
            let segment = any_closed(plan, rng)?;
            let center = task.object().center_of_mass;
            let pole = Vector::from(rng.direction());
            for waypoint in &mut segment.waypoints {
                for contact in &mut waypoint.contacts {
                    let (Some(point), Some(normal)) = (&mut contact.point_in_object, &mut contact.normal_in_object)
                    else {
                        continue;
                    };
                    // Mirrored into the half space of the pole, steeper than any friction cone.
                    let flat = Vector::from(*normal) - pole * pole.dot(&Vector::from(*normal));
                    *normal = (pole * 20.0 + flat).normalize().into();
                    let arm = Point::from(*point) - center;
                    *point = (center + arm + pole * (pole.dot(&arm).abs() - pole.dot(&arm))).into();
                }
            }
            Some(())
        });
        self.add("contact without a normal", &[NotANumber], |plan, rng| {
            let waypoint = any_waypoint(plan, rng)?;
            let mut held: Vec<_> = waypoint.contacts.iter_mut().filter(|c| c.holds()).collect();
            pick(&mut held, rng)?.normal_in_object = None;
            Some(())
        });
    }

    pub(super) fn break_roles(&mut self) {
        self.add("contact changes in a transfer", &[GraspChanges], |plan, rng| {
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Transfer)?;
            let mut contacts: Vec<_> = plan.segments[s].waypoints[w].contacts.iter_mut().collect();
            contacts.retain(|contact| contact.mode == ContactMode::Fixed);
            let point = pick(&mut contacts, rng)?.point_in_object.as_mut()?;
            point[rng.below(3)] += rng.uniform(1e-6, 1e-5);
            Some(())
        });
        self.add("finger lets go in a transfer", &[WrongContactMode], |plan, rng| {
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Transfer)?;
            let mut held: Vec<_> = plan.segments[s].waypoints[w].contacts.iter_mut().collect();
            held.retain(|contact| contact.holds());
            **pick(&mut held, rng)? = ContactState::FREE;
            Some(())
        });
        let model = self.model;
        self.add("another finger named as moving", &[WrongMovingFinger], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
            let f = moving_finger(model, segment)?;
            segment.moving_finger = Some(model.fingers[(f + 1) % model.fingers.len()].name.clone());
            Some(())
        });
        self.add("moving finger not named", &[WrongMovingFinger], |plan, rng| {
            any_segment(plan, rng, SegmentKind::Regrasp)?.moving_finger = None;
            Some(())
        });
        self.add("holding finger lets go in a regrasp", &[WrongContactMode, ClosureLost], |plan, rng| {
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Regrasp)?;
            let mut held = plan.segments[s].waypoints[w].contacts.iter_mut().collect::<Vec<_>>();
            held.retain(|contact| contact.holds());
            **pick(&mut held, rng)? = ContactState::FREE;
            Some(())
        });
        self.add("moving finger lands early", &[WrongContactMode], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
            let f = moving_finger(model, segment)?;
            let last = segment.waypoints.len().checked_sub(1).filter(|&last| last >= 2)?;
            if !segment.waypoints[last].contacts[f].holds() {
                return None;
            }
            segment.waypoints[last - 1].contacts[f] = segment.waypoints[last].contacts[f];
            Some(())
        });
        self.add("holding finger moves in a regrasp", &[WrongMovingFinger], |plan, rng| {
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Regrasp)?;
            let f = moving_finger(model, &plan.segments[s])?;
            let other = (f + 1 + rng.below(model.fingers.len() - 1)) % model.fingers.len();
            let k = model.fingers[other].coordinates.start;
            plan.segments[s].waypoints[w].joints[k] += rng.uniform(1e-5, 1e-3);
            Some(())
        });
    }
}
