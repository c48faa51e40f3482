"""Replays of plans in MuJoCo: what a plan is worth where things slip, give and fall.

    from regrasp.simulate import load, simulate
    plan, xml = load("plan.json")
    report = simulate(plan, xml).report
    print(report.kept, report.final_position_error)

``python -m regrasp.simulate plan.json`` does the same; ``docs/reference/replay.md`` says what is simulated and how. Needs the extra
``sim``: ``pip install "regrasp[sim]"``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .files import load
    from .measure import Dropped, LostContact, Report, UnplannedContact
    from .model import Settings
    from .reference import PlanError
    from .replay import Drift, Track
    from .run import Replay, simulate
    from .task import TaskReport, TaskSettings

__all__ = [
    "Drift",
    "Dropped",
    "LostContact",
    "PlanError",
    "Replay",
    "Report",
    "Settings",
    "TaskReport",
    "TaskSettings",
    "Track",
    "UnplannedContact",
    "load",
    "simulate",
]

_HOMES = {
    "Drift": "replay",
    "Dropped": "measure",
    "LostContact": "measure",
    "PlanError": "reference",
    "Replay": "run",
    "Report": "measure",
    "Settings": "model",
    "TaskReport": "task",
    "TaskSettings": "task",
    "Track": "replay",
    "UnplannedContact": "measure",
    "load": "files",
    "simulate": "run",
}


def __getattr__(name: str) -> Any:
    # MuJoCo chooses how to draw when it is imported: the command line has a say before that.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)
