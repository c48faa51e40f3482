"""Sessions: many queries of one scene that is open."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _regrasp
from ._arguments import StrPath, level_of, real, real_numbers, seconds, seed_of, shown, whole
from ._errors import argument_error
from ._model import FloatArray, Pose, Scene, load_scene, pose_of
from ._plan import Plan
from ._planning import MAX_THREADS, Level, _listener, _settings_text
from ._result import Failure, Progress, Report, failure_of, report_of

Touching = Literal["holds", "slides", "free"]


@dataclass(frozen=True, eq=False)
class Start:
    """A valid start near an observed state, as `Session.project` found it. True, as opposed to a `Failure`."""

    world_from_object: Pose
    joints: FloatArray
    """(j,): in the order of `Hand.joint_names`."""
    holds: tuple[bool, ...]
    """For every finger whether it holds; the others are free."""
    touching: tuple[Touching, ...]
    """What every finger was seen to do. A finger that slides holds in the start, as soon as it rests."""
    moved: Mapping[str, float]
    """How far the start is from what was observed: `object` and `tip` in metres, `object_turn` in radians, `joint` in either."""
    _native: _regrasp.Start

    def __bool__(self) -> bool:
        return True


@dataclass(frozen=True)
class QueryTimes:
    """What the last query of a session took, in seconds."""

    search: float
    check: float
    total: float

    @property
    def overhead(self) -> float:
        """What was neither search nor check."""
        return self.total - self.search - self.check


class Session:
    """A scene that is open for queries from where hand and object really are. Nothing is read after it was opened.

        session = regrasp.Session("scene.toml")
        start = session.project(pose, joints)
        plan = session.plan(start, goal) if start else start

    A session never changes; any number of threads may ask it.
    """

    def __init__(
        self,
        scene: Scene | StrPath,
        *,
        task: str | None = None,
        settings: Mapping[str, Any] | None = None,
        threads: int = 1,
        roadmap: StrPath | None = None,
    ) -> None:
        """Opens `scene` for the hand and the object of `task` (the first where nothing is said).

        settings: of the planner, with the keys of "settings" in a plan file. threads: that search at once. roadmap: a file that
        `regrasp roadmap build` wrote; queries are asked of it first, and searched where it has no plan that the checker accepts.
        Raises `InputError`, also for tasks of finger tracking.
        """
        self.scene = scene if isinstance(scene, Scene) else load_scene(scene)
        text = None if settings is None else _settings_text(settings, "Session")
        n_threads = whole("Session", "threads", threads, 1, MAX_THREADS)
        graph = None if roadmap is None else os.fspath(roadmap)
        self._native = _regrasp.Session.open(self.scene._native, task, text, n_threads, graph)
        self._task = next(entry for entry in self.scene.tasks if task in (None, entry.name))
        self.hand = next(hand for hand in self.scene.hands if hand.name_in_scene == self._task.hand)
        """The hand that moves."""
        self.object = next(entry for entry in self.scene.objects if entry.name == self._task.object)
        """The object that it moves."""
        self._times = threading.local()

    @property
    def start(self) -> Pose:
        """World from object at the start of the task, as seed 0 draws it where the scene leaves it open."""
        return self.scene.query(task=self._task.name or None).start

    @property
    def times(self) -> QueryTimes | None:
        """Of the last `plan` that this thread asked for; None where it asked for none."""
        return getattr(self._times, "last", None)

    def project(
        self,
        world_from_object: Pose,
        joints: npt.ArrayLike,
        *,
        velocities: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike] | None = None,
        presses: Sequence[bool] | None = None,
        distance: float = 0.001,
        turn: float = 0.02,
        sliding: float = 0.002,
    ) -> Start | Failure:
        """The valid start nearest to what was observed, or why there is none.

        joints: (j,), in the order of `hand.joint_names`. velocities: of the joints, and of the object, linear and angular, in
        the world. presses: for every finger whether it is felt to press. distance, turn: how far the object, the fingertips
        and the joints may be moved, in metres and radians. sliding: from which relative speed on a contact slides.
        """
        values = real_numbers(joints)
        if values is None:
            expected = "one number per joint, in the order of Session.hand.joint_names"
            raise argument_error("Session.project", "joints", f"is {shown(joints)}", expected)
        if values.ndim != 1:
            raise argument_error("Session.project", "joints", f"has shape {values.shape}", "one number per joint")
        asked: dict[str, Any] = {
            "pose": _parts("Session.project", "world_from_object", world_from_object),
            "joints": values.tolist(),
            "velocities": None,
            "presses": None if presses is None else _presses(presses, len(self.hand.fingers)),
            "distance": real("Session.project", "distance", distance, lambda value: value > 0, "metres above 0"),
            "turn": real("Session.project", "turn", turn, lambda value: value > 0, "radians above 0"),
            "sliding": real("Session.project", "sliding", sliding, lambda value: value > 0, "metres per second above 0"),
        }
        if velocities is not None:
            asked["velocities"] = _velocities(velocities, len(self.hand.joint_names))
        found, failure = self._native.project(asked)
        if found is None:
            return failure_of(str(failure))
        fields: dict[str, Any] = json.loads(found.describe())
        return Start(
            world_from_object=pose_of(fields["world_from_object"]),
            joints=np.array(fields["joints"]),
            holds=tuple(fields["holds"]),
            touching=tuple(fields["touching"]),
            moved=fields["moved"],
            _native=found,
        )

    def plan(
        self,
        start: Start,
        goal: Pose,
        *,
        seed: int = 0,
        max_work: int = 1_000_000,
        time_limit: float | None = None,
        level: Level = "motion",
        progress: Callable[[Progress], object] | None = None,
    ) -> Plan | Failure:
        """A plan from `start` to `goal`, a pose of the object in the world, that the checker accepts; or a `Failure`.

        The plan brings what it was asked, so that `check` and `regrasp check` judge its file. seed, max_work, time_limit,
        level, progress: as in `regrasp.plan`. A failure says what stopped the search, but not which change of the scene would have
        helped: trying that takes time, and `regrasp.plan` does.
        """
        _must_be(Start, start, "Session.plan", "start", "a Start of Session.project; look whether it is one before you plan")
        asked: dict[str, Any] = {
            "goal": _parts("Session.plan", "goal", goal),
            "seed": seed_of("Session.plan", seed),
            "max_work": whole("Session.plan", "max_work", max_work, 0, 2**64 - 1),
            "time_limit": seconds("Session.plan", "time_limit", time_limit),
            "level": level_of("Session.plan", level),
            "progress": None if progress is None else _listener(progress),
        }
        found, outcome, times = self._native.plan(start._native, asked)
        self._times.last = QueryTimes(*times)
        if found is None:
            return failure_of(outcome)
        made = Plan(found, report=report_of(json.loads(outcome)))
        made._source = self.scene
        return made

    def check(self, plan: Plan, *, level: Level = "motion") -> Report:
        """Judges a plan against the query that it brings; one that brings none against the scene's task."""
        _must_be(Plan, plan, "Session.check", "plan", "a Plan")
        return report_of(json.loads(self._native.check(plan._native, level_of("Session.check", level))))

    def __repr__(self) -> str:
        return f"<Session {self.scene.name!r}: {self._task.hand} and {self.object.name!r}>"


def _must_be(kind: type, value: Any, function: str, name: str, expected: str) -> None:
    if not isinstance(value, kind):
        was = f"is a Failure: {value.message}" if isinstance(value, Failure) else f"is {shown(value)}"
        raise argument_error(function, name, was, expected)


def _presses(values: Any, n_fingers: int) -> list[bool]:
    expected = f"{n_fingers} of True or False, one per finger of Session.hand.fingers"
    pressing: list[Any] = [] if isinstance(values, (str, bytes)) or not hasattr(values, "__len__") else list(values)
    if len(pressing) != n_fingers or not all(isinstance(value, (bool, int, np.bool_)) for value in pressing):
        raise argument_error("Session.project", "presses", f"is {shown(values)}", expected)
    return [bool(value) for value in pressing]


def _velocities(values: Any, n_joints: int) -> tuple[list[float], list[float], list[float]]:
    expected = f"finite numbers: {n_joints} of the joints, 3 of the object's motion, 3 of its turn"
    if isinstance(values, (str, bytes)) or not hasattr(values, "__len__") or len(values) != 3:
        raise argument_error("Session.project", "velocities", f"is {shown(values)}", expected)
    found: list[list[float]] = []
    for entry, n in zip(values, (n_joints, 3, 3)):
        array = real_numbers(entry)
        if array is None or array.shape != (n,) or not np.isfinite(array).all():
            raise argument_error("Session.project", "velocities", f"has {shown(entry)}", expected)
        found.append(array.tolist())
    return found[0], found[1], found[2]


def _parts(function: str, name: str, pose: Any) -> tuple[list[float], list[float]]:
    if not isinstance(pose, Pose):
        raise argument_error(function, name, f"is {shown(pose)}", "a regrasp.Pose")
    position = np.asarray(pose.position, dtype=np.float64)
    quat = np.asarray(pose.quat_xyzw, dtype=np.float64)
    if position.shape != (3,) or quat.shape != (4,) or not (np.isfinite(position).all() and np.isfinite(quat).all()):
        raise argument_error(function, name, f"is {pose!r}", "a pose of finite numbers")
    norm = float(np.linalg.norm(quat))
    if abs(norm - 1.0) > 1e-2:
        raise argument_error(function, name, f"has a quaternion of length {norm:.3g}", "a unit quaternion")
    return position.tolist(), (quat / norm).tolist()
