"""Controller C2 for pick and place: slow feedback of the object's pose in the hands that hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._mujoco import MjData, mujoco
from .controllers import FREE_FOLLOW_TIME, RETURN_SPEED
from .model import INVERSE_DAMPING, LARGEST_OFFSET
from .reference import Array, rotation_matrices
from .task_reference import TaskReference, TaskRig


@dataclass(frozen=True)
class _Grip:
    """A fingertip at its contact, at a waypoint."""

    finger: int
    base: int
    """Body of the hand's base."""
    presses: bool
    """False while it closes."""
    point: Array
    """Contact in the object, from its frame's origin."""
    normal: Array
    """In the frame of the hand's base."""
    joints_from_tip: Array
    """Changes of joint targets for a displacement of the tip in the frame of the hand's base; shape (n_joints, 3)."""


class TaskFeedback:
    """The error of the object's pose, integrated slowly as an offset of every fingertip that presses, in the frame of its hand.

    As ``controllers.Feedback`` does it in one hand. A finger that closes takes up the displacement of the real object from the planned
    one, so that it lands where it should. While a support carries the object, nothing is corrected. When a hand has closed, its servos
    take the joints as they are for targets: fingers that stopped where the object really is would else go on pushing it sideways.
    """

    def __init__(self, rig: TaskRig, ref: TaskReference, plan: Mapping[str, Any], tick: float, settings: tuple[float, float]) -> None:
        gain, squeeze_time = settings
        self._rig, self._ref = rig, ref
        self._settled = np.zeros(len(rig.names))
        self._holding = np.zeros(len(rig.hands), dtype=np.int64)
        """Ticks for which each hand has held."""
        self._squeeze = max(1, round(squeeze_time / tick))
        points = [waypoint for segment in plan["segments"] for waypoint in segment["waypoints"]]
        self._keys = list(rig.tips)
        self._offsets = np.zeros((len(self._keys), 3))
        self._gain, self._leak, self._return = gain * tick, min(1.0, tick / FREE_FOLLOW_TIME), RETURN_SPEED * tick
        times = np.array([float(point["time"]) for point in points])
        search: Any = np.searchsorted
        self._waypoint = (search(times, ref.plan_time, side="right") - 1).clip(0, len(points) - 1)
        self._grips = self._all_grips(plan, points)
        self._joints_of = {hand: rig.joints_of(hand) for hand in rig.hands}

    def shift(self, at: int, data: MjData) -> Array:
        """What feedback adds to the targets of the servos at a tick, with the object as ``data`` has it."""
        rig, ref = self._rig, self._ref
        wanted = rig.object_pose(ref, at)
        seen = data.qpos[rig.object_qpos : rig.object_qpos + 7]
        turn_wanted, turn_seen = rotation_matrices(wanted[3:]), rotation_matrices(seen[3:])
        added = self._settle(at, data)
        held = np.zeros(len(self._keys), dtype=bool)
        for grip in self._grips[int(self._waypoint[at])]:
            held[grip.finger] = True
            offset = self._offsets[grip.finger]
            base = data.xmat[grip.base].reshape(3, 3)
            lacking = base.T @ (wanted[:3] + turn_wanted @ grip.point - seen[:3] - turn_seen @ grip.point)
            if not grip.presses:
                offset -= self._leak * (lacking + offset)
            elif ref.only_hands[at]:
                # No finger presses less than planned: what it gives way others would have to hold by friction.
                limit = max(0.0, float(offset @ grip.normal) - self._return)
                np.clip(offset + self._gain * lacking, -LARGEST_OFFSET, LARGEST_OFFSET, out=offset)
                offset -= max(float(offset @ grip.normal) - limit, 0.0) * grip.normal
            added += grip.joints_from_tip @ offset
        self._offsets[~held] = 0.0
        return added

    def _settle(self, at: int, data: MjData) -> Array:
        """Offsets of all targets by where hands closed."""
        rig = self._rig
        holding = {grip.base for grip in self._grips[int(self._waypoint[at])] if grip.presses}
        for h, hand in enumerate(rig.hands):
            own = self._joints_of[hand]
            self._holding[h] = self._holding[h] + 1 if rig.bases[hand] in holding else 0
            if self._holding[h] == self._squeeze:
                self._settled[own] = data.qpos[rig.joint_qpos[own]] - self._ref.joints[at][own]
            elif self._holding[h] == 0:
                self._settled[own] *= 1.0 - self._leak
        return self._settled.copy()

    def _all_grips(self, plan: Mapping[str, Any], points: list[dict[str, Any]]) -> list[list[_Grip]]:
        """By waypoint. Fingers that close have the contacts at which they are to arrive."""
        data = mujoco.MjData(self._rig.model)
        found: list[list[_Grip]] = []
        index = 0
        for s, segment in enumerate(plan["segments"]):
            after: list[dict[str, Any]] = []
            if segment["kind"] == "grasp" and s + 1 < len(plan["segments"]):
                after = plan["segments"][s + 1]["waypoints"][0].get("contacts", [])
            elif segment["kind"] == "regrasp":
                after = segment["waypoints"][-1].get("contacts", [])
            for point in segment["waypoints"]:
                self._place(data, index)
                now = point.get("contacts", [])
                pressing = {(contact["hand"], contact["finger"]) for contact in now}
                closing = [contact for contact in after if (contact["hand"], contact["finger"]) not in pressing]
                grips = [self._grip(data, contact, True) for contact in now]
                found.append(grips + [self._grip(data, contact, False) for contact in closing])
                index += 1
        return found

    def _place(self, data: MjData, index: int) -> None:
        data.qpos[:] = self._rig.model.key_qpos[index]
        mujoco.mj_kinematics(self._rig.model, data)
        mujoco.mj_comPos(self._rig.model, data)

    def _grip(self, data: MjData, contact: Mapping[str, Any], presses: bool) -> _Grip:
        rig = self._rig
        key = (contact["hand"], contact["finger"])
        base = rig.bases[contact["hand"]]
        base_from_world = data.xmat[base].reshape(3, 3).T
        at = slice(rig.object_qpos + 3, rig.object_qpos + 7)
        turn = rotation_matrices(data.qpos[at])
        point = np.array(contact["point_in_object"], dtype=np.float64)
        where = data.qpos[rig.object_qpos : rig.object_qpos + 3] + turn @ point
        jacobian = np.zeros((3, rig.model.nv))
        mujoco.mj_jac(rig.model, data, jacobian, None, where, rig.tips[key])
        # The hand's own joints alone.
        moved = base_from_world @ (jacobian @ rig.drives) * rig.of_hand
        invert: Any = np.linalg.inv
        inverse: Array = moved.T @ invert(moved @ moved.T + INVERSE_DAMPING**2 * np.eye(3))
        normal = base_from_world @ turn @ np.array(contact["normal_in_object"], dtype=np.float64)
        return _Grip(self._keys.index(key), base, presses, point, normal, inverse)
