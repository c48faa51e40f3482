"""Hands and scenes."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import regrasp
from conftest import REPOSITORY


def test_a_hand_has_names_limits_and_fingers() -> None:
    hand = regrasp.load_hand(REPOSITORY / "assets/hands/wide_four_finger/hand.toml")
    assert [finger.name for finger in hand.fingers] == ["east", "north", "west", "south"]
    assert hand.joint_names == tuple(name for finger in hand.fingers for name in finger.joint_names)
    assert hand.limits.shape == (12, 2)
    assert hand.limits[0].tolist() == [hand.joints[0].lower, hand.joints[0].upper]
    # As its URDF says.
    assert (hand.joints[0].kind, hand.joints[0].effort, hand.joints[0].velocity) == ("revolute", 1.0, 4.0)
    assert hand.joints[0].upper == pytest.approx(np.radians(35), abs=1e-9)
    assert all(finger.tip.shape == "sphere" and finger.tip.radius == 0.005 for finger in hand.fingers)
    assert hand.notes == ()


def test_a_scene_has_what_its_file_says(scene: regrasp.Scene) -> None:
    assert scene.object.shape.kind == "sphere"
    assert scene.object.mass == 0.1 and scene.object.friction == 0.8
    assert scene.object.shape.high.tolist() == [scene.object.radius] * 3
    assert [entry.role for entry in scene.inputs][0] == "scene"
    assert scene.obstacles == () and scene.gravity is None
    turn = scene.goal.matrix[:3, :3] @ scene.start.matrix[:3, :3].T
    np.testing.assert_allclose(turn, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)


def written(folder: Path, text: str) -> regrasp.Scene:
    """The scene that `text` describes, with the wide hand beside it."""
    hand = REPOSITORY / "assets/hands/wide_four_finger"
    for name in ("hand.toml", "hand.urdf"):
        (folder / name).write_bytes((hand / name).read_bytes())
    (folder / "scene.toml").write_text(text.replace("../assets/hands/wide_four_finger/", ""))
    return regrasp.load_scene(folder / "scene.toml")


def test_gravity_is_given_in_the_frame_of_the_hand(tmp_path: Path) -> None:
    text = (REPOSITORY / "scenes/sphere_90x.toml").read_text()
    for value, expected in [("[0.0, 2.0, 0.0]", [0, 9.80665, 0]), ('"any"', "any")]:
        scene = written(tmp_path, text.replace('task = "in_hand"', f'task = "in_hand"\ngravity = {value}'))
        if isinstance(scene.gravity, str):
            assert scene.gravity == expected
        else:
            # The hand of this scene stands upright in the world.
            np.testing.assert_allclose(scene.gravity, expected)


def test_the_seed_draws_what_the_scene_leaves_open(tmp_path: Path) -> None:
    given = (REPOSITORY / "scenes/sphere_90x.toml").read_text()
    drawn = given.replace("[start]\n", "[start]\nrandom_orientation = true\n")
    for text, same in ((given, True), (drawn, False)):
        scene = written(tmp_path, text)
        starts = [scene.query(seed=seed).start.matrix for seed in (0, 0, 1)]
        np.testing.assert_array_equal(starts[0], starts[1])
        assert np.array_equal(starts[0], starts[2]) is same


def test_way_poses_are_asked_for_between_start_and_goal() -> None:
    scene = regrasp.load_scene(REPOSITORY / "scenes/cubic.toml")
    query = scene.query(seed=0)
    assert len(query.way) == 2
    turns = [pose.matrix[:3, :3] for pose in (query.start, *query.way, query.goal)]
    for turn, following in zip(turns, turns[1:]):
        # A full turn in three legs of 120 degrees.
        assert np.trace(following @ turn.T) == pytest.approx(0.0, abs=1e-9)


def test_fingertips_stand_one_radius_off_their_contacts(box: regrasp.Scene, plan: regrasp.Plan) -> None:
    """Forward kinematics against the contacts of a plan, which the checker has accepted."""
    tips = box.hand.tips(plan.joints)
    assert tips.shape == (plan.n_waypoints, len(plan.fingers), 3)
    radius = np.array([finger.tip.radius for finger in box.hand.fingers])
    centers = plan.contact_points_in_object + radius[:, None] * plan.contact_normals_in_object
    largest = 0.0
    for k in range(plan.n_waypoints):
        world_from_object = regrasp.Pose(plan.object_positions[k], plan.object_quat_xyzw[k]).matrix
        in_world = centers[k] @ world_from_object[:3, :3].T + world_from_object[:3, 3]
        largest = max(largest, float(np.nanmax(np.linalg.norm(in_world - tips[k], axis=1))))
    assert largest < plan.promises["contact_tolerance"]
    np.testing.assert_array_equal(box.hand.tips(plan.joints[3]), tips[3])


def test_joint_vectors_are_made_by_name(scene: regrasp.Scene) -> None:
    hand = scene.hand
    values = {name: 0.01 * k for k, name in enumerate(hand.joint_names)}
    by_name = dict(reversed(list(values.items())))
    np.testing.assert_array_equal(hand.joint_vector(by_name), list(values.values()))
    with pytest.raises(regrasp.InputError, match="unknown joints .'elbow'"):
        hand.joint_vector({**values, "elbow": 0.0})
    with pytest.raises(regrasp.InputError, match="lacks joints"):
        hand.joint_vector({})
    assert hand.tips(np.zeros(12, dtype=np.float32)).shape == (4, 3)
    assert hand.tips(np.zeros((12, 5), order="F").T).shape == (5, 4, 3)
    with pytest.raises(regrasp.InputError, match=r"shape \(11,\); expected shape \(12,\)"):
        hand.tips(np.zeros(11))


def test_arrays_of_models_cannot_be_written(scene: regrasp.Scene) -> None:
    for array in (scene.start.position, scene.hand.limits, scene.object.center_of_mass):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_a_scene_travels_to_other_processes(scene: regrasp.Scene) -> None:
    again = pickle.loads(pickle.dumps(scene))
    assert again.inputs == scene.inputs


def test_packages_are_folders(tmp_path: Path) -> None:
    scene = REPOSITORY / "scenes/allegro/sphere32_x.toml"
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_scene(scene, packages={"models": tmp_path / "missing"})
    assert "not a folder" in str(caught.value)
