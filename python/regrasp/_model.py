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
from ._scene_text import Document, document_of, posed, sections, sized, table_at, toml_of, with_values

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

    def __post_init__(self) -> None:
        """Lists and tuples become arrays. Raises ``InputError`` (A510) for what holds no numbers."""
        for name in ("position", "quat_xyzw"):
            values = getattr(self, name)
            if isinstance(values, np.ndarray):
                continue
            try:
                array = np.array(values, dtype=np.float64)
            except (TypeError, ValueError):
                raise argument_error("Pose", name, f"is {values!r}", "an array of numbers") from None
            object.__setattr__(self, name, array)

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
    """"point", "sphere", "ellipsoid" or "hull"."""
    surface: str
    """What touches: "point", "sphere" or "ellipsoid", and of hulls that are no ellipsoid "smooth_hull"."""
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
    """What is asked of one hand and one object of a scene, or of a whole robot."""

    name: str
    """Empty in scenes of one task."""
    kind: Literal["in_hand", "tracking", "motion", "pick_and_place"]
    hand: str
    """Name of the hand in the scene; empty in tasks of kind "motion"."""
    object: str
    """Name of the object; empty in tasks of kind "motion"."""
    robot: str | None = None
    """Name of the robot, in tasks of kind "motion"."""


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


Gravity = list[float] | str | None
"""Gravity instead of the scene file's."""

Source = tuple[str, dict[str, str], bool, Gravity]
"""What a scene was read from: file, packages, lenient, gravity instead of the file's."""


class Scene:
    """Hands, objects, supports, obstacles and tasks. Made by `load_scene`, `Scene.from_toml` or `Scene.from_dict`.

    A scene is pickled by value: with the content of every file that it names, so that another machine needs none of them.
    """

    def __init__(self, native: _regrasp.Scene, source: Source, *, on_disk: bool = True) -> None:
        fields: dict[str, Any] = json.loads(native.describe())
        self._native = native
        self._source = source
        self._on_disk = on_disk
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

    @staticmethod
    def from_toml(
        text: str | bytes,
        *,
        base: StrPath = "",
        name: str = "scene",
        packages: Mapping[str, StrPath] | None = None,
        lenient: bool = False,
        gravity: Sequence[float] | Literal["any"] | None = None,
    ) -> Scene:
        """The scene with this content of a scene file, without a file.

        base: the folder that file names in `text` are relative to; the current one where nothing is said.
        name: what the scene is called; its file would be `name.toml` in `base`.
        packages, lenient, gravity: as in `load_scene`. Raises `InputError`.
        """
        content = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else bytes(text)
        path, named = os.path.join(os.fspath(base), f"{name}.toml"), _named(packages)
        options = load_options("Scene.from_toml", named, lenient)
        stated = _stated(gravity)
        native = _regrasp.Scene.parse(content, path, options, stated)
        return Scene(native, (path, named, lenient, stated), on_disk=False)

    @staticmethod
    def from_dict(
        document: Mapping[str, Any],
        *,
        base: StrPath = "",
        name: str = "scene",
        packages: Mapping[str, StrPath] | None = None,
        lenient: bool = False,
        gravity: Sequence[float] | Literal["any"] | None = None,
    ) -> Scene:
        """As `from_toml`, with the keys and values of a scene file as a dictionary; arrays of numpy count as lists."""
        text = toml_of(document, "Scene.from_dict")
        return Scene.from_toml(text, base=base, name=name, packages=packages, lenient=lenient, gravity=gravity)

    def to_toml(self) -> str:
        """The content of the scene file."""
        return self._native.text().decode("utf-8-sig")

    def to_dict(self) -> dict[str, Any]:
        """Keys and values of the scene file; yours to change, for `from_dict`."""
        return document_of(self._native.text(), self.path)

    @cached_property
    def _document(self) -> Document:
        return self.to_dict()

    def with_keys(self, values: Mapping[str, Any]) -> Scene:
        """The scene with other values in its file, by dotted key: `{"object.friction": 0.6, "goal.turn.angle_deg": 45}`.

        In a list of tables an entry is meant by its name or index: `objects.cube.mass`, `tasks.0.goal`. Hands and meshes that
        both scenes name are not loaded again, so this takes about a millisecond. Raises `InputError`, as `load_scene` would.
        """
        text = toml_of(with_values(self._document, values, "Scene.with_keys"), "Scene.with_keys")
        return Scene(self._native.varied(text.encode()), self._source, on_disk=False)

    def with_(
        self,
        *,
        goal: Pose | Mapping[str, Any] | None = None,
        start: Pose | Mapping[str, Any] | None = None,
        friction: float | None = None,
        mass: float | None = None,
        size: float | Sequence[float] | None = None,
        scale: float | Sequence[float] | None = None,
        object: str | None = None,
        task: str | None = None,
    ) -> Scene:
        """The scene with another goal, start or object; hands and meshes are not loaded again.

        goal, start: world from object, or keys of `[goal]` and `[start]`: `goal={"turn": {"axis": "x", "angle_deg": 45}}`.
        friction, mass: of the object; the mass in kilograms.
        size: of a primitive, in metres: radius of a sphere, edges of a box, half axes of an ellipsoid, (radius, length) of
        cylinders and capsules.
        scale: factor of a mesh (one, or one per axis, instead of that of the scene), or of the size of a primitive.
        object, task: by name; the first where nothing is said.

        Raises `InputError`: of arguments (A510), and as `load_scene` would.
        """
        document = self._document
        of_object, of_task = sections(document, object, task)
        values: dict[str, Any] = {}
        for key, pose in (("start", start), ("goal", goal)):
            if pose is not None:
                fields = (
                    {"position": pose.position.tolist(), "quat_xyzw": pose.quat_xyzw.tolist()} if isinstance(pose, Pose) else pose
                )
                values[of_task + key] = posed(table_at(document, of_task + key, "Scene.with_"), fields)
        body = table_at(document, of_object[:-1], "Scene.with_")
        changed: Document = {**body}
        if friction is not None:
            changed["friction"] = friction
        if mass is not None:
            changed.pop("density", None)
            changed["mass"] = mass
        if size is not None or scale is not None:
            changed.update(sized(body, size, scale))
        if changed != body:
            values[of_object[:-1]] = changed
        return self.with_keys(values)

    def _afresh(self) -> Scene:
        """The same scene, read again from its file where it has one."""
        return _load_scene(*self._source) if self._on_disk else self

    def __reduce__(self) -> tuple[Any, ...]:
        # By value, with every file that it names: what a scene is stands there.
        kept = [(name, path, content) for _, name, path, _, content in self._native.files()]
        return (_restored, (self._native.text(), kept, self._source))

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
    return _load_scene(os.fspath(path), _named(packages), lenient, _stated(gravity))


def _named(packages: Mapping[str, StrPath] | None) -> dict[str, str]:
    return {name: os.fspath(folder) for name, folder in (packages or {}).items()}


def _stated(gravity: Sequence[float] | str | None) -> Gravity:
    return gravity if gravity is None or isinstance(gravity, str) else [float(x) for x in gravity]


def _restored(text: bytes, kept: list[tuple[str, str, bytes]], source: Source) -> Scene:
    path, _, lenient, gravity = source
    return Scene(_regrasp.Scene.restore(text, path, kept, lenient, gravity), source, on_disk=False)


def _load_scene(path: str, packages: dict[str, str], lenient: bool, gravity: Gravity) -> Scene:
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
