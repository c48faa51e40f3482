"""The node for ROS 2 against messages and a clock that look like its own. ROS 2 itself is not needed, and not tested here."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import regrasp

pytest.importorskip("mujoco")

from regrasp import ros2  # noqa: E402
from regrasp.execute import Command, Executor, MujocoPlant, PlantSettings, turns  # noqa: E402
from regrasp.execute.planning import ChargedPlanning  # noqa: E402
from regrasp.execute.settings import PLANNER  # noqa: E402

SCENES = Path(__file__).parents[2] / "scenes"


class FakeClock:
    """Time that passes when somebody waits."""

    def __init__(self) -> None:
        self.time = 100.0
        self.waited: list[Any] = []

    def now(self) -> float:
        return self.time

    def sleep_until(self, when: float) -> None:
        self.time = max(self.time, when)
        for call in self.waited:
            call()


def stamped(stamp: float, position: Any, quat_wxyz: Any) -> Any:
    x, y, z = (float(value) for value in position)
    w, i, j, k = (float(value) for value in quat_wxyz)
    sec = int(stamp)
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=round(1e9 * (stamp - sec)))),
        pose=SimpleNamespace(
            position=SimpleNamespace(x=x, y=y, z=z), orientation=SimpleNamespace(x=i, y=j, z=k, w=w)
        ),
    )


def test_messages_become_observations() -> None:
    plant = ros2.RosPlant(["a", "b"], ["one"], lambda command, due: None, clock=FakeClock())
    assert np.isnan(plant.observe().joints).all() and plant.observe().pose_stamp is None
    plant.on_joint_states(SimpleNamespace(name=["b", "other", "a"], position=[2.0, 9.0, 1.0]))
    plant.on_object_pose(stamped(99.5, (1, 2, 3), (1, 0, 0, 0)))
    seen = plant.observe()
    assert seen.joints.tolist() == [1.0, 2.0] and seen.pose_stamp == pytest.approx(99.5) and seen.time == 100.0
    assert seen.object_position is not None and seen.object_position.tolist() == [1.0, 2.0, 3.0]
    plant.on_joint_states(SimpleNamespace(name=["a"], position=[1.0]))
    assert np.isnan(plant.observe().joints[1]), "a joint that is missing is not made up"


def test_commands_become_messages() -> None:
    command = Command(np.array([1.0, 2.0]), np.array([0.1, 0.2]), np.array([0.3, 0.4]))
    point = SimpleNamespace(time_from_start=SimpleNamespace())
    message = ros2.trajectory(SimpleNamespace(), point, ["a", "b"], command, 1.25)
    assert message.joint_names == ["a", "b"] and message.points[0].positions == [0.1, 0.2]
    assert (point.time_from_start.sec, point.time_from_start.nanosec) == (1, 250_000_000)
    torques = ros2.efforts(SimpleNamespace(), command, np.array([0.5, 0.5]), np.array([2.0, 2.0]))
    assert torques.data == [0.0, 1.0]


def test_goals_wait_for_their_turn() -> None:
    goals = ros2.Goals()
    goals.on_goal(stamped(0.0, (0, 0, 1), (2, 0, 0, 0)))
    goals.on_goal(stamped(0.0, (0, 0, 1), (np.nan, 0, 0, 0)))
    goals.close()
    found = list(goals)
    assert len(found) == 1 and found[0].quat_xyzw.tolist() == [0.0, 0.0, 0.0, 1.0]


def test_a_robot_behind_messages_reaches_a_goal() -> None:
    scene = regrasp.load_scene(SCENES / "sphere_90x.toml")
    inner = MujocoPlant.of(scene, PlantSettings(seed=2), seed=2)
    clock = FakeClock()
    sent: list[Command] = []
    plant = ros2.RosPlant(inner.joint_names, inner.fingers, lambda command, due: sent.append(command), clock=clock, tick=inner.tick)

    def world() -> None:
        # The drives are position drives with the stiffness of replays; their targets hold the share of the torque.
        if sent:
            positions = inner.rig.stiffness * sent[-1].positions + inner.rig.damping * sent[-1].velocities
            inner.apply(Command(positions, sent[-1].positions, sent[-1].velocities))
        seen = inner.observe()
        plant.on_joint_states(SimpleNamespace(name=list(inner.joint_names), position=seen.joints.tolist()))
        if seen.pose_stamp is not None:
            plant.on_object_pose(stamped(100.0 + seen.pose_stamp, seen.object_position, seen.object_quat_wxyz))

    # The hand has the object when the node starts; so the first command is the one that holds it.
    grip = np.array(inner.data.ctrl[inner.rig.motors])
    sent.append(Command(grip, grip / inner.rig.stiffness, np.zeros(len(grip))))
    clock.waited.append(world)
    for _ in range(20):
        world()
    plant.data, plant.rig = inner.data, inner.rig  # type: ignore[attr-defined]
    executor = Executor(
        regrasp.Session(scene, settings=PLANNER),
        plant,
        planning=ChargedPlanning,
        stiffness=inner.rig.stiffness,
        damping=inner.rig.damping,
    )
    log = executor.run(turns(inner.pose, count=1, seed=3))
    assert log.status == "done" and log.n_reached == 1, (log.message, log.goals, log.events)


@pytest.mark.skipif(importlib.util.find_spec("rclpy") is not None, reason="ROS 2 is here")
def test_without_ros_the_node_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert ros2.main([str(SCENES / "sphere_90x.toml"), "--stiffness", "1"]) == 2
    assert "ROS 2" in capsys.readouterr().err
