"""MuJoCo, which comes without type stubs: to type checkers it is anything."""

from __future__ import annotations

from importlib import import_module
from typing import Any, TypeAlias

mujoco: Any = import_module("mujoco")

MjModel: TypeAlias = Any
"""`mujoco.MjModel`."""
MjData: TypeAlias = Any
"""`mujoco.MjData`."""
MjvCamera: TypeAlias = Any
"""`mujoco.MjvCamera`."""
