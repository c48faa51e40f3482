"""A plan in time: what hand and object should do at every control tick.

Between two waypoints every joint follows the cubic through the plan's positions, velocities and times. The object follows
``interpolate_pose`` of the planner. Its parameter is the cubic from 0 to 1 whose slopes at both ends are the joint velocities
projected on the joints' chord (docs/reference/plan-format.md, Time). This is the motion that the checker judges. Between two segments
everything rests while forces change linearly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Plan = dict[str, Any]


class PlanError(ValueError):
    """A plan that cannot be replayed; the message says why."""


@dataclass(frozen=True)
class Reference:
    """What should be, at ``n`` control ticks of one plan."""

    tick: float
    """Time between two ticks, in seconds."""
    segment: NDArray[np.int64]
    """Segment under way; in a pause between two, the one before. Shape (n,)."""
    waypoint: NDArray[np.int64]
    """Index of the waypoint passed last, counted over all segments. Shape (n,)."""
    fraction: Array
    """Parameter of the object and the forces on the way to the next waypoint, in [0, 1]. Shape (n,)."""
    joints: Array
    """In the order of the plan's ``joint_names``. Shape (n, n_joints)."""
    joint_velocities: Array
    """Shape (n, n_joints)."""
    object_position: Array
    """Origin of the object frame in the world. Shape (n, 3)."""
    object_quat_wxyz: Array
    """Shape (n, 4)."""
    holds: NDArray[np.bool_]
    """Fingers that should press on the object. Shape (n, n_fingers)."""
    presses: NDArray[np.bool_]
    """Fingers that hold, or whose force goes up or down in a pause. Shape (n, n_fingers)."""

    @property
    def n_ticks(self) -> int:
        """Number of ticks."""
        return len(self.segment)

    def blend(self, at_waypoints: Array) -> Array:
        """Values given at all waypoints (first axis), linear in between with the parameter of the motion."""
        last = len(at_waypoints) - 1
        before = at_waypoints[self.waypoint]
        after = at_waypoints[np.minimum(self.waypoint + 1, last)]
        shape = (-1,) + (1,) * (at_waypoints.ndim - 1)
        return before + self.fraction.reshape(shape) * (after - before)


def waypoints_of(plan: Plan) -> list[dict[str, Any]]:
    """All waypoints, over all segments."""
    return [waypoint for segment in plan["segments"] for waypoint in segment["waypoints"]]


def held_at_waypoints(plan: Plan) -> NDArray[np.bool_]:
    """Fingers that press on the object: not the moving one of a regrasp, though it touches at the ends.

    Shape (n_waypoints, n_fingers).
    """
    rows: list[list[bool]] = []
    for segment in plan["segments"]:
        moving = segment.get("moving_finger") if segment["kind"] == "regrasp" else None
        for point in segment["waypoints"]:
            named = zip(plan["fingers"], point["contacts"])
            rows.append([contact["mode"] != "free" and finger != moving for finger, contact in named])
    return np.array(rows)


def reference(plan: Plan, *, tick: float = 0.004, speed: float = 1.0) -> Reference:
    """The plan at control ticks.

    ``speed`` divides all times. Raises ``PlanError`` where times do not increase.
    """
    points = waypoints_of(plan)
    times = np.array([point["time"] for point in points]) / speed
    segment_of = np.repeat(np.arange(len(plan["segments"])), [len(s["waypoints"]) for s in plan["segments"]])
    steps = np.diff(times)
    rests = np.diff(segment_of) > 0
    if np.any(steps < 0) or np.any(steps[~rests] <= 0):
        raise PlanError("the times of the plan's waypoints do not increase")
    n = int(np.ceil((times[-1] - times[0]) / tick)) + 1
    at = times[0] + tick * np.arange(n)
    # Of waypoints at the same time the last has passed.
    search: Any = np.searchsorted
    index: NDArray[np.int64] = np.asarray(search(times, at, side="right") - 1).clip(0, len(times) - 2)
    u = np.clip((at - times[index]) / np.maximum(steps, 1e-12)[index], 0.0, 1.0)

    joints = np.array([point["joints"] for point in points], dtype=np.float64)
    velocities = np.array([point["joint_velocities"] for point in points], dtype=np.float64) * speed
    line = np.diff(joints, axis=0)
    duration = np.maximum(steps, 1e-12)
    span = duration[index]
    s = chord_parameter(line[index], velocities[:-1][index] * span[:, None], velocities[1:][index] * span[:, None], u)
    # Cubic Hermite polynomials and their derivatives: of the change, and of the velocities at both ends.
    v = 1.0 - u
    polynomials = u * u * (3.0 - 2.0 * u), u * v * v * span, -u * u * v * span
    derivatives = 6.0 * u * v / span, v * (1.0 - 3.0 * u), u * (3.0 * u - 2.0)
    ends = line[index], velocities[:-1][index], velocities[1:][index]
    way = np.sum([share[:, None] * end for share, end in zip(polynomials, ends)], axis=0)
    velocity = np.sum([share[:, None] * end for share, end in zip(derivatives, ends)], axis=0)

    position, quat = _object_poses(points, index, s)
    held = held_at_waypoints(plan)
    return Reference(
        tick=tick,
        segment=segment_of[index],
        waypoint=index,
        fraction=s,
        joints=joints[index] + way,
        joint_velocities=velocity,
        object_position=position,
        object_quat_wxyz=quat,
        # In a pause only those hold that hold before and after: the others' forces go up from zero or down to it.
        holds=held[index] & held[index + 1],
        presses=held[index] | held[index + 1],
    )


def chord_parameter(line: Array, first: Array, last: Array, u: Array) -> Array:
    """Parameter of the object's motion at the share ``u`` of the time of steps (docs/reference/plan-format.md, Time).

    ``line`` is the change of the joints in each step, ``first`` and ``last`` their velocities at its ends times its duration.
    """
    length = np.einsum("ij,ij->i", line, line)
    # Where the joints rest the parameter is linear in time.
    moves = length > 1e-18
    slope = np.where(moves, 1.0 / np.where(moves, length, 1.0), 0.0)
    a = np.where(moves, np.clip(slope * np.einsum("ij,ij->i", line, first), 0.0, 3.0), 1.0)
    b = np.where(moves, np.clip(slope * np.einsum("ij,ij->i", line, last), 0.0, 3.0), 1.0)
    return np.asarray(u * (a + u * ((3.0 - 2.0 * a - b) + u * (a + b - 2.0))))


def _object_poses(points: list[dict[str, Any]], index: NDArray[np.int64], s: Array) -> tuple[Array, Array]:
    position = np.array([point["world_from_object"]["position"] for point in points], dtype=np.float64)
    xyzw = np.array([point["world_from_object"]["quat_xyzw"] for point in points], dtype=np.float64)
    quat = xyzw[:, [3, 0, 1, 2]]
    turn = rotation_vector(quat_product(quat[1:], quat_inverse(quat[:-1])))
    moved = position[index] + s[:, None] * np.diff(position, axis=0)[index]
    return moved, quat_product(quat_exp(s[:, None] * turn[index]), quat[index])


def quat_product(a: Array, b: Array) -> Array:
    """Product of quaternions w x y z, over the last axis."""
    aw, ax, ay, az = _parts(a)
    bw, bx, by, bz = _parts(b)
    return _joined(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        )
    )


def quat_inverse(quat: Array) -> Array:
    """Inverse of unit quaternions w x y z."""
    return quat * np.array([1.0, -1.0, -1.0, -1.0])


def quat_exp(vector: Array) -> Array:
    """Unit quaternions w x y z of rotation vectors."""
    half = 0.5 * np.linalg.norm(vector, axis=-1, keepdims=True)
    # sin(h) / h, also at zero.
    return np.concatenate((np.cos(half), 0.5 * np.sinc(half / np.pi) * vector), axis=-1)


def rotation_vector(quat: Array) -> Array:
    """Rotation vectors, no longer than pi, of unit quaternions w x y z."""
    quat = np.where(quat[..., :1] < 0.0, -quat, quat)
    sine = np.linalg.norm(quat[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, quat[..., :1])
    return np.where(sine > 1e-12, angle / np.where(sine > 1e-12, sine, 1.0), 2.0) * quat[..., 1:]


def rotation_matrices(quat: Array) -> Array:
    """Rotation matrices of unit quaternions w x y z; shape (..., 3, 3)."""
    w, x, y, z = _parts(quat)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    if quat.ndim == 1:
        return np.array(rows)
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _parts(quat: Array) -> Any:
    """What is along the last axis; plain numbers of one quaternion, with which numpy is slow."""
    return quat.tolist() if quat.ndim == 1 else np.moveaxis(quat, -1, 0)


def _joined(parts: tuple[Any, ...]) -> Array:
    return np.array(parts) if all(isinstance(part, float) for part in parts) else np.stack(parts, axis=-1)
