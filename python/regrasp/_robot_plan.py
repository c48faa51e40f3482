"""Plans of whole robots: how their joints move, and what they carry."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false, reportUnusedFunction=false

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from . import _regrasp
from ._arguments import StrPath
from ._model import FloatArray, Scene, load_scene
from ._result import Report, report_of


@dataclass(frozen=True)
class RobotSegment:
    """A piece of the plan."""

    kind: str
    """"transit" or "carry"; of pick and place "approach", "grasp", "release", "retreat", "transfer" and "regrasp" too."""
    held_by: Mapping[str, tuple[str, ...]]
    """For every object of the plan, the hands and supports that hold it all through the segment."""
    first: int
    """Index of its first waypoint."""
    last: int
    """Index of its last waypoint."""
    start: float
    """From when, in seconds."""
    end: float
    """Until when, in seconds."""


class RobotPlan:
    """A motion of a whole robot, or pick and place. True, as opposed to a `Failure`.

    The waypoints of all segments stand in one array each, in order; where two segments meet, the last of one and the first of
    the next are both there.
    """

    def __init__(self, native: _regrasp.RobotPlan, report: Report | None = None, path: str | None = None) -> None:
        self._native = native
        self.report = report
        """What the checker said when the plan was made; none for a plan from a file."""
        self.path = path
        """The file that it was read from, if it was."""

    @staticmethod
    def from_file(path: StrPath) -> RobotPlan:
        """Reads a plan file. Raises `InputError`."""
        return RobotPlan(_regrasp.RobotPlan.load(os.fspath(path)), path=os.fspath(path))

    @staticmethod
    def from_json(content: str | bytes, *, name: str = "plan.json") -> RobotPlan:
        """Reads the content of a plan file; errors call it `name`. Raises `InputError`."""
        return RobotPlan(_regrasp.RobotPlan.parse(content.encode() if isinstance(content, str) else content, name))

    def to_json(self) -> bytes:
        """The content of its plan file."""
        return self._native.to_json()

    @cached_property
    def document(self) -> Mapping[str, Any]:
        """The content of the plan file."""
        return json.loads(self._native.to_json())

    @cached_property
    def held_joints(self) -> dict[str, float]:
        """Joints of its robots that no plan moves, and where each of them has to stand all along, in radians or metres."""
        return {name: float(at) for robot in self.document["robots"] for name, at in robot.get("held_joints", {}).items()}

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of all joints, in the order of `joints`."""
        return tuple(name for robot in self.document["robots"] for name in robot["joint_names"])

    @cached_property
    def _waypoints(self) -> list[dict[str, Any]]:
        return [waypoint for segment in self.document["segments"] for waypoint in segment["waypoints"]]

    @cached_property
    def times(self) -> FloatArray:
        """(n,): seconds from the start."""
        return np.array([waypoint["time"] for waypoint in self._waypoints], dtype=np.float64)

    @cached_property
    def joints(self) -> FloatArray:
        """(n, j): positions of the joints, in radians or metres."""
        return np.array([waypoint["joints"] for waypoint in self._waypoints], dtype=np.float64)

    @cached_property
    def joint_velocities(self) -> FloatArray:
        """(n, j): their velocities."""
        return np.array([waypoint["joint_velocities"] for waypoint in self._waypoints], dtype=np.float64)

    @cached_property
    def objects(self) -> tuple[str, ...]:
        """Names of the objects that the plan moves."""
        return tuple(self.document["objects"])

    @cached_property
    def fingers(self) -> tuple[str, ...]:
        """HAND/FINGER of all fingers of the plan's hands, in the order of contact arrays."""
        return tuple(f"{hand['name']}/{finger}" for hand in self.document["hands"] for finger in hand["fingers"])

    @cached_property
    def segments(self) -> tuple[RobotSegment, ...]:
        """The segments, in order."""
        found: list[RobotSegment] = []
        first = 0
        for segment in self.document["segments"]:
            last = first + len(segment["waypoints"]) - 1
            held_by = {name: tuple(segment["held_by"].get(name, ())) for name in self.objects}
            start, end = float(self.times[first]), float(self.times[last])
            found.append(RobotSegment(segment["kind"], held_by, first, last, start, end))
            first = last + 1
        return tuple(found)

    @cached_property
    def object_positions(self) -> FloatArray:
        """(n, o, 3): positions of the objects in the world."""
        return self._poses("position", 3)

    @cached_property
    def object_quat_xyzw(self) -> FloatArray:
        """(n, o, 4): their orientations."""
        return self._poses("quat_xyzw", 4)

    def _poses(self, key: str, size: int) -> FloatArray:
        rows = [[pose[key] for pose in waypoint["world_from_objects"]] for waypoint in self._waypoints]
        return np.array(rows, dtype=np.float64).reshape(len(rows), len(self.objects), size)

    @cached_property
    def contact_points_in_object(self) -> FloatArray:
        """(n, f, 3): where each of `fingers` touches, in the frame of the object; NaN where it does not."""
        return self._contacts("point_in_object")

    @cached_property
    def contact_normals_in_object(self) -> FloatArray:
        """(n, f, 3): outward normals of the object there."""
        return self._contacts("normal_in_object")

    @cached_property
    def contact_forces_in_object(self) -> FloatArray:
        """(n, f, 3): forces of the fingers on the object, in newtons; NaN too where no forces are planned."""
        return self._contacts("force_in_object")

    def _contacts(self, key: str) -> FloatArray:
        column = {name: k for k, name in enumerate(self.fingers)}
        found = np.full((len(self._waypoints), len(column), 3), np.nan)
        for row, waypoint in zip(found, self._waypoints):
            for contact in waypoint.get("contacts", []):
                if contact.get(key) is not None:
                    row[column[f"{contact['hand']}/{contact['finger']}"]] = contact[key]
        return found

    @property
    def duration(self) -> float:
        """Time from the first waypoint to the last, in seconds."""
        return float(self.times[-1] - self.times[0])

    def save(self, path: StrPath) -> None:
        """Writes the plan file."""
        _regrasp.Plan.write(os.fspath(path), self._native.to_json())

    def to_npz(self, path: StrPath) -> None:
        """Writes the arrays for numpy (`docs/reference/export-formats.md`)."""
        _regrasp.Plan.write(os.fspath(path), self._native.to_npz())

    def to_ros2(self, path: StrPath, scene: Scene | StrPath | None = None) -> None:
        """Writes trajectories of ROS 2 controllers: a YAML document for each arm, hand and the common part that moves."""
        _regrasp.Plan.write(os.fspath(path), self._native.to_ros2(self._scene(scene)._native).encode())

    def to_mjcf(self, scene: Scene | StrPath | None = None) -> str:
        """The MuJoCo model of the scene with a keyframe for every waypoint. Warns where the model differs from the scene."""
        xml, notes = self._native.to_mjcf(self._scene(scene)._native)
        for note in notes:
            warnings.warn(note, stacklevel=2)
        return xml

    def check(self, scene: Scene | StrPath | None = None, *, level: str = "motion") -> Report:
        """Judges the plan in its scene, by the checker that knows no planner."""
        return report_of(json.loads(self._native.check(self._scene(scene)._native, level)))

    def load_scene(
        self, path: StrPath | None = None, *, packages: Mapping[str, StrPath] | None = None, lenient: bool = False
    ) -> Scene:
        """The scene that the plan names, or the one in ``path``; packages and lenient as in `load_scene`. Raises `InputError`."""
        if path is None:
            path = self._native.find_scene(self.path or "plan.json", os.getcwd())
        return load_scene(path, packages=packages, lenient=lenient)

    def _scene(self, scene: Scene | StrPath | None) -> Scene:
        return scene if isinstance(scene, Scene) else self.load_scene(scene)
