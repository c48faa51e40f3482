"""Scenes of two hands, two objects and a support."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import regrasp
from conftest import REPOSITORY


@pytest.fixture(scope="module")
def two_hands(tmp_path_factory: pytest.TempPathFactory) -> regrasp.Scene:
    """The scene that the Rust tests use."""
    text = (REPOSITORY / "tests/support/two_hands.rs").read_text()
    found = re.search(r'r#"(.*)"#;', text, re.DOTALL)
    assert found is not None
    hand = REPOSITORY / "assets/hands/wide_four_finger/hand.toml"
    path: Path = tmp_path_factory.mktemp("scenes") / "two_hands.toml"
    path.write_text(found[1].replace('"hand.toml"', json.dumps(str(hand))))
    return regrasp.load_scene(path)


@pytest.fixture(scope="module")
def plans(two_hands: regrasp.Scene) -> list[regrasp.Plan]:
    """One plan for each task."""
    found = [regrasp.plan(two_hands, task=task.name) for task in two_hands.tasks]
    return [plan for plan in found if isinstance(plan, regrasp.Plan)]


def test_everything_has_its_name(two_hands: regrasp.Scene) -> None:
    assert [hand.name_in_scene for hand in two_hands.hands] == ["right", "left"]
    assert [each.name for each in two_hands.objects] == ["ball", "box"]
    assert [each.name for each in two_hands.supports] == ["table"]
    assert [each.name for each in two_hands.obstacles] == ["lamp"]
    assert [(task.name, task.kind, task.hand, task.object) for task in two_hands.tasks] == [
        ("turn_ball", "in_hand", "right", "ball"),
        ("turn_box", "in_hand", "left", "box"),
    ]
    assert two_hands.hand is two_hands.hands[0] and two_hands.object is two_hands.objects[0]
    assert "left (" in repr(two_hands) and "'box'" in repr(two_hands) and "1 supports" in repr(two_hands)


def test_tasks_are_asked_for_by_name(two_hands: regrasp.Scene) -> None:
    for task, each in zip(two_hands.tasks, two_hands.objects):
        query = two_hands.query(3, task=task.name)
        np.testing.assert_array_equal(query.start.matrix, each.world_from_object.matrix)
    with pytest.raises(regrasp.InputError, match="A510"):
        two_hands.query(task="turn_lamp")
    with pytest.raises(regrasp.InputError, match="A510"):
        regrasp.plan(two_hands, task="turn_lamp")


def test_plans_name_hand_object_and_holders(two_hands: regrasp.Scene, plans: list[regrasp.Plan]) -> None:
    assert [(plan.query, plan.hand, plan.object) for plan in plans] == [
        ("turn_ball", "right", "ball"),
        ("turn_box", "left", "box"),
    ]
    for plan in plans:
        assert all(segment.held_by == (plan.hand,) for segment in plan.segments)
        assert regrasp.check(plan, two_hands)


def test_tips_of_every_hand_are_in_the_world(two_hands: regrasp.Scene, plans: list[regrasp.Plan]) -> None:
    for hand, plan in zip(two_hands.hands, plans):
        tips = hand.tips(plan.joints)
        holds = plan.contact_modes != 0
        away = np.linalg.norm(tips - plan.object_positions[:, None, :], axis=2)
        # Fingertips that hold an object of 32 mm, or of half a diagonal of 46 mm, are beside it.
        assert holds.any() and (away[holds] < 0.07).all()


def test_both_hands_replay(two_hands: regrasp.Scene, plans: list[regrasp.Plan]) -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate import Settings, simulate

    for plan in plans:
        with pytest.warns(UserWarning, match="stands on no support"):
            xml = regrasp.export_mjcf(plan, two_hands)
        result = simulate(json.loads(plan.to_json()), xml, Settings(controller="C2", hold_time=0.0))
        report = result.report
        assert report.kept, (plan.query, report.dropped)
        assert report.final_position_error < 0.002 and report.final_angle_error < np.radians(2.0)
        # Servos hold the other hand, and a weld the other object.
        rig, qpos = result.rig, result.track.qpos
        moved = {int(rig.model.jnt_qposadr[rig.model.joint(name).id]) for name in rig.joint_names}
        moved |= set(range(rig.object_qpos, rig.object_qpos + 7))
        rests = [k for k in range(rig.model.nq) if k not in moved]
        assert len(rests) == 12 + 7
        assert np.abs(qpos[:, rests] - rig.model.key_qpos[0][rests]).max() < 2e-3
