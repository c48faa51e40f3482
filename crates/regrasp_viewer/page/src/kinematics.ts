// Forward kinematics from the links of a body of the story.

import type { LinkStory } from "./story";
import { compose, fromRotationVector, poseFrom, scale, type Pose } from "./math";

/** Pose of every link in the world, for one position per joint. */
export function linkPoses(links: readonly LinkStory[], joints: readonly number[]): Pose[] {
  const poses: Pose[] = [];
  for (const link of links) {
    let pose = poseFrom(link.parent_from_joint);
    if (link.parent >= 0) pose = compose(poses[link.parent], pose);
    if (link.kind !== "fixed") {
      let at = link.joint < 0 ? link.offset : link.multiplier * (joints[link.joint] ?? 0) + link.offset;
      for (const other of link.others ?? []) at += other.multiplier * (joints[other.joint] ?? 0);
      const moved = scale(link.axis, at);
      pose = compose(
        pose,
        link.kind === "revolute"
          ? { position: [0, 0, 0], quat: fromRotationVector(moved) }
          : { position: moved, quat: [0, 0, 0, 1] },
      );
    }
    poses.push(pose);
  }
  return poses;
}
