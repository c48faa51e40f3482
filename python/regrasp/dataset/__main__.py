"""``python -m regrasp.dataset``: exit code 0 done, 1 something is wrong with the data set, 2 bad input, 130 interrupted."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from .._errors import RegraspError


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    options = _parser().parse_args(arguments)
    if find_spec("pyarrow") is None:
        print("error: pyarrow is not installed; pip install 'regrasp[data]'", file=sys.stderr)
        return 2
    try:
        return options.run(options)
    except RegraspError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; what is done stays: the same command goes on", file=sys.stderr)
        return 130


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _make(options: argparse.Namespace) -> int:
    from .making import duration, make
    from .specification import read_specification

    specification = read_specification(options.specification, packages=dict(options.package))
    if options.episodes is not None:
        specification = specification.at_most(options.episodes)
    if options.replay is not None:
        specification = specification.replayed(options.replay)
    memory = None if options.memory is None else round(options.memory * 1e6)
    made = make(specification, options.output, workers=options.workers, ray=options.ray, memory=memory, say=_say)
    kept = f", {made.kept:,} kept by the replay" if made.kept else ""
    print(
        f"made {made.made:,} shards of {made.episodes:,} episodes, {made.solved:,} solved{kept}, in {duration(made.elapsed)} "
        f"({duration(made.seconds)} of processor time); {made.done_before:,} shards were there"
    )
    if made.lost:
        print(f"{len(made.lost)} shards could not be made: run the same command again", file=sys.stderr)
    return 0 if made.complete else 1


def _verify(options: argparse.Namespace) -> int:
    from .verifying import verify

    verdict = verify(options.folder, share=options.share, seed=options.seed, workers=options.workers, say=_say)
    for problem in verdict.problems[:20]:
        print(problem, file=sys.stderr)
    if len(verdict.problems) > 20:
        print(f"and {len(verdict.problems) - 20:,} more", file=sys.stderr)
    print(
        f"{verdict.shards:,} shards, {verdict.episodes:,} episodes; the checker accepts {verdict.accepted:,} of "
        f"{verdict.judged:,} plans; {len(verdict.problems):,} problems"
    )
    return 0 if verdict.ok else 1


def _info(options: argparse.Namespace) -> int:
    from .folder import write_whole
    from .info import markdown, page, summary

    found = summary(options.folder)
    print(markdown(found), end="")
    if options.page is not None:
        write_whole(options.page, page(options.folder, found, pictures=options.pictures).encode())
    return 1 if found.damaged else 0


def _merge(options: argparse.Namespace) -> int:
    from .merging import merge

    merged = merge(options.folders, options.output, say=_say)
    print(f"copied {merged.shards:,} shards; {merged.known:,} were there")
    return 0


def _export(options: argparse.Namespace) -> int:
    from .reading import Episode, read_episodes

    def episodes() -> Iterator[Episode]:
        found = read_episodes(options.folder, task=options.task, kept=options.kept)
        for index, episode in enumerate(found):
            if options.episodes is not None and index >= options.episodes:
                return
            yield episode

    if options.format == "lerobot":
        from .export_lerobot import export_lerobot

        count = export_lerobot(episodes(), options.output, fps=options.fps)
    elif options.format == "robomimic":
        from .export_files import export_robomimic

        count = export_robomimic(episodes(), options.output, fps=options.fps)
    else:
        from .export_files import export_npz

        count = export_npz(episodes(), options.output)
    print(f"exported {count:,} episodes to {options.output}")
    return 0


def _package(text: str) -> tuple[str, str]:
    name, separator, folder = text.partition("=")
    if not separator or not name:
        raise argparse.ArgumentTypeError("expected NAME=DIR")
    return name, folder


def _share(text: str) -> float:
    value = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    if not 0.0 <= value <= 1.0:
        raise argparse.ArgumentTypeError("expected a share between 0 and 1, or 0 % and 100 %")
    return value


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("expected a whole number above 0")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m regrasp.dataset", description="Data sets of checked plans.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    make = commands.add_parser("make", help="make what is missing of a data set")
    make.add_argument("specification", type=Path, help="dataset.toml")
    make.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    make.add_argument("--workers", type=_count, metavar="N", help="processes [default: one per processor]")
    make.add_argument("--ray", metavar="auto|local|ADDRESS", help="run on Ray instead: pip install 'regrasp[ray]'")
    make.add_argument("--replay", choices=("A", "B", "C2", "H"), help="replay every plan in MuJoCo with this controller")
    make.add_argument("--episodes", type=_count, metavar="N", help="at most so many episodes of every task")
    make.add_argument("--memory", type=float, metavar="MB", help="limit of a worker's address space")
    make.add_argument("--package", type=_package, action="append", default=[], metavar="NAME=DIR")
    make.set_defaults(run=_make)

    verify = commands.add_parser("verify", help="judge the plans again, from the folder alone")
    verify.add_argument("folder", type=Path)
    verify.add_argument("--share", type=_share, default=1.0, help="random share of the plans [default: 100%%]")
    verify.add_argument("--seed", type=int, default=0, help="of the choice of the plans")
    verify.add_argument("--workers", type=_count, default=1, metavar="N")
    verify.set_defaults(run=_verify)

    info = commands.add_parser("info", help="tables of what is in a data set")
    info.add_argument("folder", type=Path)
    info.add_argument("--page", type=Path, metavar="FILE.html", help="write a page with histograms and storyboards")
    info.add_argument("--pictures", type=int, default=3, metavar="N", help="storyboards of every task [default: 3]")
    info.set_defaults(run=_info)

    merge = commands.add_parser("merge", help="merge data sets into one")
    merge.add_argument("folders", type=Path, nargs="+")
    merge.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    merge.set_defaults(run=_merge)

    export = commands.add_parser("export", help="write solved episodes in another format")
    export.add_argument("format", choices=("lerobot", "robomimic", "npz"))
    export.add_argument("folder", type=Path)
    export.add_argument("-o", "--output", type=Path, required=True, metavar="PATH")
    export.add_argument("--task", metavar="NAME", help="of this task alone")
    export.add_argument("--episodes", type=_count, metavar="N", help="at most so many")
    export.add_argument("--kept", action="store_true", help="those alone that the replay kept")
    export.add_argument("--fps", type=_count, default=30, help="frames per second [default: 30]")
    export.set_defaults(run=_export)
    return parser


if __name__ == "__main__":
    sys.exit(main())
