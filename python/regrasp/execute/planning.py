"""Planning beside the motion: on a thread of its own for robots, with time that is charged for simulations."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from .._model import Pose
from .._plan import Plan
from .._result import Failure
from .._session import Session, Start
from .settings import ExecutorSettings, work_share


class Cancelled(Exception):
    """The search is not wanted any more."""


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
    """Configurations that all searches looked at."""
    search_seconds: float = 0.0
    check_seconds: float = 0.0
    total_seconds: float = 0.0
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
    def listen(_: Any) -> None:
        if ticket.cancelled.is_set():
            raise Cancelled

    def ask(session: Session, number: int) -> Plan | Failure:
        answer = session.plan(
            ticket.start,
            ticket.goal,
            seed=seed + number,
            max_work=settings.max_work,
            time_limit=settings.time_limit,
            progress=listen,
        )
        ticket.work += float(answer.statistics["work"])
        times = session.times
        if times is not None:
            ticket.search_seconds += times.search
            ticket.check_seconds += times.check
            ticket.total_seconds += times.total
        return answer

    answer: Plan | Failure | None = None
    # One try of each careful session, then all tries of the last.
    tries = [*sessions[:-1], *[sessions[-1]] * settings.plan_attempts]
    for attempt, session in enumerate(tries):
        answer = ask(session, attempt)
        if isinstance(answer, Plan):
            most_work = work_share(session.hand) * settings.choice_work
            answer = _shortest(answer, lambda number: ask(session, len(tries) + number), ticket, (settings.choices, most_work))
            ticket.prepared = prepare(answer, ticket.speed)
            break
    ticket.answer = answer


def _shortest(plan: Plan, ask: Callable[[int], Plan | Failure], ticket: Ticket, limits: tuple[int, float]) -> Plan:
    """The plan whose motion takes the least time, of this one and of others: so many in all, while so much work lasts."""
    choices, most_work = limits
    best, each = plan, ticket.work
    for number in range(choices - 1):
        # What one more is likely to take; a motion of the object alone is as short as can be.
        if ticket.work + each > most_work or best.statistics["relocations"] == 0:
            break
        before = ticket.work
        other = ask(number)
        each = max(each, ticket.work - before)
        if isinstance(other, Plan) and other.duration < best.duration:
            best = other
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
        ticket.ready_at = now + ticket.work / rate + self._settings.planning_overhead
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
