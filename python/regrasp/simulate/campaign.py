"""Many replays: scenes times seeds times directions of gravity times controllers, to a CSV file and a Markdown table.

    python -m regrasp.simulate.campaign scenes/sphere_90x.toml scenes/box_90x.toml --seeds 50 -o campaign

Plans are made for the direction of gravity that they are replayed in. Every plan and every result is kept in the output
folder, one file each, and what is there is not done again: a campaign that was cut off goes on where it was. The same
arguments give the same tables on any number of processes. With ``--made DIR`` nothing is planned: the plans of one scene are
those in ``DIR/KIND/SEED.json``, as ``regrasp roadmap bench --plans DIR`` writes them.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import multiprocessing
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from .__main__ import package

#: Settings of the planner for each kind of plan; all but the first are negative controls.
VARIANTS: dict[str, dict[str, Any]] = {
    "default": {},
    "no-rolling": {"transfer": "fixed"},
    "no-margin": {"friction_margin": 1.0},
}
#: Where the palm faces; ``plan``: gravity as scene and settings have it.
GRAVITIES = ("up", "down", "side", "plan")
CONTROLLERS = ("A", "B", "C2", "H")
#: Controllers that hold the start grasp in a way of their own: their static holds are measured apart.
HOLD_APART = ("A", "H")
#: Limit of work for one plan where none is given, in configurations: the default of :func:`regrasp.plan`.
MAX_WORK = 20_000_000
#: Drift of a static hold beyond which the object has fallen, in millimetres.
FALLEN_MM = 50.0


@dataclass(frozen=True)
class Job:
    """One plan and its replays."""

    scene: str
    seed: int
    gravity: str
    variant: str
    controllers: tuple[str, ...]
    friction_scale: float
    mass_scale: float
    speed: float
    torsion: float | None
    torsion_told: float | None
    noslip: bool
    packages: tuple[tuple[str, str], ...]
    settings: str
    """Settings of the planner as JSON; those of the variant win over them."""
    time_limit: float | None
    max_work: int
    folder: str
    made: str | None = None
    """Folder of plans that are there already."""

    @property
    def scene_name(self) -> str:
        """Its file's name, with the folder's where that is not the scenes' own."""
        path = Path(self.scene)
        return path.stem if path.parent.name in ("", "scenes") else f"{path.parent.name}/{path.stem}"

    @property
    def plan_path(self) -> Path:
        """Where the plan is kept."""
        if self.made is not None:
            return Path(self.made) / self.variant / f"{self.seed}.json"
        return Path(self.folder) / "plans" / self.variant / self.scene_name / f"{self.gravity}-{self.seed}.json"

    def result_path(self, controller: str) -> Path:
        """Where the result of a replay is kept."""
        conditions = f"f{self.friction_scale:g}-m{self.mass_scale:g}-v{self.speed:g}"
        conditions += "" if self.torsion is None else f"-t{self.torsion:g}"
        conditions += "" if self.torsion_told is None else f"-k{self.torsion_told:g}"
        conditions += "" if self.noslip else "-creep"
        place = Path(self.folder) / "results" / self.variant / self.scene_name / f"{controller}-{conditions}"
        return place / f"{self.gravity}-{self.seed}.json"


def run(job: Job) -> list[dict[str, Any]]:
    """Plans, unless the plan is there, and replays what has no result yet; returns a row per controller."""
    missing = [controller for controller in job.controllers if not _is_done(job, controller)]
    if missing:
        _replay(job, missing)
    return [json.loads(job.result_path(controller).read_text()) for controller in job.controllers]


def _is_done(job: Job, controller: str) -> bool:
    """True where a result is there, and no plan that was written since."""
    result = job.result_path(controller)
    is_there = result.exists()
    is_newer = is_there and job.plan_path.exists() and job.plan_path.stat().st_mtime_ns > result.stat().st_mtime_ns
    return is_there and not is_newer


def _replay(job: Job, controllers: Sequence[str]) -> None:
    import regrasp

    from .model import Settings
    from .run import simulate

    scene = regrasp.load_scene(job.scene, packages=dict(job.packages))
    plan, cause = _plan(job, scene)
    drift = None
    for controller in controllers:
        row: dict[str, Any] = {
            "scene": job.scene_name,
            "variant": job.variant,
            "gravity": job.gravity,
            "controller": controller,
            "seed": job.seed,
            "friction_scale": job.friction_scale,
            "mass_scale": job.mass_scale,
            "speed": job.speed,
            "torsion": job.torsion,
            "torsion_told": job.torsion_told,
            "noslip": job.noslip,
            "planned": plan is not None,
            "cause": cause,
        }
        if plan is not None:
            settings = Settings(
                controller=controller,
                gravity=job.gravity,
                friction_scale=job.friction_scale,
                mass_scale=job.mass_scale,
                speed=job.speed,
                torsion=job.torsion,
                torsion_told=job.torsion_told,
                noslip=job.noslip,
            )
            xml = regrasp.export_mjcf(plan, scene)
            known = None if controller in HOLD_APART else drift
            report = simulate(json.loads(plan.to_json()), xml, settings, drift=known).report
            drift = drift if controller in HOLD_APART else report.drift
            assert report.drift is not None
            lost, touched, dropped = report.lost_contacts, report.unplanned_contacts, report.dropped
            row |= {
                "kept": report.kept,
                "final_mm": round(1e3 * report.final_position_error, 4),
                "final_deg": round(math.degrees(report.final_angle_error), 4),
                "largest_mm": round(1e3 * report.largest_position_error, 4),
                "largest_deg": round(math.degrees(report.largest_angle_error), 4),
                "slip_mm": round(1e3 * report.largest_slip, 4),
                "drift_mm": round(1e3 * report.drift.position, 4),
                "drift_deg": round(math.degrees(report.drift.angle), 4),
                "contacts_lost": len(lost),
                "unplanned": " ".join("+".join(touch.geoms) for touch in touched),
                "duration": round(report.duration, 3),
                "largest_force": round(report.largest_normal_force, 3),
                "lost_by": dropped.cause if dropped else "",
                "dropped_segment": dropped.segment if dropped else "",
                "dropped_kind": dropped.kind if dropped else "",
                "dropped_finger": (dropped.finger or "") if dropped else "",
                "dropped_time": round(dropped.time, 3) if dropped else "",
            }
        path = job.result_path(controller)
        path.parent.mkdir(parents=True, exist_ok=True)
        _write(path, json.dumps(row))


def _plan(job: Job, scene: Any) -> tuple[Any, str]:
    """The plan, or why there is none."""
    import regrasp

    if job.plan_path.exists():
        return regrasp.Plan.from_file(job.plan_path), ""
    failed = job.plan_path.with_suffix(".failed")
    if failed.exists():
        return None, failed.read_text()
    if job.made is not None:
        return None, f"{job.plan_path} is not there"
    settings = {**json.loads(job.settings), **VARIANTS[job.variant]}
    if job.gravity != "plan":
        scene = regrasp.load_scene(job.scene, packages=dict(job.packages), gravity=_down(job, scene))
    # Variants leave out what holds or moves the object: replays show what that costs.
    found = regrasp.plan(scene, seed=job.seed, settings=settings, time_limit=job.time_limit, max_work=job.max_work, level="geometry")
    job.plan_path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(found, regrasp.Plan):
        _write(job.plan_path, found.to_json().decode())
        return found, ""
    cause = str(found).splitlines()[0]
    _write(failed, cause)
    return None, cause


def _down(job: Job, scene: Any) -> list[float]:
    """The direction of gravity, in the hand's frame."""
    import numpy as np
    import regrasp

    from .model import Settings, gravity_of, make_rig
    from .plans import flat

    # Which way the palm faces shows in any plan.
    for seed in range(100):
        plan = regrasp.plan(scene, seed=seed, settings={"forces": None, "friction_margin": 1.0}, level="geometry")
        if isinstance(plan, regrasp.Plan):
            rig = make_rig(regrasp.export_mjcf(plan, scene), flat(json.loads(plan.to_json())), Settings(controller="A"))
            world_from_hand = scene.hand.world_from_base.matrix[:3, :3]
            down = world_from_hand.T @ gravity_of(rig, job.gravity)
            return [round(float(x), 12) for x in down / np.linalg.norm(down)]
    raise RuntimeError(f"{job.scene}: no seed below 100 has a plan")


def _write(path: Path, text: str) -> None:
    """Whole or not at all."""
    part = path.with_name(path.name + ".part")
    part.write_text(text)
    part.replace(path)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Markdown tables: one line per scene, kind of plan, gravity, controller and conditions; sums; and every miss."""
    keys = ("scene", "variant", "gravity", "controller", "friction_scale", "mass_scale", "speed", "torsion", "torsion_told", "noslip")
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    lines = [
        "| scene | plans | gravity | controller | conditions | planned | kept | within 5 mm, 5 deg | within 2 mm, 2 deg | "
        "final median | final worst | slip median, worst | contacts lost | unplanned contacts | hold drift worst |",
        "|" + "---|" * 15,
    ]
    for group, members in sorted(groups.items(), key=lambda item: [str(value) for value in item[0]]):
        scene, variant, gravity, controller, friction, mass, speed, torsion, told, noslip = group
        seen = [row for row in members if row["planned"]]
        kept = [row for row in seen if row["kept"]]
        conditions = [
            text
            for text, usual in (
                (f"friction x {friction:g}", friction == 1.0),
                (f"mass x {mass:g}", mass == 1.0),
                (f"speed x {speed:g}", speed == 1.0),
                (f"torsion {1e3 * (torsion or 0.0):g} mm", torsion is None),
                (f"told {1e3 * (told or 0.0):g} mm", told is None),
                ("noslip off", noslip),
            )
            if not usual
        ]
        within = [sum(row["final_mm"] < limit and row["final_deg"] < limit for row in kept) for limit in (5, 2)]
        cells = [
            scene,
            variant,
            gravity,
            controller,
            ", ".join(conditions) or "nominal",
            f"{len(seen)} of {len(members)}",
            f"{len(kept)} of {len(seen)}",
            *(f"{n} of {len(seen)}" for n in within),
            _pair(kept, median, "final_mm", "final_deg"),
            _pair(kept, max, "final_mm", "final_deg"),
            f"{_one(kept, median, 'slip_mm')}, {_one(kept, max, 'slip_mm')} mm",
            str(sum(row["contacts_lost"] for row in kept)),
            f"in {sum(bool(row['unplanned']) for row in kept)}",
            _drift(seen),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n" + _totals(rows) + _misses(rows)


def _totals(rows: Sequence[dict[str, Any]]) -> str:
    """One line per controller over all scenes."""
    lines = ["", "| controller | planned | kept | within 5 mm, 5 deg | within 2 mm, 2 deg |", "|" + "---|" * 5]
    for controller in sorted({row["controller"] for row in rows}):
        of_it = [row for row in rows if row["controller"] == controller]
        seen = [row for row in of_it if row["planned"]]
        counts = [len(seen), *(sum(bool(is_so(row)) for row in seen) for is_so in (_kept, _within(5), _within(2)))]
        totals = [len(of_it), len(seen), len(seen), len(seen)]
        shares = [f"{n} of {total} ({100.0 * n / max(total, 1):.1f} %)" for n, total in zip(counts, totals)]
        lines.append("| " + " | ".join([controller, *shares]) + " |")
    return "\n".join(lines) + "\n"


def _kept(row: dict[str, Any]) -> bool:
    return bool(row["kept"])


def _within(limit: float) -> Callable[[dict[str, Any]], bool]:
    return lambda row: bool(row["kept"]) and row["final_mm"] < limit and row["final_deg"] < limit


def _misses(rows: Sequence[dict[str, Any]]) -> str:
    """The replays that lost the object or ended too far off, one by one, and the queries without a plan."""
    lines = ["", "| scene | gravity | seed | controller | what |", "|" + "---|" * 5]
    for row in sorted(rows, key=lambda row: (row["scene"], row["gravity"], row["seed"], row["controller"])):
        if not row["planned"]:
            what = f"no plan: {row['cause']}"
        elif not row["kept"]:
            finger = f", {row['dropped_finger']} let go first" if row["dropped_finger"] else ""
            where = f"{row['dropped_time']:.2f} s, segment {row['dropped_segment']} ({row['dropped_kind']}){finger}"
            what = f"lost ({row['lost_by']}) at {where}"
        elif not _within(5)(row):
            what = f"ended {row['final_mm']:.2f} mm {row['final_deg']:.2f} deg off"
        else:
            continue
        cells = [row["scene"], row["gravity"], str(row["seed"]), row["controller"], what.replace("|", "/")]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n" if len(lines) > 3 else ""


def _one(rows: list[dict[str, Any]], of: Any, key: str) -> str:
    return f"{of([row[key] for row in rows]):.2f}" if rows else "-"


def _drift(rows: list[dict[str, Any]]) -> str:
    """The worst drift of the static holds in which nothing fell, and how many fell."""
    held = [row for row in rows if row["drift_mm"] < FALLEN_MM]
    worst = _pair(held, max, "drift_mm", "drift_deg")
    return worst if len(held) == len(rows) else f"{worst}, {len(rows) - len(held)} fell"


def _pair(rows: list[dict[str, Any]], of: Any, mm: str, deg: str) -> str:
    return f"{_one(rows, of, mm)} mm {_one(rows, of, deg)} deg"


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    variants: list[str] = options.variants
    if options.made is not None:
        if len(options.scenes) != 1 or options.gravity != ["plan"] or options.settings:
            parser.error("--made takes one scene, --gravity plan and no --settings: the plans are there already")
        variants = sorted(entry.name for entry in options.made.iterdir() if entry.is_dir()) if options.made.is_dir() else []
        if not variants:
            parser.error(f"argument --made: {options.made} has no folder of plans")
    settings: dict[str, Any] = json.loads(options.settings.read_text()) if options.settings else {}
    if options.made is not None:
        settings = {"made": str(options.made.resolve())}
    options.output.mkdir(parents=True, exist_ok=True)
    made_with = options.output / "settings.json"
    if made_with.exists() and json.loads(made_with.read_text()) != settings:
        print(f"error: {options.output} has replays of plans with other --settings or from another --made ({made_with})", file=sys.stderr)
        return 2
    _write(made_with, json.dumps(settings))
    jobs = [
        Job(
            scene=str(scene),
            seed=seed,
            gravity=gravity,
            variant=variant,
            controllers=tuple(options.controllers),
            friction_scale=friction,
            mass_scale=mass,
            speed=speed,
            torsion=options.torsion,
            torsion_told=options.torsion_told,
            noslip=not options.no_noslip,
            packages=tuple((name, str(folder)) for name, folder in options.package),
            settings=json.dumps(settings),
            time_limit=options.time_limit or (None if options.max_work else 60.0),
            max_work=options.max_work or MAX_WORK,
            folder=str(options.output),
            made=None if options.made is None else str(options.made),
        )
        for scene in options.scenes
        for variant in variants
        for gravity in options.gravity
        for friction in options.friction_scale
        for mass in options.mass_scale
        for speed in options.speed
        for seed in range(options.first_seed, options.first_seed + options.seeds)
    ]
    done: dict[int, list[dict[str, Any]]] = {}
    with ProcessPoolExecutor(options.processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        futures = {pool.submit(run, job): k for k, job in enumerate(jobs)}
        for n, future in enumerate(as_completed(futures), 1):
            done[futures[future]] = future.result()
            if n % 20 == 0 or n == len(jobs):
                print(f"{n} of {len(jobs)} plans", file=sys.stderr)
    rows = [row for k in range(len(jobs)) for row in done[k]]
    fields = list(dict.fromkeys(key for row in rows for key in row))
    with (options.output / f"{options.name}.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, fields, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    text = table(rows)
    (options.output / f"{options.name}.md").write_text(text)
    print(text, end="")
    return 0


def _parser() -> argparse.ArgumentParser:
    def words(known: Sequence[str]) -> Any:
        def read(text: str) -> list[str]:
            wanted = text.split(",")
            if unknown := [word for word in wanted if word not in known]:
                raise argparse.ArgumentTypeError(f"{unknown[0]!r} is none of {', '.join(known)}")
            return wanted

        return read

    def scales(text: str) -> list[float]:
        values = [float(word) for word in text.split(",")]
        if not all(0.0 < value < math.inf for value in values):
            raise argparse.ArgumentTypeError("expected numbers above zero")
        return values

    parser = argparse.ArgumentParser(
        prog="python -m regrasp.simulate.campaign", description="Replays many plans in MuJoCo and tabulates."
    )
    parser.add_argument("scenes", type=Path, nargs="+", help="scene files")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for plans, results and tables")
    parser.add_argument("--name", default="campaign", help="name of the tables [default: campaign]")
    parser.add_argument("--seeds", type=int, default=10, help="plans per scene and direction [default: 10]")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--gravity", type=words(GRAVITIES), default=["up", "down", "side"], help="of up, down, side, plan [default: up,down,side]")
    parser.add_argument("--controllers", type=words(CONTROLLERS), default=["B", "C2"], help="[default: B,C2]")
    parser.add_argument("--variants", type=words(tuple(VARIANTS)), default=["default"], help=f"of {', '.join(VARIANTS)}")
    parser.add_argument("--made", type=Path, metavar="DIR", help="replay DIR/KIND/SEED.json, plans of one scene, with every KIND; needs --gravity plan")
    parser.add_argument("--friction-scale", type=scales, default=[1.0])
    parser.add_argument("--mass-scale", type=scales, default=[1.0])
    parser.add_argument("--speed", type=scales, default=[1.0])
    parser.add_argument("--torsion", type=float, metavar="M", help="torsional friction of all fingertips, in metres")
    parser.add_argument("--torsion-told", type=float, metavar="M", help="what the controller makes up for of it")
    parser.add_argument("--no-noslip", action="store_true", help="without MuJoCo's solver against creep")
    parser.add_argument("--settings", type=Path, metavar="FILE.json", help="settings of the planner")
    parser.add_argument("--time-limit", type=float, metavar="S", help="for one plan [default: 60, or none with --max-work]")
    parser.add_argument("--max-work", type=int, metavar="N", help="configurations for one plan: the same plans on every machine")
    parser.add_argument("--package", type=package, action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("--processes", type=int, default=2)
    return parser


if __name__ == "__main__":
    sys.exit(main())
