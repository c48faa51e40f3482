"""Exports of data sets, and replays as a filter."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import regrasp

pq = pytest.importorskip("pyarrow.parquet")

from regrasp.dataset import Episode, make, read_episodes, specification_of, verify  # noqa: E402
from regrasp.dataset.export_files import export_robomimic  # noqa: E402
from regrasp.dataset.export_lerobot import export_lerobot  # noqa: E402
from regrasp.dataset.frames import frames_of  # noqa: E402
from test_dataset import SCENES, shards, text_of  # noqa: E402

FPS = 25


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small data set."""
    folder = tmp_path_factory.mktemp("exports")
    assert make(specification_of(text_of(episodes=4), "dataset.toml"), folder, workers=1).solved >= 3
    return folder


def test_frames_follow_the_plan(made: Path) -> None:
    for episode in read_episodes(made):
        plan, frames = episode.plan(), frames_of(episode, FPS)
        n, j, f = len(frames.time), len(plan.joint_names), len(plan.fingers)
        assert frames.state.shape == (n, j + 7) and frames.action.shape == (n, 2 * j)
        assert frames.contacts.shape == (n, f) and frames.forces.shape == (n, 3 * f)
        np.testing.assert_allclose(frames.joints[0], plan.joints[0], atol=1e-6)
        np.testing.assert_allclose(frames.joints[-1], plan.joints[-1], atol=1e-6)
        np.testing.assert_allclose(frames.object_pose[-1, :3], plan.object_positions[-1], atol=1e-6)
        np.testing.assert_array_equal(frames.next_joints[:-1], frames.joints[1:])
        names = frames.names()
        assert [len(names[key]) for key in ("state", "action", "contacts", "forces", "goal")] == [j + 7, 2 * j, f, 3 * f, 7]


def test_lerobot_files_have_the_layout_of_version_3(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count = export_lerobot(read_episodes(made), tmp_path, fps=FPS)
    info = json.loads((tmp_path / "meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["total_episodes"] == count and info["fps"] == FPS
    data = pq.read_table(tmp_path / info["data_path"].format(chunk_index=0, file_index=0))
    assert data.num_rows == info["total_frames"] and set(data.schema.names) == set(info["features"])
    assert data.column("index").to_pylist() == list(range(data.num_rows))
    episodes = pq.read_table(tmp_path / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [each["dataset_to_index"] for each in episodes[:-1]] == [each["dataset_from_index"] for each in episodes[1:]]
    assert sum(each["length"] for each in episodes) == data.num_rows
    for each in episodes:
        times = data.column("timestamp").to_numpy()[each["dataset_from_index"] : each["dataset_to_index"]]
        np.testing.assert_allclose(times, np.arange(each["length"]) / FPS, atol=1e-5)
    stats = json.loads((tmp_path / "meta/stats.json").read_text())
    action = np.array(data.column("action").to_pylist())
    np.testing.assert_allclose(stats["action"]["mean"], action.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(stats["action"]["std"], action.std(axis=0), atol=1e-6)
    np.testing.assert_allclose(stats["action"]["q90"], np.quantile(action, 0.9, axis=0), atol=1e-6)
    assert stats["action"]["count"] == [data.num_rows]
    # In several files, as large exports are.
    monkeypatch.setattr("regrasp.dataset.export_lerobot.FRAMES_IN_FILE", 20)
    export_lerobot(read_episodes(made), tmp_path / "parts", fps=FPS)
    parts = [pq.read_table(path) for path in sorted((tmp_path / "parts/data").rglob("*.parquet"))]
    assert len(parts) > 1 and sum(part.num_rows for part in parts) == data.num_rows
    known = [row for path in sorted((tmp_path / "parts/meta/episodes").rglob("*.parquet")) for row in pq.read_table(path).to_pylist()]
    for row in known:
        part = parts[row["data/file_index"]].column("episode_index").to_pylist()
        assert part.count(row["episode_index"]) == row["length"]
    with pytest.raises(regrasp.InputError, match="D127"):
        export_lerobot(read_episodes(made), tmp_path, fps=FPS)


@pytest.mark.skipif(find_spec("lerobot") is None, reason="SKIPPED: lerobot is not installed")
def test_lerobot_itself_opens_the_export(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    import torch
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    count = export_lerobot(read_episodes(made), tmp_path, fps=FPS)
    data = LeRobotDataset("local/test", root=tmp_path)
    assert data.num_episodes == count
    loader = torch.utils.data.DataLoader(data, batch_size=64, shuffle=True)
    assert sum(len(batch["action"]) for batch in loader) == data.num_frames


@pytest.mark.skipif(find_spec("h5py") is None, reason="SKIPPED: h5py is not installed")
def test_the_hdf5_file_has_the_layout_of_robomimic(made: Path, tmp_path: Path) -> None:
    import h5py

    count = export_robomimic(read_episodes(made), tmp_path / "data.hdf5", fps=FPS)
    with h5py.File(tmp_path / "data.hdf5") as file:
        demos = file["data"]
        assert len(demos) == count and demos.attrs["total"] == sum(demo.attrs["num_samples"] for demo in demos.values())
        assert json.loads(demos.attrs["env_args"])["env_kwargs"]["fps"] == FPS
        for demo in demos.values():
            n = demo.attrs["num_samples"]
            assert demo["actions"].shape[0] == n and demo["dones"][-1] == 1 and demo["dones"][:-1].sum() == 0
            for name, values in demo["obs"].items():
                assert values.shape[0] == n
                np.testing.assert_array_equal(demo["next_obs"][name][:-1], values[1:])
        masks = {name.decode() for mask in file["mask"].values() for name in mask[()]}
        assert masks == set(demos)


def with_lamp(folder: Path, lamp: float) -> Path:
    """A scene of the wide hand with a lamp on its palm, which a joint of no finger turns."""
    hand = SCENES.parent / "assets/hands/wide_four_finger"
    folder.mkdir()
    joint = """<joint name="lamp" type="revolute"><parent link="palm"/><child link="shade"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint><link name="shade"/></robot>"""
    (folder / "hand.urdf").write_text((hand / "hand.urdf").read_text().replace("</robot>", joint))
    held = f'base_link = "palm"\n\n[held]\nlamp = {lamp}\n'
    (folder / "hand.toml").write_text((hand / "hand.toml").read_text().replace('base_link = "palm"\n', held))
    scene = folder / "scene.toml"
    text = (SCENES / "sphere_90x.toml").read_text()
    scene.write_text(text.replace("../assets/hands/wide_four_finger/hand.toml", "hand.toml"))
    return scene


@pytest.mark.skipif(find_spec("h5py") is None, reason="SKIPPED: h5py is not installed")
def test_exports_say_where_joints_of_no_finger_stand(made: Path, tmp_path: Path) -> None:
    import h5py

    def lit(lamp: float) -> Path:
        scene = with_lamp(tmp_path / f"lamp_{lamp}", lamp)
        text = text_of(episodes=2, block=2).replace(str(SCENES / "sphere_90x.toml"), str(scene))
        assert make(specification_of(text, "dataset.toml"), scene.parent / "made", workers=1).solved >= 1
        return scene.parent / "made"

    folder = lit(0.3)
    for episode in read_episodes(folder):
        assert episode.plan().held_joints == {"lamp": 0.3}
        assert frames_of(episode, FPS).layout.held_joints == (("lamp", 0.3),)
    export_robomimic(read_episodes(folder), tmp_path / "lamp.hdf5", fps=FPS)
    export_robomimic(read_episodes(made), tmp_path / "dark.hdf5", fps=FPS)
    for name, held in (("lamp", {"lamp": 0.3}), ("dark", {})):
        with h5py.File(tmp_path / f"{name}.hdf5") as file:
            assert json.loads(file["data"].attrs["env_args"])["env_kwargs"]["held_joints"] == held
    export_lerobot(read_episodes(folder), tmp_path / "lerobot", fps=FPS)
    assert json.loads((tmp_path / "lerobot/meta/held_joints.json").read_text()) == {"lamp": 0.3}
    export_lerobot(read_episodes(made), tmp_path / "lerobot_dark", fps=FPS)
    assert not (tmp_path / "lerobot_dark/meta/held_joints.json").exists()
    # One export is of one hand, in one posture.
    both = [*read_episodes(folder), *read_episodes(lit(0.4))]
    with pytest.raises(regrasp.InputError, match=r"D126.*'lamp': 0.4.*'lamp': 0.3"):
        export_robomimic(iter(both), tmp_path / "both.hdf5", fps=FPS)


@pytest.mark.skipif(find_spec("mujoco") is None, reason="SKIPPED: MuJoCo is not installed")
def test_replays_are_columns_and_noise_is_keyed(tmp_path: Path) -> None:
    more = '[replay]\ncontroller = "C2"\nkeep = "track"\nfriction_scale = { range = [0.9, 1.0] }\nmass_scale = { range = [0.9, 1.1] }\n'
    more += "start_offset = { range = [[-0.001, -0.001, -0.001], [0.001, 0.001, 0.001]] }\n"
    more += "start_turn = { range = [[-0.02, -0.02, -0.02], [0.02, 0.02, 0.02]] }\n"
    specification = specification_of(text_of(episodes=2, block=1, more=more), "dataset.toml")
    one = make(specification, tmp_path / "one", workers=1)
    make(specification, tmp_path / "two", workers=2)
    assert shards(tmp_path / "one") == shards(tmp_path / "two")
    rows = [episode.row for episode in read_episodes(tmp_path / "one")]
    assert one.kept == sum(row["replay_kept"] for row in rows) == len(list(read_episodes(tmp_path / "one", kept=True)))
    assert rows and all(row["replay_controller"] == "C2" for row in rows)
    assert len({row["replay_friction_scale"] for row in rows}) == len(rows)
    for row in rows:
        joints, poses = row["replay_joints"].reshape(-1, 12), row["replay_object_pose"].reshape(-1, 7)
        assert len(joints) == len(poses) and len(poses) * row["replay_tick"] >= row["duration"]
        np.testing.assert_allclose(np.linalg.norm(poses[:, 3:], axis=1), 1.0, atol=1e-6)
        # The object starts displaced, up to what the grip did.
        moved = poses[0, :3] - np.array(row["start_pose"][:3])
        assert np.abs(moved - row["replay_start_offset"]).max() < 3e-4 and np.abs(row["replay_start_offset"]).max() > 1e-4
        if row["replay_kept"]:
            assert np.abs(joints[0] - row["joints"][:12]).max() < 0.1
            assert np.linalg.norm(poses[-1, :3] - row["goal_pose"][:3]) < 0.01
    assert verify(tmp_path / "one").ok
    # The plans are those without a replay.
    plain = [row.row for row in _plain(tmp_path)]
    assert [row["joints"].tolist() for row in plain] == [row["joints"].tolist() for row in rows]


@pytest.mark.parametrize("noise", ["start_offset = 0.001", "start_turn = { range = [0.0, 0.1] }", 'mass_scale = { direction = "any" }'])
def test_noise_of_another_shape_is_refused(noise: str) -> None:
    with pytest.raises(regrasp.InputError, match="D103"):
        specification_of(text_of(episodes=2, more=f'[replay]\ncontroller = "C2"\n{noise}\n'), "dataset.toml")


def _plain(folder: Path) -> list[Episode]:
    make(specification_of(text_of(episodes=2, block=1), "dataset.toml"), folder / "plain", workers=1)
    return list(read_episodes(folder / "plain"))
