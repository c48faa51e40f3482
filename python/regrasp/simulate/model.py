"""The MuJoCo model of a plan, made ready for a replay."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._mujoco import MjModel, mujoco
from .reference import Array, Plan, PlanError, rotation_matrices, waypoints_of

#: Stiffness of the joints of a finger of REFERENCE_REACH, in N m/rad, and damping, in N m s/rad (physics notes, section 6).
REFERENCE_STIFFNESS = 5.0
REFERENCE_DAMPING = 0.08
#: Reach of the prototype's fingers, in metres.
REFERENCE_REACH = 0.108
#: Factor of stiffness and damping for controller H, which takes most of the stiffness along the normal away again. By hand.
HYBRID_STIFFNESS = 10.0
#: See `Settings.controller`.
CONTROLLERS = ("A", "B", "C2", "H")
#: Damping of inverse Jacobians, in metres per radian.
INVERSE_DAMPING = 0.005

#: Largest offset of a fingertip's target by feedback, along each axis, in metres.
LARGEST_OFFSET = 0.01


@dataclass(frozen=True)
class Settings:
    """How a plan is replayed."""

    controller: str = "B"
    """``A``: joint PD with targets pushed into the object, no forces. ``B``: joint PD on the plan with its joint torques and
    velocities fed forward. ``C2``: ``B`` with slow feedback of the object's pose. ``H``: ``C2`` with stiffer tips that give along
    the normal: for contacts that slide."""
    gravity: str | tuple[float, float, float] = "plan"
    """``plan``, ``up`` (the palm faces up), ``down``, ``side``, or a vector in the world in m/s^2."""
    friction_scale: float = 1.0
    """Friction of the simulation over the scene's."""
    mass_scale: float = 1.0
    """Mass of the simulated object over the one that the plan counts on."""
    start_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """How far from the plan's start the object is gripped: a displacement in the world, in metres."""
    start_turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """How the object is turned there from the plan's start: a rotation vector in the world, in radians, about its centre of mass."""
    torsion: float | None = None
    """Torsional friction of all fingertips, in metres, before it is scaled; without it the model's."""
    torsion_told: float | None = None
    """Torsional friction of hard fingertips that the controller makes up for, in metres; without it that of the simulation. None of
    it with 0, and by controller A."""
    speed: float = 1.0
    """Times faster than planned."""
    noslip: bool = True
    """MuJoCo's solver against creep; without it every hold creeps."""
    squeeze: float = 0.003
    """How far controller A pushes its targets into the object, in metres."""
    feedback_gain: float = 2.0
    """Of C2, per second."""
    largest_offset: float = LARGEST_OFFSET
    """Of C2: how far from its plan feedback moves the target of a fingertip along each axis of the world at most, in metres."""
    forces_turn: bool = True
    """Of C2: forces turn with the object where it is turned from its plan. Else they keep their directions in the world."""
    stiffness_scale: float = 1.0
    """Factor of the joints' stiffness and damping."""
    tick: float = 0.004
    """Time between two commands, in seconds: a whole number of steps of the simulation."""
    grip_time: float = 0.5
    """Time for gripping the pinned object, in seconds."""
    rest_time: float = 0.5
    """Time for which everything rests at the end, in seconds."""
    hold_time: float = 10.0
    """Length of the static hold that is measured first, in seconds; 0 leaves it out."""


@dataclass(frozen=True)
class FingerModel:
    """Where a finger is in the model."""

    name: str
    site: int
    body: int
    joints: NDArray[np.int64]
    """Indices of its joints in the plan's ``joint_names``."""
    reach: float
    """Distance from its first turning joint to the tip along the straight finger, in metres. To the surface of the tip where
    joints slide: a free fingertip turns about its centre."""
    slides: NDArray[np.bool_]
    """Which of its joints slide."""
    touching: frozenset[int]
    """Geoms that touch the object when the finger holds."""


@dataclass(frozen=True)
class Rig:
    """A MuJoCo model with what the controllers and measurements ask of it.

    Of a scene with several hands and objects, the hand and the object of the plan. Servos hold the other hands.
    """

    model: MjModel
    plan: Plan
    joint_names: list[str]
    """Names in the model of the plan's joints."""
    motors: NDArray[np.int64]
    """Per joint of the plan, the index of its motor."""
    rest_ctrl: Array
    """Commands of all drives of the model while the plan begins: those of other hands stay as they are here."""
    fingers: list[FingerModel]
    object_body: int
    object_geoms: frozenset[int]
    """Convex parts of the object."""
    moved_geoms: frozenset[int]
    """Geoms of the hand and the object that the plan moves."""
    object_qpos: int
    """First of the seven coordinates of the object's free joint."""
    pin: int
    """The equality that holds the object where it starts."""
    stiffness: Array
    """Per joint of the plan, in N m/rad; in N/m where it slides."""
    damping: Array
    """Per joint of the plan, in N m s/rad; in N s/m where it slides."""
    drives: Array
    """Velocities of the model's degrees of freedom over those of the plan's joints; shape (nv, n_joints)."""
    palm_axis: Array
    """Out of the palm, in the world."""
    side_axis: Array
    """The next axis of the hand frame, in the world."""
    linear_velocity: list[slice]
    """Sensor data of each tip, and last of the object."""
    angular_velocity: list[slice]
    """Sensor data of each tip, and last of the object."""
    normal_force: NDArray[np.int64]
    """Sensor data of each tip."""
    radius: float
    """Largest distance of the object's surface from its centre of mass: the plan's ``torque_scale``."""
    configurations: Array
    """Coordinates of the model at every waypoint; shape (n_waypoints, nq)."""


def make_rig(xml: str, plan: Plan, settings: Settings) -> Rig:
    """The model in ``xml`` (see ``regrasp export --mjcf``) as ``settings`` want it. Raises ``PlanError``."""
    if settings.controller not in CONTROLLERS:
        raise PlanError(f"no controller {settings.controller!r}; there are {', '.join(CONTROLLERS)}")
    if settings.controller != "A" and not waypoints_of(plan)[0].get("joint_torques"):
        raise PlanError("the plan has no forces; only controller A (a squeeze by position) can replay it")
    try:
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise PlanError(f"MuJoCo cannot read the model: {error}") from None
    n_waypoints = len(waypoints_of(plan))
    if model.nkey != n_waypoints:
        raise PlanError(f"the model has {model.nkey} keyframes, the plan {n_waypoints} waypoints; make it from this plan")
    # In scenes of several hands or objects, names in the model begin with those of hand and object.
    hand, object_ = _prefix(model, plan, "hand"), _prefix(model, plan, "object")
    object_body = int(model.geom_bodyid[model.geom(f"{object_}object").id])
    object_geoms = frozenset(g for g in range(model.ngeom) if model.geom_bodyid[g] == object_body)
    object_joint = int(model.body_jntadr[object_body])
    names = [f"{hand}{name}" for name in plan["joint_names"]]
    drives = _drives(model, names)
    fingers = [_finger(model, name, hand, names, object_geoms) for name in plan["fingers"]]
    scale = settings.stiffness_scale * (HYBRID_STIFFNESS if settings.controller == "H" else 1.0)
    stiffness, damping = _gains(fingers, len(names), scale)
    motors = np.array([model.actuator(name).id for name in names], dtype=np.int64)
    _make_servos(model, motors, stiffness, damping)
    palm_axis, side_axis = _palm_axes(model, fingers, object_body)
    sensors = [*(f"{hand}{name}" for name in plan["fingers"]), f"{object_}object"]
    rig = Rig(
        model=model,
        plan=plan,
        joint_names=names,
        motors=motors,
        rest_ctrl=np.array(model.key_ctrl[0]),
        fingers=fingers,
        object_body=object_body,
        object_geoms=object_geoms,
        moved_geoms=_geoms_below(model, fingers[0].body) | object_geoms,
        object_qpos=int(model.jnt_qposadr[object_joint]),
        pin=int(model.equality(f"{object_}pin").id),
        stiffness=stiffness,
        damping=damping,
        drives=drives,
        palm_axis=palm_axis,
        side_axis=side_axis,
        linear_velocity=[_sensor(model, f"{name}:linear_velocity") for name in sensors],
        angular_velocity=[_sensor(model, f"{name}:angular_velocity") for name in sensors],
        normal_force=np.array([_sensor(model, f"{name}:normal_force").start for name in sensors[:-1]]),
        radius=float(plan["promises"]["torque_scale"]),
        configurations=np.array(model.key_qpos),
    )
    _apply(rig, settings)
    return rig


def with_plan(rig: Rig, plan: Plan) -> Rig:
    """The same model with another plan of the same hand and object (``plans.flat``), which needs no keyframes.

    Joints that the plan does not move stay as they are at the first waypoint of the plan before.
    """
    points = waypoints_of(plan)
    configurations = np.repeat(rig.configurations[:1], len(points), axis=0)
    model = rig.model
    joints = np.array([point["joints"] for point in points])
    for j, name in enumerate(rig.joint_names):
        configurations[:, model.jnt_qposadr[model.joint(name).id]] = joints[:, j]
    for e in range(model.neq):
        if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and model.eq_obj2id[e] >= 0:
            follower, leader = (int(model.jnt_qposadr[k]) for k in (model.eq_obj1id[e], model.eq_obj2id[e]))
            moved = configurations[:, leader] - model.qpos0[leader]
            configurations[:, follower] = model.qpos0[follower] + np.polynomial.polynomial.polyval(moved, model.eq_data[e, :5])
    pose = [point["world_from_object"] for point in points]
    first = rig.object_qpos
    configurations[:, first : first + 3] = [entry["position"] for entry in pose]
    configurations[:, first + 3 : first + 7] = np.array([entry["quat_xyzw"] for entry in pose])[:, [3, 0, 1, 2]]
    return replace(rig, plan=plan, configurations=configurations)


def gravity_of(rig: Rig, gravity: str | tuple[float, float, float]) -> Array:
    """Gravity in the world, in m/s^2. ``up``, ``down`` and ``side`` say where the palm faces."""
    if not isinstance(gravity, str):
        return np.array(gravity, dtype=np.float64)
    if gravity == "plan":
        return np.array(rig.model.opt.gravity)
    directions = {"up": -rig.palm_axis, "down": rig.palm_axis, "side": rig.side_axis}
    if gravity not in directions:
        raise PlanError(f"no gravity {gravity!r}; there are plan, up, down, side, or three numbers")
    return 9.81 * directions[gravity]


def contact_jacobians(rig: Rig) -> tuple[Array, Array]:
    """Jacobians of the contacts over the plan's joints at every waypoint, and contact points in the world.

    Shapes (n_waypoints, n_fingers, 3, n_joints) and (n_waypoints, n_fingers, 3). A free finger has its tip's centre.
    """
    model, plan = rig.model, rig.plan
    data = mujoco.MjData(model)
    points = waypoints_of(plan)
    jacobians = np.zeros((len(points), len(rig.fingers), 3, len(plan["joint_names"])))
    where = np.zeros((len(points), len(rig.fingers), 3))
    full = np.zeros((3, model.nv))
    for k, point in enumerate(points):
        data.qpos[:] = rig.configurations[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for f, finger in enumerate(rig.fingers):
            contact = point["contacts"][f]
            where[k, f] = data.site_xpos[finger.site]
            if contact["mode"] != "free":
                body = rig.object_body
                where[k, f] = data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.array(contact["point_in_object"])
            mujoco.mj_jac(model, data, full, None, where[k, f], finger.body)
            # Joints of other fingers do not move this one.
            jacobians[k, f][:, finger.joints] = (full @ rig.drives)[:, finger.joints]
    return jacobians, where


def angular_jacobians(rig: Rig) -> Array:
    """Angular velocity of every fingertip over the velocities of the plan's joints, at every waypoint: shape (n_waypoints,
    n_fingers, 3, n_joints)."""
    model = rig.model
    data = mujoco.MjData(model)
    n_joints = len(rig.plan["joint_names"])
    jacobians = np.zeros((len(rig.configurations), len(rig.fingers), 3, n_joints))
    full = np.zeros((3, model.nv))
    for k in range(len(rig.configurations)):
        data.qpos[:] = rig.configurations[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for f, finger in enumerate(rig.fingers):
            mujoco.mj_jac(model, data, None, full, np.zeros(3), finger.body)
            jacobians[k, f][:, finger.joints] = (full @ rig.drives)[:, finger.joints]
    return jacobians


def inverses(jacobians: Array) -> Array:
    """Damped inverses: shape (n_waypoints, n_joints, n_fingers, 3)."""
    square: Any = np.einsum("kfij,kflj->kfil", jacobians, jacobians) + INVERSE_DAMPING**2 * np.eye(3)
    # numpy's own types of inv are not known to checkers for arrays of any shape.
    invert: Any = np.linalg.inv
    return np.einsum("kfij,kfil->kjfl", jacobians, invert(square))


def normals_in_world(plan: Plan) -> Array:
    """Outward normals of the object where fingers hold, zero where they are free: shape (n_waypoints, n_fingers, 3)."""
    points = waypoints_of(plan)
    xyzw = np.array([point["world_from_object"]["quat_xyzw"] for point in points])
    turns = rotation_matrices(xyzw[:, [3, 0, 1, 2]])
    normals = np.array(
        [[contact.get("normal_in_object") or (0.0, 0.0, 0.0) for contact in point["contacts"]] for point in points]
    )
    return np.einsum("kij,kfj->kfi", turns, normals)


def forces_in_world(plan: Plan) -> Array:
    """Forces of the fingers on the object as planned, in newtons, zero where they are free or the plan has none: shape (n_waypoints,
    n_fingers, 3)."""
    points = waypoints_of(plan)
    xyzw = np.array([point["world_from_object"]["quat_xyzw"] for point in points])
    turns = rotation_matrices(xyzw[:, [3, 0, 1, 2]])
    forces = np.array([[contact.get("force_in_object") or (0.0, 0.0, 0.0) for contact in point["contacts"]] for point in points])
    return np.einsum("kij,kfj->kfi", turns, forces)


def _apply(rig: Rig, settings: Settings) -> None:
    model = rig.model
    model.opt.gravity = gravity_of(rig, settings.gravity)
    if not settings.noslip:
        model.opt.noslip_iterations = 0
    if settings.torsion is not None:
        resists = model.pair_dim == 4
        model.pair_friction[resists, 2] = settings.torsion
        if settings.torsion == 0.0:
            model.pair_dim[resists] = 3
    model.pair_friction[:] *= settings.friction_scale
    model.body_mass[rig.object_body] *= settings.mass_scale
    model.body_inertia[rig.object_body] *= settings.mass_scale
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _make_servos(model: MjModel, motors: NDArray[np.int64], stiffness: Array, damping: Array) -> None:
    """Turns motors into joint servos: torque = control + stiffness * (0 - q) - damping * velocity.

    With control = stiffness * target + damping * velocity + torque it is a PD controller with both fed forward, that runs at the
    steps of the simulation and keeps the limits of the motors.
    """
    for j, actuator in enumerate(motors):
        model.actuator_biastype[actuator] = mujoco.mjtBias.mjBIAS_AFFINE
        model.actuator_biasprm[actuator, :3] = (0.0, -stiffness[j], -damping[j])


def _gains(fingers: list[FingerModel], n_joints: int, scale: float) -> tuple[Array, Array]:
    """Stiffness and damping per joint: all tips are about as stiff as those of the prototype, whether joints turn or slide."""
    factor = np.ones(n_joints)
    for finger in fingers:
        factor[finger.joints] = np.where(finger.slides, 1.0, finger.reach**2) / REFERENCE_REACH**2
    return scale * REFERENCE_STIFFNESS * factor, scale * REFERENCE_DAMPING * factor


def _drives(model: MjModel, names: list[str]) -> Array:
    drives = np.zeros((model.nv, len(names)))
    for j, name in enumerate(names):
        drives[model.jnt_dofadr[model.joint(name).id], j] = 1.0
    for e in range(model.neq):
        if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT:
            follower, leader = (model.jnt_dofadr[k] for k in (model.eq_obj1id[e], model.eq_obj2id[e]))
            drives[follower] = model.eq_data[e, 1] * drives[leader]
    return drives


def _finger(model: MjModel, name: str, hand: str, joint_names: list[str], object_geoms: frozenset[int]) -> FingerModel:
    site = model.site(f"{hand}{name}:tip")
    body = int(model.site_bodyid[site.id])
    on_tip = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body]
    touching: set[int] = set()
    for p in range(model.npair):
        a, b = int(model.pair_geom1[p]), int(model.pair_geom2[p])
        # Pairs that the plan does not use have condim 3 (class "unplanned").
        if object_geoms & {a, b} and model.pair_dim[p] != 3:
            touching.update({a, b}.intersection(on_tip))
    joints: list[int] = []
    sliding: list[int] = []
    reach = 0.0
    way = float(np.linalg.norm(site.pos))
    link = body
    while True:
        for k in range(int(model.body_jntadr[link]), int(model.body_jntadr[link] + model.body_jntnum[link])):
            turns = model.jnt_type[k] == mujoco.mjtJoint.mjJNT_HINGE
            reach = way if turns else reach
            if model.joint(k).name in joint_names:
                index = joint_names.index(model.joint(k).name)
                joints.append(index)
                sliding += [] if turns else [index]
        parent = int(model.body_parentid[link])
        if model.body_jntnum[parent] == 0:
            break
        way += float(np.linalg.norm(model.body_pos[link]))
        link = parent
    if sliding:
        reach += max((float(model.geom_size[geom, 0]) for geom in touching), default=0.0)
    joints.sort()
    slides = np.isin(joints, sliding)
    return FingerModel(name, int(site.id), body, np.array(joints), reach, slides, frozenset(touching))


def _palm_axes(model: MjModel, fingers: list[FingerModel], object_body: int) -> tuple[Array, Array]:
    """The axis of the hand frame nearest to the way from the roots of the fingers to the object where it starts, and the
    positive axis after it in the order x y z, both in the world."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    links = [finger.body for finger in fingers]
    for f, link in enumerate(links):
        while model.body_jntnum[model.body_parentid[link]] > 0:
            link = int(model.body_parentid[link])
        links[f] = link
    world_from_hand = data.xmat[model.body_parentid[links[0]]].reshape(3, 3)
    way = world_from_hand.T @ (data.xpos[object_body] - data.xpos[links].mean(axis=0))
    k = int(np.argmax(np.abs(way)))
    return np.sign(way[k]) * world_from_hand[:, k], world_from_hand[:, (k + 1) % 3].copy()


def _prefix(model: MjModel, plan: Plan, kind: str) -> str:
    """What stands before the names of the plan's hand or object: nothing in scenes of one hand and one object."""
    prefix = f"{plan.get(kind, '')}/"
    expected = plan["joint_names"][0] if kind == "hand" else "object"
    names: Any = model.actuator if kind == "hand" else model.geom
    for found in (prefix, ""):
        try:
            names(f"{found}{expected}")
        except KeyError:
            continue
        return found
    raise PlanError(f"the model does not have the plan's {kind} \"{plan.get(kind, '')}\"; make it from this plan")


def _geoms_below(model: MjModel, body: int) -> frozenset[int]:
    """All geoms of the tree of bodies that ``body`` is in."""
    root = model.body_rootid[body]
    return frozenset(np.flatnonzero(model.body_rootid[model.geom_bodyid] == root).tolist())


def _sensor(model: MjModel, name: str) -> slice:
    sensor = model.sensor(name).id
    first = int(model.sensor_adr[sensor])
    return slice(first, first + int(model.sensor_dim[sensor]))
