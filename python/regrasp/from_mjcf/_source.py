"""What is read from a compiled model of MuJoCo: bodies, joints, geoms and couplings of one hand, and the names of all that is left out.

MuJoCo has resolved includes, defaults, units, frames and mesh assets. Metres, radians, kilograms.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .._errors import RegraspError

FloatArray = npt.NDArray[np.float64]


class MjcfError(RegraspError, ValueError):
    """A model that cannot be written as a URDF, with every cause on a line of its own."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A pose in a parent's frame."""

    position: FloatArray
    """(3,)."""
    rotation: FloatArray
    """(3, 3)."""

    def then(self, other: Placed) -> Placed:
        """`other` is given in this frame; the answer in the parent's."""
        return Placed(self.position + self.rotation @ other.position, self.rotation @ other.rotation)


def moved(position: npt.ArrayLike) -> Placed:
    """A shift."""
    return Placed(np.asarray(position, dtype=np.float64), np.eye(3))


def rotation_of(quat_wxyz: npt.ArrayLike) -> FloatArray:
    """(3, 3), of a quaternion as MuJoCo spells it."""
    q = np.asarray(quat_wxyz, dtype=np.float64)
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def turned(axis: FloatArray, angle: float) -> Placed:
    """A turn about a unit axis through the origin."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return Placed(np.zeros(3), np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross))


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles, in the frame that MuJoCo gave the mesh."""

    name: str
    vertices: FloatArray
    """(n, 3)."""
    faces: npt.NDArray[np.int64]
    """(m, 3), counter-clockwise from outside."""


@dataclass(frozen=True, eq=False)
class Geom:
    """A shape on a body."""

    name: str
    kind: str
    """"box", "sphere", "capsule", "cylinder" or "mesh"."""
    size: tuple[float, ...]
    """box: three lengths; sphere: radius; capsule and cylinder: radius and length (without the round ends)."""
    body_from_geom: Placed
    mesh: Mesh | None
    collides: bool
    visible: bool


@dataclass(frozen=True)
class Coupling:
    """`position = multiplier * position of leader + offset`."""

    leader: str
    multiplier: float
    offset: float


@dataclass(eq=False)
class Joint:
    """A joint of one coordinate, in the frame of its body."""

    name: str
    kind: str
    """"revolute", "continuous" or "prismatic"."""
    axis: FloatArray
    anchor: FloatArray
    """A point of the axis."""
    reference: float
    """Position at which the body stands as its pose says."""
    limits: tuple[float, float] | None
    effort: float | None
    damping: float
    friction: float
    is_driven: bool
    """Has an actuator of its own."""
    held_at: float | None = None
    """Position where an equality constraint holds it."""
    coupling: Coupling | None = None


@dataclass(eq=False)
class Body:
    """A link to be."""

    name: str
    parent: str | None
    """None for the root."""
    parent_from_body: Placed
    joints: list[Joint]
    """In the order in which they move the body."""
    geoms: list[Geom]
    mass: float
    body_from_inertia: Placed
    inertia: FloatArray
    """(3,): about the axes of the inertia frame."""


@dataclass(eq=False)
class Source:
    """One hand of a model."""

    name: str
    path: Path
    bodies: list[Body]
    """Parents first; the root is the first."""
    allow: list[tuple[str, str]]
    """Pairs of bodies that may touch."""
    left_out: dict[str, list[str]] = field(default_factory=dict[str, list[str]])
    """What is not written, by name: kind to names."""
    notes: list[str] = field(default_factory=list[str])
    """What was decided, and what to look at."""

    @property
    def joints(self) -> list[Joint]:
        """All joints."""
        return [joint for body in self.bodies for joint in body.joints]

    def leave_out(self, kind: str, name: str) -> None:
        """Notes that something is not written."""
        self.left_out.setdefault(kind, []).append(name)
