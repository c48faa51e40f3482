//! Plans of whole robots. `docs/reference/plan-format.md` and `schema/robot-plan.schema.json` say the same.
//!
//! Between two waypoints every joint follows the cubic through positions, velocities and times. An object that a hand holds follows
//! that hand: it keeps the pose in the frame of the hand's base that it has at the first waypoint of the segment.

use crate::each_once;
use crate::plan::{ContactMode, FORMAT, FORMAT_VERSION, PlanInput, PoseData, Promises};
use regrasp_robot::Manipulator;
use regrasp_robot::manipulator::layout::Coordinate;
use regrasp_scene::motion::MOTION;
use regrasp_scene::pick_and_place::PICK_AND_PLACE;
use regrasp_scene::{CarriedObject, Holder, MotionQuery, PickAndPlaceQuery, Scene, SceneHand};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Kind of a segment of a [`RobotPlan`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum RobotSegmentKind {
    /// The robot moves; no hand holds anything.
    Transit,
    /// The robot holds one or several objects. Each follows its hand. Also a moment of rest in which a holder joins or leaves.
    Carry,
    /// A hand comes to an object on the way of its grasp. Who holds the object rests.
    Approach,
    /// Fingers of one hand close until they touch the object; everything else rests. At the end the hand is ready to hold.
    Grasp,
    /// Fingers of one hand let go and open; everything else rests.
    Release,
    /// A hand leaves the object. Who holds the object rests.
    Retreat,
    /// The object moves in the one hand that holds it: as the kind of that name in plans of motions in the hand. All but the fingers of
    /// that hand rests.
    Transfer,
    /// The object stays and one finger of the one hand that holds it moves: as the kind of that name in plans of motions in the hand. All
    /// else rests.
    Regrasp,
}

/// A robot that the plan moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct PlanRobot {
    /// Its name in the scene.
    pub name: String,
    /// Names of all its independent joints, in the order of its layout: the order of every joint vector.
    pub joint_names: Vec<String>,
    /// Its joints that no plan moves, and where each of them stands all along, in radians or metres: `[held]` of the robot file. Absent
    /// where there are none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty", deserialize_with = "each_once::positions")]
    #[cfg_attr(test, ts(optional, as = "Option<BTreeMap<String, f64>>"))]
    pub held_joints: BTreeMap<String, f64>,
}

/// A hand that holds something or moves its fingers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct PlanHand {
    /// Its name in the scene; of an arm that holds without a hand the name of the arm.
    pub name: String,
    /// Names of its fingers; none for an arm without a hand.
    pub fingers: Vec<String>,
}

/// A finger that touches an object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, ts(optional_fields))]
pub struct RobotContact {
    /// The hand.
    pub hand: String,
    /// The finger of that hand.
    pub finger: String,
    /// The object that it touches.
    pub object: String,
    /// What the finger does; never `free`: free fingers have no entry.
    pub mode: ContactMode,
    /// Contact point in the object frame, in metres.
    pub point_in_object: [f64; 3],
    /// Outward normal of the object there, in the object frame.
    pub normal_in_object: [f64; 3],
    /// Force of the finger on the object, in newtons, in the object frame; absent in plans without forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_in_object: Option<[f64; 3]>,
    /// Moment of the finger on the object about the outward normal, in newton metres; absent: zero. Soft fingers only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion: Option<f64>,
}

/// The state of robots and objects at one moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, ts(optional_fields))]
pub struct RobotWaypoint {
    /// When, in seconds from the start.
    pub time: f64,
    /// Positions of all joints, robot by robot, in radians or metres.
    pub joints: Vec<f64>,
    /// Velocities of all joints, in radians or metres per second; zero at both ends of every segment.
    pub joint_velocities: Vec<f64>,
    /// Pose of every object of `objects`, in the world.
    #[cfg_attr(test, ts(type = "PoseData[]"))]
    pub world_from_objects: Vec<PoseData>,
    /// Fingers that touch an object, hand by hand in the order of their fingers. Absent where contacts are not planned.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(test, ts(optional, as = "Option<Vec<RobotContact>>"))]
    pub contacts: Vec<RobotContact>,
}

/// What a `transfer` or a `regrasp` says beside its waypoints.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, ts(optional_fields))]
pub struct InHandPart {
    /// The finger that moves, in a regrasp.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moving_finger: Option<String>,
    /// For every waypoint, torques of the joints of the hand with which they make the contact forces, in newton metres, or newtons of
    /// sliding joints.
    pub joint_torques: Vec<Vec<f64>>,
}

/// A piece of motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct RobotSegment {
    /// Its kind.
    pub kind: RobotSegmentKind,
    /// For every object of `objects`, who holds it: names of hands and supports.
    #[serde(deserialize_with = "each_once::holders")]
    pub held_by: BTreeMap<String, Vec<String>>,
    /// In a `transfer` or `regrasp`: which finger moves, and torques. Absent in all other kinds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_hand: Option<Box<InHandPart>>,
    /// At least two; the first is the last of the segment before, but for its time.
    pub waypoints: Vec<RobotWaypoint>,
}

/// What a plan of whole robots promises; the checker holds it to these numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct RobotPromises {
    /// Largest velocity of each joint, in radians or metres per second.
    pub joint_velocities: Vec<f64>,
    /// Largest acceleration of each joint, in radians or metres per second squared.
    pub joint_accelerations: Vec<f64>,
    /// Bodies that must not touch are at every moment at least this far apart, in metres; 0 where no more than no collision is
    /// promised.
    pub clearance: f64,
    /// What holds for all contacts; absent in plans without contacts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holding: Option<HoldingPromises>,
    /// What holds while an object moves in a hand, by the name of the hand: as in plans of motions in the hand. Absent in plans without
    /// such segments.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[cfg_attr(test, ts(optional, type = "{ [key in string]: Promises }"))]
    pub in_hand: BTreeMap<String, Promises>,
}

/// What a plan promises of the fingers that hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct HoldingPromises {
    /// Largest distance of a fingertip from its contact, in metres.
    pub contact_tolerance: f64,
    /// What the object's friction coefficient is divided by, at least 1: the quotient is what closure and forces count on.
    pub friction_margin: f64,
    /// Closure margin that every hand keeps by itself while it holds (see `regrasp_grasp::margin`); dimensionless.
    pub required_margin: f64,
    /// Length by which torques are divided in the margin, in metres.
    pub torque_scale: f64,
    /// Least and largest normal force of a contact, in newtons.
    pub normal_force: [f64; 2],
}

/// Counts of the search for a motion.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(default, deny_unknown_fields)]
pub struct RobotStatistics {
    /// Nodes of trees and roadmaps when the search ended.
    pub nodes: u64,
    /// Configurations sampled.
    pub samples: u64,
    /// Configurations looked at (kinematics and collision): the unit of the work budget.
    pub work: u64,
    /// True when a wall-clock limit cut something, so that another machine may find another plan.
    pub cut_by_time: bool,
    /// Further counts of the method, by name.
    pub counts: BTreeMap<String, u64>,
}

/// A plan of whole robots: how their joints move, and what they hold. All else of the scene rests meanwhile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, ts(optional_fields))]
pub struct RobotPlan {
    /// Always `regrasp-plan`.
    pub format: String,
    /// Version of the format.
    pub format_version: u32,
    /// Tool and version that wrote it.
    pub tool: String,
    /// Kind of task: `motion` or `pick_and_place`.
    pub task: String,
    /// Name of the task in the scene file; absent where the file has only one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    #[cfg_attr(test, ts(optional, as = "Option<String>"))]
    pub query: String,
    /// Method that planned it.
    pub method: String,
    /// Seed.
    pub seed: u64,
    /// Settings of the planner, as they were used.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub settings: serde_json::Value,
    /// Files it was made from, the scene file first.
    #[cfg_attr(test, ts(type = "PlanInput[]"))]
    pub inputs: Vec<PlanInput>,
    /// What it promises.
    pub promises: RobotPromises,
    /// The robots that the plan moves. This version: one.
    pub robots: Vec<PlanRobot>,
    /// The hands that hold something; empty in a plan in which nothing is held.
    pub hands: Vec<PlanHand>,
    /// Names of the objects that the plan moves, in the order of every `world_from_objects`.
    pub objects: Vec<String>,
    /// Counts of the search.
    pub statistics: RobotStatistics,
    /// The motion, in order; never empty.
    pub segments: Vec<RobotSegment>,
}

impl RobotPlan {
    /// A plan for `query` without segments: names, files, and promises that are the limits of robot and scene. The planner adds method,
    /// seed, settings, segments and statistics.
    pub fn answering(scene: &Scene, query: &MotionQuery) -> Self {
        let carried = query.carried.iter();
        let mut hands: Vec<PlanHand> = Vec::new();
        for holder in carried.clone().map(|carried| carried.holder) {
            let name = holder.name(scene, query.robot).to_owned();
            let fingers = match holder {
                Holder::Hand(hand) => scene.hands[hand].hand.fingers.iter().map(|f| f.name.clone()).collect(),
                Holder::Arm(_) => Vec::new(),
            };
            if hands.iter().all(|known| known.name != name) {
                hands.push(PlanHand { name, fingers });
            }
        }
        let objects = carried.map(|carried| scene.objects[carried.object].name.clone()).collect();
        RobotPlan { hands, objects, ..RobotPlan::of_task(scene, query.robot, MOTION, &query.name) }
    }

    /// A plan for a query of pick and place without segments, as [`RobotPlan::answering`]. It names every hand of the robot.
    pub fn answering_pick_and_place(scene: &Scene, query: &PickAndPlaceQuery) -> Self {
        let of_robot = |hand: &&SceneHand| hand.carrier.is_some_and(|carrier| carrier.robot == query.robot);
        let hand = |hand: &SceneHand| PlanHand {
            name: hand.name.clone(),
            fingers: hand.hand.fingers.iter().map(|finger| finger.name.clone()).collect(),
        };
        RobotPlan {
            hands: scene.hands.iter().filter(of_robot).map(hand).collect(),
            objects: vec![scene.objects[query.object].name.clone()],
            ..RobotPlan::of_task(scene, query.robot, PICK_AND_PLACE, &query.name)
        }
    }

    fn of_task(scene: &Scene, robot: usize, task: &str, query: &str) -> Self {
        let robot = &scene.robots[robot];
        let inputs = scene.inputs.iter();
        RobotPlan {
            format: FORMAT.into(),
            format_version: FORMAT_VERSION,
            tool: concat!("regrasp ", env!("CARGO_PKG_VERSION")).into(),
            task: task.into(),
            query: query.into(),
            method: String::new(),
            seed: 0,
            settings: serde_json::Value::Object(serde_json::Map::new()),
            inputs: inputs
                .map(|input| PlanInput {
                    role: input.role.clone(),
                    name: input.name.clone(),
                    sha256: input.sha256.clone(),
                })
                .collect(),
            promises: RobotPromises::of(scene, robot),
            robots: vec![PlanRobot {
                name: robot.name.clone(),
                joint_names: robot.layout.names(),
                held_joints: robot.held_joints.clone(),
            }],
            hands: Vec::new(),
            objects: Vec::new(),
            statistics: RobotStatistics::default(),
            segments: Vec::new(),
        }
    }

    /// Who holds what all through a plan for `query`.
    pub fn held_by(scene: &Scene, query: &MotionQuery) -> BTreeMap<String, Vec<String>> {
        let holder = |carried: &CarriedObject| {
            let object = scene.objects[carried.object].name.clone();
            (object, vec![carried.holder.name(scene, query.robot).to_owned()])
        };
        query.carried.iter().map(holder).collect()
    }

    /// Names of all joints, in the order of every joint vector.
    pub fn joint_names(&self) -> Vec<String> {
        self.robots.iter().flat_map(|robot| robot.joint_names.iter().cloned()).collect()
    }

    /// All waypoints, in order.
    pub fn waypoints(&self) -> impl DoubleEndedIterator<Item = &RobotWaypoint> {
        self.segments.iter().flat_map(|segment| &segment.waypoints)
    }

    /// Time from the first waypoint to the last, in seconds.
    pub fn duration(&self) -> f64 {
        let mut waypoints = self.waypoints();
        let first = waypoints.next().map_or(0.0, |waypoint| waypoint.time);
        waypoints.next_back().map_or(0.0, |last| last.time - first)
    }

    /// Every floating-point number of the plan.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let RobotPromises { joint_velocities, joint_accelerations, clearance, holding, in_hand } = &self.promises;
        let promises = joint_velocities.iter().chain(joint_accelerations).copied().chain([*clearance]);
        let of_holding = |holding: &HoldingPromises| {
            let scalars =
                [holding.contact_tolerance, holding.friction_margin, holding.required_margin, holding.torque_scale];
            scalars.into_iter().chain(holding.normal_force).collect::<Vec<f64>>()
        };
        let promises = promises.chain(holding.iter().flat_map(of_holding));
        let promises = promises.chain(in_hand.values().flat_map(Promises::numbers));
        let parts = self.segments.iter().filter_map(|segment| segment.in_hand.as_ref());
        let torques = parts.flat_map(|part| part.joint_torques.iter().flatten().copied());
        let held = self.robots.iter().flat_map(|robot| robot.held_joints.values().copied());
        promises.chain(torques).chain(held).chain(self.waypoints().flat_map(RobotWaypoint::numbers))
    }
}

impl RobotPromises {
    /// The largest velocities and accelerations that robot and scene allow, and no clearance.
    pub fn of(scene: &Scene, robot: &Manipulator) -> Self {
        let velocity = |coordinate: &Coordinate| {
            let limits = robot.robot.joints[coordinate.joint.0].limits;
            limits.and_then(|limits| limits.velocity).unwrap_or(scene.limits.joint_velocity)
        };
        let acceleration = |coordinate: &Coordinate| coordinate.acceleration.unwrap_or(scene.limits.joint_acceleration);
        RobotPromises {
            joint_velocities: robot.layout.coordinates.iter().map(velocity).collect(),
            joint_accelerations: robot.layout.coordinates.iter().map(acceleration).collect(),
            clearance: 0.0,
            holding: None,
            in_hand: BTreeMap::new(),
        }
    }
}

impl RobotSegmentKind {
    /// True where the object moves in a hand, or the hand changes its grasp: kinds of plans of motions in the hand.
    pub fn is_in_hand(self) -> bool {
        matches!(self, RobotSegmentKind::Transfer | RobotSegmentKind::Regrasp)
    }
}

impl RobotWaypoint {
    /// Every number of the waypoint.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let joints = self.joints.iter().chain(&self.joint_velocities).copied();
        let poses = self.world_from_objects.iter().flat_map(|pose| pose.numbers().collect::<Vec<f64>>());
        let of_contact = |contact: &RobotContact| {
            let vectors = [Some(contact.point_in_object), Some(contact.normal_in_object), contact.force_in_object];
            vectors.into_iter().flatten().flatten().chain(contact.torsion).collect::<Vec<f64>>()
        };
        std::iter::once(self.time).chain(joints).chain(poses).chain(self.contacts.iter().flat_map(of_contact))
    }
}
