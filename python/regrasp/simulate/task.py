"""Replays of pick and place: arms follow by position, fingers press with the planned forces, the object is free from the first moment.

``docs/reference/replay.md`` says what is simulated and how.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._mujoco import mujoco
from .reference import Array, PlanError, quat_inverse, quat_product, rotation_matrices, rotation_vector
from .task_feedback import TaskFeedback
from .task_reference import TaskReference, TaskRig, make_rig, task_reference

#: The object is lost where it is farther from the plan than this, in metres and radians; as in replays of one hand.
LOST = (0.010, math.radians(20.0))
#: It is lost where nothing touches it for longer than this, in seconds.
LOOSE_TIME = 0.024
#: For so long the last posture is held before errors are measured, in seconds.
REST_TIME = 0.5
#: Steps of the simulation between two commands, and commands between two looks at the object.
STEPS, LOOKS = 2, 5
#: Contacts of what should not touch count from this depth, in metres.
LEAST_DEPTH = 1e-4


#: See ``TaskSettings.controller``.
TASK_CONTROLLERS = ("B", "C2")


@dataclass(frozen=True)
class TaskSettings:
    """How a plan of pick and place is replayed."""

    controller: str = "B"
    """``B``: servos on the plan, with its forces fed forward. ``C2``: fingers that hold correct the object's pose slowly, too."""
    feedback_gain: float = 2.0
    """Of C2, per second."""
    speed: float = 1.0
    """Times faster than planned."""
    squeeze_time: float = 0.25
    """Where fingers begin or cease to hold, everything rests for so long, and forces go from those before to those after; seconds."""
    with_forces: bool = True
    """False: fingers go where the plan has them, and press with nothing. A control: the object should fall."""
    friction_scale: float = 1.0
    """Friction of the simulation over the scene's."""
    mass_scale: float = 1.0
    """Mass of the simulated object over the scene's."""


@dataclass(frozen=True)
class Lost:
    """Where the object was lost."""

    cause: str
    """``position``, ``angle`` or ``nothing touches it``."""
    segment: int
    kind: str
    time: float
    """Of the plan, in seconds."""
    position_error: float
    angle_error: float


@dataclass(frozen=True)
class Hold:
    """How the object moved in a hand that held it, from the first moment to the last in which only hands held it."""

    hand: str
    first_segment: int
    last_segment: int
    slip: float
    """Way of its centre of mass in the frame of the hand's base, in metres."""
    turn: float
    """Its turn in that frame, in radians."""


@dataclass(frozen=True)
class TaskReport:
    """What came of a replay."""

    scene: str
    settings: TaskSettings
    duration: float
    """Of the plan, in seconds."""
    lost: Lost | None
    final_position_error: float
    """Of the centre of mass against the plan's last pose, in metres."""
    final_angle_error: float
    largest_position_error: float
    """At any moment, until the object was lost."""
    largest_angle_error: float
    holds: tuple[Hold, ...]
    largest_joint_error: float
    """Largest distance of an arm's joint from the plan, in radians or metres."""
    saturated: Mapping[str, float]
    """Joints whose drives reached their largest torque, with the time for which they did, in seconds."""
    contacts: tuple[str, ...]
    """Pairs of geoms that touched and should not, at most ten."""

    @property
    def kept(self) -> bool:
        """True where the object was never lost."""
        return self.lost is None

    def to_json(self) -> dict[str, Any]:
        """For a file."""
        return {"format": "regrasp-task-replay", "format_version": 1, **asdict(self), "kept": self.kept}

    def __str__(self) -> str:
        lines = [f"replay {self.scene}"]
        if self.lost is None:
            lines.append(f"KEPT   {self.duration:.1f} s of motion")
        else:
            at = self.lost
            lines.append(f"LOST ({at.cause}) at {at.time:.2f} of {self.duration:.1f} s, segment {at.segment}, {at.kind}")
        lines.append(
            f"error  {_pose(self.final_position_error, self.final_angle_error)} at the end, "
            f"{_pose(self.largest_position_error, self.largest_angle_error)} at most; "
            f"joints of arms {math.degrees(self.largest_joint_error):.2f} deg at most"
        )
        lines += [
            f"hold   {hold.hand}, segments {hold.first_segment} to {hold.last_segment}: slips {_pose(hold.slip, hold.turn)}"
            for hold in self.holds
        ]
        lines += [f"limit  {name} at its largest torque for {1e3 * time:.0f} ms" for name, time in self.saturated.items()]
        lines += [f"touch  {pair}" for pair in self.contacts]
        return "\n".join(lines)


@dataclass(frozen=True)
class TaskTrack:
    """Coordinates of the model at the moments that were looked at."""

    times: Array
    """Of the plan, in seconds. Shape (n,)."""
    qpos: Array
    """Shape (n, nq)."""


def replay(plan: Mapping[str, Any], xml: str, settings: TaskSettings | None = None) -> tuple[TaskReport, TaskTrack, TaskRig]:
    """Replays a plan of pick and place in the model ``xml`` (``regrasp export --mjcf``). Raises ``PlanError``."""
    settings = settings or TaskSettings()
    if settings.speed <= 0.0 or settings.squeeze_time < 0.0:
        raise PlanError("the speed has to be above zero, and the time of squeezing not below")
    if settings.controller not in TASK_CONTROLLERS:
        raise PlanError(f"no controller {settings.controller!r} for pick and place; there are {', '.join(TASK_CONTROLLERS)}")
    rig = make_rig(plan, xml)
    model = rig.model
    model.pair_friction[:] *= settings.friction_scale
    model.geom_friction[list(rig.object_geoms)] *= settings.friction_scale
    model.body_mass[rig.object_body] *= settings.mass_scale
    model.body_inertia[rig.object_body] *= settings.mass_scale
    mujoco.mj_setConst(model, mujoco.MjData(model))
    tick = STEPS * float(model.opt.timestep)
    ref = task_reference(rig, plan, tick, settings.speed, settings.squeeze_time)
    commands = ref.targets + ref.inertia + (ref.feed_forward if settings.with_forces else 0.0)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.time = 0.0
    watch = _Watch(rig, ref, tick)
    feedback = TaskFeedback(rig, ref, plan, tick, (settings.feedback_gain, settings.squeeze_time)) if settings.controller == "C2" else None
    n = ref.n_ticks + round(REST_TIME / tick)
    for k in range(n):
        # Over a tick, the command is the mean of those at its ends; what is seen after it is compared with its end.
        before, at = min(k, ref.n_ticks - 1), min(k + 1, ref.n_ticks - 1)
        data.ctrl[rig.servos] = 0.5 * (commands[before] + commands[at])
        if feedback is not None:
            data.ctrl[rig.servos] += feedback.shift(before, data)
        mujoco.mj_step(model, data, STEPS)
        if not watch.look(k, at, data):
            break
    return watch.report(plan, settings), watch.track(), rig


class _Watch:
    """Looks at a replay while it runs."""

    def __init__(self, rig: TaskRig, ref: TaskReference, tick: float) -> None:
        self._rig, self._ref, self._tick = rig, ref, tick
        self._center = np.array(rig.model.body_ipos[rig.object_body])
        self._lost: Lost | None = None
        self._loose = 0
        self._errors: list[tuple[float, float]] = []
        self._joint_error = 0.0
        self._touched: dict[str, None] = {}
        self._limits = np.where(rig.model.actuator_forcelimited[rig.servos] > 0, rig.model.actuator_forcerange[rig.servos, 1], np.inf)
        self._saturated = np.zeros(len(rig.servos))
        self._seen: list[tuple[float, Array]] = []
        self._segments: list[int] = []
        self._arms = np.array([k for k in range(len(rig.names)) if not rig.of_hand[k]], dtype=np.int64)

    def look(self, k: int, at: int, data: Any) -> bool:
        """False where there is nothing left to see."""
        rig, ref = self._rig, self._ref
        self._saturated += np.abs(data.actuator_force[rig.servos]) >= 0.999 * self._limits
        segment = int(ref.segment[at])
        touches = self._contacts(data)
        if ref.only_hands[at] and not touches:
            self._loose += 1
        else:
            self._loose = 0
        error = None
        if k % LOOKS == 0 or self._loose * self._tick > LOOSE_TIME:
            self._seen.append((float(ref.plan_time[at]), data.qpos.copy()))
            self._segments.append(segment)
            error = self._error(data.qpos, rig.object_pose(ref, at))
            if self._lost is None:
                self._errors.append(error)
            apart = np.abs(data.qpos[rig.joint_qpos[self._arms]] - ref.joints[at][self._arms])
            self._joint_error = max(self._joint_error, float(apart.max(initial=0.0)))
        if self._lost is None and error is not None:
            causes = (
                (self._loose * self._tick > LOOSE_TIME, "nothing touches it"),
                (not error[0] <= LOST[0], "position"),
                (not error[1] <= LOST[1], "angle"),
            )
            for is_lost, cause in causes:
                if is_lost:
                    self._lost = Lost(cause, segment, rig.kinds[segment], float(ref.plan_time[at]), *error)
                    break
        # What is gone does not come back: the rest of the replay would tell nothing.
        return error is None or error[0] < 20.0 * LOST[0]

    def _contacts(self, data: Any) -> bool:
        """True where a hand touches the object; keeps what should not touch."""
        rig = self._rig
        touches = False
        for geoms, depth in zip(data.contact.geom.tolist(), data.contact.dist.tolist()):
            on_object = [g in rig.object_geoms for g in geoms]
            if any(on_object):
                other = geoms[1 - on_object.index(True)]
                if other in rig.hand_geoms:
                    touches = True
                if other in rig.tip_geoms or other in rig.support_geoms:
                    continue
            if depth < -LEAST_DEPTH and len(self._touched) < 10:
                names = [rig.model.geom(g).name or str(g) for g in geoms]
                self._touched[" and ".join(names)] = None
        return touches

    def _error(self, qpos: Array, wanted: Array) -> tuple[float, float]:
        at = slice(self._rig.object_qpos, self._rig.object_qpos + 7)
        seen = qpos[at]
        place = [pose[:3] + rotation_matrices(pose[3:]) @ self._center for pose in (seen, wanted)]
        turn = rotation_vector(quat_product(seen[3:], quat_inverse(wanted[3:])))
        return float(np.linalg.norm(place[0] - place[1])), float(np.linalg.norm(turn))

    def track(self) -> TaskTrack:
        """What was seen."""
        return TaskTrack(np.array([time for time, _ in self._seen]), np.array([qpos for _, qpos in self._seen]))

    def report(self, plan: Mapping[str, Any], settings: TaskSettings) -> TaskReport:
        """After the last look."""
        rig, ref = self._rig, self._ref
        final = self._error(self._seen[-1][1], rig.object_pose(ref, ref.n_ticks - 1))
        errors = np.array(self._errors)
        saturated = {
            rig.names[k]: float(self._saturated[k] * self._tick) for k in np.flatnonzero(self._saturated).tolist()
        }
        points = [waypoint for segment in plan["segments"] for waypoint in segment["waypoints"]]
        return TaskReport(
            scene=rig.scene,
            settings=settings,
            duration=float(points[-1]["time"] - points[0]["time"]),
            lost=self._lost,
            final_position_error=final[0],
            final_angle_error=final[1],
            largest_position_error=float(errors[:, 0].max()),
            largest_angle_error=float(errors[:, 1].max()),
            holds=self._holds(),
            largest_joint_error=self._joint_error,
            saturated=saturated,
            contacts=tuple(self._touched),
        )

    def _holds(self) -> tuple[Hold, ...]:
        """One for each run of segments in which the same hand holds, and no support."""
        rig = self._rig
        found: list[Hold] = []
        data = mujoco.MjData(rig.model)
        segments: NDArray[np.int64] = np.array(self._segments, dtype=np.int64)
        for hand in rig.hands:
            holds = np.array([hand in held and all(name in rig.hands for name in held) for held in rig.held_by])
            first = 0
            while first < len(holds):
                last = first
                while last < len(holds) and holds[last]:
                    last += 1
                within: list[int] = np.flatnonzero((segments >= first) & (segments < last)).tolist()
                if last > first and within:
                    poses = [self._in_hand(data, hand, self._seen[k][1]) for k in (within[0], within[-1])]
                    found.append(Hold(hand, first, last - 1, *_apart(poses[0], poses[1], self._center)))
                first = max(last, first + 1)
        return tuple(sorted(found, key=lambda hold: hold.first_segment))

    def _in_hand(self, data: Any, hand: str, qpos: Array) -> tuple[Array, Array]:
        rig = self._rig
        data.qpos[:] = qpos
        mujoco.mj_kinematics(rig.model, data)
        base, turn = data.xpos[rig.bases[hand]], data.xmat[rig.bases[hand]].reshape(3, 3)
        at = rig.object_qpos
        return turn.T @ (qpos[at : at + 3] - base), turn.T @ rotation_matrices(qpos[at + 3 : at + 7])


def _apart(first: tuple[Array, Array], last: tuple[Array, Array], center: Array) -> tuple[float, float]:
    way = last[0] + last[1] @ center - first[0] - first[1] @ center
    cosine = 0.5 * (float(np.trace(first[1].T @ last[1])) - 1.0)
    return float(np.linalg.norm(way)), math.acos(min(1.0, max(-1.0, cosine)))


def _pose(position: float, angle: float) -> str:
    return f"{1e3 * position:.2f} mm {math.degrees(angle):.2f} deg"
