// What the page is told: the one contract between `regrasp_viewer` (crate `src/story/`, same names) and the page.
// Written by Rust as JSON into <script type="application/json" id="story">, with every `<`, `>`, `&`, U+2028, U+2029 escaped.
// SI units, radians. A quaternion is x y z w. Nothing that follows from the plan is stored beside it: traces, bars of the
// gait chart, object path and facts about joints are computed from `plan`.

export interface PoseData { position: [number, number, number]; quat_xyzw: [number, number, number, number] }

export interface Story {
  format: "regrasp-story";
  version: 1;
  /** Name of the scene, as text. */
  title: string;
  /** Label and value of each line of facts, in order of display: text, never markup. */
  facts: [string, string][];
  scene: SceneStory;
  /** Poses asked for: start, then way poses, then goal; in the world. At least two, or empty when unknown. */
  asked: PoseData[];
  /** The plan, or null when none was found. The page is told the plan file as it is; plan.ts makes this of it. */
  plan: Plan | null;
  /** What the checker measured; null when there is no plan. */
  judged: Judged | null;
  /** Why no plan was found; null when there is one. */
  failure: FailureStory | null;
  /** The manipulation graph, when asked for. */
  roadmap: RoadmapStory | null;
}

export interface SceneStory {
  /** Names of all hands of the scene. */
  hands: string[];
  /** Index in `hands` of the one that moves: links, joints and fingers are its own. */
  moving_hand: number;
  /** Names of all objects of the scene. */
  objects: string[];
  /** Index in `objects` of the one that is moved. */
  moved_object: number;
  /** Links of the robot of the hand that moves, every parent before its children. */
  links: LinkStory[];
  world_from_root: PoseData;
  /** Same order as `plan.joint_names` and as `joints` of waypoints. */
  joints: { name: string; lower: number | null; upper: number | null; effort: number | null }[];
  /** Same order as `plan.fingers`. The colour of finger i is palette[i % 8] everywhere. */
  fingers: { name: string; tip_link: number; tip_center_in_link: [number, number, number]; tip_radius: number }[];
  /** Friction coefficient of the scene. */
  friction: number;
  /** Gravity in the world, m/s^2; null when any direction must hold. */
  gravity_in_world: [number, number, number] | null;
  /** Meshes used by `pieces`, each stored once. */
  meshes: MeshStory[];
  pieces: PieceStory[];
}

export interface LinkStory {
  name: string;
  /** Index in `links`; -1 for the root. */
  parent: number;
  kind: "fixed" | "revolute" | "prismatic";
  /** Frame of the joint in the parent link, at joint position 0. */
  parent_from_joint: PoseData;
  axis: [number, number, number];
  /**
   * Index in `joints` that drives it, -1 for fixed ones. Position = multiplier * joints[joint] + offset, plus the same
   * product for each of `others`.
   */
  joint: number;
  multiplier: number;
  offset: number;
  others?: { joint: number; multiplier: number }[];
  /** Index in `fingers` of the finger it belongs to, -1 for the palm. */
  finger: number;
}

export interface MeshStory {
  /** Base64 of little-endian u16 x y z per vertex: coordinate = lower + (upper - lower) * value / 65535, per axis. */
  vertices: string;
  lower: [number, number, number];
  upper: [number, number, number];
  /** Base64 of little-endian indices, three per triangle, counter-clockwise seen from outside; u16 when there are at most 65,536 vertices, else u32. */
  triangles: string;
  /** Curved surfaces are shaded smoothly: angle below which neighbouring faces share a normal; 0 shades flat. */
  smooth_below: number;
}

export interface PieceStory {
  /** What it moves with: index of a link, "object", or "world" for what rests and for obstacles. */
  on: number | "object" | "world";
  /** Which kind of body it is of. */
  part: "hand" | "object" | "support" | "obstacle";
  /** Name to show: of the object, support or obstacle; of the link, and before it that of a hand at rest and a slash. */
  name: string;
  role: "collision" | "visual";
  mesh: number;
  /** Frame of the mesh in the link, the object or the world. */
  from_mesh: PoseData;
  /** Fingertip that may touch the object. */
  is_tip: boolean;
}

/** One number per waypoint, all segments joined in order (the shared waypoint between two segments counts twice). */
export interface Judged {
  accepted: boolean;
  /** What the plan was judged for. */
  level: "geometry" | "forces" | "motion";
  /** First violations, as text. */
  violations: string[];
  /** Closure margin of the holding fingers; null where it could not be judged. */
  margin: (number | null)[];
  required_margin: number;
  /** Smallest distance of things that must not touch, metres. */
  clearance: (number | null)[];
  /** Index in `pairs` of the pair at that distance. */
  pair: number[];
  pairs: [string, string][];
}

export interface FailureStory {
  kind: string;
  message: string;
  advice: string;
  causes: { reason: string; count: number; share: number }[];
  nearest_miss: { world_from_object: PoseData; joints: number[]; angle_left: number; distance_left: number } | null;
}

export interface RoadmapStory {
  /** Object orientation of each node. */
  nodes: { quat_xyzw: [number, number, number, number]; component: number; /** order of growth */ grown: number; angle_to_goal: number }[];
  /** Pairs of nodes. */
  edges: { nodes: [number, number]; kind: "transfer" | "transfer_regrasp" }[];
  /** Nodes of the solution, in order; empty when there is none. */
  solution: number[];
}

// ---- the plan (docs/reference/plan-format.md) as plan.ts makes it of a plan file; only what the page reads ----

export interface Plan {
  format: "regrasp-plan";
  task: string;
  method: string;
  seed: number;
  /** Name of the scene's task; absent where it has only one. */
  query?: string;
  /** Name of the hand that moves. */
  hand: string;
  /** Name of the object that it moves. All else rests. */
  object: string;
  joint_names: string[];
  fingers: string[];
  start: PoseData;
  goal: PoseData;
  segments: Segment[];
  promises: {
    friction: number; friction_margin: number; required_margin: number; kept_margin: number; torque_scale: number;
    /** Of plans of finger tracking only. */
    tracking?: { goal_tolerance: number; sliding_friction: number };
  };
  inputs: { role: string; name: string; sha256: string }[];
  /** In tracking: `transfers` are sub-goals on the path, `samples` sub-goals tried, `nodes` cells that sub-goals are in. */
  statistics: { transfers: number; relocations: number; samples?: number; nodes?: number };
}

export interface Segment {
  kind: "transfer" | "regrasp" | "tracking";
  moving_finger?: string;
  /** In tracking, others that move with it. */
  also_moving?: string[];
  /** In tracking, the resting finger that the object rolls on. */
  rolling_finger?: string;
  /** Names of hands and supports that hold the object. */
  held_by?: string[];
  waypoints: Waypoint[];
}

export interface Waypoint {
  time: number;
  joints: number[];
  joint_velocities: number[];
  joint_torques?: number[];
  world_from_object: PoseData;
  contacts: Contact[];
}

export interface Contact {
  /** In tracking it says what the contact does on the way to the next waypoint. */
  mode: "fixed" | "rolling" | "pure_rolling" | "twisting" | "pure_sliding" | "sliding" | "free";
  point_in_object?: [number, number, number];
  normal_in_object?: [number, number, number];
  force_in_object?: [number, number, number];
}
