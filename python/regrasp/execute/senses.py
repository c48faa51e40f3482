"""What the executor believes of what it is told: observations without nonsense, and a pose of the object at every tick."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arguments import real_numbers
from ..simulate.reference import Array
from .estimate import PoseFilter
from .guards import BELIEVABLE, are_believable, real_number
from .leg import Leg
from .plant import Observation
from .settings import ExecutorSettings

#: A clock may be this far ahead of the plant's, in seconds.
AHEAD = 0.02
#: No clock says more seconds than this.
LATEST = 1e12


@dataclass(frozen=True)
class Fault:
    """Something wrong with an observation."""

    kind: str
    message: str


class Senses:
    """The newest joints and forces, and the filtered pose."""

    def __init__(self, n_joints: int, n_fingers: int, settings: ExecutorSettings) -> None:
        self._n_joints = n_joints
        self._n_fingers = n_fingers
        self._settings = settings
        self._filter: PoseFilter | None = None
        self._jumps = 0
        self._jump: tuple[Array, Array] | None = None
        self.time = 0.0
        self._has_time = False
        self.n_still = 0
        """Observations in a row without the plant's clock going on."""
        self.joints = np.zeros(n_joints)
        self.joint_change = np.zeros(n_joints)
        self.forces: Array | None = None
        self.good_stamp = -np.inf
        """Of the last pose that was believed."""
        self.seen: tuple[Array, Array] | None = None
        """The last pose that was seen, believed or not: position, and orientation w x y z."""
        self._seen_stamp = -np.inf
        self._has_joints = False

    @property
    def knows_pose(self) -> bool:
        """True from the first pose on."""
        return self._filter is not None

    @property
    def knows_joints(self) -> bool:
        """True since every joint was seen."""
        return self._has_joints

    @property
    def position(self) -> Array:
        """Of the object's origin in the world."""
        assert self._filter is not None
        return self._filter.position

    @property
    def quat(self) -> Array:
        """Orientation of the object, w x y z."""
        assert self._filter is not None
        return self._filter.quat

    def take(self, seen: Observation, leg: Leg | None, k: int) -> list[Fault]:
        """Takes an observation over; what is wrong with it is left out, and told."""
        faults: list[Fault] = []
        self._take_time(seen, faults)
        self._take_joints(seen, faults)
        self._take_forces(seen, faults)
        if self._filter is not None and leg is not None:
            self._filter.predict(self.time, *leg.object_motion(k, self.joint_change))
        elif self._filter is not None:
            self._filter.predict(self.time, np.zeros(3), np.zeros(3))
        if seen.pose_stamp is not None and seen.pose_stamp != self._seen_stamp:
            self._take_pose(seen, real_number(seen.pose_stamp), faults)
        if self._filter is not None and self.time - self.good_stamp > self._settings.stale_after:
            faults.append(Fault("stale_pose", f"the last pose believed is {self.time - self.good_stamp:.2f} s old"))
        return faults

    def _take_time(self, seen: Observation, faults: list[Fault]) -> None:
        now = real_number(seen.time)
        goes_on = not self._has_time or now > self.time
        if not abs(now) <= LATEST or (self._has_time and now < self.time):
            faults.append(Fault("bad_stamp", f"the plant's clock says {seen.time!r}, after {self.time}"))
            goes_on = False
        else:
            self.time, self._has_time = now, True
        self.n_still = 0 if goes_on else self.n_still + 1

    def _take_forces(self, seen: Observation, faults: list[Fault]) -> None:
        self.forces = None
        if seen.tip_forces is None:
            return
        forces = real_numbers(seen.tip_forces)
        if forces is None or forces.shape != (self._n_fingers,):
            was = "are no numbers" if forces is None else f"have shape {forces.shape}"
            faults.append(Fault("bad_forces", f"the forces of the fingertips {was}; expected {self._n_fingers} numbers"))
        elif are_believable(forces):
            self.forces = forces

    def _take_joints(self, seen: Observation, faults: list[Fault]) -> None:
        joints = real_numbers(seen.joints)
        self.joint_change = np.zeros(self._n_joints)
        if joints is None:
            faults.append(Fault("joints_missing", f"the joints are no list of numbers; expected {self._n_joints} of them"))
            return
        if joints.shape != (self._n_joints,):
            faults.append(Fault("joints_missing", f"{joints.size} joints were seen, of {self._n_joints}, in the shape {joints.shape}"))
            return
        good = np.abs(joints) <= BELIEVABLE
        if not good.all():
            missing = np.flatnonzero(~good).tolist()
            what = f"are beyond {BELIEVABLE:g}" if np.isfinite(joints).all() else "are no numbers"
            faults.append(Fault("joints_missing", f"joints {missing} {what}"))
        joints = np.where(good, joints, self.joints)
        if self._has_joints:
            self.joint_change = joints - self.joints
        self.joints = joints
        self._has_joints = self._has_joints or bool(good.all())

    def _take_pose(self, seen: Observation, stamp: float, faults: list[Fault]) -> None:
        settings = self._settings
        position, quat = real_numbers(seen.object_position), real_numbers(seen.object_quat_wxyz)
        if position is None or quat is None:
            faults.append(Fault("bad_pose", "the object's pose is no number"))
            return
        if position.shape != (3,) or quat.shape != (4,):
            shapes = f"the object's position has shape {position.shape}, and its quaternion {quat.shape}"
            faults.append(Fault("bad_pose", f"{shapes}; expected (3,) and (4,)"))
            return
        if not (are_believable(position) and are_believable(quat)):
            is_finite = np.isfinite(position).all() and np.isfinite(quat).all()
            faults.append(Fault("bad_pose", f"the object's pose is {f'beyond {BELIEVABLE:g}' if is_finite else 'no number'}"))
            return
        length = float(np.linalg.norm(quat))
        if not 0.9 < length < 1.1:
            faults.append(Fault("bad_pose", f"the object's quaternion has length {length:.3g}"))
            return
        if not np.isfinite(stamp) or stamp > self.time + AHEAD or stamp < self._seen_stamp:
            faults.append(Fault("bad_stamp", f"a pose is of {stamp:.3f} s, at {self.time:.3f} s"))
            return
        self._seen_stamp = stamp
        self.seen = position, quat / length
        if stamp < self.time - settings.stale_after:
            return
        if self._filter is None:
            self._filter = PoseFilter(position, quat / length, stamp, settings.pose_time_constant)
            self.good_stamp = stamp
            return
        shift, turn = self._filter.innovation(position, quat / length, stamp)
        if np.linalg.norm(shift) > settings.jump_distance or np.linalg.norm(turn) > settings.jump_turn:
            agrees = self._jump is not None and bool(
                np.linalg.norm(shift - self._jump[0]) < settings.jump_distance
                and np.linalg.norm(turn - self._jump[1]) < settings.jump_turn
            )
            self._jumps = self._jumps + 1 if agrees else 1
            self._jump = (shift, turn)
            faults.append(
                Fault(
                    "pose_jump",
                    f"the object is seen {1e3 * np.linalg.norm(shift):.0f} mm and {np.degrees(np.linalg.norm(turn)):.0f} degrees "
                    "from where it can be",
                )
            )
            if self._jumps >= settings.jump_count:
                # Often enough, and always the same: it is there.
                self._filter.restart(shift, turn, stamp)
                self.good_stamp = stamp
                self._jumps, self._jump = 0, None
            return
        self._jumps, self._jump = 0, None
        self._filter.correct(shift, turn, stamp)
        self.good_stamp = stamp
