"""Episodes at a fixed frame rate, by the plan's own interpolation: what exports for learning are made of."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from ..simulate.plans import flat
from ..simulate.reference import reference
from .packing import unpack
from .reading import Episode
from .specification import PICK_AND_PLACE
from .tables import fault

Single = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Layout:
    """What a frame holds: the same for all episodes of an export."""

    joint_names: tuple[str, ...]
    fingers: tuple[str, ...]
    held_joints: tuple[tuple[str, float], ...] = ()
    """Joints that stand still all along, and where."""


@dataclass(frozen=True)
class Frames:
    """An episode at n frames; j joints, f fingers. SI units; poses are world from object: position, then quaternion x y z w."""

    layout: Layout
    episode: Episode
    time: npt.NDArray[np.float64]
    """(n,): seconds from the start."""
    joints: Single
    """(n, j)."""
    object_pose: Single
    """(n, 7)."""
    next_joints: Single
    """(n, j): joints at the next frame; at the last, those there."""
    torques: Single
    """(n, j): joint torques of the plan; zero in plans without forces."""
    contacts: Single
    """(n, f): 1 where the finger should press on the object."""
    forces: Single
    """(n, 3 f): forces of the fingers on the object, in the object frame; zero where the finger is free."""
    goal_pose: Single
    """(7,)."""

    @property
    def state(self) -> Single:
        """(n, j + 7): joints and object pose."""
        return np.concatenate([self.joints, self.object_pose], axis=1)

    @property
    def action(self) -> Single:
        """(n, 2 j): the next joints and the torques."""
        return np.concatenate([self.next_joints, self.torques], axis=1)

    def names(self) -> dict[str, list[str]]:
        """What the columns of state, action, contacts, forces and goal are."""
        pose = ["x", "y", "z", "qx", "qy", "qz", "qw"]
        joints, fingers = self.layout.joint_names, self.layout.fingers
        return {
            "state": [*joints, *(f"object_{name}" for name in pose)],
            "action": [*joints, *(f"{name}_torque" for name in joints)],
            "contacts": list(fingers),
            "forces": [f"{finger}_{axis}" for finger in fingers for axis in "xyz"],
            "goal": [f"goal_{name}" for name in pose],
        }


def frames_of(episode: Episode, fps: float) -> Frames:
    """The frames of a solved episode. Raises `InputError` (D132) for plans of a whole robot."""
    content = unpack(episode.row)
    if content["task"] == PICK_AND_PLACE:
        problem = "is pick and place: between waypoints its object follows the hand, which only the model of the robot knows"
        raise fault("D132", episode.row["task"], problem, fix="export npz, or export another task with --task NAME")
    plan = flat(content)
    ref = reference(plan, tick=1.0 / fps)
    points = [waypoint for segment in plan["segments"] for waypoint in segment["waypoints"]]
    j, fingers = len(plan["joint_names"]), plan["fingers"]
    torques = np.array([point.get("joint_torques", [0.0] * j) for point in points])
    forces = np.array([[contact.get("force_in_object", [0.0] * 3) for contact in point["contacts"]] for point in points])
    joints = ref.joints.astype(np.float32)
    pose = np.concatenate([ref.object_position, ref.object_quat_wxyz[:, [1, 2, 3, 0]]], axis=1)
    return Frames(
        layout=Layout(tuple(plan["joint_names"]), tuple(fingers), _held(content)),
        episode=episode,
        time=np.arange(ref.n_ticks) / fps,
        joints=joints,
        object_pose=pose.astype(np.float32),
        next_joints=np.concatenate([joints[1:], joints[-1:]]),
        torques=ref.blend(torques).astype(np.float32),
        contacts=ref.presses.astype(np.float32),
        forces=ref.blend(forces).reshape(ref.n_ticks, -1).astype(np.float32),
        goal_pose=np.asarray(episode.row["goal_pose"], np.float32),
    )


def _held(content: dict[str, Any]) -> tuple[tuple[str, float], ...]:
    """Of the hands of a plan file."""
    hands: list[dict[str, Any]] = content["hands"]
    positions = [item for hand in hands for item in cast("dict[str, float]", hand.get("held_joints", {})).items()]
    return tuple(sorted(positions))


def all_frames(episodes: Iterable[Episode], fps: float) -> Iterator[Frames]:
    """The frames of every episode. Raises `InputError` (D126) where hands differ: such exports have one row layout."""
    layout: Layout | None = None
    for episode in episodes:
        frames = frames_of(episode, fps)
        if layout is not None and frames.layout != layout:
            name = episode.row["task"]
            problem = f"has the joints {short(frames.layout)}, other episodes have {short(layout)}{_standing(frames.layout, layout)}"
            raise fault("D126", name, problem, fix="export one task at a time: --task NAME")
        layout = frames.layout
        yield frames


def short(layout: Layout) -> str:
    """Joint names, cut."""
    text = json.dumps(list(layout.joint_names))
    return text if len(text) < 80 else text[:77] + "..."


def _standing(own: Layout, other: Layout) -> str:
    """Which joints stand still, where that differs."""
    if own.held_joints == other.held_joints:
        return ""
    return f"; still stand {dict(own.held_joints)}, there {dict(other.held_joints)}"


__all__ = ["Frames", "Layout", "all_frames", "frames_of"]
