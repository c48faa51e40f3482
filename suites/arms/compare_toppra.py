"""Durations of plans of motions against those of toppra on the same paths: `compare_toppra.py PLAN...`. Needs the package toppra.

A plan's path is its cubics; where it rests, it is cut, because toppra needs a path that never stands still. Steps from and to rest are
straight lines. Limits are those that the plan promises.
"""

import json
import logging
import sys
from typing import Any

import numpy as np
from toppra import constraint
from toppra.algorithm import TOPPRA
from toppra.interpolator import AbstractGeometricPath

logging.disable(logging.WARNING)
Array = np.ndarray[Any, np.dtype[np.float64]]


class Cubics(AbstractGeometricPath):
    """Cubics between two rests, by the plan's time in seconds; steps from and to rest have an even pace."""

    def __init__(self, times: Array, joints: Array, velocities: Array) -> None:
        self.pieces: list[Array] = []
        self.knots = [0.0]
        for k, change in enumerate(np.diff(joints, axis=0)):
            a, b = velocities[k], velocities[k + 1]
            rests = [not v.any() for v in (a, b)]
            span = times[k + 1] - times[k]
            if any(rests):
                pace = change if all(rests) else b if rests[0] else a
                span = np.linalg.norm(change) / np.linalg.norm(pace)
                assert np.allclose(pace * span, change, atol=1e-6), "a step from or to rest is no line"
                a = b = change / span
            bend = (3 * change / span - 2 * a - b) / span
            self.pieces.append(np.array([joints[k], a, bend, (a + b - 2 * change / span) / span**2]))
            self.knots.append(self.knots[-1] + span)

    def __call__(self, path_positions: Any, order: int = 0) -> Array:
        flat = np.atleast_1d(np.asarray(path_positions, float))
        found = np.searchsorted(self.knots, flat + 1e-12) - 1
        index = np.clip(found, 0, len(self.pieces) - 1)
        c = np.array([self.pieces[k] for k in index])
        t = (flat - np.array(self.knots)[index])[:, None]
        values = [
            c[:, 0] + t * (c[:, 1] + t * (c[:, 2] + t * c[:, 3])),
            c[:, 1] + t * (2 * c[:, 2] + 3 * t * c[:, 3]),
            2 * c[:, 2] + 6 * t * c[:, 3],
        ]
        return values[order] if np.ndim(path_positions) else values[order][0]

    @property
    def dof(self) -> int:
        return self.pieces[0].shape[1]

    @property
    def path_interval(self) -> Array:
        return np.array([0.0, self.knots[-1]])

    @property
    def waypoints(self) -> None:
        return None


def duration(path: Cubics, velocities: Array, accelerations: Array) -> float:
    """Seconds from rest to rest by toppra: some 400 points of the path, limits kept at both ends of every step."""
    steps = [(a, b, max(4, int(np.ceil(400 * (b - a) / path.knots[-1])))) for a, b in zip(path.knots, path.knots[1:])]
    grid = np.unique(np.concatenate([np.linspace(a, b, n + 1) for a, b, n in steps]))
    limits = [
        constraint.JointVelocityConstraint(np.c_[-velocities, velocities]),
        constraint.JointAccelerationConstraint(
            np.c_[-accelerations, accelerations], discretization_scheme=constraint.DiscretizationType.Interpolation
        ),
    ]
    found = TOPPRA(limits, path, gridpoints=grid, solver_wrapper="seidel").compute_parameterization(0, 0)
    speeds = found[1]
    if speeds is None or np.isnan(speeds).any():
        raise ArithmeticError("toppra found no times")
    return float(np.sum(2 * np.diff(grid) / (speeds[1:] + speeds[:-1])))


def ratio(file: str) -> float:
    """The plan's duration by that of toppra."""
    with open(file, encoding="utf-8") as opened:
        plan = json.load(opened)
    points = [point for segment in plan["segments"] for point in segment["waypoints"]]
    times, joints, speeds = (np.array([point[key] for point in points]) for key in ("time", "joints", "joint_velocities"))
    limits = [np.array(plan["promises"][key]) for key in ("joint_velocities", "joint_accelerations")]
    moves = np.ptp(joints, axis=0) > 0
    joints, speeds, limits = joints[:, moves], speeds[:, moves], [limit[moves] for limit in limits]
    rests = [k for k in range(len(times)) if not speeds[k].any()]
    legs = [slice(a, b + 1) for a, b in zip(rests, rests[1:]) if times[b] > times[a] and np.ptp(joints[a : b + 1], axis=0).any()]
    least = sum(duration(Cubics(times[leg], joints[leg], speeds[leg]), *limits) for leg in legs)
    return sum(times[leg][-1] - times[leg][0] for leg in legs) / least


def main() -> None:
    ratios = np.array([ratio(file) for file in sys.argv[1:]])
    print(
        f"{len(ratios)} plans: least {ratios.min():.4f}, median {np.median(ratios):.4f}, 95 % {np.quantile(ratios, 0.95):.4f}, "
        f"largest {ratios.max():.4f}; above 1.1: {np.count_nonzero(ratios > 1.1)}"
    )


main()
