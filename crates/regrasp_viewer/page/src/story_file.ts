// What `regrasp view` writes into its page. Generated from `regrasp_viewer::story`: do not edit.
// REGRASP_WRITE_SCHEMA=1 cargo test -p regrasp_viewer --lib writes it anew.

import type { FilePlan, Level, PoseData } from "../../../../schema/plan";

/** The body that a piece is of, and what it moves with. */
export type Carrier = { "hand": [number, number] } | { "robot_part": [number, number] } | { "object": number } | { "support": number } | { "obstacle": number };

/** One reason for which attempts failed. */
export type CauseStory = {
  /** In words. */
  reason: string,
  /** Attempts. */
  count: number,
  /** Share of all failed attempts. */
  share: number,
};

/** Why no plan was found. */
export type FailureStory = {
  /** Kind, as the planner spells it. */
  kind: string,
  /** What happened. */
  message: string,
  /** What to try; may be empty. */
  advice: string,
  /** Causes, commonest first. */
  causes: Array<CauseStory>,
  /** The nearest that the search came to the goal. */
  nearest_miss: NearestMissStory | null,
};

/** A finger and its tip. */
export type FingerStory = {
  /** Name. */
  name: string,
  /** Index in the hand's `links` of the one that carries the tip. */
  tip_link: number,
  /** Centre of the tip, in the frame of that link. */
  tip_center_in_link: [number, number, number],
  /** Radius of the tip; zero for a sharp one. */
  tip_radius: number,
};

/** A hand. */
export type HandStory = {
  /** Name. */
  name: string,
  /**
   * Its links, every parent before its children. Links of an arm that no moving joint parts from the hand are among them: they
   * count as palm.
   */
  links: Array<LinkStory>,
  /** Its joints. Of the hand that moves, in the order of the plan's `joint_names`. */
  joints: Array<JointStory>,
  /** Its fingers. Of the hand that moves, in the order of the plan's `fingers`. */
  fingers: Array<FingerStory>,
};

/** A joint that other joints do not drive. */
export type JointStory = {
  /** Name. */
  name: string,
  /** Position at rest, radians or metres. */
  at_rest: number,
  /** Lowest position; none for joints without limits. */
  lower: number | null,
  /** Highest position. */
  upper: number | null,
  /** Highest torque or force, N m or N, where the robot says one. */
  effort: number | null,
};

/**
 * What the checker measured: one number per waypoint, all segments joined in order (the waypoint that two segments share
 * counts twice).
 */
export type Judged = {
  /** Verdict. */
  accepted: boolean,
  /** What the plan was judged for: `geometry`, `forces` or `motion`. */
  level: Level,
  /** First violations, as text. */
  violations: Array<string>,
  /** Closure margin of the holding fingers; none where it could not be judged. */
  margin: Array<number | null>,
  /** Margin that the plan promises. */
  required_margin: number,
  /** Smallest distance of things that must not touch, metres. */
  clearance: Array<number | null>,
  /** Index in `pairs` of the pair at that distance. */
  pair: Array<number>,
  /** Names of pairs. */
  pairs: Array<[string, string]>,
};

/** A joint that drives another together with more. */
export type LeaderStory = {
  /** Index in `joints`. */
  joint: number,
  /** Its multiplier. */
  multiplier: number,
};

/** How a link moves against its parent. */
export type LinkKind = "fixed" | "revolute" | "prismatic";

/** A link and the joint that carries it. */
export type LinkStory = {
  /** Name. */
  name: string,
  /** Index in the `links` of the same body; -1 for a link whose parent is the world, or a link of another body. */
  parent: number,
  /** Kind of the joint. A joint that no joint of the body drives is fixed, where it is held. */
  kind: LinkKind,
  /** Frame of the joint at joint position 0: in the parent link, or in the world where `parent` is -1. */
  parent_from_joint: PoseData,
  /** Axis in that frame. */
  axis: [number, number, number],
  /**
   * Index in the `joints` of the same body of what drives it, -1 for fixed ones. Position = `multiplier * joints[joint] + offset`,
   * plus the same product for each of `others`.
   */
  joint: number,
  /** See `joint`. */
  multiplier: number,
  /** See `joint`. */
  offset: number,
  /** More joints that drive it; none for nearly all. */
  others?: Array<LeaderStory>,
  /** Index in `fingers` of the finger that it belongs to, -1 for a palm and for arms. */
  finger: number,
};

/** A mesh with quantised vertices; `story::pack` writes and reads it. */
export type MeshStory = {
  /** Base64 of little-endian u16 x y z per vertex: coordinate = lower + (upper - lower) * value / 65535, per axis. */
  vertices: string,
  /** Lowest coordinates. */
  lower: [number, number, number],
  /** Highest coordinates. */
  upper: [number, number, number],
  /**
   * Base64 of little-endian indices, three per triangle, counter-clockwise seen from outside; u16 when there are at most
   * 65,536 vertices, else u32.
   */
  triangles: string,
  /** Angle below which neighbouring faces share a normal, in radians; 0 shades flat. */
  smooth_below: number,
};

/** The pose nearest to the goal that was reached. */
export type NearestMissStory = {
  /** The object there. */
  world_from_object: PoseData,
  /** The joints of the hand that moves, there, in the order of its `joints`. */
  joints: Array<number>,
  /** Angle left, radians. */
  angle_left: number,
  /** Distance left, metres. */
  distance_left: number,
};

/** An object that hands can move. */
export type ObjectStory = {
  /** Name. */
  name: string,
  /** Where it stands while nothing moves it. */
  world_from_object: PoseData,
};

/** A mesh at its place. */
export type PieceStory = {
  /** What it is of. */
  on: Carrier,
  /** What it is for. */
  role: Role,
  /** Index in `meshes`. */
  mesh: number,
  /** Frame of the mesh in the link, the object or the world. */
  from_mesh: PoseData,
  /** Fingertip that may touch the object. */
  is_tip: boolean,
};

/** An edge of a manipulation graph. */
export type RoadmapEdge = {
  /** Its two nodes. */
  nodes: [number, number],
  /** Its kind. */
  kind: RoadmapEdgeKind,
};

/** Kind of an edge of a manipulation graph. */
export type RoadmapEdgeKind = "transfer" | "transfer_regrasp";

/** A node of a manipulation graph. */
export type RoadmapNode = {
  /** Orientation of the object in the world. */
  quat_xyzw: [number, number, number, number],
  /** Number of the connected component, 0 the largest (or the start's, in a search). */
  component: number,
  /** Order of growth. */
  grown: number,
  /** Angle to the goal, radians. */
  angle_to_goal: number,
};

/** A manipulation graph. */
export type RoadmapStory = {
  /** Object orientation of each node. */
  nodes: Array<RoadmapNode>,
  /** Edges. */
  edges: Array<RoadmapEdge>,
  /** Nodes of the solution, in order; empty when there is none. */
  solution: Array<number>,
};

/** A part of a robot that carries hands: an arm, or what the arms stand on. It rests. */
export type RobotPartStory = {
  /** Name: of the robot, and for an arm a slash and its own. */
  name: string,
  /** Its links, every parent before its children, without those that count as a hand's palm. */
  links: Array<LinkStory>,
  /** Its joints. */
  joints: Array<JointStory>,
};

/** What a piece is for. */
export type Role = "collision" | "visual";

/** Everything that stands in a scene. */
export type SceneStory = {
  /** All hands. */
  hands: Array<HandStory>,
  /** Index in `hands` of the one that the plan moves; the others rest. */
  moving_hand: number,
  /** What carries hands: of each robot the common part, if it has links, and the arms. */
  robot_parts: Array<RobotPartStory>,
  /** All objects that hands can move. */
  objects: Array<ObjectStory>,
  /** Index in `objects` of the one that the plan moves; the others rest. */
  moved_object: number,
  /** Names of the supports. */
  supports: Array<string>,
  /** Names of the obstacles. */
  obstacles: Array<string>,
  /** Friction coefficient of the object that the plan moves. */
  friction: number,
  /** Gravity in the world, m/s^2; none when any direction must hold. */
  gravity_in_world: [number, number, number] | null,
  /** Meshes used by `pieces`, each stored once. */
  meshes: Array<MeshStory>,
  /** The shapes of all bodies. */
  pieces: Array<PieceStory>,
};

/** Everything that a page shows. */
export type Story = {
  /** Always `regrasp-story`. */
  format: string,
  /** Version of the contract. */
  version: number,
  /** Name of the scene, as text. */
  title: string,
  /** Label and value of each line of facts, in order of display: text, never markup. */
  facts: Array<[string, string]>,
  /** Hands, objects, supports and obstacles. */
  scene: SceneStory,
  /** Poses asked for: start, then way poses, then goal; in the world. Empty when unknown. */
  asked: PoseData[],
  /** The plan, or none when none was found. In JSON as in a plan file (`docs/reference/plan-format.md`). */
  plan: FilePlan | null,
  /** What the checker measured; none when there is no plan. */
  judged: Judged | null,
  /** Why no plan was found; none when there is one. */
  failure: FailureStory | null,
  /** The manipulation graph, when asked for. */
  roadmap: RoadmapStory | null,
};
