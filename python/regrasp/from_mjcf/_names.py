"""Names: as the model has them, made up where it has none."""

from __future__ import annotations

from typing import Any

from ..simulate._mujoco import MjModel, mujoco


class Names:
    """Names of bodies and joints, each used once."""

    def __init__(self, model: MjModel) -> None:
        objects = mujoco.mjtObj
        self._model = model
        self._bodies = _named(model, objects.mjOBJ_BODY, model.nbody, "body")
        self._joints = _named(model, objects.mjOBJ_JOINT, model.njnt, "joint")

    def body(self, body: int) -> str:
        """Of a body, and of its link."""
        return self._bodies[body]

    def joint(self, joint: int) -> str:
        """Of a joint."""
        return self._joints[joint]

    def body_called(self, name: str) -> int | None:
        """The body of this name."""
        return self._bodies.index(name) if name in self._bodies else None

    def other(self, kind: Any, index: int) -> str:
        """Of anything else; its number where it has none."""
        return mujoco.mj_id2name(self._model, kind, index) or f"number {index}"


def _named(model: MjModel, kind: Any, number: int, word: str) -> list[str]:
    own = [mujoco.mj_id2name(model, kind, index) or "" for index in range(number)]
    taken = set(own)
    return [name or unused(f"{word}_{index}", taken) for index, name in enumerate(own)]


def unused(name: str, taken: set[str]) -> str:
    """`name`, or `name_2` and on where it is taken. It is taken afterwards."""
    free, count = name, 1
    while free in taken:
        count += 1
        free = f"{name}_{count}"
    taken.add(free)
    return free
