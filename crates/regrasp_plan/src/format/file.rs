//! The plan file of version 3 as it stands on disk. `docs/reference/plan-format.md` and `schema/plan.schema.json` say the same.
//!
//! The file has room for several hands and objects. This version plans for one hand and one object at a time: [`FilePlan::plan`]
//! refuses files with more.

use super::caps;
use crate::each_once;
use crate::plan::{
    Asked, ContactMode, ContactState, Plan, PlanInput, PoseData, Promises, Segment, SegmentKind, Statistics, WayPose,
    Waypoint,
};
use regrasp_base::json_place::PathStep;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A hand of the scene that the plan moves.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub(super) struct FileHand<'a> {
    /// Its name in the scene.
    pub name: Cow<'a, str>,
    /// Names of its fingers.
    pub fingers: Cow<'a, [String]>,
    /// Names of its joints, in the order of every joint vector.
    pub joint_names: Cow<'a, [String]>,
    /// Its joints that the plan does not move, and where each of them stands all along, in radians or metres: independent joints that belong
    /// to no finger. Absent where there are none, and where a robot carries the hand.
    #[serde(default, skip_serializing_if = "is_empty", deserialize_with = "positions_each_once")]
    #[cfg_attr(test, ts(optional, as = "Option<BTreeMap<String, f64>>"))]
    pub held_joints: Cow<'a, BTreeMap<String, f64>>,
}

fn is_empty(positions: &BTreeMap<String, f64>) -> bool {
    positions.is_empty()
}

/// Positions by the names of joints.
fn positions_each_once<'de, 'a, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Cow<'a, BTreeMap<String, f64>>, D::Error> {
    each_once::positions(deserializer).map(Cow::Owned)
}

/// A finger that touches an object.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, ts(optional_fields))]
pub(super) struct FileContact<'a> {
    /// The hand.
    pub hand: Cow<'a, str>,
    /// The finger of that hand.
    pub finger: Cow<'a, str>,
    /// The object that it touches.
    pub object: Cow<'a, str>,
    /// What the finger does; never `free`: free fingers have no entry.
    pub mode: ContactMode,
    /// Contact point in the object frame, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_in_object: Option<[f64; 3]>,
    /// Outward normal of the object there, in the object frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_in_object: Option<[f64; 3]>,
    /// Force of the finger on the object, in newtons, in the object frame; absent in plans without forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_in_object: Option<[f64; 3]>,
    /// Moment of the finger on the object about the outward normal, in newton metres; absent: zero. Soft fingers only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion: Option<f64>,
    /// Contact point in the frame of the fingertip's link, in metres. In tracking.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_in_tip: Option<[f64; 3]>,
    /// Velocity of the fingertip's material point that touches, seen from the object and across the normal, in the object
    /// frame, in metres per second: its mean over the way to the next waypoint. In tracking.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_velocity_in_object: Option<[f64; 3]>,
    /// Angular velocity of the fingertip's link seen from the object, in the object frame, in radians per second. In tracking.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_turn_in_object: Option<[f64; 3]>,
}

/// The state of hands and objects at one moment.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub(super) struct FileWaypoint<'a> {
    /// When, in seconds from the start.
    pub time: f64,
    /// Positions of all joints, hand by hand, in radians or metres.
    pub joints: Cow<'a, [f64]>,
    /// Velocities of all joints, in radians or metres per second; zero at both ends of every segment.
    pub joint_velocities: Cow<'a, [f64]>,
    /// Torques, or forces of sliding joints, with which the joints make the contact forces; absent in plans without forces.
    #[serde(default, skip_serializing_if = "<[f64]>::is_empty")]
    pub joint_torques: Cow<'a, [f64]>,
    /// Pose of every object of `objects`, in the world.
    #[cfg_attr(test, ts(type = "PoseData[]"))]
    pub world_from_objects: Vec<PoseData>,
    /// Fingers that touch an object, hand by hand in the order of their fingers.
    pub contacts: Vec<FileContact<'a>>,
}

/// For every object, who holds it.
type Holders<'a> = BTreeMap<Cow<'a, str>, Vec<Cow<'a, str>>>;

/// A piece of motion.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub(super) struct FileSegment<'a> {
    /// Its kind.
    pub kind: SegmentKind,
    /// The hand that moves its fingers.
    pub hand: Cow<'a, str>,
    /// In a regrasp the finger that moves, in tracking all that move; absent in transfers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moving: Vec<Cow<'a, str>>,
    /// In tracking, the resting finger that the object rolls on without sliding (Cherif & Gupta 1999, sec. 6.1.2: `F_t`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub rolling_finger: Option<Cow<'a, str>>,
    /// For every object, who holds it: names of hands and supports.
    #[serde(deserialize_with = "each_once::holders")]
    pub held_by: Holders<'a>,
    /// At least two; the first is the last of the segment before, but for time and forces.
    pub waypoints: Vec<FileWaypoint<'a>>,
}

/// A plan file.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub(super) struct FilePlan<'a> {
    /// Always `regrasp-plan`.
    pub format: Cow<'a, str>,
    /// Version of the format.
    pub format_version: u32,
    /// Tool and version that wrote it.
    pub tool: Cow<'a, str>,
    /// Kind of task: `in_hand` or `tracking`.
    pub task: Cow<'a, str>,
    /// Name of the task in the scene file; absent where the file has only one.
    #[serde(default, skip_serializing_if = "str::is_empty")]
    pub query: Cow<'a, str>,
    /// Method that planned it.
    pub method: Cow<'a, str>,
    /// Seed.
    pub seed: u64,
    /// Settings of the planner, as they were used.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub settings: Cow<'a, serde_json::Value>,
    /// Files it was made from, the scene file first.
    #[cfg_attr(test, ts(type = "PlanInput[]"))]
    pub inputs: Cow<'a, [PlanInput]>,
    /// What it promises.
    pub promises: Cow<'a, Promises>,
    /// The hands that it moves. All others of the scene rest.
    pub hands: Vec<FileHand<'a>>,
    /// Names of the objects that it moves. All others of the scene rest.
    pub objects: Vec<Cow<'a, str>>,
    /// Pose of the object asked for at the start.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub start: PoseData,
    /// The query, where the scene file does not have it: that of a session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub asked: Option<Cow<'a, Asked>>,
    /// Poses asked for between start and goal, in order; absent where none were.
    #[serde(default, skip_serializing_if = "<[WayPose]>::is_empty")]
    pub way_poses: Cow<'a, [WayPose]>,
    /// Pose of the object asked for at the goal.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub goal: PoseData,
    /// Counts of the search.
    pub statistics: Cow<'a, Statistics>,
    /// The motion, in order; never empty.
    pub segments: Vec<FileSegment<'a>>,
}

/// What is wrong with a file that serde has read.
pub(super) struct Fault {
    /// Code of the error.
    pub code: &'static str,
    /// Where.
    pub at: Vec<PathStep<'static>>,
    /// What.
    pub problem: String,
    /// What was expected.
    pub expected: String,
}

impl<'a> FileWaypoint<'a> {
    /// Of a waypoint of `plan`.
    pub fn of(plan: &'a Plan, waypoint: &'a Waypoint) -> Self {
        let contact = |(finger, state): (&'a String, &'a ContactState)| FileContact {
            hand: Cow::Borrowed(&plan.hand),
            finger: Cow::Borrowed(finger),
            object: Cow::Borrowed(&plan.object),
            mode: state.mode,
            point_in_object: state.point_in_object,
            normal_in_object: state.normal_in_object,
            force_in_object: state.force_in_object,
            torsion: state.torsion,
            point_in_tip: state.point_in_tip,
            relative_velocity_in_object: state.relative_velocity_in_object,
            relative_turn_in_object: state.relative_turn_in_object,
        };
        let touching = plan.fingers.iter().zip(&waypoint.contacts).filter(|(_, state)| **state != ContactState::FREE);
        FileWaypoint {
            time: waypoint.time,
            joints: Cow::Borrowed(&waypoint.joints),
            joint_velocities: Cow::Borrowed(&waypoint.joint_velocities),
            joint_torques: Cow::Borrowed(&waypoint.joint_torques),
            world_from_objects: vec![waypoint.world_from_object],
            contacts: touching.map(contact).collect(),
        }
    }

    /// As a waypoint of a plan of one hand and one object.
    fn waypoint(self, names: &Names, at: [PathStep<'static>; 4]) -> Result<Waypoint, Fault> {
        let [world_from_object] = self.world_from_objects[..] else {
            let problem = format!("has {} poses", self.world_from_objects.len());
            return Err(fault(
                "C404",
                &at,
                &[PathStep::Key("world_from_objects")],
                problem,
                "one for each of \"objects\"",
            ));
        };
        let mut contacts = vec![ContactState::FREE; names.fingers.len()];
        let mut next = 0;
        for (index, contact) in self.contacts.into_iter().enumerate() {
            let step = |key| [PathStep::Key("contacts"), PathStep::Index(index), PathStep::Key(key)];
            names.expect_hand(&contact.hand).map_err(|name| unknown(&at, &step("hand"), &contact.hand, name))?;
            names
                .expect_object(&contact.object)
                .map_err(|name| unknown(&at, &step("object"), &contact.object, name))?;
            let Some(finger) = names.fingers.iter().position(|finger| *finger == contact.finger) else {
                return Err(unknown(&at, &step("finger"), &contact.finger, &names.fingers.join(", ")));
            };
            if finger < next {
                let problem = format!("\"{}\" stands after a finger that comes later", contact.finger);
                let expected = "each finger once, in the order of \"fingers\"";
                return Err(fault("C408", &at, &step("finger"), problem, expected));
            }
            next = finger + 1;
            if contact.mode == ContactMode::Free {
                let problem = "is free, but has an entry".to_owned();
                return Err(fault("C407", &at, &step("mode"), problem, "no entry for a finger that touches nothing"));
            }
            contacts[finger] = ContactState {
                mode: contact.mode,
                point_in_object: contact.point_in_object,
                normal_in_object: contact.normal_in_object,
                force_in_object: contact.force_in_object,
                torsion: contact.torsion,
                point_in_tip: contact.point_in_tip,
                relative_velocity_in_object: contact.relative_velocity_in_object,
                relative_turn_in_object: contact.relative_turn_in_object,
            };
        }
        Ok(Waypoint {
            time: self.time,
            joints: self.joints.into_owned(),
            joint_velocities: self.joint_velocities.into_owned(),
            joint_torques: self.joint_torques.into_owned(),
            world_from_object,
            contacts,
        })
    }
}

fn fault(
    code: &'static str,
    at: &[PathStep<'static>],
    inside: &[PathStep<'static>],
    problem: String,
    expected: &str,
) -> Fault {
    Fault { code, at: [at, inside].concat(), problem, expected: expected.to_owned() }
}

fn unknown(at: &[PathStep<'static>], inside: &[PathStep<'static>], name: &str, known: &str) -> Fault {
    fault("C408", at, inside, format!("\"{name}\" is not in the plan"), known)
}

/// The names that a plan of one hand and one object knows.
struct Names {
    hand: String,
    object: String,
    fingers: Vec<String>,
}

impl Names {
    /// Err with the name that is known.
    fn expect_hand(&self, name: &str) -> Result<(), &str> {
        if name == self.hand { Ok(()) } else { Err(&self.hand) }
    }

    /// Err with the name that is known.
    fn expect_object(&self, name: &str) -> Result<(), &str> {
        if name == self.object { Ok(()) } else { Err(&self.object) }
    }
}

impl<'a> FileSegment<'a> {
    /// Of a segment of `plan`, without its waypoints.
    pub fn of(plan: &'a Plan, segment: &'a Segment) -> Self {
        let held_by = segment.held_by.iter().map(|name| Cow::Borrowed(name.as_str())).collect();
        FileSegment {
            kind: segment.kind,
            hand: Cow::Borrowed(&plan.hand),
            moving: segment.moving_fingers().map(|name| Cow::Borrowed(name.as_str())).collect(),
            rolling_finger: segment.rolling_finger.as_deref().map(Cow::Borrowed),
            held_by: BTreeMap::from([(Cow::Borrowed(plan.object.as_str()), held_by)]),
            waypoints: Vec::new(),
        }
    }

    fn segment(self, names: &Names, at: [PathStep<'static>; 2]) -> Result<Segment, Fault> {
        names.expect_hand(&self.hand).map_err(|name| unknown(&at, &[PathStep::Key("hand")], &self.hand, name))?;
        let mut held_by = Vec::new();
        for (object, holders) in self.held_by {
            names.expect_object(&object).map_err(|name| unknown(&at, &[PathStep::Key("held_by")], &object, name))?;
            held_by = holders.into_iter().map(Cow::into_owned).collect();
        }
        let mut moving = self.moving.into_iter().map(Cow::into_owned);
        let waypoints = self.waypoints.into_iter().enumerate().map(|(index, waypoint)| {
            waypoint.waypoint(names, [at[0], at[1], PathStep::Key("waypoints"), PathStep::Index(index)])
        });
        Ok(Segment {
            kind: self.kind,
            moving_finger: moving.next(),
            also_moving: moving.collect(),
            held_by,
            rolling_finger: self.rolling_finger.map(Cow::into_owned),
            waypoints: waypoints.collect::<Result<_, _>>()?,
        })
    }
}

impl FilePlan<'_> {
    /// The plan in it.
    ///
    /// Errors: not one hand and one object (`C411`), names that are not known or out of order (`C408`), a contact of a free finger
    /// (`C407`), lists that are too short or too long (`C404`), more fingers than any hand has (`C410`).
    pub fn plan(mut self) -> Result<Plan, Fault> {
        for (key, n) in [("hands", self.hands.len()), ("objects", self.objects.len())] {
            if n != 1 {
                let expected = "one; this version judges plans in which one hand moves one object and all else rests";
                return Err(fault("C411", &[], &[PathStep::Key(key)], format!("has {n} entries"), expected));
            }
        }
        let (hand, object) = (self.hands.remove(0), self.objects.remove(0).into_owned());
        // Every waypoint takes memory for every finger: the number of fingers is looked at before.
        if hand.fingers.len() > caps::FINGERS {
            let problem = format!("has {} entries", hand.fingers.len());
            let at = [PathStep::Key("hands"), PathStep::Index(0), PathStep::Key("fingers")];
            return Err(fault("C410", &at, &[], problem, &format!("at most {}", caps::FINGERS)));
        }
        let names = Names { hand: hand.name.into_owned(), object, fingers: hand.fingers.into_owned() };
        let segments = self.segments.into_iter().enumerate();
        let segments = segments
            .map(|(index, segment)| segment.segment(&names, [PathStep::Key("segments"), PathStep::Index(index)]));
        let segments = segments.collect::<Result<Vec<_>, _>>()?;
        Ok(Plan {
            format: self.format.into_owned(),
            format_version: self.format_version,
            tool: self.tool.into_owned(),
            task: self.task.into_owned(),
            query: self.query.into_owned(),
            hand: names.hand,
            object: names.object,
            method: self.method.into_owned(),
            seed: self.seed,
            settings: self.settings.into_owned(),
            inputs: self.inputs.into_owned(),
            promises: self.promises.into_owned(),
            joint_names: hand.joint_names.into_owned(),
            held_joints: hand.held_joints.into_owned(),
            fingers: names.fingers,
            start: self.start,
            asked: self.asked.map(|asked| Box::new(asked.into_owned())),
            way_poses: self.way_poses.into_owned(),
            goal: self.goal,
            segments,
            statistics: self.statistics.into_owned(),
        })
    }
}
