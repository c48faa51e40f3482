"""Plans: what a hand does, over time."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false, reportUnusedFunction=false

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt

from . import _regrasp
from ._arguments import StrPath
from ._errors import InputError
from ._model import FloatArray, Pose, Scene, pose_of
from ._result import Report

CONTACT_MODES = ("free", "fixed", "rolling", "pure_rolling", "twisting", "pure_sliding", "sliding")
"""What the numbers in `Plan.contact_modes` mean."""


@dataclass(frozen=True)
class Segment:
    """A piece of motion: waypoints `start` to `stop` (exclusive) of the plan's arrays."""

    kind: Literal["transfer", "regrasp", "tracking"]
    """In a transfer the object moves; in a regrasp it stands still and one finger moves; in tracking all touch it and some move."""
    moving_finger: str | None
    """The finger that moves, in a regrasp or in tracking."""
    start: int
    stop: int
    also_moving: tuple[str, ...] = ()
    """In tracking, others that move at the same time."""
    rolling_finger: str | None = None
    """In tracking, the resting finger that the object rolls on without sliding."""
    held_by: tuple[str, ...] = ()
    """Who holds the object all along: names of hands and supports."""

    @property
    def moving(self) -> tuple[str, ...]:
        """All fingers that move."""
        return (*(() if self.moving_finger is None else (self.moving_finger,)), *self.also_moving)

    @property
    def slice(self) -> slice:
        """Of the plan's arrays: `plan.joints[segment.slice]`."""
        return slice(self.start, self.stop)


class Plan:
    """How a hand takes an object from start to goal. True, as opposed to a `Failure`.

    The waypoints of all n segments stand in one array each, in order; where two segments meet, the last of one and the first
    of the next are both there. n waypoints, j joints (`joint_names`), f fingers (`fingers`). Arrays are read-only.
    """

    ok: ClassVar[Literal[True]] = True
    """A plan is a plan."""

    def __init__(self, native: _regrasp.Plan, *, path: str | None = None, report: Report | None = None) -> None:
        fields: dict[str, Any] = json.loads(native.header())
        self._native = native
        self.path: str | None = path
        """The file it was read from, or last saved to."""
        # The scene it was planned for, when `plan` made it.
        self._source: Scene | None = None
        self.report: Report | None = report
        """What the checker said when `plan` made it."""
        self.query: str = fields["query"]
        """Name of the scene's task; empty in scenes of one task."""
        self.hand: str = fields["hand"]
        """Name in the scene of the hand that moves."""
        self.object: str = fields["object"]
        """Name of the object that it moves. All else rests."""
        self.joint_names: tuple[str, ...] = tuple(fields["joint_names"])
        self.held_joints: Mapping[str, float] = fields["held_joints"]
        """Joints of the hand that the plan does not move, and where each of them has to stand all along, in radians or metres."""
        self.fingers: tuple[str, ...] = tuple(fields["fingers"])
        self.method: str = fields["method"]
        self.seed: int = fields["seed"]
        self.tool: str = fields["tool"]
        """Tool and version that made it."""
        self.settings: Mapping[str, Any] = fields["settings"]
        """Settings of the planner, as they were used; `plan(settings=...)` takes them."""
        self.inputs: tuple[Mapping[str, str], ...] = tuple(fields["inputs"])
        """Files it was made from: `role`, `name`, `sha256`; the scene file first."""
        self.promises: Mapping[str, Any] = fields["promises"]
        """What the checker holds it to; docs/reference/plan-format.md has the keys."""
        self.statistics: Mapping[str, Any] = fields["statistics"]
        """Counts of the search."""
        self.start: Pose = pose_of(fields["start"])
        """World from object, asked for at the start."""
        self.goal: Pose = pose_of(fields["goal"])
        """World from object, asked for at the goal."""
        self.segments: tuple[Segment, ...] = _segments(fields["segments"])

    @staticmethod
    def from_file(path: StrPath) -> Plan:
        """Reads a plan file. It is not judged: `check` does. Raises `InputError`."""
        return Plan(_regrasp.Plan.load(os.fspath(path)), path=os.fspath(path))

    @staticmethod
    def from_json(content: str | bytes, *, name: str = "plan.json") -> Plan:
        """Reads the content of a plan file; errors call it `name`. Raises `InputError`."""
        data = content.encode("utf-8", "surrogatepass") if isinstance(content, str) else bytes(content)
        return Plan(_regrasp.Plan.parse(data, name))

    def to_json(self) -> bytes:
        """The plan file: the same plan gives the same bytes, which are those that the command line writes."""
        return self._native.to_json()

    def save(self, path: StrPath) -> None:
        """Writes the plan file, whole or not at all. Raises `InputError` (F003) when it cannot be written."""
        _regrasp.Plan.write(os.fspath(path), self.to_json())
        self.path = os.fspath(path)

    def to_npz(self, path: StrPath | None = None) -> bytes:
        """The arrays as an `.npz` file, without pickle; written to `path` too, if given (docs/reference/export-formats.md)."""
        return self._exported(path, self._native.to_npz())

    def to_ros2(self, path: StrPath | None = None) -> str:
        """A ROS 2 `trajectory_msgs/JointTrajectory` as YAML; written to `path` too, if given (docs/reference/export-formats.md)."""
        return self._exported(path, self._native.to_ros2().encode()).decode()

    @staticmethod
    def _exported(path: StrPath | None, content: bytes) -> bytes:
        if path is not None:
            _regrasp.Plan.write(os.fspath(path), content)
        return content

    @cached_property
    def _arrays(self) -> dict[str, npt.NDArray[Any]]:
        raw = self._native.arrays()
        return {name: np.ndarray(shape, np.dtype(dtype), data) for name, (dtype, shape, data) in raw.items()}

    @property
    def n_waypoints(self) -> int:
        """n: of all segments together."""
        return self.segments[-1].stop

    @property
    def times(self) -> FloatArray:
        """(n,): seconds from the start."""
        return self._arrays["times"]

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.times[-1])

    @property
    def joints(self) -> FloatArray:
        """(n, j): positions of the joints."""
        return self._arrays["joints"]

    @property
    def joint_velocities(self) -> FloatArray:
        """(n, j): velocities of the joints."""
        return self._arrays["joint_velocities"]

    @property
    def joint_torques(self) -> FloatArray | None:
        """(n, j): torques of the joints; none in plans without forces."""
        return self._arrays.get("joint_torques")

    @property
    def object_positions(self) -> FloatArray:
        """(n, 3): position of the object in the world."""
        return self._arrays["object_positions"]

    @property
    def object_quat_xyzw(self) -> FloatArray:
        """(n, 4): orientation of the object in the world, w >= 0."""
        return self._arrays["object_quat_xyzw"]

    @property
    def contact_modes(self) -> npt.NDArray[np.uint8]:
        """(n, f): index in `regrasp.CONTACT_MODES`: 0 free, 1 fixed, 2 rolling; others in tracking."""
        return self._arrays["contact_modes"]

    @property
    def contact_points_in_object(self) -> FloatArray:
        """(n, f, 3): contact points in the object frame; NaN where the finger is free."""
        return self._arrays["contact_points_in_object"]

    @property
    def contact_normals_in_object(self) -> FloatArray:
        """(n, f, 3): outward normals of the object there; NaN where the finger is free."""
        return self._arrays["contact_normals_in_object"]

    @property
    def contact_forces_in_object(self) -> FloatArray:
        """(n, f, 3): forces of the fingers on the object, in newtons, in the object frame; NaN where the finger is free, and in
        plans without forces."""
        return self._arrays["contact_forces_in_object"]

    @property
    def contact_torsions(self) -> FloatArray:
        """(n, f): moments about the outward normals; NaN for point contacts and where the finger is free."""
        return self._arrays["contact_torsions"]

    @property
    def segment_of_waypoint(self) -> npt.NDArray[np.int64]:
        """(n,): index in `segments`."""
        return self._arrays["segment_of_waypoint"]

    def __bool__(self) -> Literal[True]:
        return True

    def __eq__(self, other: object) -> bool:
        """True when the plan files are the same, byte by byte."""
        return self.to_json() == other.to_json() if isinstance(other, Plan) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.to_json())

    def __reduce__(self) -> tuple[Any, ...]:
        # As the bytes of its file: nothing else of it is worth trusting.
        return (Plan.from_json, (self.to_json(),))

    def __repr__(self) -> str:
        transfers, relocations = self.statistics["transfers"], self.statistics["relocations"]
        if self.promises.get("tracking") is not None:
            # What the statistics call transfers are sub-goals there (docs/reference/plan-format.md).
            relocated = f", {relocations} relocations" if relocations else ""
            return (
                f"<Plan: tracking over {transfers} sub-goals{relocated}, {self.n_waypoints} waypoints, {self.duration:.1f} s>"
            )
        return (
            f"<Plan: {transfers} transfers, {relocations} relocations, {self.n_waypoints} waypoints, {self.duration:.1f} s, "
            f"closure margin {self.promises['kept_margin']:.4f}>"
        )

    def _repr_html_(self) -> str:
        """The page of the plan in a frame, where its scene is known and still there; else a table of its segments."""
        heading = f"<b>{escape(repr(self)[1:-1])}</b>"
        page = self._page()
        if page is None:
            return heading + self._table()
        # The page runs scripts of its own, in an origin of its own.
        return (
            f'{heading}<iframe srcdoc="{escape(page, quote=True)}" sandbox="allow-scripts" title="plan" '
            'width="100%" height="720" style="border: 0"></iframe>'
        )

    def _page(self) -> str | None:
        from ._planning import view

        if self._source is None and self.path is None:
            return None
        try:
            return view(self)
        except InputError:
            return None

    def _table(self) -> str:
        rows = "".join(
            f"<tr><td>{index}</td><td>{segment.kind}</td><td>{escape(', '.join(segment.moving))}</td>"
            f"<td>{self.times[segment.start]:.2f} s</td><td>{segment.stop - segment.start}</td></tr>"
            for index, segment in enumerate(self.segments)
        )
        head = "<tr><th></th><th>segment</th><th>moving finger</th><th>from</th><th>waypoints</th></tr>"
        return f"<table>{head}{rows}</table>"


def _segments(entries: list[dict[str, Any]]) -> tuple[Segment, ...]:
    segments: list[Segment] = []
    start = 0
    for entry in entries:
        stop = start + entry["n_waypoints"]
        also = tuple(entry["also_moving"])
        segments.append(
            Segment(
                entry["kind"], entry["moving_finger"], start, stop, also, entry["rolling_finger"], tuple(entry["held_by"])
            )
        )
        start = stop
    return tuple(segments)
