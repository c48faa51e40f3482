"""Settings, looked at when they are made: every one has a rule that says what it may be."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, cast

import numpy as np

from .._errors import argument_error

#: Largest number of any setting. Logs hold no larger ones.
LARGEST = 1e9


@dataclass(frozen=True)
class Rule:
    """What a setting may be."""

    is_right: Callable[[Any], bool]
    expected: str


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def number(expected: str, *, above: float | None = None, least: float = 0.0, most: float = LARGEST) -> Rule:
    """A finite number from ``least`` to ``most``; with ``above``, one that is larger than that."""
    bound = f"above {above:g}" if above is not None else f"from {least:g}"
    upper = "" if most == LARGEST else f" to {most:g}" if above is None else f" and at most {most:g}"

    def is_right(value: Any) -> bool:
        return _is_number(value) and value <= most and (value > above if above is not None else value >= least)

    return Rule(is_right, f"{expected} {bound}{upper}")


def count(least: int, most: int = 2**63) -> Rule:
    """A whole number from ``least`` on."""

    def is_right(value: Any) -> bool:
        return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most

    return Rule(is_right, f"a whole number from {least} on" if most == 2**63 else f"a whole number from {least} to {most}")


def choice(*words: str) -> Rule:
    """One of these words."""
    return Rule(lambda value: isinstance(value, str) and value in words, "one of " + ", ".join(f'"{word}"' for word in words))


def optional(rule: Rule) -> Rule:
    """The same, or None."""
    return Rule(lambda value: value is None or rule.is_right(value), f"None, or {rule.expected}")


def instance(kind: type) -> Rule:
    """An object of this class."""
    return Rule(lambda value: isinstance(value, kind), f"an object of the class {kind.__module__}.{kind.__name__}")


#: On or off.
FLAG = Rule(lambda value: isinstance(value, bool), "True or False")
METRES = number("metres")
METRES_ABOVE_0 = number("metres", above=0.0)
RADIANS = number("radians")
RADIANS_ABOVE_0 = number("radians", above=0.0)
SECONDS = number("seconds")
SECONDS_ABOVE_0 = number("seconds", above=0.0)
NEWTONS = number("newtons")
FACTOR = number("a factor")
FACTOR_ABOVE_0 = number("a factor", above=0.0)
SHARE_ABOVE_0 = number("a share", above=0.0, most=1.0)
SEED = count(0)


def plain_number(value: Any) -> Any:
    """Python's number, of one of numpy's; all else as it is."""
    return cast(Any, value.item()) if isinstance(value, np.generic) else value


def check_settings(settings: Any, rules: Mapping[str, Rule]) -> None:
    """Raises ``InputError`` (A510) for the first setting of a dataclass that its rule refuses. numpy's numbers become Python's, which logs
    can hold."""
    name = type(settings).__name__
    for field in fields(settings):
        given = getattr(settings, field.name)
        value = plain_number(given)
        if value is not given:
            object.__setattr__(settings, field.name, value)
        rule = rules[field.name]
        if not rule.is_right(value):
            raise argument_error(name, field.name, f"is {value!r}", rule.expected)


#: Of ``ExecutorSettings``.
EXECUTOR: Mapping[str, Rule] = {
    "feedback": FLAG,
    "largest_offset": METRES,
    "replanning": FLAG,
    "slip_trigger": FLAG,
    "anytime": FLAG,
    "reached_distance": METRES,
    "reached_turn": RADIANS,
    "settled_distance": METRES,
    "settled_turn": RADIANS,
    "settled_after": SECONDS,
    "settle_time": SECONDS,
    "rest_time": SECONDS,
    "blend_time": SECONDS_ABOVE_0,
    "deviation_distance": METRES_ABOVE_0,
    "deviation_turn": RADIANS_ABOVE_0,
    "resume_within": SECONDS,
    "resume_after": SECONDS,
    "resume_share": FACTOR,
    "sudden_within": SECONDS,
    "most_resumes": count(0),
    "least_progress": SECONDS,
    "slip_distance": METRES_ABOVE_0,
    "slip_round": METRES_ABOVE_0,
    "lost_after": SECONDS,
    "lost_force": NEWTONS,
    "stall_error": RADIANS_ABOVE_0,
    "stall_after": SECONDS,
    "pose_time_constant": SECONDS_ABOVE_0,
    "jump_distance": METRES_ABOVE_0,
    "jump_turn": RADIANS_ABOVE_0,
    "jump_count": count(1),
    "stale_after": SECONDS_ABOVE_0,
    "patience": SECONDS_ABOVE_0,
    "grip": choice("usual", "firm after trouble", "firm"),
    "reflex_press": FACTOR,
    "reflex_force": NEWTONS,
    "reflex_time": SECONDS,
    "reflex_release": SECONDS_ABOVE_0,
    "back_off_time": SECONDS,
    "gone_distance": METRES,
    "gone_after": SECONDS,
    "project_distance": METRES_ABOVE_0,
    "project_turn": RADIANS_ABOVE_0,
    "last_reach": number("a factor", least=1.0),
    "most_retreats": count(0),
    "attempts": count(1),
    "most_detours": count(0),
    "again_speed": SHARE_ABOVE_0,
    "again_share": SHARE_ABOVE_0,
    "again_speed_round": SHARE_ABOVE_0,
    "again_share_round": SHARE_ABOVE_0,
    "regrips_round": FLAG,
    "threads": count(1, 1024),
    "plan_attempts": count(1),
    "choices": count(1),
    "choice_work": count(0),
    "max_work": count(0),
    "time_limit": optional(number("seconds", above=0.0, most=1e7)),
    "work_rate": number("configurations per second", above=0.0),
    "planning_overhead": SECONDS,
    "seed": SEED,
}

#: Of the cameras, encoders and pushes of ``PlantSettings`` and ``ForeignSettings``, but for what only one of them has.
SENSING: Mapping[str, Rule] = {
    "pose_rate": number("poses per second", above=0.0, most=1e6),
    "pose_noise": METRES,
    "pose_turn_noise": RADIANS,
    "joint_noise": RADIANS,
    "seed": SEED,
}

#: Of ``PlantSettings``, but for ``simulation``.
PLANT: Mapping[str, Rule] = {
    **SENSING,
    "pose_delay": SECONDS,
    "feels_forces": FLAG,
    "push": NEWTONS,
    "push_every": SECONDS_ABOVE_0,
    "push_time": SECONDS,
}

#: Of the settings of a simulation, those that plants and executors use.
SIMULATION: Mapping[str, Rule] = {
    "friction_scale": FACTOR_ABOVE_0,
    "mass_scale": FACTOR_ABOVE_0,
    "stiffness_scale": FACTOR_ABOVE_0,
    "speed": FACTOR_ABOVE_0,
    "feedback_gain": FACTOR,
    "largest_offset": METRES,
    "torsion": optional(METRES),
    "torsion_told": optional(METRES),
    "tick": number("seconds", above=0.0, most=1.0),
    "grip_time": SECONDS,
}

#: Of ``ForeignSettings``.
FOREIGN: Mapping[str, Rule] = {
    **SENSING,
    "tick": number("seconds", above=0.0, most=1.0),
    "grip_time": SECONDS,
    "carries_hand": FLAG,
    "friction": optional(FACTOR),
    "impratio": optional(FACTOR_ABOVE_0),
}


def check_simulation(owner: str, simulation: Any) -> None:
    """Raises ``InputError`` (A510) for settings of a simulation that no run can have. owner: whose argument they are."""
    for name, rule in SIMULATION.items():
        value = plain_number(getattr(simulation, name))
        if not rule.is_right(value):
            raise argument_error(owner, name, f"is {value!r}", rule.expected)
