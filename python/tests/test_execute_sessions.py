"""How much is planned for a leg, by hand."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import regrasp
from regrasp.execute.planning import ChargedPlanning
from regrasp.execute.sessions import ExecutorSessions, planner_settings
from regrasp.execute.settings import (
    ANEW,
    CAREFUL,
    CAREFUL_ROUND,
    CLEAR_ROUND,
    EDGED,
    FIRM,
    FIRMER,
    LOOSE,
    LOOSE_EDGED,
    NEAR,
    MESH_TIPS,
    PLANNER,
    ExecutorSettings,
    work_share,
)

ROOT = Path(__file__).parents[2]
MODELS = Path(os.environ.get("REGRASP_MODELS", ROOT.parent / "shared/models"))
needs_models = pytest.mark.skipif(not MODELS.is_dir(), reason="SKIPPED: no shared models")


class Counted:
    """A session whose every plan takes the same work."""

    times = None

    def __init__(self, hand: Any, plan: regrasp.Plan, work: int) -> None:
        self.hand, self.plans = hand, 0
        statistics = {**plan.statistics, "work": work, "relocations": 3}
        self._plan = plan
        vars(plan)["statistics"] = statistics

    def plan(self, *_: Any, **__: Any) -> regrasp.Plan:
        self.plans += 1
        return self._plan


def with_tips(hand: regrasp.Hand, surface: str) -> Any:
    fingers = [replace(finger, tip=replace(finger.tip, surface=surface)) for finger in hand.fingers]
    return SimpleNamespace(fingers=fingers)


def test_hands_with_mesh_tips_get_an_eighth_of_the_work_for_more_plans() -> None:
    scene = regrasp.load_scene(ROOT / "scenes/box_90x.toml")
    hand = scene.hands[0]
    assert work_share(hand) == 1.0
    for surface, share in (("sphere", 1.0), ("ellipsoid", 1.0), ("smooth_hull", 1.0 / MESH_TIPS)):
        own = with_tips(hand, surface)
        assert work_share(own) == share
        plan = regrasp.plan(scene, seed=1)
        assert isinstance(plan, regrasp.Plan)
        session: Any = Counted(own, plan, 10_000)
        settings = ExecutorSettings(choices=1000, choice_work=400_000, threads=1)
        planning = ChargedPlanning([session], settings, lambda _, __: None)
        start: Any = None
        ticket = planning.ask(start, regrasp.Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])), 0, 7.0)
        # As many plans as fit in the work, and time that is charged at the hand's rate.
        assert session.plans == 400_000 * share / 10_000
        charged = session.plans * 10_000 / (share * settings.work_rate) + settings.planning_overhead
        assert ticket.ready_at == pytest.approx(7.0 + charged)


@pytest.mark.parametrize(
    ("name", "careful", "usual", "loose"),
    [
        # An object with edges is gripped with 6 N by every plan; a round one with 4 N where it may have to be, after a miss.
        ("box_90x", (CAREFUL, EDGED, FIRMER), FIRMER, LOOSE_EDGED),
        ("sphere_90x", (CLEAR_ROUND, CAREFUL_ROUND, FIRMER), PLANNER, LOOSE),
    ],
)
def test_sessions_of_a_scene_have_the_settings_of_execution(
    name: str, careful: tuple[dict[str, Any], ...], usual: dict[str, Any], loose: dict[str, Any]
) -> None:
    scene = regrasp.load_scene(ROOT / f"scenes/{name}.toml")
    sessions = ExecutorSessions.of(scene)
    plan = regrasp.plan(scene, seed=1)
    assert isinstance(plan, regrasp.Plan)
    assert len(sessions.careful) == len(careful)
    others = [(sessions.usual, usual), (sessions.loose, loose), (sessions.near, NEAR), (sessions.firm, FIRM), (sessions.anew, ANEW)]
    for session, least in [*zip(sessions.careful, careful), *others]:
        start = session.project(regrasp.Pose(plan.object_positions[-1], plan.object_quat_xyzw[-1]), plan.joints[-1])
        assert start
        back = regrasp.Pose(plan.object_positions[0], plan.object_quat_xyzw[0])
        found = session.plan(start, back, seed=3, max_work=200_000)
        assert isinstance(found, regrasp.Plan), found
        for key in ("improve_work", "shorten_relocation", "search_work"):
            assert found.settings[key] == least[key]
        assert found.settings["friction_margin"] == least.get("friction_margin", 1.5)
        assert found.settings["clearance"] == least.get("clearance", 0.0002)
        assert found.settings["edge_margin"] == least.get("edge_margin", 0.0)
        assert found.settings["closure_margin"] == least.get("closure_margin", 0.005)
        assert found.settings["end_margin"] == least.get("end_margin", 0.0)
        assert found.settings["forces"]["squeeze"] == least.get("forces", {"squeeze": 4.0})["squeeze"]


def test_only_the_work_for_better_plans_is_shared() -> None:
    assert planner_settings(CAREFUL, 0.125) == {**CAREFUL, "improve_work": 7500}


@needs_models
def test_the_leap_hand_has_mesh_tips_and_the_allegro_hand_has_not() -> None:
    for urdf, surface in (("leap/leap_right.urdf", "smooth_hull"), ("allegro/allegro_right.urdf", "sphere")):
        hand = regrasp.load_hand(MODELS / "hands" / urdf)
        assert {finger.tip.surface for finger in hand.fingers} == {surface}
