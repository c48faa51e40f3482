"""The executor: observes, plans from there, moves, and observes again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import numpy as np

from .._model import Pose
from .._plan import Plan
from .._result import Failure
from .._session import Session, Start
from ..simulate.model import Rig, Settings
from ..simulate.reference import Array
from .endings import GiveUp, GoOn, Withdrawn
from .goals import Present, Upcoming, between, towards
from .guards import check_control, check_plant, checked_gains
from .holding import HoldFinder, first_of
from .leg import Leg, first_rig
from .log import NOT_FINISHED, Event, GoalResult, LegRecord, RunLog
from .monitor import HOLDING, Monitor, Trigger, pose_error, why_gone
from .planning import ChargedPlanning, Planning, Prepare, ThreadPlanning, Ticket
from .plant import Command, Plant
from .sessions import ExecutorSessions
from .settings import ROUND, ExecutorSettings
from .steering import Steering, Truth

#: Trouble that may pass while the hand holds: a push moves the object, and the fingers bring it back.
PASSING = frozenset({"deviation", "lost_contact", "slip"})
#: Where one finger takes over from another, the second lands within so long after the first has lifted, in seconds: plans take 0.06.
HAND_OVER_TIME = 0.1
#: The object turns by so much while it is taken hold of anew, in radians.
REGRIP_TURN = 0.002


class Executor(Steering):
    """Brings the object of a session to goal after goal."""

    def __init__(
        self,
        session: Session,
        plant: Plant,
        settings: ExecutorSettings | None = None,
        *,
        control: Settings | None = None,
        planning: Callable[[Sequence[Session], ExecutorSettings, Prepare], Planning] | None = None,
        careful: Sequence[Session] = (),
        loose: Sequence[Session] = (),
        near: Sequence[Session] = (),
        firm: Sequence[Session] = (),
        anew: Sequence[Session] = (),
        stiffness: Array | None = None,
        damping: Array | None = None,
        listener: Callable[[Event | GoalResult], None] | None = None,
    ) -> None:
        """session, plant: of the same hand. control: as the replay's settings, of which tick and speed count.

        planning: ``ThreadPlanning`` for robots; where nothing is said, ``ChargedPlanning`` for plants that know the truth, which are
        simulations, else ``ThreadPlanning``. careful: sessions of the same scene that are asked for plans first; loose: that are asked
        last, and for starts that the session refuses; near: for starts that those refuse too, and for no plans; firm: that are asked before
        all others where ``grip`` says so; anew: of plans that end in grasps that hold well, asked where no plan leads on. stiffness, damping:
        of the robot's joints, where they are not those of replays.
        listener: is told every event, and what became of every goal, as it happens, on the thread that runs. What it raises ends the run.
        Raises ``InputError`` (A510) for a plant whose joints or fingers are not those of the session's hand, in their order, and for gains
        that are none.
        """
        check_plant(plant, session.hand)
        gains = checked_gains(stiffness, damping, len(plant.joint_names))
        if control is not None:
            check_control(control)
        chosen = (settings or ExecutorSettings()).for_object(session.object)
        super().__init__(plant, chosen, gains, listener, RunLog(scene=session.scene.name, settings=asdict(chosen)))
        self._session = session
        base = control or Settings(hold_time=0.0)
        self._control = Settings(
            controller="C2" if self._settings.feedback else "B",
            tick=plant.tick,
            speed=base.speed,
            torsion_told=base.torsion_told,
            feedback_gain=base.feedback_gain,
            largest_offset=self._settings.largest_offset,
            hold_time=0.0,
        )
        maker = planning or (ChargedPlanning if self._truth is not None else ThreadPlanning)
        self._planning = maker([*careful, session, *loose], self._settings, self._prepare)
        self._for_starts = [session, *loose, *near]
        self._holds = HoldFinder(self._for_starts, [session, *loose], chosen)
        self._present: Present | None = None
        self._is_round = session.object.shape.kind in ROUND
        self._firm = firm
        self._anew = anew
        self._rig: Rig | None = None
        self._stopped: Monitor | None = None
        """Of the leg, where that was stopped on its way."""
        self._is_trusted = False
        """True where it was stopped for the first time."""
        self._times_gone_on = 0
        self._n_queries = 0
        self._home = Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
        """Where the object was seen when the run began."""

    @classmethod
    def of(cls, sessions: ExecutorSessions, plant: Plant, settings: ExecutorSettings | None = None, **more: Any) -> Executor:
        """With all sessions of a scene. more: as of `Executor`."""
        others = {"loose": [sessions.loose], "near": [sessions.near], "firm": [sessions.firm], "anew": [sessions.anew]}
        all_of_it: dict[str, Any] = {"careful": sessions.careful, **others, **more}
        return cls(sessions.usual, plant, settings, **all_of_it)

    # ------------------------------------------------------------------------------------------------------------- whole runs

    def run(self, goals: Iterable[Pose | None]) -> RunLog:
        """Brings the object to every goal, in order. Ends with the hand holding, whatever happens. Ctrl-C is raised then, and what a plant, a
        listener or the goals raise; ``log`` says so by then. A second run adds to the same log.

        goals: may yield ``None`` where there is no goal for now: the hand holds for a tick, and asks again. It must not wait itself. Where
        it has a method ``is_withdrawn``, that is asked at every tick whether the present goal is still wanted; else the hand stops and holds.
        A goal that is no pose of finite numbers raises ``InputError`` (A510), when all goals before it have been tried.
        """
        log = self.log
        upcoming = Upcoming(goals)
        log.status, log.message = "running", ""
        has_failed = False
        try:
            self._first_pose()
            self._home = Pose(self._senses.position.copy(), self._senses.quat[[1, 2, 3, 0]].copy())
            prepared: Ticket | None = None
            before = self._senses.quat
            while not upcoming.has_ended:
                goal = upcoming.take()
                if goal is None:
                    if not upcoming.has_ended:
                        self._tick(moves=False, state="idle")
                    continue
                present = self._present = Present(goal, self._senses.time, before)
                self._is_withdrawn = partial(upcoming.is_withdrawn, goal)
                try:
                    prepared, before = self._bring_to(present, upcoming, prepared)
                except Withdrawn:
                    prepared, present.motion_time = None, 0.0
                    self._event("withdrawn", "the goal is not wanted any more", "hold")
                    self._result(present, False, "withdrawn", self._truth)
                    before = self._senses.quat
                self._is_withdrawn = None
            log.status = "done"
        except GiveUp as end:
            log.status, log.message = end.status, str(end)
            self._event("object_gone" if end.status == "lost" else "gave_up", str(end), "give_up")
            self._leave()
        except BaseException as error:
            has_failed = not isinstance(error, KeyboardInterrupt)
            log.status = "interrupted"
            log.message = f"{type(error).__name__}: {error}" if has_failed else "the caller asked to stop"
            self._event("interrupted", log.message, "hold")
            self._leave(has_failed=has_failed)
            raise
        finally:
            self._is_withdrawn = None
            try:
                self._rest(has_failed=has_failed)
            finally:
                self._planning.close()
        return log

    def _bring_to(self, present: Present, upcoming: Upcoming, prepared: Ticket | None) -> tuple[Ticket | None, Array]:
        """To one goal; what was planned for the one after, and this goal's orientation."""
        settings, goal, quat, why_not = self._settings, present.goal, present.quat, ""
        is_reached = has_missed = False
        ahead: Ticket | None = None
        # A leg to another goal does not go on, unless nothing else is left.
        self._is_trusted = False
        n_without, most_without = 0, settings.most_detours + 1 if settings.replanning else 1
        attempt, most = 0, settings.attempts if settings.replanning else 1
        while attempt < most:
            made_ahead, prepared = prepared, None
            try:
                ticket = self._leg_to(goal, made_ahead, is_again=attempt > 0, has_missed=has_missed)
            except GoOn as cause:
                self._times_gone_on += 1
                self._event(cause.kind, str(cause), "resume")
            else:
                if not isinstance(ticket.answer, Plan):
                    why_not, detour = _no_plan(ticket), 1
                    # Where a leg went wrong, detours would be still more motion of fingertips that slip: the query counts as a leg.
                    if attempt > 0:
                        attempt += 1
                    else:
                        n_without = detour = n_without + 1
                    is_last = attempt == most or n_without == most_without
                    self._event("no_plan", why_not, "hold" if is_last else "replan")
                    if is_last:
                        break
                    present.motion_time += self._detour(goal, detour)
                    continue
                attempt += 1
                self._begin(ticket, ticket is made_ahead)
                following = upcoming.peek() if settings.anytime and not (settings.replanning and attempt > 1) else None
                ahead = None if following is None else self._ask_ahead(ticket.answer, following)
            answer = "replan" if attempt < most else "hold"
            begun = self._senses.time
            try:
                trigger = self._run_leg()
            finally:
                present.motion_time += self._senses.time - begun
            if trigger is not None:
                why_not = f"{trigger.kind}: {trigger.message}"
                ahead = None
                self._event(trigger.kind, trigger.message, answer)
                if settings.regrips_round and self._is_round and trigger.kind in PASSING and attempt < most:
                    present.motion_time += self._regrip(goal)
                continue
            is_reached, why_not = self._ends_at(goal, quat)
            if is_reached or not settings.replanning:
                break
            ahead = None
            has_missed = True
            self._event("missed", why_not, answer)
        self._result(present, is_reached, why_not, self._truth)
        return ahead, quat

    def _leg_to(self, goal: Pose, prepared: Ticket | None, *, is_again: bool, has_missed: bool) -> Ticket:
        """The answer to where to go next: what was planned ahead, else a query from where the object is. Raises `GoOn` where the leg that
        was stopped is the best that there is."""
        ticket = prepared if prepared is not None else self._query(goal, is_again=is_again, has_missed=has_missed)
        self._wait_for(ticket, rests=prepared is None)
        if prepared is not None and isinstance(ticket.answer, Plan) and self._is_off_start(ticket):
            # Too far from where the plan begins: it is made anew, from here.
            ticket = self._query(goal)
            self._wait_for(ticket, rests=True)
        if not isinstance(ticket.answer, Plan) and self._may_go_on():
            raise GoOn("no_plan", _no_plan(ticket))
        return ticket

    def _regrip(self, goal: Pose, first: Sequence[Session] = ()) -> float:
        """Takes hold of the object anew, about where it is, if the present grasp is weak: by a plan of ``first``, or of careful sessions,
        which end in grasps that hold well where the object is round. How long the hand moved."""
        try:
            start = self._observed_start()
        except GoOn:
            return 0.0
        # The planner looks at where a plan ends only if the object moves.
        ticket = self._ask(start, towards(start.world_from_object, goal, REGRIP_TURN), first)
        self._wait_for(ticket, rests=True)
        # Without a relocation the grasp holds well already.
        if not isinstance(ticket.answer, Plan) or ticket.answer.statistics["relocations"] == 0:
            return 0.0
        return self._go_aside(ticket)

    def _detour(self, goal: Pose, number: int) -> float:
        """Where no plan leads to the goal, the hand makes a detour, from the end of which one may: first it takes hold of the object anew where
        that is, then it goes where the run began, then to the first goal that it reached, and so on in turn. How long it moved."""
        reached = next((result for result in self.log.goals if result.reached), None)
        ways = [self._home] if reached is None else [self._home, Pose(np.array(reached.position), np.array(reached.quat_xyzw))]
        turn = (number - 1) % (len(ways) + 1)
        if turn == 0:
            return self._regrip(goal, self._anew) if self._anew else 0.0
        try:
            ticket = self._query(ways[turn - 1])
        except GoOn:
            return 0.0
        self._wait_for(ticket, rests=True)
        return self._go_aside(ticket) if isinstance(ticket.answer, Plan) else 0.0

    def _go_aside(self, ticket: Ticket) -> float:
        """Runs a leg that is none to the goal. How long the hand moved."""
        self._begin(ticket, False)
        begun = self._senses.time
        trigger = self._run_leg()
        if trigger is not None:
            self._event(trigger.kind, trigger.message, "replan")
        return self._senses.time - begun

    def _ends_at(self, goal: Pose, quat: Array) -> tuple[bool, str]:
        """Waits for feedback to bring the object to its goal. Whether it is there, and how far it is off."""
        distance, angle = self._settle(goal, quat)
        is_reached = distance <= self._settings.reached_distance and angle <= self._settings.reached_turn
        return is_reached, "" if is_reached else f"ended {1e3 * distance:.1f} mm and {np.degrees(angle):.1f} degrees off"

    def _leave(self, *, has_failed: bool = False) -> None:
        """The run ends here: writes down what became of the goal that it was at. has_failed: the plant is not asked for the truth then."""
        if self._present is not None:
            self._result(self._present, False, NOT_FINISHED + self.log.message, None if has_failed else self._truth)

    def _rest(self, *, has_failed: bool) -> None:
        """The last command: it holds. has_failed: something was raised already, which the plant does not hide by raising again."""
        if self._last_command is None:
            return
        try:
            self._plant.apply(self._resting())
        except Exception:
            if not has_failed:
                raise

    def _find_hold(self) -> Command | str:
        found = self._holds.find(self._senses)
        return first_of(self._prepare(found, 1.0)) if isinstance(found, Plan) else found

    def _result(self, present: Present, is_reached: bool, why_not: str, truth: Truth | None) -> None:
        """Tells what became of a goal, and turns to the next."""
        self._present = None
        goal, quat, before, position = present.goal, present.quat, present.before, np.array(present.goal.position)
        distance = angle = float("inf")
        true_distance = true_angle = None
        if self._leg is not None:
            distance, angle = pose_error(self._leg, self._senses.position, self._senses.quat, position, quat)
            if truth is not None:
                true_distance, true_angle = pose_error(self._leg, *truth(), position, quat)
        apart = min(float(np.linalg.norm(quat - before)), float(np.linalg.norm(quat + before)))
        self._tell(
            GoalResult(
                position=position.tolist(),
                quat_xyzw=np.array(goal.quat_xyzw).tolist(),
                reached=is_reached,
                start_time=present.started,
                time=self._senses.time,
                legs=sum(leg.goal == self._goal_index for leg in self.log.legs),
                motion_time=present.motion_time,
                turn=4.0 * float(np.arcsin(min(1.0, 0.5 * apart))),
                distance=min(distance, 1e9),
                angle=min(angle, 1e9),
                true_distance=true_distance,
                true_angle=true_angle,
                why_not=why_not,
            )
        )
        self._goal_index += 1

    # --------------------------------------------------------------------------------------------------------------- queries

    def _query(self, goal: Pose, *, is_again: bool = False, has_missed: bool = False) -> Ticket:
        """Asks for a plan from where the object really is; without replanning, from where the plan before has it. is_again: a leg to
        this goal went wrong. has_missed: one came to its end, but not to the goal."""
        settings = self._settings
        if not settings.replanning and self._leg is not None:
            return self._ask(self._predicted(self._leg.plan), goal)
        start = self._observed_start()
        first: Sequence[Session] = ()
        if has_missed:
            goal = between(start.world_from_object, goal, settings.again_share)
            # The firmer grip that careful plans have on round objects is what makes them turn too far.
            first = [self._session] if self._is_round else ()
        return self._ask(start, goal, first, settings.again_speed if is_again else 1.0)

    def _ask(self, start: Start, goal: Pose, first: Sequence[Session] = (), speed: float = 1.0) -> Ticket:
        self._n_queries += 1
        seed = self._settings.seed + 1000 * self._n_queries
        return self._planning.ask(start, goal, seed, self._senses.time, self._firm if self._grips_firmer else first, speed)

    def _ask_ahead(self, plan: Plan, following: Pose) -> Ticket | None:
        start = self._session.project(Pose(plan.object_positions[-1], plan.object_quat_xyzw[-1]), plan.joints[-1])
        return self._ask(start, following) if isinstance(start, Start) else None

    def _predicted(self, plan: Plan) -> Start:
        start = self._session.project(Pose(plan.object_positions[-1], plan.object_quat_xyzw[-1]), plan.joints[-1])
        if not isinstance(start, Start):
            raise GiveUp("gave_up", f"the end of a plan is no start: {start.message}")
        return start

    def _observed_start(self) -> Start:
        """The start nearest to what is seen, after a rest; observes again until there is one, or patience ends.

        Where there is none, the hand goes back a little on the way that it came: what is in the way there was not before.
        """
        settings = self._settings
        since = self._senses.time
        told, reach, n_retreats = False, 1.0, 0
        while True:
            self._hold_for(settings.rest_time)
            senses = self._senses
            start, message = self._start_near(reach)
            if start is not None:
                return start
            gone = why_gone(self._leg, self._senses, self._settings)
            if gone:
                raise GiveUp("lost", f"{gone}; no start: {message}")
            if not told:
                self._event("no_start", message, "hold")
                told = True
            if self._is_trusted and self._may_go_on():
                raise GoOn("no_start", message)
            if self._go_back() or senses.time - since <= settings.patience:
                continue
            if reach >= settings.last_reach:
                # The object is where the leg has it, and held: going on does less harm than ending here.
                if self._may_go_on():
                    raise GoOn("no_start", message)
                if n_retreats < settings.most_retreats and self._retreat(message):
                    since, reach, n_retreats = senses.time, 1.0, n_retreats + 1
                    continue
                n_felt = None if senses.forces is None else int((senses.forces > settings.lost_force).sum())
                lost = "no finger touches" in message if n_felt is None else n_felt < HOLDING
                raise GiveUp("lost" if lost else "gave_up", f"no start: {message}")
            # Before the hand gives up, a start farther off is good enough: the fingers go there from where they are.
            reach = min(2.0 * reach, settings.last_reach)

    def _start_near(self, reach: float) -> tuple[Start | None, str]:
        """The start nearest to what is seen, within so many times the usual limits, or why there is none."""
        settings, senses = self._settings, self._senses
        pose = Pose(senses.position.copy(), senses.quat[[1, 2, 3, 0]].copy())
        presses = None if senses.forces is None else (senses.forces > settings.lost_force).tolist()
        message = ""
        # Angles first: with more distance, fingers that are farther away count as touching too.
        for share in (1.0,) if reach == 1.0 else (1.0, reach):
            distance, turn = share * settings.project_distance, reach * settings.project_turn
            for session in self._for_starts:
                start = session.project(pose, senses.joints, presses=presses, distance=distance, turn=turn)
                if isinstance(start, Start):
                    return start, ""
                # The last session accepts most: its cause is what is left.
                message = start.message
        return None, message

    def _may_go_on(self) -> bool:
        """True where a leg was stopped on its way, and all but slipped fingertips are where that leg has them."""
        monitor = self._stopped
        if monitor is None or self._times_gone_on >= self._settings.most_resumes:
            return False
        return monitor.is_back(self._k, self._senses, 1.0, slips=False)

    def _go_back(self) -> bool:
        """Goes back on the leg for ``back_off_time``, no farther than to where another finger landed or lifted. False where that is
        here, and where the object is not as the leg has it: fingers that move would drag it farther off."""
        leg, senses, settings = self._leg, self._senses, self._settings
        if leg is None or settings.back_off_time <= 0.0:
            return False
        wanted = leg.ref.object_position[self._k], leg.ref.object_quat_wxyz[self._k]
        distance, angle = pose_error(leg, senses.position, senses.quat, *wanted)
        if distance > settings.project_distance or angle > settings.project_turn:
            return False
        holds, last = leg.ref.holds[self._k], self._k
        goal = max(0, self._k - round(settings.back_off_time / self._plant.tick))
        while self._k > goal and bool((leg.ref.holds[self._k - 1] == holds).all()):
            self._step_back()
        return self._k < last

    def _retreat(self, message: str) -> bool:
        """Goes back on the leg to before the last finger had lifted, wherever the object is by now: that finger takes hold again where it
        did, and one that had landed since lifts. Where no finger has lifted since the leg began, back to there. False where that is here."""
        leg = self._leg
        if leg is None:
            return False
        all_holds, k = leg.ref.holds, self._k
        while not bool((all_holds[k] & ~all_holds[self._k]).any()):
            # The first tick of the phase in which the same fingers hold as at this one.
            first = k
            while first > 0 and bool((all_holds[first - 1] == all_holds[k]).all()):
                first -= 1
            if first == 0:
                if self._k == 0:
                    return False
                k = 0
                break
            # Between two fingers of which one takes over there is a short phase in which neither holds.
            if k != self._k and (k + 1 - first) * self._plant.tick > HAND_OVER_TIME:
                return False
            k = first - 1
        self._event("no_start", message, "back")
        while self._k > k:
            self._step_back()
        # It went wrong here, and would again.
        self._stopped = None
        return True

    def _step_back(self) -> None:
        """One tick back on the leg."""
        self._k -= 1
        faults = self._tick(moves=False, state="hold")
        if faults:
            self._outlast(faults)

    def _prepare(self, plan: Plan, speed: float) -> Leg:
        if self._rig is None:
            self._rig = first_rig(plan, self._control, *self._gains)
        # Fingertips that hold for long creep over the object: where fingers relocate, the motion is as fast as ever.
        share = speed if plan.statistics["relocations"] == 0 else 1.0
        return Leg(plan, self._rig, replace(self._control, speed=share * self._control.speed))

    def _wait_for(self, ticket: Ticket, *, rests: bool) -> None:
        """Holds until the answer is there. rests: the plan begins where the object was seen; feedback would bring it away from there, to
        where the leg before has it, and press on and on where it cannot."""
        feedback = None if self._leg is None else self._leg.feedback
        try:
            if feedback is not None:
                feedback.is_frozen = rests
            while not self._planning.is_ready(ticket, self._senses.time):
                self._tick(moves=False, state="hold")
        except Withdrawn:
            ticket.cancelled.set()
            raise
        finally:
            if feedback is not None:
                feedback.is_frozen = False

    def _is_off_start(self, ticket: Ticket) -> bool:
        """True where the object is not where a plan made ahead begins."""
        leg: Leg = ticket.prepared
        if not self._settings.replanning:
            return False
        senses, settings = self._senses, self._settings
        distance, angle = pose_error(
            leg, senses.position, senses.quat, leg.ref.object_position[0], leg.ref.object_quat_wxyz[0]
        )
        slips = leg.slips(0, leg.tips(senses.joints), senses.position, senses.quat)
        slip = float(np.linalg.norm(slips, axis=1).max(initial=0.0))
        return (
            distance > settings.settled_distance
            or angle > settings.settled_turn
            or slip > 0.5 * settings.slip_distance
        )

    # ---------------------------------------------------------------------------------------------------------------- motion

    def _begin(self, ticket: Ticket, was_prepared: bool) -> None:
        leg: Leg = ticket.prepared
        plan = leg.plan
        offsets = None
        if was_prepared and self._leg is not None and self._leg.feedback is not None:
            offsets = self._leg.feedback.offsets.copy()
        self._leg, self._k, self._times_gone_on = leg, 0, 0
        if offsets is not None and leg.feedback is not None:
            leg.feedback.carry(offsets)
        self._blend_from = None if self._last_command is None else self._last_command.servo.copy()
        self._blended = 0.0
        free = [finger for finger, holds in zip(plan.fingers, ticket.start.holds) if not holds]
        self.log.plans.append(plan)
        self.log.legs.append(
            LegRecord(
                start_time=self._senses.time,
                goal=self._goal_index,
                seed=plan.seed,
                duration=leg.n_ticks * self._plant.tick,
                search_seconds=ticket.search_seconds,
                check_seconds=ticket.check_seconds,
                overhead_seconds=ticket.overhead_seconds,
                moved=dict(ticket.start.moved),
                prepared=was_prepared,
                free=free,
            )
        )

    def _run_leg(self) -> Trigger | None:
        """Runs the leg to its end, or to the first thing that goes wrong and does not pass."""
        leg, settings, first = self._leg, self._settings, self._k
        assert leg is not None
        monitor = Monitor(leg, settings, self._senses.joints, first)
        resumed = 0
        self._stopped = None
        while self._blended < 1.0:
            self._tick(moves=False, state="blend")
        while self._k < leg.n_ticks - 1:
            faults = self._tick(moves=True, state="run", monitor=monitor)
            if faults:
                self._outlast(faults)
            targets = leg.ref.joints[self._k]
            trigger = monitor.look(self._k, self._senses, targets)
            if trigger is not None and settings.replanning:
                may_pass = trigger.kind in PASSING and resumed < settings.most_resumes
                may_pass = may_pass and (trigger.kind != "deviation" or monitor.is_sudden)
                if not (may_pass and self._comes_back(monitor)):
                    # A leg that goes wrong again after it went on is not to be trusted; one that does so at once does not go on again.
                    self._is_trusted = first == 0
                    gets_nowhere = self._times_gone_on > 0 and (self._k - first) * self._plant.tick < settings.least_progress
                    self._stopped = None if gets_nowhere else monitor
                    return trigger
                resumed += 1
                self._event(trigger.kind, trigger.message, "resume")
            self._k += 1
        return None

    def _comes_back(self, monitor: Monitor) -> bool:
        """Holds; true as soon as the leg may go on, false where ``resume_within`` is over."""
        leg, settings, senses = self._leg, self._settings, self._senses
        assert leg is not None
        since, good_since = senses.time, np.inf
        while senses.time - since < settings.resume_within:
            faults = self._tick(moves=False, state="hold", monitor=monitor)
            if faults:
                self._outlast(faults)
            trigger = monitor.look(self._k, senses, leg.ref.joints[self._k])
            if trigger is not None and trigger.kind not in PASSING:
                return False
            is_good = trigger is None and monitor.is_back(self._k, senses, settings.resume_share)
            good_since = min(good_since, senses.time) if is_good else np.inf
            if senses.time - good_since >= settings.resume_after:
                return True
        return False


def _no_plan(ticket: Ticket) -> str:
    return f"no plan: {ticket.answer.message if isinstance(ticket.answer, Failure) else 'cancelled'}"
