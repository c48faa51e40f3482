// Vectors, quaternions (x y z w) and poses as plain arrays. `interpolatePose` is that of regrasp_geometry::frame.

import type { PoseData } from "./story";

export type Vec3 = [number, number, number];
export type Quat = [number, number, number, number];
export interface Pose { position: Vec3; quat: Quat }

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const norm = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const lerp = (a: Vec3, b: Vec3, t: number): Vec3 => [
  a[0] + (b[0] - a[0]) * t,
  a[1] + (b[1] - a[1]) * t,
  a[2] + (b[2] - a[2]) * t,
];
export function unit(a: Vec3): Vec3 {
  const length = norm(a);
  return length > 0 ? scale(a, 1 / length) : [0, 0, 1];
}

export function multiply(a: Quat, b: Quat): Quat {
  const [ax, ay, az, aw] = a;
  const [bx, by, bz, bw] = b;
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}
export const conjugate = (q: Quat): Quat => [-q[0], -q[1], -q[2], q[3]];
export function rotate(q: Quat, v: Vec3): Vec3 {
  const imaginary: Vec3 = [q[0], q[1], q[2]];
  const t = scale(cross(imaginary, v), 2);
  return add(add(v, scale(t, q[3])), cross(imaginary, t));
}
export function fromRotationVector(v: Vec3): Quat {
  const angle = norm(v);
  if (angle === 0) return [0, 0, 0, 1];
  const s = Math.sin(angle / 2) / angle;
  return [v[0] * s, v[1] * s, v[2] * s, Math.cos(angle / 2)];
}

/** Rotation vector, in the parent frame, that turns `from` into `to`; its length is at most pi. */
export function rotationBetween(from: Quat, to: Quat): Vec3 {
  let delta = multiply(to, conjugate(from));
  if (delta[3] < 0) delta = [-delta[0], -delta[1], -delta[2], -delta[3]];
  const imaginary: Vec3 = [delta[0], delta[1], delta[2]];
  const halfSine = norm(imaginary);
  if (halfSine < 1e-12) return scale(imaginary, 2);
  return scale(imaginary, (2 * Math.atan2(halfSine, delta[3])) / halfSine);
}

/** The rotation vector of the same orientation as `vector` that is nearest to `to`: they differ by whole turns about its axis. */
export function nearestVector(vector: Vec3, to: Vec3): Vec3 {
  const length = norm(vector);
  const axis = length > 1e-12 ? scale(vector, 1 / length) : unit(to);
  const turns = Math.round((dot(to, axis) - length) / (2 * Math.PI));
  return add(vector, scale(axis, 2 * Math.PI * turns));
}

/** Position linear, orientation by the shortest great circle, at `t` in [0, 1]. */
export function interpolatePose(from: Pose, to: Pose, t: number): Pose {
  return {
    position: lerp(from.position, to.position, t),
    quat: multiply(fromRotationVector(scale(rotationBetween(from.quat, to.quat), t)), from.quat),
  };
}

export const compose = (a: Pose, b: Pose): Pose => ({
  position: add(a.position, rotate(a.quat, b.position)),
  quat: multiply(a.quat, b.quat),
});
export const apply = (pose: Pose, point: Vec3): Vec3 => add(pose.position, rotate(pose.quat, point));
export const poseFrom = (data: PoseData): Pose => ({ position: data.position, quat: data.quat_xyzw });

export const clamp = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);
