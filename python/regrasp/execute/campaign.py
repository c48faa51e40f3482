"""Chains of random goals under disturbances, by the hundred: ``python -m regrasp.execute.campaign``."""

from __future__ import annotations

import argparse
import csv
import multiprocessing
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .._model import load_scene
from ..simulate.model import Settings
from ..simulate.reference import PlanError
from .executor import Executor
from .goals import turns
from .mujoco_plant import MujocoPlant, PlantSettings
from .sessions import ExecutorSessions
from .settings import ExecutorSettings

#: How the plant differs from the plan.
DISTURBANCES: dict[str, dict[str, Any]] = {
    "none": {},
    "friction 0.7": {"friction_scale": 0.7},
    "friction 1.3": {"friction_scale": 1.3},
    "mass 1.5": {"mass_scale": 1.5},
    "noise 1 mm 1 deg": {"pose_noise": 0.001, "pose_turn_noise": float(np.radians(1.0))},
    "pushes 0.5 N": {"push": 0.5},
    "friction 0.5": {"friction_scale": 0.5},
    "pushes 4 N": {"push": 4.0},
    "friction 0.5, pushes 4 N": {"friction_scale": 0.5, "push": 4.0},
}

#: What the executor does without.
ABLATIONS: dict[str, dict[str, Any]] = {
    "both": {},
    "both, no slip trigger": {"slip_trigger": False},
    "both, with reflex": {"reflex_press": 1.0},
    "replanning alone": {"feedback": False},
    "feedback alone": {"replanning": False},
    "feedback and reflex": {"replanning": False, "reflex_press": 1.0},
    "open loop": {"replanning": False, "feedback": False},
    "both, firm after trouble": {"grip": "firm after trouble"},
    "both, firm grip": {"grip": "firm"},
    "both, firm grip with reflex": {"reflex_press": 1.0, "grip": "firm"},
    "feedback alone, firm grip": {"replanning": False, "grip": "firm"},
}


@dataclass(frozen=True)
class Case:
    """One run."""

    scene: str
    packages: tuple[tuple[str, str], ...]
    disturbance: str
    ablation: str
    run: int
    goals: int
    largest: float
    axis: str
    max_work: int


@dataclass(frozen=True)
class Row:
    """What came of it."""

    scene: str
    disturbance: str
    ablation: str
    run: int
    status: str
    goals: int
    tried: int
    reached: int
    """By the executor's own estimate."""
    within: int
    """Of the real object within 2 mm and 2 degrees."""
    dropped: int
    legs: int
    replans: int
    motion_per_90: float
    """Median over goals of at least 30 degrees, in seconds."""
    search_check: float
    """Median of a leg, in seconds of this machine."""
    overhead: float
    """The largest, in seconds."""
    simulated: float
    seconds: float
    """Processor time."""
    message: str


def run_case(case: Case) -> Row:
    """One run."""
    started = time.process_time()
    disturbed = dict(DISTURBANCES[case.disturbance])
    simulation = Settings(
        hold_time=0.0,
        friction_scale=disturbed.pop("friction_scale", 1.0),
        mass_scale=disturbed.pop("mass_scale", 1.0),
    )
    scene = load_scene(case.scene, packages=dict(case.packages))
    base = Row(Path(case.scene).stem, case.disturbance, case.ablation, case.run, "", case.goals, 0, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, "")
    settings = ExecutorSettings(seed=1_000_000 * case.run, max_work=case.max_work, **ABLATIONS[case.ablation])
    try:
        plant = MujocoPlant.of(
            scene, PlantSettings(simulation=simulation, seed=case.run, **disturbed), seed=case.run, max_work=5_000_000
        )
    except PlanError as error:
        return replace(base, status="no_plan", message=str(error))
    axis = None if not case.axis else np.eye(3)["xyz".index(case.axis)]
    goals = turns(plant.pose, count=case.goals, seed=case.run, largest=case.largest, axis=axis)
    executor = Executor.of(ExecutorSessions.of(scene), plant, settings)
    log = executor.run(goals)
    # What is counted is goals that were finished: a run that ends early says what became of the present one, too.
    tried = [goal for goal in log.goals if goal.is_finished]
    position, _ = plant.truth()
    away = float(np.linalg.norm(position - np.array(tried[-1].position))) if tried else 0.0
    dropped = log.status == "lost" or plant.touching() == 0 or away > 0.03
    good = [
        goal
        for goal in tried
        if (goal.true_distance or 0.0) <= 0.002 and (goal.true_angle or 0.0) <= np.radians(2.0)
    ]
    times = [goal.motion_time / goal.turn * np.pi / 2 for goal in tried if goal.reached and goal.turn >= np.radians(30.0)]
    return replace(
        base,
        status=log.status,
        tried=len(tried),
        reached=log.n_reached,
        within=len(good),
        dropped=int(dropped),
        legs=len(log.legs),
        replans=sum(max(goal.legs - 1, 0) for goal in tried),
        motion_per_90=float(np.median(times)) if times else 0.0,
        search_check=float(np.median([leg.search_seconds + leg.check_seconds for leg in log.legs])) if log.legs else 0.0,
        overhead=max((leg.overhead_seconds for leg in log.legs), default=0.0),
        simulated=log.samples[-1].time if log.samples else 0.0,
        seconds=time.process_time() - started,
        message=log.message or "; ".join(sorted({event.kind for event in log.events})),
    )


def table(rows: list[Row]) -> str:
    """Sums per scene, disturbance and ablation, as Markdown."""
    lines = [
        "| scene | disturbance | executor | runs | goals | within 2 mm, 2 deg | drops | replans | motion per 90 deg | search and check |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.scene, row.disturbance, row.ablation), []).append(row)
    for (scene, disturbance, ablation), group in groups.items():
        goals, within = sum(row.goals for row in group), sum(row.within for row in group)
        motion = [row.motion_per_90 for row in group if row.motion_per_90 > 0.0]
        search = [row.search_check for row in group if row.legs > 0]
        lines.append(
            f"| {scene} | {disturbance} | {ablation} | {len(group)} | {goals} | {within} ({100 * within / max(goals, 1):.1f} %) "
            f"| {sum(row.dropped for row in group)} | {sum(row.replans for row in group)} "
            f"| {np.median(motion) if motion else float('nan'):.1f} s | {1e3 * np.median(search) if search else float('nan'):.0f} ms |"
        )
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m regrasp.execute.campaign", description=__doc__)
    parser.add_argument("scenes", nargs="+", metavar="SCENE")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="campaign.csv and tables.md; what is there is not done again")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--goals", type=int, default=50)
    parser.add_argument("--largest", type=float, default=90.0, metavar="DEG", help="turn from one goal to the next at most")
    parser.add_argument("--axis", default="", choices=["", "x", "y", "z"], help="fixed axis of the world in place of random ones")
    parser.add_argument("--disturbances", default="none,friction 0.7,friction 1.3,mass 1.5,noise 1 mm 1 deg,pushes 0.5 N")
    parser.add_argument("--ablations", default="both")
    parser.add_argument("--max-work", type=int, default=ExecutorSettings.max_work, help="of one search, in configurations")
    parser.add_argument("--package", action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("--processes", type=int, default=1)
    asked = parser.parse_args(arguments)
    packages = tuple(tuple(entry.split("=", 1)) for entry in asked.package)
    # One name may have a comma in it.
    separator = ";" if ";" in asked.disturbances or asked.disturbances in DISTURBANCES else ","
    disturbances = asked.disturbances.split(separator)
    ablations = asked.ablations.split(";")
    unknown = [name for name in disturbances if name not in DISTURBANCES] + [name for name in ablations if name not in ABLATIONS]
    if unknown:
        parser.error(f"unknown: {', '.join(unknown)}; there are {'; '.join([*DISTURBANCES, *ABLATIONS])}")
    asked.output.mkdir(parents=True, exist_ok=True)
    path = asked.output / "campaign.csv"
    done: list[Row] = []
    if path.exists():
        kinds = Row.__annotations__
        convert: dict[str, Any] = {"int": int, "float": float, "str": str}
        with path.open(newline="") as file:
            done = [Row(**{key: convert[kinds[key]](value) for key, value in entry.items()}) for entry in csv.DictReader(file)]
    have = {(row.scene, row.disturbance, row.ablation, row.run) for row in done}
    cases = [
        Case(scene, packages, disturbance, ablation, run, asked.goals, float(np.radians(asked.largest)), asked.axis, asked.max_work)
        for run in range(asked.runs)
        for scene in asked.scenes
        for disturbance in disturbances
        for ablation in ablations
        if (Path(scene).stem, disturbance, ablation, run) not in have
    ]
    is_new = not path.exists()
    with path.open("a", newline="") as file, multiprocessing.get_context("spawn").Pool(asked.processes) as pool:
        writer = csv.DictWriter(file, list(Row.__annotations__))
        if is_new:
            writer.writeheader()
        for row in pool.imap_unordered(run_case, cases):
            writer.writerow(asdict(row))
            file.flush()
            done.append(row)
            print(f"{row.scene} {row.disturbance} {row.ablation} {row.run}: {row.status}, {row.within} of {row.goals}", flush=True)
    text = table(sorted(done, key=lambda row: (row.scene, list(DISTURBANCES).index(row.disturbance), list(ABLATIONS).index(row.ablation))))
    (asked.output / "tables.md").write_text(text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
