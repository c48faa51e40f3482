"""Which part of a model is the hand."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path

from ..simulate._mujoco import MjModel, mujoco
from ._names import Names
from ._source import MjcfError

WORLD = 0
"""The body that MuJoCo calls "world"."""


@dataclass(frozen=True)
class Part:
    """A body and all that hangs on it, but for what is free."""

    root: int
    bodies: list[int]
    """Parents first."""
    outside: list[int]
    """The highest of the bodies that are left out."""
    mounts: list[int]
    """Joints that move the root: the hand stands on it."""


def choose_part(model: MjModel, names: Names, root: str | None, path: Path) -> Part:
    """The part below the body called `root`, or below the only body of the world that joints move or that carries joints."""
    if root is None:
        return _part(model, _guess(model, names, path))
    body = names.body_called(root)
    if body is None:
        known = [names.body(index) for index in range(model.nbody)]
        meant = difflib.get_close_matches(root, known, 1)
        hint = f'; did you mean --root "{meant[0]}"?' if meant else f"; its bodies are {_list(known)}"
        raise MjcfError(f'{path}: there is no body "{root}"{hint}')
    return _part(model, body)


def _guess(model: MjModel, names: Names, path: Path) -> int:
    found = [body for body in _children(model, WORLD) if _has_joints(model, body)]
    if not found:
        raise MjcfError(f"{path}: no body has a hinge or a slide, so there is no hand")
    if len(found) == 1:
        (only,) = found
        # Where the joints of the root are all there is, they are a finger's, and the world is the palm.
        return only if any(_has_joints(model, child) for child in _children(model, only)) else WORLD
    choices = ", ".join(f'--root "{names.body(body)}"' for body in found)
    raise MjcfError(f"{path}: several bodies of the world have joints; choose one: {choices}; or --root world for all")


def _part(model: MjModel, root: int) -> Part:
    bodies, outside = [root], list[int]()
    above = {root}
    for body in range(1, model.nbody):
        if body == root or int(model.body_parentid[body]) not in above:
            continue
        if root == WORLD and (_is_free(model, body) or int(model.body_mocapid[body]) >= 0):
            outside.append(body)
            continue
        above.add(body)
        bodies.append(body)
    kept = set(_ancestors(model, root))
    # What stands beside the root or beside what carries it.
    outside += [
        body
        for body in range(1, model.nbody)
        if root != WORLD and body not in above and body not in kept and int(model.body_parentid[body]) in kept
    ]
    first, count = int(model.body_jntadr[root]), int(model.body_jntnum[root])
    return Part(root, bodies, sorted(outside), list(range(first, first + count)))


def _ancestors(model: MjModel, body: int) -> list[int]:
    chain = [body]
    while chain[-1] != WORLD:
        chain.append(int(model.body_parentid[chain[-1]]))
    return chain[1:] or [WORLD]


def _children(model: MjModel, body: int) -> list[int]:
    return [child for child in range(1, model.nbody) if int(model.body_parentid[child]) == body]


def _is_free(model: MjModel, body: int) -> bool:
    return _types(model, body) == [int(mujoco.mjtJoint.mjJNT_FREE)]


def _has_joints(model: MjModel, body: int) -> bool:
    """Whether a hinge, slide or ball is on `body` or below it."""
    own = [kind for kind in _types(model, body) if kind != int(mujoco.mjtJoint.mjJNT_FREE)]
    return bool(own) or any(_has_joints(model, child) for child in _children(model, body))


def _types(model: MjModel, body: int) -> list[int]:
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    return [int(kind) for kind in model.jnt_type[first : first + count]]


def _list(names: list[str]) -> str:
    shown = ", ".join(f'"{name}"' for name in names[:8])
    return shown if len(names) <= 8 else f"{shown} and {len(names) - 8} more"
