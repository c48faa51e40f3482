"""A plant in MuJoCo: the scene as it is simulated, disturbed as settings say, seen through a camera with noise and delay."""

from __future__ import annotations

import json
import warnings
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._arguments import StrPath
from .._model import Pose, Scene, load_scene
from .._plan import Plan
from .._planning import export_mjcf
from .._planning import plan as plan_scene
from ..simulate import replay
from ..simulate._mujoco import mujoco
from ..simulate.controllers import Controller
from ..simulate.model import Rig, Settings, make_rig
from ..simulate.plans import flat
from ..simulate.reference import Array, PlanError, quat_exp, quat_product, reference
from .plant import Command, Observation
from .settings_check import PLANT, check_settings, check_simulation, instance


@dataclass(frozen=True)
class PlantSettings:
    """How the simulation differs from the plan, and what is seen of it."""

    simulation: Settings = field(default_factory=lambda: Settings(hold_time=0.0))
    """Friction, mass, gravity, tick: as in ``regrasp.simulate``."""
    pose_rate: float = 30.0
    """Poses of the object per second."""
    pose_delay: float = 0.03
    """Age of a pose when it is seen, in seconds."""
    pose_noise: float = 0.0005
    """Standard deviation of the length of a pose's error in position, in metres."""
    pose_turn_noise: float = float(np.radians(0.5))
    """The same in orientation, in radians."""
    joint_noise: float = 0.0002
    """Standard deviation of encoders, in radians or metres."""
    feels_forces: bool = True
    """Whether fingertips feel normal forces."""
    push: float = 0.0
    """Force on the object, in newtons, in pushes,"""
    push_every: float = 4.0
    """on average so many seconds apart,"""
    push_time: float = 0.2
    """each so long, in a random direction."""
    seed: int = 0

    def __post_init__(self) -> None:
        """Raises ``InputError`` (A510) for a setting that no plant can have."""
        check_settings(self, {**PLANT, "simulation": instance(Settings)})
        check_simulation("PlantSettings", self.simulation)


class MujocoPlant:
    """The hand and the object of a plan's scene, gripped as the plan begins."""

    def __init__(self, plan: Plan, settings: PlantSettings | None = None) -> None:
        """Grips. Raises ``PlanError`` for plans that cannot be replayed."""
        settings = settings or PlantSettings()
        self.settings = settings
        self.scene: Scene | None = plan._source  # pyright: ignore[reportPrivateUsage]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            xml = export_mjcf(plan)
        simulation = settings.simulation
        content = flat(json.loads(plan.to_json()))
        self.rig: Rig = make_rig(xml, content, simulation)
        self.joint_names: tuple[str, ...] = tuple(plan.joint_names)
        self.fingers: tuple[str, ...] = tuple(plan.fingers)
        self.tick: float = simulation.tick
        ref = reference(content, tick=simulation.tick, speed=simulation.speed)
        controller = Controller(self.rig, ref, simulation)
        self.data: Any = replay.grip(self.rig, controller, simulation)
        self.data.time = 0.0
        self._steps = max(1, round(simulation.tick / self.rig.model.opt.timestep))
        self._qpos = np.array([self.rig.model.jnt_qposadr[self.rig.model.joint(name).id] for name in self.rig.joint_names])
        self._rng = np.random.default_rng(settings.seed)
        self._waiting: deque[tuple[float, Array, Array]] = deque()
        self._next_pose = 0.0
        self._seen: tuple[float, Array, Array] | None = None
        self._push_until = -1.0
        self._push = np.zeros(3)
        self.largest_error = 0.0

    @staticmethod
    def of(scene: Scene | StrPath, settings: PlantSettings | None = None, *, seed: int = 0, **arguments: Any) -> MujocoPlant:
        """The plant of a scene, gripped as a plan for its task begins. Arguments as of ``regrasp.plan``. Raises ``PlanError``
        where there is no such plan."""
        scene = scene if isinstance(scene, Scene) else load_scene(scene)
        plan = plan_scene(scene, seed=seed, **arguments)
        if not isinstance(plan, Plan):
            raise PlanError(f"no plan to grip by: {plan.message}")
        return MujocoPlant(plan, settings)

    @property
    def pose(self) -> Pose:
        """Where the object really is: for those who judge, not for those who act."""
        position, quat = self.truth()
        return Pose(position, quat[[1, 2, 3, 0]])

    def truth(self) -> tuple[Array, Array]:
        """Position of the object's frame, and its orientation w x y z."""
        first = self.rig.object_qpos
        return self.data.qpos[first : first + 3].copy(), self.data.qpos[first + 3 : first + 7].copy()

    def observe(self) -> Observation:
        """What camera, encoders and fingertips have by now."""
        settings, now = self.settings, float(self.data.time)
        while now + 1e-9 >= self._next_pose:
            position, quat = self.truth()
            # A vector of three such parts has the length asked for.
            noise = self._rng.normal(size=(2, 3)) / np.sqrt(3.0)
            turned = quat_product(quat_exp(settings.pose_turn_noise * noise[1]), quat)
            self._waiting.append((self._next_pose, position + settings.pose_noise * noise[0], turned))
            self._next_pose += 1.0 / settings.pose_rate
        while self._waiting and self._waiting[0][0] + settings.pose_delay <= now + 1e-9:
            self._seen = self._waiting.popleft()
        joints = self.data.qpos[self._qpos] + settings.joint_noise * self._rng.normal(size=len(self._qpos))
        forces = self.data.sensordata[self.rig.normal_force].copy() if settings.feels_forces else None
        stamp, position, quat = self._seen if self._seen is not None else (None, None, None)
        return Observation(now, joints, stamp, position, quat, forces)

    def apply(self, command: Command) -> None:
        """Steps the simulation by one tick."""
        self.data.ctrl[self.rig.motors] = command.servo
        self._disturb()
        mujoco.mj_step(self.rig.model, self.data, self._steps)

    def touching(self) -> int:
        """Number of fingertips that press on the object."""
        return int((self.data.sensordata[self.rig.normal_force] > 0.0).sum())

    def _disturb(self) -> None:
        settings = self.settings
        if settings.push == 0.0:
            return
        now = float(self.data.time)
        if now > self._push_until and self._rng.random() < self.tick / settings.push_every:
            direction = self._rng.normal(size=3)
            self._push = settings.push * direction / np.linalg.norm(direction)
            self._push_until = now + settings.push_time
        body = self.rig.object_body
        self.data.xfrc_applied[body, :3] = self._push if now <= self._push_until else 0.0
