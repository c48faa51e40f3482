"""Reads a plan as numpy arrays: how far joints go, how long fingers hold, how near they are to their limits."""

from pathlib import Path

import numpy as np

import regrasp

SCENES = Path(__file__).resolve().parents[2] / "scenes"

scene = regrasp.load_scene(SCENES / "sphere_180z.toml")
plan = regrasp.plan(scene, seed=3)
if not plan:
    raise SystemExit(str(plan))

# Every vector travels with its names: rows are waypoints, columns are `joint_names` or `fingers`.
travel = np.abs(np.diff(plan.joints, axis=0)).sum(axis=0)
low, high = scene.hand.limits.T
nearest = np.minimum(plan.joints - low, high - plan.joints).min(axis=0)
print(f"{plan.n_waypoints} waypoints, {plan.duration:.1f} s")
for name, way, margin in zip(plan.joint_names, travel, nearest):
    print(f"  {name:24} goes {np.degrees(way):6.1f} deg, stays {np.degrees(margin):5.1f} deg off its limits")

# A finger holds where it is not free; steps between waypoints last differently long.
steps = np.diff(plan.times)
holds = plan.contact_modes[1:] != regrasp.CONTACT_MODES.index("free")
for finger, share in zip(plan.fingers, (holds * steps[:, None]).sum(axis=0) / plan.duration):
    print(f"  {finger:8} holds for {100 * share:5.1f} % of the time")

# Forward kinematics: a holding fingertip is one radius away from its contact, along the outward normal.
tips_in_world = scene.hand.tips(plan.joints)
pose = regrasp.Pose(plan.object_positions[0], plan.object_quat_xyzw[0]).matrix
for k, finger in enumerate(scene.hand.fingers):
    if plan.contact_modes[0, k] == 0:
        continue
    center = plan.contact_points_in_object[0, k] + finger.tip.radius * plan.contact_normals_in_object[0, k]
    error = np.linalg.norm(pose[:3, :3] @ center + pose[:3, 3] - tips_in_world[0, k])
    print(f"  {finger.name:8} is {1e6 * error:.2f} micrometres off its contact at the start")
