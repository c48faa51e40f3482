"""A whole run in one call."""

from __future__ import annotations

from collections.abc import Iterable

from .._model import Pose
from .._session import Session
from .executor import Executor
from .log import RunLog
from .plant import Plant
from .sessions import ExecutorSessions
from .settings import ExecutorSettings


def execute(
    plant: Plant,
    goals: Iterable[Pose | None],
    *,
    session: Session | None = None,
    settings: ExecutorSettings | None = None,
) -> RunLog:
    """Brings the object of ``plant`` to every goal, in order; as `Executor.run`.

    session: of the plant's scene; a plant in MuJoCo knows its scene. The planner then has the settings of execution. To keep the log of a run
    that raises, make an `Executor`.
    """
    if session is not None:
        return Executor(session, plant, settings).run(goals)
    scene = getattr(plant, "scene", None)
    if scene is None:
        raise ValueError('the plant has no member "scene": give a session, or use Executor.of(ExecutorSessions.of(scene), plant)')
    return Executor.of(ExecutorSessions.of(scene), plant, settings).run(goals)
