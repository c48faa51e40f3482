"""A pool of processes on this machine. A worker that dies is replaced, and its block is made again."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from .blocks import Block, Result, run_block
from .specification import TaskSpec

#: A block that so many workers died of is given up.
MAX_DEATHS = 3


@dataclass(frozen=True)
class Lost:
    """A block that could not be made."""

    reason: str


@dataclass(frozen=True)
class Retried:
    """A worker died, and its block is made again."""

    reason: str


Outcome = tuple[Block, Result | Lost | Retried]


def _work(tasks: tuple[TaskSpec, ...], connection: Connection, memory: int | None) -> None:
    """The loop of a worker."""
    # Ctrl-C is the driver's business.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if memory is not None:
        _limit_memory(memory)
    while True:
        try:
            block = connection.recv()
        except EOFError:
            return
        if block is None:
            return
        try:
            answer: Result | str = run_block(tasks, block)
        except MemoryError:
            answer = "the worker ran out of memory"
        except Exception as error:  # noqa: BLE001: whatever it is, the driver reports it
            answer = f"{type(error).__name__}: {error}"
        connection.send(answer)


def _limit_memory(limit: int) -> None:
    """In bytes of address space; beyond it allocations fail."""
    try:
        import resource
    except ImportError:
        return
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))


@dataclass
class _Worker:
    process: SpawnProcess
    connection: Connection
    block: Block | None = None


@dataclass
class Pool:
    """Processes that make blocks."""

    tasks: tuple[TaskSpec, ...]
    n_workers: int
    memory: int | None = None
    """Limit of a worker's memory, in bytes."""
    _workers: list[_Worker] = field(default_factory=list[_Worker])

    def run(self, blocks: Iterable[Block]) -> Iterator[Outcome]:
        """Makes blocks, in any order; each ends as a result, or as lost after some retries."""
        waiting = iter(blocks)
        again: list[Block] = []
        deaths: dict[str, int] = {}
        try:
            while True:
                self._hand_out(again, waiting)
                busy = {worker.connection: worker for worker in self._workers if worker.block is not None}
                if not busy:
                    return
                for connection in wait(list(busy)):
                    worker = busy[connection]  # pyright: ignore[reportArgumentType]
                    block = worker.block
                    assert block is not None
                    try:
                        answer: Any = worker.connection.recv()
                    except (EOFError, OSError):
                        self._bury(worker)
                        how = _how_it_died(worker.process.exitcode)
                        deaths[block.key] = deaths.get(block.key, 0) + 1
                        if deaths[block.key] < MAX_DEATHS:
                            again.append(block)
                            yield block, Retried(how)
                        else:
                            yield block, Lost(f"{MAX_DEATHS} workers died of it; the last one {how}")
                        continue
                    worker.block = None
                    yield block, Lost(answer) if isinstance(answer, str) else answer
        finally:
            self.stop()

    def _hand_out(self, again: list[Block], waiting: Iterator[Block]) -> None:
        """Gives every idle worker a block; starts workers that are missing."""
        for worker in self._workers:
            if worker.block is None:
                block = again.pop() if again else next(waiting, None)
                if block is None:
                    return
                self._give(worker, block)
        while len(self._workers) < self.n_workers:
            block = again.pop() if again else next(waiting, None)
            if block is None:
                return
            worker = self._start()
            self._workers.append(worker)
            self._give(worker, block)

    def _start(self) -> _Worker:
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=_work, args=(self.tasks, there, self.memory), daemon=True)
        process.start()
        there.close()
        return _Worker(process, here)

    @staticmethod
    def _give(worker: _Worker, block: Block) -> None:
        worker.block = block
        try:
            worker.connection.send(block)
        except OSError:
            # It is dead; that shows when its answer is waited for.
            pass

    def _bury(self, worker: _Worker) -> None:
        worker.process.join(10)
        worker.connection.close()
        self._workers.remove(worker)

    def stop(self) -> None:
        """Ends all workers; what they were making is lost."""
        for worker in self._workers:
            worker.process.kill() if worker.block is not None else _send_end(worker)
        for worker in self._workers:
            worker.process.join(10)
            worker.connection.close()
        self._workers.clear()


def _send_end(worker: _Worker) -> None:
    try:
        worker.connection.send(None)
    except OSError:
        pass


def _how_it_died(code: int | None) -> str:
    if code == -signal.SIGKILL:
        return "was killed (signal 9: by somebody, or by the system because memory ran out)"
    if code is not None and code < 0:
        return f"died of signal {-code} ({signal.strsignal(-code)})"
    return f"ended with exit code {code}"
