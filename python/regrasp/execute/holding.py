"""The command that holds an object in a hand: of a plan as it begins, or of what is seen before a run begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._model import Pose
from .._plan import Plan
from .._session import Session, Start
from ..simulate.model import Settings
from ..simulate.reference import Array, quat_exp, quat_product
from .guards import checked_gains
from .leg import Leg, first_rig
from .plant import Command
from .senses import Senses
from .settings import ExecutorSettings

#: The plan whose first command holds the object turns it by so much, in radians. It is never run.
HOLD_TURN = 0.002
#: Work of one search for such a plan, in configurations: ten times what the first one takes; the rest makes it better.
HOLD_WORK = 2_000


def holding_command(plan: Plan, *, tick: float = 0.004, stiffness: Array | None = None, damping: Array | None = None) -> Command:
    """The command that holds the object as ``plan`` begins, for a plant's ``holding``.

    stiffness, damping: of the robot's joints, in the order of ``plan.joint_names``; without them those of replays in MuJoCo.
    """
    control = Settings(hold_time=0.0, tick=tick)
    n = len(plan.joint_names)
    return first_of(Leg(plan, first_rig(plan, control, *checked_gains(stiffness, damping, n)), control))


def first_of(leg: Leg) -> Command:
    """The command that holds the object where ``leg`` begins."""
    servo = leg.command(0, leg.ref.object_position[0], leg.ref.object_quat_wxyz[0], moves=False)
    return leg.as_command(0, servo, moves=False)


@dataclass(frozen=True)
class HoldFinder:
    """Finds a plan that begins with the grasp that is seen: its forces hold the object."""

    finders: Sequence[Session]
    """Asked for a start near what is seen."""
    planners: Sequence[Session]
    """Asked for a plan from there."""
    settings: ExecutorSettings

    def find(self, senses: Senses) -> Plan | str:
        """The plan, or why there is none. Where the object was not seen yet, it is looked for where the scene has it start."""
        session, settings = self.finders[0], self.settings
        if senses.knows_pose:
            pose = Pose(senses.position.copy(), senses.quat[[1, 2, 3, 0]].copy())
        else:
            pose = session.start
        presses = None if senses.forces is None else (senses.forces > settings.lost_force).tolist()
        message = ""
        for reach in (1.0, settings.last_reach):
            distance, turn = reach * settings.project_distance, reach * settings.project_turn
            for finder in self.finders:
                start = finder.project(pose, senses.joints, presses=presses, distance=distance, turn=turn)
                if not isinstance(start, Start):
                    message = start.message
                    continue
                found = self._plan(start)
                if isinstance(found, Plan):
                    return found
                message = found
        return message

    def _plan(self, start: Start) -> Plan | str:
        message = ""
        pose = start.world_from_object
        turned = quat_product(quat_exp(np.array([0.0, 0.0, HOLD_TURN])), np.array(pose.quat_xyzw)[[3, 0, 1, 2]])
        goal = Pose(np.array(pose.position), turned[[1, 2, 3, 0]])
        for planner in self.planners:
            found = planner.plan(start, goal, seed=self.settings.seed, max_work=HOLD_WORK)
            if isinstance(found, Plan):
                return found
            message = found.message
        return message
