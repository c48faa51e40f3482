"""Searches that run at once, and whose answers are taken one after the other: what is taken does not depend on how many run."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from .._plan import Plan
from .._result import Failure
from .._session import QueryTimes


class Cancelled(Exception):
    """The search is not wanted any more."""


@dataclass(frozen=True)
class Answer:
    """Of one search."""

    plan: Plan | Failure
    work: float
    """Configurations that it looked at."""
    times: QueryTimes


Ask = Callable[[int, threading.Event], Answer]
"""The search of a number. It raises `Cancelled` soon after the event is set."""


@dataclass
class _Running:
    answer: Future[Answer]
    is_unwanted: threading.Event
    asked_at: float
    """As `InOrder.span`."""


class InOrder:
    """Answers in the order of their numbers. While one is waited for, the next ones are searched too, and dropped where nobody takes
    them."""

    def __init__(self, ask: Ask, threads: int) -> None:
        self._ask = ask
        self._threads = threads
        # Searches that were dropped end soon, but not at once: the next ones do not wait for them.
        self._pool = ThreadPoolExecutor(2 * threads, "regrasp-search") if threads > 1 else None
        self._running: dict[int, _Running] = {}
        self.work = 0.0
        """Of all answers that were taken."""
        self.span = 0.0
        """Work that was done one after the other until the last answer was there, if a configuration takes as long in every search."""
        self.overhead_seconds = 0.0
        """Of all answers that were taken."""

    def __enter__(self) -> InOrder:
        return self

    def __exit__(self, *_: Any) -> None:
        self.drop()
        if self._pool is not None:
            self._pool.shutdown()

    def take(self, number: int, last: int) -> Answer:
        """The answer of a number. Those up to ``last`` may be taken after it."""
        if self._pool is None:
            answer = self._ask(number, threading.Event())
            self.span += answer.work
        else:
            for following in range(number, min(number + self._threads - 1, last) + 1):
                if following not in self._running:
                    is_unwanted = threading.Event()
                    self._running[following] = _Running(self._pool.submit(self._ask, following, is_unwanted), is_unwanted, self.span)
            running = self._running[number]
            answer = running.answer.result()
            del self._running[number]
            self.span = max(self.span, running.asked_at + answer.work)
        self.work += answer.work
        self.overhead_seconds += answer.times.overhead
        return answer

    def drop(self) -> None:
        """Ends what runs and was not taken."""
        for running in self._running.values():
            running.is_unwanted.set()
            running.answer.cancel()
        self._running.clear()
