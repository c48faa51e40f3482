"""What goes wrong while a leg runs."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from ..simulate.reference import Array, rotation_matrices, rotation_vector, quat_inverse, quat_product
from .leg import Leg
from .senses import Senses
from .settings import ExecutorSettings


#: Fewer fingers than these hold nothing.
HOLDING = 2


@dataclass(frozen=True)
class Trigger:
    """Why a leg does not go on."""

    kind: str
    message: str


def pose_error(leg: Leg, position: Array, quat: Array, wanted_position: Array, wanted_quat: Array) -> tuple[float, float]:
    """Distance of the centre of mass, and angle, between two poses of the object."""
    center = np.array(leg.rig.model.body_ipos[leg.rig.object_body])
    away = position + rotation_matrices(quat) @ center - wanted_position - rotation_matrices(wanted_quat) @ center
    turn = rotation_vector(quat_product(quat, quat_inverse(wanted_quat)))
    return float(np.linalg.norm(away)), float(np.linalg.norm(turn))


class Monitor:
    """Watches one leg."""

    #: Ticks between two looks at fingertips.
    EVERY = 5

    def __init__(self, leg: Leg, settings: ExecutorSettings, joints_at_start: Array, start: int = 0) -> None:
        """start: the tick of ``joints_at_start``."""
        self._leg = leg
        self._settings = settings
        n = len(leg.rig.fingers)
        self._lost_since = np.full(n, np.nan)
        self._stalled_since = np.full(len(leg.rig.joint_names), np.nan)
        self._baseline = np.full((n, 3), np.nan)
        # A position drive never ends exactly where it was told: what was off at the start does not count.
        self._usual_error = np.abs(joints_at_start - leg.ref.joints[start])
        self.slip = 0.0
        self.distance = 0.0
        self.angle = 0.0
        self.joint_error = 0.0
        self._count = 0
        self._shares: deque[tuple[float, float]] = deque()

    def look(self, k: int, senses: Senses, targets: Array) -> Trigger | None:
        """At tick ``k``. ``targets`` are where the joints were told to be, without the share of torques."""
        leg, settings = self._leg, self._settings
        wanted = leg.ref.object_position[k], leg.ref.object_quat_wxyz[k]
        self.distance, self.angle = pose_error(leg, senses.position, senses.quat, *wanted)
        share = max(self.distance / settings.deviation_distance, self.angle / settings.deviation_turn)
        self._shares.append((senses.time, share))
        while self._shares[0][0] < senses.time - settings.sudden_within:
            self._shares.popleft()
        if share > 1.0:
            return Trigger(
                "deviation",
                f"the object is {1e3 * self.distance:.1f} mm and {np.degrees(self.angle):.1f} degrees off",
            )
        found = self._lost(k, senses) or self._stalled(senses, targets)
        self._count += 1
        if self._count % Monitor.EVERY == 0:
            found = self._slipped(k, senses) or found
        return found

    @property
    def is_sudden(self) -> bool:
        """True where the object was near where it should be a short time before the last look: a push, not a drift."""
        return bool(self._shares) and self._shares[0][1] <= self._settings.resume_share

    def is_back(self, k: int, senses: Senses, share: float, *, slips: bool = True) -> bool:
        """True where the leg may go on: the object is within ``share`` of what counts as a deviation, every joint within ``share`` of what
        counts as stalled, every holding finger feels the object, and, with ``slips``, no fingertip is beyond ``share`` of a slip."""
        leg, settings = self._leg, self._settings
        wanted = leg.ref.object_position[k], leg.ref.object_quat_wxyz[k]
        distance, angle = pose_error(leg, senses.position, senses.quat, *wanted)
        error = np.abs(senses.joints - leg.ref.joints[k])
        return bool(
            distance <= share * settings.deviation_distance
            and angle <= share * settings.deviation_turn
            and (error <= share * settings.stall_error + self._usual_error).all()
            and (senses.forces is None or (senses.forces >= settings.lost_force)[leg.ref.holds[k]].all())
            and not (slips and settings.slip_trigger and self.slip > share * settings.slip_distance)
        )

    def _lost(self, k: int, senses: Senses) -> Trigger | None:
        if senses.forces is None:
            return None
        away = self._leg.ref.holds[k] & (senses.forces < self._settings.lost_force)
        self._lost_since = np.where(away, np.fmin(self._lost_since, senses.time), np.nan)
        for f, since in enumerate(self._lost_since):
            if senses.time - since > self._settings.lost_after:
                return Trigger("lost_contact", f'finger "{self._leg.rig.fingers[f].name}" does not touch')
        return None

    def _stalled(self, senses: Senses, targets: Array) -> Trigger | None:
        error = np.abs(senses.joints - targets)
        self.joint_error = float(error.max(initial=0.0))
        far = error > self._settings.stall_error + self._usual_error
        self._stalled_since = np.where(far, np.fmin(self._stalled_since, senses.time), np.nan)
        for j, since in enumerate(self._stalled_since):
            if senses.time - since > self._settings.stall_after:
                name = self._leg.rig.joint_names[j]
                return Trigger("stalled_joint", f'joint "{name}" is {error[j]:.2f} from where it was told to be')
        return None

    def _slipped(self, k: int, senses: Senses) -> Trigger | None:
        leg = self._leg
        off = leg.slips(k, leg.tips(senses.joints), senses.position, senses.quat)
        holds = leg.ref.holds[k]
        self._baseline = np.where(holds[:, None], np.where(np.isnan(self._baseline), off, self._baseline), np.nan)
        moved = np.linalg.norm(np.where(holds[:, None], off - self._baseline, 0.0), axis=1)
        self.slip = float(np.nanmax(moved, initial=0.0))
        if self._settings.slip_trigger and self.slip > self._settings.slip_distance:
            finger = leg.rig.fingers[int(np.nanargmax(moved))].name
            return Trigger("slip", f'finger "{finger}" has slipped by {1e3 * self.slip:.1f} mm')
        return None


def why_gone(leg: Leg | None, senses: Senses, settings: ExecutorSettings) -> str:
    """Why the object is not in the hand any more; empty where it may be. A camera that errs while fingers feel the object is not
    believed."""
    n_felt = None if senses.forces is None else int((senses.forces > settings.lost_force).sum())
    if leg is None or senses.seen is None or (n_felt is not None and n_felt >= HOLDING):
        return ""
    felt = "" if n_felt is None else f", and {n_felt} fingers feel something"
    if senses.time - senses.good_stamp > settings.patience:
        return f"the object is out of sight{felt}" if n_felt is not None else ""
    position, quat = senses.seen
    center = position + rotation_matrices(quat) @ np.array(leg.rig.model.body_ipos[leg.rig.object_body])
    away = float(np.linalg.norm(leg.tips(senses.joints) - center, axis=1).min()) - leg.rig.radius
    if away > settings.gone_distance:
        return f"the object is {1e3 * away:.0f} mm away from all fingertips{felt}"
    return ""
