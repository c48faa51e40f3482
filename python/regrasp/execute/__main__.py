"""Chains of goals in MuJoCo from the command line: ``python -m regrasp.execute SCENE``."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .._errors import InputError
from .._model import load_scene
from ..simulate.__main__ import package
from ..simulate.model import Settings
from ..simulate.reference import PlanError
from .executor import Executor
from .goals import turns
from .log import Event, GoalResult, RunLog
from .mujoco_plant import MujocoPlant, PlantSettings
from .sessions import ExecutorSessions
from .settings import ExecutorSettings

#: Exit code where Ctrl-C ended the command, as shells have it.
INTERRUPTED = 130
#: Largest seed of a run.
LARGEST_SEED = 2**63


def main(arguments: list[str] | None = None) -> int:
    """Exit codes: 0 every goal was reached, 1 not, 2 bad input, 130 Ctrl-C. Log and page are written whatever happened in the run."""
    parser = _parser()
    asked = parser.parse_args(arguments)
    for option, path in (("-o/--output", asked.output), ("--page", asked.page)):
        problem = "" if path is None else _why_not_written(path)
        if problem:
            parser.error(f"argument {option}: {problem}")
    try:
        return _run(asked)
    except KeyboardInterrupt:
        print("INTERRUPTED  before the run began", file=sys.stderr)
        return INTERRUPTED


def _run(asked: argparse.Namespace) -> int:
    try:
        scene = load_scene(asked.scene, packages=dict(asked.package))
        simulation = Settings(hold_time=0.0, friction_scale=asked.friction_scale, mass_scale=asked.mass_scale)
        plant = MujocoPlant.of(scene, PlantSettings(simulation=simulation, push=asked.push, seed=asked.seed), seed=asked.seed)
        settings = ExecutorSettings(
            feedback=not asked.no_feedback,
            replanning=not asked.no_replanning,
            slip_trigger=not asked.no_slip_trigger,
            seed=asked.seed,
        )
        executor = Executor.of(ExecutorSessions.of(scene), plant, settings, listener=_listener(asked.goals))
    except (InputError, PlanError, OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    log = executor.log
    goals = turns(plant.pose, count=asked.goals, seed=asked.seed, largest=math.radians(asked.largest))
    try:
        executor.run(goals)
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        _write(log, asked)
    return 0 if log.n_reached == asked.goals else 1


def _listener(n_goals: int) -> Callable[[Event | GoalResult], None]:
    """Prints a line per goal as the run goes on."""
    count = 0

    def listen(happening: Event | GoalResult) -> None:
        nonlocal count
        if not isinstance(happening, GoalResult):
            return
        count += 1
        word = "reached" if happening.reached else happening.why_not
        turn = f"{np.degrees(happening.turn):.0f} degrees in {happening.time - happening.start_time:.1f} s"
        print(f"goal {count} of {n_goals}: {turn}, {word}", flush=True)

    return listen


def _write(log: RunLog, asked: argparse.Namespace) -> None:
    """What happened, on the screen and in files."""
    print(f"{log.status.upper()}  {log.n_reached} of {asked.goals} goals reached, {log.n_replans} replans {log.message}")
    for event in log.events:
        print(f"{event.time:8.2f} s  goal {event.goal + 1}  {event.kind}: {event.message}; {event.answer}")
    if asked.output:
        log.save(asked.output)
    if asked.page:
        log.page(asked.page)


def _why_not_written(path: Path) -> str:
    """Why no file can be written there; empty where it can."""
    if path.is_dir():
        return f"{path} is a folder; give the name of a file in it"
    if not path.parent.is_dir():
        return f"the folder {path.parent} does not exist; make it first"
    return ""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m regrasp.execute", description="Random goals one after the other, in MuJoCo.")
    parser.add_argument("scene")
    parser.add_argument("--goals", type=_whole(1, 1_000_000), default=5, metavar="N")
    parser.add_argument("--largest", type=_number(above=0.0), default=90.0, metavar="DEG", help="turn from one goal to the next at most")
    parser.add_argument("--seed", type=_whole(0, LARGEST_SEED), default=0)
    parser.add_argument("--friction-scale", type=_number(above=0.0), default=1.0, help="friction of the simulation over the scene's")
    parser.add_argument("--mass-scale", type=_number(above=0.0), default=1.0)
    parser.add_argument("--push", type=_number(least=0.0), default=0.0, metavar="N", help="pushes on the object")
    parser.add_argument("--no-feedback", action="store_true")
    parser.add_argument("--no-replanning", action="store_true")
    parser.add_argument("--no-slip-trigger", action="store_true")
    parser.add_argument("--package", type=package, action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="run.json; regrasp view draws it")
    parser.add_argument("--page", type=Path, metavar="FILE.html")
    return parser


def _whole(least: int, most: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f'"{text}"; expected a whole number from {least} to {most}')
        return value

    return read


def _number(*, above: float | None = None, least: float = 0.0) -> Callable[[str], float]:
    expected = f"a finite number from {least:g}" if above is None else f"a finite number above {above:g}"

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or (value < least if above is None else value <= above):
            raise argparse.ArgumentTypeError(f'"{text}"; expected {expected}')
        return value

    return read


if __name__ == "__main__":
    sys.exit(main())
