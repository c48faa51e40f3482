"""Where the object is: a complementary filter of camera and fingers (Higgins 1975)."""

from __future__ import annotations

from collections import deque

import numpy as np

from ..simulate.reference import Array, quat_exp, quat_inverse, quat_product, rotation_vector

#: How far back poses are kept, in seconds: cameras are not later.
MEMORY = 1.0


class PoseFilter:
    """Fast motion as the holding fingers make it, slow errors as the camera sees them.

    A pose that arrives late corrects the estimate of the moment at which it was seen, and all since.
    """

    def __init__(self, position: Array, quat_wxyz: Array, stamp: float, time_constant: float) -> None:
        self.position = np.array(position, dtype=np.float64)
        self.quat = np.array(quat_wxyz, dtype=np.float64)
        self._time_constant = time_constant
        self._last_stamp = stamp
        self._past: deque[tuple[float, Array, Array]] = deque()

    def predict(self, time: float, shift: Array, turn: Array) -> None:
        """The fingers have moved the object's origin by ``shift`` and turned it by the rotation vector ``turn``."""
        self.position = self.position + shift
        self.quat = _unit(quat_product(quat_exp(turn), self.quat))
        self._past.append((time, self.position, self.quat))
        while self._past and self._past[0][0] < time - MEMORY:
            self._past.popleft()

    def innovation(self, position: Array, quat_wxyz: Array, stamp: float) -> tuple[Array, Array]:
        """How far a pose seen at ``stamp`` is from the estimate of that moment."""
        then_position, then_quat = self._at(stamp)
        return position - then_position, rotation_vector(quat_product(_unit(quat_wxyz), quat_inverse(then_quat)))

    def correct(self, shift: Array, turn: Array, stamp: float) -> None:
        """Takes a share of an innovation over."""
        share = 1.0 - np.exp(-max(stamp - self._last_stamp, 0.0) / self._time_constant)
        self._last_stamp = stamp
        self._move(share * shift, share * turn)

    def restart(self, shift: Array, turn: Array, stamp: float) -> None:
        """Takes all of an innovation over."""
        self._last_stamp = stamp
        self._move(shift, turn)

    def _at(self, stamp: float) -> tuple[Array, Array]:
        best = (self.position, self.quat)
        for time, position, quat in reversed(self._past):
            best = (position, quat)
            if time <= stamp:
                break
        return best

    def _move(self, shift: Array, turn: Array) -> None:
        by = quat_exp(turn)
        self.position = self.position + shift
        self.quat = _unit(quat_product(by, self.quat))
        if not self._past:
            return
        times, positions, quats = zip(*self._past)
        # All at once, and to the last digit what one by one gives: the past has 250 poses, and a camera 30 images in a second.
        turned = quat_product(by, np.array(quats))
        lengths = np.sqrt(np.matmul(turned[:, None, :], turned[:, :, None]))[:, 0]
        self._past = deque(zip(times, np.array(positions) + shift, turned / lengths))


def _unit(quat: Array) -> Array:
    return quat / np.linalg.norm(quat)
