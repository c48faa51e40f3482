"""Scenes without files: made of text, varied, and sent to other machines."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import regrasp
from conftest import REPOSITORY, SCENES


def test_a_scene_of_text_is_the_scene_of_the_file(scene: regrasp.Scene) -> None:
    text = (SCENES / "sphere_90x.toml").read_text()
    made = regrasp.Scene.from_toml(text, base=SCENES, name="sphere_90x")
    assert made.inputs == scene.inputs and made.name == scene.name
    assert made.to_toml() == text
    found = regrasp.plan(made, seed=3)
    assert found == regrasp.plan(scene, seed=3)
    assert regrasp.check(found) and regrasp.check(found, scene)


def test_a_dictionary_says_what_a_file_says(scene: regrasp.Scene) -> None:
    made = regrasp.Scene.from_dict(scene.to_dict(), base=SCENES)
    assert made.to_dict() == scene.to_dict()
    assert made.hand.limits.tolist() == scene.hand.limits.tolist()
    odd = {**scene.to_dict(), "object": {"name": 'a "b"', "sphere": {"radius": np.float64(0.03)}, "mass": 1, "friction": 1e-5}}
    assert regrasp.Scene.from_dict(odd, base=SCENES).object.friction == 1e-5
    with pytest.raises(regrasp.InputError, match="as TOML has them"):
        regrasp.Scene.from_dict({**scene.to_dict(), "name": None}, base=SCENES)
    with pytest.raises(regrasp.InputError, match="S101"):
        regrasp.Scene.from_dict({**scene.to_dict(), "colour": "red"}, base=SCENES)


def test_every_bundled_scene_is_the_same_after_its_dictionary() -> None:
    for path in sorted(SCENES.glob("*.toml")):
        scene = regrasp.load_scene(path)
        again = regrasp.Scene.from_dict(scene.to_dict(), base=SCENES)
        assert again.to_dict() == scene.to_dict(), path
        assert [hand.joints for hand in again.hands] == [hand.joints for hand in scene.hands]


def test_scenes_vary_without_files(scene: regrasp.Scene) -> None:
    goal = {"turn": {"axis": [0.0, 0.6, 0.8], "angle_deg": 20.0}}
    varied = scene.with_(goal=goal, start=scene.start, friction=0.7, mass=0.2, size=0.03)
    assert (varied.object.friction, varied.object.mass, varied.object.radius) == (0.7, 0.2, 0.03)
    assert np.degrees(2 * np.arccos(varied.goal.quat_xyzw[3])) == pytest.approx(20.0)
    assert scene.object.friction == 0.8, "scenes never change"
    assert scene.with_(scale=0.5).object.radius == scene.object.radius / 2
    assert scene.with_keys({"object.friction": 0.4}).object.friction == 0.4
    found = regrasp.plan(varied, seed=1)
    assert isinstance(found, regrasp.Plan)
    # What was planned is what a file of that text would have been.
    assert regrasp.check(found, regrasp.Scene.from_toml(varied.to_toml(), base=SCENES, name=varied.name))
    assert not regrasp.check(found, scene), "the plan belongs to another object"


def test_scenes_of_several_bodies_vary_by_name() -> None:
    scene = regrasp.load_scene(SCENES / "two_hands.toml")
    last = scene.objects[-1].name
    varied = scene.with_(mass=0.05, object=last)
    assert [body.mass for body in varied.objects[:-1]] == [body.mass for body in scene.objects[:-1]]
    assert varied.objects[-1].mass == 0.05
    with pytest.raises(regrasp.InputError, match="which is not there"):
        scene.with_(mass=0.05, object="teapot")


def test_what_cannot_vary_is_refused(scene: regrasp.Scene) -> None:
    with pytest.raises(regrasp.InputError, match="radius of a sphere"):
        scene.with_(size=[0.1, 0.1])
    with pytest.raises(regrasp.InputError, match="leads through task"):
        scene.with_keys({"task.name": "x"})
    with pytest.raises(regrasp.InputError, match="S107"):
        scene.with_(friction=-1.0)


def test_a_pickled_scene_needs_no_files(tmp_path: Path) -> None:
    hand = tmp_path / "hand"
    hand.mkdir()
    for name in ("hand.toml", "hand.urdf"):
        (hand / name).write_bytes((REPOSITORY / "assets/hands/wide_four_finger" / name).read_bytes())
    (tmp_path / "cube.obj").write_text(CUBE)
    text = (SCENES / "box_90x.toml").read_text().replace("../assets/hands/wide_four_finger/", "hand/")
    text = text.replace("box = { size = [0.050, 0.050, 0.060] }", 'mesh = { file = "cube.obj" }')
    (tmp_path / "scene.toml").write_text(text)
    scene = regrasp.load_scene(tmp_path / "scene.toml")
    assert scene.object.shape.kind == "mesh"
    varied = scene.with_(friction=0.9, scale=1.01)
    sent = pickle.dumps((scene, varied))
    (hand / "hand.toml").write_text((hand / "hand.toml").read_text() + "\n")
    with pytest.raises(regrasp.InputError, match="F005.*has changed since the scene was read"):
        pickle.dumps(scene)
    for path in (hand / "hand.toml", hand / "hand.urdf", tmp_path / "cube.obj", tmp_path / "scene.toml"):
        path.unlink()
    for before, after in zip((scene, varied), pickle.loads(sent)):
        assert after.inputs == before.inputs
        assert pickle.loads(pickle.dumps(after)).inputs == before.inputs
        assert after.object.radius == before.object.radius
        found = regrasp.plan(after, seed=2)
        assert isinstance(found, regrasp.Plan) and regrasp.check(found)
    program = "import pickle, sys; print(pickle.load(sys.stdin.buffer)[1].object.friction)"
    done = subprocess.run(
        [sys.executable, "-c", program], input=sent, capture_output=True, cwd=os.path.abspath(os.sep), check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.stdout.strip() == b"0.9"


CUBE = "\n".join(
    [f"v {x} {y} {z}" for x in (-0.025, 0.025) for y in (-0.025, 0.025) for z in (-0.03, 0.03)]
    + [
        f"f {a} {b} {c}"
        for a, b, c in [
            (1, 2, 4), (1, 4, 3), (5, 7, 8), (5, 8, 6), (1, 5, 6), (1, 6, 2),
            (3, 4, 8), (3, 8, 7), (1, 3, 7), (1, 7, 5), (2, 6, 8), (2, 8, 4),
        ]
    ]
)
