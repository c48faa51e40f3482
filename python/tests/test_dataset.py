"""Data sets: specification, draws, shards, and what becomes of them."""

from __future__ import annotations

import json
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import regrasp
from conftest import REPOSITORY, SCENES

pytest.importorskip("pyarrow")

from regrasp.dataset import make, merge, read_episodes, read_specification, specification_of, summary, verify  # noqa: E402
from regrasp.dataset.__main__ import main  # noqa: E402
from regrasp.dataset.blocks import blocks_of, run_block  # noqa: E402
from regrasp.dataset.draws import Draw  # noqa: E402
from regrasp.dataset.episodes import row_of  # noqa: E402
from regrasp.dataset.packing import pack, unpack  # noqa: E402

SMALL = REPOSITORY / "datasets/small.toml"


def shards(folder: Path) -> dict[str, bytes]:
    """Every shard, by its path in the folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*.parquet"))}


def text_of(episodes: int = 12, block: int = 4, more: str = "", vary: str = "") -> str:
    return f"""
format = "regrasp-dataset"
format_version = 1
block = {block}
{more}
[[tasks]]
name = "spheres"
scene = "{SCENES / "sphere_90x.toml"}"
episodes = {episodes}
[tasks.vary]
"object.sphere.radius" = {{ range = [0.03, 0.034] }}
"goal.turn.axis" = {{ direction = "any" }}
"goal.turn.angle_deg" = {{ range = [10, 60] }}
{vary}
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small data set, made by one worker."""
    folder = tmp_path_factory.mktemp("made")
    result = make(specification_of(text_of(), "dataset.toml"), folder, workers=1)
    assert (result.made, result.episodes, result.complete) == (3, 12, True)
    assert result.solved >= 11
    return folder


def test_the_bundled_specifications_are_read() -> None:
    specification = read_specification(SMALL)
    assert specification.episodes == 1000 and specification.block == 50
    assert [task.name for task in specification.tasks] == ["spheres", "boxes"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("format_version = 1", "format_version = 9"), r'D105 d\.toml:3 key "format_version": is 9; expected 1'),
        (("block = 4", "blok = 4"), r'D101 d\.toml:4 key "blok": is unknown; .*\n  fix: did you mean "block"\?'),
        (("episodes = 12", ""), r'D102 d\.toml:\d+ key "tasks\[0\]\.episodes": is missing; .*\n  fix: add episodes = 100'),
        (("episodes = 12", 'episodes = "many"'), r'D103 d\.toml:\d+ key "tasks\[0\]\.episodes": is "many"; expected a whole number'),
        (("episodes = 12", "episodes = -1"), r'D106 .*is -1; expected a whole number from 0 to'),
        (("range = [10, 60]", "range = [60, 10]"), r'D106 d\.toml:\d+ key "tasks\[0\]\.vary\.goal\.turn\.angle_deg\.range": is \[60, 10\]; .*lower one first'),
        (('direction = "any"', 'direction = "up"'), r'D104 .*direction": is "up"; expected "any"'),
        (("object.sphere.radius", "object.sphere.colour"), r'D111 d\.toml:\d+ key "tasks\[0\]\.vary\.object\.sphere\.colour": cannot be varied'),
        (("sphere_90x", "sphere_91x"), r'D110 d\.toml:\d+ key "tasks\[0\]\.scene": cannot be read: F001'),
        (('name = "spheres"', 'name = "a b"'), r'D106 .*letters, digits'),
        (("[[tasks]]", "[[tasks"), r"D100 d\.toml:\d+"),
    ],
)
def test_bad_specifications_are_refused_with_line_key_and_value(change: tuple[str, str], message: str) -> None:
    text = text_of()
    assert change[0] in text
    with pytest.raises(regrasp.InputError) as caught:
        specification_of(text.replace(*change), "d.toml")
    assert re.search(message, str(caught.value)), str(caught.value)


def test_two_tasks_of_one_name_are_refused() -> None:
    text = text_of()
    with pytest.raises(regrasp.InputError, match="D107"):
        specification_of(text + text[text.index("[[tasks]]") :], "d.toml")


def test_the_hash_is_of_the_meaning_alone() -> None:
    one = specification_of(text_of(), "a/d.toml").tasks[0].hash
    same = text_of(episodes=999).replace("range = [10, 60] }", "range = [10, 60] } # degrees")
    assert specification_of(same, "b/e.toml").tasks[0].hash == one
    for change in (("[10, 60]", "[10, 61]"), ("block = 4", "seed = 1"), ('name = "spheres"', 'name = "balls"')):
        assert specification_of(text_of().replace(*change), "d.toml").tasks[0].hash != one


def test_draws_are_uniform_and_depend_on_key_and_name_alone() -> None:
    draw = Draw("range", [2.0, 4.0])
    values = np.array([draw.value(str(k), "x") for k in range(2000)])
    assert values.min() >= 2.0 and values.max() <= 4.0
    assert abs(values.mean() - 3.0) < 0.05 and abs(values.std() - 2 / np.sqrt(12)) < 0.03
    assert draw.value("7", "x") == draw.value("7", "x") != draw.value("7", "y")
    # The same numbers on every machine: these are part of the format.
    assert Draw("range", [0.0, 1.0]).value("key", "name") == 0.930919768
    axes = np.array([Draw("direction").value(str(k), "a") for k in range(2000)])
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-8)
    assert np.abs(axes.mean(axis=0)).max() < 0.06
    turns = np.array([Draw("quat_xyzw").value(str(k), "q") for k in range(500)])
    assert (turns[:, 3] >= 0).all()
    counts = np.bincount([Draw("integer", [1, 3]).value(str(k), "n") for k in range(900)])
    assert counts[0] == 0 and (counts[1:] > 250).all()
    assert {Draw("choice", ["a", "b"]).value(str(k), "c") for k in range(20)} == {"a", "b"}
    logs = [Draw("log_range", [1e-3, 1.0]).value(str(k), "l") for k in range(900)]
    assert 0.45 < np.mean([value < 10**-1.5 for value in logs]) < 0.55


def test_episodes_do_not_depend_on_their_order() -> None:
    task = specification_of(text_of(), "d.toml").tasks[0]
    rows = {index: row_of(task, index) for index in (5, 2)}
    again = row_of(pickle.loads(pickle.dumps(task)), 5)
    for name, value in rows[5].items():
        np.testing.assert_array_equal(value, again[name], err_msg=name)
    assert rows[5]["seed"] != rows[2]["seed"]


def test_columns_give_the_plan_back(plan: regrasp.Plan, box: regrasp.Scene) -> None:
    content = json.loads(plan.to_json())
    exact = unpack(pack(content, exact=True))
    assert regrasp.Plan.from_json(json.dumps(exact)).joints.tolist() == plan.joints.tolist()
    assert exact["segments"][0]["waypoints"][0]["contacts"] == content["segments"][0]["waypoints"][0]["contacts"]
    rounded = regrasp.Plan.from_json(json.dumps(unpack(pack(content))))
    assert regrasp.check(rounded, box)
    np.testing.assert_allclose(rounded.joints, plan.joints, atol=1e-9)
    np.testing.assert_allclose(rounded.joint_torques, plan.joint_torques, atol=1e-6)


def test_tracking_plans_are_rows_too() -> None:
    scene = regrasp.load_scene(SCENES / "football.toml")
    found = regrasp.plan(scene, seed=1)
    assert isinstance(found, regrasp.Plan)
    content = json.loads(found.to_json())
    # The checker wants friction of what slides to 1e-9 of it: rounded columns do not hold that, exact ones do.
    assert not regrasp.check(regrasp.Plan.from_json(json.dumps(unpack(pack(content)))), scene)
    again = regrasp.Plan.from_json(json.dumps(unpack(pack(content, exact=True))))
    assert regrasp.check(again, scene)
    assert [segment.moving for segment in again.segments] == [segment.moving for segment in found.segments]


def test_a_made_data_set_is_accepted_again(made: Path) -> None:
    verdict = verify(made)
    assert verdict.ok and verdict.judged == verdict.accepted >= 11
    assert (verdict.shards, verdict.episodes) == (3, 12)
    part = verify(made, share=0.5, seed=3)
    assert 0 < part.judged < verdict.judged
    assert verify(made, workers=2).accepted == verdict.accepted


def test_verify_needs_the_folder_alone(made: Path, tmp_path: Path) -> None:
    import shutil

    copy = tmp_path / "elsewhere"
    shutil.copytree(made, copy)
    program = f"from regrasp.dataset import verify; v = verify({str(copy)!r}); print(v.accepted, v.problems)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.startswith(str(verify(made).accepted)) and done.stdout.strip().endswith("[]")


def test_two_workers_make_the_same_bytes(made: Path, tmp_path: Path) -> None:
    assert make(specification_of(text_of(), "dataset.toml"), tmp_path, workers=2).complete
    assert shards(tmp_path) == shards(made)


def test_what_is_there_is_not_made_again_and_more_episodes_keep_it(made: Path, tmp_path: Path) -> None:
    said: list[str] = []
    folder = tmp_path / "grown"
    make(specification_of(text_of(episodes=4), "dataset.toml"), folder, workers=1)
    before = shards(folder)
    result = make(specification_of(text_of(), "dataset.toml"), folder, workers=1, say=said.append)
    assert (result.done_before, result.made) == (1, 2)
    assert shards(folder) == shards(made) and before.items() <= shards(made).items()
    assert make(specification_of(text_of(), "dataset.toml"), folder).made == 0
    assert any("11 % solved" in line or "solved" in line for line in said)


def test_a_last_block_that_grows_takes_the_place_of_the_shorter_one(made: Path, tmp_path: Path) -> None:
    folder = tmp_path / "grown"
    make(specification_of(text_of(episodes=6), "dataset.toml"), folder, workers=1)
    short = shards(folder)
    result = make(specification_of(text_of(), "dataset.toml"), folder, workers=1)
    assert (result.done_before, result.made, result.foreign) == (1, 2, [])
    assert shards(folder) == shards(made)
    assert summary(folder).episodes == 12 and verify(folder).ok
    # As if the run had been cut off before it removed the shorter one.
    name, content = next(item for item in short.items() if item[0] not in shards(made))
    (folder / name).write_bytes(content)
    assert make(specification_of(text_of(), "dataset.toml"), folder, workers=1).made == 0
    assert shards(folder) == shards(made)
    # Fewer episodes than there are: they stay.
    fewer = make(specification_of(text_of(episodes=6), "dataset.toml"), folder, workers=1)
    assert (fewer.done_before, fewer.made) == (2, 0) and len(fewer.foreign) == 1
    assert shards(folder) == shards(made)


def test_a_folder_made_with_another_replay_is_refused(made: Path) -> None:
    with pytest.raises(regrasp.InputError, match="D120"):
        make(specification_of(text_of(), "dataset.toml").replayed("C2"), made, workers=1)


def test_failures_are_rows_with_cause_and_nearest_miss(tmp_path: Path) -> None:
    # A turn far beyond the budget, a radius that no scene takes, and one beyond the hand's reach.
    hard = text_of(episodes=3, vary='"object.friction" = { choice = [0.3] }\n').replace("[10, 60]", "[170, 175]")
    hard = hard.replace("episodes = 3", "episodes = 3\nmax_work = 300")
    bad = text_of(episodes=2).replace("[0.03, 0.034]", "[4.0, 5.0]")
    for name, text in (("hard", hard), ("bad", bad)):
        make(specification_of(text, "dataset.toml"), tmp_path / name, workers=1)
        assert verify(tmp_path / name).ok
    rows = [episode.row for episode in read_episodes(tmp_path / "hard", solved=False)]
    assert len(rows) == 3
    failed = [row for row in rows if not row["solved"]]
    assert failed and all(row["outcome"] and row["message"] and row["joints"] is None for row in failed)
    spent = [row for row in failed if row["outcome"] == "work_spent"]
    assert spent and all(row["work"] >= 300 and row["nearest_angle"] > 0 and row["causes"] for row in spent)
    refused = [episode.row for episode in read_episodes(tmp_path / "bad", solved=False)]
    assert [row["outcome"] for row in refused] == ["input_refused"] * 2
    assert "M201" in refused[0]["message"] and json.loads(refused[0]["causes"]) == ["M201"]


def test_methods_and_settings_vary(tmp_path: Path) -> None:
    vary = '"plan.method" = { choice = ["gait"] }\n"plan.settings.shortcuts" = { integer = [0, 3] }\n'
    task = specification_of(text_of(vary=vary), "dataset.toml").tasks[0]
    rows = [row_of(task, index) for index in range(4)]
    seen = {json.loads(row["plan"])["settings"]["shortcuts"] for row in rows if row["solved"]}
    assert len(seen) > 1 and seen <= {0, 1, 2, 3}
    assert {row["method"] for row in rows} == {"gait"}
    with pytest.raises(regrasp.InputError, match="D111"):
        specification_of(text_of(vary='"plan.threads" = 2\n'), "dataset.toml")


def test_merged_parts_are_the_whole(made: Path, tmp_path: Path) -> None:
    whole, parts = shards(made), [tmp_path / "a", tmp_path / "b"]
    for part, drop in zip(parts, (0, 2)):
        make(specification_of(text_of(), "dataset.toml").at_most(4), part, workers=1)
        for k, (name, content) in enumerate(whole.items()):
            if k != drop:
                (part / name).write_bytes(content)
        if drop == 0:
            (part / list(whole)[0]).unlink()
    merged = merge(parts, tmp_path / "out")
    assert merged.shards == 3 and merged.known == 1
    assert shards(tmp_path / "out") == whole and verify(tmp_path / "out").ok
    other = tmp_path / "other"
    make(specification_of(text_of(episodes=1).replace("[10, 60]", "[10, 61]"), "dataset.toml"), other, workers=1)
    with pytest.raises(regrasp.InputError, match="D120"):
        merge([made, other], tmp_path / "no")


def test_info_counts_and_draws(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = summary(made)
    assert found.episodes == 12 and found.tasks[0].solved >= 11 and found.damaged == 0
    assert main(["info", str(made), "--page", str(tmp_path / "page.html"), "--pictures", "1"]) == 0
    text = capsys.readouterr().out
    assert "| spheres | 12 | 12 |" in text and "kB an episode" in text
    page = (tmp_path / "page.html").read_text()
    assert "data:image/png;base64," in page and "<svg" in page and "http" not in page.replace("http://www.w3.org", "")


def test_the_command_line_makes_verifies_and_exports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    specification = tmp_path / "dataset.toml"
    specification.write_text(text_of(episodes=3))
    out = str(tmp_path / "out")
    assert main(["make", str(specification), "-o", out, "--workers", "1"]) == 0
    assert "made 1 shards of 3 episodes" in capsys.readouterr().out
    assert main(["verify", out, "--share", "50%"]) == 0
    assert main(["export", "npz", out, "-o", str(tmp_path / "npz")]) == 0
    first = sorted((tmp_path / "npz").iterdir())[0]
    assert np.load(first)["joints"].shape[1] == 12
    assert main(["make", str(tmp_path / "missing.toml"), "-o", out]) == 2
    assert "F001" in capsys.readouterr().err
    specification.write_text(text_of(episodes=3).replace("[10, 60]", "[10, 61]"))
    assert main(["make", str(specification), "-o", out]) == 2
    assert "D120" in capsys.readouterr().err


def test_shards_hold_rows_that_other_readers_understand(made: Path) -> None:
    import pyarrow.parquet as pq

    from regrasp.dataset.schema import FIELDS, REPLAY_FIELDS

    path = sorted(made.rglob("*.parquet"))[0]
    table = pq.read_table(path)
    assert table.schema.names == [name for name, _ in (*FIELDS, *REPLAY_FIELDS)]
    row: dict[str, Any] = table.slice(0, 1).to_pylist()[0]
    n, j = row["n_waypoints"], len(json.loads(row["plan"])["hands"][0]["joint_names"])
    assert len(row["joints"]) == n * j and len(row["object_pose"]) == 7 * n and len(row["segment"]) == n
    # A column that nobody describes is no column.
    text = (REPOSITORY / "docs/reference/dataset-format.md").read_text()
    missing = [name for name in table.schema.names if f"`{name}`" not in text]
    assert not missing


def test_a_block_is_the_same_bytes_twice() -> None:
    specification = specification_of(text_of(episodes=2), "dataset.toml")
    block = blocks_of(specification)[0]
    assert run_block(specification.tasks, block).shard == run_block(specification.tasks, block).shard
