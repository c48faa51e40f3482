"""Replays of motions of whole robots: position servos follow the plan, gravity is compensated, the plan's last posture is held."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._mujoco import mujoco
from .reference import PlanError

Array = NDArray[np.float64]

HOLD_TIME = 1.0
"""For so long the last posture is held before errors are measured, in seconds."""
WITHIN = math.radians(1.0)
"""A joint that ends nearer than this has followed, in radians or metres."""
LEAST_DEPTH = 1e-4
"""Contacts deeper than this count as collisions, in metres."""


@dataclass(frozen=True)
class RobotReport:
    """What came of a replay."""

    scene: str
    duration: float
    """Of the plan, in seconds."""
    final_errors: Mapping[str, float]
    """By joint, in radians or metres, after the hold."""
    largest_error: float
    """Largest distance of a joint from the plan at any moment."""
    contacts: tuple[str, ...]
    """Pairs of geoms that came into contact, at most ten."""

    @property
    def followed(self) -> bool:
        """True where every joint ends within one degree of the plan, and nothing was touched."""
        return max(self.final_errors.values(), default=0.0) <= WITHIN and not self.contacts

    def to_json(self) -> dict[str, Any]:
        """For a file."""
        return {**asdict(self), "contacts": list(self.contacts), "followed": self.followed}

    def __str__(self) -> str:
        name, worst = max(self.final_errors.items(), key=lambda item: item[1], default=("-", 0.0))
        lines = [
            f"replay {self.scene}",
            f"{'FOLLOWED' if self.followed else 'MISSED'}   {self.duration:.1f} s of motion",
            f"end    joints within {math.degrees(worst):.3f} degrees of the plan ({name}), "
            f"on the way within {math.degrees(self.largest_error):.2f} degrees",
        ]
        lines.extend(f"touch  {pair}" for pair in self.contacts)
        return "\n".join(lines)


def at(plan: Mapping[str, Any], times: Array) -> Array:
    """Joints at ``times``, on the cubics of docs/reference/plan-format.md. Shape (n, n_joints)."""
    points = [waypoint for segment in plan["segments"] for waypoint in segment["waypoints"]]
    passed = np.array([point["time"] for point in points], dtype=np.float64)
    joints = np.array([point["joints"] for point in points], dtype=np.float64)
    velocities = np.array([point["joint_velocities"] for point in points], dtype=np.float64)
    if len(points) < 2 or np.any(np.diff(passed) < 0):
        raise PlanError("the times of the plan's waypoints do not increase")
    search: Any = np.searchsorted
    index = np.asarray(search(passed, times, side="right") - 1).clip(0, len(points) - 2)
    span = np.maximum(passed[index + 1] - passed[index], 1e-12)
    u = np.clip((times - passed[index]) / span, 0.0, 1.0)[:, None]
    first, last = velocities[index] * span[:, None], velocities[index + 1] * span[:, None]
    change = joints[index + 1] - joints[index]
    return joints[index] + u * (first + u * (3 * change - 2 * first - last + u * (first + last - 2 * change)))


def replay(plan: Mapping[str, Any], xml: str, *, speed: float = 1.0) -> RobotReport:
    """Runs the servos of the model through the plan. Raises ``PlanError``."""
    try:
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise PlanError(f"MuJoCo refuses the model: {error}") from None
    names = [name for robot in plan["robots"] for name in robot["joint_names"]]
    joint = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in names]
    servo = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) for name in names]
    if min(joint + servo, default=-1) < 0:
        raise PlanError("the model is of another robot: a joint or servo of the plan is not in it")
    where = np.asarray(model.jnt_qposadr)[joint]
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.time = 0.0
    points = [waypoint for segment in plan["segments"] for waypoint in segment["waypoints"]]
    start, duration = points[0]["time"], (points[-1]["time"] - points[0]["time"]) / speed
    n = math.ceil((duration + HOLD_TIME) / model.opt.timestep)
    times = np.asarray(start + speed * float(model.opt.timestep) * np.arange(1, n + 1), dtype=np.float64)
    wanted = at(plan, times)
    largest, touched = 0.0, dict[str, None]()
    for tick in range(n):
        data.ctrl[servo] = wanted[tick]
        mujoco.mj_step(model, data)
        largest = max(largest, float(np.abs(data.qpos[where] - wanted[tick]).max()))
        for contact in data.contact[: data.ncon]:
            if contact.dist < -LEAST_DEPTH and len(touched) < 10:
                pair = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, g) or str(g) for g in contact.geom]
                touched[" and ".join(pair)] = None
    errors = np.abs(data.qpos[where] - wanted[-1])
    final = {name: float(error) for name, error in zip(names, errors)}
    return RobotReport(_model_name(model), duration * speed, final, largest, tuple(touched))


def _model_name(model: Any) -> str:
    """The name of the model: the first of its names."""
    return bytes(model.names).split(b"\0", 1)[0].decode()
