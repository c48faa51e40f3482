//! Tracking gone wrong: modes, relative velocities, friction of what slides, roles, reach and goal.

use super::choice::{any_segment, pick, places, waypoints_mut};
use super::edit::move_tip;
use super::rolling::{declare, slide};
use super::{Breeder, Mutant};
use nalgebra::Rotation3;
use regrasp_base::Rng;
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::pose::pose_difference;
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::check::surface;
use regrasp_plan::check::tracking::{may_move, named_fingers};
use regrasp_plan::check::violation::ViolationKind::{
    self, Collision, ContactModeWrong, ContactNormalWrong, ContactOffTip, GoalMismatch, GraspChanges, JointJump,
    OutOfReach, PromiseBroken, RelativeMotionMissing, RelativeVelocityWrong, SlidingForceWrong, Slip, StartMismatch,
    WrongContactMode, WrongMovingFinger, WrongRollingFinger, WrongScene,
};
use regrasp_plan::plan::ContactMode::{self, Fixed, PureRolling, PureSliding, Rolling, Sliding, Twisting};
use regrasp_plan::plan::{ContactState, Plan, PoseData, Segment, SegmentKind, TrackingPromises, Waypoint};
use regrasp_robot::{ContactModel, TipShape};

/// What a contact must really do in a segment for a claim to be wrong; none where it is wrong whatever it does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Does {
    Slide,
    Turn,
    Twist,
    Roll,
    Anything,
}

/// Wrong claims: what the contact is, what it is said to be, why that is wrong, and what must be reported.
const CLAIMS: [(&str, ContactMode, ContactMode, Does, ViolationKind); 24] = [
    ("sliding said to be fixed", Sliding, Fixed, Does::Slide, Slip),
    ("sliding said to be rolling", Sliding, Rolling, Does::Slide, Slip),
    ("sliding said to be pure rolling", Sliding, PureRolling, Does::Slide, Slip),
    ("sliding said to be twisting", Sliding, Twisting, Does::Slide, Slip),
    ("sliding said to be pure sliding", Sliding, PureSliding, Does::Turn, ContactModeWrong),
    ("pure sliding said to be fixed", PureSliding, Fixed, Does::Slide, Slip),
    ("pure sliding said to be rolling", PureSliding, Rolling, Does::Slide, Slip),
    ("pure sliding said to be pure rolling", PureSliding, PureRolling, Does::Slide, Slip),
    ("pure sliding said to be twisting", PureSliding, Twisting, Does::Slide, Slip),
    ("rolling said to be fixed", Rolling, Fixed, Does::Turn, ContactModeWrong),
    ("rolling said to be pure rolling", Rolling, PureRolling, Does::Twist, ContactModeWrong),
    ("rolling said to be twisting", Rolling, Twisting, Does::Roll, ContactModeWrong),
    ("rolling said to be sliding", Rolling, Sliding, Does::Anything, ContactModeWrong),
    ("pure rolling said to be fixed", PureRolling, Fixed, Does::Turn, ContactModeWrong),
    ("pure rolling said to be twisting", PureRolling, Twisting, Does::Roll, ContactModeWrong),
    ("pure rolling said to be sliding", PureRolling, Sliding, Does::Anything, ContactModeWrong),
    ("pure rolling said to be pure sliding", PureRolling, PureSliding, Does::Anything, ContactModeWrong),
    ("twisting said to be fixed", Twisting, Fixed, Does::Turn, ContactModeWrong),
    ("twisting said to be pure rolling", Twisting, PureRolling, Does::Twist, ContactModeWrong),
    ("twisting said to be sliding", Twisting, Sliding, Does::Anything, ContactModeWrong),
    ("twisting said to be pure sliding", Twisting, PureSliding, Does::Anything, ContactModeWrong),
    ("fixed said to be sliding", Fixed, Sliding, Does::Anything, ContactModeWrong),
    ("fixed said to be pure sliding", Fixed, PureSliding, Does::Anything, ContactModeWrong),
    ("sliding of which half is said to roll", Sliding, Rolling, Does::Slide, WrongContactMode),
];

impl Breeder<'_> {
    pub(super) fn break_tracking(&mut self) {
        self.break_claims();
        self.break_relative_motion();
        self.break_sliding_forces();
        self.break_tracking_roles();
        self.break_tracked_contacts();
        self.break_tracking_promises();
        self.break_reach();
    }

    fn break_claims(&mut self) {
        let model = self.model;
        for (name, is, said, does, expected) in CLAIMS {
            self.add(name, &[expected], |plan, rng| {
                let slip = plan.promises.slip_tolerance;
                let fits =
                    |segment: &Segment, f: usize| is_all(segment, f, is) && does_it(model, segment, f, does, slip);
                let &mut (s, f) = pick(&mut places(plan, model, fits), rng)?;
                if expected == WrongContactMode {
                    let half = plan.segments[s].waypoints.len() / 2;
                    plan.segments[s].waypoints[half..].iter_mut().for_each(|w| w.contacts[f].mode = said);
                } else {
                    declare(plan, s, f, said);
                }
                Some(())
            });
        }
        self.add("mode of one waypoint is another", &[WrongContactMode], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, |contact| contact.mode != Fixed)?;
            let contact = &mut plan.segments[s].waypoints[w].contacts[f];
            contact.mode = if contact.mode == Rolling { PureRolling } else { Rolling };
            Some(())
        });
        let task = self.task;
        self.add("moving fingertip that rolls slides there and back", &[Slip], |plan, rng| {
            let still = |contact: &ContactState| !contact.mode.slides();
            let (s, w, f) = pick_moving(plan, model, rng, still)?;
            let way = plan.promises.slip_tolerance * rng.uniform(1.0, 3.0);
            let angle = rng.uniform(0.0, std::f64::consts::TAU);
            let shape = &task.object().shape;
            slide(model, shape, &mut plan.segments[s].waypoints[w], f, angle, way)
        });
    }

    fn break_relative_motion(&mut self) {
        let model = self.model;
        let slides = |contact: &ContactState| contact.mode.slides();
        self.add("relative velocity too large", &[RelativeVelocityWrong], |plan, rng| {
            let factor = rng.uniform(1.1, 2.0);
            change_velocity(plan, model, rng, slides, |velocity, _| velocity * factor)
        });
        self.add("relative velocity too small", &[RelativeVelocityWrong], |plan, rng| {
            let factor = rng.uniform(0.1, 0.9);
            change_velocity(plan, model, rng, slides, |velocity, _| velocity * factor)
        });
        self.add("relative velocity turned aside", &[RelativeVelocityWrong], |plan, rng| {
            let angle = rng.uniform(0.025, 0.3);
            change_velocity(plan, model, rng, slides, |velocity, normal| Rotation3::new(normal * angle) * velocity)
        });
        self.add("relative velocity of the object instead of the tip's", &[RelativeVelocityWrong], |plan, rng| {
            change_velocity(plan, model, rng, slides, |velocity, _| -velocity)
        });
        self.add("relative velocity in the world's frame", &[RelativeVelocityWrong], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, slides)?;
            let waypoint = &mut plan.segments[s].waypoints[w];
            let velocity = waypoint.contacts[f].relative_velocity_in_object.as_mut()?;
            let before = Vector::from(*velocity);
            *velocity = (Pose::from(&waypoint.world_from_object) * before).into();
            (before.angle(&Vector::from(*velocity)) > 0.05).then_some(())
        });
        self.add("velocity and friction turned aside together", &[RelativeVelocityWrong], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, slides)?;
            let contact = &mut plan.segments[s].waypoints[w].contacts[f];
            let normal = contact_of(contact)?.normal_in_object.into_inner();
            let turn = Rotation3::new(normal * rng.uniform(0.025, 0.3));
            for vector in [contact.relative_velocity_in_object.as_mut()?, contact.force_in_object.as_mut()?] {
                *vector = (turn * Vector::from(*vector)).into();
            }
            Some(())
        });
        self.add("relative velocity of a contact that does not slide", &[RelativeVelocityWrong], |plan, rng| {
            let speed = rng.uniform(2e-3, 1e-2);
            let still = |contact: &ContactState| !contact.mode.slides();
            change_velocity(plan, model, rng, still, |_, normal| {
                regrasp_geometry::frame::tangents(&nalgebra::Unit::new_normalize(*normal)).0.into_inner() * speed
            })
        });
        self.add("relative turn too fast", &[RelativeVelocityWrong], |plan, rng| {
            let factor = rng.uniform(1.1, 2.0);
            change_turn(plan, model, rng, |turn| turn * factor)
        });
        self.add("relative turn the other way", &[RelativeVelocityWrong], |plan, rng| {
            change_turn(plan, model, rng, |turn| -turn)
        });
        self.add("relative turn left out", &[RelativeVelocityWrong], |plan, rng| {
            change_turn(plan, model, rng, |_| Vector::zeros())
        });
        type Field = fn(&mut ContactState) -> &mut Option<[f64; 3]>;
        let fields: [(&str, Field); 3] = [
            ("point on the tip missing", |contact| &mut contact.point_in_tip),
            ("relative velocity missing", |contact| &mut contact.relative_velocity_in_object),
            ("relative turn missing", |contact| &mut contact.relative_turn_in_object),
        ];
        for (name, field) in fields {
            self.add(name, &[RelativeMotionMissing], |plan, rng| {
                let (s, w, f) = pick_tracked(plan, model, rng, |_| true)?;
                field(&mut plan.segments[s].waypoints[w].contacts[f]).take().map(|_| ())
            });
        }
        self.add("relative velocity where nothing is tracked", &[RelativeMotionMissing], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Transfer)?;
            let mut held: Vec<_> = segment.waypoints[0].contacts.iter_mut().filter(|contact| contact.holds()).collect();
            pick(&mut held, rng)?.relative_velocity_in_object = Some([0.0; 3]);
            Some(())
        });
    }

    fn break_sliding_forces(&mut self) {
        let model = self.model;
        self.add("friction of what slides not full", &[SlidingForceWrong], |plan, rng| {
            let factor = rng.uniform(0.9, 0.999_999);
            change_friction(plan, model, rng, |friction, _| friction * factor)
        });
        self.add("friction of what slides more than full", &[SlidingForceWrong], |plan, rng| {
            let factor = rng.uniform(1.000_001, 1.1);
            change_friction(plan, model, rng, |friction, _| friction * factor)
        });
        self.add("friction against the drag", &[SlidingForceWrong], |plan, rng| {
            change_friction(plan, model, rng, |friction, _| -friction)
        });
        self.add("friction aside of the drag by a millionth", &[SlidingForceWrong], |plan, rng| {
            let angle = rng.uniform(1e-7, 1e-5);
            change_friction(plan, model, rng, |friction, normal| Rotation3::new(normal * angle) * friction)
        });
        self.add("what slides is said to stick by its friction", &[SlidingForceWrong], |plan, rng| {
            change_friction(plan, model, rng, |_, _| Vector::zeros())
        });
        self.add("torsion of a soft fingertip that slides", &[SlidingForceWrong], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, |contact| contact.mode.slides())?;
            let contact = &mut plan.segments[s].waypoints[w].contacts[f];
            contact.force_in_object?;
            contact.torsion = Some(rng.uniform(1e-6, 1e-4));
            matches!(model.fingers[f].contact, ContactModel::SoftFinger { .. }).then_some(())
        });
    }

    fn break_tracking_roles(&mut self) {
        let model = self.model;
        self.add("resting finger moves in tracking", &[WrongMovingFinger], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, |_| true)?;
            let coordinates = model.fingers[f].coordinates.clone();
            let k = coordinates.start + rng.below(coordinates.len());
            plan.segments[s].waypoints[w].joints[k] += rng.uniform(1e-6, 1e-4);
            (!may_move(model, &plan.segments[s], f)).then_some(())
        });
        self.add("finger that also moves not named", &[WrongMovingFinger], |plan, rng| {
            let several: Vec<usize> =
                (0..plan.segments.len()).filter(|&s| !plan.segments[s].also_moving.is_empty()).collect();
            let s = *several.get(rng.below(several.len().max(1)))?;
            let segment = &mut plan.segments[s];
            let name = segment.also_moving.remove(rng.below(segment.also_moving.len()));
            let finger = model.fingers.iter().find(|finger| finger.name == name)?;
            let start = &segment.waypoints[0].joints;
            let moved =
                |k: usize| segment.waypoints.iter().any(|waypoint| (waypoint.joints[k] - start[k]).abs() > 1e-6);
            finger.coordinates.clone().any(moved).then_some(())
        });
        self.add("finger named twice as moving", &[WrongMovingFinger], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Tracking)?;
            segment.also_moving.push(segment.moving_finger.clone()?);
            Some(())
        });
        self.add("rolling finger named as also moving", &[WrongRollingFinger], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Tracking)?;
            segment.also_moving.push(segment.rolling_finger.clone()?);
            Some(())
        });
        self.add("other moving fingers named in a regrasp or transfer", &[WrongMovingFinger], |plan, rng| {
            let kind = if rng.chance(0.5) { SegmentKind::Regrasp } else { SegmentKind::Transfer };
            let name = plan.fingers.last()?.clone();
            any_segment(plan, rng, kind)?.also_moving.push(name);
            Some(())
        });
        self.add("another finger named as moving in tracking", &[WrongMovingFinger], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Tracking)?;
            let [moving, _] = named_fingers(model, segment);
            let coordinates = model.fingers[moving?].coordinates.clone();
            let moves = |waypoint: &Waypoint| {
                coordinates.clone().any(|k| (waypoint.joints[k] - segment.waypoints[0].joints[k]).abs() > 1e-6)
            };
            let moves = segment.waypoints.iter().any(moves);
            segment.moving_finger = Some(model.fingers[(moving? + 1) % model.fingers.len()].name.clone());
            moves.then_some(())
        });
        self.add("moving finger of tracking not named", &[WrongMovingFinger], |plan, rng| {
            any_segment(plan, rng, SegmentKind::Tracking)?.moving_finger.take().map(|_| ())
        });
        self.add("rolling finger not named", &[WrongRollingFinger], |plan, rng| {
            any_segment(plan, rng, SegmentKind::Tracking)?.rolling_finger.take().map(|_| ())
        });
        self.add("rolling finger is the moving one", &[WrongRollingFinger], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Tracking)?;
            segment.rolling_finger = segment.moving_finger.clone();
            Some(())
        });
        self.add("finger named as rolling that slides", &[WrongRollingFinger], |plan, rng| {
            let (s, _, f) = pick_tracked(plan, model, rng, |contact| contact.mode.slides())?;
            plan.segments[s].rolling_finger = Some(model.fingers[f].name.clone());
            Some(())
        });
        self.add("finger named as rolling in a transfer", &[WrongRollingFinger], |plan, rng| {
            let name = plan.fingers.first().cloned();
            any_segment(plan, rng, SegmentKind::Transfer)?.rolling_finger = name;
            Some(())
        });
        self.add("finger lets go in tracking", &[WrongContactMode], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, |_| true)?;
            plan.segments[s].waypoints[w].contacts[f] = ContactState::FREE;
            Some(())
        });
        self.add("tracking passed off as a transfer", &[WrongContactMode, RelativeMotionMissing], |plan, rng| {
            any_segment(plan, rng, SegmentKind::Tracking)?.kind = SegmentKind::Transfer;
            Some(())
        });
        let tracks = self.plan.segments.iter().any(|segment| segment.kind == SegmentKind::Tracking);
        self.add_hand("sharp fingertip tracks", &[WrongContactMode], |hand, rng| {
            pick(&mut hand.fingers, rng)?.tip.shape = TipShape::Point;
            tracks.then_some(())
        });
    }

    fn break_tracked_contacts(&mut self) {
        let (model, shape) = (self.model, &self.task.object().shape);
        self.add("point on the tip elsewhere", &[ContactOffTip], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, |_| true)?;
            let way = Vector::from(rng.direction()) * (plan.promises.contact_tolerance * rng.uniform(2.1, 4.0));
            let point = plan.segments[s].waypoints[w].contacts[f].point_in_tip.as_mut()?;
            *point = (Vector::from(*point) + way).into();
            Some(())
        });
        self.add("points on the tip of another moment", &[ContactOffTip], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, |_| true)?;
            let first = plan.segments[s].waypoints[0].contacts[f].point_in_tip?;
            let point = plan.segments[s].waypoints[w].contacts[f].point_in_tip.as_mut()?;
            let way = (Vector::from(first) - Vector::from(*point)).norm();
            *point = first;
            (way > 2.1 * plan.promises.contact_tolerance).then_some(())
        });
        for (name, along) in
            [("moving fingertip off the object", 1.0), ("moving fingertip pressed into the object", -1.0)]
        {
            self.add(name, &[ContactOffTip, Collision], |plan, rng| {
                let (s, w, f) = pick_moving(plan, model, rng, |_| true)?;
                let off = along * plan.promises.contact_tolerance * rng.uniform(2.1, 4.0);
                let waypoint = &mut plan.segments[s].waypoints[w];
                let contact = contact_of(&waypoint.contacts[f])?;
                let normal = Pose::from(&waypoint.world_from_object) * contact.normal_in_object.into_inner();
                let target = model.fingers[f].center_in_world(&waypoint.joints) + normal * off;
                move_tip(model, f, &mut waypoint.joints, &target)
            });
        }
        self.add("way round an edge cut short", &[ContactOffTip, Collision, JointJump], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Tracking)?;
            let [moving, _] = named_fingers(model, segment);
            let normal = |waypoint: &Waypoint| waypoint.contacts[moving?].normal_in_object.map(Vector::from);
            let n_waypoints = segment.waypoints.len();
            let turn = normal(segment.waypoints.first()?)?.angle(&normal(segment.waypoints.last()?)?);
            segment.waypoints.drain(1..n_waypoints - 1);
            (turn > 0.5).then_some(())
        });
        self.add("fixed contact elsewhere for a moment", &[GraspChanges], |plan, rng| {
            let (s, w, f) = pick_tracked(plan, model, rng, |contact| contact.mode == Fixed)?;
            let point = plan.segments[s].waypoints[w].contacts[f].point_in_object.as_mut()?;
            point[rng.below(3)] += rng.uniform(1e-7, 1e-6);
            Some(())
        });
        self.add("normal on an edge outside what its faces span", &[ContactNormalWrong], |plan, rng| {
            let normals = |contact: &ContactState| match contact.point_in_object {
                Some(point) => surface::nearest(shape, &point.into()).normals,
                None => Vec::new(),
            };
            let across = |normals: &[Vector]| {
                let first = *normals.first()?;
                let second = normals.iter().copied().find(|normal| normal.angle(&first) > 0.1)?;
                Some((first, (second - first * first.dot(&second)).normalize()))
            };
            let (s, w, f) = pick_tracked(plan, model, rng, |contact| across(&normals(contact)).is_some())?;
            let contact = &mut plan.segments[s].waypoints[w].contacts[f];
            let (face, aside) = across(&normals(contact))?;
            contact.normal_in_object = Some((face - aside * rng.uniform(0.002, 0.02)).normalize().into());
            Some(())
        });
    }

    fn break_tracking_promises(&mut self) {
        let model = self.model;
        self.add("goal tolerance promised too wide", &[PromiseBroken], |plan, rng| {
            promises(plan)?.goal_tolerance = rng.uniform(0.0421, 0.1);
            Some(())
        });
        self.add("goal tolerance promised below the miss", &[GoalMismatch], |plan, rng| {
            let end = plan.segments.last()?.waypoints.last()?.world_from_object;
            let (_, miss) = pose_difference(&plan.goal, &end);
            promises(plan)?.goal_tolerance = miss * rng.uniform(0.9, 0.999);
            (miss > 1e-6).then_some(())
        });
        self.add("goal asked for as another orientation", &[GoalMismatch], |plan, rng| {
            promises(plan)?;
            turn(&mut plan.goal, rng.uniform(1e-5, 1e-4), rng);
            Some(())
        });
        self.add("last segments of tracking cut off", &[GoalMismatch], |plan, _| {
            let tolerance = promises(plan)?.goal_tolerance;
            let goal = plan.goal;
            let away = |segment: &Segment| {
                let end = segment.waypoints.last().map(|waypoint| waypoint.world_from_object);
                end.is_some_and(|end| pose_difference(&end, &goal).1 > tolerance + 1e-3)
            };
            let last = plan.segments.iter().rposition(away)?;
            plan.segments.truncate(last + 1);
            Some(())
        });
        self.add("tracking reversed in time", &[StartMismatch, RelativeVelocityWrong], |plan, _| {
            promises(plan)?;
            let end = plan.segments.last()?.waypoints.last()?.time;
            plan.segments.reverse();
            plan.segments.iter_mut().for_each(|segment| segment.waypoints.reverse());
            waypoints_mut(plan).for_each(|waypoint| waypoint.time = end - waypoint.time);
            Some(())
        });
        for (name, low, high) in [
            ("sliding friction promised smaller", 0.9, 0.999_999),
            ("sliding friction promised larger", 1.000_001, 1.1),
        ] {
            self.add(name, &[PromiseBroken], |plan, rng| {
                promises(plan)?.sliding_friction *= rng.uniform(low, high);
                Some(())
            });
        }
        self.add("promises of tracking left out", &[WrongScene], |plan, _| plan.promises.tracking.take().map(|_| ()));
        self.add("gravity of any direction in tracking", &[PromiseBroken], |plan, _| {
            promises(plan)?;
            plan.promises.forces.as_mut()?.gravity_in_world.take().map(|_| ())
        });
        let has_place = self.plan.promises.tracking.is_some() && self.task.object().friction > 0.0;
        if has_place {
            let mut scene = self.task.scene.clone();
            scene.objects[self.task.object_index].friction *= self.rng.uniform(1.001, 1.1);
            let places = places(self.plan, model, |segment, f| segment.waypoints[0].contacts[f].mode.slides());
            let expected = if places.is_empty() { vec![PromiseBroken] } else { vec![SlidingForceWrong] };
            let name = "object with more friction than it had";
            self.found.push(Mutant { name, plan: self.plan.clone(), scene: Some(scene), expected });
        }
    }

    fn break_reach(&mut self) {
        let far = |finger: &regrasp_plan::check::model::FingerModel| {
            let distance = |w: &Waypoint| (finger.center_in_world(&w.joints) - finger.center_at_rest).norm();
            self.plan.segments.iter().flat_map(|s| &s.waypoints).map(distance).fold(0.0, f64::max)
        };
        let farthest = self.model.fingers.iter().map(far).fold(0.0, f64::max);
        if self.task.scene.hands[self.task.hand_index].reach.is_none() || farthest < 1e-4 {
            return;
        }
        let mut scene = self.task.scene.clone();
        scene.hands[self.task.hand_index].reach = Some(farthest * self.rng.uniform(0.9, 0.9999));
        let (plan, expected) = (self.plan.clone(), vec![OutOfReach]);
        self.found.push(Mutant { name: "reach shorter than the way", plan, scene: Some(scene), expected });
    }
}

fn promises(plan: &mut Plan) -> Option<&mut TrackingPromises> {
    plan.promises.tracking.as_mut()
}

pub(super) fn turn(pose: &mut PoseData, angle: f64, rng: &mut Rng) {
    let turned = Pose::rotation(Vector::from(rng.direction()) * angle).rotation * Pose::from(&*pose).rotation;
    let mut rotated = Pose::from(&*pose);
    rotated.rotation = turned;
    *pose = PoseData::from(&rotated);
}

fn is_all(segment: &Segment, f: usize, mode: ContactMode) -> bool {
    segment.kind == SegmentKind::Tracking && segment.waypoints.iter().all(|w| w.contacts[f].mode == mode)
}

/// True when finger `f` clearly does it in the segment: by its stated velocity, which a good plan has right, and by its
/// turns from waypoint to waypoint.
fn does_it(model: &CheckedHand, segment: &Segment, f: usize, does: Does, slip_tolerance: f64) -> bool {
    let seen = |waypoint: &Waypoint| {
        let link = regrasp_plan::check::kinematics::pose_of(&model.fingers[f].path.world_from_link(&waypoint.joints));
        Pose::from(&waypoint.world_from_object).rotation.inverse() * link.rotation
    };
    // Least turn that no tolerance covers, in radians.
    const CLEARLY: f64 = 0.01;
    let amount = |pair: &[Waypoint]| {
        let state = &pair[0].contacts[f];
        let turn = (seen(&pair[1]) * seen(&pair[0]).inverse()).scaled_axis();
        let normal = state.normal_in_object.map_or(Vector::zeros(), Vector::from);
        let about = turn.dot(&normal);
        match does {
            Does::Slide => {
                let speed = state.relative_velocity_in_object.map_or(0.0, |velocity| Vector::from(velocity).norm());
                speed * (pair[1].time - pair[0].time) / slip_tolerance * CLEARLY
            }
            Does::Turn => turn.norm(),
            Does::Twist => about.abs(),
            Does::Roll => (turn - normal * about).norm(),
            Does::Anything => 1.0,
        }
    };
    segment.waypoints.windows(2).map(amount).sum::<f64>() > 2.0 * CLEARLY
}

/// Inner waypoints of tracking segments and fingers, of which one is drawn.
///
/// `is_meant` says which fingers of a segment are asked about; `fits`, which of their contacts.
fn pick_inner(
    plan: &Plan,
    model: &CheckedHand,
    rng: &mut Rng,
    is_meant: impl Fn(&Segment, usize) -> bool,
    fits: impl Fn(&ContactState) -> bool,
) -> Option<(usize, usize, usize)> {
    let mut found = Vec::new();
    for (s, segment) in plan.segments.iter().enumerate().filter(|(_, segment)| segment.kind == SegmentKind::Tracking) {
        for f in (0..model.fingers.len()).filter(|&f| is_meant(segment, f)) {
            let inner = 1..segment.waypoints.len() - 1;
            found.extend(inner.filter(|&w| fits(&segment.waypoints[w].contacts[f])).map(|w| (s, w, f)));
        }
    }
    pick(&mut found, rng).copied()
}

/// An inner waypoint of a tracking segment and a finger whose contact there fits.
fn pick_tracked(
    plan: &Plan,
    model: &CheckedHand,
    rng: &mut Rng,
    fits: impl Fn(&ContactState) -> bool,
) -> Option<(usize, usize, usize)> {
    pick_inner(plan, model, rng, |_, _| true, fits)
}

/// As [`pick_tracked`], a moving finger.
fn pick_moving(
    plan: &Plan,
    model: &CheckedHand,
    rng: &mut Rng,
    fits: impl Fn(&ContactState) -> bool,
) -> Option<(usize, usize, usize)> {
    pick_inner(plan, model, rng, |segment, f| may_move(model, segment, f), fits)
}

/// Gives a contact that fits another relative velocity, by the one that it has and the normal.
fn change_velocity(
    plan: &mut Plan,
    model: &CheckedHand,
    rng: &mut Rng,
    fits: impl Fn(&ContactState) -> bool,
    change: impl Fn(Vector, &Vector) -> Vector,
) -> Option<()> {
    let (s, w, f) = pick_tracked(plan, model, rng, fits)?;
    let contact = &mut plan.segments[s].waypoints[w].contacts[f];
    let normal = contact_of(contact)?.normal_in_object.into_inner();
    let velocity = contact.relative_velocity_in_object.as_mut()?;
    *velocity = change(Vector::from(*velocity), &normal).into();
    Some(())
}

/// Gives a contact that turns another relative turn.
fn change_turn(plan: &mut Plan, model: &CheckedHand, rng: &mut Rng, change: impl Fn(Vector) -> Vector) -> Option<()> {
    let turns =
        |contact: &ContactState| contact.relative_turn_in_object.is_some_and(|turn| Vector::from(turn).norm() > 1e-2);
    let (s, w, f) = pick_tracked(plan, model, rng, turns)?;
    let turn = plan.segments[s].waypoints[w].contacts[f].relative_turn_in_object.as_mut()?;
    *turn = change(Vector::from(*turn)).into();
    Some(())
}

/// Gives a fingertip that slides another force across the normal.
fn change_friction(
    plan: &mut Plan,
    model: &CheckedHand,
    rng: &mut Rng,
    change: impl Fn(Vector, &Vector) -> Vector,
) -> Option<()> {
    let (s, w, f) = pick_tracked(plan, model, rng, |contact| contact.mode.slides())?;
    let contact = &mut plan.segments[s].waypoints[w].contacts[f];
    let normal = contact_of(contact)?.normal_in_object.into_inner();
    let force = Vector::from(contact.force_in_object?);
    let friction = force - normal * normal.dot(&force);
    contact.force_in_object = Some((force - friction + change(friction, &normal)).into());
    (friction.norm() > 1e-3).then_some(())
}
