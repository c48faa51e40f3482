//! Motions in a hand within a task.

use super::{Breeder, log_uniform, one_of, sign};
use regrasp_geometry::Vector;
use regrasp_plan::check::violation::ViolationKind as Kind;
use regrasp_plan::plan::ContactMode;
use regrasp_plan::robot_plan::RobotSegmentKind;

impl Breeder<'_> {
    pub(super) fn break_in_hand(&mut self) {
        let inside = self.segments(|s| self.kind(s).is_in_hand());
        let transfers = self.segments(|s| self.kind(s) == RobotSegmentKind::Transfer);
        let regrasps = self.segments(|s| self.kind(s) == RobotSegmentKind::Regrasp);
        let last = inside.iter().copied().filter(|s| !inside.contains(&(s + 1))).collect::<Vec<usize>>();
        let wrist =
            self.plan.segments.first().and_then(|segment| segment.waypoints.first()).map_or(0, |w| w.joints.len());
        let own: Vec<bool> = (0..wrist)
            .map(|k| {
                inside.iter().any(|&s| {
                    let waypoints = &self.plan.segments[s].waypoints;
                    waypoints.iter().any(|waypoint| waypoint.joints[k] != waypoints[0].joints[k])
                })
            })
            .collect();
        let resting: Vec<usize> = (0..wrist).filter(|k| !own[*k]).collect();
        self.add("an arm moves while the object moves in a hand", &[Kind::JointMovesAtRest], |plan, rng| {
            let segment = &mut plan.segments[one_of(rng, &inside)?];
            let w = 1 + rng.below(segment.waypoints.len().checked_sub(2).filter(|n| *n > 0)?);
            segment.waypoints[w].joints[one_of(rng, &resting)?] += sign(rng) * log_uniform(rng, 1e-6, 1e-2);
            Some(())
        });
        self.add(
            "the object is elsewhere while it moves in a hand",
            &[Kind::ContactOffTip, Kind::Slip, Kind::ObjectMovesAtRest, Kind::ObjectMovesInRegrasp],
            |plan, rng| {
                let segment = &mut plan.segments[one_of(rng, &inside)?];
                let w = 1 + rng.below(segment.waypoints.len().checked_sub(2).filter(|n| *n > 0)?);
                segment.waypoints[w].world_from_objects[0].position[rng.below(3)] +=
                    sign(rng) * log_uniform(rng, 1e-3, 1e-2);
                Some(())
            },
        );
        self.add(
            "a contact slips while the object moves in a hand",
            &[Kind::ContactOffTip, Kind::Slip, Kind::GraspChanges, Kind::ContactOffSurface],
            |plan, rng| {
                let segment = &mut plan.segments[one_of(rng, &transfers)?];
                let w = rng.below(segment.waypoints.len());
                let contacts = &mut segment.waypoints[w].contacts;
                let k = rng.below(contacts.len());
                let contact = contacts.get_mut(k)?;
                let (x, _) = regrasp_geometry::frame::tangents(&regrasp_geometry::UnitVector::new_normalize(
                    Vector::from(contact.normal_in_object),
                ));
                let shift = x.into_inner() * log_uniform(rng, 2e-3, 1e-2);
                (0..3).for_each(|k| contact.point_in_object[k] += shift[k]);
                Some(())
            },
        );
        self.add(
            "forces of a motion in a hand do not hold the weight",
            &[Kind::ForceUnbalanced, Kind::ForceOutsideCone, Kind::NormalForceOutOfRange],
            |plan, rng| {
                let segment = &mut plan.segments[one_of(rng, &inside)?];
                let w = rng.below(segment.waypoints.len());
                let contacts = &mut segment.waypoints[w].contacts;
                let k = rng.below(contacts.len());
                let force = contacts.get_mut(k)?.force_in_object.as_mut()?;
                // A finger that has just landed presses with nothing yet.
                if force.iter().all(|x| *x == 0.0) {
                    return None;
                }
                force.iter_mut().for_each(|x| *x *= 0.5);
                Some(())
            },
        );
        self.add("torques of a motion in a hand are others", &[Kind::TorqueWrong, Kind::TorqueLimit], |plan, rng| {
            let segment = &mut plan.segments[one_of(rng, &inside)?];
            let part = segment.in_hand.as_mut()?;
            let w = rng.below(part.joint_torques.len());
            let torques = part.joint_torques.get_mut(w)?;
            let k = rng.below(torques.len());
            *torques.get_mut(k)? += sign(rng) * log_uniform(rng, 1e-2, 1.0);
            Some(())
        });
        self.add(
            "a finger holds that has lifted in the hand",
            &[
                Kind::ContactOffTip,
                Kind::Slip,
                Kind::WrongMovingFinger,
                Kind::WrongContactMode,
                Kind::GraspChanges,
                Kind::ForceUnbalanced,
            ],
            |plan, rng| {
                let segment = &mut plan.segments[one_of(rng, &regrasps)?];
                let first = segment.waypoints[0].contacts.clone();
                let w = segment.waypoints.len() / 2;
                let lifted = first
                    .iter()
                    .find(|one| segment.waypoints[w].contacts.iter().all(|other| other.finger != one.finger))?;
                segment.waypoints[w].contacts.push(lifted.clone());
                Some(())
            },
        );
        self.add(
            "another finger is said to move in the hand",
            &[Kind::WrongMovingFinger, Kind::WrongContactMode],
            |plan, rng| {
                let segment = &mut plan.segments[one_of(rng, &regrasps)?];
                let fingers =
                    plan.hands.iter().find(|hand| segment.held_by.values().flatten().any(|name| *name == hand.name))?;
                let part = segment.in_hand.as_mut()?;
                let others: Vec<&String> =
                    fingers.fingers.iter().filter(|name| Some(*name) != part.moving_finger.as_ref()).collect();
                part.moving_finger = Some(one_of(rng, &others)?.clone());
                Some(())
            },
        );
        self.add("a contact slides in the hand", &[Kind::WrongContactMode, Kind::WrongMovingFinger], |plan, rng| {
            let segment = &mut plan.segments[one_of(rng, &inside)?];
            for waypoint in &mut segment.waypoints {
                waypoint.contacts.first_mut()?.mode = ContactMode::Sliding;
            }
            Some(())
        });
        self.add("other contacts after a motion in a hand", &[Kind::GraspChanges, Kind::ContactOffTip], |plan, rng| {
            let s = one_of(rng, &last)?;
            let before = plan.segments[s].waypoints.last()?.contacts.clone();
            let finger = before.get(rng.below(before.len()))?.finger.clone();
            for waypoint in plan.segments.get_mut(s + 1)?.waypoints.iter_mut() {
                waypoint.contacts.retain(|contact| contact.finger != finger);
            }
            Some(())
        });
        self.add("motions in hands without forces", &[Kind::ForcesAbsent], |plan, _| {
            let mut promises = plan.promises.in_hand.values_mut();
            promises.by_ref().for_each(|promises| promises.forces = None);
            for &s in &inside {
                let segment = &mut plan.segments[s];
                segment.in_hand.as_mut()?.joint_torques.clear();
                for contact in segment.waypoints.iter_mut().flat_map(|waypoint| &mut waypoint.contacts) {
                    (contact.force_in_object, contact.torsion) = (None, None);
                }
            }
            (!inside.is_empty()).then_some(())
        });
        self.add("nothing is promised of motions in hands", &[Kind::PromiseBroken], |plan, _| {
            let had_some = !plan.promises.in_hand.is_empty();
            plan.promises.in_hand.clear();
            had_some.then_some(())
        });
        self.add(
            "motions in hands are promised too loosely",
            &[Kind::PromiseBroken, Kind::FrictionMarginTooSmall],
            |plan, rng| {
                let promises = plan.promises.in_hand.values_mut().next()?;
                match rng.below(2) {
                    0 => promises.contact_tolerance = 2e-3,
                    _ => promises.slip_tolerance = 2e-3,
                }
                Some(())
            },
        );
    }
}
