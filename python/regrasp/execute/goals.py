"""Goals one after the other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .._model import Pose
from ..simulate.reference import Array, quat_exp, quat_product


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
