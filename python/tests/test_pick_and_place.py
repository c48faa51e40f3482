"""Plans of pick and place: read, exported, replayed. The plan is one made by hand."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import regrasp
from conftest import REPOSITORY

FOLDER = REPOSITORY / "tests/support/pick_and_place"
SCENE, PLAN = FOLDER / "scene.toml", FOLDER / "plan.json"


@pytest.fixture(scope="module")
def plan() -> regrasp.RobotPlan:
    return regrasp.RobotPlan.from_file(PLAN)


@pytest.fixture(scope="module")
def xml(plan: regrasp.RobotPlan) -> str:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return plan.to_mjcf(SCENE)


def test_a_plan_says_who_holds_and_where_fingers_touch(plan: regrasp.RobotPlan) -> None:
    assert plan.objects == ("box",) and plan.fingers[:2] == ("right/east", "right/north")
    kinds = [segment.kind for segment in plan.segments]
    assert kinds == ["transit", "approach", "grasp", "carry", "carry", "carry", "release", "retreat", "transit"]
    carry = plan.segments[4]
    assert carry.held_by == {"box": ("right",)} and carry.end > carry.start
    n, f = len(plan.times), len(plan.fingers)
    assert plan.object_positions.shape == (n, 1, 3) and plan.contact_points_in_object.shape == (n, f, 3)
    touches = ~np.isnan(plan.contact_points_in_object[:, :, 0])
    assert touches[carry.first : carry.last + 1, :4].all() and not touches[:, 4:].any() and not touches[: plan.segments[3].first].any()
    # Forces hold the weight.
    total = plan.contact_forces_in_object[carry.first].sum(axis=0, where=touches[carry.first][:, None])
    assert total[2] == pytest.approx(0.15 * 9.80665)


def test_arrays_have_the_contacts(plan: regrasp.RobotPlan, tmp_path: Path) -> None:
    plan.to_npz(tmp_path / "plan.npz")
    arrays = np.load(tmp_path / "plan.npz", allow_pickle=False)
    assert tuple(arrays["fingers"]) == plan.fingers
    for name in ("contact_points_in_object", "contact_normals_in_object", "contact_forces_in_object"):
        assert np.array_equal(arrays[name], getattr(plan, name), equal_nan=True)
    assert np.array_equal(arrays["object_positions"], plan.object_positions)
    assert tuple(arrays["holders"]) == ("table", "right")


def test_tasks_of_other_kinds_are_refused() -> None:
    with pytest.raises(regrasp.InputError, match="A510"):
        regrasp.plan_motion(SCENE)
    with pytest.raises(regrasp.InputError, match="A510"):
        regrasp.plan_pick_and_place(REPOSITORY / "scenes/sphere_90x.toml")


def test_the_hand_keeps_the_object_and_drops_it_without_forces(plan: regrasp.RobotPlan, xml: str) -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate.task import TaskSettings, replay

    report, track, _ = replay(plan.document, xml)
    assert report.kept and report.final_position_error < 1e-3 and report.final_angle_error < 0.01, str(report)
    assert [(hold.hand, hold.first_segment) for hold in report.holds] == [("right", 4)] and report.holds[0].slip < 1e-3
    assert not report.contacts and track.times[-1] == pytest.approx(plan.times[-1])
    weak, _, _ = replay(plan.document, xml, TaskSettings(with_forces=False))
    assert weak.lost is not None and weak.lost.kind == "carry" and weak.lost.segment == 4, str(weak)


def test_feedback_holds_a_heavier_box_closer_to_the_plan(plan: regrasp.RobotPlan, xml: str) -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate.reference import PlanError
    from regrasp.simulate.task import TaskSettings, replay

    # The box is heavier than planned: fingers sag with it, and feedback takes that back.
    errors = {}
    for controller in ("B", "C2"):
        report, _, _ = replay(plan.document, xml, TaskSettings(controller=controller, mass_scale=1.3))
        assert report.kept, str(report)
        errors[controller] = report.largest_position_error
    assert errors["C2"] < 0.8 * errors["B"], errors
    with pytest.raises(PlanError, match="no controller 'A' for pick and place; there are B, C2"):
        replay(plan.document, xml, TaskSettings(controller="A"))


def test_a_grasp_that_changes_in_the_hand_is_replayed() -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate.task import TaskSettings, replay

    scene = REPOSITORY / "scenes/two_arms/regrasp_then_give.toml"
    plan = regrasp.plan_pick_and_place(scene)
    assert isinstance(plan, regrasp.RobotPlan), str(plan)
    assert {"regrasp", "transfer"} <= {segment.kind for segment in plan.segments}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        xml = plan.to_mjcf(scene)
    for controller in ("B", "C2"):
        report, _, _ = replay(plan.document, xml, TaskSettings(controller=controller))
        assert report.kept and report.largest_angle_error < 0.1, str(report)


def test_a_box_of_ice_is_lost(plan: regrasp.RobotPlan, xml: str) -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate.reference import PlanError
    from regrasp.simulate.task import TaskSettings, replay

    report, _, _ = replay(plan.document, xml, TaskSettings(friction_scale=0.05))
    assert not report.kept, str(report)
    heavy, _, _ = replay(plan.document, xml, TaskSettings(mass_scale=20.0))
    assert not heavy.kept, str(heavy)
    shorter = dict(plan.document) | {"segments": plan.document["segments"][:-1]}
    with pytest.raises(PlanError, match="keyframes"):
        replay(shorter, xml)


def test_the_command_says_kept_and_dropped(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-W", "ignore", "-m", "regrasp.simulate", str(PLAN), *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)

    kept = run("-o", str(tmp_path / "report.json"))
    assert kept.returncode == 0 and "KEPT   7.6 s" in kept.stdout, kept.stdout + kept.stderr
    assert json.loads((tmp_path / "report.json").read_text())["kept"] is True
    dropped = run("--no-forces")
    assert dropped.returncode == 1 and "LOST (" in dropped.stdout and "segment 4, carry" in dropped.stdout


def test_a_campaign_counts_all_replays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mujoco")
    from regrasp.simulate.task_campaign import main

    assert main([str(PLAN), "-o", str(tmp_path), "--controllers", "B,C2"]) == 0
    printed = capsys.readouterr().out
    assert "| `scene` | B | 1 | 1 | 1 |" in printed and "| `scene` | C2 | 1 | 1 | 1 |" in printed
    lines = (tmp_path / "task_campaign.csv").read_text().splitlines()
    assert [line.split(",")[3:6] for line in lines[1:]] == [["B", "planned", "True"], ["C2", "planned", "True"], ["B", "none", "False"]]
    assert ",4,carry," in lines[3]
    with pytest.raises(SystemExit):
        main([str(PLAN), "--controllers", "A"])
    assert main([str(SCENE)]) == 2
