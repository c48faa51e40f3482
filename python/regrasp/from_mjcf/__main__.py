"""``python -m regrasp.from_mjcf hand.xml -o folder``: exit code 0 written, 2 bad input."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from . import Conversion, MjcfError, convert

NAMES_SHOWN = 6
"""Names of one kind that are printed; --all prints the others."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    options = _parser().parse_args(arguments)
    try:
        made = convert(
            options.model,
            options.output,
            root=options.root,
            lenient=options.lenient,
            couple=dict(options.couple),
            velocity=options.velocity,
        )
    except (MjcfError, ImportError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(report(made, None if options.all else NAMES_SHOWN))
    if made.problem is not None:
        print(f"error: {made.urdf} is written, and is not a hand as it stands:\n{made.problem}", file=sys.stderr)
        return 2
    return 0


def report(made: Conversion, shown: int | None) -> str:
    """What was written and what was left out, in lines."""
    lines = [f"note: {note}" for note in made.notes]
    for kind, names in made.left_out.items():
        listed = names[:shown]
        more = f" and {len(names) - len(listed)} more" if len(names) > len(listed) else ""
        lines.append(f"left out: {kind}: {', '.join(listed)}{more}")
    lines.append(f"wrote  {made.urdf}")
    if made.hand_file is not None:
        lines.append(f"wrote  {made.hand_file}")
        lines.append(f"next   regrasp inspect {made.hand_file}")
    return "\n".join(lines)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m regrasp.from_mjcf",
        description="Writes a hand of MuJoCo (MJCF) as hand.urdf, meshes and hand.toml. docs/how-to/mjcf.md describes it.",
    )
    parser.add_argument("model", type=Path, help="model file; includes and meshes are found as MuJoCo finds them")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER", help="new folder to write into")
    parser.add_argument(
        "--root",
        metavar="BODY",
        help="body that becomes the root link; world for all [default: the only one with joints]",
    )
    parser.add_argument("--lenient", action="store_true", help="hold or leave out what a URDF cannot hold, with a note")
    parser.add_argument(
        "--couple",
        type=_coupling,
        action="append",
        default=[],
        metavar="JOINT=LEADER",
        help="a joint that follows another, as tendons make it; 0.8*LEADER by that multiplier; may be repeated",
    )
    parser.add_argument("--velocity", type=_positive, metavar="V", help="highest speed of all joints, in rad/s or m/s")
    parser.add_argument("--all", action="store_true", help="all names of what is left out")
    return parser


def _coupling(text: str) -> tuple[str, tuple[str, float]]:
    """Reads ``JOINT=LEADER`` and ``JOINT=0.8*LEADER``."""
    joint, _, rest = text.partition("=")
    factor, _, leader = rest.rpartition("*")
    try:
        multiplier = float(factor or "1")
    except ValueError:
        multiplier = math.nan
    if not (joint and leader and math.isfinite(multiplier) and multiplier != 0.0):
        raise argparse.ArgumentTypeError("expected JOINT=LEADER or JOINT=0.8*LEADER")
    return joint, (leader, multiplier)


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError("expected a number above zero")
    return value


if __name__ == "__main__":
    sys.exit(main())
