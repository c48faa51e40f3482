"""The checker from Python."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
import regrasp
from conftest import REPOSITORY, SCENES


def broken(plan: regrasp.Plan, change) -> regrasp.Plan:
    """The plan with its file changed."""
    file = json.loads(plan.to_json())
    change(file)
    return regrasp.Plan.from_json(json.dumps(file))


def test_good_plans_are_accepted(plan: regrasp.Plan, box: regrasp.Scene) -> None:
    report = regrasp.check(plan, box)
    assert report and report.ok and report.violations == ()
    assert report == plan.report
    assert report.n_waypoints == plan.n_waypoints
    assert report.min_margin is not None and report.min_margin >= plan.promises["required_margin"]
    assert report.min_clearance is not None and report.min_clearance.distance > 0
    assert str(report) == "accepted for motion"
    assert (report.level, report.reached) == ("motion", "motion")
    assert report.max_hold_slip is not None and report.max_hold_slip < 1e-4


def test_violations_say_when_who_and_how_much(plan: regrasp.Plan, box: regrasp.Scene) -> None:
    limit = box.hand.joints[0].upper

    def beyond_limit(file) -> None:
        file["segments"][1]["waypoints"][0]["joints"][0] = limit + 0.01

    report = regrasp.check(broken(plan, beyond_limit), box)
    assert not report and not report.ok and report.n_violations >= 1
    violation = next(entry for entry in report.violations if entry.kind == "joint_limit")
    assert violation.moment == regrasp.Moment(segment=1, waypoint=0, fraction=0.0)
    assert violation.subjects == (box.hand.joint_names[0],)
    assert violation.amount is not None and violation.limit is not None
    assert str(violation).startswith("JointLimit at segment 1, waypoint 0")
    assert violation.message in violation.text
    assert violation.text in str(report)


def test_a_plan_for_another_scene_is_rejected(plan: regrasp.Plan, scene: regrasp.Scene) -> None:
    report = regrasp.check(plan, scene)
    assert "input_hash_mismatch" in {violation.kind for violation in report.violations}


def test_the_scene_is_found_beside_the_plan(plan: regrasp.Plan, tmp_path: Path) -> None:
    for folder in ("scenes", "assets/hands/wide_four_finger"):
        shutil.copytree(REPOSITORY / folder, tmp_path / folder)
    path = tmp_path / "scenes/plan.json"
    plan.save(path)
    assert regrasp.check(path).ok
    (tmp_path / "scenes/box_90x.toml").unlink()
    with pytest.raises(regrasp.InputError) as caught:
        regrasp.check(regrasp.Plan.from_json(plan.to_json(), name=str(path)), tmp_path / "scenes/box_90x.toml")
    assert caught.value.code == "F001"


def test_the_same_verdict_as_the_command_line(regrasp_cli, plan: regrasp.Plan, tmp_path: Path, box: regrasp.Scene) -> None:
    def lift_early(file) -> None:
        waypoint = file["segments"][0]["waypoints"][1]
        del waypoint["contacts"][0]

    for candidate in (plan, broken(plan, lift_early)):
        candidate.save(tmp_path / "plan.json")
        run = regrasp_cli("check", "plan.json", "--scene", SCENES / "box_90x.toml", "--json")
        events = [json.loads(line) for line in run.stdout.splitlines()]
        said = next(event["report"] for event in events if event["event"] == "check")
        report = regrasp.check(candidate, box)
        assert run.returncode == (0 if report.ok else 1), run.stderr
        assert said["n_violations"] == report.n_violations
        assert [entry["kind"] for entry in said["violations"]] == [entry.kind for entry in report.violations]
