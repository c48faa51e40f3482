"""``python -m regrasp.simulate.task_campaign PLAN...``: replays many plans of pick and place, with each controller and without forces.

Writes a line for each replay (``-o DIR/task_campaign.csv``) and prints the shares by scene.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from multiprocessing import Pool
from pathlib import Path

#: A plan counts as accurate where the object ends within these limits of the plan's last pose, in metres and degrees.
ACCURATE = (0.005, 5.0)


@dataclass(frozen=True)
class Row:
    """One replay."""

    plan: str
    scene: str
    seed: int
    controller: str
    forces: str
    """``planned`` or ``none``."""
    kept: bool
    cause: str
    segment: int
    kind: str
    time: float
    position_error: float
    """At the end, in metres."""
    angle_error: float
    """At the end, in degrees."""
    slip: float
    """Largest way of the object in a hand, in metres."""
    duration: float
    touched: int
    """Pairs of geoms that touched and should not."""
    problem: str = ""
    """Why it could not be replayed."""

    @property
    def is_accurate(self) -> bool:
        """Kept, and within `ACCURATE` at the end."""
        return self.kept and self.position_error <= ACCURATE[0] and self.angle_error <= ACCURATE[1]


@dataclass(frozen=True)
class Job:
    """A plan to replay."""

    path: Path
    scene: Path | None
    packages: tuple[tuple[str, Path], ...]
    controllers: tuple[str, ...]


def replayed(job: Job) -> list[Row]:
    """All replays of a plan: with each controller, and with the first without forces."""
    from .files import load_robot
    from .reference import PlanError
    from .task import TaskSettings, replay

    empty = Row(str(job.path), "", 0, "", "planned", False, "", -1, "", 0.0, math.inf, math.inf, math.inf, 0.0, 0)
    rows: list[Row] = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = load_robot(job.path, scene=job.scene, packages=dict(job.packages))
        if loaded is None or loaded[0]["task"] != "pick_and_place":
            raise PlanError("is no plan of pick and place")
        all_settings = [TaskSettings(controller=name) for name in job.controllers]
        all_settings.append(TaskSettings(controller=job.controllers[0], with_forces=False))
        for settings in all_settings:
            report, _, _ = replay(*loaded, settings)
            lost = report.lost
            row = replace(
                empty,
                scene=report.scene,
                seed=int(loaded[0]["seed"]),
                controller=settings.controller,
                forces="planned" if settings.with_forces else "none",
                kept=report.kept,
                position_error=report.final_position_error,
                angle_error=math.degrees(report.final_angle_error),
                slip=max((hold.slip for hold in report.holds), default=0.0),
                duration=report.duration,
                touched=len(report.contacts),
            )
            if lost is not None:
                row = replace(row, cause=lost.cause, segment=lost.segment, kind=lost.kind, time=lost.time)
            rows.append(row)
    except (PlanError, OSError) as error:
        rows.append(replace(empty, problem=str(error)))
    return rows


def table(rows: Iterable[Row]) -> str:
    """Shares by scene and controller, as Markdown."""
    known = list(rows)
    lines = [
        "| scene | controller | plans | kept | within 5 mm, 5 deg | median error | dropped without forces |",
        "|---|---|---|---|---|---|---|",
    ]
    for scene, controller in sorted({(row.scene, row.controller) for row in known if not row.problem}):
        of_both = [row for row in known if (row.scene, row.controller) == (scene, controller)]
        own = [row for row in of_both if row.forces == "planned"]
        control = [row for row in of_both if row.forces == "none"]
        errors = sorted((row.position_error, row.angle_error) for row in own)
        middle = errors[len(errors) // 2]
        lines.append(
            f"| `{scene}` | {controller} | {len(own)} | {sum(row.kept for row in own)} | {sum(row.is_accurate for row in own)} "
            f"| {1e3 * middle[0]:.1f} mm, {middle[1]:.1f} deg "
            f"| {sum(not row.kept for row in control) if control else '-'} |"
        )
    lines += [f"\n{row.plan}: {row.problem}" for row in known if row.problem]
    lines += [
        f"\n{row.plan}, {row.controller}: lost ({row.cause}) at {row.time:.2f} s, segment {row.segment}, {row.kind}"
        for row in known
        if row.forces == "planned" and not row.kept and not row.problem
    ]
    return "\n".join(lines)


def _controllers(text: str) -> tuple[str, ...]:
    from .task import TASK_CONTROLLERS

    names = tuple(text.split(","))
    if not set(names) <= set(TASK_CONTROLLERS):
        raise argparse.ArgumentTypeError(f"expected some of {', '.join(TASK_CONTROLLERS)}, separated by commas")
    return names


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns the exit code: 0 where every plan was replayed, 2 else."""
    from .__main__ import package

    parser = argparse.ArgumentParser(prog="python -m regrasp.simulate.task_campaign", description=__doc__)
    parser.add_argument("plans", type=Path, nargs="+", metavar="PLAN")
    parser.add_argument("--scene", type=Path, help="scene file of all plans [default: those that the plans name]")
    parser.add_argument("--package", type=package, action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("--controllers", type=_controllers, default=("B",), metavar="NAMES", help="B, C2, or both: B,C2 [default: B]")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, metavar="DIR")
    options = parser.parse_args(arguments)
    jobs = [Job(path, options.scene, tuple(options.package), options.controllers) for path in options.plans]
    if options.processes > 1:
        with Pool(options.processes) as pool:
            found = pool.map(replayed, jobs, chunksize=1)
    else:
        found = [replayed(job) for job in jobs]
    rows = [row for own in found for row in own]
    if options.output:
        options.output.mkdir(parents=True, exist_ok=True)
        with (options.output / "task_campaign.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, fieldnames=list(Row.__dataclass_fields__))
            writer.writeheader()
            writer.writerows([vars(row) for row in rows])
    print(table(rows))
    return 2 if any(row.problem for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
