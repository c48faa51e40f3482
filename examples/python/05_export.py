"""Exports a plan: arrays for numpy, a trajectory for ROS 2."""

import tempfile
from pathlib import Path

import numpy as np

import regrasp

SCENES = Path(__file__).resolve().parents[2] / "scenes"

plan = regrasp.plan(SCENES / "sphere_90x.toml", seed=1)
if not plan:
    raise SystemExit(str(plan))

with tempfile.TemporaryDirectory() as folder:
    arrays_path = Path(folder) / "plan.npz"
    plan.to_npz(arrays_path)
    with np.load(arrays_path, allow_pickle=False) as arrays:
        for name in arrays.files:
            print(f"  {name:28} {arrays[name].dtype!s:6} {arrays[name].shape}")

    trajectory_path = Path(folder) / "trajectory.yaml"
    trajectory = plan.to_ros2(trajectory_path)
    print(f"{trajectory_path.name}: {len(trajectory.splitlines())} lines, for `ros2 topic pub --once`")
