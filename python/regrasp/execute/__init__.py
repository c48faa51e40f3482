"""Plans on a robot, real or simulated: observe, plan from there, move, observe again; goal after goal.

    plant = MujocoPlant.of("scene.toml")
    log = execute(plant, turns(plant.pose, count=5, seed=1))
    log.page("run.html")

``docs/how-to/execute.md`` leads through it. Needs the extra ``sim``: controllers take kinematics from MuJoCo also where the plant is
a robot.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .executor import Executor
    from .faults import FaultyPlant
    from .foreign_plant import ForeignPlant, ForeignSettings
    from .goals import turns
    from .holding import holding_command
    from .log import Event, GoalResult, RunLog
    from .mujoco_plant import MujocoPlant, PlantSettings
    from .one_call import execute
    from .plant import Command, Observation, Plant
    from .sessions import ExecutorSessions
    from .settings import ExecutorSettings

__all__ = [
    "Command",
    "Event",
    "Executor",
    "ExecutorSessions",
    "ExecutorSettings",
    "FaultyPlant",
    "ForeignPlant",
    "ForeignSettings",
    "GoalResult",
    "MujocoPlant",
    "Observation",
    "Plant",
    "PlantSettings",
    "RunLog",
    "execute",
    "holding_command",
    "turns",
]

_HOMES = {
    "Command": "plant",
    "Event": "log",
    "Executor": "executor",
    "ExecutorSessions": "sessions",
    "ExecutorSettings": "settings",
    "FaultyPlant": "faults",
    "ForeignPlant": "foreign_plant",
    "ForeignSettings": "foreign_plant",
    "GoalResult": "log",
    "MujocoPlant": "mujoco_plant",
    "Observation": "plant",
    "Plant": "plant",
    "PlantSettings": "mujoco_plant",
    "RunLog": "log",
    "execute": "one_call",
    "holding_command": "holding",
    "turns": "goals",
}


def __getattr__(name: str) -> Any:
    # MuJoCo is imported when it is needed.
    if name in ("faults", "planning"):
        return import_module(f".{name}", __name__)
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)
