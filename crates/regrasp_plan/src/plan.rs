//! The plan and its parts. `docs/reference/plan-format.md` and `schema/plan.schema.json` say the same.
//!
//! Between two waypoints every joint follows the cubic through positions, velocities and times. The object's pose moves as
//! `interpolate_pose` says, with the joints' progress along their chord as its parameter. Contact forces are linear in that
//! parameter, in the object frame. Between two segments everything rests while forces change.

use regrasp_geometry::Pose;
use regrasp_grasp::list::GraspList;
pub use regrasp_grasp::record::{PlanInput, PoseData};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Value of [`Plan::format`].
pub const FORMAT: &str = "regrasp-plan";
/// Value of [`Plan::format_version`] that this version writes.
pub const FORMAT_VERSION: u32 = 3;
/// Hand and object of plans that name none: those of format version 2, and of scenes with one of each.
pub const ONLY_HAND: &str = "hand";

/// What a finger does at a waypoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum ContactMode {
    /// Holds the object; the contact is fixed on the object.
    Fixed,
    /// Holds the object; the contact travels because the fingertip rolls without slipping. It may twist about the normal
    /// (Cherif 1999, table 1: rolling without sliding).
    Rolling,
    /// As rolling, without twisting about the normal (Cherif 1999, table 1: pure rolling). In tracking only.
    PureRolling,
    /// Holds the object at a contact that stays on both, and twists about the normal there (Cherif 1999, table 1: pure
    /// twisting). In tracking only.
    Twisting,
    /// Slides over the object and does not turn relative to it (Cherif 1999, table 1: pure sliding). In tracking only.
    PureSliding,
    /// Slides over the object, and may roll and twist (Cherif 1999, table 1: sliding). In tracking only.
    Sliding,
    /// Does not touch the object.
    Free,
}

impl ContactMode {
    /// True where the fingertip slides: friction then has its full size and opposes the sliding.
    pub fn slides(self) -> bool {
        matches!(self, ContactMode::PureSliding | ContactMode::Sliding)
    }
}

/// Contact of one finger at one waypoint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactState {
    /// What the finger does.
    pub mode: ContactMode,
    /// Contact point in the object frame, in metres; absent when the finger is free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_in_object: Option<[f64; 3]>,
    /// Outward normal of the object there, in the object frame; absent when the finger is free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_in_object: Option<[f64; 3]>,
    /// Force of the finger on the object, in newtons, in the object frame; absent when the finger is free, and in plans
    /// without forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_in_object: Option<[f64; 3]>,
    /// Moment of the finger on the object about the outward normal, in newton metres; absent: zero. Only soft fingers exert
    /// any; it is absent where the force is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion: Option<f64>,
    /// Contact point at this waypoint in the frame of the fingertip's link, in metres. In tracking, where it is part of what is
    /// planned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_in_tip: Option<[f64; 3]>,
    /// Velocity of the fingertip's material point that touches, seen from the object, without its part along the normal, in
    /// the object frame, in metres per second: its mean over the way from this waypoint to the next, at the last one over
    /// that to it; zero where the mode does not slide. In tracking.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_velocity_in_object: Option<[f64; 3]>,
    /// Angular velocity of the fingertip's link seen from the object, in the object frame, in radians per second: the rotation
    /// vector of the same way over its time; zero where the mode does not turn. In tracking.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_turn_in_object: Option<[f64; 3]>,
}

impl ContactState {
    /// The contact of a finger that does not touch the object.
    pub const FREE: ContactState = ContactState {
        mode: ContactMode::Free,
        point_in_object: None,
        normal_in_object: None,
        force_in_object: None,
        torsion: None,
        point_in_tip: None,
        relative_velocity_in_object: None,
        relative_turn_in_object: None,
    };

    /// A contact at a point with this outward normal, both in the object frame, without a force.
    pub fn at(mode: ContactMode, point_in_object: [f64; 3], normal_in_object: [f64; 3]) -> Self {
        ContactState {
            mode,
            point_in_object: Some(point_in_object),
            normal_in_object: Some(normal_in_object),
            ..ContactState::FREE
        }
    }

    /// True when the finger holds the object, at a fixed contact or rolling.
    pub fn holds(&self) -> bool {
        self.mode != ContactMode::Free
    }
}

/// The state of hand and object at one moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// When, in seconds from the start.
    pub time: f64,
    /// Positions of all joints, in the order of [`Plan::joint_names`], in radians or metres.
    pub joints: Vec<f64>,
    /// Velocities of all joints, in radians or metres per second; zero at both ends of every segment.
    pub joint_velocities: Vec<f64>,
    /// Torques, or forces of sliding joints, with which the joints make the contact forces; empty in plans without forces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_torques: Vec<f64>,
    /// Pose of the object in the world.
    pub world_from_object: PoseData,
    /// One entry per finger, in the order of [`Plan::fingers`].
    pub contacts: Vec<ContactState>,
}

impl Waypoint {
    /// Every number of the waypoint.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let joints = self.joints.iter().chain(&self.joint_velocities).chain(&self.joint_torques).copied();
        let of_contact = |contact: &ContactState| {
            let vectors = [
                contact.point_in_object,
                contact.normal_in_object,
                contact.force_in_object,
                contact.point_in_tip,
                contact.relative_velocity_in_object,
                contact.relative_turn_in_object,
            ];
            vectors.into_iter().flatten().flatten().chain(contact.torsion)
        };
        let contacts = self.contacts.iter().flat_map(of_contact);
        std::iter::once(self.time).chain(joints).chain(self.world_from_object.numbers()).chain(contacts)
    }
}

/// Kind of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum SegmentKind {
    /// The object moves; every finger holds all along, at one contact or rolling, or is free all along (Saut 2011, section
    /// 3.1: in GS_k k fingers hold and the others are independent; Sahbani 2007, sec. IV-C: rolling).
    Transfer,
    /// The object stays and one finger moves: to another contact, away from one to stay free, from free to a contact, or
    /// from one free posture to another. The others rest, those that hold and those that are free.
    Regrasp,
    /// The object moves or rests, every finger touches it all along, and some fingers move, of four in the paper one (Cherif 1999,
    /// sec. 3.1: finger tracking). Of the others, which rest, one rolls without sliding, and all may roll, slide and twist as the object moves.
    Tracking,
}

/// A piece of motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Its kind.
    pub kind: SegmentKind,
    /// The finger that moves, in a regrasp and in tracking; of several the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moving_finger: Option<String>,
    /// In tracking, other fingers that move at the same time, where there are some.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also_moving: Vec<String>,
    /// Who holds the object: names of hands and supports of the scene.
    #[serde(skip)]
    pub held_by: Vec<String>,
    /// In tracking, the resting finger that the object rolls on without sliding (Cherif 1999, sec. 6.1.2: `F_t`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rolling_finger: Option<String>,
    /// At least two; the first is the last of the segment before, but for time and forces: the finger that is about to lift
    /// has none left, one that has landed none yet.
    pub waypoints: Vec<Waypoint>,
}

impl Segment {
    /// A transfer along `waypoints`.
    pub fn transfer(waypoints: Vec<Waypoint>) -> Self {
        let (moving_finger, rolling_finger) = (None, None);
        let (also_moving, held_by) = (Vec::new(), Vec::new());
        Segment { kind: SegmentKind::Transfer, moving_finger, also_moving, held_by, rolling_finger, waypoints }
    }

    /// Names of all fingers that it says move.
    pub fn moving_fingers(&self) -> impl Iterator<Item = &String> {
        self.moving_finger.iter().chain(&self.also_moving)
    }
}

/// Relocations among `segments`: how often a finger lands on a contact. The one definition, for statistics, tables, page and
/// charts. A finger that lifts off and stays free is none. `fingers` are named in the order of the contacts.
pub fn relocations(fingers: &[String], segments: &[Segment]) -> u64 {
    let lands = |segment: &&Segment| {
        let moving = segment.moving_finger.as_ref().and_then(|name| fingers.iter().position(|finger| finger == name));
        let last = segment.waypoints.last().zip(moving).and_then(|(waypoint, finger)| waypoint.contacts.get(finger));
        segment.kind == SegmentKind::Regrasp && last.is_some_and(ContactState::holds)
    };
    segments.iter().filter(lands).count() as u64
}

/// A pose that the object has to pass between start and goal, and when it does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct WayPose {
    /// The pose asked for.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub world_from_object: PoseData,
    /// Index of the segment in which it is passed, from 0.
    pub segment: usize,
    /// Index of the waypoint of that segment at which it is passed, from 0.
    pub waypoint: usize,
}

/// A query that no scene file has: what a session was asked, from where hand and object really were. Hand, object, limits and all
/// else are the scene's; a plan can only say where it was to begin and to end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// Pose of the object at the start.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub start: PoseData,
    /// Pose of the object at the goal.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub goal: PoseData,
    /// Positions of all joints of the hand at the start, in radians or metres.
    pub joints: Vec<f64>,
    /// Names of the fingers that are free at the start. The others hold.
    pub free: Vec<String>,
}

impl Asked {
    /// Every number of the query.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.start.numbers().chain(self.goal.numbers()).chain(self.joints.iter().copied())
    }
}

/// What the plan promises; the checker holds it to these numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, ts(optional_fields))]
pub struct Promises {
    /// Largest distance of a holding fingertip from its contact at and between waypoints, in metres.
    pub contact_tolerance: f64,
    /// Friction coefficient that closure and forces count on: the scene's over `friction_margin`.
    pub friction: f64,
    /// What the scene's friction coefficient was divided by; at least 1.
    pub friction_margin: f64,
    /// Closure margin that every holding set keeps (see `regrasp_grasp::margin`); dimensionless.
    pub required_margin: f64,
    /// Smallest margin that the planner found at the waypoints: a lower bound of the Ferrari-Canny radius.
    pub kept_margin: f64,
    /// Length by which torques are divided in the margin, in metres.
    pub torque_scale: f64,
    /// How far a rolling fingertip slips at most over the object in one segment, in metres.
    pub slip_tolerance: f64,
    /// What tracking promises beside; absent in plans of in-hand tasks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracking: Option<TrackingPromises>,
    /// Limits of the motion in time.
    pub motion: MotionLimits,
    /// What the contact forces balance, and their limits; absent in plans without forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forces: Option<ForcePromises>,
}

impl Promises {
    /// Every number of the promises.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let scalars = [
            self.contact_tolerance,
            self.friction,
            self.friction_margin,
            self.required_margin,
            self.kept_margin,
            self.torque_scale,
            self.slip_tolerance,
            self.motion.largest_speed,
        ];
        let motion = self.motion.joint_velocities.iter().chain(&self.motion.joint_accelerations).copied();
        let of_forces = |forces: &'_ ForcePromises| {
            let scalars = [forces.mass, forces.normal_force[0], forces.normal_force[1]].into_iter();
            let limits = forces.joint_torques.iter().flatten().copied();
            scalars.chain(forces.gravity_in_world.into_iter().flatten()).chain(limits).collect::<Vec<f64>>()
        };
        let of_tracking = |tracking: &TrackingPromises| [tracking.goal_tolerance, tracking.sliding_friction];
        let tracking = self.tracking.iter().flat_map(of_tracking);
        scalars.into_iter().chain(motion).chain(tracking).chain(self.forces.iter().flat_map(of_forces))
    }
}

/// What a tracking plan promises beside. The goal of such a task is an orientation; where the object then is, is not asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct TrackingPromises {
    /// Largest angle between the object's last orientation and the goal's, in radians (Cherif 1999, sec. 5: within a cell).
    pub goal_tolerance: f64,
    /// Friction coefficient of fingertips that slide: the scene's, as friction then has its full size.
    pub sliding_friction: f64,
}

/// Limits of the motion in time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct MotionLimits {
    /// Largest speed of a fingertip's centre, or of a point of the object no farther from its centre of mass than
    /// `torque_scale`, between two waypoints on average, in metres per second: slow enough to be quasi-static.
    pub largest_speed: f64,
    /// Largest velocity of each joint, in radians or metres per second: the robot's, or what the settings say where it has
    /// none.
    pub joint_velocities: Vec<f64>,
    /// Largest acceleration of each joint, as differences of velocities between waypoints, in radians or metres per second
    /// squared.
    pub joint_accelerations: Vec<f64>,
}

/// What the contact forces balance, and their limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, ts(optional_fields))]
pub struct ForcePromises {
    /// Mass of the object, in kilograms.
    pub mass: f64,
    /// Gravity in the world, in metres per second squared; absent when the grasp holds whatever its direction: forces then
    /// balance no weight, and leave room for that of every direction (`docs/reference/plan-format.md`, forces).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity_in_world: Option<[f64; 3]>,
    /// Least and largest normal force of a finger that holds, in newtons.
    pub normal_force: [f64; 2],
    /// Largest torque of each joint, in newton metres or newtons: the share of the robot's effort limit that the settings
    /// allow; absent for joints without a limit.
    pub joint_torques: Vec<Option<f64>>,
}

/// Counts of the search.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(test, ts(optional_fields))]
pub struct Statistics {
    /// Nodes of the roadmap or tree when the search ended; in tracking, cells that sub-goals are in.
    pub nodes: u64,
    /// Configurations sampled; in tracking, sub-goals that the local planner tried to reach.
    pub samples: u64,
    /// Configurations looked at (kinematics and collision): the unit of the work budget.
    pub work: u64,
    /// Restarts used.
    pub restarts: u64,
    /// Transfers in the plan; in tracking, sub-goals on its path.
    pub transfers: u64,
    /// Transfers in the plan during which some finger is free.
    pub transfers_with_free_fingers: u64,
    /// Relocations in the plan: how often a finger lands on a contact ([`relocations`]).
    pub relocations: u64,
    /// True when a wall-clock limit cut something, so that another machine may find another plan.
    pub cut_by_time: bool,
    /// Attempts that failed, by cause.
    pub failures: BTreeMap<String, u64>,
    /// What became of the first plan; absent where none was asked to be improved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub improvement: Option<Box<Improvement>>,
}

/// Looking for a better plan after the first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct Improvement {
    /// The first plan.
    pub first: PlanFigures,
    /// The plan in this file.
    pub improved: PlanFigures,
    /// What no plan for the query costs less than.
    pub lower_bound: f64,
    /// Searches begun.
    pub rounds: u64,
    /// Configurations looked at, part of the statistics' `work`.
    pub work: u64,
}

/// What a plan costs, and why.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct PlanFigures {
    /// Relocations: how often a finger lands on a contact ([`relocations`]).
    pub relocations: u64,
    /// Transfers.
    pub transfers: u64,
    /// How far the object goes, in metres; angles count with the object's radius about its centre of mass.
    pub object_path: f64,
    /// How far the joints go, all together, in radians or metres.
    pub joint_path: f64,
    /// Closure margin kept, as promised.
    pub kept_margin: f64,
    /// Cost by the weights in the settings.
    pub cost: f64,
}

/// A plan: how a hand takes an object from start to goal. All else of the scene rests meanwhile.
///
/// [`crate::format`] reads and writes plan files. Serde alone gives the shape of format version 2, which names no task, hand, object
/// or holder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Always `regrasp-plan`.
    pub format: String,
    /// Version of the format.
    pub format_version: u32,
    /// Tool and version that wrote it.
    pub tool: String,
    /// Kind of task: `in_hand` or `tracking`.
    pub task: String,
    /// Name of the task in the scene file; empty where the file has only one.
    #[serde(skip)]
    pub query: String,
    /// Name of the hand that moves the object.
    #[serde(skip)]
    pub hand: String,
    /// Name of the object that is moved; empty in plans of format version 2, which name none.
    #[serde(skip)]
    pub object: String,
    /// Method that planned it.
    pub method: String,
    /// Seed.
    pub seed: u64,
    /// Settings of the planner, as they were used.
    pub settings: serde_json::Value,
    /// Files it was made from, the scene file first.
    pub inputs: Vec<PlanInput>,
    /// What it promises.
    pub promises: Promises,
    /// Names of the joints, in the order of every joint vector.
    pub joint_names: Vec<String>,
    /// Joints of the hand that the plan does not move, and the position of each all along, in radians or metres: independent joints that
    /// belong to no finger. Joints that follow others are not among them, nor joints of a robot that carries the hand.
    #[serde(skip)]
    pub held_joints: BTreeMap<String, f64>,
    /// Names of the fingers, in the order of every contact list.
    pub fingers: Vec<String>,
    /// Object pose asked for at the start.
    pub start: PoseData,
    /// The query, where the scene file does not have it; see [`Asked`].
    #[serde(skip)]
    pub asked: Option<Box<Asked>>,
    /// Poses asked for between start and goal, in order; absent where none were.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub way_poses: Vec<WayPose>,
    /// Object pose asked for at the goal.
    pub goal: PoseData,
    /// The motion, in order; never empty.
    pub segments: Vec<Segment>,
    /// Counts of the search.
    pub statistics: Statistics,
}

impl Plan {
    /// A grasp list as one segment of waypoints, which promises no forces. It is no plan that anybody could carry out: what judges and
    /// writes plans does the same with lists so.
    pub fn of_grasps(list: &GraspList, waypoints: Vec<Waypoint>) -> Plan {
        let promises = &list.promises;
        let n_joints = list.hand.joint_names.len();
        let identity = PoseData::from(&Pose::identity());
        Plan {
            format: list.format.clone(),
            format_version: list.format_version,
            tool: list.tool.clone(),
            task: String::new(),
            query: String::new(),
            hand: list.hand.name.clone(),
            object: list.object.name.clone(),
            method: String::new(),
            seed: list.seed,
            settings: serde_json::Value::Null,
            inputs: list.inputs.clone(),
            promises: Promises {
                contact_tolerance: promises.contact_tolerance,
                friction: promises.friction,
                friction_margin: promises.friction_margin,
                required_margin: promises.required_margin,
                kept_margin: promises.required_margin,
                torque_scale: promises.torque_scale,
                slip_tolerance: 0.0,
                tracking: None,
                motion: MotionLimits {
                    largest_speed: 1.0,
                    joint_velocities: vec![1.0; n_joints],
                    joint_accelerations: vec![1.0; n_joints],
                },
                forces: None,
            },
            joint_names: list.hand.joint_names.clone(),
            held_joints: list.hand.held_joints.clone(),
            fingers: list.hand.fingers.clone(),
            start: identity,
            way_poses: Vec::new(),
            goal: identity,
            asked: None,
            segments: vec![Segment::transfer(waypoints)],
            statistics: Statistics::default(),
        }
    }

    /// How often a finger lands on a contact ([`relocations`]), counted from the segments.
    pub fn n_relocations(&self) -> u64 {
        relocations(&self.fingers, &self.segments)
    }
}
