"""Not to find a plan is a result."""

from __future__ import annotations

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
