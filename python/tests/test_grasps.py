"""Grasp lists from Python: found, judged, saved, and tried in MuJoCo."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import regrasp

ROOT = Path(__file__).resolve().parents[2]
HANDS = ROOT / "assets" / "hands"
BOX = ROOT / "scenes" / "box_90x.toml"


@pytest.fixture(scope="module")
def grasps() -> regrasp.GraspList:
    return regrasp.list_grasps(HANDS / "wide_four_finger" / "hand.toml", BOX, grasps=4, seed=1)


def test_a_list_is_found_judged_and_read_back(grasps: regrasp.GraspList, tmp_path: Path) -> None:
    assert len(grasps) == 4
    assert grasps.joints.shape == grasps.open_joints.shape == (4, len(grasps.joint_names))
    assert grasps.held_joints == {}
    assert np.allclose(np.linalg.norm(grasps.poses[:, 3:], axis=1), 1.0)
    path = tmp_path / "grasps.json"
    grasps.save(path)
    assert regrasp.GraspList.load(path).to_dict() == grasps.to_dict()
    assert regrasp.check_grasps(path)["accepted"]


def test_broken_lists_are_rejected(grasps: regrasp.GraspList, tmp_path: Path) -> None:
    content = grasps.to_dict()
    content["grasps"][1]["contacts"][0]["point_in_object"][0] += 0.001
    path = tmp_path / "grasps.json"
    path.write_text(json.dumps(content))
    judged = regrasp.check_grasps(path)
    assert not judged["accepted"]
    assert judged["report"]["rejected"] == [1]


def test_the_dictionary_of_dexgraspbench_squeezes_beyond_the_grasp(grasps: regrasp.GraspList) -> None:
    arrays = grasps.to_dexgraspbench(squeeze=0.2)
    assert set(arrays) == {"pregrasp_qpos", "grasp_qpos", "squeeze_qpos"}
    before, at, beyond = (arrays[name][:, 7:] for name in ("pregrasp_qpos", "grasp_qpos", "squeeze_qpos"))
    assert np.allclose(beyond - at, 0.2 * (at - before))
    assert np.allclose(arrays["grasp_qpos"][:, 3], grasps.poses[:, 6])


def test_a_yaml_library_reads_isaac_files(grasps: regrasp.GraspList, tmp_path: Path, regrasp_cli) -> None:
    yaml = pytest.importorskip("yaml")
    grasps.save(tmp_path / "grasps.json")
    run = regrasp_cli("export", "grasps.json", "--isaac", "grasps.yaml")
    assert run.returncode == 0, run.stderr
    read = yaml.safe_load((tmp_path / "grasps.yaml").read_text())
    assert read["format"] == "isaac_grasp" and len(read["grasps"]) == len(grasps)
    for i, grasp in enumerate(read["grasps"].values()):
        pose = [*grasp["position"], *grasp["orientation"]["xyz"], grasp["orientation"]["w"]]
        assert np.allclose(pose, grasps.poses[i], atol=1e-6, rtol=0.0)
        for key, joints in (("cspace_position", grasps.joints), ("pregrasp_cspace_position", grasps.open_joints)):
            assert list(grasp[key]) == list(grasps.joint_names)
            assert np.allclose(list(grasp[key].values()), joints[i], atol=1e-6, rtol=0.0)


def test_no_grasp_says_why() -> None:
    with pytest.raises(regrasp.NoGrasps) as caught:
        regrasp.list_grasps(HANDS / "parallel_gripper" / "hand.toml", BOX, settings={"kind": "closing", "frames": 10, "margin": 0.9})
    assert caught.value.why


def test_a_gripper_of_which_one_motor_drives_both_jaws() -> None:
    found = regrasp.list_grasps(HANDS / "parallel_gripper" / "hand.toml", BOX, grasps=3, settings={"kind": "gripper"})
    assert found.joint_names == ["left_slide", "right_slide"]
    assert np.allclose(found.joints[:, 0], found.joints[:, 1])


def test_grasps_hold_in_simulation_and_those_without_forces_do_not(grasps: regrasp.GraspList, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate.grasps import OURS, THEIRS, GraspSettings, load, try_list

    path = tmp_path / "grasps.json"
    grasps.save(path)
    content, xml, notes = load(path)
    report = try_list(content, xml, notes=notes, most=3)
    assert report.share("shake", THEIRS) == (3, 3)
    assert report.share("shake", OURS)[0] >= 2
    held, tried = report.share("lift", THEIRS)
    assert held == tried
    loose = try_list(content, xml, GraspSettings(control="no_forces"), tests=("shake",), most=3)
    assert loose.share("shake", OURS)[0] == 0
    assert json.loads(json.dumps(report.to_json()))["shares"]["shake"]["tried"] == 3
