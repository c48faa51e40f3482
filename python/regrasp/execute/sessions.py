"""The sessions that execution plans with: one scene, opened with the settings of ``settings``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .._model import Scene
from .._session import Session
from .settings import ANEW, FIRM, NEAR, careful_settings, loose_settings, usual_settings, work_share


@dataclass(frozen=True)
class ExecutorSessions:
    """What `Executor` asks for plans, in the order of ``firm`` where the grip is firm, ``careful``, ``usual``, ``loose``."""

    usual: Session
    careful: tuple[Session, ...]
    """Those of `careful_settings`."""
    loose: Session
    """For starts that are worse than plans may be."""
    near: Session
    """For starts with links nearer to the object. It makes no plans."""
    firm: Session
    """A firmer grip."""
    anew: Session
    """Of grasps that hold well, where no plan leads on from the present one."""

    @classmethod
    def of(cls, scene: Scene) -> ExecutorSessions:
        """Of the first task of ``scene``. Errors: as of `Session`."""
        hand = next(hand for hand in scene.hands if hand.name_in_scene == scene.tasks[0].hand)
        moved = next(entry for entry in scene.objects if entry.name == scene.tasks[0].object)

        def opened(kind: Mapping[str, Any]) -> Session:
            return Session(scene, settings=planner_settings(kind, work_share(hand)))

        careful = tuple(opened(kind) for kind in careful_settings(moved))
        return cls(opened(usual_settings(moved)), careful, opened(loose_settings(moved)), opened(NEAR), opened(FIRM), opened(ANEW))


def planner_settings(settings: Mapping[str, Any], share: float) -> dict[str, Any]:
    """The same with so much of the work for better plans. How much a relocation is worth the planner knows by itself; plans that it calls long
    are shortened with 20,000 configurations at least."""
    return {**settings, "improve_work": round(share * settings["improve_work"])}
