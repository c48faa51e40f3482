"""Chains of goals in MuJoCo from the command line: ``python -m regrasp.execute SCENE``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from .._errors import InputError
from .._model import load_scene
from ..simulate.model import Settings
from ..simulate.reference import PlanError
from .goals import turns
from .mujoco_plant import MujocoPlant, PlantSettings
from .one_call import execute
from .settings import ExecutorSettings


def main(arguments: list[str] | None = None) -> int:
    """Exit codes: 0 every goal was reached, 1 not, 2 bad input."""
    parser = argparse.ArgumentParser(prog="python -m regrasp.execute", description="Random goals one after the other, in MuJoCo.")
    parser.add_argument("scene")
    parser.add_argument("--goals", type=int, default=5)
    parser.add_argument("--largest", type=float, default=90.0, metavar="DEG", help="turn from one goal to the next at most")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--friction-scale", type=float, default=1.0, help="friction of the simulation over the scene's")
    parser.add_argument("--mass-scale", type=float, default=1.0)
    parser.add_argument("--push", type=float, default=0.0, metavar="N", help="pushes on the object")
    parser.add_argument("--no-feedback", action="store_true")
    parser.add_argument("--no-replanning", action="store_true")
    parser.add_argument("--no-slip-trigger", action="store_true")
    parser.add_argument("--package", action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("-o", "--output", metavar="FILE", help="run.json; regrasp view draws it")
    parser.add_argument("--page", metavar="FILE.html")
    asked = parser.parse_args(arguments)
    try:
        scene = load_scene(asked.scene, packages=dict(entry.split("=", 1) for entry in asked.package))
        simulation = Settings(hold_time=0.0, friction_scale=asked.friction_scale, mass_scale=asked.mass_scale)
        plant = MujocoPlant.of(scene, PlantSettings(simulation=simulation, push=asked.push, seed=asked.seed), seed=asked.seed)
    except (InputError, PlanError, OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    settings = ExecutorSettings(
        feedback=not asked.no_feedback,
        replanning=not asked.no_replanning,
        slip_trigger=not asked.no_slip_trigger,
        seed=asked.seed,
    )
    log = execute(plant, turns(plant.pose, count=asked.goals, seed=asked.seed, largest=float(np.radians(asked.largest))), settings=settings)
    print(f"{log.status.upper()}  {log.n_reached} of {asked.goals} goals reached, {log.n_replans} replans {log.message}")
    for event in log.events:
        print(f"{event.time:8.2f} s  goal {event.goal + 1}  {event.kind}: {event.message}; {event.answer}")
    if asked.output:
        log.save(asked.output)
    if asked.page:
        log.page(Path(asked.page))
    return 0 if log.n_reached == asked.goals else 1


if __name__ == "__main__":
    sys.exit(main())
