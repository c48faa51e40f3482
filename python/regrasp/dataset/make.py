"""Makes a data set: blocks that have no shard yet, on a pool of processes or on Ray."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from .._arguments import StrPath
from .._errors import InputError
from .blocks import Block, Result, blocks_of
from .folder import begin, problem_of, remove_temporary, shards_in, write_whole
from .pool import Lost, Outcome, Pool, Retried
from .specification import Specification

Say = Callable[[str], object]


@dataclass
class Made:
    """What a run of `make` did."""

    done_before: int = 0
    """Blocks whose shards were there."""
    made: int = 0
    """Blocks made now."""
    episodes: int = 0
    """Episodes made now."""
    solved: int = 0
    kept: int = 0
    """Of the solved ones, those that the replay kept."""
    seconds: float = 0.0
    """Processor time of the workers."""
    elapsed: float = 0.0
    """Wall-clock seconds."""
    lost: list[tuple[Block, str]] = field(default_factory=list[tuple[Block, str]])
    """Blocks that could not be made, and why."""
    foreign: list[Path] = field(default_factory=list[Path])
    """Files among the shards that are none of them."""

    @property
    def complete(self) -> bool:
        """True when every block has its shard."""
        return not self.lost


def make(
    specification: Specification,
    folder: StrPath,
    *,
    workers: int | None = None,
    ray: str | None = None,
    memory: int | None = None,
    say: Say = lambda _: None,
) -> Made:
    """Makes what is missing of a data set in `folder`.

    workers: processes, or blocks at once on Ray; as many as there are processors where nothing is said.
    ray: "local", "auto" or an address, to run the blocks on Ray instead of on processes of this machine.
    memory: limit of a worker's address space, in bytes.
    say: is told how it goes, line by line.

    Whoever stops it (Ctrl-C raises `KeyboardInterrupt`) has a valid data set, and goes on with the same call. Raises `InputError`.
    """
    place = Path(os.fspath(folder))
    begin(place, specification)
    if n_left := remove_temporary(place):
        say(f"removed {n_left} unfinished files of a run that was cut off")
    made = Made()
    blocks = blocks_of(specification)
    missing = list(_missing(place, blocks, made, say))
    if made.done_before:
        say(f"{made.done_before} of {len(blocks)} shards are there already")
    # More workers than blocks would only wait.
    n_workers = max(1, min(workers or os.cpu_count() or 1, len(missing)))
    progress = _Progress(made, sum(block.count for block in missing), time.monotonic(), say)
    for block, outcome in _outcomes(specification, missing, n_workers if workers or not ray else None, ray, memory):
        name = f"{specification.tasks[block.task].name} {block.first} to {block.first + block.count - 1}"
        if isinstance(outcome, Retried):
            say(f"a worker {outcome.reason}; episodes {name} are made again")
        elif isinstance(outcome, Lost):
            made.lost.append((block, outcome.reason))
            say(f"episodes {name} could not be made: {outcome.reason}")
        else:
            write_whole(place / block.path, outcome.shard)
            _log(place, block, outcome)
            progress.add(block, outcome)
    made.elapsed = time.monotonic() - progress.began
    return made


def _outcomes(
    specification: Specification, missing: list[Block], n_workers: int | None, ray: str | None, memory: int | None
) -> Iterator[Outcome]:
    if not missing:
        return iter(())
    if ray is not None:
        from .cluster import run_on_ray

        return run_on_ray(specification.tasks, missing, ray, n_workers)
    return Pool(specification.tasks, n_workers or 1, memory).run(missing)


def _missing(folder: Path, blocks: list[Block], made: Made, say: Say) -> Iterator[Block]:
    """Blocks without a whole shard; says what else is wrong."""
    known = {folder / block.path for block in blocks}
    for block in blocks:
        problem = problem_of(folder, block)
        if problem is None:
            made.done_before += 1
            continue
        if problem:
            say(f"D121 {folder / block.path}: {problem}; it is made again")
        yield block
    for path in shards_in(folder):
        if path not in known:
            made.foreign.append(path)
            say(f"D122 {path}: is no shard of this data set; it is left alone and not counted")


def _log(folder: Path, block: Block, result: Result) -> None:
    """One line about a block. The log is no part of the data: not being able to write it stops nothing."""
    fields = {"shard": block.path, "episodes": block.count, "solved": result.solved, "seconds": round(result.seconds, 3)}
    try:
        with open(folder / "log.jsonl", "a", encoding="utf-8") as file:
            file.write(json.dumps(fields) + "\n")
    except OSError:
        pass


@dataclass
class _Progress:
    made: Made
    total: int
    """Episodes to be made in this run."""
    began: float
    say: Say
    told: float = 0.0

    def add(self, block: Block, result: Result) -> None:
        """Counts a block; tells about once a second, and at the end."""
        made = self.made
        made.made += 1
        made.episodes += block.count
        made.solved += result.solved
        made.kept += result.kept
        made.seconds += result.seconds
        now = time.monotonic()
        if now - self.told < 1.0 and made.episodes < self.total:
            return
        self.told = now
        elapsed = max(now - self.began, 1e-9)
        rate = made.episodes / elapsed
        left = (self.total - made.episodes) / rate
        self.say(
            f"{made.episodes:,} of {self.total:,} episodes, {100 * made.solved / made.episodes:.1f} % solved, "
            f"{rate:.1f} episodes/s, {duration(left)} left"
        )


def duration(seconds: float) -> str:
    """In words, to two units."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


__all__ = ["InputError", "Made", "duration", "make"]
