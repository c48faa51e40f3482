"""Grasp lists: grasps of one hand and one object, each with a way in."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from . import _regrasp
from ._arguments import StrPath, load_options

FloatArray = npt.NDArray[np.float64]


class GraspList:
    """Grasps of one hand and one object, best score first. True when there are some."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._data: dict[str, Any] = json.loads(text)

    def __len__(self) -> int:
        return len(self.grasps)

    def __bool__(self) -> bool:
        return len(self) > 0

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.grasps)

    def __repr__(self) -> str:
        hand, thing = self._data["hand"]["name"], self._data["object"]["name"]
        return f"GraspList({len(self)} grasps of {thing!r} by {hand!r})"

    @property
    def grasps(self) -> list[dict[str, Any]]:
        """The grasps, as in the file."""
        return cast("list[dict[str, Any]]", self._data["grasps"])

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints, in the order of every joint vector."""
        return cast("list[str]", self._data["hand"]["joint_names"])

    @property
    def held_joints(self) -> dict[str, float]:
        """Joints of the hand that no grasp moves, such as a wrist's, and where they stand, in radians or metres."""
        return dict(cast("dict[str, float]", self._data["hand"].get("held_joints", {})))

    @property
    def joints(self) -> FloatArray:
        """(grasps, joints): joint positions of the grasps."""
        return np.array([grasp["joints"] for grasp in self.grasps], dtype=np.float64)

    @property
    def open_joints(self) -> FloatArray:
        """(grasps, joints): joint positions of the open hand."""
        return np.array([grasp["open_joints"] for grasp in self.grasps], dtype=np.float64)

    @property
    def poses(self) -> FloatArray:
        """(grasps, 7): position and `quat_xyzw` of the hand in the object frame."""
        poses = [grasp["object_from_hand"] for grasp in self.grasps]
        return np.array([[*pose["position"], *pose["quat_xyzw"]] for pose in poses], dtype=np.float64)

    def to_dict(self) -> dict[str, Any]:
        """The whole list, as in the file."""
        return cast("dict[str, Any]", json.loads(self._text))

    def to_dexgraspbench(self, squeeze: float = 0.1) -> dict[str, FloatArray]:
        """The arrays that DexGraspBench evaluates: `pregrasp_qpos`, `grasp_qpos` and `squeeze_qpos`, each (grasps, 7 + joints).

        A row is position and quaternion (w first) of the hand's base link in the object frame, then the joints. To squeeze,
        the joints go on from the open posture through the grasp by the share `squeeze` of that way.
        """
        poses = self.poses[:, [0, 1, 2, 6, 3, 4, 5]]
        squeezed = self.joints + squeeze * (self.joints - self.open_joints)
        rows = {"pregrasp_qpos": self.open_joints, "grasp_qpos": self.joints, "squeeze_qpos": squeezed}
        return {name: np.hstack([poses, joints]) for name, joints in rows.items()}

    def save(self, path: StrPath) -> None:
        """Writes the list as a file."""
        Path(os.fspath(path)).write_text(self._text, encoding="utf-8")

    @staticmethod
    def load(path: StrPath) -> GraspList:
        """Reads a list that `regrasp grasps` or `save` wrote. Judges nothing: see `check_grasps`."""
        return GraspList(Path(os.fspath(path)).read_text(encoding="utf-8"))


class NoGrasps(Exception):
    """No grasp was found, or the checker rejected the list. `why` has the causes."""

    def __init__(self, why: dict[str, Any]) -> None:
        failure = why.get("failure")
        message = failure["message"] if failure else "the checker rejected the list; please report it"
        super().__init__(message)
        self.why = why


def list_grasps(
    hand: StrPath,
    object: StrPath,  # noqa: A002
    *,
    mass: float = 0.1,
    friction: float = 0.8,
    scale: float = 1.0,
    torsion_radius: float | None = None,
    grasps: int | None = None,
    frames: int | None = None,
    settings: Mapping[str, Any] | None = None,
    seed: int = 0,
    threads: int | None = None,
    time_limit: float | None = None,
    packages: Mapping[str, StrPath] | None = None,
    lenient: bool = False,
) -> GraspList:
    """Finds grasps of `object` by `hand` and judges them.

    hand: a hand file or a URDF. object: a mesh, with mass, friction and scale; or a scene file, whose object is taken. settings:
    the keys of "settings" in a grasp list. The list does not depend on the number of threads.

    Raises `InputError` for files that cannot be used, and `NoGrasps`.
    """
    named = {name: os.fspath(folder) for name, folder in (packages or {}).items()}
    request = {
        "hand": os.fspath(hand),
        "object": os.fspath(object),
        "mass": float(mass),
        "friction": float(friction),
        "scale": float(scale),
        "torsion_radius": torsion_radius,
        "grasps": grasps,
        "frames": frames,
        "settings": None if settings is None else json.dumps(dict(settings)),
        "seed": seed,
        "threads": threads or os.cpu_count() or 1,
        "time_limit": time_limit,
    }
    found, why = _regrasp.list_grasps(request, load_options("list_grasps", named, lenient))
    if found is None:
        raise NoGrasps(json.loads(why or "{}"))
    return GraspList(found)


def check_grasps(
    path: StrPath, *, packages: Mapping[str, StrPath] | None = None, lenient: bool = False
) -> dict[str, Any]:
    """Judges the grasp list in a file, from the files of hand and object that it names: `{"accepted": ..., "report": ...}`."""
    named = {name: os.fspath(folder) for name, folder in (packages or {}).items()}
    options = load_options("check_grasps", named, lenient)
    return cast("dict[str, Any]", json.loads(_regrasp.check_grasps(os.fspath(path), os.getcwd(), options)))


def grasps_mjcf(
    path: StrPath, *, packages: Mapping[str, StrPath] | None = None, lenient: bool = False
) -> tuple[str, list[str]]:
    """The MuJoCo model of hand and object of the list in a file, and where the model differs from them.

    Every grasp has two keyframes: the open hand and the grasp. Raises `InputError`.
    """
    named = {name: os.fspath(folder) for name, folder in (packages or {}).items()}
    options = load_options("grasps_mjcf", named, lenient)
    return _regrasp.grasps_mjcf(os.fspath(path), os.getcwd(), options)


__all__: Sequence[str] = ["GraspList", "NoGrasps", "check_grasps", "grasps_mjcf", "list_grasps"]
