"""What an executor asks of a robot, or of a simulation of one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ..simulate.reference import Array


@dataclass(frozen=True)
class Observation:
    """What is known at one control tick. Lists are fine in place of arrays; what has another shape, or numbers beyond 1e6, is left out."""

    time: float
    """Of the plant's clock, in seconds. It may begin anywhere; a run ends where it stands still for ``patience``."""
    joints: Array
    """Positions of the hand's joints, in the order of the plant's ``joint_names``, in radians or metres; NaN where one is missing."""
    pose_stamp: float | None = None
    """When the newest pose of the object was seen, on the plant's clock; none before the first. A pose is new where its stamp is."""
    object_position: Array | None = None
    """Of the object's frame in the world of the scene, in metres. Shape (3,)."""
    object_quat_wxyz: Array | None = None
    """Its orientation, w first; a `Pose` has w last. Shape (4,)."""
    tip_forces: Array | None = None
    """Normal force of every fingertip, in newtons, where that is felt. Shape (n_fingers,)."""


@dataclass(frozen=True)
class Command:
    """What the joints are told for one control tick, in the order of ``joint_names``. Take what the drives understand."""

    servo: Array
    """Stiffness times target, plus damping times velocity, plus torque: for torque drives with the gains of the plan's hand."""
    positions: Array
    """For position drives: targets that hold the share of the torque which the stiffness then makes."""
    velocities: Array
    """Planned velocities, in radians or metres per second."""


class Plant(Protocol):
    """A hand with an object in it, which it holds as the run begins.

    More members are optional. ``wait()``: waits for a tick and gives no command. ``holding``: the command that holds the object as the run
    begins; `holding_command` makes one of a plan. ``scene``: for `execute` without a session. ``truth()``: where the object really is,
    position and quaternion w x y z, of a simulation.

    Before the first leg the executor waits where it can, else gives ``holding``, else a command that it makes itself of the grasp that is
    seen. As long as it finds none, it gives no command.
    """

    joint_names: tuple[str, ...]
    """Joints of the hand, as the scene names them, in the order of ``session.hand.joint_names``."""
    fingers: tuple[str, ...]
    """Fingers of the hand, as the scene names them, in the order of ``session.hand.fingers``."""
    tick: float
    """Time between two commands, in seconds."""

    def observe(self) -> Observation:
        """What is known now. Does not wait."""
        ...

    def apply(self, command: Command) -> None:
        """Gives a command and waits until the next one is due. The plant keeps the last command that it has."""
        ...
