"""Replays of plans in MuJoCo: what a plan is worth where things slip, give and fall.

    from regrasp.simulate import simulate
    report = simulate("plan.json", gravity="down")
    print(report.kept, report.final_position_error)

``python -m regrasp.simulate plan.json`` does the same; ``docs/simulate.md`` says what is simulated and how. Needs the extra
``sim``: ``pip install "regrasp[sim]"``.
"""

from __future__ import annotations

from .measure import Dropped, LostContact, Report, UnplannedContact, report
from .model import Settings
from .reference import PlanError
from .run import Replay, simulate
from .replay import Drift, Track

__all__ = [
    "Drift",
    "Dropped",
    "LostContact",
    "PlanError",
    "Replay",
    "Report",
    "Settings",
    "Track",
    "UnplannedContact",
    "report",
    "simulate",
]
