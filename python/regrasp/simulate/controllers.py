"""What the joints are told: physics notes, section 1 (controllers) and section 6."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .model import Rig, Settings, angular_jacobians, contact_jacobians, forces_in_world, gravity_of, inverses, normals_in_world
from .reference import Array, Reference, held_at_waypoints, rotation_matrices, waypoints_of
from .torsion import Spinning, least_forces, spinning

#: Speed at which a tip that landed with an offset away from the object comes back to where it presses as planned, in metres per second.
RETURN_SPEED = 0.005
#: Controller H: share of a tip's stiffness along the normal that is taken away. A tip that slides, or stands where the object
#: slides over it, must press as planned wherever the object is (hybrid control: Raibert, Craig 1981).
NORMAL_GIVE = 0.9
#: Forces turn with the object up to this angle, in radians: an object that is farther off is not where they were planned for.
LARGEST_TURN = 0.2
#: Time in which a free finger takes up the error of the object, in seconds.
FREE_FOLLOW_TIME = 0.05


class Controller:
    """Commands of a replay: computed in advance for A and B, corrected at every tick for C2 and H."""

    def __init__(self, rig: Rig, ref: Reference, settings: Settings) -> None:
        jacobians, contacts = contact_jacobians(rig)
        self._inverses = inverses(jacobians)
        self._contacts = contacts
        self._jacobians = jacobians
        torques = _torques(rig, jacobians, contacts, settings)
        spin = None
        if settings.controller != "A" and settings.torsion_told != 0.0:
            spin = spinning(rig, contacts, settings.torsion_told)
            torques = torques + _against_torsion(rig, jacobians, spin)
        self._planned_torques = torques
        self.torques = ref.blend(torques)
        """Fed forward, at every tick."""
        targets = ref.joints
        if spin is not None:
            targets = targets + ref.blend(np.einsum("kjfl,kfl->kj", self._inverses, spin.slips))
        if settings.controller == "A":
            held = held_at_waypoints(rig.plan)
            inward = -settings.squeeze * normals_in_world(rig.plan) * held[:, :, None]
            targets = targets + ref.blend(np.einsum("kjfl,kfl->kj", self._inverses, inward))
        self.servo = rig.stiffness * targets + rig.damping * ref.joint_velocities
        """Commands without torques, at every tick."""
        self.commands = self.servo + self.torques
        """Commands at every tick."""
        self.has_feedback = settings.controller in ("C2", "H")

    @property
    def contacts(self) -> tuple[Array, Array]:
        """Jacobians of the contacts, and where they are in the world, at every waypoint: as ``contact_jacobians`` has them."""
        return self._jacobians, self._contacts

    def feedback(self, rig: Rig, ref: Reference, settings: Settings) -> Feedback:
        """A fresh feedback loop over these commands."""
        feedback = Feedback(rig, ref, settings, self.commands, self._inverses, self._contacts)
        pressing = _pressing_torques(rig, self._jacobians, self._contacts)
        feedback.press_by(pressing, _room_for(pressing, self._planned_torques, rig))
        if settings.forces_turn:
            feedback.turn_forces(_torques_of_turns(rig, self._jacobians))
        if settings.controller == "H":
            feedback.give(NORMAL_GIVE, rig, self._jacobians)
        return feedback


class Feedback:
    """C2: the error of the object's pose, integrated slowly as an offset of every fingertip.

    A pressing finger's offset grows by gain * (displacement that its contact lacks). A free finger takes up the
    displacement of the real object from the planned one, so that it lands where it should on the real object; offsets are
    continuous over landing and lifting. No finger presses less than planned: where friction holds the object in a wrong pose,
    a finger that retreats would only lose its contact.

    Forces turn with the object, where it is turned from its plan. Forces that two fingers press with from opposite sides, and that keep
    their directions in the world, turn an object on that is turned a little, by their moment 2 f r sin(angle) at the distance 2 r. Only the
    stiffness k of the fingers holds against that, by 2 k r^2 angle: not where f > k r. Forces that turn with the object have no such moment, and
    stay in their friction cones (stiffness of a grasp by its forces: Cutkosky, Kao 1989).

    H: beside that, targets of pressing tips follow the tips along the normal by the share `give`.
    """

    def __init__(
        self,
        rig: Rig,
        ref: Reference,
        settings: Settings,
        commands: Array,
        inverse: Array,
        contacts: Array,
    ) -> None:
        self._commands = commands
        n_joints = commands.shape[1]
        self._inverse = (rig.stiffness[:, None] * inverse.reshape(len(inverse), n_joints, -1)).copy()
        self._arms = ref.blend(contacts) - ref.object_position[:, None, :]
        self._normals = ref.blend(normals_in_world(rig.plan))
        self._farthest_out = np.where(ref.presses, 0.0, np.inf)
        self._ref = ref
        pressing = ref.presses[:, :, None].astype(np.float64)
        self._leak = (1.0 - pressing) * (settings.tick / FREE_FOLLOW_TIME)
        self._gain = pressing * (settings.feedback_gain * settings.tick) - self._leak
        self._return = RETURN_SPEED * settings.tick
        self._largest_offset = settings.largest_offset
        self._offsets = np.zeros((len(rig.fingers), 3))
        self.is_frozen = False
        """Whether offsets stay as they are, wherever the object is: fingers rest."""
        self._turning: Array | None = None
        self._pressing_by: Array | None = None
        self._most_extra = np.zeros(0)
        self.extra = 0.0
        """How much harder fingers press than planned, in shares of the forces that they press with."""
        self._give = 0.0
        self._jacobians = np.zeros(0)
        self._joint_qpos = np.zeros(0, dtype=np.int64)
        self._pressing = ref.presses.astype(np.float64)
        self._position = slice(rig.object_qpos, rig.object_qpos + 3)
        self._quat = slice(rig.object_qpos + 3, rig.object_qpos + 7)

    def press_by(self, at_waypoints: Array, most: Array) -> None:
        """Takes over the torques of the forces that fingers press with, shape (n_waypoints, n_joints), and how many times more of them the
        motors have, shape (n_waypoints,)."""
        self._pressing_by = self._ref.blend(at_waypoints)
        self._most_extra = self._ref.blend(most)

    def turn_forces(self, at_waypoints: Array) -> None:
        """Adds the torques ``at_waypoints @ turn`` where the object is turned from its plan by the rotation vector ``turn``; shape
        (n_waypoints, n_joints, 3)."""
        self._turning = self._ref.blend(at_waypoints)

    def give(self, share: float, rig: Rig, jacobians: Array) -> None:
        """Takes ``share`` of the stiffness along the normal from pressing tips."""
        self._give = share
        self._jacobians = jacobians
        model = rig.model
        joints = [model.jnt_qposadr[model.joint(name).id] for name in rig.joint_names]
        self._joint_qpos = np.array(joints, dtype=np.int64)

    @property
    def offsets(self) -> Array:
        """Offsets of the fingertips' targets, in the world; shape (n_fingers, 3)."""
        return self._offsets

    def carry(self, offsets: Array) -> None:
        """Begins with these offsets, those of the motion before."""
        np.copyto(self._offsets, offsets)

    def command(self, k: int, qpos: Array) -> Array:
        """The command at tick ``k``, with the object where ``qpos`` has it."""
        ref = self._ref
        x, y, z = ref.object_position[k] - qpos[self._position]
        a, b, c = _turn(ref.object_quat_wxyz[k], qpos[self._quat])
        arms = self._arms[k]
        offsets, normals = self._offsets, self._normals[k]
        if not self.is_frozen:
            lacking = np.empty_like(arms)
            lacking[:, 0] = x + b * arms[:, 2] - c * arms[:, 1]
            lacking[:, 1] = y + c * arms[:, 0] - a * arms[:, 2]
            lacking[:, 2] = z + a * arms[:, 1] - b * arms[:, 0]
            change = self._gain[k] * lacking - self._leak[k] * offsets
            # Where it is beyond the limit, because the finger landed so, it comes back without a jump.
            limits = np.maximum(self._farthest_out[k], (offsets * normals).sum(axis=1) - self._return)
            np.maximum(-self._largest_offset, np.minimum(self._largest_offset, offsets + change), out=offsets)
            too_far = (offsets * normals).sum(axis=1) - limits
            offsets -= np.maximum(too_far, 0.0)[:, None] * normals
        shifted = offsets
        if self._give > 0.0:
            moved = self._jacobians[ref.waypoint[k]] @ (qpos[self._joint_qpos] - ref.joints[k])
            given = self._give * self._pressing[k] * ((moved - offsets) * normals).sum(axis=1)
            shifted = offsets + given[:, None] * normals
        command = self._commands[k] + self._inverse[ref.waypoint[k]] @ shifted.ravel()
        extra = 0.0 if self.extra == 0.0 else min(self.extra, float(self._most_extra[k]))
        if self._turning is not None:
            share = min(1.0, LARGEST_TURN / max(math.sqrt(a * a + b * b + c * c), 1e-12)) * (1.0 + extra)
            command += self._turning[k] @ np.array((-share * a, -share * b, -share * c))
        if extra > 0.0 and self._pressing_by is not None:
            command += extra * self._pressing_by[k]
        return command


def _turn(to: Array, from_: Array) -> tuple[float, float, float]:
    """Rotation vector that turns the orientation ``from_`` into ``to``, for small angles; numpy is slow on three numbers."""
    aw, ax, ay, az = to.tolist()
    bw, bx, by, bz = from_.tolist()
    w = aw * bw + ax * bx + ay * by + az * bz
    s = 2.0 if w >= 0.0 else -2.0
    return (
        s * (-aw * bx + ax * bw - ay * bz + az * by),
        s * (-aw * by + ax * bz + ay * bw - az * bx),
        s * (-aw * bz - ax * by + ay * bx + az * bw),
    )


def _torques(rig: Rig, jacobians: Array, contacts: Array, settings: Settings) -> Array:
    """Torques that make the plan's contact forces, at every waypoint: none for a squeeze by position.

    A plan for gravity of any direction balances no weight: the least forces that balance the weight are added.
    """
    points = waypoints_of(rig.plan)
    if settings.controller == "A":
        return np.zeros((len(points), len(rig.plan["joint_names"])))
    torques = np.array([point["joint_torques"] for point in points], dtype=np.float64)
    promised: dict[str, Any] = rig.plan["promises"].get("forces") or {}
    if "gravity_in_world" in promised:
        return torques
    lift = -float(promised["mass"]) * gravity_of(rig, settings.gravity) if "mass" in promised else np.zeros(3)
    held = held_at_waypoints(rig.plan)
    center = np.array(rig.model.body_ipos[rig.object_body])
    for k, point in enumerate(points):
        pose = point["world_from_object"]
        forces = least_forces(contacts[k][held[k]] - _place(pose, center), lift, np.zeros(3))
        torques[k] += np.einsum("fij,fi->j", jacobians[k][held[k]], forces)
    return torques


def _torques_of_turns(rig: Rig, jacobians: Array) -> Array:
    """Torques that turn the plan's contact forces, over the rotation vector that they turn by, at every waypoint: shape (n_waypoints,
    n_joints, 3). For small angles: the force f becomes f + turn x f."""
    x, y, z = np.moveaxis(forces_in_world(rig.plan), -1, 0)
    zero = np.zeros(x.shape)
    turned = np.stack([np.stack(row, axis=-1) for row in ((zero, z, -y), (-z, zero, x), (y, -x, zero))], axis=-2)
    return np.einsum("kfij,kfil->kjl", jacobians, turned)


def _pressing_torques(rig: Rig, jacobians: Array, contacts: Array) -> Array:
    """Torques of the forces that fingers press against each other with, at every waypoint: of the planned forces without the least ones that
    have the same sum and moments."""
    forces, held = forces_in_world(rig.plan), held_at_waypoints(rig.plan)
    center = np.array(rig.model.body_ipos[rig.object_body])
    for k, point in enumerate(waypoints_of(rig.plan)):
        arms, pressing = contacts[k][held[k]] - _place(point["world_from_object"], center), forces[k][held[k]]
        forces[k][held[k]] -= least_forces(arms, pressing.sum(axis=0), np.cross(arms, pressing).sum(axis=0))
    return np.einsum("kfij,kfi->kj", jacobians, forces)


def _room_for(pressing: Array, torques: Array, rig: Rig) -> Array:
    """How many times ``pressing`` fits between torques and the limits that the plan counts on, at every waypoint."""
    promised: dict[str, Any] = rig.plan["promises"].get("forces") or {}
    limits: list[float | None] = promised.get("joint_torques") or [None] * pressing.shape[1]
    most = np.array([np.inf if limit is None else limit for limit in limits])
    room = np.maximum(0.0, most - np.sign(pressing) * torques) / np.maximum(np.abs(pressing), 1e-9)
    # An infinity between two waypoints would be no number.
    return np.minimum(room.min(axis=1), 1e3)


def _against_torsion(rig: Rig, jacobians: Array, spin: Spinning) -> Array:
    """Torques that exert the moments of fingertips that spin, and the forces that balance them, at every waypoint."""
    about = spin.moments[:, :, None] * normals_in_world(rig.plan)
    return np.einsum("kfij,kfi->kj", angular_jacobians(rig), about) + np.einsum("kfij,kfi->kj", jacobians, spin.forces)


def _place(pose: dict[str, list[float]], point: Array) -> Array:
    quat_wxyz = np.array(pose["quat_xyzw"])[[3, 0, 1, 2]]
    return np.array(pose["position"]) + rotation_matrices(quat_wxyz) @ point
