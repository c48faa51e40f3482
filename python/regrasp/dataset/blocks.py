"""Blocks of episodes: what one worker makes at a time, and what one shard holds."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import os
import signal
from dataclasses import dataclass

from .. import _regrasp
from .draws import canonical, key_of
from .episodes import row_of
from .schema import SCHEMA, SHARD_VERSION, shard_of
from .specification import Specification, TaskSpec

#: Blocks in a folder: folders of millions of files are slow.
BLOCKS_IN_FOLDER = 1000


@dataclass(frozen=True)
class Block:
    """Episodes `first` to `first + count` (exclusive) of a task."""

    task: int
    """Index in the specification."""
    first: int
    count: int
    path: str
    """Of its shard, below the data set's folder; the name has the content key."""
    key: str
    """Content key: SHA-256 of all that the shard depends on, but for the machine."""


def blocks_of(specification: Specification) -> list[Block]:
    """All blocks, in order."""
    blocks: list[Block] = []
    for index, task in enumerate(specification.tasks):
        for number, first in enumerate(range(0, task.episodes, specification.block)):
            count = min(specification.block, task.episodes - first)
            key = content_key(task, first, count)
            folder = f"shards/{task.name}/{number // BLOCKS_IN_FOLDER:05d}"
            blocks.append(Block(index, first, count, f"{folder}/{first:09d}-{key[:16]}.parquet", key))
    return blocks


def content_key(task: TaskSpec, first: int, count: int) -> str:
    """Of the shard of some episodes of a task."""
    replay = canonical(task.replay.to_json()) if task.replay else ""
    return key_of("shard", SHARD_VERSION, " ".join(SCHEMA.names), _regrasp.__version__, task.hash, replay, first, count)


@dataclass(frozen=True)
class Result:
    """A block that is done."""

    shard: bytes
    """Its Parquet file."""
    solved: int
    kept: int
    """Solved episodes that the replay kept."""
    seconds: float
    """Processor time that it took."""


def run_block(tasks: tuple[TaskSpec, ...], block: Block) -> Result:
    """Makes a block: the same bytes in every process."""
    _fault_for_tests(block)
    task = tasks[block.task]
    before = os.times()
    rows = [row_of(task, index) for index in range(block.first, block.first + block.count)]
    about = {
        "task": task.name,
        "task_hash": task.hash,
        "first": block.first,
        "count": block.count,
        "content_key": block.key,
        "shard_version": SHARD_VERSION,
        "tool": f"regrasp {_regrasp.__version__}",
        "level": task.level,
        "scene_task": task.scene_task,
        "words": task.words,
    }
    shard = shard_of(rows, about)
    after = os.times()
    seconds = (after.user - before.user) + (after.system - before.system)
    solved = sum(bool(row["solved"]) for row in rows)
    return Result(shard, solved, sum(bool(row["replay_kept"]) for row in rows), seconds)


def _fault_for_tests(block: Block) -> None:
    """Kills the process at the block that `REGRASP_TEST_FAULT` names, once or always: tests of the driver."""
    fault = os.environ.get("REGRASP_TEST_FAULT", "")
    if not fault:
        return
    kind, first, marker = fault.split(":", 2)
    if int(first) != block.first or (kind == "kill_once" and os.path.exists(marker)):
        return
    if kind == "kill_once":
        with open(marker, "w", encoding="utf-8"):
            pass
    os.kill(os.getpid(), signal.SIGKILL)
