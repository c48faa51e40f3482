"""What a caller gives to an executor, looked at before the first command."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from .._arguments import real_numbers, shown
from .._errors import argument_error
from .._model import Hand, Pose
from ..simulate.model import Settings
from ..simulate.reference import Array
from .plant import Command, Observation
from .settings_check import check_simulation, plain_number

#: A coordinate, an angle or a force beyond this was not observed, and is no goal: a sensor or a program is broken.
BELIEVABLE = 1e6
#: How far the length of a goal's quaternion may be from one.
QUATERNION_TOLERANCE = 1e-2
#: Longest time between two commands, in seconds.
LONGEST_TICK = 1.0


def check_plant(plant: Any, hand: Hand) -> None:
    """Raises ``InputError`` (A510) where a plant is not one of this hand: its joints or fingers have other names or another order."""
    for name in ("joint_names", "fingers", "tick", "observe", "apply"):
        if not hasattr(plant, name):
            raise argument_error("Executor", "plant", f'{type(plant).__name__} has no "{name}"', "the members of regrasp.execute.Plant")
    _check_names("joint_names", plant.joint_names, hand.joint_names, "session.hand.joint_names")
    _check_names("fingers", plant.fingers, [finger.name for finger in hand.fingers], "[finger.name for finger in session.hand.fingers]")
    if not 0.0 < real_number(plant.tick) <= LONGEST_TICK:
        raise argument_error("Executor", "plant", f"tick is {plant.tick!r}", f"seconds above 0, and at most {LONGEST_TICK:g}")


def _check_names(what: str, seen: Any, wanted: Sequence[str], source: str) -> None:
    expected = f"{len(wanted)} names in the order of the scene's hand: {', '.join(wanted)}. Take {source}"
    if isinstance(seen, (str, bytes)) or not isinstance(seen, (Sequence, np.ndarray)):
        raise argument_error("Executor", "plant", f"{what} is {seen!r}", expected)
    names: list[Any] = list(cast(Sequence[Any], seen))
    if names == list(wanted):
        return
    strange = [name for name in names if not isinstance(name, str)]
    if strange:
        raise argument_error("Executor", "plant", f"{what} has {strange[0]!r}, which is no string", expected)
    if len(names) != len(wanted):
        raise argument_error("Executor", "plant", f"{what} has {len(names)} names: {', '.join(names)}", expected)
    if sorted(names) == sorted(wanted):
        index = next(k for k, (a, b) in enumerate(zip(names, wanted)) if a != b)
        problem = f'{what} has the right names in another order: "{names[index]}" stands where "{wanted[index]}" belongs'
        raise argument_error("Executor", "plant", problem, f"{expected}, and reorder what the plant observes and applies")
    unknown = [name for name in names if name not in wanted] or [name for name in names if names.count(name) > 1]
    word = "is no name of the hand" if unknown[0] not in wanted else "is there twice"
    raise argument_error("Executor", "plant", f'{what} has "{unknown[0]}", which {word}', expected)


def checked_gains(stiffness: Any, damping: Any, n: int) -> tuple[Array | None, Array | None]:
    """Stiffness and damping as arrays. Raises ``InputError`` (A510) where they are no gains of ``n`` joints."""
    if damping is not None and stiffness is None:
        raise argument_error("Executor", "damping", "is given without stiffness", "both, or stiffness alone")
    return (
        None if stiffness is None else _gains("stiffness", stiffness, n, is_above_0=True),
        None if damping is None else _gains("damping", damping, n, is_above_0=False),
    )


def _gains(name: str, values: Any, n: int, *, is_above_0: bool) -> Array:
    expected = f"{n} finite numbers {'above 0' if is_above_0 else 'from 0'}, one per joint"
    gains = real_numbers(values)
    if gains is None or gains.shape != (n,):
        raise argument_error("Executor", name, f"is {shown(values)}", expected)
    wrong = ~(np.isfinite(gains) & ((gains > 0.0) if is_above_0 else (gains >= 0.0)))
    if wrong.any():
        index = int(np.flatnonzero(wrong)[0])
        raise argument_error("Executor", name, f"has {gains[index]} at index {index}", expected)
    return gains


def check_control(control: Any) -> None:
    """Raises ``InputError`` (A510) for settings of a replay that no run can have."""
    if not isinstance(control, Settings):
        raise argument_error("Executor", "control", f"is {shown(control)}", "regrasp.simulate.Settings")
    check_simulation("Executor", control)


def check_goal(goal: Any, number: int) -> Pose:
    """``goal`` itself. Raises ``InputError`` (A510) where it is no pose that an object can be brought to. number: from 1."""
    expected = "a regrasp.Pose of finite numbers in metres, with a unit quaternion x y z w"
    if not isinstance(goal, Pose):
        raise argument_error("Executor.run", "goals", f"goal {number} is {shown(goal)}", expected)
    position, quat = real_numbers(goal.position), real_numbers(goal.quat_xyzw)
    if position is None or position.shape != (3,) or quat is None or quat.shape != (4,):
        raise argument_error("Executor.run", "goals", f"goal {number} is {shown(goal)}", expected)
    if not (are_believable(position) and are_believable(quat)):
        raise argument_error("Executor.run", "goals", f"goal {number} is {shown(goal)}", f"{expected}; no number beyond {BELIEVABLE:g}")
    length = float(np.linalg.norm(quat))
    if abs(length - 1.0) > QUATERNION_TOLERANCE:
        raise argument_error("Executor.run", "goals", f"goal {number} has a quaternion of length {length:.3g}", expected)
    return goal


def checked_holding(holding: Any, n: int) -> Command:
    """A plant's ``holding``. Raises ``InputError`` (A510) where it is no command for ``n`` joints."""
    expected = f"a regrasp.execute.Command, each field {n} finite numbers"
    if not isinstance(holding, Command):
        raise argument_error("Executor", "plant", f"holding is {shown(holding)}", expected)
    for name in ("servo", "positions", "velocities"):
        values = real_numbers(getattr(holding, name))
        if values is None or values.shape != (n,) or not np.isfinite(values).all():
            raise argument_error("Executor", "plant", f"holding.{name} is {shown(getattr(holding, name))}", expected)
    return holding


def check_observation(plant: object, seen: object) -> Observation:
    """``seen`` itself. Raises ``InputError`` (A510) where it is no observation."""
    if isinstance(seen, Observation):
        return seen
    name = f"{type(plant).__name__}.observe"
    raise argument_error(name, "return value", f"is {shown(seen)}", "an object of the class regrasp.execute.Observation")


def real_number(value: Any) -> float:
    """A number; NaN where it is none."""
    plain = plain_number(value)
    if isinstance(plain, bool) or not isinstance(plain, (int, float)):
        return math.nan
    try:
        return float(plain)
    except OverflowError:
        return math.nan


def are_believable(values: Array) -> bool:
    """True where all are finite, and not absurdly large."""
    return bool((np.abs(values) <= BELIEVABLE).all())
