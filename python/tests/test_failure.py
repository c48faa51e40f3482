"""Not to find a plan is a result."""

from __future__ import annotations

import re
import time

import regrasp
from conftest import REPOSITORY, SCENES


def test_a_search_that_runs_out_of_work_says_why() -> None:
    scene = regrasp.load_scene(SCENES / "box_180x.toml")
    failure = regrasp.plan(scene, max_work=2_000)
    assert isinstance(failure, regrasp.Failure)
    assert not failure and not failure.ok and failure.kind == "work_spent"
    assert sum(cause.count for cause in failure.causes) > 0
    assert abs(sum(cause.share for cause in failure.causes) - 1) < 1e-9
    assert failure.statistics["work"] >= 2_000 and not failure.statistics["cut_by_time"]
    assert failure.nearest_miss is not None and 0 < failure.nearest_miss.angle_left < 3.2
    assert len(failure.nearest_miss.joints) == len(scene.hand.joints)
    text = str(failure)
    assert failure.message in text and failure.causes[0].reason in text and failure.advice in text
    assert "<table>" in failure._repr_html_()


def test_a_time_limit_cuts() -> None:
    scene = regrasp.load_scene(SCENES / "box_180x.toml")
    started = time.monotonic()
    failure = regrasp.plan(scene, time_limit=0.001)
    assert isinstance(failure, regrasp.Failure) and failure.kind == "time_limit"
    assert failure.statistics["cut_by_time"]
    assert time.monotonic() - started < 5


def test_an_invalid_goal_is_named_before_any_search(tmp_path) -> None:
    hand = REPOSITORY / "assets/hands/wide_four_finger"
    for name in ("hand.toml", "hand.urdf"):
        (tmp_path / name).write_bytes((hand / name).read_bytes())
    path = tmp_path / "scene.toml"
    path.write_text(
        """format = "regrasp-scene"
format_version = 1
task = "in_hand"
hand = { file = "hand.toml" }
object = { name = "ball", sphere = { radius = 0.032 }, mass = 0.1, friction = 0.8 }
start = { position = [0.0, 0.0, 0.078] }
goal = { turn = { axis = "x", angle_deg = 90 } }
obstacles = [{ name = "wall", box = { size = [0.01, 0.01, 0.01] }, position = [0.0, 0.0, 0.078] }]
"""
    )
    failure = regrasp.plan(path)
    assert isinstance(failure, regrasp.Failure)
    assert failure.kind in ("start_invalid", "goal_invalid"), str(failure)
    assert "wall" in failure.message
    assert failure.statistics["work"] <= 1


def test_a_task_of_a_robot_says_where_it_came_nearest() -> None:
    """The posture, the two bodies that meet, the hand that is wanted elsewhere."""
    scenes = SCENES / "two_arms"
    failure = regrasp.plan_pick_and_place(scenes / "impossible_start.toml")
    assert isinstance(failure, regrasp.Failure)
    miss = failure.robot_miss
    assert miss is not None and miss.bodies is not None
    assert all(body.name in str(failure) for body in miss.bodies), str(failure)
    assert {body.kind for body in miss.bodies} <= {"link", "carried", "resting"}

    failure = regrasp.plan_pick_and_place(scenes / "impossible_reach.toml")
    assert isinstance(failure, regrasp.Failure)
    miss = failure.robot_miss
    assert miss is not None and miss.bodies is None and len(miss.joints) == 42 and miss.world_from_object is not None
    hand = miss.wanted[0]
    # The message says how far the wrist would be from the shoulder at least; it does not get nearer than that.
    least = float(re.search(r"would be (\d+\.\d+) m too far", str(failure))[1])  # type: ignore[index]
    away = sum((a - b) ** 2 for a, b in zip(hand.wrist_at, hand.wrist_wanted, strict=True)) ** 0.5
    assert hand.hand == "left" and away >= least - 1e-3

    # In the hand there is none.
    assert regrasp.plan(SCENES / "box_180x.toml", max_work=2_000).robot_miss is None
