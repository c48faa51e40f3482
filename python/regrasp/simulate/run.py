"""One replay from the plan to the report."""

from __future__ import annotations

from dataclasses import dataclass

from . import measure, replay
from .controllers import Controller
from .model import Rig, Settings, make_rig
from .plans import flat
from .reference import Plan, Reference, reference


@dataclass(frozen=True)
class Replay:
    """All there is to know about one replay."""

    rig: Rig
    reference: Reference
    track: replay.Track
    report: measure.Report


def simulate(plan: Plan, xml: str, settings: Settings | None = None, *, drift: replay.Drift | None = None) -> Replay:
    """Replays ``plan`` (as read from ``plan.json``) in the model ``xml`` (``regrasp export --mjcf``).

    The drift of a static hold is measured first, unless ``drift`` says what it is. Raises ``PlanError`` for a plan that
    cannot be replayed.
    """
    settings = settings or Settings()
    plan = flat(plan)
    rig = make_rig(xml, plan, settings)
    ref = reference(plan, tick=settings.tick, speed=settings.speed)
    controller = Controller(rig, ref, settings)
    gripped = replay.grip(rig, controller, settings)
    if drift is None and settings.hold_time > 0.0:
        drift = replay.hold(rig, ref, controller, gripped, settings)
    track = replay.replay(rig, ref, controller, gripped, settings)
    return Replay(rig, ref, track, measure.report(rig, ref, track, controller.torques, drift, settings))
