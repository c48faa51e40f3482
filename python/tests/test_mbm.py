"""Problems of MotionBenchMaker as scenes."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import regrasp

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")

ROBOT = Path(__file__).resolve().parents[2] / "assets/robots/upper_body/robot.toml"
REQUEST = {
    "start_state": {
        "joint_state": {"name": ["torso_yaw", "right_arm_1", "head_pan"], "position": [0.0, 0.5, 0.1]},
        "multi_dof_joint_state": {"transforms": [{"translation": [1.0, 0.0, 0.2], "rotation": [0.0, 0.0, 0.6, 0.8]}]},
    },
    "goal_constraints": [
        {"joint_constraints": [{"joint_name": "right_arm_1", "position": -0.4}, {"joint_name": "torso_yaw", "position": 0.3}]}
    ],
    "group_name": "right",
}
SCENE = {
    "robot_model_name": "upper_body",
    "allowed_collision_matrix": {"entry_names": ["a", "b", "c"], "entry_values": [[False, True, False], [True, False, False], [False] * 3]},
    "world": {
        "collision_objects": [
            {
                "id": "Can",
                "pose": {"position": [0.0, 0.0, 1.0], "orientation": [0.0, 0.0, 1.0, 0.0]},
                "primitives": [{"type": "cylinder", "dimensions": [0.14, 0.03]}, {"type": "sphere", "dimensions": [0.05]}],
                "primitive_poses": [
                    {"position": [1.5, 2.0, 0.0], "orientation": [0.0, 0.0, 0.0, 1.0]},
                    {"position": [0.0, 2.0, 0.0], "orientation": [1.0, 0.0, 0.0, 0.0]},
                ],
            },
            {
                "id": "shelf",
                "primitives": [{"type": "box", "dimensions": [1.2, 1.0, 0.04]}],
                "primitive_poses": [{"position": [2.5, 0.0, 0.2], "orientation": [0.0, 0.0, 0.0, 1.0]}],
            },
        ]
    },
}


def written(folder: Path, request: object = REQUEST, scene: object = SCENE, number: str = "0001") -> Path:
    folder.mkdir(exist_ok=True, parents=True)
    (folder / f"request{number}.yaml").write_text(yaml.safe_dump(request))
    (folder / f"scene{number}.yaml").write_text(yaml.safe_dump(scene))
    return folder


def changed(document: object, path: str, value: object) -> object:
    out = json.loads(json.dumps(document))
    place = out
    *parents, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    for part in parents:
        place = place[part]
    place[last] = value
    return out


def test_a_problem_becomes_a_scene(tmp_path: Path):
    written(tmp_path / "shelves")
    (problem,) = regrasp.import_mbm(tmp_path, ROBOT)
    assert (problem.name, problem.family, problem.robot_name, problem.group) == ("shelves/0001", "shelves", "upper_body", "right")
    assert problem.start_of_others == {"head_pan": 0.1}
    assert problem.may_touch == [("b", "a")]
    document = problem.document
    assert document["robot"]["world_from_robot"]["position"] == [1.0, 0.0, 0.2]
    can, ball, shelf = document["obstacles"]
    assert (can["name"], ball["name"], shelf["name"]) == ("Can_1", "Can_2", "shelf")
    assert can["cylinder"] == {"radius": 0.03, "length": 0.14}
    # Half a turn about z, then up by 1.
    assert np.allclose(can["position"], [-1.5, -2.0, 1.0]) and np.allclose(ball["position"], [0.0, -2.0, 1.0])
    assert np.allclose(np.abs(ball["quat_xyzw"]), [0.0, 1.0, 0.0, 0.0])
    (task,) = document["tasks"]
    assert task["start"] == {"joints": {"right_arm_1": 0.5, "torso_yaw": 0.0}}
    assert task["goal"] == {"joints": {"right_arm_1": -0.4, "torso_yaw": 0.3}}


def test_written_scenes_load(tmp_path: Path):
    written(tmp_path / "in" / "shelves")
    written(tmp_path / "in" / "shelves", number="0002")
    problems = regrasp.import_mbm(tmp_path / "in", ROBOT, output=tmp_path / "out")
    files = sorted((tmp_path / "out").rglob("*.toml"))
    assert [file.name for file in files] == ["0001.toml", "0002.toml"]
    assert [file.read_text() for file in files] == [problem.to_toml() for problem in problems]
    scene = regrasp.load_scene(files[0])
    assert [obstacle.name for obstacle in scene.obstacles] == ["Can_1", "Can_2", "shelf"]


@pytest.mark.parametrize(
    ("file", "path", "value", "problem"),
    [
        ("scene", "world.collision_objects.1.primitives.0.type", "cone", "is a cone"),
        ("scene", "world.collision_objects.1.primitives.0.dimensions", [1.0, 2.0], "is [1.0, 2.0]"),
        ("scene", "world.collision_objects.1.primitives.0.dimensions", [1.0, 2.0, -1.0], "is [1.0, 2.0, -1.0]"),
        ("scene", "world.collision_objects.1.primitive_poses.0.orientation", [0.0, 0.0, 0.0, 2.0], "has length 2"),
        ("scene", "world.collision_objects.1.primitive_poses", [], "has 1 shapes and 0 poses"),
        ("scene", "world.collision_objects.1.meshes", ["mug.stl"], "has meshes"),
        ("scene", "world", [1.0], "is [1.0]"),
        ("scene", "allowed_collision_matrix.entry_values", [[True]], "has 3 names and 1 rows"),
        ("request", "goal_constraints", [], "has 0 goals"),
        ("request", "goal_constraints.0.joint_constraints.0.position", float("nan"), "is [nan]"),
        ("request", "start_state.joint_state.name", ["torso_yaw", "head_pan", "x"], "has no position of right_arm_1"),
        ("request", "start_state.joint_state.position", [0.0], "is [0.0]"),
    ],
)
def test_bad_problems_say_what_is_wrong(tmp_path: Path, file: str, path: str, value: object, problem: str):
    request = changed(REQUEST, path, value) if file == "request" else REQUEST
    scene = changed(SCENE, path, value) if file == "scene" else SCENE
    written(tmp_path / "bad", request, scene)
    with pytest.raises(regrasp.InputError, match="V025") as error:
        regrasp.import_mbm(tmp_path, ROBOT)
    assert problem in error.value.problem and file in error.value.file


def test_bad_files_and_folders(tmp_path: Path):
    with pytest.raises(regrasp.InputError, match="without any problem"):
        regrasp.import_mbm(tmp_path, ROBOT)
    with pytest.raises(regrasp.InputError, match="no folder"):
        regrasp.import_mbm(tmp_path / "missing", ROBOT)
    with pytest.raises(regrasp.InputError, match="no file"):
        regrasp.import_mbm(tmp_path, tmp_path / "robot.toml")
    folder = written(tmp_path / "one")
    for text, problem in (("a: &x [1]\nb: *x\n", "has an alias in line 2"), ("a: [", "is no YAML"), ("- 1\n", "holds list")):
        (folder / "scene0001.yaml").write_text(text)
        with pytest.raises(regrasp.InputError) as error:
            regrasp.import_mbm(tmp_path, ROBOT)
        assert problem in error.value.problem
    (folder / "scene0001.yaml").unlink()
    with pytest.raises(regrasp.InputError, match="cannot be read"):
        regrasp.import_mbm(tmp_path, ROBOT)
    written(tmp_path / "one")
    written(tmp_path / "two", scene={**SCENE, "robot_model_name": "panda"})
    with pytest.raises(regrasp.InputError, match="several robots: panda, upper_body"):
        regrasp.import_mbm(tmp_path, ROBOT)


@pytest.mark.skipif("REGRASP_MODELS" not in os.environ, reason="SKIPPED: no shared models")
def test_the_shared_problems_are_all_read():
    models = Path(os.environ["REGRASP_MODELS"])
    for folder, n_problems, n_joints in (("mbm_panda", 140, 7), ("mbm_baxter_both_arms", 120, 14)):
        problems = regrasp.import_mbm(models / "benchmarks" / folder, ROBOT)
        assert len(problems) == n_problems
        assert {len(problem.document["tasks"][0]["goal"]["joints"]) for problem in problems} == {n_joints}
        assert all(problem.document["obstacles"] for problem in problems)
