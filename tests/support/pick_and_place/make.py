"""Writes scene.toml and plan.json: a plan of pick and place of the bundled robot `two_arms`, made by hand, for tests that need a plan and
no planner.

    PYTHONPATH=python python3 tests/support/pick_and_place/make.py

The right hand takes a box from above, carries it to the side and puts it down. All joints follow from closed forms: the arm is planar, and
so is each finger. Forces hold the weight at rest; inertia is left out, so that the checker may reject the plan.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import regrasp

FOLDER = Path(__file__).parent
# Lengths of the robot, in metres: the shoulder, upper arm and forearm, from the wrist to the hand; radius of the roots of fingers, links.
SHOULDER = np.array([0.0, -0.25, 0.7])
UPPER, FORE, HAND = 0.25, 0.25, 0.17
ROOT, PROXIMAL, DISTAL, TIP = 0.045, 0.058, 0.05, 0.005
# The box: half its width, half its height, mass; contacts at its middle, this far below the palm.
HALF, HALF_HEIGHT, MASS, DEPTH = 0.025, 0.035, 0.15, 0.07
X, TABLE, LIFT, OPEN = 0.1, 0.23, 0.12, 0.02
YAW = (0.4, 0.0, -0.5)
PRESS = 3.0
FINGERS = ("east", "north", "west", "south")
# Outward normals of the box where fingers touch, in the object frame: the palm faces down and the hand points back.
NORMALS = {"east": (-1.0, 0.0, 0.0), "north": (0.0, 1.0, 0.0), "west": (1.0, 0.0, 0.0), "south": (0.0, -1.0, 0.0)}
HAND_HEIGHT = TABLE + HALF_HEIGHT + DEPTH

SCENE = """# Written by make.py; change that.
format = "regrasp-scene"
format_version = 2

[robot]
file = "../../../assets/robots/two_arms/robot.toml"

[[objects]]
name = "box"
box = {{ size = [{size}, {size}, {height}] }}
mass = {mass}
friction = 0.8
position = [{start[0]}, {start[1]}, {start[2]}]

[[supports]]
name = "table"
box = {{ size = [0.7, 0.42, 0.02] }}
position = [0.1, -0.34, {table}]

[[obstacles]]
name = "lamp"
cylinder = {{ radius = 0.02, length = 0.3 }}
position = [0.4, -0.2, 0.381]

[[tasks]]
task = "pick_and_place"
start = {{ joints = {{ {joints} }} }}
goal = {{ position = [{goal[0]}, {goal[1]}, {goal[2]}], quat_xyzw = [0.0, 0.0, {quat[2]}, {quat[3]}] }}
"""


def arm(height: float) -> list[float]:
    """Shoulder, elbow, wrist pitch and roll with the palm down at this height above the grasp."""
    x, z = X + HAND, SHOULDER[2] - (HAND_HEIGHT + height)
    reach = math.hypot(x, z)
    bend = math.acos((reach**2 - UPPER**2 - FORE**2) / (2 * UPPER * FORE))
    shoulder = math.atan2(z, x) - math.atan2(FORE * math.sin(bend), UPPER + FORE * math.cos(bend))
    return [shoulder, bend, math.pi - shoulder - bend, 0.0]


def finger(opened: float) -> list[float]:
    """Abduction and both flexions with the tip so far from the box."""
    inward = ROOT - HALF - TIP - opened
    reach = math.hypot(inward, DEPTH)
    inner = math.acos((PROXIMAL**2 + reach**2 - DISTAL**2) / (2 * PROXIMAL * reach))
    bend = math.pi - math.acos((PROXIMAL**2 + DISTAL**2 - reach**2) / (2 * PROXIMAL * DISTAL))
    return [0.0, math.atan2(inward, DEPTH) - inner, bend]


def posture(rest: list[float], yaw: float, height: float, opened: float) -> list[float]:
    right = [*arm(height), *(value for _ in FINGERS for value in finger(opened))]
    return [yaw, *right, *rest[1 + len(right) :]]


def box_pose(yaw: float, height: float) -> dict[str, list[float]]:
    x, y = X, SHOULDER[1]
    return {
        "position": [
            x * math.cos(yaw) - y * math.sin(yaw),
            x * math.sin(yaw) + y * math.cos(yaw),
            TABLE + HALF_HEIGHT + height,
        ],
        "quat_xyzw": [0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)],
    }


def contacts() -> list[dict[str, Any]]:
    found = []
    for name in FINGERS:
        normal = np.array(NORMALS[name])
        force = -PRESS * normal + np.array([0.0, 0.0, MASS * 9.80665 / 4])
        found.append(
            {
                "hand": "right",
                "finger": name,
                "object": "box",
                "mode": "fixed",
                "point_in_object": (HALF * normal).tolist(),
                "normal_in_object": normal.tolist(),
                "force_in_object": force.tolist(),
            }
        )
    return found


class Maker:
    """Adds segments one after another."""

    def __init__(self, rest: list[float]) -> None:
        self.rest, self.time, self.segments = rest, 0.0, list[dict[str, Any]]()

    def add(self, kind: str, held_by: list[str], *legs: tuple[float, Callable[[float], tuple[float, float, float]]]) -> None:
        """Legs of so many seconds; each says yaw, height and opening of the hand at every share of its way."""
        holds = "right" in held_by
        waypoints: list[dict[str, Any]] = []
        for number, (seconds, at) in enumerate(legs):
            for k in range(min(number, 1), 5):
                u = k / 4
                share, slope = u * u * (3 - 2 * u), 6 * u * (1 - u) / seconds
                low, high = (np.array(posture(self.rest, *at(share + d))) for d in (-1e-6, 1e-6))
                yaw, height, _ = at(share)
                waypoint = {
                    "time": round(self.time + u * seconds, 9),
                    "joints": np.round(posture(self.rest, *at(share)), 12).tolist(),
                    "joint_velocities": np.round(slope * (high - low) / 2e-6, 9).tolist(),
                    "world_from_objects": [box_pose(*((yaw, height) if holds else self.at))],
                }
                waypoints.append(waypoint | ({"contacts": contacts()} if holds else {}))
            self.time += seconds
            if holds:
                self.at = at(1.0)[:2]
        self.segments.append({"kind": kind, "held_by": {"box": held_by}, "waypoints": waypoints})

    at = (YAW[1], 0.0)


def main() -> None:
    robot = regrasp.load_scene(FOLDER / "../../../scenes/two_arms/among_lamps.toml")
    motion = regrasp.plan_motion(robot, task="swing")
    assert motion
    names, rest = list(motion.joint_names), motion.joints[0].tolist()
    begin = posture(rest, YAW[0], LIFT, OPEN)
    goal = box_pose(YAW[2], 0.0)
    text = SCENE.format(
        size=2 * HALF,
        height=2 * HALF_HEIGHT,
        mass=MASS,
        start=box_pose(YAW[1], 0.0)["position"],
        goal=goal["position"],
        quat=goal["quat_xyzw"],
        table=TABLE - 0.01,
        joints=", ".join(f'"{name}" = {value:.12f}' for name, value, own in zip(names, begin, rest) if value != own),
    )
    (FOLDER / "scene.toml").write_text(text)
    scene = regrasp.load_scene(FOLDER / "scene.toml")
    maker = Maker(rest)
    a, b, c = YAW

    def ramp(start: tuple[float, float, float], end: tuple[float, float, float]) -> Callable[[float], tuple[float, float, float]]:
        return lambda u: tuple(p + u * (q - p) for p, q in zip(start, end))  # type: ignore[return-value]

    maker.add("transit", ["table"], (0.8, ramp((a, LIFT, OPEN), (b, LIFT, OPEN))))
    maker.add("approach", ["table"], (0.8, ramp((b, LIFT, OPEN), (b, 0, OPEN))))
    maker.add("grasp", ["table"], (0.4, ramp((b, 0, OPEN), (b, 0, 0))))
    maker.add("carry", ["right", "table"], (0.2, ramp((b, 0, 0), (b, 0, 0))))
    maker.add(
        "carry",
        ["right"],
        (0.8, ramp((b, 0, 0), (b, LIFT, 0))),
        (1.2, ramp((b, LIFT, 0), (c, LIFT, 0))),
        (0.8, ramp((c, LIFT, 0), (c, 0, 0))),
    )
    maker.add("carry", ["right", "table"], (0.2, ramp((c, 0, 0), (c, 0, 0))))
    maker.add("release", ["table"], (0.4, ramp((c, 0, 0), (c, 0, OPEN))))
    maker.add("retreat", ["table"], (0.8, ramp((c, 0, OPEN), (c, LIFT, OPEN))))
    maker.add("transit", ["table"], (1.2, ramp((c, LIFT, OPEN), (a, LIFT, OPEN))))
    document = dict(motion.document)
    document |= {
        "task": "pick_and_place",
        "method": "by hand",
        "inputs": [{"role": file.role, "name": file.name, "sha256": file.sha256} for file in scene.inputs],
        "hands": [{"name": hand, "fingers": list(FINGERS)} for hand in ("right", "left")],
        "objects": ["box"],
        "segments": maker.segments,
        "settings": {},
        "statistics": {"nodes": 0, "samples": 0, "work": 0, "cut_by_time": False, "counts": {}},
    }
    document.pop("query", None)
    document["promises"]["holding"] = {
        "contact_tolerance": 0.0005,
        "friction_margin": 1.25,
        "required_margin": 0.02,
        "torque_scale": math.hypot(HALF, HALF, HALF_HEIGHT),
        "normal_force": [0.5, 10.0],
    }
    (FOLDER / "plan.json").write_text(json.dumps(document) + "\n")


if __name__ == "__main__":
    main()
