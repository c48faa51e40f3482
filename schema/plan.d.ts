// Types of a plan file (docs/reference/plan-format.md). Generated from `regrasp_plan::format`: do not edit.
// REGRASP_WRITE_SCHEMA=1 cargo test -p regrasp_plan --lib writes it anew.

import type { PlanInput, PoseData } from "./record";

export type { PlanInput, PoseData };

/**
 * A query that no scene file has: what a session was asked, from where hand and object really were. Hand, object, limits and all
 * else are the scene's; a plan can only say where it was to begin and to end.
 */
export type Asked = {
  /** Pose of the object at the start. */
  start: PoseData,
  /** Pose of the object at the goal. */
  goal: PoseData,
  /** Positions of all joints of the hand at the start, in radians or metres. */
  joints: Array<number>,
  /** Names of the fingers that are free at the start. The others hold. */
  free: Array<string>,
};

/** What a finger does at a waypoint. */
export type ContactMode = "fixed" | "rolling" | "pure_rolling" | "twisting" | "pure_sliding" | "sliding" | "free";

/** A finger that touches an object. */
export type FileContact = {
  /** The hand. */
  hand: string,
  /** The finger of that hand. */
  finger: string,
  /** The object that it touches. */
  object: string,
  /** What the finger does; never `free`: free fingers have no entry. */
  mode: ContactMode,
  /** Contact point in the object frame, in metres. */
  point_in_object?: [number, number, number],
  /** Outward normal of the object there, in the object frame. */
  normal_in_object?: [number, number, number],
  /** Force of the finger on the object, in newtons, in the object frame; absent in plans without forces. */
  force_in_object?: [number, number, number],
  /** Moment of the finger on the object about the outward normal, in newton metres; absent: zero. Soft fingers only. */
  torsion?: number,
  /** Contact point in the frame of the fingertip's link, in metres. In tracking. */
  point_in_tip?: [number, number, number],
  /**
   * Velocity of the fingertip's material point that touches, seen from the object and across the normal, in the object
   * frame, in metres per second: its mean over the way to the next waypoint. In tracking.
   */
  relative_velocity_in_object?: [number, number, number],
  /** Angular velocity of the fingertip's link seen from the object, in the object frame, in radians per second. In tracking. */
  relative_turn_in_object?: [number, number, number],
};

/** A hand of the scene that the plan moves. */
export type FileHand = {
  /** Its name in the scene. */
  name: string,
  /** Names of its fingers. */
  fingers: Array<string>,
  /** Names of its joints, in the order of every joint vector. */
  joint_names: Array<string>,
  /**
   * Its joints that the plan does not move, and where each of them stands all along, in radians or metres: independent joints that belong
   * to no finger. Absent where there are none, and where a robot carries the hand.
   */
  held_joints?: { [key in string]: number },
};

/** A plan file. */
export type FilePlan = {
  /** Always `regrasp-plan`. */
  format: string,
  /** Version of the format. */
  format_version: number,
  /** Tool and version that wrote it. */
  tool: string,
  /** Kind of task: `in_hand` or `tracking`. */
  task: string,
  /** Name of the task in the scene file; absent where the file has only one. */
  query?: string,
  /** Method that planned it. */
  method: string,
  /** Seed. */
  seed: number,
  /** Settings of the planner, as they were used. */
  settings: unknown,
  /** Files it was made from, the scene file first. */
  inputs: PlanInput[],
  /** What it promises. */
  promises: Promises,
  /** The hands that it moves. All others of the scene rest. */
  hands: Array<FileHand>,
  /** Names of the objects that it moves. All others of the scene rest. */
  objects: Array<string>,
  /** Pose of the object asked for at the start. */
  start: PoseData,
  /** The query, where the scene file does not have it: that of a session. */
  asked?: Asked,
  /** Poses asked for between start and goal, in order; absent where none were. */
  way_poses?: Array<WayPose>,
  /** Pose of the object asked for at the goal. */
  goal: PoseData,
  /** Counts of the search. */
  statistics: Statistics,
  /** The motion, in order; never empty. */
  segments: Array<FileSegment>,
};

/** A piece of motion. */
export type FileSegment = {
  /** Its kind. */
  kind: SegmentKind,
  /** The hand that moves its fingers. */
  hand: string,
  /** In a regrasp the finger that moves, in tracking all that move; absent in transfers. */
  moving?: Array<string>,
  /** In tracking, the resting finger that the object rolls on without sliding (Cherif & Gupta 1999, sec. 6.1.2: `F_t`). */
  rolling_finger?: string,
  /** For every object, who holds it: names of hands and supports. */
  held_by: { [key in string]: Array<string> },
  /** At least two; the first is the last of the segment before, but for time and forces. */
  waypoints: Array<FileWaypoint>,
};

/** The state of hands and objects at one moment. */
export type FileWaypoint = {
  /** When, in seconds from the start. */
  time: number,
  /** Positions of all joints, hand by hand, in radians or metres. */
  joints: Array<number>,
  /** Velocities of all joints, in radians or metres per second; zero at both ends of every segment. */
  joint_velocities: Array<number>,
  /** Torques, or forces of sliding joints, with which the joints make the contact forces; absent in plans without forces. */
  joint_torques?: Array<number>,
  /** Pose of every object of `objects`, in the world. */
  world_from_objects: PoseData[],
  /** Fingers that touch an object, hand by hand in the order of their fingers. */
  contacts: Array<FileContact>,
};

/** What the contact forces balance, and their limits. */
export type ForcePromises = {
  /** Mass of the object, in kilograms. */
  mass: number,
  /**
   * Gravity in the world, in metres per second squared; absent when the grasp holds whatever its direction: forces then
   * balance no weight, and leave room for that of every direction (`docs/reference/plan-format.md`, forces).
   */
  gravity_in_world?: [number, number, number],
  /** Least and largest normal force of a finger that holds, in newtons. */
  normal_force: [number, number],
  /**
   * Largest torque of each joint, in newton metres or newtons: the share of the robot's effort limit that the settings
   * allow; absent for joints without a limit.
   */
  joint_torques: Array<number | null>,
};

/** What a plan promises of the fingers that hold. */
export type HoldingPromises = {
  /** Largest distance of a fingertip from its contact, in metres. */
  contact_tolerance: number,
  /** What the object's friction coefficient is divided by, at least 1: the quotient is what closure and forces count on. */
  friction_margin: number,
  /** Closure margin that every hand keeps by itself while it holds (see `regrasp_grasp::margin`); dimensionless. */
  required_margin: number,
  /** Length by which torques are divided in the margin, in metres. */
  torque_scale: number,
  /** Least and largest normal force of a contact, in newtons. */
  normal_force: [number, number],
};

/** Looking for a better plan after the first. */
export type Improvement = {
  /** The first plan. */
  first: PlanFigures,
  /** The plan in this file. */
  improved: PlanFigures,
  /** What no plan for the query costs less than. */
  lower_bound: number,
  /** Searches begun. */
  rounds: number,
  /** Configurations looked at, part of the statistics' `work`. */
  work: number,
};

/** What a `transfer` or a `regrasp` says beside its waypoints. */
export type InHandPart = {
  /** The finger that moves, in a regrasp. */
  moving_finger?: string,
  /**
   * For every waypoint, torques of the joints of the hand with which they make the contact forces, in newton metres, or newtons of
   * sliding joints.
   */
  joint_torques: Array<Array<number>>,
};

/**
 * What a plan is judged for. A higher level asks for all that the lower ones ask for.
 *
 * What a plan has is judged at every level: wrong forces are wrong in a plan that is judged for its geometry only. The levels
 * say what a plan may leave out.
 */
export type Level = "geometry" | "forces" | "motion";

/** Limits of the motion in time. */
export type MotionLimits = {
  /**
   * Largest speed of a fingertip's centre, or of a point of the object no farther from its centre of mass than
   * `torque_scale`, between two waypoints on average, in metres per second: slow enough to be quasi-static.
   */
  largest_speed: number,
  /**
   * Largest velocity of each joint, in radians or metres per second: the robot's, or what the settings say where it has
   * none.
   */
  joint_velocities: Array<number>,
  /**
   * Largest acceleration of each joint, as differences of velocities between waypoints, in radians or metres per second
   * squared.
   */
  joint_accelerations: Array<number>,
};

/** What a plan costs, and why. */
export type PlanFigures = {
  /** Relocations: how often a finger lands on a contact ([`relocations`]). */
  relocations: number,
  /** Transfers. */
  transfers: number,
  /** How far the object goes, in metres; angles count with the object's radius about its centre of mass. */
  object_path: number,
  /** How far the joints go, all together, in radians or metres. */
  joint_path: number,
  /** Closure margin kept, as promised. */
  kept_margin: number,
  /** Cost by the weights in the settings. */
  cost: number,
};

/** A hand that holds something or moves its fingers. */
export type PlanHand = {
  /** Its name in the scene; of an arm that holds without a hand the name of the arm. */
  name: string,
  /** Names of its fingers; none for an arm without a hand. */
  fingers: Array<string>,
};

/** A robot that the plan moves. */
export type PlanRobot = {
  /** Its name in the scene. */
  name: string,
  /** Names of all its independent joints, in the order of its layout: the order of every joint vector. */
  joint_names: Array<string>,
  /**
   * Its joints that no plan moves, and where each of them stands all along, in radians or metres: `[held]` of the robot file. Absent
   * where there are none.
   */
  held_joints?: { [key in string]: number },
};

/** What the plan promises; the checker holds it to these numbers. */
export type Promises = {
  /** Largest distance of a holding fingertip from its contact at and between waypoints, in metres. */
  contact_tolerance: number,
  /** Friction coefficient that closure and forces count on: the scene's over `friction_margin`. */
  friction: number,
  /** What the scene's friction coefficient was divided by; at least 1. */
  friction_margin: number,
  /** Closure margin that every holding set keeps (see `regrasp_grasp::margin`); dimensionless. */
  required_margin: number,
  /** Smallest margin that the planner found at the waypoints: a lower bound of the Ferrari-Canny radius. */
  kept_margin: number,
  /** Length by which torques are divided in the margin, in metres. */
  torque_scale: number,
  /** How far a rolling fingertip slips at most over the object in one segment, in metres. */
  slip_tolerance: number,
  /** What tracking promises beside; absent in plans of in-hand tasks. */
  tracking?: TrackingPromises,
  /** Limits of the motion in time. */
  motion: MotionLimits,
  /** What the contact forces balance, and their limits; absent in plans without forces. */
  forces?: ForcePromises,
};

/** A finger that touches an object. */
export type RobotContact = {
  /** The hand. */
  hand: string,
  /** The finger of that hand. */
  finger: string,
  /** The object that it touches. */
  object: string,
  /** What the finger does; never `free`: free fingers have no entry. */
  mode: ContactMode,
  /** Contact point in the object frame, in metres. */
  point_in_object: [number, number, number],
  /** Outward normal of the object there, in the object frame. */
  normal_in_object: [number, number, number],
  /** Force of the finger on the object, in newtons, in the object frame; absent in plans without forces. */
  force_in_object?: [number, number, number],
  /** Moment of the finger on the object about the outward normal, in newton metres; absent: zero. Soft fingers only. */
  torsion?: number,
};

/** A plan of whole robots: how their joints move, and what they hold. All else of the scene rests meanwhile. */
export type RobotPlan = {
  /** Always `regrasp-plan`. */
  format: string,
  /** Version of the format. */
  format_version: number,
  /** Tool and version that wrote it. */
  tool: string,
  /** Kind of task: `motion` or `pick_and_place`. */
  task: string,
  /** Name of the task in the scene file; absent where the file has only one. */
  query?: string,
  /** Method that planned it. */
  method: string,
  /** Seed. */
  seed: number,
  /** Settings of the planner, as they were used. */
  settings: unknown,
  /** Files it was made from, the scene file first. */
  inputs: PlanInput[],
  /** What it promises. */
  promises: RobotPromises,
  /** The robots that the plan moves. This version: one. */
  robots: Array<PlanRobot>,
  /** The hands that hold something; empty in a plan in which nothing is held. */
  hands: Array<PlanHand>,
  /** Names of the objects that the plan moves, in the order of every `world_from_objects`. */
  objects: Array<string>,
  /** Counts of the search. */
  statistics: RobotStatistics,
  /** The motion, in order; never empty. */
  segments: Array<RobotSegment>,
};

/** What a plan of whole robots promises; the checker holds it to these numbers. */
export type RobotPromises = {
  /** Largest velocity of each joint, in radians or metres per second. */
  joint_velocities: Array<number>,
  /** Largest acceleration of each joint, in radians or metres per second squared. */
  joint_accelerations: Array<number>,
  /**
   * Bodies that must not touch are at every moment at least this far apart, in metres; 0 where no more than no collision is
   * promised.
   */
  clearance: number,
  /** What holds for all contacts; absent in plans without contacts. */
  holding?: HoldingPromises | null,
  /**
   * What holds while an object moves in a hand, by the name of the hand: as in plans of motions in the hand. Absent in plans without
   * such segments.
   */
  in_hand?: { [key in string]: Promises },
};

/** A piece of motion. */
export type RobotSegment = {
  /** Its kind. */
  kind: RobotSegmentKind,
  /** For every object of `objects`, who holds it: names of hands and supports. */
  held_by: { [key in string]: Array<string> },
  /** In a `transfer` or `regrasp`: which finger moves, and torques. Absent in all other kinds. */
  in_hand?: InHandPart | null,
  /** At least two; the first is the last of the segment before, but for its time. */
  waypoints: Array<RobotWaypoint>,
};

/** Kind of a segment of a [`RobotPlan`]. */
export type RobotSegmentKind = "transit" | "carry" | "approach" | "grasp" | "release" | "retreat" | "transfer" | "regrasp";

/** Counts of the search for a motion. */
export type RobotStatistics = {
  /** Nodes of trees and roadmaps when the search ended. */
  nodes: number,
  /** Configurations sampled. */
  samples: number,
  /** Configurations looked at (kinematics and collision): the unit of the work budget. */
  work: number,
  /** True when a wall-clock limit cut something, so that another machine may find another plan. */
  cut_by_time: boolean,
  /** Further counts of the method, by name. */
  counts: { [key in string]: number },
};

/** The state of robots and objects at one moment. */
export type RobotWaypoint = {
  /** When, in seconds from the start. */
  time: number,
  /** Positions of all joints, robot by robot, in radians or metres. */
  joints: Array<number>,
  /** Velocities of all joints, in radians or metres per second; zero at both ends of every segment. */
  joint_velocities: Array<number>,
  /** Pose of every object of `objects`, in the world. */
  world_from_objects: PoseData[],
  /** Fingers that touch an object, hand by hand in the order of their fingers. Absent where contacts are not planned. */
  contacts?: Array<RobotContact>,
};

/** Kind of a segment. */
export type SegmentKind = "transfer" | "regrasp" | "tracking";

/** Counts of the search. */
export type Statistics = {
  /** Nodes of the roadmap or tree when the search ended; in tracking, cells that sub-goals are in. */
  nodes: number,
  /** Configurations sampled; in tracking, sub-goals that the local planner tried to reach. */
  samples: number,
  /** Configurations looked at (kinematics and collision): the unit of the work budget. */
  work: number,
  /** Restarts used. */
  restarts: number,
  /** Transfers in the plan; in tracking, sub-goals on its path. */
  transfers: number,
  /** Transfers in the plan during which some finger is free. */
  transfers_with_free_fingers: number,
  /** Relocations in the plan: how often a finger lands on a contact ([`relocations`]). */
  relocations: number,
  /** True when a wall-clock limit cut something, so that another machine may find another plan. */
  cut_by_time: boolean,
  /** Attempts that failed, by cause. */
  failures: { [key in string]: number },
  /** What became of the first plan; absent where none was asked to be improved. */
  improvement?: Improvement,
};

/** What a tracking plan promises beside. The goal of such a task is an orientation; where the object then is, is not asked. */
export type TrackingPromises = {
  /** Largest angle between the object's last orientation and the goal's, in radians (Cherif 1999, sec. 5: within a cell). */
  goal_tolerance: number,
  /** Friction coefficient of fingertips that slide: the scene's, as friction then has its full size. */
  sliding_friction: number,
};

/** A pose that the object has to pass between start and goal, and when it does. */
export type WayPose = {
  /** The pose asked for. */
  world_from_object: PoseData,
  /** Index of the segment in which it is passed, from 0. */
  segment: number,
  /** Index of the waypoint of that segment at which it is passed, from 0. */
  waypoint: number,
};
