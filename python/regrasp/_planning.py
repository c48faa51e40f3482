"""Planning and checking."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false, reportUnusedFunction=false

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from . import _regrasp
from ._arguments import StrPath, load_options, real, seconds, seed_of, whole
from ._errors import argument_error
from ._model import Scene, load_scene
from ._plan import Plan
from ._robot_plan import RobotPlan
from ._result import Failure, Progress, Report, failure_of, report_of

METHODS = ("gait", "visibility", "classic", "tracking", "tracking+gaiting")
MAX_THREADS = 1024

Level = Literal["geometry", "forces", "motion"]
"""What a plan is judged for; a higher level asks for all that the lower ones ask for."""


def plan(
    scene: Scene | StrPath,
    *,
    seed: int = 0,
    threads: int = 1,
    time_limit: float | None = None,
    max_work: int = 20_000_000,
    method: Literal["gait", "visibility", "classic", "tracking", "tracking+gaiting"] | None = None,
    margin: float | None = None,
    improve: float | None = None,
    improve_work: int | None = None,
    settings: Mapping[str, Any] | None = None,
    level: Level = "motion",
    task: str | None = None,
    hold: bool = False,
    progress: Callable[[Progress], object] | None = None,
) -> Plan | Failure:
    """Plans how the hand takes the object from start to goal, and has the plan judged by the independent checker.

    Not to find a plan is a result, no exception: the answer is a `Plan`, which is true, or a `Failure`, which is false. A plan
    that the checker rejects is a failure of kind "rejected". `plan_motion` plans tasks of kind "motion", `plan_pick_and_place`
    those of kind "pick_and_place".

    scene: a scene, or a scene file.
    seed: the same scene, settings and seed give the same plan, byte by byte, on any number of threads.
    threads: threads that search at once.
    time_limit: seconds after which the search is cut; the plan then says so (`statistics["cut_by_time"]`).
    max_work: limit in configurations looked at, the same on every machine.
    method: algorithm; "gait" where nothing else is said, "tracking" for tasks of that kind.
    margin: force-closure margin that the holding fingers keep, in [0, 1).
    improve: seconds spent on a better plan after the first; `improve_work`: the same by work.
    margin, improve, improve_work: of in-hand tasks; refused for tasks of kind "tracking".
    settings: settings of the planner, with the keys of "settings" in a plan file; the other arguments win over it.
    level: what the plan is judged for: "geometry" (poses alone), "forces" (and contact forces) or "motion" (and that nothing
    slips or goes too fast).
    task: name of the task, of a scene with several; the first where nothing is said.
    hold: asks only whether the object can be held at the start: one grasp, with its forces and margin. Goal and way do not count.
    progress: called now and then, by this thread, with a `Progress`; what it raises stops the search and is raised.

    The interpreter's lock is released while the search runs, and Ctrl-C stops it. Raises `InputError`, and `InternalError`
    where regrasp has a bug.
    """
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    if method is not None and method not in METHODS:
        raise argument_error("plan", "method", f"is {method!r}", f"one of {', '.join(METHODS)}")
    if margin is not None:
        margin = real("plan", "margin", margin, lambda value: 0 <= value < 1, "a number in [0, 1)")
    if improve_work is not None:
        improve_work = whole("plan", "improve_work", improve_work, 0, 2**64 - 1)
    request: dict[str, Any] = {
        "seed": seed_of("plan", seed),
        "threads": whole("plan", "threads", threads, 1, MAX_THREADS),
        "max_work": whole("plan", "max_work", max_work, 0, 2**64 - 1),
        "time_limit": seconds("plan", "time_limit", time_limit),
        "improve": seconds("plan", "improve", improve),
        "method": method,
        "margin": margin,
        "improve_work": improve_work,
        "settings": None if settings is None else _settings_text(settings),
        "level": level,
        "task": task,
        "hold": bool(hold),
        "progress": None if progress is None else _listener(progress),
    }
    found, outcome = _regrasp.plan(scene._native, request)
    if found is None:
        return failure_of(outcome)
    made = Plan(found, report=report_of(json.loads(outcome)))
    made._source = scene
    return made


def plan_motion(
    scene: Scene | StrPath,
    *,
    seed: int = 0,
    time_limit: float | None = None,
    max_work: int = 20_000_000,
    method: str | None = None,
    settings: Mapping[str, Any] | None = None,
    level: Level = "motion",
    task: str | None = None,
) -> RobotPlan | Failure:
    """Plans the motion of a whole robot that a task of kind "motion" asks for, and has it judged by the independent checker.

    The answer is a `RobotPlan`, which is true, or a `Failure`, which is false. A plan that the checker rejects is a failure of
    kind "rejected".

    scene, seed, time_limit, max_work, settings, level, task: as in `plan`.
    method: "in_turn" or "single_query"; the settings' where nothing is said.

    Raises `InputError` for a task of another kind (A510), and `InternalError` where regrasp has a bug.
    """
    return _plan_robot("plan_motion", "motion", scene, seed, time_limit, max_work, method, settings, level, task)


def plan_pick_and_place(
    scene: Scene | StrPath,
    *,
    seed: int = 0,
    time_limit: float | None = None,
    max_work: int = 20_000_000,
    method: str | None = None,
    settings: Mapping[str, Any] | None = None,
    level: Level = "motion",
    task: str | None = None,
) -> RobotPlan | Failure:
    """Plans how a robot brings an object to where a task of kind "pick_and_place" asks for it, and has the plan judged by the
    independent checker. Arguments and result are those of `plan_motion`.

    The plan says who holds the object when (`RobotPlan.segments`), and where fingers touch it (`RobotPlan.contact_points_in_object`).

    Raises `InputError` for a task of another kind (A510), and `InternalError` where regrasp has a bug.
    """
    return _plan_robot("plan_pick_and_place", "pick_and_place", scene, seed, time_limit, max_work, method, settings, level, task)


def _plan_robot(
    name: str,
    kind: str,
    scene: Scene | StrPath,
    seed: int,
    time_limit: float | None,
    max_work: int,
    method: str | None,
    settings: Mapping[str, Any] | None,
    level: Level,
    task: str | None,
) -> RobotPlan | Failure:
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    asked = next((one for one in scene.tasks if one.name == task), scene.tasks[0])
    if asked.kind != kind:
        raise argument_error(name, "task", f'is of kind "{asked.kind}"', f'a task of kind "{kind}"')
    request: dict[str, Any] = {
        "seed": seed_of(name, seed),
        "threads": 1,
        "max_work": whole(name, "max_work", max_work, 0, 2**64 - 1),
        "time_limit": seconds(name, "time_limit", time_limit),
        "improve": None,
        "method": method,
        "margin": None,
        "improve_work": None,
        "settings": None if settings is None else _settings_text(settings),
        "level": level,
        "task": task,
        "hold": False,
        "progress": None,
    }
    found, outcome = _regrasp.plan_motion(scene._native, request)
    return failure_of(outcome) if found is None else RobotPlan(found, report=report_of(json.loads(outcome)))


def place(
    hand: StrPath,
    object: StrPath,
    output: StrPath,
    *,
    turns: Sequence[str] = ("z:90",),
    mass: float | None = None,
    friction: float | None = None,
    scale: float | str | None = None,
    solid: Literal["mesh", "hull"] | None = None,
    torsion_radius: float | None = None,
    alternatives: int = 0,
    hold: bool = False,
    seed: int = 0,
    time_limit: float | None = None,
    max_work: int = 3_000_000,
    packages: Mapping[str, StrPath] | None = None,
) -> list[Scene] | Failure:
    """Finds poses of an object in a hand from which it can be turned, and writes a scene for the best of them.

    The answer is the scenes, the best first, each with its start pose (`Scene.start`); or a `Failure`, which is false, with the
    causes where no pose with a grasp was found.

    hand: hand file or URDF.
    object: mesh file, scene file whose object is taken, or a primitive such as "sphere:0.032", "box:0.057,0.057,0.057",
    "cylinder:0.03,0.07", "capsule:0.02,0.05", "ellipsoid:0.03,0.03,0.04", in metres.
    output: scene file that is written; the alternatives go beside it, as scene.2.toml and on.
    turns: turns about axes of the world that must look possible; of several, each becomes a task.
    mass, friction: of the object; 0.1 kg and 0.8 where neither these nor a scene say any.
    scale: of a mesh, as scene files have it.
    solid: what stands for the inside of a mesh: its triangles, or its convex hull, for meshes that are not closed.
    torsion_radius: soft fingertips, where the hand file names no contact model.
    alternatives: scenes of the next best poses, up to 5.
    hold: looks for poses in which the object can be held at all; turns do not count. `plan(scene, hold=True)` plans such scenes.
    seed, time_limit, max_work: as in `plan`.
    packages: folders of package://NAME/...

    Raises `InputError`, and `InternalError` where regrasp has a bug.
    """
    if mass is not None:
        mass = real("place", "mass", mass, lambda value: value >= 0, "a number from 0")
    if friction is not None:
        friction = real("place", "friction", friction, lambda value: value >= 0, "a number from 0")
    if torsion_radius is not None:
        torsion_radius = real("place", "torsion_radius", torsion_radius, lambda value: 0 <= value <= 1, "metres, 0 to 1")
    if solid not in (None, "mesh", "hull"):
        raise argument_error("place", "solid", f"is {solid!r}", '"mesh" or "hull"')
    request: dict[str, Any] = {
        "hand": os.fspath(hand),
        "object": os.fspath(object),
        "output": os.fspath(output),
        "turns": [str(turn) for turn in turns],
        "mass": mass,
        "friction": friction,
        "scale": None if scale is None else str(scale),
        "solid": solid,
        "torsion_radius": torsion_radius,
        "alternatives": whole("place", "alternatives", alternatives, 0, 5),
        "hold": bool(hold),
        "seed": seed_of("place", seed),
        "time_limit": seconds("place", "time_limit", time_limit),
        "max_work": whole("place", "max_work", max_work, 0, 2**64 - 1),
    }
    options = load_options("place", packages, lenient=False)
    paths, failure = _regrasp.place(request, options)
    if failure is not None:
        return failure_of(failure)
    return [load_scene(path, packages=packages) for path in paths]


def _listener(progress: Callable[[Progress], object]) -> Callable[[dict[str, Any]], None]:
    def listen(fields: dict[str, Any]) -> None:
        progress(Progress(**fields))

    return listen


def _settings_text(settings: Mapping[str, Any], function: str = "plan") -> str:
    try:
        return json.dumps(dict(settings), allow_nan=False)
    except (TypeError, ValueError) as error:
        raise argument_error(function, "settings", str(error), "what JSON can express") from None


def check(
    plan: Plan | StrPath,
    scene: Scene | StrPath | None = None,
    *,
    packages: Mapping[str, StrPath] | None = None,
    lenient: bool = False,
    level: Level = "motion",
    own_query: bool = False,
    hold: bool = False,
) -> Report:
    """Judges a plan in its scene, by the checker that knows no planner.

    plan: a plan, or a plan file.
    scene: a scene, taken as it was read, or a scene file, which is read now; without it, the scene that `plan` planned for,
    read afresh, or the file that the plan names: beside the plan file, in one of the folders above it, or in the current one.
    packages, lenient: as in `load_scene`, for scene files.
    level: as in `plan`. `Report.reached` says which level the plan reaches.
    own_query: a plan of a `Session` brings the start and the goal that it was asked. It is rejected unless this is True, because
    such a plan answers only its own question.
    hold: the plan was asked only whether the object can be held (`plan(..., hold=True)`).

    Raises `InputError` for files that cannot be used. What is wrong with the plan is no exception but in the report.
    """
    plan, scene = _with_scene(plan, scene, packages, lenient)
    return report_of(json.loads(_regrasp.check(plan._native, scene._native, level, own_query, hold)))


def export_mjcf(
    plan: Plan | StrPath,
    scene: Scene | StrPath | None = None,
    *,
    packages: Mapping[str, StrPath] | None = None,
    lenient: bool = False,
) -> str:
    """The MuJoCo model of a plan's scene: hands, objects, supports, obstacles, and a keyframe for every waypoint.

    plan, scene, packages, lenient: as in `check`.

    Warns where the model differs from the scene: MuJoCo collides with convex hulls, and welds hold objects that stand on no
    support. Raises `InputError`.
    """
    plan, scene = _with_scene(plan, scene, packages, lenient)
    xml, notes = plan._native.to_mjcf(scene._native)
    for note in notes:
        warnings.warn(note, stacklevel=2)
    return xml


def view(
    plan: Plan | StrPath,
    path: StrPath | None = None,
    scene: Scene | StrPath | None = None,
    *,
    title: str | None = None,
    packages: Mapping[str, StrPath] | None = None,
    lenient: bool = False,
) -> str:
    """The page of a plan: one HTML file with hand, object, margin and clearance, which opens from disk and fetches nothing.

    plan, scene, packages, lenient: as in `check`.
    path: where the page is written too, if given.
    title: in place of the scene's name.

    The checker's verdict is in the page, also where it rejects the plan. Raises `InputError`.
    """
    plan, scene = _with_scene(plan, scene, packages, lenient)
    page = _regrasp.page(plan._native, scene._native, title)
    if path is not None:
        _regrasp.Plan.write(os.fspath(path), page.encode())
    return page


def _with_scene(
    plan: Plan | StrPath, scene: Scene | StrPath | None, packages: Mapping[str, StrPath] | None, lenient: bool
) -> tuple[Plan, Scene]:
    """A plan and its scene, read where files are named."""
    if not isinstance(plan, Plan):
        plan = Plan.from_file(plan)
    if scene is None:
        if plan._source is not None:
            scene = plan._source._afresh()
        else:
            scene = _regrasp.find_scene(plan._native, plan.path or "plan.json", os.getcwd())
    if not isinstance(scene, Scene):
        scene = load_scene(scene, packages=packages, lenient=lenient)
    return plan, scene
