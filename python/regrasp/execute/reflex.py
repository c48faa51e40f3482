"""A grip that becomes firmer where fingertips feel a sudden change."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from ..simulate.reference import Array
from .leg import Leg
from .monitor import HOLDING
from .settings import ExecutorSettings

#: Looks over which a change counts: 12 ms at ticks of 4 ms.
LOOKS = 4


class Reflex:
    """Presses harder for a while where the normal force of a holding fingertip changes at once, other than planned.

    People do so 60 to 100 ms after an object that they hold is loaded (Johansson, Westling 1984). A controller need not wait so long.
    """

    def __init__(self, settings: ExecutorSettings) -> None:
        self._settings = settings
        self._felt: deque[tuple[Leg, Array, Array, float]] = deque(maxlen=LOOKS)
        """Leg, forces felt, forces planned, and how much harder was pressed then."""
        self._until = -np.inf
        self._last = 0.0
        self.extra = 0.0
        """How much harder fingers press than planned, in shares of that."""

    def look(self, time: float, leg: Leg, k: int, forces: Array | None, *, blends: bool) -> bool:
        """At tick ``k`` of a leg; true where a change is felt, but for one that is felt already. blends: commands still pass from the leg before."""
        settings = self._settings
        if forces is None or settings.reflex_press <= 0.0:
            return False
        was_quiet = self.extra == 0.0
        if self._felt and self._felt[-1][0] is not leg:
            self._felt.clear()
        self._felt.append((leg, forces, leg.normal_forces[k], self.extra))
        # What the reflex itself changes is none.
        if len(self._felt) == LOOKS and not blends and all(look[3] == self.extra for look in self._felt) and self._changes(leg.ref.holds[k]):
            self._until = time + settings.reflex_time
            self.extra = settings.reflex_press
        elif time > self._until:
            self.extra = max(0.0, self.extra - settings.reflex_press * (time - self._last) / settings.reflex_release)
        self._last = time
        return was_quiet and self.extra > 0.0

    def _changes(self, holds: NDArray[np.bool_]) -> bool:
        """True where a holding finger feels more of a change than is planned, and than forces that change as planned miss their plan by. Where
        fewer than two feel anything, before or now, it is the sensors, or the object is gone."""
        first, last = self._felt[0], self._felt[-1]
        planned = last[2] - first[2]
        beyond = np.abs(last[1] - first[1] - planned)[holds].max(initial=0.0)
        n_felt = int((np.minimum(first[1], last[1]) > self._settings.lost_force).sum())
        return bool(n_felt >= HOLDING and beyond > self._settings.reflex_force + np.abs(planned).max())
