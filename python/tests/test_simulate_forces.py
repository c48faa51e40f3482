"""Contact forces of replays: they turn with the object, and stay in friction cones where fingertips spin."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import regrasp
from conftest import SCENES

mujoco = pytest.importorskip("mujoco")

from regrasp.simulate import Settings, simulate  # noqa: E402
from regrasp.simulate.controllers import Controller  # noqa: E402
from regrasp.simulate.model import Rig, contact_jacobians, forces_in_world, make_rig, normals_in_world  # noqa: E402
from regrasp.simulate.plans import flat  # noqa: E402
from regrasp.simulate.reference import held_at_waypoints, quat_exp, quat_product, reference, rotation_matrices  # noqa: E402
from regrasp.simulate.torsion import Cones, forces_in_cones, friction_of, spinning  # noqa: E402


def planned(name: str, seed: int, **settings: Any) -> tuple[dict[str, Any], str]:
    """A plan, and its model."""
    scene = regrasp.load_scene(SCENES / f"{name}.toml")
    plan = regrasp.plan(scene, seed=seed, settings=settings)
    assert isinstance(plan, regrasp.Plan), plan
    return flat(json.loads(plan.to_json())), regrasp.export_mjcf(plan, scene)


def command(rig: Rig, settings: Settings, k: int, turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Command at tick ``k``, with the object off by a rotation vector and a way."""
    ref = reference(rig.plan)
    feedback = Controller(rig, ref, settings).feedback(rig, ref, settings)
    qpos = rig.configurations[0].copy()
    first = rig.object_qpos
    qpos[first : first + 3] = ref.object_position[k] + shift
    qpos[first + 3 : first + 7] = quat_product(quat_exp(turn), ref.object_quat_wxyz[k])
    return feedback.command(k, qpos)


def test_forces_turn_with_the_object_as_far_as_it_is_turned_and_no_farther() -> None:
    plan, xml = planned("box_90x", 1)
    rig = make_rig(xml, plan, Settings(controller="C2"))
    jacobians, _ = contact_jacobians(rig)
    forces = forces_in_world(plan)
    ref = reference(plan)
    shift = np.array([0.001, -0.002, 0.0005])
    rng = np.random.default_rng(3)
    for k in rng.integers(0, ref.n_ticks, 8):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        for angle, told in ((0.03, 0.03), (0.5, 0.2)):
            turn, felt = angle * axis, told * axis
            with_, without = (command(rig, Settings(controller="C2", forces_turn=on), k, turn, shift) for on in (True, False))
            # Forces turned by the whole rotation, at the waypoints around the tick.
            turned = forces @ rotation_matrices(quat_exp(felt)).T
            expected = ref.blend(np.einsum("kfij,kfi->kj", jacobians, turned - forces))[k]
            # Beside first order there is a half of the angle's square; forces here are below 15 N, arms below 0.15 m.
            assert np.abs(with_ - without - expected).max() <= 0.75 * told**2 * 15.0 * 0.15, (k, angle)
            assert np.abs(expected).max() > 0.0
    for on in (True, False):
        assert not np.any(
            command(rig, Settings(controller="C2", forces_turn=on), 5, np.zeros(3), np.zeros(3)) - Controller(rig, ref, Settings()).commands[5]
        )


def test_offsets_stay_as_they_are_while_they_are_frozen() -> None:
    plan, xml = planned("box_90x", 1)
    settings = Settings(controller="C2")
    rig = make_rig(xml, plan, settings)
    ref = reference(plan)
    feedback = Controller(rig, ref, settings).feedback(rig, ref, settings)
    qpos = rig.configurations[0].copy()
    qpos[rig.object_qpos] += 0.002
    sums = []
    for is_frozen in (False, True, False):
        feedback.is_frozen = is_frozen
        commands = np.array([feedback.command(0, qpos) for _ in range(500)])
        assert bool(np.ptp(commands, axis=0).max() == 0.0) == is_frozen
        sums.append(float(np.linalg.norm(feedback.offsets)))
    assert 0.0 < sums[0] == sums[1] < sums[2]


@pytest.mark.parametrize("largest", [0.004, 0.01])
def test_offsets_end_at_the_largest(largest: float) -> None:
    """An object that is held where it should not be: feedback pushes no farther, and comes back."""
    plan, xml = planned("box_90x", 1)
    settings = Settings(controller="C2", largest_offset=largest)
    rig = make_rig(xml, plan, settings)
    ref = reference(plan)
    feedback = Controller(rig, ref, settings).feedback(rig, ref, settings)
    qpos = rig.configurations[0].copy()
    there = qpos[rig.object_qpos : rig.object_qpos + 3].copy()
    for shift, n_ticks in ((-0.02, 2000), (0.001, 1)):
        qpos[rig.object_qpos : rig.object_qpos + 3] = there + shift
        for _ in range(n_ticks):
            feedback.command(0, qpos)
        assert (np.abs(feedback.offsets).max() == pytest.approx(largest, rel=1e-12)) == (shift < 0.0)


def test_joints_stop_at_their_limits() -> None:
    """Pushed with 0.7 N m by each motor, as 15 N on a fingertip do, from the inside of both limits."""
    plan, xml = planned("sphere_90x", 0)
    rig = make_rig(xml, plan, Settings(controller="C2"))
    model = rig.model
    # Fingers alone, without contacts and weight.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_GRAVITY
    model.actuator_gainprm[:, 0], model.actuator_biasprm[:] = 1.0, 0.0
    joints = [model.joint(name).id for name in rig.joint_names]
    low, high = model.jnt_range[joints].T
    assert model.jnt_limited[joints].all()
    for push, stops in ((0.7, high), (-0.7, low)):
        data = mujoco.MjData(model)
        data.qpos[:] = rig.configurations[0]
        data.qpos[model.jnt_qposadr[joints]] = stops - 0.05 * np.sign(push)
        data.ctrl[rig.motors] = push
        for _ in range(1000):
            mujoco.mj_step(model, data)
        beyond = (data.qpos[model.jnt_qposadr[joints]] - stops) * np.sign(push)
        assert np.all((-0.001 < beyond) & (beyond < 0.002)), beyond


def test_fingers_that_press_harder_move_nothing_and_spare_their_motors() -> None:
    """What is added are forces without a sum or moments, as far as the motors have them: by projection onto the forces that have none."""
    plan, xml = planned("box_90x", 1)
    rig = make_rig(xml, plan, Settings(controller="C2"))
    jacobians, contacts = contact_jacobians(rig)
    forces, held, ref = forces_in_world(plan), held_at_waypoints(plan), reference(plan)
    inner = np.zeros(forces.shape)
    for k in range(len(forces)):
        rows = _sums(contacts[k][held[k]])
        inner[k][held[k]] = ((np.eye(rows.shape[1]) - np.linalg.pinv(rows) @ rows) @ forces[k][held[k]].ravel()).reshape(-1, 3)
    torques = np.einsum("kfij,kfi->kj", jacobians, inner)
    planned_torques = np.array([point["joint_torques"] for segment in plan["segments"] for point in segment["waypoints"]])
    assert np.abs(inner).max() > 1.0
    for k in (0, ref.n_ticks // 3, ref.n_ticks - 1):
        commands: list[np.ndarray] = []
        for extra in (0.0, 0.25, 50.0):
            feedback = Controller(rig, ref, Settings(controller="C2")).feedback(rig, ref, Settings(controller="C2"))
            feedback.extra = extra
            qpos = rig.configurations[0].copy()
            first = rig.object_qpos
            qpos[first : first + 3], qpos[first + 3 : first + 7] = ref.object_position[k], ref.object_quat_wxyz[k]
            commands.append(feedback.command(k, qpos))
        assert np.abs(commands[1] - commands[0] - 0.25 * ref.blend(torques)[k]).max() < 1e-6
        # However hard it is asked to, no motor is told more than its plan may: 1 N m here. One of them is.
        most = np.abs(commands[2] - commands[0] + ref.blend(planned_torques)[k]).max()
        assert 0.97 < most < 1.0 + 1e-9


@pytest.mark.parametrize("name", ["box_90x", "sphere_90x"])
def test_soft_fingers_that_press_hard_turn_the_object_out_unless_forces_turn_with_it(name: str) -> None:
    plan, xml = planned(name, 2, forces={"squeeze": 6.0})
    verdicts = [
        simulate(
            plan, xml, Settings(controller="C2", forces_turn=on, stiffness_scale=0.15, start_turn=(0.0, 0.0, 0.05), hold_time=0.0)
        ).report
        for on in (True, False)
    ]
    assert verdicts[0].kept and not verdicts[1].kept
    assert verdicts[0].final_position_error < 0.001 and verdicts[0].final_angle_error < np.radians(2.0)


def test_forces_that_make_up_for_spin_stay_in_the_cones_that_the_plan_counts_on() -> None:
    """Of ten plans of the box those whose least forces leave the cones."""
    outside = 0
    for seed in range(10):
        plan, xml = planned("box_90x", seed)
        rig = make_rig(xml, plan, Settings())
        _, contacts = contact_jacobians(rig)
        spin = spinning(rig, contacts)
        normals, held = normals_in_world(plan), held_at_waypoints(plan)
        forces = forces_in_world(plan) + spin.forces
        assert not np.any(spin.forces[~held])
        # The sum of what is added, and its moments with those of the spin, about the world's origin: nothing.
        assert np.abs(spin.forces.sum(axis=1)).max() < 1e-9
        moments = np.cross(contacts, spin.forces).sum(axis=1) + (spin.moments[:, :, None] * normals).sum(axis=1)
        assert np.abs(moments).max() < 1e-9
        along = -(forces * normals).sum(axis=2)
        across = np.linalg.norm(forces + along[:, :, None] * normals, axis=2)
        ratio = np.where(held, across / np.maximum(along, 1e-9), 0.0)
        friction, _ = friction_of(rig)
        least = np.array([_least_of(rig, contacts, spin.moments, k) for k in range(len(contacts))])
        outside += bool((least > plan["promises"]["friction"] + 0.02).any())
        # At most 0.01 more friction than is counted on, or less than the least forces need: some grasps have nothing better.
        assert np.all((ratio.max(axis=1) < plan["promises"]["friction"] + 0.01) | (ratio.max(axis=1) < least)), seed
        assert np.all(ratio < friction), seed
    assert outside >= 2


def _least_of(rig: Rig, contacts: np.ndarray, moments: np.ndarray, k: int) -> float:
    """Friction that is needed at waypoint ``k`` with the least forces against these moments, by a pseudoinverse."""
    held = held_at_waypoints(rig.plan)[k]
    normals, planned_forces = normals_in_world(rig.plan)[k][held], forces_in_world(rig.plan)[k][held]
    rows = _sums(contacts[k][held])
    wrench = np.concatenate((np.zeros(3), -(moments[k][held][:, None] * normals).sum(axis=0)))
    forces = planned_forces + (np.linalg.pinv(rows) @ wrench).reshape(-1, 3)
    along = -(forces * normals).sum(axis=1)
    across = np.linalg.norm(forces + along[:, None] * normals, axis=1)
    return float((across / np.maximum(along, 1e-9)).max())


def _sums(points: np.ndarray) -> np.ndarray:
    """Matrix that takes forces at points to their sum and their moments."""
    return np.vstack([np.hstack([np.eye(3)] * len(points)), np.hstack([np.cross(np.eye(3), -point).T for point in points])])


def test_forces_in_cones_are_the_nearest_of_all_that_balance() -> None:
    """Compared with forces drawn in the same cones with the same sums: none is nearer."""
    rng = np.random.default_rng(11)
    arms = 0.03 * np.array([[1.0, 0.1, 0.0], [-1.0, 0.0, 0.1], [0.1, 1.0, 0.2], [0.0, -1.0, -0.1]])
    normals = np.round(arms / 0.03)
    cones = Cones(normals, 0.5, 1.0)
    n_bound = 0
    for _ in range(20):
        planned_forces = cones.nearest(-normals * rng.uniform(1.0, 6.0, (4, 1)) + rng.normal(size=(4, 3)))
        added = 0.7 * rng.normal(size=(4, 3))
        found = forces_in_cones(planned_forces, added, arms, cones)
        rows = _sums(arms)
        assert np.abs(rows @ (found - added).ravel()).max() < 1e-9
        forces = planned_forces + found
        if np.abs(forces - cones.nearest(forces)).max() > 5e-3:
            continue  # there are none inside: nothing to compare with
        n_bound += bool(np.abs(found - added).max() > 1e-2)
        free = np.linalg.svd(rows)[2][6:]
        nearest = np.inf
        for scale in (0.03, 0.1, 0.3, 1.0):
            for step in scale * rng.normal(size=(300, len(free))) @ free:
                other = forces + step.reshape(4, 3)
                if np.abs(other - cones.nearest(other)).max() < 1e-9:
                    nearest = min(nearest, float(np.linalg.norm(other - planned_forces - added)))
        # What changes the planned forces least, of those with these sums, is what is nearest to the ones asked for.
        assert np.linalg.norm(found - added) <= nearest + 1e-2
    assert n_bound >= 5
