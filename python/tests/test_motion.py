"""Motions of whole robots: planned, judged, written, replayed."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import regrasp
from conftest import SCENES

SCENE = SCENES / "two_arms/among_lamps.toml"


@pytest.fixture(scope="module", params=["swing", "carry"])
def moved(request: pytest.FixtureRequest) -> regrasp.RobotPlan:
    found = regrasp.plan_motion(SCENE, task=request.param)
    assert isinstance(found, regrasp.RobotPlan), str(found)
    return found


def test_a_motion_is_judged_and_read_back(moved: regrasp.RobotPlan, tmp_path: Path) -> None:
    assert moved.report is not None and moved.report.ok
    moved.save(tmp_path / "plan.json")
    again = regrasp.RobotPlan.from_file(tmp_path / "plan.json")
    assert again.document == moved.document
    assert again.joints.shape == (len(again.times), len(again.joint_names))
    assert again.check(SCENE).ok
    assert np.all(again.joint_velocities[[0, -1]] == 0.0)
    broken = dict(json.loads((tmp_path / "plan.json").read_text()))
    broken["segments"][0]["waypoints"][-1]["joints"][0] += 1e-3
    (tmp_path / "broken.json").write_text(json.dumps(broken))
    report = regrasp.RobotPlan.from_file(tmp_path / "broken.json").check(SCENE)
    assert not report.ok and "goal_mismatch" in {violation.kind for violation in report.violations}


def test_a_motion_is_exported(moved: regrasp.RobotPlan, tmp_path: Path) -> None:
    moved.to_npz(tmp_path / "plan.npz")
    arrays = np.load(tmp_path / "plan.npz", allow_pickle=False)
    assert np.array_equal(arrays["joints"], moved.joints) and np.array_equal(arrays["times"], moved.times)
    moved.to_ros2(tmp_path / "plan.yaml", SCENE)
    assert "joint_names" in (tmp_path / "plan.yaml").read_text()


def test_tasks_of_other_kinds_are_refused() -> None:
    with pytest.raises(regrasp.InputError, match="A510"):
        regrasp.plan_motion(SCENES / "sphere_90x.toml")
    assert not regrasp.plan(SCENE)


def test_servos_follow_a_motion(moved: regrasp.RobotPlan) -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate.robot import at, replay

    with pytest.warns(UserWarning, match="mass"):
        xml = moved.to_mjcf(SCENE)
    # At waypoints the reference is the waypoint.
    assert np.allclose(at(moved.document, moved.times), moved.joints, atol=1e-12)
    report = replay(moved.document, xml)
    assert report.followed, str(report)


def test_a_lenient_plan_is_replayed_leniently(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate.__main__ import main

    # Like the SRDF of a real robot that names links which its URDF lacks.
    shutil.copytree(SCENES.parent / "assets", tmp_path / "assets")
    robot = tmp_path / "assets/robots/two_arms/robot.toml"
    robot.write_text(robot.read_text().replace('urdf = "body.urdf"', 'urdf = "body.urdf"\nsrdf = "body.srdf"'))
    pair = '<disable_collisions link1="ghost" link2="nobody" reason="Never"/>'
    (robot.parent / "body.srdf").write_text(f'<robot name="two_arms">{pair}</robot>')
    scene = tmp_path / "scenes/two_arms/scene.toml"
    scene.parent.mkdir(parents=True)
    shutil.copy(SCENE, scene)

    plan = regrasp.plan_motion(regrasp.load_scene(scene, lenient=True), task="swing")
    assert isinstance(plan, regrasp.RobotPlan) and plan.report is not None and plan.report.ok
    path = scene.parent / "plan.json"
    plan.save(path)
    assert main([str(path), "--scene", str(scene)]) == 2
    assert "--lenient" in capsys.readouterr().err
    with pytest.warns(UserWarning, match="mass"):
        assert main([str(path), "--scene", str(scene), "--lenient"]) == 0
    assert "FOLLOWED" in capsys.readouterr().out
