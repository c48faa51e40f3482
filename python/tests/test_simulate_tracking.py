"""Replays of tracking plans in MuJoCo: free fingertips, contacts that slide as planned."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp
from conftest import REPOSITORY, SCENES

pytest.importorskip("mujoco")

from regrasp.simulate import Settings, simulate  # noqa: E402
from regrasp.simulate.measure import planned_sliding  # noqa: E402
from regrasp.simulate.model import REFERENCE_REACH, REFERENCE_STIFFNESS, contact_jacobians, make_rig  # noqa: E402
from regrasp.simulate.model import normals_in_world  # noqa: E402
from regrasp.simulate.plans import flat  # noqa: E402
from regrasp.simulate.reference import reference, rotation_matrices, waypoints_of  # noqa: E402
from regrasp.simulate.torsion import spinning  # noqa: E402


@pytest.fixture(scope="module")
def football(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[dict[str, Any], str]]:
    """The football turned by some 7 degrees, and its model."""
    text = (SCENES / "football.toml").read_text()
    text = text.replace("../assets", str(REPOSITORY / "assets"))
    goal = "rotation_vector = [-0.6, -0.5, 0.8]"
    assert goal in text
    path: Path = tmp_path_factory.mktemp("scenes") / "football.toml"
    path.write_text(text.replace(goal, "rotation_vector = [0.5, 0.7, 0.52]"))
    scene = regrasp.load_scene(path)
    plan = regrasp.plan(scene, seed=1)
    assert isinstance(plan, regrasp.Plan), plan
    yield flat(json.loads(plan.to_json())), regrasp.export_mjcf(plan, scene)


def test_torques_of_free_fingertips_are_those_of_their_forces(football: tuple[dict[str, Any], str]) -> None:
    plan, xml = football
    jacobians, _ = contact_jacobians(make_rig(xml, plan, Settings()))
    slides = 0
    for k, point in enumerate(waypoints_of(plan)):
        turn = rotation_matrices(np.array(point["world_from_object"]["quat_xyzw"])[[3, 0, 1, 2]])
        torques = np.zeros(len(plan["joint_names"]))
        for f, contact in enumerate(point["contacts"]):
            slides += contact["mode"] == "sliding"
            torques += jacobians[k, f].T @ (turn @ np.array(contact["force_in_object"]))
        np.testing.assert_allclose(point["joint_torques"], torques, atol=1e-8)
    assert slides > 10


def test_free_fingertips_are_as_stiff_as_those_of_fingers(football: tuple[dict[str, Any], str]) -> None:
    plan, xml = football
    rig = make_rig(xml, plan, Settings())
    jacobians, _ = contact_jacobians(rig)
    compliance = np.einsum("fij,fkj->fik", jacobians[0] / rig.stiffness, jacobians[0])
    tip = REFERENCE_STIFFNESS / REFERENCE_REACH**2
    # Along the normal the slides give alone; across it the tip turns as well.
    normals = normals_in_world(plan)[0]
    np.testing.assert_allclose(np.einsum("fi,fij,fj->f", normals, compliance, normals), 1.0 / tip, rtol=1e-6)
    assert np.all(np.linalg.eigvalsh(compliance)[:, -1] < 2.01 / tip)


def test_planned_sliding_adds_up_to_the_way_of_the_plan(football: tuple[dict[str, Any], str]) -> None:
    plan, xml = football
    rig = make_rig(xml, plan, Settings())
    ref = reference(plan)
    longest = 0.0
    for f in range(len(rig.fingers)):
        velocity = planned_sliding(rig, ref, f)
        way = np.zeros(3)
        for segment in plan["segments"]:
            for a, b in zip(segment["waypoints"], segment["waypoints"][1:]):
                way += (b["time"] - a["time"]) * np.array(a["contacts"][f]["relative_velocity_in_object"])
        np.testing.assert_allclose(velocity.sum(axis=0) * ref.tick, way, atol=1e-12)
        longest = max(longest, float(np.linalg.norm(way)))
    assert longest > 1e-3


def test_creep_of_spinning_tips_is_undone_where_they_slide(football: tuple[dict[str, Any], str]) -> None:
    plan, xml = football
    rig = make_rig(xml, plan, Settings())
    crept = np.linalg.norm(spinning(rig, contact_jacobians(rig)[1]).slips, axis=2)
    undone = grown = first = 0
    for segment in plan["segments"]:
        last = first + len(segment["waypoints"]) - 1
        for f, contact in enumerate(segment["waypoints"][0]["contacts"]):
            change = crept[last, f] - crept[first, f]
            if contact["mode"] == "sliding":
                assert change <= 0.0
                undone += change < 0.0
            else:
                grown += change > 0.0
        first = last + 1
    assert undone > 0 and grown > 0


def test_a_short_tracking_plan_is_kept_and_slides_as_planned(football: tuple[dict[str, Any], str]) -> None:
    plan, xml = football
    report = simulate(plan, xml, Settings(controller="H", hold_time=2.0)).report
    assert report.drift is not None and report.drift.position < 0.2e-3
    assert report.kept and not report.unplanned_contacts
    assert report.final_position_error < 5e-3 and report.final_angle_error < math.radians(3)
    again = simulate(plan, xml, Settings(controller="H", hold_time=0.0), drift=report.drift).report
    assert again.final_position_error == report.final_position_error
    # A squeeze by position alone, with nothing of the plan's forces, does worse or drops it.
    squeezed = simulate(plan, xml, Settings(controller="A", hold_time=0.0)).report
    assert not squeezed.kept or squeezed.final_angle_error > report.final_angle_error
