"""What the command does with scenes, folders and mistakes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import regrasp

mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")

from mjcf_support import GECKO, assert_same_poses, converted, palm, wrong  # noqa: E402
from regrasp.from_mjcf import MjcfError, convert  # noqa: E402
from regrasp.from_mjcf.__main__ import main  # noqa: E402


def test_the_root(tmp_path: Path):
    table = '<body name="table"><geom type="box" size="1 1 0.1"/></body><geom type="plane" size="1 1 1" name="floor"/>'
    # A hand that floats, and a table: joints of the root are how it is mounted.
    made, urdf, _ = converted(tmp_path, table + palm(joint='<freejoint name="float"/>'))
    assert urdf.root == "palm"
    assert made.left_out["bodies outside the hand"] == ("table",)
    assert made.left_out["joints that move the root body"] == ("float",)
    # Two hands: choose.
    both = palm("first") + palm("second")
    assert '--root "first", --root "second"; or --root world' in wrong(tmp_path, both)
    (tmp_path / "one").mkdir()
    _, urdf, _ = converted(tmp_path / "one", both, root="second")
    assert urdf.links == ["second", "second_a", "second_b"]
    (tmp_path / "all").mkdir()
    made, urdf, model = converted(tmp_path / "all", both + table, root="world")
    assert urdf.root == "world" and "second_b" in urdf.links
    assert made.left_out["planes and height fields"] == ("floor",)
    assert_same_poses(model, urdf)
    # Fingers on the world itself.
    fingers = palm().partition("/>")[2].rpartition("</body>")[0]
    assert '--root "palm_a", --root "palm_b"; or --root world' in wrong(tmp_path, fingers)


def test_names_that_are_wrong(tmp_path: Path):
    assert 'there is no body "plam"; did you mean --root "palm"?' in wrong(tmp_path, palm(), root="plam")
    assert "no body has a hinge or a slide" in wrong(tmp_path, '<body name="rock"><geom size="0.1"/></body>')
    with pytest.raises(MjcfError, match="there is no such file"):
        convert(tmp_path / "gone.xml", tmp_path / "out")
    (tmp_path / "text.xml").write_text("<mujoco><worldbdy/></mujoco>")
    with pytest.raises(MjcfError, match="MuJoCo cannot read it"):
        convert(tmp_path / "text.xml", tmp_path / "out")


def test_a_part_of_a_model_names_the_files_that_include_it(tmp_path: Path):
    (tmp_path / "parts").mkdir()
    part = tmp_path / "parts" / "hand.xml"
    part.write_text("<mujocoinclude/>")
    (tmp_path / "pen.xml").write_text('<mujoco><include file="parts/hand.xml"/></mujoco>')
    (tmp_path / "other.xml").write_text('<mujoco><include file="parts/left_hand.xml"/></mujoco>')
    (tmp_path / "parts" / "all.xml").write_text('<mujocoinclude><include file="hand.xml"/></mujocoinclude>')
    with pytest.raises(MjcfError, match=r"give the file that includes it, such as \.\./pen\.xml$"):
        convert(part, tmp_path / "out")
    (tmp_path / "pen.xml").unlink()
    with pytest.raises(MjcfError, match="give the file that includes it$"):
        convert(part, tmp_path / "out")


def test_folders_of_others_are_left_alone(tmp_path: Path):
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "palm.stl").write_text("mine")
    with pytest.raises(MjcfError, match="not empty"):
        convert(GECKO, tmp_path / "model")
    assert [path.name for path in (tmp_path / "model").iterdir()] == ["palm.stl"]
    convert(GECKO, tmp_path / "new")
    convert(GECKO, tmp_path / "new")


def test_a_urdf_that_is_no_hand_is_written_with_the_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    model = tmp_path / "far.xml"
    world = palm().replace("0.03", "30").replace("0.02", "20").replace("0.005", "5")
    model.write_text(f"<mujoco><worldbody>{world}</worldbody></mujoco>")
    assert main([str(model), "-o", str(tmp_path / "out")]) == 2
    assert "U216" in capsys.readouterr().err
    assert (tmp_path / "out" / "hand.urdf").is_file() and not (tmp_path / "out" / "hand.toml").exists()


def test_the_command_that_the_reader_of_urdfs_prints_works(tmp_path: Path):
    """U108 names the command; it is run as it stands."""
    (tmp_path / "hand.xml").write_text(f"<mujoco><worldbody>{palm()}</worldbody></mujoco>")
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_hand(tmp_path / "hand.xml")
    assert caught.value.code == "U108"
    command = caught.value.fix.split("#")[0].split()
    assert command[:3] == ["python", "-m", "regrasp.from_mjcf"]
    run = subprocess.run([sys.executable, *command[1:]], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    assert len(regrasp.load_hand(tmp_path / "hand" / "hand.toml").fingers) == 2


def test_radians_that_are_taken_for_degrees_are_told(tmp_path: Path):
    made, _, _ = converted(tmp_path, palm().replace("-60 60", "-1 1"))
    assert any('angle="radian"' in note for note in made.notes)
    (tmp_path / "right").mkdir()
    made, _, _ = converted(tmp_path / "right", palm())
    assert not made.notes


def test_the_command_line_takes_a_base(tmp_path: Path, regrasp_cli: Any):
    """A hand on an arm, with a head beside it: the fix that is printed works."""
    arm = ""
    for name in ("shoulder", "elbow", "wrist"):
        arm += f'<body name="{name}" pos="0 0 0.1"><joint name="{name}" range="-60 60"/><geom size="0.01"/>'
    head = '<body name="head" pos="0.2 0 0"><joint name="head" range="-60 60"/><geom type="capsule" size="0.01 0.02"/></body>'
    world = f'<body name="torso"><geom size="0.02"/>{head}{arm}{palm()}{"</body>" * 3}</body>'
    made, _, _ = converted(tmp_path, world)
    assert made.problem is not None and made.problem.code == "U208"
    assert made.problem.fix == "regrasp inspect with --base wrist"
    options = made.problem.fix.partition("with ")[2].split()
    done = regrasp_cli("inspect", made.urdf, *options, "-o", made.urdf.with_name("hand.toml"), "--samples", "100")
    assert done.returncode == 0, done.stderr
    hand = regrasp.load_hand(made.urdf.with_name("hand.toml"))
    assert (hand.base_link, hand.joint_names) == ("wrist", ("palm_a", "palm_b"))
    refused = regrasp_cli("inspect", made.urdf.with_name("hand.toml"), "--base", "palm")
    assert (refused.returncode, "A505" in refused.stderr) == (2, True)
