"""What happened: samples, events, legs and goals of a run."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from .. import _regrasp
from .._plan import Plan

FORMAT = "regrasp-run"
FORMAT_VERSION = 1
#: ``GoalResult.why_not`` of a goal that the run ended at begins so.
NOT_FINISHED = "not finished: "


@dataclass(frozen=True)
class Event:
    """Something that was not planned, and what was done about it."""

    time: float
    kind: str
    """docs/reference/run-format.md lists the kinds."""
    message: str
    answer: str
    """``hold``, ``resume``, ``back``, ``replan``, ``ignore``, ``give_up`` or ``none``."""
    goal: int
    leg: int


@dataclass(frozen=True)
class Sample:
    """One moment. Distances in metres, of the centre of mass; angles in radians."""

    time: float
    leg: int
    tick: int
    """Of the leg."""
    state: str
    """``run``, ``blend``, ``hold`` or ``settle``."""
    distance: float
    """Of the estimated object from where the leg has it."""
    angle: float
    true_distance: float | None
    """The same of the real object, where the plant knows it."""
    true_angle: float | None
    slip: float
    """Of the fingertip that slipped farthest."""
    forces: list[float] | None
    """Felt at every fingertip."""
    joint_error: float
    """Of the joint that is farthest from what it was told."""


@dataclass(frozen=True)
class LegRecord:
    """A plan that was executed."""

    start_time: float
    goal: int
    seed: int
    duration: float
    """Of its motion."""
    search_seconds: float
    check_seconds: float
    overhead_seconds: float
    moved: Mapping[str, float]
    """How far its start is from what was observed."""
    prepared: bool
    """True where it was planned while the leg before ran."""
    free: list[str]
    """Fingers that were free at its start."""


@dataclass(frozen=True)
class GoalResult:
    """What became of a goal."""

    position: list[float]
    quat_xyzw: list[float]
    reached: bool
    start_time: float
    time: float
    legs: int
    motion_time: float
    """Time in which the hand moved, in seconds."""
    turn: float
    """From the goal before, in radians."""
    distance: float
    """Of the estimated object from the goal at the end,"""
    angle: float
    true_distance: float | None
    """and of the real one, where the plant knows it."""
    true_angle: float | None
    why_not: str
    """Empty where it was reached."""

    @property
    def is_finished(self) -> bool:
        """False for the goal that the run ended at."""
        return not self.why_not.startswith(NOT_FINISHED)


@dataclass
class RunLog:
    """All of a run."""

    scene: str = ""
    status: str = "running"
    """``done``, ``gave_up``, ``lost``, ``interrupted`` or ``running``: docs/reference/run-format.md."""
    message: str = ""
    settings: dict[str, Any] = field(default_factory=dict[str, Any])
    samples: list[Sample] = field(default_factory=list[Sample])
    events: list[Event] = field(default_factory=list[Event])
    legs: list[LegRecord] = field(default_factory=list[LegRecord])
    goals: list[GoalResult] = field(default_factory=list[GoalResult])
    plans: list[Plan] = field(default_factory=list[Plan])
    """One per leg."""

    def add(self, happening: Event | GoalResult) -> None:
        """Takes over an event, or what became of a goal."""
        if isinstance(happening, Event):
            self.events.append(happening)
        else:
            self.goals.append(happening)

    @property
    def n_reached(self) -> int:
        """Goals that were reached."""
        return sum(goal.reached for goal in self.goals)

    @property
    def n_replans(self) -> int:
        """Legs beyond one per goal."""
        return sum(max(goal.legs - 1, 0) for goal in self.goals)

    def to_json(self) -> dict[str, Any]:
        """Plain data; docs/reference/run-format.md has the keys. Plans are not in it."""
        content = asdict(self._without_plans())
        del content["plans"]
        return {"format": FORMAT, "format_version": FORMAT_VERSION, **content}

    def _without_plans(self) -> RunLog:
        return RunLog(self.scene, self.status, self.message, self.settings, self.samples, self.events, self.legs, self.goals)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes ``run.json``, and beside it the plan of every leg, as ``run.leg1.json`` and on: each is a plan file that
        ``regrasp check`` judges."""
        where = Path(path)
        where.write_bytes(self._bytes())
        for number, plan in enumerate(self.plans, start=1):
            plan.save(where.with_name(f"{where.stem}.leg{number}.json"))

    def page(self, path: str | os.PathLike[str], title: str | None = None) -> None:
        """Writes the page of the run: one HTML file, the same as ``regrasp view run.json`` makes."""
        plans = [plan._native for plan in self.plans]
        Path(path).write_text(_regrasp.run_page(self._bytes(), plans, title), encoding="utf-8")

    def _bytes(self) -> bytes:
        return (json.dumps(self.to_json(), allow_nan=False) + "\n").encode()

    @staticmethod
    def load(path: str | os.PathLike[str]) -> RunLog:
        """Reads ``run.json``, and the plans of its legs beside it up to the first that is not there.

        Raises ``InputError`` with the codes of docs/reference/run-format.md.
        """
        where = Path(path)
        content: dict[str, Any] = json.loads(_regrasp.run_file(str(where)))
        found: list[Plan] = []
        for number in range(1, len(content["legs"]) + 1):
            leg = where.with_name(f"{where.stem}.leg{number}.json")
            if not leg.exists():
                break
            found.append(Plan.from_file(leg))
        return RunLog(
            scene=content["scene"],
            status=content["status"],
            message=content["message"],
            settings=content["settings"],
            samples=[Sample(**entry) for entry in content["samples"]],
            events=[Event(**entry) for entry in content["events"]],
            legs=[LegRecord(**entry) for entry in content["legs"]],
            goals=[GoalResult(**entry) for entry in content["goals"]],
            plans=found,
        )
