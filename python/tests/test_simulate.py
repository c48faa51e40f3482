"""Replays in MuJoCo: the exported model, the reference in time, verdicts."""

from __future__ import annotations

import io
import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp
from conftest import SCENES

mujoco = pytest.importorskip("mujoco")

from regrasp.simulate import PlanError, Settings, load, simulate  # noqa: E402
from regrasp.simulate.__main__ import main  # noqa: E402
from regrasp.simulate.model import contact_jacobians, make_rig, normals_in_world  # noqa: E402
from regrasp.simulate import measure  # noqa: E402
from regrasp.simulate.plans import flat  # noqa: E402
from regrasp.simulate.reference import (  # noqa: E402
    held_at_waypoints,
    quat_exp,
    quat_product,
    reference,
    rotation_matrices,
    rotation_vector,
    waypoints_of,
)
from regrasp.simulate.replay import Track  # noqa: E402
from regrasp.simulate.torsion import friction_of, saturations, spinning, spins  # noqa: E402

MODELS = Path(os.environ.get("REGRASP_MODELS", SCENES.parents[1] / "shared/models"))


def planned(name: str, seed: int = 1, **settings: Any) -> tuple[regrasp.Plan, str]:
    """A plan and its model."""
    if "/" in name and not MODELS.is_dir():
        pytest.skip("SKIPPED: the shared models are not here")
    packages = {"models": MODELS} if MODELS.is_dir() else {}
    scene = regrasp.load_scene(SCENES / f"{name}.toml", packages=packages)
    # Replays show what plans without forces or rolling cost.
    plan = regrasp.plan(scene, seed=seed, settings=settings, level="geometry")
    assert isinstance(plan, regrasp.Plan), plan
    return plan, regrasp.export_mjcf(plan, scene)


def as_data(plan: regrasp.Plan) -> dict[str, Any]:
    return flat(json.loads(plan.to_json()))


@pytest.fixture(scope="module")
def short() -> Iterator[tuple[dict[str, Any], str]]:
    """A plan of a few seconds."""
    plan, xml = planned("sphere_90x", seed=2)
    yield as_data(plan), xml


@pytest.mark.parametrize("name", ["sphere_90x", "box_90x", "allegro/cube57_z", "shadow/sphere32_z"])
def test_fingertips_of_every_frame_lie_on_their_contacts(name: str) -> None:
    plan, xml = planned(name)
    arrays = np.load(io.BytesIO(plan.to_npz()), allow_pickle=False)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    assert model.nkey == len(arrays["times"])
    qpos_of = [model.joint(str(joint)).qposadr[0] for joint in arrays["joint_names"]]
    names = [str(arrays["contact_mode_names"][k]) for k in range(3)]
    held = 0
    for k in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, k)
        assert data.time == arrays["times"][k]
        np.testing.assert_array_equal(data.qpos[qpos_of], arrays["joints"][k])
        mujoco.mj_kinematics(model, data)
        turn, origin = data.body("object").xmat.reshape(3, 3), data.body("object").xpos
        np.testing.assert_allclose(origin, arrays["object_positions"][k], atol=1e-12)
        for f, finger in enumerate(arrays["fingers"]):
            if names[arrays["contact_modes"][k, f]] == "free":
                continue
            held += 1
            radius = model.geom(f"{finger}:tip").size[0]
            outward = turn @ arrays["contact_normals_in_object"][k, f]
            contact = origin + turn @ arrays["contact_points_in_object"][k, f]
            assert np.linalg.norm(data.site(f"{finger}:tip").xpos - radius * outward - contact) < 0.5e-3
    assert held > 3 * model.nkey


@pytest.mark.parametrize("name", ["sphere_90x", "allegro/cube57_z", "shadow/sphere32_z"])
def test_what_may_touch_does_not_at_any_waypoint_but_for_tips(name: str) -> None:
    # The checker said so; MuJoCo's collision is another way to know, but it has margins of its own.
    plan, xml = planned(name)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    for k in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, k)
        mujoco.mj_forward(model, data)
        for contact in data.contact[: data.ncon]:
            depth = 0.5e-3 if model.geom("object").id in contact.geom else 1e-5
            assert contact.dist > -depth, [model.geom(g).name for g in contact.geom]


def test_coupled_joints_of_the_model_follow() -> None:
    plan, xml = planned("shadow/sphere32_z")
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    couplings = [e for e in range(model.neq) if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT]
    assert len(couplings) == 4
    mujoco.mj_resetDataKeyframe(model, data, model.nkey - 1)
    for e in couplings:
        follower, leader = (data.qpos[model.jnt_qposadr[j]] for j in (model.eq_obj1id[e], model.eq_obj2id[e]))
        assert follower == pytest.approx(model.eq_data[e, 0] + model.eq_data[e, 1] * leader, abs=1e-12)


def test_rotations_agree_with_mujoco() -> None:
    rng = np.random.default_rng(1)
    vectors = rng.normal(size=(50, 3))
    quats = quat_exp(vectors)
    out, turn = np.empty(4), np.empty(9)
    for vector, quat, other in zip(vectors, quats, quats[::-1]):
        mujoco.mju_axisAngle2Quat(out, vector / np.linalg.norm(vector), float(np.linalg.norm(vector)))
        np.testing.assert_allclose(quat, out, atol=1e-12)
        mujoco.mju_quat2Mat(turn, quat)
        np.testing.assert_allclose(rotation_matrices(quat), turn.reshape(3, 3), atol=1e-12)
        mujoco.mju_mulQuat(out, quat, other)
        np.testing.assert_allclose(quat_product(quat, other), out, atol=1e-12)
        if np.linalg.norm(vector) < math.pi:
            np.testing.assert_allclose(rotation_vector(quat), vector, atol=1e-9)


def bezier(a: Any, b: Any, first: Any, last: Any, u: float) -> Any:
    """Cubic by de Casteljau: another way than the one tested."""
    points = [a, a + first / 3.0, b - last / 3.0, b]
    while len(points) > 1:
        points = [(1.0 - u) * p + u * q for p, q in zip(points, points[1:])]
    return points[0]


@pytest.mark.parametrize("speed", [1.0, 2.0])
def test_the_reference_goes_through_the_waypoints_on_cubics(short: tuple[dict[str, Any], str], speed: float) -> None:
    plan, _ = short
    ref = reference(plan, speed=speed)
    points = waypoints_of(plan)
    joints = np.array([point["joints"] for point in points])
    assert ref.n_ticks * ref.tick == pytest.approx(points[-1]["time"] / speed, abs=3 * ref.tick)
    times = np.array([point["time"] for point in points]) / speed
    velocities = np.array([point["joint_velocities"] for point in points]) * speed
    assert np.all((ref.fraction >= 0) & (ref.fraction <= 1))
    for tick in range(0, ref.n_ticks, 7):
        k = ref.waypoint[tick]
        span = times[k + 1] - times[k]
        u = min((times[0] + tick * ref.tick - times[k]) / max(span, 1e-12), 1.0)
        cubic = bezier(joints[k], joints[k + 1], velocities[k] * span, velocities[k + 1] * span, u)
        np.testing.assert_allclose(ref.joints[tick], cubic, atol=1e-10)
        chord = joints[k + 1] - joints[k]
        if chord @ chord > 1e-12:
            np.testing.assert_allclose(ref.fraction[tick], (cubic - joints[k]) @ chord / (chord @ chord), atol=1e-6)
    # Velocities are what the positions do, by differences.
    differences = np.gradient(ref.joints, ref.tick, axis=0)
    largest = np.abs(ref.joint_velocities).max()
    assert largest > 0.05
    assert np.abs(differences - ref.joint_velocities).max() < 0.1 * largest
    quats = np.array([point["world_from_object"]["quat_xyzw"] for point in points])[:, [3, 0, 1, 2]]
    np.testing.assert_allclose(np.abs(ref.object_quat_wxyz[-1] @ quats[-1]), 1.0, atol=1e-12)


def test_torques_of_the_plan_are_those_of_its_forces_in_the_model(short: tuple[dict[str, Any], str]) -> None:
    plan, xml = short
    rig = make_rig(xml, plan, Settings())
    jacobians, _ = contact_jacobians(rig)
    points = waypoints_of(plan)
    for k, point in enumerate(points):
        x, y, z, w = point["world_from_object"]["quat_xyzw"]
        turn = rotation_matrices(np.array([w, x, y, z]))
        torques = np.zeros(len(plan["joint_names"]))
        for f, contact in enumerate(point["contacts"]):
            if contact.get("force_in_object"):
                torques += jacobians[k, f].T @ (turn @ np.array(contact["force_in_object"]))
        np.testing.assert_allclose(point["joint_torques"], torques, atol=1e-9)
    pushes = [c["force_in_object"] for c in points[0]["contacts"]]
    outward = normals_in_world(plan)[0]
    first = points[0]["world_from_object"]["quat_xyzw"]
    turn = rotation_matrices(np.array(first)[[3, 0, 1, 2]])
    assert all((turn @ np.array(push)) @ normal < 0 for push, normal in zip(pushes, outward))


def test_a_static_hold_does_not_creep_and_a_short_plan_is_kept(short: tuple[dict[str, Any], str]) -> None:
    plan, xml = short
    result = simulate(plan, xml, Settings(controller="B"))
    report = result.report
    assert report.drift is not None
    assert report.drift.position < 0.2e-3 and report.drift.angle < math.radians(0.5)
    assert report.kept and report.dropped is None
    assert report.final_position_error < 5e-3 and report.final_angle_error < math.radians(5)
    assert all(0.0 <= slip < 5e-3 for row in report.slip for slip in row if slip is not None)
    again = simulate(plan, xml, Settings(controller="B")).report
    assert json.dumps(again.to_json()) == json.dumps(report.to_json())
    closed = simulate(plan, xml, Settings(controller="C2"), drift=report.drift).report
    assert closed.kept
    assert closed.final_position_error < 2e-3 and closed.final_angle_error < math.radians(2)
    assert closed.final_angle_error < report.final_angle_error


def test_a_load_that_nobody_told_of_is_dropped_and_the_report_says_where(short: tuple[dict[str, Any], str]) -> None:
    plan, xml = short
    report = simulate(plan, xml, Settings(gravity="down", mass_scale=30.0, hold_time=0.0)).report
    assert not report.kept
    assert report.dropped is not None and 0 <= report.dropped.segment < len(plan["segments"])
    assert report.dropped.cause in ("position", "angle", "off the fingers")
    assert report.largest_position_error > 0.01 or report.largest_angle_error > math.radians(20)
    assert report.lost_contacts


def test_torsional_friction_is_made_up_for_from_the_plan_alone() -> None:
    plan, xml = planned("sphere_90x", seed=4)
    data = as_data(plan)
    unaware = simulate(data, xml, Settings(hold_time=0.0, torsion_told=0.0)).report
    aware = simulate(data, xml, Settings(hold_time=0.0)).report
    # The tips of this plan spin; a controller that does not know of it ends degrees off.
    assert unaware.final_angle_error > math.radians(3)
    assert aware.final_angle_error < 0.5 * unaware.final_angle_error
    # Soft fingertips do not spin: there is nothing to make up for.
    rig = make_rig(xml, data, Settings())
    friction, torsion = friction_of(rig)
    assert (friction == 0.8).all() and (torsion == 0.002).all()
    assert spinning(rig, contact_jacobians(rig)[1], 0.0).slips.max() == 0.0


def test_spin_is_that_of_the_tips_seen_from_the_object() -> None:
    plan, xml = planned("sphere_90x", seed=4)
    data = as_data(plan)
    rig = make_rig(xml, data, Settings())
    spun, held = spins(rig), held_at_waypoints(data)
    assert np.abs(spun).sum() > 0.1 and (spun[~held] == 0.0).all()
    # Dahl's model: full within some hundredths of a radian, never more, gone where the finger lets go.
    share = saturations(spun, held)
    assert np.abs(share).max() <= 1.0 and np.abs(share).max() > 0.9
    assert (share[~held] == 0.0).all()


def test_an_object_that_turns_too_far_is_lost_though_it_stays_where_it_was(short: tuple[dict[str, Any], str]) -> None:
    plan, xml = short
    rig = make_rig(xml, plan, Settings())
    ref = reference(plan)
    n = ref.n_ticks
    sensors = np.ones((n, rig.model.nsensordata))
    turned = quat_product(quat_exp(np.linspace(0.0, math.radians(25.0), n)[:, None] * np.array([1.0, 0.0, 0.0])), ref.object_quat_wxyz)
    none = np.zeros(0, np.int64)
    track = Track(ref.object_position, turned, np.zeros((n, len(rig.fingers), 3)), sensors, np.zeros((n, 1)), none, np.zeros((0, 2), np.int32))
    seen = measure.report(rig, ref, track, np.zeros((n, 1)), None, Settings())
    assert not seen.kept and seen.dropped is not None and seen.dropped.cause == "angle"
    track.object_quat_wxyz[:] = ref.object_quat_wxyz
    assert measure.report(rig, ref, track, np.zeros((n, 1)), None, Settings()).kept
    sensors[n // 2 : n // 2 + 10, rig.normal_force] = 0.0
    seen = measure.report(rig, ref, track, np.zeros((n, 1)), None, Settings())
    assert not seen.kept and seen.dropped is not None and seen.dropped.cause == "off the fingers"


def test_without_noslip_every_hold_creeps(short: tuple[dict[str, Any], str]) -> None:
    plan, xml = short
    still = simulate(plan, xml, Settings(gravity="down", speed=50.0)).report.drift
    creeps = simulate(plan, xml, Settings(gravity="down", speed=50.0, noslip=False)).report.drift
    assert still is not None and creeps is not None
    assert creeps.position > 3 * still.position


def test_a_model_of_another_plan_is_refused(short: tuple[dict[str, Any], str]) -> None:
    plan, xml = short
    with pytest.raises(PlanError, match="MuJoCo cannot read"):
        make_rig("<mujoco", plan, Settings())
    *before, last = plan["segments"]
    shorter = {**plan, "segments": [*before, {**last, "waypoints": last["waypoints"][:-1]}]}
    with pytest.raises(PlanError, match="keyframes"):
        make_rig(xml, shorter, Settings())


def test_a_plan_without_forces_is_for_controller_a_only() -> None:
    plan, xml = planned("sphere_90x", forces=None)
    data = as_data(plan)
    with pytest.raises(PlanError, match="no forces"):
        simulate(data, xml, Settings(controller="B"))
    assert simulate(data, xml, Settings(controller="A", hold_time=0.0)).report.largest_torque == 0.0


def test_the_command_line_says_kept_dropped_or_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan, xml = planned("sphere_90x", seed=2)
    plan.save(tmp_path / "plan.json")
    (tmp_path / "model.xml").write_text(xml)
    assert load(str(tmp_path / "plan.json"), mjcf=tmp_path / "model.xml") == (as_data(plan), xml)
    usual = [str(tmp_path / "plan.json"), "--mjcf", str(tmp_path / "model.xml"), "--hold-time", "0"]
    assert main([*usual, "-o", str(tmp_path / "report.json")]) == 0
    assert "KEPT" in capsys.readouterr().out
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["format"] == "regrasp-replay" and report["kept"] is True
    assert main([*usual, "--mass-scale", "30", "--gravity", "down"]) == 1
    assert "LOST (" in capsys.readouterr().out
    (tmp_path / "broken.json").write_text("{")
    assert main([str(tmp_path / "broken.json")]) == 2
    assert "not JSON" in capsys.readouterr().err


def test_a_campaign_replays_plans_that_are_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from regrasp.simulate.campaign import main as campaign

    plan, _ = planned("sphere_90x", seed=2)
    for kind in ("roadmap", "single"):
        (tmp_path / "made" / kind).mkdir(parents=True)
        (tmp_path / "made" / kind / "2.json").write_bytes(plan.to_json())
    scene, made = str(SCENES / "sphere_90x.toml"), str(tmp_path / "made")
    line = [scene, "--made", made, "--gravity", "plan", "--controllers", "C2", "--first-seed", "2", "--seeds", "2", "--processes", "1"]
    assert campaign([*line, "-o", str(tmp_path / "out")]) == 0
    rows = (tmp_path / "out" / "campaign.csv").read_text().splitlines()
    assert len(rows) == 5
    text = capsys.readouterr().out
    for kind in ("roadmap", "single"):
        assert f"| sphere_90x | {kind} | plan | C2 | nominal | 1 of 2 | 1 of 1 |" in text
    assert "3.json is not there" in text
    # A plan that was written since is replayed; what is there of the others stays.
    results = sorted((tmp_path / "out" / "results").rglob("plan-2.json"))
    before = [path.stat().st_mtime_ns for path in results]
    (tmp_path / "made" / "single" / "2.json").write_bytes(plan.to_json())
    assert campaign([*line, "-o", str(tmp_path / "out")]) == 0
    again = {path.parts[-4] for path, time in zip(results, before) if path.stat().st_mtime_ns != time}
    assert again == {"single"}
    capsys.readouterr()
    with pytest.raises(SystemExit):
        campaign([scene, "--made", made, "-o", str(tmp_path / "up")])
    with pytest.raises(SystemExit):
        campaign([scene, "--made", str(tmp_path / "nothing"), "--gravity", "plan", "-o", str(tmp_path / "out")])
    assert "has no folder of plans" in capsys.readouterr().err


def test_one_quaternion_is_computed_as_many_are() -> None:
    quats = np.random.default_rng(2).normal(size=(2, 50, 4))
    products, matrices = quat_product(*quats), rotation_matrices(quats[0])
    for a, b, product, matrix in zip(*quats, products, matrices):
        assert (quat_product(a, b) == product).all() and (rotation_matrices(a) == matrix).all()
        # A product turns as its factors do, one after the other.
        ab = rotation_matrices(product / np.linalg.norm(product))
        one_by_one = rotation_matrices(a / np.linalg.norm(a)) @ rotation_matrices(b / np.linalg.norm(b))
        assert np.allclose(ab, one_by_one, atol=1e-12)
    assert (quat_product(quats[0][0], quats[1]) == quat_product(np.tile(quats[0][0], (50, 1)), quats[1])).all()


def test_hands_whose_root_link_is_called_world_are_replayed(tmp_path: Path) -> None:
    """As in many URDFs. MuJoCo has a body of that name too."""
    hand = SCENES.parent / "assets/hands/wide_four_finger"
    for name in ("hand.toml", "hand.urdf"):
        (tmp_path / name).write_text((hand / name).read_text().replace('"palm"', '"world"'))
    text = (SCENES / "sphere_90x.toml").read_text()
    scene = tmp_path / "scene.toml"
    scene.write_text(text.replace("../assets/hands/wide_four_finger/hand.toml", "hand.toml"))
    plan = regrasp.plan(scene, seed=2)
    assert isinstance(plan, regrasp.Plan), plan
    model = mujoco.MjModel.from_xml_string(regrasp.export_mjcf(plan, regrasp.load_scene(scene)))
    names = [model.body(index).name for index in range(model.nbody)]
    assert names.count("world") == 1 and "world_" in names
