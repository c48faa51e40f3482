"""Where to hold an object: scenes that are planned without an edit, the same as those of the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
import regrasp
from conftest import SCENES

HAND = SCENES.parent / "assets" / "hands" / "wide_four_finger" / "hand.toml"


def test_a_place_is_that_of_the_command_line_and_is_planned(regrasp_cli, tmp_path: Path) -> None:
    scenes = regrasp.place(HAND, "sphere:0.03", tmp_path / "placed.toml", turns=["x:60"], seed=3, alternatives=1)
    assert scenes and len(scenes) == 2
    bytes_of_python = (tmp_path / "placed.toml").read_bytes()
    run = regrasp_cli("place", HAND, "sphere:0.03", "--turn", "x:60", "--seed", "3", "-o", "placed.toml")
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "placed.toml").read_bytes() == bytes_of_python
    assert regrasp.plan(scenes[0], max_work=1_000_000)


def test_what_does_not_fit_is_a_failure_and_nonsense_is_refused(tmp_path: Path) -> None:
    failure = regrasp.place(HAND, "sphere:0.4", tmp_path / "out.toml")
    assert not failure
    assert isinstance(failure, regrasp.Failure) and "found no pose" in str(failure)
    with pytest.raises(regrasp.InputError, match="AXIS:DEGREES"):
        regrasp.place(HAND, "sphere:0.03", tmp_path / "out.toml", turns=["up"])
    with pytest.raises(regrasp.InputError):
        regrasp.place(HAND, "sphere:0.03", tmp_path / "out.toml", mass=-1.0)
    with pytest.raises(regrasp.InputError, match="is for meshes"):
        regrasp.place(HAND, "sphere:0.03", tmp_path / "out.toml", solid="hull")
    assert list(tmp_path.iterdir()) == []


def test_a_hold_is_that_of_the_command_line(regrasp_cli, tmp_path: Path) -> None:
    scene = tmp_path / "held.toml"
    assert regrasp.place(HAND, "sphere:0.03", scene, hold=True, seed=2)
    bytes_of_python = scene.read_bytes()
    assert regrasp_cli("place", HAND, "sphere:0.03", "--hold", "--seed", "2", "-o", "held.toml").returncode == 0
    assert scene.read_bytes() == bytes_of_python
    plan = regrasp.plan(scene, hold=True)
    assert plan and plan.report
    assert not any(segment.moving for segment in plan.segments)
    assert regrasp_cli("plan", scene, "--hold", "--threads", "1", "-o", "cli.json").returncode == 0
    plan.save(tmp_path / "python.json")
    assert (tmp_path / "python.json").read_bytes() == (tmp_path / "cli.json").read_bytes()
    assert regrasp.check(tmp_path / "python.json", scene, hold=True)
    assert not regrasp.check(tmp_path / "python.json", scene), "a hold is no turn"
    with pytest.raises(regrasp.InputError, match="in_hand"):
        regrasp.plan(SCENES / "tracking_sphere_wide.toml", hold=True)
