"""Plans: the same bytes everywhere, arrays that say what the file says."""

from __future__ import annotations

import json
import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import regrasp
from conftest import REPOSITORY, SCENES


def test_the_same_bytes_as_the_command_line(regrasp_cli, tmp_path: Path, scene: regrasp.Scene) -> None:
    run = regrasp_cli("plan", SCENES / "sphere_90x.toml", "--seed", "11", "-o", "cli.json")
    assert run.returncode == 0, run.stderr
    plan = regrasp.plan(scene, seed=11)
    assert plan
    plan.save(tmp_path / "python.json")
    written = (tmp_path / "cli.json").read_bytes()
    assert (tmp_path / "python.json").read_bytes() == written == plan.to_json()
    assert regrasp.Plan.from_file(tmp_path / "cli.json") == plan
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cli.json", "python.json"], "nothing else is left behind"


def test_arrays_say_what_the_file_says(plan: regrasp.Plan) -> None:
    file = json.loads(plan.to_json())
    waypoints = [waypoint for segment in file["segments"] for waypoint in segment["waypoints"]]
    assert [(hand["name"], hand["fingers"], hand["joint_names"]) for hand in file["hands"]] == [
        (plan.hand, list(plan.fingers), list(plan.joint_names))
    ]
    assert file["objects"] == [plan.object]
    # Free fingers have no entry.
    free = {"mode": "free"}
    touching = [{contact["finger"]: contact for contact in w["contacts"]} for w in waypoints]
    contacts = [[named.get(finger, free) for finger in plan.fingers] for named in touching]
    n, j, f = len(waypoints), len(plan.joint_names), len(plan.fingers)
    np.testing.assert_array_equal(plan.times, [w["time"] for w in waypoints])
    np.testing.assert_array_equal(plan.joints, [w["joints"] for w in waypoints])
    np.testing.assert_array_equal(plan.joint_velocities, [w["joint_velocities"] for w in waypoints])
    np.testing.assert_array_equal(plan.object_positions, [w["world_from_objects"][0]["position"] for w in waypoints])
    np.testing.assert_array_equal(plan.object_quat_xyzw, [w["world_from_objects"][0]["quat_xyzw"] for w in waypoints])
    torques = [w.get("joint_torques") for w in waypoints]
    if plan.joint_torques is None:
        assert torques == [None] * n
    else:
        np.testing.assert_array_equal(plan.joint_torques, torques)
    nan = [np.nan] * 3
    for name, array in [
        ("point_in_object", plan.contact_points_in_object),
        ("normal_in_object", plan.contact_normals_in_object),
        ("force_in_object", plan.contact_forces_in_object),
    ]:
        expected = [[contact.get(name) or nan for contact in row] for row in contacts]
        np.testing.assert_array_equal(array, expected)
    torsions = [[contact.get("torsion", np.nan) for contact in row] for row in contacts]
    np.testing.assert_array_equal(plan.contact_torsions, torsions)
    modes = [[contact["mode"] for contact in row] for row in contacts]
    assert [[regrasp.CONTACT_MODES[mode] for mode in row] for row in plan.contact_modes] == modes
    assert plan.joints.shape == (n, j) and plan.contact_points_in_object.shape == (n, f, 3)
    for segment, entry in zip(plan.segments, file["segments"], strict=True):
        assert (segment.kind, segment.moving) == (entry["kind"], tuple(entry.get("moving", ())))
        assert segment.rolling_finger == entry.get("rolling_finger")
        assert entry["held_by"] == {plan.object: list(segment.held_by)}
        assert plan.times[segment.slice].tolist() == [w["time"] for w in entry["waypoints"]]
    assert all(plan.segments[s].start <= k < plan.segments[s].stop for k, s in enumerate(plan.segment_of_waypoint))
    for name in ("promises", "statistics", "settings", "seed", "method", "tool"):
        assert getattr(plan, name) == file[name], name


def test_arrays_are_doubles_in_c_order_and_cannot_be_written(plan: regrasp.Plan) -> None:
    for array in (plan.times, plan.joints, plan.contact_points_in_object):
        assert array.dtype == np.float64 and array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


def test_plans_do_not_depend_on_threads(box: regrasp.Scene) -> None:
    alone = regrasp.plan(box, seed=2)
    assert alone and regrasp.plan(box, seed=2, threads=4) == alone
    assert regrasp.plan(box, seed=3) != alone


def test_thirty_two_threads_plan_at_once(scene: regrasp.Scene, box: regrasp.Scene) -> None:
    """No deadlock, with searches that are threaded themselves and callbacks into Python, and the same bytes as alone."""
    heard: list[regrasp.Progress] = []

    def solve(k: int) -> bytes:
        chosen = (scene, box)[k % 2]
        found = regrasp.plan(chosen, seed=k % 6, threads=1 + k % 3, progress=heard.append)
        assert found, str(found)
        return found.to_json()

    with ThreadPoolExecutor(max_workers=32) as pool:
        at_once = list(pool.map(solve, range(128), timeout=300))
    assert at_once == [solve(k % 6) for k in range(128)]


def test_pickles_are_the_bytes_of_the_file(plan: regrasp.Plan) -> None:
    assert plan.to_json() in pickle.dumps(plan)
    assert pickle.loads(pickle.dumps(plan)) == plan


def test_a_plan_is_shown_in_a_notebook(plan: regrasp.Plan) -> None:
    assert "closure margin" in repr(plan)
    table = regrasp.Plan.from_json(plan.to_json())._repr_html_()
    assert table.count("<tr>") == 1 + len(plan.segments)
    hostile = plan.to_json().replace(b'"north"', b'"<script>alert(1)</script>"')
    named = regrasp.Plan.from_json(hostile)
    assert "<script>alert(1)</script>" in named.fingers
    assert "<script>" not in named._repr_html_()


def test_settings_of_a_plan_make_it_again(box: regrasp.Scene) -> None:
    first = regrasp.plan(box, seed=4, settings={"closure_margin": 0.01, "cost": {"relocation": 2.0}}, margin=0.02)
    assert first and first.promises["required_margin"] == 0.02
    assert first.settings["cost"]["relocation"] == 2.0
    assert regrasp.plan(box, seed=4, settings=first.settings) == first


def test_improvement_by_work_is_in_the_plan(box: regrasp.Scene) -> None:
    better = regrasp.plan(box, seed=4, improve_work=30_000)
    assert better and better.statistics["improvement"]["improved"]["cost"] <= better.statistics["improvement"]["first"]["cost"]


def test_a_scene_file_plans_too() -> None:
    plan = regrasp.plan(SCENES / "sphere_90x.toml")
    assert plan and plan.report is not None and plan.report.ok
    assert regrasp.check(plan).ok


def test_tracking_tasks_are_planned_and_judged() -> None:
    scene = regrasp.load_scene(SCENES / "football.toml")
    plan = regrasp.plan(scene, seed=1)
    assert plan, str(plan)
    assert regrasp.check(plan, scene)
    used = {regrasp.CONTACT_MODES[mode] for mode in np.unique(plan.contact_modes)}
    assert {"rolling", "pure_rolling", "sliding"} <= used
    with pytest.raises(regrasp.InputError, match="goal_weight"):
        regrasp.plan(scene, settings={"goal_weight": -1})
    on_path = plan.statistics["transfers"]
    assert f"over {on_path} sub-goals" in repr(plan) and "transfer" not in repr(plan)


@pytest.mark.parametrize("argument", [{"method": "gait"}, {"margin": 0.01}, {"improve": 1}, {"improve_work": 10}])
def test_arguments_of_in_hand_tasks_are_refused_for_tracking(argument: dict[str, Any]) -> None:
    scene = regrasp.load_scene(SCENES / "football.toml")
    with pytest.raises(regrasp.InputError, match="tracking") as caught:
        regrasp.plan(scene, **argument)
    (name,) = argument
    assert caught.value.code == "A507" and name in caught.value.element and caught.value.fix


def test_joints_that_stand_still_are_in_the_plan_and_in_what_is_exported(tmp_path: Path) -> None:
    hand = REPOSITORY / "assets/hands/nine_motors/hand.urdf"
    lines = [
        'format = "regrasp-scene"\nformat_version = 1\ntask = "in_hand"',
        f'[hand]\nfile = "{hand}"',
        '[object]\nname = "ball"\nsphere = { radius = 0.06 }\nmass = 0.1\nfriction = 0.8',
        '[start]\nposition = [0.0821, 0.0279, 0.1264]\n[goal]\nturn = { axis = "z", angle_deg = 90 }\n',
    ]
    (tmp_path / "scene.toml").write_text("\n".join(lines))
    plan = regrasp.plan(tmp_path / "scene.toml", hold=True)
    assert isinstance(plan, regrasp.Plan), plan
    # By the URDF: the middle of what the motors' own limits and those of their followers leave.
    stand = {"finger_spread": 0.29, "thumb_opposition": 0.49}
    assert plan.held_joints == stand
    assert json.loads(plan.to_json())["hands"][0]["held_joints"] == stand
    assert regrasp.Plan.from_json(plan.to_json()).held_joints == stand
    assert '"finger_spread" at 0.29, "thumb_opposition" at 0.49' in plan.to_ros2()
    plan.to_npz(tmp_path / "plan.npz")
    with np.load(tmp_path / "plan.npz", allow_pickle=False) as arrays:
        assert dict(zip(arrays["held_joint_names"].tolist(), arrays["held_joints"].tolist())) == stand
    elsewhere = plan.to_json().replace(b'"finger_spread":0.29', b'"finger_spread":0.3')
    report = regrasp.check(regrasp.Plan.from_json(elsewhere), tmp_path / "scene.toml", hold=True)
    assert not report and [violation.kind for violation in report.violations] == ["wrong_scene"]
