"""`load_hand` takes names of the package `robot_descriptions`. The package here is a stand-in: the real one fetches by git."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest
import regrasp
from conftest import REPOSITORY

WIDE = REPOSITORY / "assets" / "hands" / "wide_four_finger" / "hand.urdf"
GECKO = Path(__file__).parent / "data" / "mjcf"


@pytest.fixture
def descriptions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a package that is laid out as the real one."""
    package = tmp_path / "site" / "robot_descriptions"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "_descriptions.py").write_text(
        "class About:\n    tags = {'end_effector'}\nDESCRIPTIONS = {'wide_hand_description': About(), 'gecko_hand_mj_description': About()}\n"
    )
    monkeypatch.syspath_prepend(str(package.parent))
    yield package
    for name in [name for name in sys.modules if name.split(".")[0] == "robot_descriptions"]:
        del sys.modules[name]


def module(package: Path, name: str, **paths: Path) -> None:
    (package / f"{name}.py").write_text("".join(f"{key}: str = {str(path)!r}\n" for key, path in paths.items()))


def test_a_urdf_with_packages(descriptions: Path, tmp_path: Path):
    root = tmp_path / "repository" / "wide_hand"
    (root / "urdf").mkdir(parents=True)
    (root / "meshes").mkdir()
    shutil.copy(GECKO / "assets" / "palm.obj", root / "meshes" / "palm.obj")
    mesh = '<mesh filename="package://wide_hand/meshes/palm.obj" scale="0.001 0.001 0.001"/>'
    text = WIDE.read_text().replace('<cylinder radius="0.055" length="0.01"/>', mesh)
    assert mesh in text
    (root / "urdf" / "hand.urdf").write_text(text)
    module(
        descriptions,
        "wide_hand_description",
        REPOSITORY_PATH=root.parent,
        PACKAGE_PATH=root,
        URDF_PATH=root / "urdf" / "hand.urdf",
    )
    hand = regrasp.load_hand("wide_hand_description")
    assert (hand.name, len(hand.fingers), len(hand.joints)) == ("wide_four_finger", 4, 12)


def test_a_model_of_mujoco(descriptions: Path):
    pytest.importorskip("mujoco", reason="mujoco is not installed")
    module(descriptions, "gecko_hand_mj_description", PACKAGE_PATH=GECKO, MJCF_PATH=GECKO / "gecko.xml")
    hand = regrasp.load_hand("gecko_hand_mj_description")
    assert (hand.name, len(hand.fingers), len(hand.coupled_joints)) == ("gecko", 4, 4)
    # The files that it was read from are gone, and it does not need them.
    assert hand.tips([0.5 * (joint.lower + joint.upper) for joint in hand.joints]).shape == (4, 3)


def test_xacro_is_refused_with_the_command(descriptions: Path, tmp_path: Path):
    (tmp_path / "hand.urdf.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:hand/></robot>'
    )
    module(descriptions, "wide_hand_description", PACKAGE_PATH=tmp_path, XACRO_PATH=tmp_path / "hand.urdf.xacro")
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_hand("wide_hand_description")
    assert caught.value.code == "U107"


def test_names_that_are_not_there(descriptions: Path):
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_hand("wide_hnd_description")
    assert caught.value.code == "A510"
    assert 'did you mean "wide_hand_description"?' in caught.value.expected
    assert "gecko_hand_mj_description, wide_hand_description" in caught.value.expected


def test_files_that_cannot_be_fetched(descriptions: Path):
    (descriptions / "wide_hand_description.py").write_text("raise OSError('no network')\n")
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_hand("wide_hand_description")
    assert "whose files cannot be fetched: no network" in caught.value.problem


def test_a_description_without_files(descriptions: Path, tmp_path: Path):
    module(descriptions, "wide_hand_description", PACKAGE_PATH=tmp_path)
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_hand("wide_hand_description")
    assert "neither URDF_PATH nor MJCF_PATH" in caught.value.problem


def test_without_the_package(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    with pytest.raises(ImportError, match="pip install robot_descriptions"):
        regrasp.load_hand("allegro_hand_description")


def test_files_of_such_a_name_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_description").mkdir()
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_hand("my_description")
    assert caught.value.code == "U215"
