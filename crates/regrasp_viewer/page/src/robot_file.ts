// What `regrasp view` writes into the page of a robot. Generated from `regrasp_viewer::robots`: do not edit.
// REGRASP_WRITE_SCHEMA=1 cargo test -p regrasp_viewer --lib writes it anew.

import type { PoseData } from "../../../../schema/plan";

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

/** A chart of the page, of which the horizontal axis is time. */
export type ReplayAxis = {
  /** Time at the left edge and at the right edge, in seconds. */
  times: [number, number],
  /** The edges as shares of the chart's width. */
  edges: [number, number],
};

/** A body. */
export type ReplayBody = {
  /** Its name. */
  name: string,
  /** What it is. */
  kind: ReplayKind,
  /** What it looks like. */
  pieces: Array<ReplayPiece>,
  /** Its column in `poses`; none for a body that rests. */
  column: number | null,
  /** Where it stands at the start. */
  pose: PoseData,
};

/** A hand or support that holds an object in some segment. */
export type ReplayHolder = {
  /** Its name. */
  name: string,
  /** Its colour in all charts. */
  color: string,
};

/** What a body is. */
export type ReplayKind = "link" | "hand" | "tip" | "object" | "resting" | "support" | "obstacle";

/** A mesh at its place in a body. */
export type ReplayPiece = {
  /** Index in `meshes`. */
  mesh: number,
  /** Where it stands in the body. */
  from_mesh: PoseData,
};

/** A stretch of the plan. */
export type ReplaySegment = {
  /** Kind, as plan files spell it. */
  kind: string,
  /** From when, in seconds. */
  start: number,
  /** Until when. */
  end: number,
  /** Who holds the objects. */
  held_by: Array<string>,
};

/** A robot's plan, ready to be shown. */
export type RobotReplay = {
  /** Always `regrasp-robot-replay`. */
  format: string,
  /** Version of the format. */
  version: number,
  /** Against gravity, in the world. */
  up: [number, number, number],
  /** The time of every frame, in seconds, rising. */
  times: Array<number>,
  /** Base64 of little-endian 32-bit floats: frame by frame, column by column, position and quaternion x y z w. */
  poses: string,
  /** Number of columns. */
  n_columns: number,
  /** Meshes, each once. */
  meshes: Array<MeshStory>,
  /** All bodies. */
  bodies: Array<ReplayBody>,
  /** The segments of the plan. */
  segments: Array<ReplaySegment>,
  /** Hands of the plan, then supports. */
  holders: Array<ReplayHolder>,
  /** The time axis of all charts. */
  axis: ReplayAxis,
};
