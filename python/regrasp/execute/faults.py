"""A plant between the executor and another one, which breaks what passes: for tests, and to see what a robot would do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .plant import Command, Observation, Plant


class FaultyPlant:
    """Changes observations and commands of ``plant`` while a fault lasts. What it does not change is the plant's own."""

    def __init__(
        self,
        plant: Plant,
        *,
        observe: Callable[[Observation], Observation] | None = None,
        apply: Callable[[Command], Command] | None = None,
        begin: float = 0.0,
        end: float = float("inf"),
    ) -> None:
        """observe: makes a faulty observation of a good one. apply: makes of the command given the one that is carried out.
        begin, end: when, on the plant's clock."""
        self._plant = plant
        self._observe = observe
        self._apply = apply
        self._begin, self._end = begin, end
        self._time = 0.0
        self.joint_names = plant.joint_names
        self.fingers = plant.fingers
        self.tick = plant.tick
        for name in ("truth", "rig", "data", "scene", "pose", "wait", "holding"):
            if hasattr(plant, name):
                setattr(self, name, getattr(plant, name))

    def observe(self) -> Observation:
        """What the plant has, or what the fault makes of it."""
        seen = self._plant.observe()
        self._time = seen.time
        return self._observe(seen) if self._observe is not None and self._lasts else seen

    def apply(self, command: Command) -> None:
        """Passes the command on, or what the fault makes of it."""
        self._plant.apply(self._apply(command) if self._apply is not None and self._lasts else command)

    @property
    def _lasts(self) -> bool:
        return self._begin <= self._time < self._end


def pose_jumps(distance: float) -> Callable[[Observation], Observation]:
    """The object is seen elsewhere, in metres."""

    def broken(seen: Observation) -> Observation:
        if seen.object_position is None:
            return seen
        return replace(seen, object_position=seen.object_position + np.array([distance, 0.0, 0.0]))

    return broken


def pose_is_nan(seen: Observation) -> Observation:
    """The object's pose is no number."""
    return replace(seen, object_position=np.full(3, np.nan))


def pose_is_stale() -> Callable[[Observation], Observation]:
    """The first pose of the fault is repeated for ever."""
    kept: list[Observation] = []

    def broken(seen: Observation) -> Observation:
        if not kept:
            kept.append(seen)
        old = kept[0]
        return replace(
            seen, pose_stamp=old.pose_stamp, object_position=old.object_position, object_quat_wxyz=old.object_quat_wxyz
        )

    return broken


def stamps_run_ahead(seen: Observation) -> Observation:
    """Poses come from the future."""
    return replace(seen, pose_stamp=None if seen.pose_stamp is None else seen.pose_stamp + 5.0)


def joints_are_missing(joints: list[int]) -> Callable[[Observation], Observation]:
    """These joints are not seen."""

    def broken(seen: Observation) -> Observation:
        values = seen.joints.copy()
        values[joints] = np.nan
        return replace(seen, joints=values)

    return broken


def finger_is_stuck(joints: list[int]) -> Callable[[Command], Command]:
    """These joints keep the command that they had when the fault began."""
    kept: list[Command] = []

    def broken(command: Command) -> Command:
        if not kept:
            kept.append(command)
        servo = command.servo.copy()
        servo[joints] = kept[0].servo[joints]
        return replace(command, servo=servo)

    return broken
