"""``python -m regrasp.simulate.task_campaign PLAN...``: replays many plans of pick and place, each with and without forces.

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


def replayed(job: Job) -> list[Row]:
    """Both replays of a plan."""
    from .files import load_robot
    from .reference import PlanError
    from .task import TaskSettings, replay

    empty = Row(str(job.path), "", 0, "planned", False, "", -1, "", 0.0, math.inf, math.inf, math.inf, 0.0, 0)
    rows: list[Row] = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = load_robot(job.path, scene=job.scene, packages=dict(job.packages))
        if loaded is None or loaded[0]["task"] != "pick_and_place":
            raise PlanError("is no plan of pick and place")
        for forces, settings in (("planned", TaskSettings()), ("none", TaskSettings(with_forces=False))):
            report, _, _ = replay(*loaded, settings)
            lost = report.lost
            row = replace(
                empty,
                scene=report.scene,
                seed=int(loaded[0]["seed"]),
                forces=forces,
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
    """Shares by scene, as Markdown."""
    known = list(rows)
    lines = [
        "| scene | plans | kept | within 5 mm, 5 deg | median error | dropped without forces |",
        "|---|---|---|---|---|---|",
    ]
    for scene in sorted({row.scene for row in known if not row.problem}):
        own = [row for row in known if row.scene == scene and row.forces == "planned"]
        control = [row for row in known if row.scene == scene and row.forces == "none"]
        errors = sorted((row.position_error, row.angle_error) for row in own)
        middle = errors[len(errors) // 2]
        lines.append(
            f"| `{scene}` | {len(own)} | {sum(row.kept for row in own)} | {sum(row.is_accurate for row in own)} "
            f"| {1e3 * middle[0]:.1f} mm, {middle[1]:.1f} deg | {sum(not row.kept for row in control)} |"
        )
    lines += [f"\n{row.plan}: {row.problem}" for row in known if row.problem]
    lines += [
        f"\n{row.plan}: lost ({row.cause}) at {row.time:.2f} s, segment {row.segment}, {row.kind}"
        for row in known
        if row.forces == "planned" and not row.kept and not row.problem
    ]
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns the exit code: 0 where every plan was replayed, 2 else."""
    from .__main__ import package

    parser = argparse.ArgumentParser(prog="python -m regrasp.simulate.task_campaign", description=__doc__)
    parser.add_argument("plans", type=Path, nargs="+", metavar="PLAN")
    parser.add_argument("--scene", type=Path, help="scene file of all plans [default: those that the plans name]")
    parser.add_argument("--package", type=package, action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, metavar="DIR")
    options = parser.parse_args(arguments)
    jobs = [Job(path, options.scene, tuple(options.package)) for path in options.plans]
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
