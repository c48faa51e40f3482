"""Hands and scenes, read. They never change, and any number of threads may share one.

SI units, radians. `world_from_x` takes points of frame x to the world.
"""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false, reportUnusedFunction=false

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from . import _descriptions, _regrasp
from ._arguments import StrPath, load_options, seed_of
from ._errors import argument_error

FloatArray = npt.NDArray[np.float64]
"""Doubles, C-contiguous. Those that belong to a scene, hand or plan are read-only."""


def _constant(values: Sequence[float]) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a frame stands in another."""

    position: FloatArray
    """(3,), metres."""
    quat_xyzw: FloatArray
    """(4,), unit quaternion, w >= 0."""

    @property
    def matrix(self) -> FloatArray:
        """(4, 4): parent_from_child, so that `point_in_parent = matrix @ [*point_in_child, 1]`."""
        x, y, z, w = (float(value) for value in self.quat_xyzw)
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:3, 3] = self.position
        return matrix

    def __repr__(self) -> str:
        return f"Pose(position={self.position.tolist()}, quat_xyzw={self.quat_xyzw.tolist()})"


def pose_of(fields: Mapping[str, Any]) -> Pose:
    """A pose as files spell it."""
    return Pose(_constant(fields["position"]), _constant(fields["quat_xyzw"]))


@dataclass(frozen=True, eq=False)
class Shape:
    """What a shape is, and its extent in its own frame."""

    kind: str
    """"sphere", "capsule", "box", "cylinder", "ellipsoid", "convex" or "mesh"."""
    low: FloatArray
    """(3,): lowest coordinates."""
    high: FloatArray
    """(3,): highest coordinates."""


def _shape(fields: Mapping[str, Any]) -> Shape:
    return Shape(fields["kind"], _constant(fields["low"]), _constant(fields["high"]))


@dataclass(frozen=True)
class Joint:
    """An independent joint."""

    name: str
    finger: str
    """The finger that it moves."""
    kind: str
    """"revolute", "continuous" or "prismatic"."""
    lower: float
    """Lowest position, those of joints that follow it taken into account; -inf without a limit."""
    upper: float
    """Highest position; inf without a limit."""
    velocity: float | None
    """Highest speed, where the robot file says."""
    effort: float | None
    """Highest torque (or force), where the robot file says."""


@dataclass(frozen=True)
class CoupledJoint:
    """A joint that follows others: `position = multiplier * position(follows) + offset`, and more terms in `others`."""

    name: str
    follows: str
    multiplier: float
    offset: float
    others: tuple[tuple[str, float], ...] = ()
    """More joints that it follows, with their multipliers."""


@dataclass(frozen=True)
class Tip:
    """A fingertip."""

    link: str
    shape: str
    """"point", "sphere" or "hull"."""
    radius: float
    """Of a sphere; 0 for others."""
    contact: str
    """Contact model: "frictionless", "point" or "soft_finger"."""
    torsion_radius: float | None
    """Of a soft finger."""


@dataclass(frozen=True)
class Finger:
    """A finger."""

    name: str
    joint_names: tuple[str, ...]
    tip: Tip
    rest: tuple[float, ...]
    """Posture when nothing else is asked of it, in the order of `joint_names`."""


class Hand:
    """A palm and fingers. Made by `load_hand`, or part of a scene, where it is placed in the world."""

    def __init__(self, tips: Callable[[bytes], bytes], fields: Mapping[str, Any]) -> None:
        self._tips = tips
        self.name: str = fields["name"]
        """Name of the robot."""
        self.name_in_scene: str | None = fields["name_in_scene"]
        """What the scene calls it; none for a hand without a scene."""
        self.base_link: str = fields["base_link"]
        """The link whose frame is the hand frame."""
        self.world_from_base: Pose = pose_of(fields["world_from_base"])
        self.joints: tuple[Joint, ...] = tuple(_joint(entry) for entry in fields["joints"])
        """Independent joints, finger by finger: the order of every joint vector."""
        self.coupled_joints: tuple[CoupledJoint, ...] = tuple(_coupled_joint(entry) for entry in fields["coupled_joints"])
        self.fingers: tuple[Finger, ...] = tuple(_finger(entry) for entry in fields["fingers"])
        """Fingers, in the order of every contact list."""
        self.notes: tuple[str, ...] = tuple(fields.get("notes", ()))
        """Remarks of the reader."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the independent joints, in the order of every joint vector."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def limits(self) -> FloatArray:
        """(j, 2): lowest and highest position of every joint."""
        limits = np.empty((len(self.joints), 2))
        limits[:, 0] = [joint.lower for joint in self.joints]
        limits[:, 1] = [joint.upper for joint in self.joints]
        limits.flags.writeable = False
        return limits

    def joint_vector(self, positions: Mapping[str, float]) -> FloatArray:
        """(j,): positions given by name, in the order of `joint_names`. Raises `InputError` for names unknown or missing."""
        names = self.joint_names
        unknown = sorted(set(positions) - set(names))
        missing = [name for name in names if name not in positions]
        if unknown or missing:
            problem = f"names unknown joints {unknown}" if unknown else f"lacks joints {missing}"
            raise argument_error("Hand.joint_vector", "positions", problem, f"a value for each of {list(names)}")
        return np.array([positions[name] for name in names], dtype=np.float64)

    def tips(self, joints: npt.ArrayLike) -> FloatArray:
        """Centres of the fingertips in the world (in the base frame, for a hand without a scene), by forward kinematics.

        `joints` is (j,) or (n, j), in the order of `joint_names`; the answer is (f, 3) or (n, f, 3).
        """
        values = np.ascontiguousarray(joints, dtype=np.float64)
        if values.ndim not in (1, 2) or values.shape[-1] != len(self.joints):
            expected = f"shape ({len(self.joints)},) or (n, {len(self.joints)})"
            raise argument_error("Hand.tips", "joints", f"has shape {values.shape}", expected)
        shape = (*values.shape[:-1], len(self.fingers), 3)
        return np.ndarray(shape, np.float64, self._tips(values.tobytes()))

    def __repr__(self) -> str:
        fingers = ", ".join(finger.name for finger in self.fingers)
        return f"<Hand {self.name!r}: {len(self.joints)} joints, fingers {fingers}>"


def _joint(fields: Mapping[str, Any]) -> Joint:
    lower, upper = fields["lower"], fields["upper"]
    return Joint(
        name=fields["name"],
        finger=fields["finger"],
        kind=fields["kind"],
        lower=-float("inf") if lower is None else lower,
        upper=float("inf") if upper is None else upper,
        velocity=fields["velocity"],
        effort=fields["effort"],
    )


def _coupled_joint(fields: Mapping[str, Any]) -> CoupledJoint:
    made: dict[str, Any] = {**fields, "others": tuple((name, factor) for name, factor in fields["others"])}
    return CoupledJoint(**made)


def _finger(fields: Mapping[str, Any]) -> Finger:
    return Finger(fields["name"], tuple(fields["joint_names"]), Tip(**fields["tip"]), tuple(fields["rest"]))


@dataclass(frozen=True, eq=False)
class Object:
    """An object that hands can move. Its frame is that of its shape."""

    name: str
    shape: Shape
    mass: float
    center_of_mass: FloatArray
    """(3,), in the object frame."""
    friction: float
    """Coulomb coefficient between fingertips and object."""
    radius: float
    """Largest distance of its surface from its centre of mass."""
    collides_as_hull: bool
    """True where its convex hull stands for it, but to fingertips."""
    world_from_object: Pose
    """Where it is at the beginning."""


def _object(fields: Mapping[str, Any]) -> Object:
    made: dict[str, Any] = {
        **fields,
        "shape": _shape(fields["shape"]),
        "center_of_mass": _constant(fields["center_of_mass"]),
        "world_from_object": pose_of(fields["world_from_object"]),
    }
    return Object(**made)


@dataclass(frozen=True, eq=False)
class Obstacle:
    """Something fixed in the world that nothing may touch."""

    name: str
    shape: Shape
    world_from_obstacle: Pose


@dataclass(frozen=True, eq=False)
class Support:
    """Something fixed in the world that objects may stand on."""

    name: str
    shape: Shape
    world_from_support: Pose


@dataclass(frozen=True)
class Task:
    """What is asked of one hand and one object of a scene."""

    name: str
    """Empty in scenes of one task."""
    kind: Literal["in_hand", "tracking"]
    hand: str
    """Name of the hand in the scene."""
    object: str
    """Name of the object."""


@dataclass(frozen=True)
class InputFile:
    """A file that a scene was read from."""

    role: str
    """"scene", "hand", "urdf", "srdf" or "mesh"."""
    name: str
    """How the scene spells it."""
    path: str
    """Where it was found."""
    sha256: str


@dataclass(frozen=True, eq=False)
class Query:
    """What is asked, with the randomness of the scene file resolved by a seed."""

    start: Pose
    """World from object at the start."""
    way: tuple[Pose, ...]
    """Poses to be passed, in order."""
    goal: Pose
    """World from object at the goal."""


Source = tuple[str, dict[str, str], bool, list[float] | str | None]
"""What a scene was read from: file, packages, lenient, gravity instead of the file's."""


class Scene:
    """Hands, objects, supports, obstacles and tasks. Made by `load_scene`."""

    def __init__(self, native: _regrasp.Scene, source: Source) -> None:
        fields: dict[str, Any] = json.loads(native.describe())
        self._native = native
        self._source = source
        self.name: str = fields["name"]
        self.path: str = fields["path"]
        """The scene file, as it was named."""
        self.hands: tuple[Hand, ...] = tuple(
            Hand(partial(native.tips, index), entry) for index, entry in enumerate(fields["hands"])
        )
        """The hands, in the order of the file; at least one."""
        self.objects: tuple[Object, ...] = tuple(_object(entry) for entry in fields["objects"])
        """The objects that hands can move, in the order of the file; at least one."""
        self.supports: tuple[Support, ...] = tuple(
            Support(entry["name"], _shape(entry["shape"]), pose_of(entry["world_from_support"]))
            for entry in fields["supports"]
        )
        """What objects may stand on."""
        self.obstacles: tuple[Obstacle, ...] = tuple(
            Obstacle(entry["name"], _shape(entry["shape"]), pose_of(entry["world_from_obstacle"]))
            for entry in fields["obstacles"]
        )
        self.tasks: tuple[Task, ...] = tuple(Task(**entry) for entry in fields["tasks"])
        """What is asked, in the order of the file; at least one."""
        gravity = fields["gravity"]
        self.gravity: FloatArray | Literal["any"] | None = (
            _constant(cast("list[float]", gravity)) if isinstance(gravity, list) else gravity
        )
        """(3,): acceleration in the world, in m/s^2; "any" where the grasp has to hold whatever its direction; none where the
        scene leaves it open, and it is along the world's -Z."""
        self.inputs: tuple[InputFile, ...] = tuple(InputFile(**entry) for entry in fields["inputs"])
        """Every file that was read, the scene file first."""
        self.notes: tuple[str, ...] = tuple(fields["notes"])
        """Remarks of the reader."""

    @property
    def hand(self) -> Hand:
        """The first hand: of most scenes there is no other."""
        return self.hands[0]

    @property
    def object(self) -> Object:
        """The first object: of most scenes there is no other."""
        return self.objects[0]

    @property
    def start(self) -> Pose:
        """World from object at the start of the first task, as seed 0 draws it where the scene leaves it open."""
        return self.query().start

    @property
    def goal(self) -> Pose:
        """World from object at the goal of the first task, of seed 0."""
        return self.query().goal

    def query(self, seed: int = 0, *, task: str | None = None) -> Query:
        """What is asked with `seed`, by the task called `task` or the first. Raises `InputError` (A510) for an unknown task."""
        fields = json.loads(self._native.query(seed_of("Scene.query", seed), task))
        way = tuple(pose_of(entry) for entry in fields["way"])
        return Query(pose_of(fields["start"]), way, pose_of(fields["goal"]))

    def __reduce__(self) -> tuple[Any, ...]:
        # Read again from its files: what a scene is stands there.
        return (_load_scene, self._source)

    def __repr__(self) -> str:
        hands = [hand.name if len(self.hands) == 1 else f"{hand.name_in_scene} ({hand.name})" for hand in self.hands]
        objects = [f"{each.shape.kind} {each.name!r}" for each in self.objects]
        counts = (("supports", self.supports), ("obstacles", self.obstacles))
        others = [f"{len(bodies)} {what}" for what, bodies in counts if bodies]
        return f"<Scene {self.name!r}: {', '.join([*hands, *objects, *others])}>"


def load_scene(
    path: StrPath,
    *,
    packages: Mapping[str, StrPath] | None = None,
    lenient: bool = False,
    gravity: Sequence[float] | Literal["any"] | None = None,
) -> Scene:
    """Reads a scene file and every file it names.

    `packages` says where `package://NAME/` is; `ROS_PACKAGE_PATH` and `AMENT_PREFIX_PATH` are looked at after it. With
    `lenient`, what cannot be understood in robot files is dropped and listed in `notes`, instead of refused.

    gravity: instead of the scene file's: a direction in the frame of the hand's base link, or "any". Plans are made and judged
    under it.

    Raises `InputError`, with every cause found.
    """
    named = {name: os.fspath(folder) for name, folder in (packages or {}).items()}
    stated = gravity if gravity is None or isinstance(gravity, str) else [float(x) for x in gravity]
    return _load_scene(os.fspath(path), named, lenient, stated)


def _load_scene(path: str, packages: dict[str, str], lenient: bool, gravity: list[float] | str | None) -> Scene:
    native = _regrasp.Scene.load(path, load_options("load_scene", packages, lenient), gravity)
    return Scene(native, (path, packages, lenient, gravity))


def load_hand(path: StrPath, *, packages: Mapping[str, StrPath] | None = None, lenient: bool = False) -> Hand:
    """Reads a hand file, or a URDF whose fingers are then guessed. Arguments and errors as `load_scene`.

    A name of the package `robot_descriptions`, such as "allegro_hand_description", is a hand as well: its files are fetched once.
    Raises `ImportError` where that package, or `mujoco` for a MJCF file of it, is not installed.
    """
    if isinstance(path, str) and _descriptions.is_description(path):
        return _load_described(path, packages, lenient)
    native = _regrasp.Hand.load(os.fspath(path), load_options("load_hand", packages, lenient))
    return Hand(native.tips, json.loads(native.describe()))


def _load_described(name: str, packages: Mapping[str, StrPath] | None, lenient: bool) -> Hand:
    """The hand that `robot_descriptions` calls `name`."""
    module = _descriptions.fetched(name)
    file = _descriptions.model_file(module)
    own, search = _descriptions.packages_of(module)
    folder = None
    if file == getattr(module, "MJCF_PATH", None):
        file, folder = _descriptions.converted(file)
    try:
        named, more, is_lenient = load_options("load_hand", {**own, **(packages or {})}, lenient)
        native = _regrasp.Hand.load(file, (named, [*search, *more], is_lenient))
    finally:
        if folder is not None:
            folder.cleanup()
    return Hand(native.tips, json.loads(native.describe()))
