"""Grasp lists in MuJoCo: grasps are shaken, as DexGraspBench does, and lifted from the object's stable poses."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .._arguments import StrPath
from ._mujoco import MjData, mujoco
from .model import Rig, Settings, make_rig
from .reference import Array, PlanError, rotation_matrices
from .replay import pose_errors

#: Success as DexGraspBench counts it, and as we do: metres and degrees.
THEIRS = (0.050, 15.0)
OURS = (0.005, 5.0)
#: Acceleration of the shaking force, in m/s^2, and how long it acts along each of six directions, in seconds.
SHAKE_ACCELERATION = 10.0
SHAKE_TIME = 2.0
#: Height of the lift, in metres; how long it and the hold after it take, in seconds.
LIFT_HEIGHT = 0.1
LIFT_TIME = 1.0
LIFT_HOLD = 3.0
#: Time in which the hand closes and in which it squeezes, in seconds.
CLOSE_TIME = 0.5
SQUEEZE_TIME = 0.3
#: What a trial can do to a grasp on purpose, so that it must fail.
CONTROLS = ("none", "no_forces", "first_finger_open")
#: Half the length and half the thickness of the table, in metres.
TABLE = (0.5, 0.05)


@dataclass(frozen=True)
class GraspSettings:
    """How grasps are tried."""

    mass: float = 0.1
    """Mass of the object, in kilograms."""
    friction: float = 0.6
    """Friction coefficient of the fingertips on the object."""
    squeeze: float = 1.0
    """Factor of the list's joint torques."""
    control: str = "none"
    """``none``; ``no_forces``: the fingers go to the grasp and press with nothing; ``first_finger_open``: the finger of the first
    contact stays open, so that what is left has no force closure."""
    tick: float = 0.004
    """Time between two commands, in seconds."""


@dataclass(frozen=True)
class Trial:
    """What became of one grasp in one test."""

    grasp: int
    test: str
    """``shake`` or ``lift``."""
    case: int
    """Direction of the shake, or index of the stable pose."""
    distance: float
    """How far the object's centre of mass moved against the hand, in metres."""
    angle: float
    """How far it turned, in degrees."""

    def holds(self, limits: tuple[float, float]) -> bool:
        """True when it stayed within so many metres and degrees."""
        return self.distance <= limits[0] and self.angle <= limits[1]


@dataclass(frozen=True)
class Report:
    """All trials of a list."""

    hand: str
    object: str
    settings: GraspSettings
    notes: list[str]
    trials: list[Trial] = field(default_factory=list[Trial])

    def share(self, test: str, limits: tuple[float, float]) -> tuple[int, int]:
        """Grasps that held in every case of a test, and grasps that were tried in it."""
        cases: dict[int, list[bool]] = {}
        for trial in self.trials:
            if trial.test == test:
                cases.setdefault(trial.grasp, []).append(trial.holds(limits))
        return sum(all(held) for held in cases.values()), len(cases)

    def to_json(self) -> dict[str, Any]:
        """The report as JSON data."""
        shares = {
            test: {"tried": self.share(test, THEIRS)[1], "theirs": self.share(test, THEIRS)[0], "ours": self.share(test, OURS)[0]}
            for test in ("shake", "lift")
        }
        return {
            "hand": self.hand,
            "object": self.object,
            "settings": asdict(self.settings),
            "notes": self.notes,
            "shares": shares,
            "trials": [asdict(trial) for trial in self.trials],
        }


def load(
    path: StrPath, *, packages: Mapping[str, StrPath] | None = None, mjcf: StrPath | None = None
) -> tuple[dict[str, Any], str, list[str]]:
    """The list in ``path``, its MuJoCo model, and where the model differs. Raises ``PlanError`` or ``OSError``."""
    try:
        content: Any = json.loads(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise PlanError(f"{path}: not JSON ({error})") from None
    if mjcf is not None:
        return content, Path(mjcf).read_text(encoding="utf-8"), []
    import regrasp

    try:
        xml, notes = regrasp.grasps_mjcf(path, packages=packages)
    except regrasp.RegraspError as error:
        raise PlanError(str(error)) from None
    return content, xml, notes


class Trials:
    """A list in its model, ready to be tried."""

    def __init__(self, content: dict[str, Any], xml: str, settings: GraspSettings | None = None) -> None:
        """Raises ``PlanError`` where model and list do not belong together."""
        self.settings = settings or GraspSettings()
        if self.settings.control not in CONTROLS:
            raise PlanError(f"no control {self.settings.control!r}; there are {', '.join(CONTROLS)}")
        self.content = content
        scale = self.settings.friction / float(content["object"]["friction"])
        mass = self.settings.mass / float(content["object"]["mass"])
        self.rig: Rig = make_rig(_with_table(xml), _plan(content), Settings(friction_scale=scale, mass_scale=mass))
        self.table = int(self.rig.model.body("regrasp:table").mocapid[0])
        self.steps = max(1, round(self.settings.tick / self.rig.model.opt.timestep))

    def shake(self, grasp: int) -> Iterator[Trial]:
        """Closes the hand without gravity, then pushes the object along each of six directions afresh."""
        self._gravity(np.zeros(3))
        start, closed = self._closed(grasp, None)
        for case in range(6):
            data = copy.copy(closed)
            force = np.zeros(3)
            force[case // 2] = (1 - 2 * (case % 2)) * SHAKE_ACCELERATION * self.settings.mass
            data.xfrc_applied[self.rig.object_body, :3] = force
            self._run(data, SHAKE_TIME)
            yield self._trial(grasp, "shake", case, data, start)

    def lift(self, grasp: int) -> Iterator[Trial]:
        """Closes the hand about the object on a table, in each stable pose of the grasp, then takes the table away downwards: the hand
        lifts the object, seen from the hand."""
        for case in self.content["grasps"][grasp]["stable_poses"]:
            pose = self.content["stable_poses"][case]
            hand_from_object = _hand_from_object(self.content["grasps"][grasp])
            down = rotation_matrices(hand_from_object[3:]) @ np.array(pose["down_in_object"])
            top = hand_from_object[:3] + down * pose["height"]
            self._gravity(9.81 * down)
            start, data = self._closed(grasp, (top, down))
            ticks = round(LIFT_TIME / self.settings.tick)
            for k in range(ticks):
                data.mocap_pos[self.table] = top + down * (TABLE[1] + LIFT_HEIGHT * (k + 1) / ticks)
                mujoco.mj_step(self.rig.model, data, self.steps)
            self._run(data, LIFT_HOLD)
            yield self._trial(grasp, "lift", int(case), data, start)

    def _gravity(self, gravity: Array) -> None:
        self.rig.model.opt.gravity = gravity

    def _closed(self, grasp: int, table: tuple[Array, Array] | None) -> tuple[Array, MjData]:
        """Where the object began, and the moment at which the hand has closed and squeezes."""
        rig = self.rig
        data = mujoco.MjData(rig.model)
        mujoco.mj_resetDataKeyframe(rig.model, data, 2 * grasp)
        data.time = 0.0
        data.eq_active[rig.pin] = 0
        down = np.array([0.0, 0.0, -1.0])
        place = np.array([0.0, 0.0, -10.0])
        if table is not None:
            place, down = table[0] + table[1] * TABLE[1], table[1]
        data.mocap_pos[self.table] = place
        data.mocap_quat[self.table] = _quaternion_to(down)
        at = slice(rig.object_qpos, rig.object_qpos + 7)
        start = data.qpos[at].copy()
        one = self.content["grasps"][grasp]
        begin, end = np.array(one["open_joints"]), np.array(one["joints"])
        torques = np.array(one["joint_torques"]) * self.settings.squeeze
        if self.settings.control == "no_forces":
            torques = np.zeros_like(torques)
        if self.settings.control == "first_finger_open":
            name = one["contacts"][0]["finger"]
            joints = next(finger.joints for finger in rig.fingers if finger.name == name)
            end[joints], torques[joints] = begin[joints], 0.0
        n_close, n_squeeze = (round(time / self.settings.tick) for time in (CLOSE_TIME, SQUEEZE_TIME))
        for k in range(n_close + n_squeeze):
            share = min(1.0, (k + 1) / n_close)
            press = max(0.0, (k + 1 - n_close) / n_squeeze)
            # Targets do not jump at either end.
            target = begin + (end - begin) * (share * share * (3.0 - 2.0 * share))
            data.ctrl[rig.motors] = rig.stiffness * target + press * torques
            mujoco.mj_step(rig.model, data, self.steps)
        return start, data

    def _run(self, data: MjData, time: float) -> None:
        mujoco.mj_step(self.rig.model, data, round(time / self.settings.tick) * self.steps)

    def _trial(self, grasp: int, test: str, case: int, data: MjData, start: Array) -> Trial:
        at = slice(self.rig.object_qpos, self.rig.object_qpos + 7)
        distance, angle = pose_errors(self.rig, data.qpos[at].copy()[None], start)
        lost = not np.isfinite(data.qpos).all()
        return Trial(grasp, test, case, np.inf if lost else float(distance[0]), 180.0 if lost else float(np.degrees(angle[0])))


def try_list(
    content: dict[str, Any],
    xml: str,
    settings: GraspSettings | None = None,
    *,
    tests: tuple[str, ...] = ("shake", "lift"),
    most: int | None = None,
    notes: list[str] | None = None,
) -> Report:
    """Tries the first ``most`` grasps of a list. Raises ``PlanError``."""
    trials = Trials(content, xml, settings)
    found: list[Trial] = []
    for grasp in range(min(len(content["grasps"]), most or len(content["grasps"]))):
        if "shake" in tests:
            found.extend(trials.shake(grasp))
        if "lift" in tests:
            found.extend(trials.lift(grasp))
    return Report(content["hand"]["name"], content["object"]["name"], trials.settings, notes or [], found)


def _plan(content: dict[str, Any]) -> dict[str, Any]:
    """The list as the plan that the model was made of: two waypoints for each grasp."""
    points: list[dict[str, Any]] = []
    for grasp in content["grasps"]:
        pose = _hand_from_object(grasp)
        entry = {"position": pose[:3].tolist(), "quat_xyzw": pose[[4, 5, 6, 3]].tolist()}
        free = [{"mode": "free"} for _ in content["hand"]["fingers"]]
        points += [
            {"joints": grasp[key], "joint_torques": grasp["joint_torques"], "world_from_object": entry, "contacts": free}
            for key in ("open_joints", "joints")
        ]
    return {
        "joint_names": content["hand"]["joint_names"],
        "fingers": content["hand"]["fingers"],
        "hand": content["hand"]["name"],
        "object": content["object"]["name"],
        "promises": {"torque_scale": content["promises"]["torque_scale"]},
        "segments": [{"kind": "transfer", "waypoints": points}],
    }


def _hand_from_object(grasp: dict[str, Any]) -> Array:
    """Position and quaternion, w first, of the object in the hand frame."""
    pose = grasp["object_from_hand"]
    x, y, z, w = pose["quat_xyzw"]
    inverse = np.array([w, -x, -y, -z])
    position = -(rotation_matrices(inverse) @ np.array(pose["position"]))
    return np.concatenate((position, inverse))


def _quaternion_to(down: Array) -> Array:
    """A turn, w first, of -z to ``down``."""
    axis = np.cross([0.0, 0.0, -1.0], down)
    w = 1.0 - down[2]
    if w < 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])
    quaternion = np.concatenate(([w], axis))
    return quaternion / np.linalg.norm(quaternion)


def _with_table(xml: str) -> str:
    """The model with a table that can be moved, and that touches only the object."""
    parts = re.findall(r'<geom[^>]*\bname="((?:[^"/]*/)?object(?:_*)(?::\d+)?)"', xml)
    table = (
        f'<body name="regrasp:table" mocap="true" pos="0 0 -10"><geom name="regrasp:table" type="box" '
        f'size="{TABLE[0]} {TABLE[0]} {TABLE[1]}" contype="0" conaffinity="0"/></body></worldbody>'
    )
    pairs = "".join(f'<pair geom1="regrasp:table" geom2="{part}" condim="3" friction="0.8 0.8 0.005 0.0001 0.0001"/>' for part in parts)
    with_table = xml.replace("</worldbody>", table, 1)
    if "</contact>" in with_table:
        return with_table.replace("</contact>", f"{pairs}</contact>", 1)
    return with_table.replace("</worldbody>", f"</worldbody><contact>{pairs}</contact>", 1)
