"""Arguments, looked at before anything is done with them."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import argument_error

StrPath = str | os.PathLike[str]
"""A path."""

Options = tuple[list[tuple[str, str]], list[str], bool]
"""Packages by name and folder, folders to search, lenient."""


def load_options(function: str, packages: Mapping[str, StrPath] | None, lenient: bool) -> Options:
    """How files are read: the packages given, then `ROS_PACKAGE_PATH`, then `AMENT_PREFIX_PATH`, as the command line does."""
    named = [(name, os.fspath(folder)) for name, folder in (packages or {}).items()]
    for name, folder in named:
        if not name or not os.path.isdir(folder):
            raise argument_error(function, "packages", f"{name!r}: {folder!r} is not a folder", "names with folders")
    variables = (os.environ.get(name, "") for name in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"))
    search = [path for value in variables for path in value.split(os.pathsep) if path]
    return named, search, lenient


def whole(function: str, name: str, value: Any, low: int, high: int) -> int:
    """A whole number from `low` to `high`; numpy's integers count."""
    try:
        number = value.__index__()
    except AttributeError:
        raise argument_error(function, name, f"is {value!r}", "a whole number") from None
    if isinstance(value, bool) or not low <= number <= high:
        raise argument_error(function, name, f"is {value!r}", f"a whole number from {low} to {high}")
    return int(number)


def seed_of(function: str, value: Any) -> int:
    """A seed."""
    return whole(function, "seed", value, 0, 2**64 - 1)


def seconds(function: str, name: str, value: Any) -> float | None:
    """A number of seconds above 0, or none."""
    if value is None:
        return None
    return real(function, name, value, lambda number: 0 < number <= 1e7, "a number of seconds above 0 and at most 1e7")


def real_numbers(values: Any) -> npt.NDArray[np.float64] | None:
    """An array of doubles; None where the values are no real numbers. The array that was given, where it is one. None among the values is NaN."""
    try:
        array: npt.NDArray[Any] = np.asarray(values)
        if array.dtype.kind == "O":
            array = np.array([np.nan if entry is None else entry for entry in values])
        # Neither booleans, complex numbers, strings nor objects.
        return np.asarray(array, dtype=np.float64) if array.dtype.kind in "fiu" else None
    except (TypeError, ValueError):
        return None


def shown(value: Any) -> str:
    """A value as messages show it: on one line, and not too long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 120 else f"{text[:117]}..."


def level_of(function: str, value: Any) -> Any:
    """What a plan is judged for."""
    levels = ("geometry", "forces", "motion")
    if not isinstance(value, str) or value not in levels:
        raise argument_error(function, "level", f"is {value!r}", "one of " + ", ".join(f'"{level}"' for level in levels))
    return value


def real(function: str, name: str, value: Any, is_right: Callable[[float], bool], expected: str) -> float:
    """A number for which `is_right` holds."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise argument_error(function, name, f"is {value!r}", expected) from None
    if isinstance(value, (str, bytes)) or not math.isfinite(number) or not is_right(number):
        raise argument_error(function, name, f"is {value!r}", expected)
    return number
