"""Searches that run at once: what is taken does not depend on how many."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp
from regrasp._session import QueryTimes
from regrasp.execute.in_order import Answer, Cancelled, InOrder
from regrasp.execute.planning import ChargedPlanning, ThreadPlanning
from regrasp.execute.sessions import ExecutorSessions
from regrasp.execute.settings import ExecutorSettings

SCENES = Path(__file__).parents[2] / "scenes"

#: What the searches of the tests below look at, by their number.
WORK = [30.0, 10.0, 25.0, 5.0, 40.0, 1.0]


class Searches:
    """Searches that wait for the test, and end when they are told to."""

    def __init__(self) -> None:
        self.began = [threading.Event() for _ in WORK]
        self.may_end = [threading.Event() for _ in WORK]
        self.dropped: list[int] = []
        self.at_once = self.most_at_once = 0
        self._lock = threading.Lock()

    def __call__(self, number: int, is_unwanted: threading.Event) -> Answer:
        with self._lock:
            self.at_once += 1
            self.most_at_once = max(self.most_at_once, self.at_once)
        self.began[number].set()
        try:
            while not self.may_end[number].wait(0.002):
                if is_unwanted.is_set():
                    self.dropped.append(number)
                    raise Cancelled
        finally:
            with self._lock:
                self.at_once -= 1
        plan: Any = number
        return Answer(plan, WORK[number], QueryTimes(0.5, 0.25, 1.0))


def test_answers_come_in_order_while_the_next_ones_are_searched() -> None:
    searches, before = Searches(), threading.active_count()
    with InOrder(searches, 2) as answers:
        taken: list[Any] = []
        taker = threading.Thread(target=lambda: taken.append(answers.take(0, 5).plan))
        taker.start()
        assert searches.began[0].wait(5) and searches.began[1].wait(5)
        # The second is ready first, and waits for its turn.
        searches.may_end[1].set()
        time.sleep(0.02)
        assert taken == [] and not searches.began[2].is_set()
        searches.may_end[0].set()
        taker.join(5)
        assert taken == [0]
        searches.may_end[2].set()
        assert answers.take(1, 5).plan == 1 and answers.take(2, 5).plan == 2
        assert searches.began[3].wait(5)
    # What nobody takes is dropped, and no thread is left.
    assert searches.dropped == [3] and searches.most_at_once == 2 and threading.active_count() == before


@pytest.mark.parametrize(
    ("threads", "span"),
    [
        (1, 30 + 10 + 25 + 5 + 40),
        # Of two: 0 and 1 from 0 on, 2 from 30, 3 from 30, 4 from 55.
        (2, 95),
        # Of three: 3 begins when 1 is taken, at 30, and 4 when 2 is, at 30.
        (3, 70),
    ],
)
def test_work_is_the_same_and_the_span_is_what_cannot_be_done_at_once(threads: int, span: float) -> None:
    searches = Searches()
    for event in searches.may_end:
        event.set()
    with InOrder(searches, threads) as answers:
        plans: list[Any] = [answers.take(number, 4).plan for number in range(5)]
    assert plans == [0, 1, 2, 3, 4]
    assert answers.work == sum(WORK[:5]) and answers.span == span
    assert answers.overhead_seconds == pytest.approx(5 * 0.25)
    # None beyond the last that may be taken.
    assert not searches.began[5].is_set()


def test_an_error_of_a_search_is_raised_where_its_answer_is_taken() -> None:
    def ask(number: int, _: threading.Event) -> Answer:
        if number == 1:
            raise ValueError("of the second")
        plan: Any = number
        return Answer(plan, 1.0, QueryTimes(0.0, 0.0, 0.0))

    with InOrder(ask, 2) as answers:
        assert answers.take(0, 2).work == 1.0
        with pytest.raises(ValueError, match="of the second"):
            answers.take(1, 2)


def test_legs_are_the_same_on_any_number_of_threads() -> None:
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    sessions = ExecutorSessions.of(scene)
    plan = regrasp.plan(scene, seed=1)
    assert isinstance(plan, regrasp.Plan)
    start = sessions.usual.project(regrasp.Pose(plan.object_positions[-1], plan.object_quat_xyzw[-1]), plan.joints[-1])
    assert isinstance(start, regrasp.Start)
    goal = regrasp.Pose(plan.object_positions[0], plan.object_quat_xyzw[0])
    made: list[tuple[bytes, float]] = []
    spans: list[float] = []
    for threads in (1, 2, 3):
        settings = ExecutorSettings(threads=threads, choice_work=600_000)
        planning = ChargedPlanning([*sessions.careful, sessions.usual, sessions.loose], settings, lambda _, __: None)
        ticket = planning.ask(start, goal, 7, 2.0)
        assert isinstance(ticket.answer, regrasp.Plan)
        made.append((ticket.answer.to_json(), ticket.work))
        spans.append(ticket.span)
        assert ticket.ready_at == pytest.approx(2.0 + ticket.span / settings.work_rate + settings.planning_overhead)
        assert ticket.search_seconds > 0.0 and ticket.check_seconds > 0.0 and np.isfinite(ticket.overhead_seconds)
    assert made[0] == made[1] == made[2]
    assert spans[0] == made[0][1] > spans[1] >= spans[2]


def test_nobody_waits_for_a_search_that_was_dropped() -> None:
    scene = regrasp.load_scene(SCENES / "sphere_90x.toml")
    plan = regrasp.plan(scene, seed=1)
    assert isinstance(plan, regrasp.Plan)
    may_end, began = threading.Event(), threading.Event()

    class Quick:
        hand, times = scene.hands[0], None

        def plan(self, *_: Any, **__: Any) -> Any:
            assert began.wait(5)
            return plan

    class Slow(Quick):
        def plan(self, *_: Any, **__: Any) -> Any:
            began.set()
            may_end.wait(5)
            return plan

    sessions: Any = [Quick(), Slow()]
    start: Any = None
    before = threading.active_count()
    planning = ThreadPlanning(sessions, ExecutorSettings(choices=1), lambda plan, _: plan)
    ticket = planning.ask(start, plan.goal, 0, 0.0)
    assert ticket.done.wait(5) and planning.is_ready(ticket, 0.0) and not may_end.is_set()
    assert ticket.answer is plan and ticket.prepared is plan
    may_end.set()
    planning.close()
    assert threading.active_count() == before
