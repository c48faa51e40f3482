"""Draws by key: what varies from episode to episode, the same on every machine, in any order.

A draw hashes the episode's key and its own name. Only sums, products, quotients and square roots are taken (which IEEE 754
defines to the last bit), but for logarithmic ranges; all numbers are rounded to nine digits.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, cast

from .tables import Table, short

Kind = Literal["constant", "range", "log_range", "integer", "choice", "direction", "quat_xyzw"]
KINDS: tuple[Kind, ...] = ("range", "log_range", "integer", "choice", "direction", "quat_xyzw")


def key_of(*parts: str | int) -> str:
    """SHA-256 of some texts and numbers, as hexadecimal digits."""
    return hashlib.sha256("\0".join(str(part) for part in parts).encode()).hexdigest()


def units(key: str, name: str) -> Iterator[float]:
    """Numbers in [0, 1), as many as are asked for."""
    counter = 0
    while True:
        digest = hashlib.sha256(f"{key}\0{name}\0{counter}".encode()).digest()
        for k in range(0, 32, 8):
            yield (int.from_bytes(digest[k : k + 8], "big") >> 11) / float(1 << 53)
        counter += 1


def rounded(value: float) -> float:
    """To nine digits."""
    return float(f"{value:.9g}")


@dataclass(frozen=True)
class Draw:
    """How the value of a key varies."""

    kind: Kind
    values: Any = None
    """The constant; lowest and highest value; the choices."""

    def value(self, key: str, name: str) -> Any:
        """The value of `name` for an episode."""
        numbers = units(key, name)
        if self.kind == "constant":
            return self.values
        if self.kind == "choice":
            return self.values[int(next(numbers) * len(self.values))]
        if self.kind == "direction":
            return _unit_vector(numbers, 3)
        if self.kind == "quat_xyzw":
            x, y, z, w = _unit_vector(numbers, 4)
            return [x, y, z, w] if w >= 0.0 else [-x, -y, -z, -w]
        low, high = self.values
        if self.kind == "integer":
            return low + int(next(numbers) * (high - low + 1))
        if isinstance(low, list):
            pairs = zip(cast("list[float]", low), cast("list[float]", high))
            return [rounded(a + next(numbers) * (b - a)) for a, b in pairs]
        if self.kind == "log_range":
            return rounded(math.exp(math.log(low) + next(numbers) * (math.log(high) - math.log(low))))
        return rounded(low + next(numbers) * (high - low))

    def to_json(self) -> Any:
        """As the specification has it."""
        return self.values if self.kind == "constant" else {self.kind: self.values}


def _unit_vector(numbers: Iterator[float], n: int) -> list[float]:
    """Uniform on the unit sphere, by rejection."""
    while True:
        vector = [2.0 * next(numbers) - 1.0 for _ in range(n)]
        square = sum(x * x for x in vector)
        if 1e-4 < square <= 1.0:
            length = math.sqrt(square)
            return [rounded(x / length) for x in vector]


def read_draws(table: Table) -> dict[str, Draw]:
    """`[tasks.vary]`: dotted keys of the scene file, or `plan.` and an argument of the planner, each with a draw."""
    draws: dict[str, Draw] = {}
    _read_into(draws, table, "")
    return draws


def _read_into(draws: dict[str, Draw], table: Table, prefix: str) -> None:
    for key in table.values:
        name, value = f"{prefix}{key}", table.get(key)
        kinds = [kind for kind in KINDS if isinstance(value, dict) and kind in value]
        if kinds:
            inside = table.table(key)
            draw = _draw(inside, kinds[0])
            inside.finish()
            if draw is not None:
                draws[name] = draw
        elif isinstance(value, dict):
            _read_into(draws, table.table(key), f"{name}.")
        else:
            draws[name] = Draw("constant", value)


def _draw(table: Table, kind: Kind) -> Draw | None:
    value = table.get(kind)
    if kind in ("direction", "quat_xyzw"):
        if value != "any":
            table.report("D104", kind, f"is {short(value)}", '"any": uniform over all')
            return None
        return Draw(kind, value)
    if not isinstance(value, list) or not value:
        table.report("D103", kind, f"is {short(value)}", "a list of choices" if kind == "choice" else "[lowest, highest]")
        return None
    values = cast("list[Any]", value)
    if kind == "choice":
        return Draw(kind, values)
    problem = _range_problem(kind, values)
    if problem:
        table.report("D106", kind, f"is {short(values)}", problem)
        return None
    return Draw(kind, values)


def _range_problem(kind: Kind, values: list[Any]) -> str:
    """What a range ought to be; empty where it is right."""
    whole, real = kind == "integer", kind == "log_range"
    expected = "two whole numbers" if whole else "two numbers above 0" if real else "two numbers, or two lists of numbers"
    expected += ", the lower one first"
    flat = [entry if isinstance(entry, list) else [entry] for entry in values]
    lists = cast("list[list[Any]]", flat)
    if len(lists) != 2 or len(lists[0]) != len(lists[1]) or type(values[0]) is list and kind != "range":
        return expected
    for low, high in zip(*lists):
        for number in (low, high):
            if isinstance(number, bool) or not isinstance(number, int if whole else (int, float)) or not math.isfinite(number):
                return expected
        if low > high or (real and low <= 0):
            return expected
    if isinstance(values[0], list) != isinstance(values[1], list):
        return expected
    return ""


def canonical(value: Any) -> str:
    """The same text for the same JSON."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
