"""``python -m regrasp.simulate plan.json``: exit code 0 kept, 1 lost, 2 bad input."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .measure import Report


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    given = sys.argv[1:] if arguments is None else arguments
    if any(name.endswith(".json") and _is_list(name) for name in given):
        try:
            from . import grasp_command
        except ImportError as error:
            return _bad_input(f"MuJoCo is not there ({error}); pip install 'regrasp[sim]'")
        return grasp_command.main(given)
    options = _parser().parse_args(arguments)
    if options.strip and sys.platform == "linux" and not {"MUJOCO_GL", "DISPLAY"} & os.environ.keys():
        # Read by MuJoCo when it is imported.
        os.environ["MUJOCO_GL"] = "egl"
    try:
        from . import _mujoco  # noqa: F401  # pyright: ignore[reportUnusedImport]
    except ImportError as error:
        return _bad_input(f"MuJoCo is not there ({error}); pip install 'regrasp[sim]'")
    from .files import load, load_robot
    from .model import Settings
    from .reference import PlanError
    from .run import simulate

    try:
        packages = dict(options.package)
        files: dict[str, Any] = {"scene": options.scene, "packages": packages, "lenient": options.lenient, "mjcf": options.mjcf}
        moved = load_robot(options.plan, **files)
        if moved is not None:
            return _replay_robot(*moved, options)
        settings = Settings(
            controller=options.controller,
            gravity=options.gravity,
            friction_scale=options.friction_scale,
            mass_scale=options.mass_scale,
            torsion=options.torsion,
            torsion_told=options.torsion_told,
            speed=options.speed,
            noslip=not options.no_noslip,
            hold_time=options.hold_time,
            squeeze=options.squeeze,
        )
        plan, xml = load(options.plan, **files)
        result = simulate(plan, xml, settings)
    except (PlanError, OSError) as error:
        return _bad_input(str(error))
    report = result.report
    text = json.dumps(report.to_json(), indent=1)
    if options.output:
        options.output.write_text(text + "\n")
    if options.json:
        print(text)
    else:
        print(summary(report))
    if options.strip:
        from .strip import NoRenderer, strip, write_png

        try:
            write_png(options.strip, strip(result.rig, result.track))
        except NoRenderer as error:
            print(f"no picture: {error}", file=sys.stderr)
    return 0 if report.kept else 1


def _is_list(path: str) -> bool:
    try:
        with Path(path).open(encoding="utf-8") as file:
            return '"regrasp-grasps"' in file.read(200)
    except (OSError, ValueError):
        return False


def _replay_robot(plan: dict[str, Any], xml: str, options: argparse.Namespace) -> int:
    """Replays a motion of a whole robot, or pick and place."""
    if plan["task"] == "pick_and_place":
        return _replay_task(plan, xml, options)
    from .robot import replay

    report = replay(plan, xml, speed=options.speed)
    text = json.dumps(report.to_json(), indent=1)
    if options.output:
        options.output.write_text(text + "\n")
    print(text if options.json else report)
    return 0 if report.followed else 1


def _replay_task(plan: dict[str, Any], xml: str, options: argparse.Namespace) -> int:
    """Replays pick and place."""
    from .task import TaskSettings, replay

    settings = TaskSettings(
        controller=options.controller,
        speed=options.speed,
        squeeze_time=options.squeeze_time,
        with_forces=not options.no_forces,
        friction_scale=options.friction_scale,
        mass_scale=options.mass_scale,
    )
    report, track, rig = replay(plan, xml, settings)
    text = json.dumps(report.to_json(), indent=1)
    if options.output:
        options.output.write_text(text + "\n")
    print(text if options.json else report)
    if options.strip:
        from .strip import NoRenderer, task_strip, write_png

        try:
            write_png(options.strip, task_strip(rig, track))
        except NoRenderer as error:
            print(f"no picture: {error}", file=sys.stderr)
    return 0 if report.kept else 1


def summary(report: Report) -> str:
    """A report in a few lines, in millimetres and degrees."""
    gravity = ", ".join(f"{g:.2f}" for g in report.gravity_in_world)
    lines = [f"replay {report.scene}, seed {report.seed}, controller {report.settings.controller}, gravity ({gravity})"]
    if report.drift is not None:
        drift = report.drift
        lines.append(
            f"drift  {_pose(drift.position, drift.angle)} in a static hold of {drift.time:g} s "
            f"(settled {_pose(drift.settled_position, drift.settled_angle)} from the plan)"
        )
    if report.dropped is None:
        lines.append(f"KEPT   {report.duration:.1f} s of motion")
    else:
        at = report.dropped
        who = f", {at.finger} let go first" if at.finger else ""
        moving = f" of {at.moving_finger}" if at.moving_finger else ""
        lines.append(f"LOST ({at.cause}) at {at.time:.2f} of {report.duration:.1f} s, segment {at.segment}, {at.kind}{moving}{who}")
    final = _pose(report.final_position_error, report.final_angle_error)
    lines.append(f"error  {final} at the end, {_pose(report.largest_position_error, report.largest_angle_error)} at most")
    lines.append(
        f"slip   {1e3 * report.largest_slip:.2f} mm at most in a segment; contacts lost {len(report.lost_contacts)}; "
        f"normal forces up to {report.largest_normal_force:.1f} N, torques fed forward up to {report.largest_torque:.2f} N m"
    )
    lines += [
        f"touch  {touch.geoms[0]} and {touch.geoms[1]}, not planned, from {touch.time:.2f} s for {1e3 * touch.duration:.0f} ms"
        for touch in report.unplanned_contacts
    ]
    return "\n".join(lines)


def _pose(position: float, angle: float) -> str:
    return f"{1e3 * position:.2f} mm {math.degrees(angle):.2f} deg"


def _bad_input(problem: str) -> int:
    print(f"error: {problem}", file=sys.stderr)
    return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m regrasp.simulate",
        description="Replays a plan in MuJoCo and says whether the object is kept. docs/reference/replay.md describes it.",
    )
    parser.add_argument("plan", type=Path, help="plan file")
    parser.add_argument("--scene", type=Path, help="scene file [default: the one that the plan names]")
    parser.add_argument("--package", type=package, action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("--lenient", action="store_true", help="leave out what cannot be read in robot files, as regrasp plan --lenient does")
    parser.add_argument("--mjcf", type=Path, metavar="FILE", help="model to use, as written by regrasp export --mjcf")
    parser.add_argument(
        "--controller",
        choices=("A", "B", "C2", "H"),
        default="B",
        help="A squeezes by position, B feeds forces forward, C2 is B with feedback of the object's pose, "
        "H is C2 that gives along the normal, for tracking; pick and place: B or C2 [default: B]",
    )
    parser.add_argument("--feedback", action="store_const", const="C2", dest="controller", help="the same as --controller C2")
    parser.add_argument(
        "--gravity",
        type=_gravity,
        default="plan",
        metavar="DIRECTION",
        help="plan, up, down, side (where the palm faces), or X,Y,Z in the world in m/s^2 [default: plan]",
    )
    parser.add_argument("--friction-scale", type=_positive, default=1.0, help="friction of the simulation over the scene's")
    parser.add_argument("--mass-scale", type=_positive, default=1.0, help="mass of the object over the planned one")
    parser.add_argument("--torsion", type=float, metavar="M", help="torsional friction of all fingertips, in metres")
    parser.add_argument(
        "--torsion-told",
        type=float,
        metavar="M",
        help="what the controller makes up for of it, for hard fingertips; 0: nothing [default: all]",
    )
    parser.add_argument("--speed", type=_positive, default=1.0, help="times faster than planned")
    parser.add_argument("--squeeze", type=_positive, default=0.003, metavar="M", help="of controller A, in metres")
    parser.add_argument("--no-noslip", action="store_true", help="without MuJoCo's solver against creep")
    parser.add_argument("--hold-time", type=float, default=10.0, metavar="S", help="of the static hold measured first; 0: none")
    parser.add_argument(
        "--no-forces", action="store_true", help="of pick and place: fingers press with nothing, as a control; the object should fall"
    )
    parser.add_argument(
        "--squeeze-time",
        type=float,
        default=0.25,
        metavar="S",
        help="of pick and place: rest in which forces change where fingers begin or cease to hold [default: 0.25]",
    )
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.json", help="write the report")
    parser.add_argument("--json", action="store_true", help="the report on stdout")
    parser.add_argument("--strip", type=Path, metavar="FILE.png", help="write a strip of pictures")
    return parser


def package(text: str) -> tuple[str, Path]:
    """Reads ``NAME=DIR``."""
    name, equals, folder = text.partition("=")
    if not (name and equals and folder):
        raise argparse.ArgumentTypeError("expected NAME=DIR")
    return name, Path(folder)


def _positive(text: str) -> float:
    value = float(text)
    if not (0.0 < value < math.inf):
        raise argparse.ArgumentTypeError("expected a number above zero")
    return value


def _gravity(text: str) -> str | tuple[float, float, float]:
    if text in ("plan", "up", "down", "side"):
        return text
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError("expected plan, up, down, side or X,Y,Z") from None
    if not all(map(math.isfinite, (x, y, z))):
        raise argparse.ArgumentTypeError("expected finite numbers")
    return x, y, z


if __name__ == "__main__":
    sys.exit(main())
