"""Commands, and what is seen after them: the part of an executor that knows no goals and makes no plans."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .._model import Pose
from ..simulate.reference import Array
from .endings import GiveUp, Withdrawn
from .guards import check_observation, checked_holding
from .leg import Leg
from .log import Event, GoalResult, RunLog, Sample
from .monitor import Monitor, pose_error, why_gone
from .plant import Command, Plant
from .reflex import Reflex
from .senses import Fault, Senses
from .settings import ExecutorSettings

#: A sample is kept every so many ticks.
SAMPLED = 5
#: Faults that stop the motion until they are over.
SERIOUS = frozenset({"joints_missing", "stale_pose", "pose_jump"})
#: Events that a firmer grip may prevent.
LOSING = frozenset({"deviation", "slip", "lost_contact", "missed"})
#: A clock that has stood still for so many observations goes on by commands alone, as that of a simulation does.
STILL = 3
#: Seconds between two looks for a command that holds the object.
LOOK_AGAIN = 0.1
#: A clock that stands still for fewer observations than this is none that has stopped, however short ``patience`` is.
LEAST_STILL = 20

Truth = Callable[[], tuple[Array, Array]]
"""Where the object really is: position, and orientation w x y z."""


class Steering:
    """Gives a command at every tick, from a leg that others begin, and writes down what happens."""

    def __init__(
        self,
        plant: Plant,
        settings: ExecutorSettings,
        gains: tuple[Array | None, Array | None],
        listener: Callable[[Event | GoalResult], None] | None,
        log: RunLog,
    ) -> None:
        """gains: stiffness and damping of the joints, where they are not those of replays."""
        self._plant = plant
        self._settings = settings
        self._gains = gains
        self._listener = listener
        self._is_withdrawn: Callable[[], bool] | None = None
        self._waits: Callable[[], None] | None = getattr(plant, "wait", None)
        self._truth: Truth | None = getattr(plant, "truth", None)
        self._grips_firmer = settings.grip == "firm"
        self._senses = Senses(len(plant.joint_names), len(plant.fingers), settings)
        self._most_still = max(LEAST_STILL, math.ceil(settings.patience / plant.tick))
        self._n_looks = 0
        self._why_no_hold = ""
        """Why there is no command that holds the object; empty where that was not tried."""
        self._reflex = Reflex(settings)
        self._current: list[Fault] = []
        self._leg: Leg | None = None
        self._k = 0
        """Tick of the leg."""
        self._blend_from: Array | None = None
        self._blended = 1.0
        self._last_command: Command | None = None
        self._goal_index: int = 0
        self._n_ticks = 0
        self._faults: dict[str, float] = {}
        self.log = log

    # --------------------------------------------------------------------------------------------------------- before a leg

    def _first_pose(self) -> None:
        """Waits for the first pose and joints; the plant does what it did before."""
        seen = self._plant.observe()
        since = seen.time
        self._take(seen)
        while not (self._senses.knows_pose and self._senses.knows_joints):
            if self._senses.time - since > self._settings.patience:
                what = "no pose of the object" if not self._senses.knows_pose else "not every joint"
                raise GiveUp("lost", f"{what} was ever seen")
            self._wait()

    def _wait(self) -> None:
        """One tick before the first leg: without a command where the plant can wait, else with one that holds. Without any as long as
        there is none that holds: the plant then does what it did before."""
        if self._waits is not None:
            self._waits()
        else:
            if self._last_command is None:
                self._last_command = self._first_command()
            if self._last_command is None:
                time.sleep(self._plant.tick)
            else:
                self._plant.apply(self._last_command)
        self._take(self._plant.observe())

    def _first_command(self) -> Command | None:
        """What the plant holds with as the run begins: what it says, what a simulation is told, else the forces of a plan from the grasp that
        is seen. None where that is not known yet."""
        holding = getattr(self._plant, "holding", None)
        if holding is not None:
            return checked_holding(holding, len(self._plant.joint_names))
        rig, data = getattr(self._plant, "rig", None), getattr(self._plant, "data", None)
        if rig is not None and data is not None:
            servo = np.array(data.ctrl[rig.motors])
            return Command(servo, self._senses.joints.copy(), np.zeros(len(servo)))
        senses = self._senses
        # A clock that goes on by itself brings the pose of the object soon.
        if not senses.knows_joints or not (senses.knows_pose or senses.n_still >= STILL):
            return None
        self._n_looks += 1
        if (self._n_looks - 1) % max(1, round(LOOK_AGAIN / self._plant.tick)) != 0:
            return None
        found = self._find_hold()
        self._why_no_hold = found if isinstance(found, str) else ""
        return None if isinstance(found, str) else found

    def _find_hold(self) -> Command | str:
        """The command that holds what is seen, or why there is none."""
        return "nothing here makes plans"

    # -------------------------------------------------------------------------------------------------------------- holding

    def _outlast(self, faults: list[Fault]) -> None:
        """Holds until observations are good again. Raises where they do not become so, and where the object is gone."""
        settings, since = self._settings, self._senses.time
        gone_since: float | None = None
        while any(fault.kind in SERIOUS for fault in faults):
            now, gone = self._senses.time, why_gone(self._leg, self._senses, self._settings)
            gone_since = None if not gone else now if gone_since is None else gone_since
            if gone_since is not None and now - gone_since >= settings.gone_after:
                raise GiveUp("lost", gone)
            if now - since > settings.patience:
                raise GiveUp("gave_up", f"{faults[0].kind}: {faults[0].message}")
            faults = self._tick(moves=False, state="hold")

    def _settle(self, goal: Pose, quat: Array) -> tuple[float, float]:
        """Waits for feedback to bring the object to its goal; how far it is off then."""
        leg, settings = self._leg, self._settings
        assert leg is not None
        position = np.array(goal.position)
        since = self._senses.time
        while True:
            distance, angle = pose_error(leg, self._senses.position, self._senses.quat, position, quat)
            waited = self._senses.time - since
            is_there = distance <= settings.settled_distance and angle <= settings.settled_turn
            if (is_there and waited >= settings.settled_after) or waited >= settings.settle_time:
                return distance, angle
            self._tick(moves=False, state="settle")

    def _hold_for(self, seconds: float) -> None:
        """Holds, and for as long as observations are bad."""
        since = self._senses.time
        while self._senses.time - since < seconds:
            faults = self._tick(moves=False, state="hold")
            if faults:
                self._outlast(faults)

    # ----------------------------------------------------------------------------------------------------------------- ticks

    def _tick(self, *, moves: bool, state: str, monitor: Monitor | None = None) -> list[Fault]:
        """One command and what is seen after it; what is seriously wrong with that."""
        leg = self._leg
        if leg is None:
            self._wait()
        else:
            self._feel(leg)
            servo = leg.command(self._k, self._senses.position, self._senses.quat, moves=moves)
            if self._blended < 1.0 and self._blend_from is not None:
                self._blended = min(1.0, self._blended + self._plant.tick / self._settings.blend_time)
                servo = self._blend_from + self._blended * (servo - self._blend_from)
            else:
                self._blended = 1.0
            self._last_command = leg.as_command(self._k, servo, moves=moves)
            self._plant.apply(self._last_command)
            self._take(self._plant.observe())
        self._n_ticks += 1
        if self._n_ticks % SAMPLED == 0 and state != "idle":
            self._sample(state, monitor)
        if self._is_withdrawn is not None and self._is_withdrawn():
            raise Withdrawn
        return self._current

    def _feel(self, leg: Leg) -> None:
        """Presses harder where fingertips feel a sudden change."""
        if leg.feedback is None:
            return
        senses = self._senses
        if self._reflex.look(senses.time, leg, self._k, senses.forces, blends=self._blended < 1.0):
            self._event("sudden_force", "a fingertip feels a sudden change", "grip")
        leg.feedback.extra = self._reflex.extra

    def _resting(self) -> Command:
        assert self._last_command is not None
        if self._leg is None:
            return self._last_command
        servo = self._leg.command(self._k, self._senses.position, self._senses.quat, moves=False)
        return self._leg.as_command(self._k, servo, moves=False)

    def _take(self, seen: Any) -> None:
        leg = self._leg
        faults = self._senses.take(check_observation(self._plant, seen), leg, self._k)
        now = self._senses.time
        for fault in faults:
            # A fault that stays is told once a second.
            if now - self._faults.get(fault.kind, -np.inf) > 1.0:
                self._faults[fault.kind] = now
                self._event(fault.kind, fault.message, "hold" if fault.kind in SERIOUS else "ignore")
        self._current = [fault for fault in faults if fault.kind in SERIOUS]
        if self._senses.n_still >= self._most_still:
            raise GiveUp("gave_up", self._why_still())

    def _why_still(self) -> str:
        """Why the clock of the plant stands still."""
        if self._leg is None and self._last_command is None and self._waits is None:
            why = self._why_no_hold or "not every joint was seen"
            return f"no command that holds the object is known ({why}): give the plant a member \"holding\" or \"wait\""
        return f"the plant's clock stands still at {self._senses.time:g} s: {self._senses.n_still} observations in a row"

    def _sample(self, state: str, monitor: Monitor | None) -> None:
        leg, senses = self._leg, self._senses
        if leg is None:
            return
        wanted = leg.ref.object_position[self._k], leg.ref.object_quat_wxyz[self._k]
        distance, angle = pose_error(leg, senses.position, senses.quat, *wanted)
        true_distance = true_angle = None
        if self._truth is not None:
            true_distance, true_angle = pose_error(leg, *self._truth(), *wanted)
        self.log.samples.append(
            Sample(
                time=round(senses.time, 6),
                leg=len(self.log.legs) - 1,
                tick=self._k,
                state=state,
                distance=distance,
                angle=angle,
                true_distance=true_distance,
                true_angle=true_angle,
                slip=0.0 if monitor is None else monitor.slip,
                forces=None if senses.forces is None else [float(force) for force in senses.forces],
                joint_error=0.0 if monitor is None else monitor.joint_error,
            )
        )

    def _event(self, kind: str, message: str, answer: str) -> None:
        leg = len(self.log.legs) - 1
        if kind in LOSING and self._settings.grip == "firm after trouble":
            self._grips_firmer = True
        self._tell(Event(round(self._senses.time, 6), kind, message, answer, self._goal_index, leg))

    def _tell(self, happening: Event | GoalResult) -> None:
        self.log.add(happening)
        if self._listener is not None:
            try:
                self._listener(happening)
            except BaseException:
                # It ends the run, and is not told about that.
                self._listener = None
                raise
