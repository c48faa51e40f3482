"""Problems of MotionBenchMaker as scenes with a task of kind `motion`: `regrasp.import_mbm(folder, robot)`."""

# What PyYAML gives has no types.
# pyright: reportPrivateUsage=false, reportUnknownMemberType=false, reportMissingModuleSource=false

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from ._arguments import StrPath
from ._errors import Diagnostic, InputError, argument_error
from ._scene_text import Document, toml_of

_REQUEST = re.compile(r"request(\d+)\.yaml")
_MAX_BYTES = 64 * 1024 * 1024
_MAX_PROBLEMS = 100_000


@dataclass(frozen=True)
class MotionProblem:
    """A problem of a benchmark: move a robot from one posture to another among obstacles."""

    name: str
    """Family and number: `bookshelf_small_panda/0001`."""
    family: str
    """The folder that it is in."""
    robot_name: str
    """The robot that the problem was made for, as its file says."""
    group: str
    """The planning group that moves."""
    document: Document
    """The scene file as a dictionary."""
    start_of_others: dict[str, float]
    """Start positions of joints that do not move, such as fingers: the robot file says where those are held."""
    may_touch: list[tuple[str, str]]
    """Pairs of links that the problem's matrix lets touch, for `allow` of a robot file."""

    def to_toml(self) -> str:
        """The scene file."""
        return toml_of(self.document, "MotionProblem.to_toml")

    def save(self, path: StrPath) -> None:
        """Writes the scene file. The robot in it is named relative to the folder it was imported for."""
        Path(path).write_text(self.to_toml(), encoding="utf-8", newline="\n")


def import_mbm(folder: StrPath, robot: StrPath, *, output: StrPath | None = None) -> list[MotionProblem]:
    """The problems of MotionBenchMaker below `folder`, for the robot file `robot`, by family and number.

    A problem is a pair of files `requestNNNN.yaml` and `sceneNNNN.yaml` in one folder, as the data sets of MotionBenchMaker have them.
    Boxes, cylinders and spheres become obstacles. The joints of the goal move; all others stay where the robot file has them.

    With `output` every problem is written there too, as `FAMILY/NNNN.toml`, and the scenes name the robot file relative to that.
    Without it they name it by its whole path. Needs the package PyYAML. Raises `InputError`.
    """
    try:
        import yaml  # noqa: F401  # pyright: ignore[reportUnusedImport]
    except ModuleNotFoundError as error:
        raise ImportError("import_mbm needs the package PyYAML: pip install PyYAML", name="yaml") from error
    top, robot = Path(folder), Path(robot)
    if not top.is_dir():
        raise argument_error("import_mbm", "folder", f"is {str(top)!r}, which is no folder", "a folder with request0001.yaml below")
    if not robot.is_file():
        raise argument_error("import_mbm", "robot", f"is {str(robot)!r}, which is no file", "a robot file")
    requests = sorted(path for path in top.rglob("request*.yaml") if _REQUEST.fullmatch(path.name))
    if not requests:
        raise argument_error("import_mbm", "folder", f"is {str(top)!r}, without any problem", "files request0001.yaml and scene0001.yaml")
    if len(requests) > _MAX_PROBLEMS:
        raise argument_error("import_mbm", "folder", f"has {len(requests)} problems", f"at most {_MAX_PROBLEMS}")
    problems: list[MotionProblem] = []
    for request in requests:
        family = request.parent.name
        target = None if output is None else Path(output) / family / f"{_number(request)}.toml"
        robot_file = robot.resolve() if target is None else Path(os.path.relpath(robot.resolve(), target.parent.resolve()))
        problem = _problem(request, family, robot_file.as_posix())
        if target is not None:
            target.parent.mkdir(parents=True, exist_ok=True)
            problem.save(target)
        problems.append(problem)
    robots = sorted({problem.robot_name for problem in problems})
    if len(robots) > 1:
        raise argument_error("import_mbm", "folder", f"has problems of several robots: {', '.join(robots)}", "problems of one robot")
    return problems


def _number(request: Path) -> str:
    found = _REQUEST.fullmatch(request.name)
    return found.group(1) if found else request.stem


def _problem(request: Path, family: str, robot: str) -> MotionProblem:
    number = _number(request)
    scene_file = request.with_name(f"scene{number}.yaml")
    asked, world = _read(request), _read(scene_file)
    goal = _goal(request, asked)
    start = _positions(request, asked, "start_state")
    missing = [name for name in goal if name not in start]
    if missing:
        raise _error(request, "start_state.joint_state", f"has no position of {', '.join(missing)}", "every joint of the goal")
    document: Document = {"format": "regrasp-scene", "format_version": 2, "robot": {"file": robot}}
    placed = _root_pose(request, asked)
    if placed is not None:
        document["robot"]["world_from_robot"] = placed
    obstacles = [shape for each in _list(scene_file, world, "world", "collision_objects") for shape in _obstacles(scene_file, each)]
    if obstacles:
        document["obstacles"] = obstacles
    document["tasks"] = [
        {
            "name": f"{family}_{number}",
            "task": "motion",
            "start": {"joints": {name: start[name] for name in goal}},
            "goal": {"joints": goal},
        }
    ]
    return MotionProblem(
        name=f"{family}/{number}",
        family=family,
        robot_name=str(world.get("robot_model_name", "")),
        group=str(asked.get("group_name", "")),
        document=document,
        start_of_others={name: value for name, value in start.items() if name not in goal},
        may_touch=_may_touch(scene_file, world),
    )


def _read(path: Path) -> dict[str, Any]:
    """A YAML file without aliases: those can make a small file endless."""
    import yaml

    try:
        if path.stat().st_size > _MAX_BYTES:
            raise _error(path, "", f"has {path.stat().st_size} bytes", f"at most {_MAX_BYTES}")
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise _error(path, "", f"cannot be read: {error.strerror}", "both files of a problem, request and scene") from error
    except UnicodeDecodeError as error:
        raise _error(path, "", f"is not UTF-8 at byte {error.start}", "a YAML file") from error
    try:
        events = cast("Any", yaml.parse(text, Loader=yaml.SafeLoader))
        for event in events:
            if isinstance(event, yaml.AliasEvent):
                raise _error(path, "", f"has an alias in line {event.start_mark.line + 1}", "a file without aliases")
        content = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise _error(path, "", f"is no YAML: {str(error).splitlines()[0]}", "a file of MotionBenchMaker") from error
    if not isinstance(content, dict):
        raise _error(path, "", f"holds {type(content).__name__}", "a table")
    return cast("dict[str, Any]", content)


def _error(path: Path, element: str, problem: str, expected: str) -> InputError:
    named = f' key "{element}"' if element else ""
    diagnostic = Diagnostic("V025", str(path), None, None, named.strip(), problem, expected, "")
    return InputError(f"V025 {path}{named}: {problem}; expected {expected}", (diagnostic,))


def _table(path: Path, content: Mapping[str, Any], *keys: str) -> Mapping[str, Any]:
    """The table at nested keys, empty where it is missing."""
    place: Any = content
    for key in keys:
        inside: Any = cast("Mapping[str, Any]", place).get(key) or {}
        if not isinstance(inside, Mapping):
            raise _error(path, ".".join(keys), f"is {inside!r}", "a table")
        place = cast("Any", inside)
    return cast("Mapping[str, Any]", place)


def _list(path: Path, content: Mapping[str, Any], *keys: str) -> list[Any]:
    *parents, last = keys
    value: Any = _table(path, content, *parents).get(last) or []
    if not isinstance(value, list):
        raise _error(path, ".".join(keys), f"is {value!r}", "a list")
    return cast("list[Any]", value)


def _numbers(path: Path, element: str, value: Any, n: int | None = None) -> list[float]:
    """Finite numbers, `n` of them where that is given."""
    try:
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        numbers = np.full(1, np.nan)
    if numbers.ndim != 1 or (n is not None and len(numbers) != n) or not np.isfinite(numbers).all():
        raise _error(path, element, f"is {value!r}", f"{n if n is not None else 'a list of'} finite numbers")
    return [float(number) for number in numbers]


def _positions(path: Path, asked: Mapping[str, Any], key: str) -> dict[str, float]:
    names = [str(name) for name in _list(path, asked, key, "joint_state", "name")]
    positions = _numbers(path, f"{key}.joint_state.position", _list(path, asked, key, "joint_state", "position"), len(names))
    return dict(zip(names, positions))


def _goal(path: Path, asked: Mapping[str, Any]) -> dict[str, float]:
    constraints = _list(path, asked, "goal_constraints")
    rows = _list(path, cast("Mapping[str, Any]", constraints[0]), "joint_constraints") if len(constraints) == 1 else []
    if not rows:
        raise _error(path, "goal_constraints", f"has {len(constraints)} goals", "one goal with joint_constraints")
    goal: dict[str, float] = {}
    for row in rows:
        if not isinstance(row, Mapping) or "joint_name" not in row:
            raise _error(path, "goal_constraints.joint_constraints", f"is {row!r}", "joint_name and position")
        of_joint = cast("Mapping[str, Any]", row)
        (goal[str(of_joint["joint_name"])],) = _numbers(path, "joint_constraints.position", [of_joint.get("position")], 1)
    return goal


def _pose(path: Path, element: str, position: Any, quat_xyzw: Any) -> tuple[np.ndarray, np.ndarray]:
    quat = np.array(_numbers(path, element, quat_xyzw, 4))
    length = float(np.linalg.norm(quat))
    if not 0.99 < length < 1.01:
        raise _error(path, element, f"has length {length:.4g}", "a unit quaternion")
    return np.array(_numbers(path, element, position, 3)), quat / length


def _then(first: tuple[np.ndarray, np.ndarray], second: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """A pose in the frame of another."""
    (p, q), (r, s) = first, second
    turned = r + 2.0 * np.cross(q[:3], np.cross(q[:3], r) + q[3] * r)
    vector = q[3] * s[:3] + s[3] * q[:3] + np.cross(q[:3], s[:3])
    return p + turned, np.append(vector, q[3] * s[3] - q[:3] @ s[:3])


def _root_pose(path: Path, asked: Mapping[str, Any]) -> Document | None:
    """Where the robot stands; none where that is the origin."""
    transforms = _list(path, asked, "start_state", "multi_dof_joint_state", "transforms")
    if not transforms:
        return None
    first = cast("Mapping[str, Any]", transforms[0])
    position, quat = _pose(path, "transforms", first.get("translation"), first.get("rotation"))
    if not position.any() and not quat[:3].any():
        return None
    return {"position": position.tolist(), "quat_xyzw": quat.tolist()}


_IDENTITY = (np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def _obstacles(path: Path, collision_object: Any) -> list[Document]:
    """The shapes of a collision object, each an obstacle."""
    if not isinstance(collision_object, Mapping) or "id" not in collision_object:
        raise _error(path, "world.collision_objects", f"is {collision_object!r}", "tables with an id")
    each = cast("Mapping[str, Any]", collision_object)
    name = str(each["id"])
    if each.get("meshes"):
        raise _error(path, f"collision_objects.{name}", "has meshes", "boxes, cylinders and spheres")
    placed = each.get("pose")
    parent = _pose(path, name, placed.get("position"), placed.get("orientation")) if isinstance(placed, Mapping) else _IDENTITY
    shapes, poses = _list(path, each, "primitives"), _list(path, each, "primitive_poses")
    if len(shapes) != len(poses):
        raise _error(path, f"collision_objects.{name}", f"has {len(shapes)} shapes and {len(poses)} poses", "a pose for each")
    obstacles: list[Document] = []
    for k, (shape, pose) in enumerate(zip(shapes, poses)):
        label = name if len(shapes) == 1 else f"{name}_{k + 1}"
        position, quat = _then(parent, _pose(path, label, pose.get("position"), pose.get("orientation")))
        obstacles.append({"name": label, **_shape(path, label, shape), "position": position.tolist(), "quat_xyzw": quat.tolist()})
    return obstacles


def _shape(path: Path, name: str, shape: Mapping[str, Any]) -> Document:
    kind, sizes = shape.get("type"), shape.get("dimensions")
    n_sizes = {"box": 3, "cylinder": 2, "sphere": 1}.get(str(kind))
    if n_sizes is None:
        raise _error(path, f"collision_objects.{name}", f"is a {kind}", "a box, a cylinder or a sphere")
    sizes = _numbers(path, f"collision_objects.{name}.dimensions", sizes, n_sizes)
    if min(sizes) <= 0.0:
        raise _error(path, f"collision_objects.{name}.dimensions", f"is {sizes}", "lengths above 0")
    if kind == "box":
        return {"box": {"size": sizes}}
    if kind == "sphere":
        return {"sphere": {"radius": sizes[0]}}
    # As shape_msgs/SolidPrimitive has them: height, then radius.
    return {"cylinder": {"radius": sizes[1], "length": sizes[0]}}


def _may_touch(path: Path, world: Mapping[str, Any]) -> list[tuple[str, str]]:
    names: Sequence[Any] = _list(path, world, "allowed_collision_matrix", "entry_names")
    rows = _list(path, world, "allowed_collision_matrix", "entry_values")
    if any(not isinstance(row, list) or len(cast("list[Any]", row)) != len(names) for row in rows) or len(rows) != len(names):
        raise _error(path, "allowed_collision_matrix", f"has {len(names)} names and {len(rows)} rows", "a square matrix")
    pairs = [(str(names[i]), str(names[j])) for i in range(len(names)) for j in range(i) if rows[i][j]]
    return sorted(pairs)
