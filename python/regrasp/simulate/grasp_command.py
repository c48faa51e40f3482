"""``python -m regrasp.simulate grasps.json``: exit code 0 when at least ``--at-least`` of the grasps hold, 1 when fewer do, 2 bad input."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .grasps import Report


def main(arguments: list[str]) -> int:
    """Runs the command; returns the exit code."""
    options = _parser().parse_args(arguments)
    from .grasps import CONTROLS, OURS, GraspSettings, load, try_list
    from .reference import PlanError

    tests = tuple(test for test in ("shake", "lift") if getattr(options, test)) or ("shake", "lift")
    try:
        settings = GraspSettings(mass=options.mass, friction=options.friction, squeeze=options.squeeze, control=options.control)
        content, xml, notes = load(options.list, packages=dict(options.package), mjcf=options.mjcf)
        report = try_list(content, xml, settings, tests=tests, most=options.grasps, notes=notes)
    except (PlanError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    text = json.dumps(report.to_json(), indent=1)
    if options.output:
        options.output.write_text(text + "\n")
    print(text if options.json else summary(report))
    assert options.control in CONTROLS
    shares = [report.share(test, OURS) for test in tests]
    return 0 if all(held >= options.at_least * tried for held, tried in shares) else 1


def summary(report: Report) -> str:
    """A report in a few lines."""
    from .grasps import OURS, THEIRS

    settings = report.settings
    lines = [
        f"grasps {report.hand}, {report.object}, {settings.mass:g} kg, friction {settings.friction:g}, control {settings.control}",
        *(f"note   {note}" for note in report.notes),
    ]
    for test in ("shake", "lift"):
        theirs, tried = report.share(test, THEIRS)
        ours, _ = report.share(test, OURS)
        if tried:
            lines.append(
                f"{test:<6} {theirs} of {tried} hold within {1e3 * THEIRS[0]:.0f} mm and {THEIRS[1]:.0f} degrees, "
                f"{ours} within {1e3 * OURS[0]:.0f} mm and {OURS[1]:.0f} degrees"
            )
    return "\n".join(lines)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m regrasp.simulate", description="Tries the grasps of a list in MuJoCo.")
    parser.add_argument("list", type=Path, help="grasps.json")
    parser.add_argument("--shake", action="store_true", help="only shake, without gravity")
    parser.add_argument("--lift", action="store_true", help="only lift from the stable poses")
    parser.add_argument("--grasps", type=int, help="try the first N only")
    parser.add_argument("--mass", type=float, default=0.1, help="mass of the object, in kilograms")
    parser.add_argument("--friction", type=float, default=0.6, help="friction coefficient of the fingertips")
    parser.add_argument("--squeeze", type=float, default=1.0, help="factor of the list's joint torques")
    parser.add_argument("--control", default="none", help="none, no_forces or first_finger_open: grasps that must fail")
    parser.add_argument("--at-least", type=float, default=0.0, help="share of grasps that must hold within 5 mm and 5 degrees")
    parser.add_argument("--mjcf", type=Path, help="model (regrasp export --mjcf); made from the list's files without it")
    parser.add_argument("--package", action="append", default=[], type=_package, metavar="NAME=DIR", help="where package://NAME is")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("-o", "--output", type=Path, help="write JSON to a file")
    return parser


def _package(text: str) -> tuple[str, str]:
    name, found, folder = text.partition("=")
    if not found:
        raise argparse.ArgumentTypeError("expected NAME=DIR")
    return name, folder
