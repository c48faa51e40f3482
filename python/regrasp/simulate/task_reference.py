"""What a replay of pick and place follows: joints, forces and holders along time."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._mujoco import MjModel, mujoco
from .reference import Array, PlanError, chord_parameter, quat_exp, quat_inverse, quat_product, rotation_vector

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class TaskRig:
    """A MuJoCo model of a whole robot with a free object."""

    model: MjModel
    scene: str
    names: list[str]
    """The plan's joints."""
    servos: Indices
    """Their servos."""
    joint_qpos: Indices
    """Their places in the coordinates of the model."""
    drives: Array
    """Velocities of the model's degrees of freedom over those of the plan's joints; shape (nv, n_joints)."""
    of_hand: NDArray[np.bool_]
    """True for joints that move a fingertip and no hand's base."""
    stiffness: Array
    damping: Array
    object_body: int
    object_geoms: frozenset[int]
    object_qpos: int
    """First of the seven coordinates of the object."""
    hands: tuple[str, ...]
    bases: Mapping[str, int]
    """Body of the base of every hand."""
    tips: Mapping[tuple[str, str], int]
    """Body of the tip of every finger."""
    hand_geoms: frozenset[int]
    tip_geoms: frozenset[int]
    support_geoms: frozenset[int]
    """Those of supports that hold the object in some segment."""
    kinds: list[str]
    held_by: list[list[str]]

    def object_pose(self, ref: TaskReference, at: int) -> Array:
        """Where the plan has the object at a tick: with the hand that holds it, else at rest. Position and quaternion w x y z."""
        hand = ref.carrier[at]
        if hand is None:
            return ref.rest_pose[at]
        data = ref.scratch
        data.qpos[:] = ref.home + self.coordinates(ref.joints[at])
        mujoco.mj_kinematics(self.model, data)
        body = self.bases[hand]
        position, quat = ref.hold_pose[at][:3], ref.hold_pose[at][3:]
        turn = data.xmat[body].reshape(3, 3)
        return np.concatenate((data.xpos[body] + turn @ position, quat_product(data.xquat[body].copy(), quat)))

    def joints_of(self, hand: str) -> Indices:
        """Joints of the plan that move something of a hand but not its base."""
        bodies = _below(self.model, self.bases[hand])
        bodies_of = [int(self.model.jnt_bodyid[self.model.joint(name).id]) for name in self.names]
        return np.array([k for k, body in enumerate(bodies_of) if self.of_hand[k] and body in bodies], dtype=np.int64)

    def coordinates(self, joints: Array) -> Array:
        """What the joints add to the coordinates of the model at joints zero. Couplings are linear."""
        moved = np.zeros(self.model.nq)
        moved[self.dof_qpos] = (self.drives @ joints)[self.dof_of]
        return moved

    dof_qpos: Indices
    """Coordinates of hinges and slides, and their degrees of freedom."""
    dof_of: Indices


@dataclass(frozen=True)
class TaskReference:
    """Along ticks of the simulation."""

    joints: Array
    targets: Array
    """Commands of the servos without forces: positions, ahead by what damping holds back."""
    feed_forward: Array
    """What contact forces add to the commands."""
    inertia: Array
    """What moving the robot's own links adds to the commands."""
    segment: Indices
    plan_time: Array
    only_hands: NDArray[np.bool_]
    """True while only hands hold the object."""
    carrier: list[str | None]
    """The hand that the object goes with."""
    rest_pose: Array
    """Where the object is while no hand carries it: at rest, or on its way in a hand. Shape (n, 7)."""
    hold_pose: Array
    """Its pose in the frame of the carrier's base. Shape (n, 7)."""
    home: Array
    """Coordinates of the model at joints zero."""
    scratch: Any

    @property
    def n_ticks(self) -> int:
        """Number of ticks."""
        return len(self.joints)


def make_rig(plan: Mapping[str, Any], xml: str) -> TaskRig:
    """The model in ``xml``. Raises ``PlanError``."""
    try:
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise PlanError(f"MuJoCo cannot read the model: {error}") from None
    points = sum(len(segment["waypoints"]) for segment in plan["segments"])
    if model.nkey != points:
        raise PlanError(f"the model has {model.nkey} keyframes, the plan {points} waypoints; make it from this plan")
    names = [name for robot in plan["robots"] for name in robot["joint_names"]]
    hands = tuple(hand["name"] for hand in plan["hands"])
    (object_,) = plan["objects"]
    try:
        joints = [model.joint(name).id for name in names]
        servos = np.array([model.actuator(name).id for name in names], dtype=np.int64)
        body = model.body(f"object:{object_}").id
        bases = {hand: int(model.site_bodyid[model.site(f"{hand}:base").id]) for hand in hands}
        tips = {
            (hand["name"], finger): int(model.site_bodyid[model.site(f"{hand['name']}/{finger}:tip").id])
            for hand in plan["hands"]
            for finger in hand["fingers"]
        }
    except KeyError as error:
        raise PlanError(f"the model is not of this plan: {error.args[0]}") from None
    drives = _drives(model, joints)
    object_geoms = frozenset(g for g in range(model.ngeom) if model.geom_bodyid[g] == body)
    below = {hand: _below(model, base) for hand, base in bases.items()}
    hand_bodies = frozenset[int]().union(*below.values())
    held_by: list[list[str]] = [segment["held_by"].get(object_, []) for segment in plan["segments"]]
    supports = {f"fixed:{name}" for held in held_by for name in held if name not in hands}
    fixed = frozenset(g for g in range(model.ngeom) if _body_of(model.geom(g).name) in supports)
    dofs = [d for d in range(model.nv) if model.jnt_type[model.dof_jntid[d]] != mujoco.mjtJoint.mjJNT_FREE]
    return TaskRig(
        model=model,
        scene=bytes(model.names).split(b"\0", 1)[0].decode(),
        names=names,
        servos=servos,
        joint_qpos=np.asarray(model.jnt_qposadr)[joints].astype(np.int64),
        drives=drives,
        of_hand=np.array([model.jnt_bodyid[j] in hand_bodies for j in joints]),
        stiffness=np.array(model.actuator_gainprm[servos, 0]),
        damping=-np.array(model.actuator_biasprm[servos, 2]),
        object_body=body,
        object_geoms=object_geoms,
        object_qpos=int(model.jnt_qposadr[model.body_jntadr[body]]),
        hands=hands,
        bases=bases,
        tips=tips,
        hand_geoms=frozenset(g for g in range(model.ngeom) if model.geom_bodyid[g] in hand_bodies),
        tip_geoms=frozenset(g for g in range(model.ngeom) if model.geom_bodyid[g] in set(tips.values())),
        support_geoms=fixed,
        kinds=[segment["kind"] for segment in plan["segments"]],
        held_by=held_by,
        dof_qpos=np.array([model.jnt_qposadr[model.dof_jntid[d]] for d in dofs], dtype=np.int64),
        dof_of=np.array(dofs, dtype=np.int64),
    )


def _body_of(geom: str) -> str:
    """``fixed:NAME`` of its first convex part ``fixed:NAME`` or of the further ones ``fixed:NAME:k``."""
    name, _, part = geom.rpartition(":")
    return name if part.isdigit() and name.count(":") else geom


def _below(model: MjModel, top: int) -> frozenset[int]:
    """The bodies that ``top`` carries, ``top`` among them."""
    found = {top}
    for body in range(top + 1, model.nbody):
        if int(model.body_parentid[body]) in found:
            found.add(body)
    return frozenset(found)


def _drives(model: MjModel, joints: list[int]) -> Array:
    drives = np.zeros((model.nv, len(joints)))
    for k, joint in enumerate(joints):
        drives[model.jnt_dofadr[joint], k] = 1.0
    for e in range(model.neq):
        if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT:
            follower, leader = (int(model.jnt_dofadr[k]) for k in (model.eq_obj1id[e], model.eq_obj2id[e]))
            drives[follower] = model.eq_data[e, 1] * drives[leader]
        elif model.eq_type[e] == mujoco.mjtEq.mjEQ_TENDON:
            # The first joint of the tendon follows the others, which have the coefficients of the coupling with the other sign.
            tendon = int(model.eq_obj1id[e])
            first, n = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
            wraps = [(int(model.jnt_dofadr[model.wrap_objid[w]]), float(model.wrap_prm[w])) for w in range(first, first + n)]
            drives[wraps[0][0]] = -sum(share * drives[dof] for dof, share in wraps[1:])
    return drives


@dataclass
class _Knot:
    """A moment that the reference goes through: a waypoint, or the end of a pause."""

    time: float
    plan_time: float
    waypoint: int
    segment: int
    torques: Array


def task_reference(rig: TaskRig, plan: Mapping[str, Any], tick: float, speed: float, squeeze_time: float) -> TaskReference:
    """What the servos follow. Where holding fingers change between two segments, everything rests for ``squeeze_time``."""
    points = [waypoint for segment in plan["segments"] for waypoint in segment["waypoints"]]
    torques = _torques(rig, points)
    knots: list[_Knot] = []
    pause, index = 0.0, 0
    begin = float(points[0]["time"])
    for s, segment in enumerate(plan["segments"]):
        for w, point in enumerate(segment["waypoints"]):
            if w == 0 and knots and _touching(points[index - 1]) != _touching(point):
                pause += squeeze_time
            time = (float(point["time"]) - begin) / speed + pause
            if knots and time < knots[-1].time:
                raise PlanError("the times of the plan's waypoints do not increase")
            knots.append(_Knot(time, float(point["time"]), index, s, torques[index]))
            index += 1
    times = np.array([knot.time for knot in knots])
    n = max(2, round(times[-1] / tick) + 1)
    at = np.minimum(tick * np.arange(n), times[-1])
    search: Any = np.searchsorted
    left: Indices = np.asarray(search(times, at, side="right") - 1).clip(0, len(knots) - 2)
    span = np.maximum(times[left + 1] - times[left], 1e-12)
    u = np.clip((at - times[left]) / span, 0.0, 1.0)[:, None]
    positions = np.array([point["joints"] for point in points], dtype=np.float64)
    slopes = np.array([point["joint_velocities"] for point in points], dtype=np.float64) * speed
    first, last = slopes[left] * span[:, None], slopes[left + 1] * span[:, None]
    change = positions[left + 1] - positions[left]
    joints = positions[left] + u * (first + u * (3 * change - 2 * first - last + u * (first + last - 2 * change)))
    velocities = (first + u * (2 * (3 * change - 2 * first - last) + u * (3 * (first + last - 2 * change)))) / span[:, None]
    accelerations = (2 * (3 * change - 2 * first - last) + 6 * u * (first + last - 2 * change)) / span[:, None] ** 2
    pressed = torques[left] + u * (torques[left + 1] - torques[left])
    segments = np.array([knot.segment for knot in knots])
    # In a pause nothing has moved yet: it counts to the segment that it leads to.
    of_tick = np.where(segments[left] == segments[left + 1], segments[left], segments[left + 1])
    plan_times = np.array([knot.plan_time for knot in knots])
    carrier, rest, hold, home = _poses(rig, plan, points)
    rest_pose = rest[of_tick]
    moves: NDArray[np.bool_] = np.array([kind == "transfer" for kind in rig.kinds])[of_tick]
    along = chord_parameter(change[moves], first[moves], last[moves], u[moves, 0])
    rest_pose[moves] = _on_the_way(points, left[moves], along)
    return TaskReference(
        joints=joints,
        targets=joints + velocities * rig.damping / rig.stiffness,
        feed_forward=pressed / rig.stiffness,
        inertia=_dynamics(rig, home, joints, velocities, accelerations) / rig.stiffness,
        segment=of_tick,
        plan_time=plan_times[left] + u[:, 0] * (plan_times[left + 1] - plan_times[left]),
        only_hands=np.array([bool(held) and all(name in rig.hands for name in held) for held in rig.held_by])[of_tick],
        carrier=[carrier[s] for s in of_tick.tolist()],
        rest_pose=rest_pose,
        hold_pose=hold[of_tick],
        home=home,
        scratch=mujoco.MjData(rig.model),
    )


def _on_the_way(points: list[dict[str, Any]], left: Indices, along: Array) -> Array:
    """Poses of the object between waypoints and those behind them, as the plan moves it in the hand."""
    poses = [point["world_from_objects"][0] for point in points]
    position = np.array([pose["position"] for pose in poses], dtype=np.float64)
    quat = np.array([pose["quat_xyzw"] for pose in poses], dtype=np.float64)[:, [3, 0, 1, 2]]
    turn = rotation_vector(quat_product(quat[left + 1], quat_inverse(quat[left])))
    share = along[:, None]
    place = position[left] + share * (position[left + 1] - position[left])
    return np.concatenate((place, quat_product(quat_exp(share * turn), quat[left])), axis=1)


def _touching(point: Mapping[str, Any]) -> set[tuple[str, str]]:
    return {(contact["hand"], contact["finger"]) for contact in point.get("contacts", [])}


def _torques(rig: TaskRig, points: list[dict[str, Any]]) -> Array:
    """Torques of all joints that make the contact forces at every waypoint: those of arms too, which carry what the hands hold."""
    model = rig.model
    data = mujoco.MjData(model)
    torques = np.zeros((len(points), len(rig.names)))
    jacobian = np.zeros((3, model.nv))
    for k, point in enumerate(points):
        contacts = point.get("contacts", [])
        if not contacts:
            continue
        data.qpos[:] = model.key_qpos[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        origin, turn = data.xpos[rig.object_body], data.xmat[rig.object_body].reshape(3, 3)
        for contact in contacts:
            if contact.get("force_in_object") is None:
                raise PlanError("the plan has no contact forces; nothing would press")
            where = origin + turn @ np.array(contact["point_in_object"])
            body = rig.tips[contact["hand"], contact["finger"]]
            mujoco.mj_jac(model, data, jacobian, None, where, body)
            torques[k] += (jacobian @ rig.drives).T @ (turn @ np.array(contact["force_in_object"]))
    return torques


def _dynamics(rig: TaskRig, home: Array, joints: Array, velocities: Array, accelerations: Array) -> Array:
    """Torques that move the links of the robot alone, at every tick. Gravity on links is compensated already."""
    model = copy.copy(rig.model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    torques = np.zeros_like(joints)
    # Where nothing moves, nothing is needed.
    for k in np.flatnonzero(np.abs(velocities).max(axis=1) + np.abs(accelerations).max(axis=1)).tolist():
        data.qpos[:] = home + rig.coordinates(joints[k])
        data.qpos[rig.object_qpos + 3] = 1.0
        data.qvel[:] = rig.drives @ velocities[k]
        data.qacc[:] = rig.drives @ accelerations[k]
        mujoco.mj_inverse(model, data)
        torques[k] = rig.drives.T @ data.qfrc_inverse
    return torques


def _poses(rig: TaskRig, plan: Mapping[str, Any], points: list[dict[str, Any]]) -> tuple[list[str | None], Array, Array, Array]:
    """By segment: the hand that the object goes with, where it rests, its pose in that hand. And the coordinates at joints zero."""
    model = rig.model
    home = np.array(model.key_qpos[0]) - rig.coordinates(np.array(points[0]["joints"], dtype=np.float64))
    data = mujoco.MjData(model)
    carrier: list[str | None] = []
    rest = np.zeros((len(plan["segments"]), 7))
    hold = np.zeros_like(rest)
    index = 0
    for s, segment in enumerate(plan["segments"]):
        at = rig.object_qpos
        pose = np.array(model.key_qpos[index][at : at + 7])
        holding = [name for name in rig.held_by[s] if name in rig.hands]
        rests = len(holding) != 1 or len(holding) != len(rig.held_by[s]) or segment["kind"] == "transfer"
        carrier.append(None if rests else holding[0])
        rest[s] = pose
        hold[s] = [0, 0, 0, 1, 0, 0, 0]
        if not rests:
            data.qpos[:] = model.key_qpos[index]
            mujoco.mj_kinematics(model, data)
            body = rig.bases[holding[0]]
            turn = data.xmat[body].reshape(3, 3)
            hold[s, :3] = turn.T @ (pose[:3] - data.xpos[body])
            hold[s, 3:] = quat_product(quat_inverse(data.xquat[body].copy()), pose[3:])
        index += len(segment["waypoints"])
    return carrier, rest, hold, home

