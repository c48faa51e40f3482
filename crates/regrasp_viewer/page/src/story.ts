// The story as the page uses it: as story_file.ts declares it, but for the plan, of which plan.ts makes one that is easier to draw.
// Rust writes it as JSON into <script type="application/json" id="story">, with every `<`, `>`, `&`, U+2028, U+2029 escaped.
// SI units, radians. A quaternion is x y z w. Nothing that follows from the plan is stored beside it: traces, bars of the
// gait chart, object path and facts about joints are computed from `plan`.

import type { FileContact, FilePlan, FileSegment, FileWaypoint, PoseData, Promises, Statistics } from "../../../../schema/plan";
import type * as file from "./story_file";

export type * from "./story_file";
export type { FilePlan, PoseData };

export interface Story extends Omit<file.Story, "plan"> {
  plan: Plan | null;
}

/** A plan of one hand and one object: what the page reads of a plan file. */
export interface Plan extends Pick<FilePlan, "task" | "method" | "seed" | "query" | "start" | "goal" | "inputs"> {
  /** Name of the hand that moves. */
  hand: string;
  /** Name of the object that it moves. All else rests. */
  object: string;
  joint_names: string[];
  fingers: string[];
  segments: Segment[];
  promises: Pick<Promises, "friction" | "friction_margin" | "required_margin" | "kept_margin" | "torque_scale" | "tracking">;
  statistics: Pick<Statistics, "transfers" | "relocations"> & Partial<Pick<Statistics, "samples" | "nodes">>;
}

export interface Segment extends Pick<FileSegment, "kind" | "rolling_finger"> {
  moving_finger?: string;
  /** In tracking, others that move with it. */
  also_moving?: string[];
  /** Names of hands and supports that hold the object. */
  held_by?: string[];
  waypoints: Waypoint[];
}

export interface Waypoint extends Pick<FileWaypoint, "time" | "joints" | "joint_velocities" | "joint_torques"> {
  world_from_object: PoseData;
  /** One for each finger. */
  contacts: Contact[];
}

/** What a finger does. In tracking the mode says what the contact does on the way to the next waypoint. */
export type Contact = Pick<FileContact, "mode" | "point_in_object" | "normal_in_object" | "force_in_object">;
