//! Plans broken in exactly one known way each, to test the checker (reliability R1). Every mutant must be rejected. Some
//! are good plans in a hand that is another than the one they were made for: what the plan does not say, the hand does.
//!
//! Amounts are small: a mutant that any check would catch proves nothing.

/// Random places for damage.
mod choice;
/// Forces, torques, and what is promised of them.
mod forces;
/// Fingers that are free, and fingers that are said to be.
mod free;
/// Good plans in hands of other contacts and couplings.
mod hand;
/// Plans that allow themselves more than the scene does.
mod limits;
/// Tracking and relocations in one plan.
mod mixed;
/// Fingertips that roll, and fingertips that are said to.
mod rolling;
/// Objects that turn though nothing drives them.
mod still;
/// Times and velocities.
mod times;
/// Tracking: modes, relative velocities, friction of what slides.
mod tracking;
/// Way poses gone wrong.
mod way;

use crate::check::continuity::{contact_of, moving_finger, pose_difference};
use crate::check::model::Model;
use crate::check::violation::ViolationKind::{self, *};
use crate::plan::{ContactMode, ContactState, Plan, PoseData, Segment, SegmentKind, Waypoint};
use choice::{any_closed, any_segment, any_waypoint, pick, pick_waypoint, swap_two, waypoints_mut};
use nalgebra::{DMatrix, DVector};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Shape, UnitVector, Vector};
use regrasp_robot::Hand;
use regrasp_scene::{Manipulation, Scene};

/// A broken plan.
#[derive(Debug, Clone)]
pub struct Mutant {
    /// What was done to it.
    pub name: &'static str,
    /// The broken plan.
    pub plan: Plan,
    /// The scene to judge it in, where that is what was changed.
    pub scene: Option<Scene>,
    /// At least one of these must be reported; others may follow from them.
    pub expected: Vec<ViolationKind>,
}

/// All mutants that `plan`, which must be a good one, has; places and amounts are drawn from `rng`.
///
/// Kinds of damage that the plan offers no place for (a regrasp, an edge, an input file) are left out.
/// Panics if the checker cannot read the hand of `part`.
pub fn mutants(plan: &Plan, task: Manipulation, rng: &mut Rng) -> Vec<Mutant> {
    let model = Model::new(&task).expect("a good plan was checked in this scene");
    let mut breeder = Breeder { plan, task, model: &model, rng, found: Vec::new() };
    breeder.break_header();
    breeder.break_way();
    breeder.break_order();
    breeder.break_joints();
    breeder.break_object();
    breeder.break_contacts();
    breeder.break_roles();
    breeder.break_relocations();
    breeder.break_contact_models();
    breeder.break_couplings();
    breeder.break_free_fingers();
    breeder.break_rolling();
    breeder.break_forces();
    breeder.break_times();
    breeder.break_tracking();
    breeder.break_mixed();
    breeder.break_limits();
    breeder.break_drive();
    breeder.found
}

struct Breeder<'a> {
    plan: &'a Plan,
    task: Manipulation<'a>,
    model: &'a Model,
    rng: &'a mut Rng,
    found: Vec<Mutant>,
}

impl Breeder<'_> {
    /// Adds a mutant if `damage` finds a place for it.
    fn add(
        &mut self,
        name: &'static str,
        expected: &[ViolationKind],
        damage: impl FnOnce(&mut Plan, &mut Rng) -> Option<()>,
    ) {
        let mut plan = self.plan.clone();
        if damage(&mut plan, self.rng).is_some() {
            self.found.push(Mutant { name, plan, scene: None, expected: expected.to_vec() });
        }
    }

    /// Adds the plan as it is, in a scene with another hand, if `damage` finds a place for it.
    fn add_hand(
        &mut self,
        name: &'static str,
        expected: &[ViolationKind],
        damage: impl FnOnce(&mut Hand, &mut Rng) -> Option<()>,
    ) {
        let mut scene = self.task.scene.clone();
        if damage(&mut scene.hands[self.task.hand_index].hand, self.rng).is_some() {
            let plan = self.plan.clone();
            self.found.push(Mutant { name, plan, scene: Some(scene), expected: expected.to_vec() });
        }
    }

    fn break_header(&mut self) {
        let scene_friction = self.task.object().friction;
        self.add("friction promise raised", &[FrictionAboveScene], |plan, rng| {
            plan.promises.friction = scene_friction * rng.uniform(1.0001, 1.05);
            (scene_friction > 0.0).then_some(())
        });
        self.add("friction promise lowered below closure", &[ClosureLost, PromiseBroken], |plan, rng| {
            plan.promises.friction *= rng.uniform(0.001, 0.02);
            any_closed(plan, rng).map(|_| ())
        });
        self.add("contact tolerance raised", &[PromiseBroken], |plan, rng| {
            plan.promises.contact_tolerance = rng.uniform(0.51e-3, 0.7e-3);
            Some(())
        });
        self.add("margin required raised above the one kept", &[PromiseBroken], |plan, rng| {
            plan.promises.required_margin = plan.promises.kept_margin + rng.uniform(0.001, 0.01);
            Some(())
        });
        self.add("margins raised above the true one", &[ClosureLost], |plan, rng| {
            // No grasp has a Ferrari-Canny radius above one.
            plan.promises.kept_margin = rng.uniform(1.0, 1.1);
            plan.promises.required_margin = plan.promises.kept_margin;
            any_closed(plan, rng).map(|_| ())
        });
        self.add("kept margin invented", &[PromiseBroken], |plan, rng| {
            plan.promises.kept_margin = rng.uniform(0.9, 1.0);
            Some(())
        });
        self.add("torque scale changed", &[PromiseBroken], |plan, rng| {
            plan.promises.torque_scale *= rng.uniform(1.001, 1.01);
            Some(())
        });
        self.add("input hash changed", &[InputHashMismatch], |plan, rng| {
            let input = pick(&mut plan.inputs, rng)?;
            let flipped = if input.sha256.starts_with('0') { "1" } else { "0" };
            input.sha256.replace_range(0..1, flipped);
            Some(())
        });
        self.add("input left out", &[InputHashMismatch], |plan, rng| {
            let n_inputs = plan.inputs.len();
            (n_inputs > 0).then(|| drop(plan.inputs.remove(rng.below(n_inputs))))
        });
        self.add("start asked for elsewhere", &[StartMismatch], |plan, rng| {
            shift(&mut plan.start, rng, 1e-5, 1e-4);
            Some(())
        });
        self.add("goal asked for elsewhere", &[GoalMismatch], |plan, rng| {
            shift(&mut plan.goal, rng, 1e-5, 1e-4);
            plan.promises.tracking.is_none().then_some(())
        });
        self.add("two joint names swapped", &[WrongScene], |plan, rng| swap_two(&mut plan.joint_names, rng));
        self.add("two finger names swapped", &[WrongScene], |plan, rng| swap_two(&mut plan.fingers, rng));
        self.add("hand of another name", &[WrongScene], |plan, _| {
            plan.hand.push('2');
            Some(())
        });
        self.add("object of another name", &[WrongScene], |plan, _| {
            plan.object.push('2');
            Some(())
        });
        self.add("answer to a query of another name", &[WrongScene], |plan, _| {
            plan.query.push('2');
            Some(())
        });
        self.add("object said to be held by nobody", &[WrongHolder], |plan, rng| {
            pick(&mut plan.segments, rng)?.held_by.clear();
            Some(())
        });
        self.add("object said to be held by another hand too", &[WrongHolder], |plan, rng| {
            pick(&mut plan.segments, rng)?.held_by.push("other".into());
            Some(())
        });
        self.add("object let go by all fingers, said to be held by nobody", &[WrongHolder], |plan, rng| {
            let segment = pick(&mut plan.segments, rng)?;
            segment.held_by.clear();
            pick(&mut segment.waypoints, rng)?.contacts.fill(ContactState::FREE);
            Some(())
        });
        self.add("task renamed", &[WrongScene], |plan, _| {
            plan.task = if plan.task == "tracking" { "in_hand" } else { "tracking" }.into();
            Some(())
        });
    }

    fn break_order(&mut self) {
        self.add("no segments", &[EmptySegment], |plan, _| {
            plan.segments.clear();
            Some(())
        });
        self.add("segment of one waypoint", &[EmptySegment], |plan, rng| {
            pick(&mut plan.segments, rng)?.waypoints.truncate(1);
            Some(())
        });
        self.add("segment left out", &[SegmentsDoNotMeet], |plan, rng| {
            // A transfer that only takes out rounding is not missed.
            let n_segments = plan.segments.len();
            let inner = 1..n_segments.saturating_sub(1);
            let missed: Vec<usize> = inner.filter(|&s| goes_somewhere(&plan.segments[s])).collect();
            (!missed.is_empty()).then(|| drop(plan.segments.remove(missed[rng.below(missed.len())])))
        });
        self.add("segment reversed in time", &[SegmentsDoNotMeet, StartMismatch, GoalMismatch], |plan, rng| {
            let mut moving: Vec<_> = plan.segments.iter_mut().filter(|segment| goes_somewhere(segment)).collect();
            pick(&mut moving, rng)?.waypoints.reverse();
            Some(())
        });
        self.add("plan reversed in time", &[StartMismatch, GoalMismatch], |plan, _| {
            plan.segments.reverse();
            plan.segments.iter_mut().for_each(|segment| segment.waypoints.reverse());
            let (distance, angle) = pose_difference(&plan.start, &plan.goal);
            (distance.max(angle) > 1e-4 && plan.promises.tracking.is_none()).then_some(())
        });
        self.add("beginning cut off", &[StartMismatch], |plan, _| {
            let moved = plan.segments.iter().position(|s| s.kind == SegmentKind::Transfer && travel(s) > 1e-4)?;
            plan.segments.drain(..=moved);
            (!plan.segments.is_empty()).then_some(())
        });
        self.add("end cut off", &[GoalMismatch], |plan, _| {
            let moved = plan.segments.iter().rposition(|s| s.kind == SegmentKind::Transfer && travel(s) > 1e-4)?;
            plan.segments.truncate(moved);
            (moved > 0).then_some(())
        });
    }

    fn break_joints(&mut self) {
        let limits = &self.model.limits;
        self.add("joint half a degree beyond its limit", &[JointLimit], |plan, rng| {
            let row = limits.get(rng.below(limits.len().max(1)))?;
            let beyond = rng.uniform(0.5f64, 1.0).to_radians();
            let position = if rng.chance(0.5) { row.lower - beyond } else { row.upper + beyond };
            row.put(&mut any_waypoint(plan, rng)?.joints, position);
            Some(())
        });
        let model = self.model;
        self.add("joint jumps", &[JointJump], |plan, rng| {
            let turning: Vec<usize> = (0..model.slides.len()).filter(|&k| !model.slides[k]).collect();
            let k = *turning.get(rng.below(turning.len().max(1)))?;
            // Both steps at the waypoint change by this much, so one of them is a jump.
            any_waypoint(plan, rng)?.joints[k] += rng.uniform(1.01, 1.2);
            Some(())
        });
        self.add("joint is not a number", &[NotANumber], |plan, rng| {
            *pick(&mut any_waypoint(plan, rng)?.joints, rng)? = f64::NAN;
            Some(())
        });
    }

    fn break_object(&mut self) {
        const MOVED: [ViolationKind; 5] =
            [ContactOffTip, ObjectMovesInRegrasp, SegmentsDoNotMeet, StartMismatch, GoalMismatch];
        self.add("object shifted at a waypoint", &MOVED, |plan, rng| {
            let tolerance = plan.promises.contact_tolerance;
            let waypoint = any_waypoint(plan, rng)?;
            shift(&mut waypoint.world_from_object, rng, 2.5 * tolerance, 4.0 * tolerance);
            Some(())
        });
        self.add("quaternion components swapped", &MOVED, |plan, rng| {
            let waypoint = any_waypoint(plan, rng)?;
            let before = waypoint.world_from_object;
            waypoint.world_from_object.quat_xyzw.swap(0, 1 + rng.below(2));
            let (_, angle) = pose_difference(&before, &waypoint.world_from_object);
            (angle > 0.1).then_some(())
        });
        self.add("quaternion not of length one", &[NotANumber], |plan, rng| {
            let waypoint = any_waypoint(plan, rng)?;
            waypoint.world_from_object.quat_xyzw.iter_mut().for_each(|x| *x *= 1.0 + 1e-6);
            Some(())
        });
        self.add("object creeps in a regrasp", &[ObjectMovesInRegrasp], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
            let n_waypoints = segment.waypoints.len();
            let waypoint = segment.waypoints.get_mut(1 + rng.below(n_waypoints - 1))?;
            shift(&mut waypoint.world_from_object, rng, 1e-6, 1e-5);
            Some(())
        });
    }

    fn break_contacts(&mut self) {
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

    fn break_roles(&mut self) {
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

    fn break_relocations(&mut self) {
        let (model, task) = (self.model, self.task);
        self.add("relocation without lift", &[LandingOrLiftingNotFree, Collision], |plan, rng| {
            // The tip goes straight through the object or along its surface, in small steps.
            let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
            let (first, last) = (segment.waypoints.first()?.clone(), segment.waypoints.last()?.clone());
            let f = moving_finger(model, segment)?;
            let (from, to) = (contact_of(&first.contacts[f])?, contact_of(&last.contacts[f])?);
            let object = Pose::from(&first.world_from_object);
            let center = |c: &regrasp_grasp::Contact, waypoint: &Waypoint| {
                let away = model.fingers[f].center_from_contact(waypoint, &c.normal_in_object);
                object * (c.point_in_object + away)
            };
            let (a, b) = (center(&from, &first), center(&to, &last));
            if (a - b).norm() < 2e-3 {
                return None;
            }
            let n_steps = ((b - a).norm() / 1e-3).ceil() as usize;
            let mut waypoints = vec![first.clone()];
            for k in 1..n_steps {
                let mut waypoint = waypoints.last()?.clone();
                waypoint.contacts[f] = ContactState::FREE;
                move_tip(model, f, &mut waypoint.joints, &(a + (b - a) * (k as f64 / n_steps as f64)))?;
                waypoints.push(waypoint);
            }
            waypoints.push(last);
            segment.waypoints = waypoints;
            Some(())
        });
        self.add("tip dips into the object before it lifts", &[LandingOrLiftingNotFree, Collision], |plan, rng| {
            let depth = rng.uniform(1e-3, 2e-3);
            push_free_tip(plan, model, rng, |end| end.point - end.normal * depth)
        });
        self.add("tip drags along the surface before it lifts", &[LandingOrLiftingNotFree, Collision], |plan, rng| {
            let way = rng.uniform(0.5e-3, 1e-3);
            push_free_tip(plan, model, rng, |end| end.point + end.side * way)
        });
        self.add("free finger reaches into another one", &[Collision], |plan, rng| {
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Regrasp)?;
            let f = moving_finger(model, &plan.segments[s])?;
            let waypoint = &mut plan.segments[s].waypoints[w];
            let other = (f + 1 + rng.below(model.fingers.len() - 1)) % model.fingers.len();
            let hand_may_touch = task.hand().may_touch(model.fingers[f].tip_link, model.fingers[other].tip_link);
            let target = model.fingers[other].center_in_world(&waypoint.joints);
            let here = model.fingers[f].center_in_world(&waypoint.joints);
            let reach = (model.fingers[f].radius + model.fingers[other].radius - 1e-3).max(1e-3);
            if hand_may_touch || waypoint.contacts[f].holds() {
                return None;
            }
            move_tip(model, f, &mut waypoint.joints, &(target + (here - target).normalize() * reach))
        });
    }
}

fn shift(pose: &mut PoseData, rng: &mut Rng, low: f64, high: f64) {
    let way = Vector::from(rng.direction()) * rng.uniform(low, high);
    (0..3).for_each(|k| pose.position[k] += way[k]);
}

fn travel(segment: &Segment) -> f64 {
    match (segment.waypoints.first(), segment.waypoints.last()) {
        (Some(a), Some(b)) => {
            let (distance, angle) = pose_difference(&a.world_from_object, &b.world_from_object);
            distance.max(angle)
        }
        _ => 0.0,
    }
}

/// True when the object or a joint ends more than a millionth of a metre or radian from where it began.
fn goes_somewhere(segment: &Segment) -> bool {
    let (Some(first), Some(last)) = (segment.waypoints.first(), segment.waypoints.last()) else { return false };
    travel(segment) > 1e-6 || first.joints.iter().zip(&last.joints).any(|(a, b)| (a - b).abs() > 1e-6)
}

/// Moves the tip of finger `f` so that its centre is at `target`, by damped least squares from where it is.
///
/// None when it does not get there within a micrometre.
fn move_tip(model: &Model, f: usize, joints: &mut [f64], target: &Point) -> Option<()> {
    let finger = &model.fingers[f];
    let mut trial = joints.to_vec();
    for _ in 0..200 {
        let here = finger.center_in_world(&trial);
        let error = target - here;
        if error.norm() < 1e-6 {
            joints.copy_from_slice(&trial);
            return Some(());
        }
        let n_coordinates = finger.coordinates.len();
        let mut jacobian = DMatrix::zeros(3, n_coordinates);
        for (column, k) in finger.coordinates.clone().enumerate() {
            let step = 1e-7;
            trial[k] += step;
            jacobian.set_column(column, &((finger.center_in_world(&trial) - here) / step));
            trial[k] -= step;
        }
        let damped = &jacobian * jacobian.transpose() + DMatrix::identity(3, 3) * 1e-9;
        let solved = damped.lu().solve(&DVector::from_column_slice(error.as_slice()))?;
        let change = jacobian.transpose() * solved;
        let scale = (0.2 / change.norm().max(1e-12)).min(1.0);
        for (column, k) in finger.coordinates.clone().enumerate() {
            trial[k] += scale * change[column];
        }
    }
    None
}

/// Replaces one contact wherever it stands, and moves the joints along with it.
fn replace_contact(
    plan: &mut Plan,
    model: &Model,
    rng: &mut Rng,
    change: impl Fn(Point, UnitVector, &mut Rng) -> (Point, UnitVector),
) -> Option<()> {
    let f = rng.below(model.fingers.len());
    let first = pick(&mut plan.segments, rng)?.waypoints.first()?.contacts[f];
    let contact = contact_of(&first)?;
    let (point, normal) = change(contact.point_in_object, contact.normal_in_object, rng);
    for waypoint in waypoints_mut(plan) {
        if waypoint.contacts[f] == first {
            let state = &mut waypoint.contacts[f];
            state.point_in_object = Some(point.into());
            state.normal_in_object = Some(normal.into_inner().into());
            let center = point + model.fingers[f].center_from_contact(waypoint, &normal);
            move_tip(model, f, &mut waypoint.joints, &(Pose::from(&waypoint.world_from_object) * center))?;
        }
    }
    Some(())
}

/// An end of a relocation, in the world.
struct End {
    /// Where the tip's centre touches.
    point: Point,
    /// Outward normal.
    normal: Vector,
    /// A tangent.
    side: Vector,
}

/// Puts an extra waypoint after the beginning or before the end of a relocation, with the tip at `target`.
fn push_free_tip(plan: &mut Plan, model: &Model, rng: &mut Rng, target: impl Fn(&End) -> Point) -> Option<()> {
    let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
    let f = moving_finger(model, segment)?;
    let at_end = rng.chance(0.5);
    let end = if at_end { segment.waypoints.last()? } else { segment.waypoints.first()? };
    let contact = contact_of(&end.contacts[f])?;
    let object = Pose::from(&end.world_from_object);
    let (side, _) = regrasp_geometry::frame::tangents(&contact.normal_in_object);
    let ours = End {
        point: model.fingers[f].center_in_world(&end.joints),
        normal: object * contact.normal_in_object.into_inner(),
        side: object * side.into_inner(),
    };
    let mut waypoint = end.clone();
    waypoint.contacts[f] = ContactState::FREE;
    move_tip(model, f, &mut waypoint.joints, &target(&ours))?;
    let place = if at_end { segment.waypoints.len() - 1 } else { 1 };
    segment.waypoints.insert(place, waypoint);
    Some(())
}
