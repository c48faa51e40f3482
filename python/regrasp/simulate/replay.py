"""The simulation loop: grip, static hold, the plan, rest; and what was seen at every tick."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._mujoco import MjData, mujoco
from .controllers import Controller
from .model import Rig, Settings
from .reference import Array, Reference, rotation_matrices

#: Position error of the object at which a replay ends: it is gone. In metres.
GONE = 0.060
#: The static hold settles for so long before its drift is measured, in seconds.
SETTLE_TIME = 0.5


@dataclass(frozen=True)
class Track:
    """What was seen, at ``n`` ticks; fewer than planned where the object was dropped."""

    object_position: Array
    """Origin of the object frame in the world. Shape (n, 3)."""
    object_quat_wxyz: Array
    """Shape (n, 4)."""
    tips: Array
    """Centres of fingertips in the world. Shape (n, n_fingers, 3)."""
    sensors: Array
    """The model's sensor data. Shape (n, n_sensors)."""
    qpos: Array
    """Shape (n, nq)."""
    contact_ticks: NDArray[np.int64]
    """Tick of each contact seen. Shape (m,)."""
    contact_geoms: NDArray[np.int32]
    """Its two geoms. Shape (m, 2)."""

    @property
    def n_ticks(self) -> int:
        """Number of ticks."""
        return len(self.object_position)


@dataclass(frozen=True)
class Drift:
    """How far a static hold creeps: what no plan is to blame for."""

    time: float
    """How long was held, in seconds."""
    position: float
    """Largest distance from where it had settled, in metres."""
    angle: float
    """Largest angle from there, in radians."""
    settled_position: float
    """Distance from the start pose when it had settled, in metres."""
    settled_angle: float
    """Angle from there, in radians."""


def grip(rig: Rig, controller: Controller, settings: Settings) -> MjData:
    """The start grasp, closed about the pinned object with forces ramped up; then the pin is off."""
    model = rig.model
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.time = 0.0
    data.ctrl[:] = rig.rest_ctrl
    _displace(rig, data, settings)
    data.eq_active[rig.pin] = 1
    steps = _steps(rig, settings)
    ticks = max(1, round(settings.grip_time / settings.tick))
    for k in range(ticks):
        # Full forces for the last fifth.
        share = min(1.0, 1.25 * (k + 1) / ticks)
        data.ctrl[rig.motors] = controller.servo[0] + share * controller.torques[0]
        mujoco.mj_step(model, data, steps)
    data.eq_active[rig.pin] = 0
    return data


def _displace(rig: Rig, data: MjData, settings: Settings) -> None:
    """Puts the object, and the pin that holds it, where the settings have it start."""
    offset, turn = np.array(settings.start_offset), np.array(settings.start_turn)
    if not (offset.any() or turn.any()):
        return
    at = rig.object_qpos
    mujoco.mj_kinematics(rig.model, data)
    centre = data.xipos[rig.object_body].copy()
    angle = float(np.linalg.norm(turn))
    turned, quat = np.array([1.0, 0.0, 0.0, 0.0]), np.empty(4)
    if angle > 0.0:
        mujoco.mju_axisAngle2Quat(turned, turn / angle, angle)
    arm = np.empty(3)
    mujoco.mju_rotVecQuat(arm, data.qpos[at : at + 3] - centre, turned)
    mujoco.mju_mulQuat(quat, turned, data.qpos[at + 3 : at + 7])
    position = centre + offset + arm
    data.qpos[at : at + 3], data.qpos[at + 3 : at + 7] = position, quat
    # The pin welds the world to the object: its pose is that of the world in the object's frame.
    pinned_position, pinned_quat = np.empty(3), np.empty(4)
    mujoco.mju_negPose(pinned_position, pinned_quat, position, quat)
    rig.model.eq_data[rig.pin, 3:6], rig.model.eq_data[rig.pin, 6:10] = pinned_position, pinned_quat


def hold(rig: Rig, ref: Reference, controller: Controller, gripped: MjData, settings: Settings) -> Drift:
    """Holds the start grasp and measures how far the object creeps. ``gripped`` stays as it is."""
    data = copy.copy(gripped)
    data.ctrl[rig.motors] = controller.commands[0]
    at = slice(rig.object_qpos, rig.object_qpos + 7)
    stride = 25
    poses: list[Array] = []
    for _ in range(max(2, round(settings.hold_time / (stride * settings.tick)))):
        mujoco.mj_step(rig.model, data, stride * _steps(rig, settings))
        poses.append(data.qpos[at].copy())
    seen = np.array(poses)
    settled = min(round(SETTLE_TIME / (stride * settings.tick)), len(seen) - 1)
    position, angle = pose_errors(rig, seen, seen[settled])
    start = np.concatenate((ref.object_position[0], ref.object_quat_wxyz[0]))
    settled_position, settled_angle = pose_errors(rig, seen[settled : settled + 1], start)
    return Drift(
        time=settings.hold_time,
        position=float(position[settled:].max()),
        angle=float(angle[settled:].max()),
        settled_position=float(settled_position[0]),
        settled_angle=float(settled_angle[0]),
    )


def replay(rig: Rig, ref: Reference, controller: Controller, gripped: MjData, settings: Settings) -> Track:
    """Replays the plan, then rests. ``gripped`` is where it starts, and is changed. Ends early when the object is dropped."""
    model, data = rig.model, gripped
    rest = round(settings.rest_time / settings.tick)
    n = ref.n_ticks + rest
    qpos = np.empty((n, model.nq))
    sensors = np.empty((n, model.nsensordata))
    tips = np.empty((n, len(rig.fingers), 3))
    sites = np.array([finger.site for finger in rig.fingers])
    contacts: list[NDArray[np.int32]] = []
    feedback = controller.feedback(rig, ref, settings) if controller.has_feedback else None
    steps = _steps(rig, settings)
    commands, ctrl, position, motors = controller.commands, data.ctrl, data.qpos, rig.motors
    first = rig.object_qpos
    seen = n
    for k in range(n):
        tick = min(k, ref.n_ticks - 1)
        ctrl[motors] = feedback.command(tick, position) if feedback is not None else commands[tick]
        mujoco.mj_step(model, data, steps)
        qpos[k] = position
        sensors[k] = data.sensordata
        tips[k] = data.site_xpos[sites]
        contacts.append(data.contact.geom.copy())
        if k % 10 == 0:
            away = qpos[k, first : first + 3] - ref.object_position[tick]
            if not float(away @ away) < GONE**2:
                seen = k + 1
                break
    counts = np.array([len(geoms) for geoms in contacts])
    return Track(
        object_position=qpos[:seen, first : first + 3],
        object_quat_wxyz=qpos[:seen, first + 3 : first + 7],
        tips=tips[:seen],
        sensors=sensors[:seen],
        qpos=qpos[:seen],
        contact_ticks=np.repeat(np.arange(seen), counts),
        contact_geoms=np.concatenate(contacts) if counts.sum() else np.zeros((0, 2), np.int32),
    )


def pose_errors(rig: Rig, seen: Array, wanted: Array) -> tuple[Array, Array]:
    """Distances of the centre of mass, in metres, and angles, in radians, between poses (position, quat_wxyz)."""
    center = rig.model.body_ipos[rig.object_body]

    def place(poses: Array) -> Array:
        return poses[..., :3] + rotation_matrices(poses[..., 3:]) @ center

    distance = np.linalg.norm(place(seen) - place(wanted), axis=-1)
    # Of unit quaternions a and b the angle is 2 atan2(|a - b|, |a + b|) twice over, whichever sign b has.
    apart = np.linalg.norm(seen[..., 3:] - wanted[..., 3:], axis=-1)
    together = np.linalg.norm(seen[..., 3:] + wanted[..., 3:], axis=-1)
    return distance, 4.0 * np.arctan2(np.minimum(apart, together), np.maximum(apart, together))


def _steps(rig: Rig, settings: Settings) -> int:
    return max(1, round(settings.tick / rig.model.opt.timestep))
