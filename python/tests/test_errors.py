"""Bad input is `InputError`, a bug is `InternalError`, and nothing gets past `except Exception`."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import pytest
import regrasp
from conftest import REPOSITORY
from regrasp import _regrasp


def bad_scene(folder: Path) -> Path:
    """A scene with two things wrong."""
    hand = REPOSITORY / "assets/hands/wide_four_finger"
    for name in ("hand.toml", "hand.urdf"):
        (folder / name).write_bytes((hand / name).read_bytes())
    text = (REPOSITORY / "scenes/sphere_90x.toml").read_text()
    text = text.replace("../assets/hands/wide_four_finger/", "").replace("mass = 0.1", "mass = -1.0")
    path = folder / "scene.toml"
    path.write_text(text.replace("friction = ", "fricton = "))
    return path


def test_an_error_has_code_place_and_fix(tmp_path: Path) -> None:
    path = bad_scene(tmp_path)
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_scene(path)
    error = caught.value
    assert isinstance(error, ValueError) and isinstance(error, regrasp.RegraspError)
    assert len(error.diagnostics) >= 2, "all causes in one run"
    by_code = {entry.code: entry for entry in error.diagnostics}
    unknown = by_code["S101"]
    assert unknown.file == str(path) and unknown.element == 'key "object.fricton"'
    lines = path.read_text().splitlines()
    assert unknown.line is not None and "fricton" in lines[unknown.line - 1]
    assert "friction" in unknown.expected + unknown.fix + unknown.problem
    first = error.diagnostics[0]
    assert (error.code, error.file, error.line, error.fix) == (first.code, first.file, first.line, first.fix)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.diagnostics) == (str(error), error.diagnostics)


def test_the_message_is_that_of_the_command_line(regrasp_cli, tmp_path: Path) -> None:
    path = bad_scene(tmp_path)
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_scene(path)
    run = regrasp_cli("plan", path)
    assert run.returncode == 2
    assert run.stderr == f"error: {caught.value}\n"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"seed": -1}, "whole number"),
        ({"seed": 1.5}, "whole number"),
        ({"seed": True}, "whole number"),
        ({"seed": 2**64}, "whole number"),
        ({"threads": 0}, "from 1 to"),
        ({"threads": 10_000}, "from 1 to"),
        ({"time_limit": 0}, "seconds above 0"),
        ({"time_limit": float("nan")}, "seconds above 0"),
        ({"time_limit": "3"}, "seconds above 0"),
        ({"improve": float("inf")}, "seconds above 0"),
        ({"margin": 1.0}, r"\[0, 1\)"),
        ({"margin": "much"}, r"\[0, 1\)"),
        ({"method": "clasic"}, "classic"),
        ({"settings": {"closure_margn": 0.1}}, "closure_margn"),
        ({"settings": {"closure_margin": -1}}, "closure_margin is -1"),
        ({"settings": {"closure_margin": float("nan")}}, "JSON"),
        ({"settings": {"step": object()}}, "JSON"),
        ({"improve_work": -3}, "whole number"),
        ({"max_work": None}, "whole number"),
    ],
)
def test_arguments_that_make_no_sense(scene: regrasp.Scene, arguments, says: str) -> None:
    with pytest.raises(regrasp.InputError, match=says) as caught:
        regrasp.plan(scene, **arguments)
    assert caught.value.code in ("A503", "A504", "A510")
    (name,) = arguments
    assert name in caught.value.element or caught.value.element == 'argument "settings"'


@pytest.mark.skipif(os.name != "posix", reason="names of files are text here")
def test_names_that_are_not_utf_8(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("this file system wants UTF-8")
    path = bad_scene(folder)
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.load_scene(path)
    assert caught.value.file.endswith("scene.toml") and caught.value.line
    path.write_text((path.read_text()).replace("fricton", "friction").replace("mass = -1.0", "mass = 0.1"))
    scene = regrasp.load_scene(path)
    plan = regrasp.plan(scene)
    assert plan and regrasp.check(plan).ok


def test_numbers_of_numpy_are_numbers(scene: regrasp.Scene) -> None:
    numpy = pytest.importorskip("numpy")
    plan = regrasp.plan(scene, seed=numpy.uint64(3), threads=numpy.int32(1), margin=numpy.float32(0.0078125))
    assert plan == regrasp.plan(scene, seed=3, margin=0.0078125)


def test_files_that_are_no_plans(tmp_path: Path) -> None:
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.Plan.from_file(tmp_path / "missing.json")
    assert caught.value.code == "F001"
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.Plan.from_json("{\n  \"format\": \"lerobot\"\n}", name="other.json")
    assert (caught.value.code, caught.value.file, caught.value.line) == ("C402", "other.json", 2)
    for content in (b"", b"\xff\xfe", b"[]", b"{}", "\ud800"):
        with pytest.raises(regrasp.InputError):
            regrasp.Plan.from_json(content)


def test_a_plan_that_cannot_be_written(plan: regrasp.Plan, tmp_path: Path) -> None:
    for path in (tmp_path / "missing/plan.json", tmp_path):
        for write in (plan.save, plan.to_npz, plan.to_ros2):
            with pytest.raises(regrasp.InputError) as caught:
                write(path)
            assert caught.value.code == "F003"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("in_search", [False, True])
def test_a_panic_is_an_internal_error(in_search: bool, capfd: pytest.CaptureFixture[str]) -> None:
    try:
        _regrasp._panic_for_tests("a broken invariant", in_search=in_search)
    except Exception as error:
        assert type(error) is regrasp.InternalError and isinstance(error, regrasp.RegraspError)
        assert "a broken invariant" in str(error) and "guard.rs" in str(error)
        assert regrasp.__version__ in str(error) and "report" in str(error)
    else:
        pytest.fail("no exception")
    captured = capfd.readouterr()
    assert captured.out + captured.err == "", "libraries do not print"


def test_after_a_panic_all_is_well(scene: regrasp.Scene) -> None:
    before = regrasp.plan(scene, seed=5)
    for _ in range(3):
        with pytest.raises(regrasp.InternalError):
            _regrasp._panic_for_tests("again", in_search=True)
    assert regrasp.plan(scene, seed=5) == before


def test_what_python_passes_is_never_a_panic(scene: regrasp.Scene) -> None:
    with pytest.raises((TypeError, ValueError, OverflowError)):
        scene._native.query(-1)
    with pytest.raises(TypeError):
        _regrasp.Plan()  # type: ignore[call-arg]
    with pytest.raises(regrasp.InputError):
        scene._native.tips(0, b"123")
