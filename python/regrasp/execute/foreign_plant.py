"""A plant that nobody here made: a hand of somebody else's MuJoCo model, driven by that model's own position actuators.

What it needs is in docs/how-to/execute.md, "A hand of another simulation". Gains come from the model, the hand's weight is carried by
``gravcomp``, joints that the plan does not have (a wrist) stay where their actuators hold them, and poses are seen from the hand's root.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._model import Pose
from .._plan import Plan
from ..simulate._mujoco import mujoco
from ..simulate.model import Settings
from ..simulate.reference import Array, quat_exp, quat_inverse, quat_product, rotation_matrices
from .leg import Leg, first_rig
from .plant import Command, Observation
from .settings_check import FOREIGN, check_settings


@dataclass(frozen=True)
class ForeignSettings:
    """What is seen, and how the hand takes the object."""

    tick: float = 0.004
    """Time between two commands, in seconds; at least the model's time step."""
    pose_rate: float = 30.0
    """Poses of the object per second."""
    pose_noise: float = 0.0005
    """Standard deviation of the length of a pose's error in position, in metres."""
    pose_turn_noise: float = float(np.radians(0.5))
    """The same in orientation, in radians."""
    joint_noise: float = 0.0002
    """Standard deviation of encoders, in radians or metres."""
    grip_time: float = 1.0
    """Time in which the fingers close on the object, which is held in place meanwhile, in seconds."""
    carries_hand: bool = True
    """Whether the hand's own weight is compensated, as drivers of hands do it."""
    friction: float | None = None
    """Sliding friction of the object's geoms and the fingertips', in place of the model's."""
    impratio: float | None = None
    """How much stiffer friction is than the normal contact, in place of the model's. With MuJoCo's default of 1 held objects creep."""
    seed: int = 0

    def __post_init__(self) -> None:
        """Raises ``InputError`` (A510) for a setting that no plant can have."""
        check_settings(self, FOREIGN)


class ForeignPlant:
    """Hand and object of a compiled model, gripped as ``plan`` begins.

    The scene of ``plan`` has the hand as ``regrasp.from_mjcf`` made it of the same model: its root link is the body ``root``.
    """

    def __init__(
        self,
        path: str,
        plan: Plan,
        *,
        root: str,
        object_body: str,
        world_from_root: Pose,
        mjcf_name: Callable[[str], str] = str,
        tips: dict[str, str],
        followers: Mapping[str, tuple[str, float, float]] | None = None,
        settings: ForeignSettings | None = None,
    ) -> None:
        """root, object_body: names of bodies in the model at ``path``. world_from_root: where the scene has the hand's root link.

        mjcf_name: what the model calls a joint of the plan. tips: the body of every fingertip, by finger.
        followers: joints of the model that follow one of the plan (leader, multiplier, offset); they begin where they belong. Raises ``ValueError`` for
        models that lack any of it, or whose joints of the plan have no position actuators.
        """
        self.settings = settings = settings or ForeignSettings()
        self.scene = plan._source  # pyright: ignore[reportPrivateUsage]
        spec: Any = mujoco.MjSpec.from_file(path)
        for name in (root, object_body):
            if spec.body(name) is None:
                raise ValueError(f'the model has no body "{name}"')
        if settings.carries_hand:
            pending = [spec.body(root)]
            while pending:
                body = pending.pop()
                body.gravcomp = 1.0
                pending.extend(body.bodies)
        # So that it can float until the fingers hold it.
        spec.body(object_body).gravcomp = 1.0
        if settings.impratio is not None:
            spec.option.impratio = settings.impratio
            spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        self.model: Any = spec.compile()
        self.data: Any = mujoco.MjData(self.model)
        model = self.model
        self.joint_names: tuple[str, ...] = tuple(plan.joint_names)
        self.fingers: tuple[str, ...] = tuple(plan.fingers)
        self._steps = max(1, round(settings.tick / model.opt.timestep))
        self.tick: float = self._steps * float(model.opt.timestep)
        joints = [self._id(mujoco.mjtObj.mjOBJ_JOINT, mjcf_name(name)) for name in self.joint_names]
        self._qpos = np.array([model.jnt_qposadr[joint] for joint in joints])
        self._followers = [
            (self._address(follower), self.joint_names.index(leader), multiplier, offset)
            for follower, (leader, multiplier, offset) in (followers or {}).items()
        ]
        self._motors, self.stiffness, self.damping = self._gains(joints)
        self._root = self._id(mujoco.mjtObj.mjOBJ_BODY, root)
        self._object = self._id(mujoco.mjtObj.mjOBJ_BODY, object_body)
        self._free = int(model.jnt_qposadr[model.body_jntadr[self._object]])
        self._tips = np.array([self._id(mujoco.mjtObj.mjOBJ_BODY, tips[finger]) for finger in self.fingers])
        if settings.friction is not None:
            geoms = np.flatnonzero((model.geom_bodyid == self._object) | np.isin(model.geom_bodyid, self._tips))
            model.geom_friction[geoms, 0] = settings.friction
        self._root_position = np.array(world_from_root.position, dtype=np.float64)
        self._root_quat = np.array(world_from_root.quat_xyzw, dtype=np.float64)[[3, 0, 1, 2]]
        self._rng = np.random.default_rng(settings.seed)
        self._seen: tuple[float, Array, Array] | None = None
        self._next_pose = 0.0
        self.holding: Command = self._grip(plan)

    def _address(self, joint: str) -> int:
        return int(self.model.jnt_qposadr[self._id(mujoco.mjtObj.mjOBJ_JOINT, joint)])

    def _id(self, kind: Any, name: str) -> int:
        found = int(mujoco.mj_name2id(self.model, kind, name))
        if found < 0:
            raise ValueError(f'the model has no {kind.name.removeprefix("mjOBJ_").lower()} "{name}"')
        return found

    def _gains(self, joints: list[int]) -> tuple[Array, Array, Array]:
        """Actuators of joints, their stiffness, and damping of joints and actuators."""
        model = self.model
        motors: list[int] = []
        stiffness: list[float] = []
        damping: list[float] = []
        for joint, name in zip(joints, self.joint_names):
            found = [
                motor
                for motor in range(model.nu)
                if int(model.actuator_trntype[motor]) == int(mujoco.mjtTrn.mjTRN_JOINT)
                and int(model.actuator_trnid[motor, 0]) == joint
                and int(model.actuator_biastype[motor]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
            ]
            if len(found) != 1:
                raise ValueError(f'joint "{name}" has {len(found)} position actuators, not one')
            motors.append(found[0])
            stiffness.append(float(model.actuator_gainprm[found[0], 0]))
            own = -float(model.actuator_biasprm[found[0], 2])
            damping.append(own + float(model.dof_damping[model.jnt_dofadr[joint]]))
        return np.array(motors), np.array(stiffness), np.array(damping)

    # --------------------------------------------------------------------------------------------------------------- frames

    def _seen_from_scene(self, position: Array, quat: Array) -> tuple[Array, Array]:
        """A pose of the model's world, in the world of the scene."""
        back = quat_inverse(self.data.xquat[self._root])
        in_root = rotation_matrices(back) @ (position - self.data.xpos[self._root])
        turned = quat_product(self._root_quat, quat_product(back, quat))
        return self._root_position + rotation_matrices(self._root_quat) @ in_root, turned

    def _in_model(self, position: Array, quat: Array) -> tuple[Array, Array]:
        """A pose of the scene's world, in that of the model."""
        back = quat_inverse(self._root_quat)
        in_root = rotation_matrices(back) @ (position - self._root_position)
        turned = quat_product(self.data.xquat[self._root], quat_product(back, quat))
        return self.data.xpos[self._root] + rotation_matrices(self.data.xquat[self._root]) @ in_root, turned

    # ---------------------------------------------------------------------------------------------------------------- plant

    @property
    def pose(self) -> Pose:
        """Where the object really is, in the world of the scene."""
        position, quat = self.truth()
        return Pose(position, quat[[1, 2, 3, 0]])

    def truth(self) -> tuple[Array, Array]:
        """Position of the object's frame in the world of the scene, and its orientation w x y z."""
        return self._seen_from_scene(self.data.xpos[self._object].copy(), self.data.xquat[self._object].copy())

    def observe(self) -> Observation:
        """Encoders, fingertips, and the newest pose."""
        settings, now = self.settings, float(self.data.time)
        if now + 1e-9 >= self._next_pose:
            position, quat = self.truth()
            noise = self._rng.normal(size=(2, 3)) / np.sqrt(3.0)
            turned = quat_product(quat_exp(settings.pose_turn_noise * noise[1]), quat)
            self._seen = (now, position + settings.pose_noise * noise[0], turned)
            self._next_pose = now + 1.0 / settings.pose_rate
        joints = self.data.qpos[self._qpos] + settings.joint_noise * self._rng.normal(size=len(self._qpos))
        stamp, position, quat = self._seen if self._seen is not None else (None, None, None)
        return Observation(now, joints, stamp, position, quat, self.tip_forces())

    def apply(self, command: Command) -> None:
        """Gives targets to the actuators, and steps."""
        self._aim(command)
        mujoco.mj_step(self.model, self.data, self._steps)

    def _aim(self, command: Command) -> None:
        ranges = self.model.actuator_ctrlrange[self._motors]
        limited = self.model.actuator_ctrllimited[self._motors].astype(bool)
        within = np.clip(command.positions, ranges[:, 0], ranges[:, 1])
        self.data.ctrl[self._motors] = np.where(limited, within, command.positions)

    def tip_forces(self) -> Array:
        """Normal force between the object and every fingertip, in newtons."""
        model, data = self.model, self.data
        forces, wrench = np.zeros(len(self._tips)), np.zeros(6)
        for index in range(data.ncon):
            bodies = model.geom_bodyid[data.contact[index].geom]
            if self._object not in bodies:
                continue
            other = int(bodies[0] if bodies[1] == self._object else bodies[1])
            mujoco.mj_contactForce(model, data, index, wrench)
            forces[self._tips == other] += wrench[0]
        return forces

    def touching(self) -> int:
        """Number of fingertips that press on the object."""
        return int((self.tip_forces() > 0.0).sum())

    # ----------------------------------------------------------------------------------------------------------------- grip

    def _grip(self, plan: Plan) -> Command:
        """Lifts the object to where the plan has it, and closes the fingers on it while it becomes heavy. The command that holds it."""
        model, data = self.model, self.data
        control = Settings(hold_time=0.0, tick=self.tick)
        leg = Leg(plan, first_rig(plan, control, self.stiffness, self.damping), control)
        position, quat = leg.ref.object_position[0], leg.ref.object_quat_wxyz[0]
        command = leg.as_command(0, leg.command(0, position, quat, moves=False), moves=False)
        mujoco.mj_resetData(model, data)
        data.qpos[self._qpos] = leg.ref.joints[0]
        for address, leader, multiplier, offset in self._followers:
            data.qpos[address] = multiplier * leg.ref.joints[0][leader] + offset
        data.ctrl[self._motors] = leg.ref.joints[0]
        mujoco.mj_forward(model, data)
        at, turned = self._in_model(position, quat)
        data.qpos[self._free : self._free + 7] = np.concatenate([at, turned])
        n_steps = max(1, round(self.settings.grip_time / model.opt.timestep))
        for step in range(n_steps):
            # Planned forces balance the weight: with a share of the forces, a share of the weight.
            share = min(1.0, 2.0 * step / n_steps)
            model.body_gravcomp[self._object] = 1.0 - share
            targets = leg.ref.joints[0] + share * (command.positions - leg.ref.joints[0])
            self._aim(Command(command.servo, targets, command.velocities))
            mujoco.mj_step(model, data)
        data.time = 0.0
        return command
