"""Ctrl-C and callbacks stop a search."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator

import pytest
import regrasp

# An hour of improving, were it not stopped.
LONG = {"improve": 3600.0, "max_work": 10**15}


@pytest.fixture(autouse=True)
def ctrl_c() -> Iterator[None]:
    """Processes that a shell began in the background ignore Ctrl-C: the search would go on for an hour."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_stops_a_search(box: regrasp.Scene) -> None:
    pressed: list[float] = []

    def press() -> None:
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.5, press)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        regrasp.plan(box, threads=2, **LONG)
    # 100 ms on a machine of its own; this one is shared.
    assert time.monotonic() - pressed[0] < 5
    timer.join()
    assert regrasp.plan(box, seed=1), "the next search is not stopped"


def test_what_a_callback_raises_stops_the_search(box: regrasp.Scene) -> None:
    class Enough(Exception):
        pass

    heard: list[regrasp.Progress] = []

    def listen(progress: regrasp.Progress) -> None:
        heard.append(progress)
        if len(heard) == 3:
            raise Enough("three times")

    with pytest.raises(Enough, match="three times"):
        regrasp.plan(box, progress=listen, **LONG)
    assert len(heard) == 3
    assert all(isinstance(progress.work, int) and progress.angle_left >= 0 for progress in heard)
    assert threading.current_thread() is threading.main_thread()


def test_progress_is_told_by_the_thread_that_asked(box: regrasp.Scene) -> None:
    threads: set[int] = set()
    found = regrasp.plan(box, improve_work=100_000, threads=2, progress=lambda _: threads.add(threading.get_ident()))
    assert found and threads == {threading.get_ident()}


def test_other_threads_run_meanwhile(box: regrasp.Scene) -> None:
    """The interpreter's lock is released: another thread counts while a search runs."""
    counted = 0
    over = threading.Event()

    def count() -> None:
        nonlocal counted
        while not over.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    started = time.monotonic()
    regrasp.plan(box, improve_work=200_000)
    seconds = time.monotonic() - started
    over.set()
    thread.join()
    assert counted > 20 * seconds
