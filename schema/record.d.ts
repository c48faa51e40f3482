// Types that plan files and grasp lists share. Generated from `regrasp_grasp::record`: do not edit.
// REGRASP_WRITE_SCHEMA=1 cargo test -p regrasp_grasp --lib writes it anew.

/** A file the plan was made from. */
export type PlanInput = {
  /** What it is for: `scene`, `hand`, `urdf`, `srdf`, `mesh`. */
  role: string,
  /** How the scene names it: relative to the scene file, or `package://`. */
  name: string,
  /** SHA-256 of its bytes, lower-case hexadecimal. */
  sha256: string,
};

/** A pose on disk. */
export type PoseData = {
  /** Position, in metres. */
  position: [number, number, number],
  /** Orientation as a unit quaternion, x y z w, with w >= 0. */
  quat_xyzw: [number, number, number, number],
};
