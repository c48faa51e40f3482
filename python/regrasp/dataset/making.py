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
from .blocks import Block, Result, blocks_of, content_key
from .folder import about_of, begin, problem_of, remove_temporary, shards_in, write_whole
from .pool import Lost, Outcome, Pool, Retried
from .specification import Specification, TaskSpec

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
    shorter: dict[Block, Path] = {}
    missing = list(_missing(place, specification, blocks, shorter, made, say))
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
            if block in shorter:
                shorter[block].unlink(missing_ok=True)
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


def _missing(
    folder: Path, specification: Specification, blocks: list[Block], shorter: dict[Block, Path], made: Made, say: Say
) -> Iterator[Block]:
    """Blocks without a whole shard; says what else is wrong. Where more episodes were made before, those stay; where fewer
    were, their shards are noted in `shorter`: the new ones take their place."""
    known = {folder / block.path for block in blocks}
    others: dict[str, list[Path]] = {}
    for path in shards_in(folder):
        if path not in known:
            others.setdefault(_begin(path), []).append(path)
    for block in blocks:
        problem = problem_of(folder, block)
        other = _of_other_length(others.get(_begin(folder / block.path), []), specification.tasks[block.task], block)
        if other is not None:
            path, count = other
            known.add(path)
            if problem is None:
                # A run was cut off between writing the one and removing the other.
                (path if count < block.count else folder / block.path).unlink()
            elif count < block.count:
                shorter[block] = path
            else:
                problem = None
        if problem is None:
            made.done_before += 1
            continue
        if problem:
            say(f"D121 {folder / block.path}: {problem}; it is made again")
        yield block
    for path in (path for paths in others.values() for path in paths):
        if path not in known:
            made.foreign.append(path)
            say(f"D122 {path}: is no shard of this data set; it is left alone and not counted")


def _begin(path: Path) -> str:
    """Folder and first episode of a shard, by its name."""
    return str(path.parent / path.name.split("-")[0])


def _of_other_length(paths: list[Path], task: TaskSpec, block: Block) -> tuple[Path, int] | None:
    """The one of these shards that holds more or fewer of the episodes that `block` begins with, and how many."""
    for path in paths:
        try:
            about = about_of(path)
        except ValueError:
            continue
        count: int = about["count"]
        if about["content_key"] == content_key(task, block.first, count):
            return path, count
    return None


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
