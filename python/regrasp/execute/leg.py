"""A plan made ready to be executed: what to command, where the fingertips should be, how the fingers move the object."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np

from .._plan import Plan
from .._planning import export_mjcf
from ..simulate._mujoco import mujoco
from ..simulate.controllers import Controller, Feedback
from ..simulate.model import Rig, Settings, forces_in_world, make_rig, normals_in_world, with_plan
from ..simulate.plans import flat
from ..simulate.reference import Array, Reference, reference, rotation_matrices
from .plant import Command


def first_rig(plan: Plan, settings: Settings, stiffness: Array | None = None, damping: Array | None = None) -> Rig:
    """The model of the plan's scene, undisturbed, with the gains of the robot where those are given."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        xml = export_mjcf(plan)
    rig = make_rig(xml, flat(json.loads(plan.to_json())), settings)
    if stiffness is None:
        return rig
    return replace(rig, stiffness=np.array(stiffness), damping=np.zeros(len(stiffness)) if damping is None else np.array(damping))


class Leg:
    """One plan on one model."""

    def __init__(self, plan: Plan, rig: Rig, settings: Settings) -> None:
        self.plan = plan
        self.rig = with_plan(rig, flat(json.loads(plan.to_json())))
        self.ref: Reference = reference(self.rig.plan, tick=settings.tick, speed=settings.speed)
        self._controller = Controller(self.rig, self.ref, settings)
        self.feedback: Feedback | None = (
            self._controller.feedback(self.rig, self.ref, settings) if self._controller.has_feedback else None
        )
        jacobians, contacts = self._controller.contacts
        self._twists = _object_twists(self.rig, self.ref, jacobians, contacts)
        self._tips = self.ref.blend(_tips_in_object(self.rig))
        self._normals = self.ref.blend(_normals_in_object(self.rig))
        pushes = -np.einsum("kfi,kfi->kf", forces_in_world(self.rig.plan), normals_in_world(self.rig.plan))
        self.normal_forces: Array = self.ref.blend(pushes)
        """Normal force of every finger as planned, at every tick, in newtons."""
        self._qpos = self.rig.configurations[0].copy()
        self._data: Any = mujoco.MjData(self.rig.model)
        model = self.rig.model
        simple = [joint for joint in range(model.njnt) if int(model.jnt_type[joint]) >= int(mujoco.mjtJoint.mjJNT_SLIDE)]
        self._addresses = np.array([model.jnt_qposadr[joint] for joint in simple])
        self._dofs = np.array([model.jnt_dofadr[joint] for joint in simple])

    @property
    def n_ticks(self) -> int:
        """Length of the motion, in ticks."""
        return self.ref.n_ticks

    def command(self, k: int, position: Array, quat_wxyz: Array, *, moves: bool) -> Array:
        """What the servos are told at tick ``k`` with the object at this pose; with ``moves`` false, as if it stopped there."""
        first = self.rig.object_qpos
        self._qpos[first : first + 3] = position
        self._qpos[first + 3 : first + 7] = quat_wxyz
        servo = self.feedback.command(k, self._qpos) if self.feedback is not None else self._controller.commands[k]
        if not moves:
            servo = servo - self.rig.damping * self.ref.joint_velocities[k]
        return servo

    def as_command(self, k: int, servo: Array, *, moves: bool) -> Command:
        """The same for every kind of drive."""
        velocities = self.ref.joint_velocities[k] if moves else np.zeros(len(servo))
        positions = (servo - self.rig.damping * velocities) / self.rig.stiffness
        return Command(servo, positions, velocities)

    def object_motion(self, k: int, joint_change: Array) -> tuple[Array, Array]:
        """How the object's origin moves, and how it turns, when the joints move so and the holding fingers take it along."""
        twist = self._twists[self.ref.waypoint[k]] @ joint_change
        return twist[:3], twist[3:]

    def tips(self, joints: Array) -> Array:
        """Centres of the fingertips in the world, shape (n_fingers, 3)."""
        model, data = self.rig.model, self._data
        data.qpos[:] = self._qpos
        moved = self.rig.drives @ (joints - self.ref.joints[0])
        data.qpos[self._addresses] = self.rig.configurations[0][self._addresses] + moved[self._dofs]
        mujoco.mj_kinematics(model, data)
        return data.site_xpos[[finger.site for finger in self.rig.fingers]].copy()

    def slips(self, k: int, tips: Array, position: Array, quat_wxyz: Array) -> Array:
        """How far every fingertip is from its planned place over the object, along the surface, in the object frame: shape
        (n_fingers, 3); zero for those that do not hold."""
        turn = rotation_matrices(quat_wxyz)
        off = (tips - position) @ turn - self._tips[k]
        normals = self._normals[k]
        across = off - (off * normals).sum(axis=1, keepdims=True) * normals
        return np.where(self.ref.holds[k][:, None], across, 0.0)


def _object_twists(rig: Rig, ref: Reference, jacobians: Array, contacts: Array) -> Array:
    """Velocity of the object's origin and its angular velocity over those of the joints, at every waypoint: shape (n_waypoints,
    6, n_joints). Least squares over the fingers that hold there: their tips take the object along."""
    from ..simulate.reference import held_at_waypoints, waypoints_of

    origins = np.array([point["world_from_object"]["position"] for point in waypoints_of(rig.plan)])
    held = held_at_waypoints(rig.plan).astype(np.float64)
    arms = contacts - origins[:, None, :]
    n, n_fingers = held.shape
    # Angles count with the object's radius, so that both halves of a twist are metres.
    scale = rig.radius
    rows = np.zeros((n, n_fingers, 3, 6))
    rows[..., :3] = np.eye(3)
    x, y, z = np.moveaxis(arms, -1, 0)
    for (i, j), value in {(0, 4): z, (0, 5): -y, (1, 3): -z, (1, 5): x, (2, 3): y, (2, 4): -x}.items():
        rows[..., i, j] = value / scale
    rows *= held[..., None, None]
    inverse: Any = np.linalg.pinv(rows.reshape(n, 3 * n_fingers, 6), rcond=1e-3)
    twists = inverse @ (jacobians * held[..., None, None]).reshape(n, 3 * n_fingers, -1)
    twists[:, 3:] /= scale
    return twists


def _tips_in_object(rig: Rig) -> Array:
    """Centres of the fingertips in the object frame, at every waypoint."""
    data: Any = mujoco.MjData(rig.model)
    sites = [finger.site for finger in rig.fingers]
    out = np.empty((len(rig.configurations), len(sites), 3))
    first = rig.object_qpos
    for k, configuration in enumerate(rig.configurations):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(rig.model, data)
        out[k] = (data.site_xpos[sites] - configuration[first : first + 3]) @ rotation_matrices(
            configuration[first + 3 : first + 7]
        )
    return out


def _normals_in_object(rig: Rig) -> Array:
    turns = rotation_matrices(rig.configurations[:, rig.object_qpos + 3 : rig.object_qpos + 7])
    return np.einsum("kij,kfi->kfj", turns, normals_in_world(rig.plan))
