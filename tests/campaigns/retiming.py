"""Durations of plans against those of TOPP-RA (Pham and Pham 2018) on the same paths with the same limits.

    python tests/campaigns/retiming.py --package models=DIR PLAN.json...

needs the Python packages ``toppra`` and ``numpy``, and plans that were written into a folder with their scenes known
(``--scenes``, default ``scenes``): a plan names its scene file by its first input. A path is a stretch of a segment between two
waypoints at which the joints rest. Its curve is that of the plan, the cubics through positions, velocities and times; only the
timing along the curve is found again. Limits: velocity and acceleration of every joint, and the largest speed of every
fingertip's centre and of the object, as a cap of the path's speed.

Paths of one step are counted apart: between two waypoints at rest a single cubic is all that the plan format has.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from typing import Any, Callable

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint

Array = np.ndarray[Any, Any]
SAMPLES = 12
"""Points of the curve per step."""


class Hand:
    """Forward kinematics of the fingertips, straight from URDF and hand file."""

    def __init__(self, hand_file: pathlib.Path, packages: dict[str, pathlib.Path]) -> None:
        hand = tomllib.loads(hand_file.read_text()) if hand_file.suffix == ".toml" else {}
        urdf = str(hand["urdf"])
        if urdf.startswith("package://"):
            name, _, rest = urdf.removeprefix("package://").partition("/")
            path = packages[name] / rest
        else:
            path = hand_file.parent / urdf
        self.parents: dict[str, tuple[str, str, str, Array, Array, tuple[str, float, float] | None]] = {}
        for joint in ElementTree.parse(path).getroot().findall("joint"):
            axis, mimic = joint.find("axis"), joint.find("mimic")
            direction = np.array([1.0, 0.0, 0.0]) if axis is None else numbers(axis.get("xyz"))
            coupling = None
            if mimic is not None:
                coupling = (mimic.get("joint", ""), float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0)))
            self.parents[joint.find("child").get("link")] = (  # type: ignore[union-attr, index]
                joint.get("name", ""),
                joint.get("type", ""),
                joint.find("parent").get("link", ""),  # type: ignore[union-attr]
                placement(joint.find("origin")),
                direction / np.linalg.norm(direction),
                coupling,
            )
        self.tips = []
        for finger in hand["fingers"]:
            tip = finger["tip"]
            self.tips.append((finger["tip_link"], np.array(tip.get("center", tip.get("position", [0.0, 0.0, 0.0])))))

    def centers(self, names: list[str], joints: Array) -> Array:
        """Centres of all fingertips, shape (n_fingers, 3)."""
        values = dict(zip(names, joints))
        return np.array([(self._link(link, values) @ np.append(center, 1.0))[:3] for link, center in self.tips])

    def _link(self, link: str, values: dict[str, float]) -> Array:
        if link not in self.parents:
            return np.eye(4)
        name, kind, parent, origin, axis, coupling = self.parents[link]
        leader, factor, offset = coupling or (name, 1.0, 0.0)
        position = factor * values.get(leader, 0.0) + offset
        motion = np.eye(4)
        if kind in ("revolute", "continuous"):
            motion[:3, :3] = turned(axis * position)
        elif kind == "prismatic":
            motion[:3, 3] = axis * position
        return np.asarray(self._link(parent, values) @ origin @ motion)


def numbers(text: str | None) -> Array:
    return np.array([float(word) for word in (text or "0 0 0").split()])


def turned(vector: Array) -> Array:
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def placement(origin: ElementTree.Element | None) -> Array:
    pose = np.eye(4)
    if origin is not None:
        roll, pitch, yaw = numbers(origin.get("rpy"))
        pose[:3, 3] = numbers(origin.get("xyz"))
        pose[:3, :3] = turned(np.array([0, 0, yaw])) @ turned(np.array([0, pitch, 0])) @ turned(np.array([roll, 0, 0]))
    return pose


def object_way(first: Array, second: Array, torque_scale: float) -> float:
    """How fast the object moves per unit of its parameter, in metres: way of its origin, and turn times radius."""
    a, b = first[3:], second[3:]
    turn = 4.0 * np.arctan2(min(np.linalg.norm(a - b), np.linalg.norm(a + b)), max(np.linalg.norm(a + b), np.linalg.norm(a - b)))
    return float(np.linalg.norm(second[:3] - first[:3]) + turn * torque_scale)


def cubic(points: list[dict[str, Any]], k: int) -> Callable[[float], Array]:
    first, second = points[k], points[k + 1]
    span = second["time"] - first["time"]
    start, end = np.array(first["joints"]), np.array(second["joints"])
    slopes = [np.array(point["joint_velocities"]) * span for point in (first, second)]

    def at(u: float) -> Array:
        v = 1.0 - u
        return start + (end - start) * u * u * (3 - 2 * u) + slopes[0] * u * v * v - slopes[1] * u * u * v

    return at


def stretches(segment: dict[str, Any]) -> list[list[dict[str, Any]]]:
    """Parts of a segment from rest to rest in which the joints move all the time."""
    found, current = [], [segment["waypoints"][0]]
    for point in segment["waypoints"][1:]:
        current.append(point)
        if not np.any(point["joint_velocities"]):
            found.append(current)
            current = [point]
    moves = [part for part in found if all(a["joints"] != b["joints"] for a, b in zip(part, part[1:]))]
    return moves


def optimal(hand: Hand, plan: dict[str, Any], points: list[dict[str, Any]]) -> float | None:
    """Time that TOPP-RA needs along the curve, in seconds; none where it fails."""
    limits = plan["promises"]["motion"]
    joints, owners, shares = [np.array(points[0]["joints"])], [0], [0.0]
    for k in range(len(points) - 1):
        at = cubic(points, k)
        # Even shares of the way: the curve leaves a waypoint at rest slowly.
        fine = np.array([at(u) for u in np.linspace(0, 1, 201)])
        way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))))
        for u in np.interp(np.linspace(0, way[-1], SAMPLES + 1)[1:], way, np.linspace(0, 1, 201)):
            joints.append(at(u))
            owners.append(k)
            shares.append(u)
    curve = np.array(joints)
    length = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))))
    path = toppra.SplineInterpolator(length, curve)
    names, largest = plan["hands"][0]["joint_names"], limits["largest_speed"]
    poses = [np.array(p["world_from_objects"][0]["position"] + p["world_from_objects"][0]["quat_xyzw"]) for p in points]
    ways = [object_way(a, b, plan["promises"]["torque_scale"]) for a, b in zip(poses, poses[1:])]
    chords = [np.array(b["joints"]) - np.array(a["joints"]) for a, b in zip(points, points[1:])]
    grid = np.linspace(0, length[-1], 6 * len(length))
    caps = []
    for s in grid:
        q, rate = path(s), path(s, 1)
        h = 1e-6
        tips = (hand.centers(names, q + h * rate) - hand.centers(names, q - h * rate)) / (2 * h)
        fastest = max(np.linalg.norm(tips, axis=1).max(), 1e-9)
        k = owners[min(int(np.searchsorted(length, s)), len(owners) - 1)]
        along = abs(float(rate @ chords[k])) / float(chords[k] @ chords[k])
        caps.append(largest / max(fastest, ways[k] * along))
    cap = np.array(caps)

    def velocities(s: float) -> Array:
        fastest = float(np.interp(s, grid, cap)) * np.abs(path(s, 1)) + 1e-9
        most = np.minimum(np.array(limits["joint_velocities"]), fastest)
        return np.stack((-most, most), axis=1)

    acceleration = np.array(limits["joint_accelerations"])
    constraints = [
        toppra.constraint.JointVelocityConstraintVarying(velocities),
        toppra.constraint.JointAccelerationConstraint(np.stack((-acceleration, acceleration), axis=1)),
    ]
    instance = toppra.algorithm.TOPPRA(constraints, path, gridpoints=grid, solver_wrapper="seidel")
    speeds = instance.compute_parameterization(0, 0)[1]
    if speeds is None:
        return None
    return float(np.sum(2 * np.diff(grid) / (speeds[1:] + speeds[:-1])))


def scene_of(plan: dict[str, Any], folder: pathlib.Path) -> pathlib.Path:
    name = next(entry["name"] for entry in plan["inputs"] if entry["role"] == "hand")
    scene = next(entry["name"] for entry in plan["inputs"] if entry["role"] == "scene")
    for path in sorted(folder.rglob(pathlib.Path(scene).name)):
        if (path.parent / name).exists() and name in path.read_text():
            return path.parent / name
    raise SystemExit(f"the hand file {name} of scene {scene} is not found below {folder}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plans", nargs="+", type=pathlib.Path)
    parser.add_argument("--package", action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("--scenes", type=pathlib.Path, default=pathlib.Path("scenes"))
    parser.add_argument("--paths", type=int, default=100, help="paths of two steps or more to compare")
    parser.add_argument("--limit", type=float, default=1.1, help="list paths above this ratio")
    arguments = parser.parse_args()
    packages = {name: pathlib.Path(folder) for name, _, folder in (text.partition("=") for text in arguments.package)}
    toppra.setup_logging("ERROR")
    rows: list[tuple[float, str, int, float, float]] = []
    single: list[float] = []
    each = max(1, arguments.paths // len(arguments.plans) + 1)
    for file in arguments.plans:
        plan = json.loads(file.read_text())
        hand = Hand(scene_of(plan, arguments.scenes), packages)
        taken = 0
        for s, segment in enumerate(plan["segments"]):
            for points in stretches(segment):
                if len(points) > 2 and taken == each:
                    continue
                taken += len(points) > 2
                best = optimal(hand, plan, points) if len(points) > 2 or len(single) < 100 else None
                if best is None:
                    continue
                own = points[-1]["time"] - points[0]["time"]
                if len(points) == 2:
                    single.append(own / best)
                else:
                    rows.append((own / best, f"{file.name} segment {s}", len(points) - 1, own, best))
    rows.sort()
    ratios = np.array([row[0] for row in rows])
    print(f"{len(rows)} paths of two steps and more: {sum(row[3] for row in rows):.2f} s, TOPP-RA {sum(row[4] for row in rows):.2f} s")
    print("ratio: least, median, 90 %, most:", np.round(np.percentile(ratios, [0, 50, 90, 100]), 3))
    if single:
        print(f"{len(single)} paths of one step, ratio: median, most:", np.round(np.percentile(single, [50, 100]), 3))
    for ratio, name, n_steps, own, best in rows:
        if ratio > arguments.limit:
            print(f"  {ratio:.3f} {name}: {n_steps} steps, {own:.3f} s, TOPP-RA {best:.3f} s")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
