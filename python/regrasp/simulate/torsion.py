"""Torsional friction of hard fingertips: what it does to the object along a plan, and the forces that make up for it.

A plan for point contacts counts on no moment about a contact's normal. Real fingertips touch with a small patch: a tip that
spins against the object drags it along with a moment of up to the torsional friction times the normal force. The direction of
the spin is known from the plan, so the moment is too, and the fingers can balance it in advance (feed-forward of friction:
Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 4).

The moment of a contact follows the spin by Dahl's model: from rest it grows with the angle spun and saturates. It stays while
nothing spins, and is zero at landing. What makes up for it stays within the friction that the plan counts on, by projections onto
friction cones (Boyle, Dykstra 1986).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._mujoco import mujoco
from .model import Rig, forces_in_world, normals_in_world
from .reference import Array, Plan, held_at_waypoints, rotation_matrices, waypoints_of

#: Angle of spin at which the moment of a contact is full, in radians. By hand: about as much as a fingertip's joints give.
BREAKAWAY = 0.01
#: Share of its normal force that a contact has left for moments at least, however large its tangential force. By hand.
LEAST_ROOM = 0.3
#: A tip that slides goes back to its planned place on the object by this share of its planned way at most: friction still points as
#: planned. By hand.
RETURN_SHARE = 0.5
#: Of a wrench: torques in units of a finger's width, so that both halves count alike.
SCALE = np.repeat((1.0, 30.0), 3)
#: Projections onto friction cones, at most,
MOST_PROJECTIONS = 200
#: or until forces change by less, in newtons.
NEAR_ENOUGH = 1e-3


def spins(rig: Rig) -> Array:
    """Turn of each fingertip over the object about the contact's outward normal, from the waypoint before to each one, in
    radians; zero where the finger does not hold at both. Shape (n_waypoints, n_fingers)."""
    points = waypoints_of(rig.plan)
    held = held_at_waypoints(rig.plan)
    xyzw = np.array([point["world_from_object"]["quat_xyzw"] for point in points])
    world_from_object = rotation_matrices(xyzw[:, [3, 0, 1, 2]])
    normals = np.einsum("kij,kfi->kfj", world_from_object, normals_in_world(rig.plan))
    out = np.zeros((len(points), len(rig.fingers)))
    before = None
    data = mujoco.MjData(rig.model)
    for k in range(len(points)):
        data.qpos[:] = rig.configurations[k]
        mujoco.mj_kinematics(rig.model, data)
        tips = np.array([data.xmat[finger.body].reshape(3, 3) for finger in rig.fingers])
        over = np.einsum("ji,fjl->fil", world_from_object[k], tips)
        if before is not None:
            turns = np.einsum("fij,flj->fil", over, before)
            # Rotation vectors, for the small turns of a step.
            vectors = 0.5 * np.stack(
                (turns[:, 2, 1] - turns[:, 1, 2], turns[:, 0, 2] - turns[:, 2, 0], turns[:, 1, 0] - turns[:, 0, 1]), axis=1
            )
            middle = normals[k] + normals[k - 1]
            length = np.linalg.norm(middle, axis=1)
            about = np.einsum("fi,fi->f", vectors, middle) / np.maximum(length, 1e-9)
            out[k] = np.where(held[k] & held[k - 1], about, 0.0)
        before = over
    return out


def saturations(spun: Array, held: NDArray[np.bool_]) -> Array:
    """Share of its full moment that each contact has reached, with the sign of the spin, at every waypoint: Dahl's model.
    Both arguments have the shape (n_waypoints, n_fingers)."""
    share = np.zeros(spun.shape)
    for k in range(1, len(spun)):
        turn = spun[k] / BREAKAWAY
        to = np.sign(turn)
        share[k] = np.where(held[k], to + (share[k - 1] - to) * np.exp(-np.abs(turn)), 0.0)
        share[k] = np.where(held[k] & (turn == 0.0), share[k - 1], share[k])
    return share


@dataclass(frozen=True)
class Spinning:
    """What spinning does at every contact, at every waypoint."""

    moments: Array
    """On the object, about the contact's outward normal, in newton metres. Shape (n_waypoints, n_fingers)."""
    forces: Array
    """Added to the planned contact forces, they keep the object in balance; in the world. Shape (n_waypoints, n_fingers, 3)."""
    slips: Array
    """How far the tip has crept over the object beside what is planned, in the world: from zero at landing. Where the tip slides as
    planned, it goes back to its planned place. Shape (n_waypoints, n_fingers, 3)."""


def friction_of(rig: Rig) -> tuple[Array, Array]:
    """Friction and torsional friction (in metres) of every fingertip on the object. The second is zero where the plan counts on
    it, for soft fingertips, and where a tip has none."""
    model = rig.model
    out = np.zeros((2, len(rig.fingers)))
    for p in range(model.npair):
        geoms = {int(model.pair_geom1[p]), int(model.pair_geom2[p])}
        if rig.object_geoms & geoms and model.pair_dim[p] == 4:
            for f, finger in enumerate(rig.fingers):
                if geoms & finger.touching:
                    out[:, f] = np.maximum(out[:, f], model.pair_friction[p, [0, 2]])
    for f in range(len(rig.fingers)):
        if any(point["contacts"][f].get("torsion") is not None for point in waypoints_of(rig.plan)):
            out[1, f] = 0.0
    return out[0], out[1]


def spinning(rig: Rig, contacts: Array, told: float | None = None) -> Spinning:
    """Moments and slip of fingertips that spin as planned, with the planned contact forces at ``contacts`` in the world.

    A contact slides when tangential force f and moment m reach the ellipsoid (f / friction)^2 + (m / torsion)^2 = n^2 of the
    normal force n. It then slides along the ellipsoid's normal there (Howe, Cutkosky 1996): where it spins it also creeps
    along f. ``told`` is torsional friction in place of the model's.
    """
    friction, torsion = friction_of(rig)
    if told is not None:
        torsion = np.where(torsion > 0.0, told, 0.0)
    points = waypoints_of(rig.plan)
    normals = normals_in_world(rig.plan)
    held = held_at_waypoints(rig.plan)
    xyzw = np.array([point["world_from_object"]["quat_xyzw"] for point in points])
    turns = rotation_matrices(xyzw[:, [3, 0, 1, 2]])
    planned = forces_in_world(rig.plan)
    push = -np.einsum("kfi,kfi->kf", planned, normals)
    spun = spins(rig)
    share = saturations(spun, held)
    slippery = 1.0 / np.maximum(friction, 1e-9)

    def room(forces: Array) -> tuple[Array, Array]:
        """Tangential forces, and what they leave of the normal forces for moments."""
        across = forces - np.einsum("kfi,kfi->kf", forces, normals)[:, :, None] * normals
        taken = np.linalg.norm(across, axis=2) * slippery
        return across, np.sqrt(np.maximum(push**2 - taken**2, (LEAST_ROOM * push) ** 2))

    moments = share * torsion * room(planned)[1]
    center = np.array(rig.model.body_ipos[rig.object_body])
    positions = np.array([point["world_from_object"]["position"] for point in points])
    arms = contacts - (positions + turns @ center)[:, None, :]
    added = np.zeros(planned.shape)
    # Forces of a tip that slides lie on their cones, and what is added to them says itself where they go.
    sticks = ~np.array([any(contact["mode"] == "sliding" for contact in point["contacts"]) for point in points])
    for k in np.flatnonzero(np.abs(moments).max(axis=1) > 0.0):
        torque = -(moments[k][:, None] * normals[k]).sum(axis=0)
        added[k][held[k]] = least_forces(arms[k][held[k]], np.zeros(3), torque)
        if sticks[k]:
            cones = Cones(normals[k][held[k]], float(rig.plan["promises"]["friction"]), float(np.min(push[k][held[k]])))
            added[k][held[k]] = forces_in_cones(planned[k][held[k]], added[k][held[k]], arms[k][held[k]], cones)
    across, left = room(planned + added)
    rate = torsion * slippery**2 / np.maximum(left, 1e-9)
    step = (np.abs(spun) * share**2 * rate)[:, :, None] * across
    slips = np.zeros(step.shape)
    back = RETURN_SHARE * _planned_slides(rig.plan)
    for k in range(1, len(points)):
        left_over = np.linalg.norm(slips[k - 1], axis=1)
        share_left = np.maximum(0.0, 1.0 - back[k] / np.maximum(left_over, 1e-12))
        slips[k] = slips[k - 1] + step[k]
        returns = back[k] > 0.0
        slips[k][returns] = slips[k - 1][returns] * share_left[returns][:, None]
        slips[k][~held[k]] = 0.0
    return Spinning(moments, added, slips)


@dataclass(frozen=True)
class Cones:
    """Where forces may be so that contacts stick."""

    normals: Array
    """Out of the object; shape (n, 3)."""
    friction: float
    """That the plan counts on."""
    least: float
    """Normal force, in newtons."""

    def nearest(self, forces: Array) -> Array:
        """The forces inside that are nearest to these."""
        along = -(forces * self.normals).sum(axis=1)
        across = forces + along[:, None] * self.normals
        length = np.linalg.norm(across, axis=1)
        # Onto the cone where it is outside, or onto its cut at the least normal force.
        beyond = np.maximum(0.0, length - self.friction * along)
        onto = np.maximum(self.least, along + self.friction * beyond / (1.0 + self.friction**2))
        share = np.minimum(1.0, self.friction * onto / np.maximum(length, 1e-12))
        return share[:, None] * across - onto[:, None] * self.normals


def forces_in_cones(planned: Array, added: Array, arms: Array, cones: Cones) -> Array:
    """Of all forces that have the same sum and moments as ``added`` those that, added to ``planned``, stay in the cones, and change
    ``planned`` least. Where there are none, those that leave the cones least.

    By projections onto both sets in turn, corrected so that they find the nearest point of their intersection (Boyle, Dykstra 1986).
    """
    grasp = _grasp_matrix(arms)
    inverse = np.linalg.pinv(grasp)
    wrench = grasp @ (planned + added).ravel()

    def balanced(forces: Array) -> Array:
        return forces - (inverse @ (grasp @ forces.ravel() - wrench)).reshape(-1, 3)

    forces, correction = planned + added, np.zeros(planned.shape)
    for _ in range(MOST_PROJECTIONS):
        inside = cones.nearest(forces + correction)
        correction = forces + correction - inside
        before, forces = forces, balanced(inside)
        if np.abs(forces - before).max() < NEAR_ENOUGH:
            break
    return forces - planned


def _planned_slides(plan: Plan) -> Array:
    """How far each tip slides over the object as planned, from the waypoint before to each one, in metres; zero where it does not,
    and between two segments, where everything rests. Shape (n_waypoints, n_fingers)."""
    rows: list[list[float]] = []
    for segment in plan["segments"]:
        before = segment["waypoints"][0]["time"]
        for point in segment["waypoints"]:
            seconds, before = point["time"] - before, point["time"]
            rows.append([_sliding_speed(contact) * seconds for contact in point["contacts"]])
    return np.array(rows)


def _sliding_speed(contact: dict[str, Any]) -> float:
    return float(np.linalg.norm(contact["relative_velocity_in_object"])) if contact["mode"] == "sliding" else 0.0


def least_forces(arms: Array, force: Array, torque: Array) -> Array:
    """Least forces at ``arms`` from the centre of mass that sum up to ``force``, and to ``torque`` about it."""
    return (np.linalg.pinv(_grasp_matrix(arms)) @ (np.concatenate((force, torque)) * SCALE)).reshape(-1, 3)


def _grasp_matrix(arms: Array) -> Array:
    """Sum and moments of forces at ``arms``, times ``SCALE``."""
    grasp = np.zeros((6, 3 * len(arms)))
    for f, (x, y, z) in enumerate(arms):
        grasp[:3, 3 * f : 3 * f + 3] = np.eye(3)
        grasp[3:, 3 * f : 3 * f + 3] = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    return grasp * SCALE[:, None]
