"""Goals one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from .._errors import argument_error
from .._model import Pose
from ..simulate.reference import Array, quat_exp, quat_inverse, quat_product, rotation_vector
from .guards import check_goal


def turns(start: Pose, *, count: int, seed: int = 0, largest: float = float(np.pi / 2), axis: Array | None = None) -> Iterator[Pose]:
    """``count`` goals at the start's position, each turned from the one before about a random axis by up to ``largest`` radians.

    axis: a fixed axis of the world in place of random ones.
    """
    rng = np.random.default_rng(seed)
    quat = np.array(start.quat_xyzw)[[3, 0, 1, 2]]
    for _ in range(count):
        direction = rng.normal(size=3) if axis is None else np.array(axis, dtype=np.float64)
        angle = rng.uniform(0.0 if axis is None else -largest, largest)
        quat = quat_product(quat_exp(angle * direction / np.linalg.norm(direction)), quat)
        quat = quat / np.linalg.norm(quat)
        w = -quat if quat[0] < 0.0 else quat
        yield Pose(np.array(start.position), w[[1, 2, 3, 0]].copy())


def between(start: Pose, goal: Pose, share: float) -> Pose:
    """The pose that is this share of the way from ``start`` to ``goal``."""
    first, last = (np.array(pose.quat_xyzw)[[3, 0, 1, 2]] for pose in (start, goal))
    turned = quat_product(quat_exp(share * rotation_vector(quat_product(last, quat_inverse(first)))), first)
    return Pose((1.0 - share) * np.array(start.position) + share * np.array(goal.position), turned[[1, 2, 3, 0]])


def towards(start: Pose, goal: Pose, turn: float) -> Pose:
    """The pose on the way from ``start`` to ``goal`` at which the object has turned by so much, in radians; no farther than the goal."""
    whole = 2.0 * float(np.arccos(min(1.0, abs(float(np.dot(start.quat_xyzw, goal.quat_xyzw))))))
    return between(start, goal, min(1.0, turn / max(whole, 1e-12)))


@dataclass
class Present:
    """The goal that the run is at."""

    goal: Pose
    started: float
    before: Array
    """Orientation of the goal before, w x y z."""
    motion_time: float = 0.0

    @property
    def quat(self) -> Array:
        """Orientation, w x y z."""
        return np.array(self.goal.quat_xyzw)[[3, 0, 1, 2]]


class Upcoming:
    """The goals of an iterable, with a look ahead. An iterable that has no goal for now yields ``None``, and is asked again."""

    def __init__(self, goals: Iterable[Pose | None]) -> None:
        self._withdrawn: Callable[[Pose], bool] | None = getattr(goals, "is_withdrawn", None)
        if isinstance(goals, (str, bytes)) or not hasattr(goals, "__iter__"):
            raise argument_error("Executor.run", "goals", f"is {goals!r}", "an iterable of regrasp.Pose: [pose] for a single goal")
        self._goals = iter(goals)
        self._ahead: Pose | None = None
        self._n_seen = 0
        self._error: Exception | None = None
        """What is wrong with the next goal. The present one is finished first."""
        self.has_ended = False

    def peek(self) -> Pose | None:
        """The next goal, if it is there by now, and a good one."""
        if self._ahead is None and not self.has_ended and self._error is None:
            try:
                goal = next(self._goals)
                if goal is not None:
                    self._n_seen += 1
                    self._ahead = check_goal(goal, self._n_seen)
            except StopIteration:
                self.has_ended = True
            except Exception as error:
                self._error = error
        return self._ahead

    def take(self) -> Pose | None:
        """The same, and goes on to the one after. Raises what the iterable raised, and ``InputError`` for a goal that is no good one."""
        goal, self._ahead = self.peek(), None
        if goal is None and self._error is not None:
            raise self._error
        return goal

    def is_withdrawn(self, goal: Pose) -> bool:
        """True where the iterable says that this goal is not wanted any more."""
        return self._withdrawn is not None and self._withdrawn(goal)
