"""Replays of episodes in MuJoCo, inside the worker that planned them."""

from __future__ import annotations

import json
import warnings
from typing import Any

import numpy as np

from .._model import Scene
from .._planning import export_mjcf
from .._plan import Plan
from .._robot_plan import RobotPlan
from .packing import Row, rounded, unpack
from .specification import NOISE, TASK_NOISE, Replay


def task_replayed(row: Row, settings: Replay, scene: Scene) -> None:
    """As `replayed`, for plans of pick and place."""
    from ..simulate.reference import PlanError
    from ..simulate.task import TaskSettings, replay

    noise = {key: getattr(settings, key).value(row["key"], f"replay.{key}") for key in TASK_NOISE}
    row.update({f"replay_{key}": value for key, value in noise.items()}, replay_controller=settings.controller, replay_kept=False)
    content = unpack(row)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = RobotPlan.from_json(json.dumps(content)).to_mjcf(scene)
        report, _, _ = replay(content, model, TaskSettings(controller=settings.controller, **noise))
    except PlanError as error:
        row["replay_cause"] = f"not replayed: {error}"
        return
    row.update(
        replay_kept=report.kept,
        replay_cause=report.lost.cause if report.lost else None,
        replay_final_position_error=report.final_position_error,
        replay_final_angle_error=report.final_angle_error,
        replay_largest_slip=max((hold.slip for hold in report.holds), default=0.0),
    )


def replayed(row: Row, settings: Replay, scene: Scene) -> None:
    """Replays the in-hand plan of a solved row in its scene and adds the outcome, with noise keyed by the episode."""
    from ..simulate.model import Settings
    from ..simulate.reference import PlanError
    from ..simulate.run import simulate

    noise = {key: getattr(settings, key).value(row["key"], f"replay.{key}") for key in NOISE}
    row.update({f"replay_{key}": value for key, value in noise.items()}, replay_controller=settings.controller, replay_kept=False)
    how = Settings(controller=settings.controller, **noise, hold_time=0.0)
    try:
        with warnings.catch_warnings():
            # Where the model differs from the scene is said in docs/reference/replay.md.
            warnings.simplefilter("ignore")
            model = export_mjcf(Plan.from_json(json.dumps(unpack(row))), scene)
        result = simulate(unpack(row), model, how)
    except PlanError as error:
        row["replay_cause"] = f"not replayed: {error}"
        return
    report = result.report
    row.update(
        replay_kept=report.kept,
        replay_cause=report.dropped.cause if report.dropped else None,
        replay_final_position_error=report.final_position_error,
        replay_final_angle_error=report.final_angle_error,
        replay_largest_slip=report.largest_slip,
        replay_contacts_lost=len(report.lost_contacts),
    )
    if settings.keep == "track":
        _keep_track(row, result)


def _keep_track(row: Row, result: Any) -> None:
    """The replayed motion, at every fifth tick: joints in the order of the plan, and the object's pose."""
    track, stride = result.track, 5
    model = result.rig.model
    columns = [int(model.joint(name).qposadr[0]) for name in result.rig.joint_names]
    quat_xyzw = track.object_quat_wxyz[::stride][:, [1, 2, 3, 0]]
    poses = np.concatenate([track.object_position[::stride], quat_xyzw], axis=1)
    row.update(
        replay_tick=stride * result.report.settings.tick,
        replay_joints=rounded(track.qpos[::stride][:, columns].copy(), 24).ravel(),
        replay_object_pose=rounded(poses, 24).ravel(),
    )
