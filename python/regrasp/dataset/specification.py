"""`dataset.toml`: what a data set is made of. `docs/reference/dataset-format.md` says what it may contain.

Codes, beside those of `tables`: D110 a scene that cannot be read, D111 a key that cannot be varied, D112 a task of a kind that has no
rows, D113 a replay that such a task does not have.
"""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, cast

from .._arguments import StrPath
from .._errors import InputError
from .._model import Scene, load_scene
from .._planning import METHODS
from .draws import Draw, canonical, key_of, read_draws
from .tables import Table, error_of, fault, parse, short

FORMAT = "regrasp-dataset"
FORMAT_VERSION = 1
LEVELS = ("geometry", "forces", "motion")
CONTROLLERS = ("A", "B", "C2", "H")
#: The kind of task that moves a whole robot and has rows.
PICK_AND_PLACE = "pick_and_place"
#: Of these, for such tasks.
TASK_CONTROLLERS = ("B", "C2")
#: What may vary of their replays.
TASK_NOISE = ("friction_scale", "mass_scale")
MAX_EPISODES = 10**9
#: What may vary of a replay, with the values that change nothing.
NOISE: Mapping[str, Any] = {
    "friction_scale": 1.0,
    "mass_scale": 1.0,
    "start_offset": [0.0, 0.0, 0.0],
    "start_turn": [0.0, 0.0, 0.0],
}
#: Arguments of the planner that may vary, after `plan.`; and everything below `plan.settings.`.
PLAN_KEYS = ("method", "margin")


@dataclass(frozen=True)
class Replay:
    """How plans are replayed in MuJoCo."""

    controller: str
    friction_scale: Draw
    """Friction of the simulation over the scene's."""
    mass_scale: Draw
    """Mass of the simulated object over the scene's."""
    start_offset: Draw
    """Where the object is gripped, from the plan's start: a displacement in the world, in metres."""
    start_turn: Draw
    """How it is turned there: a rotation vector in the world, in radians."""
    keep: Literal["outcome", "track"]
    """"track" keeps the replayed motion as well."""

    def to_json(self) -> Any:
        """Its meaning."""
        noise = {key: getattr(self, key).to_json() for key in NOISE}
        return {"controller": self.controller, **noise, "keep": self.keep}


@dataclass(frozen=True)
class TaskSpec:
    """A family of episodes: a scene, and what varies in it."""

    name: str
    scene: Scene
    """The scene before anything varies."""
    scene_task: str | None
    """Name of the task in a scene of several; the first where nothing is said."""
    episodes: int
    vary: Mapping[str, Draw]
    """What varies, by the dotted key of the scene file."""
    vary_plan: Mapping[str, Draw]
    """What varies of the planner's arguments."""
    max_work: int
    level: str
    words: str
    """What is asked, in words, for learning from language."""
    seed: int
    replay: Replay | None

    @cached_property
    def kind(self) -> str:
        """Kind of the scene's task."""
        return next((each for each in self.scene.tasks if each.name == self.scene_task), self.scene.tasks[0]).kind

    @property
    def moves_a_robot(self) -> bool:
        """True for tasks of pick and place."""
        return self.kind == PICK_AND_PLACE

    @cached_property
    def hash(self) -> str:
        """SHA-256 of what an episode of the task depends on: not of file names, comments, or the number of episodes."""
        meaning = {
            "name": self.name,
            "seed": self.seed,
            "scene": self.scene.to_dict(),
            "inputs": [(entry.role, entry.sha256) for entry in self.scene.inputs[1:]],
            "task": self.scene_task,
            "vary": {name: draw.to_json() for name, draw in self.vary.items()},
            "plan": {name: draw.to_json() for name, draw in self.vary_plan.items()},
            "max_work": self.max_work,
            "level": self.level,
        }
        return key_of(canonical(meaning))


@dataclass(frozen=True)
class Specification:
    """A data set before it is made."""

    name: str
    text: str
    """The file."""
    path: str
    block: int
    """Episodes in a shard."""
    tasks: tuple[TaskSpec, ...]

    @property
    def episodes(self) -> int:
        """Of all tasks."""
        return sum(task.episodes for task in self.tasks)

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the hashes of its tasks, and of how they are replayed."""
        replays = [task.replay.to_json() if task.replay else None for task in self.tasks]
        return key_of(canonical([[task.hash for task in self.tasks], self.block, replays]))

    def at_most(self, episodes: int) -> Specification:
        """With at most so many episodes of every task: the first ones."""
        return replace(self, tasks=tuple(replace(task, episodes=min(task.episodes, episodes)) for task in self.tasks))

    def replayed(self, controller: str) -> Specification:
        """With every plan replayed by `controller`. Raises `InputError` (D113) where a task has no such replay."""
        for task in self.tasks:
            if task.moves_a_robot and controller not in TASK_CONTROLLERS:
                problem = f'task "{task.name}" has no replay with controller "{controller}"'
                raise fault("D113", self.path, problem, expected=f"{' or '.join(TASK_CONTROLLERS)} for pick and place")
        plain = Replay(controller, keep="outcome", **{key: Draw("constant", value) for key, value in NOISE.items()})
        replays = (replace(task.replay, controller=controller) if task.replay else plain for task in self.tasks)
        return replace(self, tasks=tuple(replace(task, replay=each) for task, each in zip(self.tasks, replays)))


def read_specification(path: StrPath, *, packages: Mapping[str, StrPath] | None = None) -> Specification:
    """Reads a specification and the scenes that it names. Raises `InputError`, with every cause found."""
    name = os.fspath(path)
    try:
        text = Path(name).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise fault("F001", name, f"cannot be read: {error}") from None
    return specification_of(text, name, packages=packages)


def specification_of(text: str, path: str, *, packages: Mapping[str, StrPath] | None = None) -> Specification:
    """The specification with this text, as if it stood at `path`."""
    file, root = parse(text, path)
    if root.text("format", fix=f'add format = "{FORMAT}"') not in (FORMAT, None):
        root.report("D105", "format", f"is {root.values['format']!r}", f'"{FORMAT}"')
    version = root.whole("format_version", FORMAT_VERSION, 0, 2**31, fix=f"add format_version = {FORMAT_VERSION}")
    if version != FORMAT_VERSION:
        root.report("D105", "format_version", f"is {version}", f"{FORMAT_VERSION}, which this version of regrasp reads")
    file.raise_if_wrong()
    name = root.text("name") or Path(path).stem
    seed, block = root.whole("seed", 0, 0, 2**63 - 1), root.whole("block", 50, 1, 10_000)
    folders = root.table("packages")
    base = os.path.dirname(path)
    known = {key: os.path.join(base, folders.text(key) or "") for key in folders.values}
    known.update({key: os.fspath(folder) for key, folder in (packages or {}).items()})
    replay = _replay(root)
    entries = root.tables("tasks", 'add [[tasks]] with name, scene = "scene.toml" and episodes')
    root.finish()
    tasks: list[TaskSpec] = []
    for entry in entries:
        task = _task(entry, base, known, seed, replay)
        if task is None:
            continue
        if any(task.name == other.name for other in tasks):
            entry.report("D107", "name", f'is "{task.name}", as of another task', "names that differ")
        tasks.append(task)
    file.raise_if_wrong()
    return Specification(name, text, path, block, tuple(tasks))


def _replay(root: Table) -> Replay | None:
    if "replay" not in root.values:
        return None
    table = root.table("replay")
    controller = table.text("controller", fix='add controller = "C2"', choices=CONTROLLERS)
    keep = table.text("keep", "outcome", choices=("outcome", "track"))
    given = {key: table.values[key] for key in NOISE if key in table.values}
    draws = read_draws(Table(table.file, table.path, given))
    for key, nothing in NOISE.items():
        table.get(key)
        draw = draws.setdefault(key, Draw("constant", nothing))
        if not _draws_such(draw, nothing):
            expected = "numbers" if isinstance(nothing, float) else "lists of three numbers: x, y, z in the world"
            table.report("D103", key, f"draws {short(draw.to_json())}", expected)
    table.finish()
    kept = cast("Literal['outcome', 'track']", keep)
    return Replay(controller or "C2", keep=kept, **{key: draws[key] for key in NOISE})


def _draws_such(draw: Draw, nothing: Any) -> bool:
    """Whether the values of a draw are numbers, or three of them, as `nothing` is."""
    numbers: list[Any] = [draw.value("", "")]
    if draw.kind == "choice":
        numbers = draw.values
    for value in numbers:
        parts = cast("list[Any]", value) if isinstance(value, list) else [value]
        if isinstance(value, list) != isinstance(nothing, list) or (isinstance(nothing, list) and len(parts) != 3):
            return False
        if not all(isinstance(part, (int, float)) and not isinstance(part, bool) for part in parts):
            return False
    return True


def _task(table: Table, base: str, packages: Mapping[str, str], seed: int, replay: Replay | None) -> TaskSpec | None:
    name = table.text("name", fix='add name = "spheres"') or ""
    if name and not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", name):
        table.report("D106", "name", f'is "{name}"', "letters, digits, - and _: it names a folder")
    scene_file = table.text("scene", fix='add scene = "scene.toml"')
    scene_task, level = table.text("task"), table.text("level", "motion", choices=LEVELS)
    episodes = table.whole("episodes", 0, 0, MAX_EPISODES, fix="add episodes = 100")
    max_work = table.whole("max_work", 200_000, 1, 2**63 - 1)
    method = table.text("method", choices=METHODS)
    margin = table.number("margin", lambda value: 0 <= value < 1, "a number in [0, 1)")
    settings, words = table.get("settings"), table.text("words") or name
    varied = table.table("vary")
    lenient = table.flag("lenient")
    table.finish()
    draws = read_draws(varied)
    if settings is not None and not isinstance(settings, dict):
        table.report("D103", "settings", "is no table", 'keys of "settings" in a plan file')
        settings = None
    of_plan: dict[str, Draw] = {}
    for key, value in (("method", method), ("margin", margin)):
        if value is not None:
            of_plan[key] = Draw("constant", value)
    for key, value in cast("dict[str, Any]", settings or {}).items():
        of_plan[f"settings.{key}"] = Draw("constant", value)
    of_scene = {key: draw for key, draw in draws.items() if not key.startswith("plan.")}
    for key, draw in draws.items():
        if key.startswith("plan."):
            inner = key.removeprefix("plan.")
            if inner not in PLAN_KEYS and not inner.startswith("settings."):
                varied.report("D111", key, "is no argument that may vary", "plan.method, plan.margin or plan.settings.KEY")
            of_plan[inner] = draw
    if scene_file is None:
        return None
    scene = _scene(table, os.path.join(base, scene_file), packages, lenient)
    if scene is None:
        return None
    task = TaskSpec(name, scene, scene_task, episodes, of_scene, of_plan, max_work, level or "motion", words, seed, replay)
    return task if _can_vary(task, table, varied) else None


def _scene(table: Table, path: str, packages: Mapping[str, str], lenient: bool) -> Scene | None:
    try:
        return load_scene(path, packages=packages, lenient=lenient)
    except InputError as error:
        first = error.diagnostics[0]
        table.report("D110", "scene", f"cannot be read: {error}", "a scene file", first.fix)
        return None


def _can_vary(task: TaskSpec, table: Table, varied: Table) -> bool:
    """Sets every key once, by itself: a key that no scene has is refused before anything is made."""
    names = [entry.name for entry in task.scene.tasks]
    if task.scene_task is not None and task.scene_task not in names:
        table.report("D104", "task", f'is "{task.scene_task}"', ", ".join(names))
        return False
    if task.kind == "motion":
        table.report("D112", "scene", "asks for a motion of a robot without an object", "in-hand, tracking, or pick and place")
        return False
    if task.moves_a_robot and task.replay is not None and not _has_replay(task.replay, table):
        return False
    good = True
    for name, draw in task.vary.items():
        try:
            task.scene.with_keys({name: draw.value("", name)})
        except InputError as error:
            # What a value alone breaks may be right beside others; keys and types never are.
            never = {"S101", "S103", "A510"}
            if any(each.code in never or "cannot stand beside" in each.problem for each in error.diagnostics):
                varied.report("D111", name, f"cannot be varied: {error}", "a key that scene files have")
                good = False
    return good


def _has_replay(replay: Replay, table: Table) -> bool:
    """Whether plans of pick and place can be replayed so."""
    if replay.controller not in TASK_CONTROLLERS:
        expected = f"{' or '.join(TASK_CONTROLLERS)} for pick and place"
        table.report("D113", "scene", f'is replayed with controller "{replay.controller}"', expected)
        return False
    still = [key for key in NOISE if key not in TASK_NOISE and getattr(replay, key) != Draw("constant", NOISE[key])]
    if still or replay.keep == "track":
        what = 'keep = "track"' if not still else still[0]
        table.report("D113", "scene", f"is replayed with {what}", f"of pick and place {' and '.join(TASK_NOISE)} may vary")
        return False
    return True


__all__ = ["PICK_AND_PLACE", "Replay", "Specification", "TaskSpec", "error_of", "read_specification", "specification_of"]
