"""Scene files as dictionaries: written as TOML, and varied key by key."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false, reportUnusedFunction=false

from __future__ import annotations

import copy
import json
import math
import re
from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from . import _regrasp
from ._errors import argument_error

Document = dict[str, Any]
"""The content of a TOML file."""

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_POSE_KEYS = ("position", "quat_xyzw", "quat_wxyz", "rotation_vector", "turn", "move")
_EXTENTS: dict[str, tuple[str, ...]] = {
    "sphere": ("radius",),
    "box": ("size",),
    "ellipsoid": ("radii",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}


def document_of(text: bytes, path: str) -> Document:
    """The content of the TOML file `path`. Raises `InputError` (S100) where it is no TOML."""
    return json.loads(_regrasp.parse_toml(text.decode("utf-8-sig"), path, "S100"))["value"]


def toml_of(document: Mapping[str, Any], function: str = "to_toml") -> str:
    """The TOML file of a dictionary. The same dictionary gives the same text. Raises `InputError` for what TOML lacks."""
    plain: list[str] = []
    tables: list[str] = []
    for key, value in document.items():
        if isinstance(value, Mapping):
            tables += ["", f"[{_key(key)}]", *_lines(cast("Mapping[str, Any]", value), function)]
        elif _is_tables(value):
            for entry in value:
                tables += ["", f"[[{_key(key)}]]", *_lines(entry, function)]
        else:
            plain.append(f"{_key(key)} = {_value(value, key, function)}")
    return "\n".join([*plain, *tables]) + "\n"


def _is_tables(value: Any) -> bool:
    if not isinstance(value, (list, tuple)) or not value:
        return False
    return all(isinstance(entry, Mapping) for entry in cast("list[Any]", value))


def _lines(table: Mapping[str, Any], function: str) -> list[str]:
    return [f"{_key(key)} = {_value(value, key, function)}" for key, value in table.items()]


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _text(key)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any, key: str, function: str) -> str:
    if isinstance(value, (np.generic, np.ndarray)):
        value = cast("Any", value).tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        inside = cast("Mapping[str, Any]", value)
        return "{ " + ", ".join(_lines(inside, function)) + " }" if inside else "{}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(each, key, function) for each in cast("list[Any]", value)) + "]"
    raise argument_error(function, key, f"is {value!r}", "a number, text, list or table, as TOML has them")


def with_values(document: Document, values: Mapping[str, Any], function: str = "with_keys") -> Document:
    """A copy with the value of every dotted key replaced or added: `object.friction`, `objects.cube.mass`, `tasks.0.goal`.

    In a list of tables an entry is meant by its name or its index. Raises `InputError` (A510) for a path that leads nowhere.
    """
    out = copy.deepcopy(document)
    for path, value in values.items():
        *parents, last = path.split(".")
        place: Any = out
        for k, part in enumerate(parents):
            place = _inside(place, part, path, ".".join(parents[: k + 1]), function)
        if isinstance(place, list):
            entries = cast("list[Any]", place)
            entries[_index(entries, last, path, path, function)] = value
        else:
            place[last] = value
    return out


def _inside(place: Any, part: str, path: str, so_far: str, function: str) -> Any:
    if isinstance(place, list):
        entries = cast("list[Any]", place)
        return entries[_index(entries, part, path, so_far, function)]
    inner = place.setdefault(part, {})
    if not isinstance(inner, (dict, list)):
        raise argument_error(function, path, f"leads through {so_far}, which is {inner!r}", "a table")
    return cast("Any", inner)


def _index(entries: list[Any], part: str, path: str, so_far: str, function: str) -> int:
    names = [entry.get("name") if isinstance(entry, dict) else None for entry in entries]
    if part in names:
        return names.index(part)
    if part.isdigit() and int(part) < len(entries):
        return int(part)
    known = ", ".join([*(str(name) for name in names if name), f"0 to {len(entries) - 1}"])
    raise argument_error(function, path, f"names {so_far}, which is not there", known)


def sections(document: Document, object: str | None, task: str | None) -> tuple[str, str]:
    """Dotted keys of the table of an object and of that of a task, with a point at the end; the first where none is named."""
    if document.get("format_version") == 1:
        return "object.", ""
    first_object, first_task = object if object is not None else "0", task if task is not None else "0"
    return f"objects.{first_object}.", f"tasks.{first_task}."


def table_at(document: Document, path: str, function: str) -> Document:
    """The table at a dotted key, empty where there is none."""
    place: Any = document
    for part in path.split("."):
        if isinstance(place, list):
            entries = cast("list[Any]", place)
            place = entries[_index(entries, part, path, path, function)]
        else:
            place = place.get(part, {})
    return place


def posed(table: Mapping[str, Any], pose: Mapping[str, Any]) -> Document:
    """A `[start]` or `[goal]` with another pose or turn; what else it says stays."""
    if not any(key in pose for key in _POSE_KEYS):
        return {**table, **pose}
    return {**{key: value for key, value in table.items() if key not in _POSE_KEYS}, **pose}


def sized(table: Mapping[str, Any], size: Any, scale: Any) -> Document:
    """The shape of an object in another size: `{key: table}`. Raises `InputError` (A510)."""
    kind = next((kind for kind in (*_EXTENTS, "mesh") if kind in table), "mesh")
    shape: Document = dict(table.get(kind, {}))
    if kind == "mesh":
        if size is not None:
            raise argument_error("Scene.with_", "size", "is for primitives", "scale, because the object is a mesh")
        return {kind: {**shape, "scale": scale}}
    keys = _EXTENTS[kind]
    if size is not None:
        n_values = {"sphere": (), "box": (3,), "ellipsoid": (3,)}.get(kind, (2,))
        if np.shape(size) != n_values:
            raise argument_error("Scene.with_", "size", f"is {size!r}", f"{' and '.join(keys)} of a {kind}, in metres")
        shape.update(zip(keys, [size] if len(keys) == 1 else size))
    if scale is not None:
        for key in keys:
            shape[key] = np.multiply(shape[key], scale).tolist()
    return {kind: shape}
