"""Planning beside the motion: on a thread of its own for robots, with time that is charged for simulations."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from .._model import Pose
from .._plan import Plan
from .._result import Failure
from .._session import QueryTimes, Session, Start
from .in_order import Answer, Cancelled, InOrder
from .settings import ExecutorSettings, work_share


@dataclass
class Ticket:
    """A query that was asked."""

    start: Start
    goal: Pose
    asked_at: float
    """Time of the plant."""
    speed: float = 1.0
    """Of the motion, as a share of the plan's own."""
    ready_at: float | None = None
    answer: Plan | Failure | None = None
    error: BaseException | None = None
    work: float = 0.0
    """Configurations that all searches looked at whose answers counted,"""
    span: float = 0.0
    """and those that were looked at one after the other, where searches ran at once."""
    search_seconds: float = 0.0
    """From asking to the answer, without the two below."""
    check_seconds: float = 0.0
    """Of the plan that is the answer."""
    overhead_seconds: float = 0.0
    prepared: Any = None
    """What was made of the plan, by whoever planned."""
    cancelled: threading.Event = field(default_factory=threading.Event)
    done: threading.Event = field(default_factory=threading.Event)


Prepare = Callable[[Plan, float], Any]
"""Of a plan and the speed of its motion, as a share of the plan's own."""


Sessions = Sequence[Session]
"""Of one scene, in the order in which they are asked: careful ones first."""


class Planning(Protocol):
    """Answers queries while the hand does something else."""

    def ask(self, start: Start, goal: Pose, seed: int, now: float, first: Sessions = (), speed: float = 1.0) -> Ticket:
        """Asks. Does not wait. first: sessions that are asked before the usual ones. speed: of the motion."""
        ...

    def is_ready(self, ticket: Ticket, now: float) -> bool:
        """True when the ticket has its answer. Raises what the search raised."""
        ...

    def close(self) -> None:
        """Ends every search and thread."""
        ...


def _solve(sessions: Sessions, settings: ExecutorSettings, prepare: Prepare, ticket: Ticket, seed: int) -> None:
    began = time.perf_counter()
    # One try of each careful session, then all tries of the last.
    tries = [*sessions[:-1], *[sessions[-1]] * settings.plan_attempts]
    # Other plans are made with the session that found the first.
    chosen = tries[-1]

    def ask(number: int, is_unwanted: threading.Event) -> Answer:
        def listen(_: Any) -> None:
            if is_unwanted.is_set() or ticket.cancelled.is_set():
                raise Cancelled

        session = tries[number] if number < len(tries) else chosen
        plan = session.plan(
            ticket.start,
            ticket.goal,
            seed=seed + number,
            max_work=settings.max_work,
            time_limit=settings.time_limit,
            progress=listen,
        )
        return Answer(plan, float(plan.statistics["work"]), session.times or QueryTimes(0.0, 0.0, 0.0))

    found: Plan | Failure | None = None
    with InOrder(ask, settings.threads) as answers:
        for number, session in enumerate(tries):
            answer = answers.take(number, len(tries) - 1)
            found, ticket.check_seconds = answer.plan, answer.times.check
            if isinstance(found, Plan):
                chosen = session
                answers.drop()
                most_work = work_share(session.hand) * settings.choice_work
                found, ticket.check_seconds = _shortest((found, answer.times.check), answers, len(tries), (settings.choices, most_work))
                break
        ticket.work, ticket.span, ticket.overhead_seconds = answers.work, answers.span, answers.overhead_seconds
        ticket.search_seconds = max(0.0, time.perf_counter() - began - ticket.check_seconds - ticket.overhead_seconds)
        if isinstance(found, Plan):
            ticket.prepared = prepare(found, ticket.speed)
        ticket.answer = found
        # Nobody waits for the searches that were dropped, which take some hundredths of a second more.
        ticket.done.set()


def _shortest(found: tuple[Plan, float], answers: InOrder, first: int, limits: tuple[int, float]) -> tuple[Plan, float]:
    """The plan whose motion takes the least time, with the seconds of its check: of the one found and of queries from number ``first`` on,
    so many in all, while so much work lasts."""
    choices, most_work = limits
    best, each, end = found, max(answers.work, 1.0), first + choices - 1
    for number in range(first, end):
        # What one more is likely to take; a motion of the object alone is as short as can be.
        if answers.work + each > most_work or best[0].statistics["relocations"] == 0:
            break
        likely = int((most_work - answers.work) // each)
        other = answers.take(number, min(number + likely, end) - 1)
        each = max(each, other.work)
        if isinstance(other.plan, Plan) and other.plan.duration < best[0].duration:
            best = (other.plan, other.times.check)
    return best


class ChargedPlanning:
    """Plans at once and has the answer ready later, by the work that it took: runs of a simulation do not depend on the machine."""

    def __init__(self, sessions: Sessions, settings: ExecutorSettings, prepare: Prepare) -> None:
        self._sessions = sessions
        self._settings = settings
        self._prepare = prepare

    def ask(self, start: Start, goal: Pose, seed: int, now: float, first: Sessions = (), speed: float = 1.0) -> Ticket:
        ticket = Ticket(start, goal, now, speed)
        _solve([*first, *self._sessions], self._settings, self._prepare, ticket, seed)
        rate = work_share(self._sessions[0].hand) * self._settings.work_rate
        ticket.ready_at = now + ticket.span / rate + self._settings.planning_overhead
        return ticket

    def is_ready(self, ticket: Ticket, now: float) -> bool:
        return ticket.ready_at is not None and now >= ticket.ready_at

    def close(self) -> None:
        pass


class ThreadPlanning:
    """Plans on a thread. The search stops within some hundredths of a second when nobody wants it any more."""

    def __init__(self, sessions: Sessions, settings: ExecutorSettings, prepare: Prepare) -> None:
        self._sessions = sessions
        self._settings = settings
        self._prepare = prepare
        self._running: list[tuple[Ticket, threading.Thread]] = []

    def ask(self, start: Start, goal: Pose, seed: int, now: float, first: Sessions = (), speed: float = 1.0) -> Ticket:
        ticket = Ticket(start, goal, now, speed)

        def work() -> None:
            try:
                _solve([*first, *self._sessions], self._settings, self._prepare, ticket, seed)
            except Cancelled:
                pass
            except BaseException as error:
                ticket.error = error
            finally:
                ticket.done.set()

        thread = threading.Thread(target=work, name="regrasp-planning", daemon=True)
        self._running = [(other, running) for other, running in self._running if running.is_alive()]
        self._running.append((ticket, thread))
        thread.start()
        return ticket

    def is_ready(self, ticket: Ticket, now: float) -> bool:
        if not ticket.done.is_set():
            return False
        if ticket.error is not None:
            raise ticket.error
        return True

    def close(self) -> None:
        for ticket, _ in self._running:
            ticket.cancelled.set()
        for _, thread in self._running:
            thread.join()
        self._running = []
