"""One episode: drawn by its key, planned, judged as it is stored, and made a row."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from .._errors import InputError
from .._model import Pose, Scene
from .._plan import Plan
from .._planning import check, plan, plan_pick_and_place
from .._result import Failure, Report
from .._robot_plan import RobotPlan
from .draws import canonical, key_of
from .packing import Row, Unpackable, pack, unpack
from .schema import empty_row
from .specification import PICK_AND_PLACE, TaskSpec


def episode_key(task: TaskSpec, index: int) -> str:
    """The key of episode `index`: nothing else decides what it is."""
    return key_of(task.hash, index)


def seed_of_key(key: str) -> int:
    """Seed of the planner: 63 bits of the key, which every format holds."""
    return int(key[:16], 16) >> 1


def drawn(task: TaskSpec, key: str) -> dict[str, Any]:
    """What varies in the scene, by the dotted key of its file."""
    return {name: draw.value(key, name) for name, draw in task.vary.items()}


def scene_of(task: TaskSpec, values: Mapping[str, Any]) -> Scene:
    """The scene of an episode. Raises `InputError` where the values make no scene."""
    return task.scene.with_keys(values) if values else task.scene


def row_of(task: TaskSpec, index: int) -> Row:
    """Plans episode `index`. Whatever happens is a row."""
    key = episode_key(task, index)
    values, seed = drawn(task, key), seed_of_key(key)
    row = empty_row()
    row.update(task=task.name, episode=index, key=key, seed=seed, values=canonical(values), solved=False)
    try:
        scene = scene_of(task, values)
        _describe(row, task, scene, seed)
        arguments = _arguments(task, key)
        row["method"] = arguments.get("method")
        planned = plan_pick_and_place if task.moves_a_robot else plan
        found = planned(scene, seed=seed, max_work=task.max_work, level=task.level, task=task.scene_task, **arguments)  # pyright: ignore
        if isinstance(found, Failure):
            _failed(row, found)
        else:
            _planned(row, task, found, scene)
        if row["solved"] and task.replay is not None:
            from .replaying import replayed, task_replayed

            (task_replayed if task.moves_a_robot else replayed)(row, task.replay, scene)
    except InputError as error:
        row.update(outcome="input_refused", message=_first_line(error), causes=canonical([each.code for each in error.diagnostics]))
    except Unpackable as error:
        row.update(outcome="not_storable", message=str(error))
    return row


def plan_of(row: Mapping[str, Any]) -> Plan | RobotPlan:
    """The plan that a row of a solved episode holds."""
    return _plan_in(unpack(row), f"{row['task']}/{row['episode']}")


def judged(found: Plan | RobotPlan, scene: Scene, level: str) -> Report:
    """What the checker says of a plan in its scene."""
    if isinstance(found, RobotPlan):
        return found.check(scene, level=level)
    return check(found, scene, level=level)  # pyright: ignore


def _plan_in(content: Mapping[str, Any], name: str = "plan.json") -> Plan | RobotPlan:
    kind = RobotPlan if content["task"] == PICK_AND_PLACE else Plan
    return kind.from_json(json.dumps(content), name=name)


def _arguments(task: TaskSpec, key: str) -> dict[str, Any]:
    arguments: dict[str, Any] = {}
    settings: dict[str, Any] = {}
    for name, draw in task.vary_plan.items():
        value = draw.value(key, f"plan.{name}")
        if name.startswith("settings."):
            *parents, last = name.removeprefix("settings.").split(".")
            place = settings
            for parent in parents:
                place = place.setdefault(parent, {})
            place[last] = value
        else:
            arguments[name] = value
    return {**arguments, "settings": settings} if settings else arguments


def _describe(row: Row, task: TaskSpec, scene: Scene, seed: int) -> None:
    asked = next((each for each in scene.tasks if each.name == task.scene_task), scene.tasks[0])
    body = next(each for each in scene.objects if each.name == asked.object)
    query = scene.query(seed, task=task.scene_task)
    row.update(
        object_kind=body.shape.kind,
        object_size=body.shape.high - body.shape.low,
        object_mass=body.mass,
        object_friction=body.friction,
        start_pose=_pose(query.start),
        goal_pose=_pose(query.goal),
        goal_angle=_angle(query.start, query.goal),
    )


def _pose(pose: Pose) -> list[float]:
    return [*pose.position.tolist(), *pose.quat_xyzw.tolist()]


def _angle(one: Pose, other: Pose) -> float:
    """Between two orientations, in radians; to nine digits, because arc cosines differ between machines in the last."""
    return float(f"{2 * math.acos(min(1.0, abs(float(one.quat_xyzw @ other.quat_xyzw)))):.9g}")


def _failed(row: Row, failure: Failure) -> None:
    causes = [{"reason": cause.reason, "count": cause.count} for cause in failure.causes]
    row.update(outcome=failure.kind, message=failure.message, causes=canonical(causes), work=failure.statistics.get("work"))
    miss = failure.nearest_miss
    if miss is not None:
        row.update(nearest_angle=miss.angle_left, nearest_distance=miss.distance_left, nearest_joints=list(miss.joints))


def _planned(row: Row, task: TaskSpec, found: Plan | RobotPlan, scene: Scene) -> None:
    content = json.loads(found.to_json())
    work = content["statistics"]["work"]
    for exact in (False, True):
        packed = pack(content, exact=exact)
        report = judged(_plan_in(unpack(packed)), scene, task.level)
        if report:
            row.update(packed)
            _judged(row, content, report)
            return
    row.update(outcome="rejected", message="the checker rejects the plan as its columns hold it", work=work)


def _judged(row: Row, content: Mapping[str, Any], report: Report) -> None:
    statistics = content["statistics"]
    row.update(
        outcome="planned",
        solved=True,
        work=statistics["work"],
        method=content["method"],
        duration=float(np.asarray(row["time"])[-1]),
        n_waypoints=len(row["time"]),
        transfers=statistics.get("transfers"),
        relocations=statistics.get("relocations"),
        margin=report.min_margin,
        clearance=None if report.min_clearance is None else report.min_clearance.distance,
        slip=report.max_hold_slip,
    )


def _first_line(error: InputError) -> str:
    return str(error).splitlines()[0]
