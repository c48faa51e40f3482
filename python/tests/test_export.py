"""Exports, read by those who read them: numpy and PyYAML."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import regrasp
from conftest import SCENES

# trajectory_msgs/JointTrajectory and what it is made of, as `ros2 interface show` prints them. Sizes of integers in bits.
MESSAGES: dict[str, dict[str, str]] = {
    "builtin_interfaces/Time": {"sec": "int32", "nanosec": "uint32"},
    "builtin_interfaces/Duration": {"sec": "int32", "nanosec": "uint32"},
    "std_msgs/Header": {"stamp": "builtin_interfaces/Time", "frame_id": "string"},
    "trajectory_msgs/JointTrajectoryPoint": {
        "positions": "float64[]",
        "velocities": "float64[]",
        "accelerations": "float64[]",
        "effort": "float64[]",
        "time_from_start": "builtin_interfaces/Duration",
    },
    "trajectory_msgs/JointTrajectory": {
        "header": "std_msgs/Header",
        "joint_names": "string[]",
        "points": "trajectory_msgs/JointTrajectoryPoint[]",
    },
}


def hold_to_message(value: Any, kind: str, place: str = "message") -> None:
    """Fails where `value` is no message of this kind: another key, another type, out of range."""
    if kind.endswith("[]"):
        assert isinstance(value, list), place
        for k, entry in enumerate(value):
            hold_to_message(entry, kind[:-2], f"{place}[{k}]")
    elif kind == "string":
        assert isinstance(value, str), place
    elif kind == "float64":
        assert isinstance(value, float) and math.isfinite(value), f"{place} is {value!r}"
    elif kind in ("int32", "uint32"):
        low, high = (-(2**31), 2**31) if kind == "int32" else (0, 2**32)
        assert type(value) is int and low <= value < high, f"{place} is {value!r}"
    else:
        assert isinstance(value, dict) and value.keys() == MESSAGES[kind].keys(), f"{place} has {list(value)}"
        for name, inner in MESSAGES[kind].items():
            hold_to_message(value[name], inner, f"{place}.{name}")


def test_the_schema_refuses_what_is_no_message() -> None:
    point = {"positions": [0.1], "velocities": [], "accelerations": [], "effort": []}
    for broken in (
        {**point},
        {**point, "time_from_start": {"sec": 0, "nanosec": -1}},
        {**point, "time_from_start": {"sec": 0.5, "nanosec": 0}},
        {**point, "time_from_start": {"sec": 0, "nanosec": 0}, "positions": ["0.1"]},
    ):
        with pytest.raises(AssertionError):
            hold_to_message(broken, "trajectory_msgs/JointTrajectoryPoint")


def test_the_trajectory_is_a_message_and_says_what_the_plan_says(plan: regrasp.Plan, tmp_path: Path) -> None:
    yaml = pytest.importorskip("yaml")
    text = plan.to_ros2(tmp_path / "plan.yaml")
    assert (tmp_path / "plan.yaml").read_text() == text == plan.to_ros2()
    message = yaml.safe_load(text)
    hold_to_message(message, "trajectory_msgs/JointTrajectory")
    assert message["joint_names"] == list(plan.joint_names)
    times = [point["time_from_start"]["sec"] * 10**9 + point["time_from_start"]["nanosec"] for point in message["points"]]
    assert all(a < b for a, b in zip(times, times[1:])), "controllers demand that times increase"
    assert all(point["time_from_start"]["nanosec"] < 10**9 for point in message["points"])
    # Of the waypoints at one time the last is written.
    kept = np.append(np.diff(plan.times) > 0, True)
    np.testing.assert_allclose(np.array(times) * 1e-9, plan.times[kept], rtol=0, atol=1e-9)
    np.testing.assert_array_equal([point["positions"] for point in message["points"]], plan.joints[kept])
    np.testing.assert_array_equal([point["velocities"] for point in message["points"]], plan.joint_velocities[kept])
    efforts = [point["effort"] for point in message["points"]]
    if plan.joint_torques is None:
        assert efforts == [[]] * len(efforts)
    else:
        np.testing.assert_array_equal(efforts, plan.joint_torques[kept])


def test_numpy_reads_the_arrays_without_pickle(plan: regrasp.Plan, tmp_path: Path) -> None:
    path = tmp_path / "plan.npz"
    content = plan.to_npz(path)
    assert path.read_bytes() == content == plan.to_npz()
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    assert all(array.dtype.kind in "fiuU" for array in arrays.values())
    for name in (
        "times",
        "joints",
        "joint_velocities",
        "object_positions",
        "object_quat_xyzw",
        "contact_modes",
        "contact_points_in_object",
        "contact_normals_in_object",
        "contact_forces_in_object",
        "contact_torsions",
        "segment_of_waypoint",
    ):
        np.testing.assert_array_equal(arrays[name], getattr(plan, name), err_msg=name)
    assert arrays["joint_names"].tolist() == list(plan.joint_names)
    assert arrays["fingers"].tolist() == list(plan.fingers)
    assert arrays["contact_mode_names"].tolist() == list(regrasp.CONTACT_MODES)
    assert (arrays["format"].item(), arrays["format_version"].item()) == ("regrasp-arrays", 1)
    assert (arrays["tool"].item(), arrays["method"].item(), arrays["seed"].item()) == (plan.tool, plan.method, plan.seed)
    starts = arrays["segment_starts"].tolist()
    assert starts == [segment.start for segment in plan.segments] + [plan.n_waypoints]
    assert arrays["segment_kinds"].tolist() == [segment.kind for segment in plan.segments]
    moving = [None if k < 0 else plan.fingers[k] for k in arrays["segment_moving_fingers"].tolist()]
    assert moving == [segment.moving_finger for segment in plan.segments]
    moves = [[name in segment.moving for name in plan.fingers] for segment in plan.segments]
    np.testing.assert_array_equal(arrays["segment_moves"].astype(bool), moves)
    assert arrays["segment_rolling_fingers"].tolist() == [-1 if s.rolling_finger is None else plan.fingers.index(s.rolling_finger) for s in plan.segments]
    assert ("joint_torques" in arrays) == (plan.joint_torques is not None)


def test_names_of_any_kind_survive(plan: regrasp.Plan) -> None:
    yaml = pytest.importorskip("yaml")
    name = 'née "ü" \\ #: {x} yes'
    text = plan.to_json().decode().replace('"north"', '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"')
    first = plan.joint_names[0]
    text = text.replace(f'"{first}"', '"null: [1, 2] é"')
    renamed = regrasp.Plan.from_json(text)
    assert name in renamed.fingers
    assert yaml.safe_load(renamed.to_ros2())["joint_names"][0] == "null: [1, 2] é"
    import io

    with np.load(io.BytesIO(renamed.to_npz()), allow_pickle=False) as arrays:
        assert arrays["fingers"].tolist() == list(renamed.fingers)
        assert arrays["joint_names"].tolist() == list(renamed.joint_names)


def test_the_same_files_as_the_command_line(regrasp_cli, plan: regrasp.Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / "plan.json")
    scene = SCENES / "box_90x.toml"
    run = regrasp_cli("export", "plan.json", "--scene", scene, "--npz", "plan.npz", "--ros2", "plan.yaml")
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "plan.npz").read_bytes() == plan.to_npz()
    assert (tmp_path / "plan.yaml").read_text(encoding="utf-8") == plan.to_ros2()
