"""Data sets of pick and place: plans of a whole robot in rows, judged as they are stored."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import regrasp
from conftest import REPOSITORY, SCENES

pytest.importorskip("pyarrow")

from regrasp.dataset import make, read_episodes, read_specification, specification_of, summary, verify  # noqa: E402
from regrasp.dataset.export_files import export_npz  # noqa: E402
from regrasp.dataset.export_lerobot import export_lerobot  # noqa: E402
from regrasp.dataset.info import page  # noqa: E402
from regrasp.dataset.packing import Unpackable, pack, unpack  # noqa: E402


def text_of(more: str = "", *, scene: str = "two_arms/grippers_bar.toml") -> str:
    return f"""
format = "regrasp-dataset"
format_version = 1
block = 2
{more}
[[tasks]]
name = "bar"
scene = "{SCENES / scene}"
episodes = 3
max_work = 1_000_000
[tasks.vary]
"objects.bar.position" = {{ range = [[0.46, -0.96, 0.54], [0.56, -0.86, 0.54]] }}
"tasks.0.goal.position" = {{ range = [[0.46, 0.86, 0.54], [0.56, 0.96, 0.54]] }}
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three episodes, made by one worker."""
    folder = tmp_path_factory.mktemp("tasks")
    result = make(specification_of(text_of(), "dataset.toml"), folder, workers=1)
    assert (result.made, result.episodes, result.solved, result.complete) == (2, 3, 3, True)
    return folder


def test_the_bundled_specification_is_read() -> None:
    specification = read_specification(REPOSITORY / "datasets/pick_and_place.toml")
    assert [task.kind for task in specification.tasks] == ["pick_and_place"] * 2
    assert specification.episodes == 400


def test_the_checker_accepts_what_the_folder_holds(made: Path) -> None:
    verdict = verify(made)
    assert verdict.ok and verdict.judged == verdict.accepted == 3, verdict.problems


def test_two_workers_make_the_same_bytes(made: Path, tmp_path: Path) -> None:
    assert make(specification_of(text_of(), "dataset.toml"), tmp_path, workers=2).complete
    shards = [{path.name: path.read_bytes() for path in folder.rglob("*.parquet")} for folder in (made, tmp_path)]
    assert shards[0] == shards[1]


def test_rows_give_plans_of_a_robot_with_all_fingers(made: Path) -> None:
    for episode in read_episodes(made):
        plan, row = episode.plan(), episode.row
        assert isinstance(plan, regrasp.RobotPlan)
        assert plan.check(episode.scene())
        n, f = len(plan.times), len(plan.fingers)
        assert {name.split("/")[0] for name in plan.fingers} == {"right", "left"}
        assert row["contact_modes"].reshape(n, f).any(axis=0).all(), "every finger of both hands holds the bar once"
        points = row["contact_points"].reshape(n, f, 3)
        np.testing.assert_array_equal(points, plan.contact_points_in_object)
        # Drawn values are those of the plan: the bar starts and ends where the episode says.
        values = json.loads(row["values"])
        np.testing.assert_allclose(plan.object_positions[0, 0], values["objects.bar.position"], atol=1e-8)
        np.testing.assert_allclose(plan.object_positions[-1, 0], values["tasks.0.goal.position"], atol=2e-3)
        assert {"approach", "grasp", "carry", "release"} <= {segment.kind for segment in plan.segments}


def test_numbers_are_counted_and_drawn(made: Path) -> None:
    found = summary(made)
    assert (found.tasks[0].solved, found.tasks[0].episodes) == (3, 3)
    assert "grasp, carry" in page(made, found)


def test_npz_is_exported_and_frames_are_refused(made: Path, tmp_path: Path) -> None:
    assert export_npz(read_episodes(made), tmp_path / "npz") == 3
    with np.load(tmp_path / "npz/bar-000000000.npz") as arrays:
        assert len(arrays["times"]) > 50
    with pytest.raises(regrasp.InputError, match="D132 bar: is pick and place"):
        export_lerobot(read_episodes(made), tmp_path / "lerobot")


def test_replays_are_columns(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    more = '[replay]\ncontroller = "C2"\nmass_scale = { range = [0.9, 1.1] }\n'
    specification = specification_of(text_of(more), "dataset.toml").at_most(1)
    assert make(specification, tmp_path, workers=1).complete
    (row,) = [episode.row for episode in read_episodes(tmp_path)]
    assert row["replay_kept"] and row["replay_controller"] == "C2" and 0.9 <= row["replay_mass_scale"] <= 1.1
    assert row["replay_final_position_error"] < 0.005


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('[replay]\ncontroller = "A"\n', 'D113 dataset.toml:10 key "tasks[0].scene": is replayed with controller "A"'),
        ('[replay]\ncontroller = "B"\nkeep = "track"\n', 'D113 dataset.toml:11 key "tasks[0].scene": is replayed with keep = "track"'),
        (
            '[replay]\ncontroller = "B"\nstart_turn = [0.1, 0.0, 0.0]\n',
            'D113 dataset.toml:11 key "tasks[0].scene": is replayed with start_turn',
        ),
    ],
)
def test_replays_that_tasks_do_not_have_are_refused(more: str, message: str) -> None:
    with pytest.raises(regrasp.InputError, match=re.escape(message)):
        specification_of(text_of(more), "dataset.toml")


def test_a_controller_of_the_command_line_is_refused_too() -> None:
    with pytest.raises(regrasp.InputError, match='D113 dataset.toml: task "bar" has no replay with controller "H"'):
        specification_of(text_of(), "dataset.toml").replayed("H")


def test_motions_without_an_object_are_refused() -> None:
    text = text_of(scene="two_arms/among_lamps.toml").split("[tasks.vary]")[0]
    with pytest.raises(regrasp.InputError, match="D112 dataset.toml:8 .*asks for a motion of a robot"):
        specification_of(text, "dataset.toml")


def test_keys_that_the_scene_rules_out_are_refused_before_any_episode() -> None:
    text = text_of().replace('"tasks.0.goal.position" = { range = [[0.46, 0.86, 0.54], [0.56, 0.96, 0.54]] }', "")
    with pytest.raises(regrasp.InputError, match="D111 .*cannot stand beside"):
        specification_of(text + '"tasks.0.goal.turn" = { choice = [{ axis = "z", angle_deg = 30 }] }\n', "dataset.toml")


def test_two_contacts_of_one_finger_are_not_storable(made: Path) -> None:
    content = unpack(next(iter(read_episodes(made))).row)
    touching = next(point for segment in content["segments"] for point in segment["waypoints"] if point["contacts"])
    touching["contacts"].append(touching["contacts"][0])
    with pytest.raises(Unpackable, match="two contacts of finger"):
        pack(content)
