"""The node for ROS 2 against messages and a clock that look like its own. ROS 2 itself is not needed, and not tested here."""

from __future__ import annotations

import importlib.util
import json
import sys
import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace
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


def joint_states(names: Sequence[str], positions: Any, velocities: Any = ()) -> Any:
    return SimpleNamespace(name=list(names), position=[float(at) for at in positions], velocity=[float(at) for at in velocities])


def test_messages_become_observations() -> None:
    clock = FakeClock()
    plant = ros2.RosPlant(["a", "b"], ["one"], lambda command, due: None, clock=clock)
    assert np.isnan(plant.observe().joints).all() and plant.observe().pose_stamp is None
    plant.on_joint_states(joint_states(["b", "other", "a"], [2.0, 9.0, 1.0]))
    plant.on_object_pose(stamped(99.5, (1, 2, 3), (1, 0, 0, 0)))
    seen = plant.observe()
    assert seen.joints.tolist() == [1.0, 2.0] and seen.pose_stamp == pytest.approx(99.5) and seen.time == 100.0
    assert seen.object_position is not None and seen.object_position.tolist() == [1.0, 2.0, 3.0]
    # Messages of efforts alone, and numbers that are none, say nothing of where a joint is.
    plant.on_joint_states(SimpleNamespace(name=["a", "b"], position=[], velocity=[]))
    plant.on_joint_states(joint_states(["a", "b"], [np.nan, 2.0], [1.0, np.nan]))
    assert plant.newest()[0].tolist() == [1.0, 2.0] and plant.newest()[1].tolist() == [0.0, 0.0]
    # What is not heard of any more is missing: it is not made up.
    clock.time += 0.15
    plant.on_joint_states(joint_states(["a"], [1.5]))
    assert plant.observe().joints.tolist() == [1.5, 2.0]
    assert plant.newest()[1].tolist() == [pytest.approx(0.5 / 0.15), 0.0]
    plant.on_joint_states(joint_states(["b", "a"], [2.0, 1.5], [-3.0, 4.0]))
    assert plant.newest()[1].tolist() == [4.0, -3.0]
    plant.on_joint_states(joint_states(["a"], [1.5]))
    clock.time += 0.15
    plant.on_joint_states(joint_states(["a"], [1.5]))
    clock.time += 0.1
    assert plant.observe().joints[0] == 1.5 and np.isnan(plant.observe().joints[1])


def test_commands_become_messages() -> None:
    command = Command(np.array([1.0, 2.0]), np.array([0.1, 0.2]), np.array([0.3, 0.4]))
    point = SimpleNamespace(time_from_start=SimpleNamespace())
    message = ros2.trajectory(SimpleNamespace(), point, ["a", "b"], command, 1.25)
    assert message.joint_names == ["a", "b"] and message.points[0].positions == [0.1, 0.2]
    assert (point.time_from_start.sec, point.time_from_start.nanosec) == (1, 250_000_000)
    joints, velocities = np.array([0.5, 0.5]), np.array([0.0, 3.0])
    torques = ros2.efforts(SimpleNamespace(), command, joints, velocities, np.array([2.0, 2.0]), np.array([0.1, 0.1]))
    assert torques.data == [0.0, pytest.approx(0.7)]


def test_goals_wait_for_their_turn() -> None:
    goals = ros2.Goals()
    goals.on_goal(stamped(0.0, (0, 0, 1), (2, 0, 0, 0)))
    assert goals.on_goal(stamped(0.0, (0, 0, 1), (np.nan, 0, 0, 0))) is None
    assert goals.on_goal(stamped(0.0, (0, np.inf, 1), (1, 0, 0, 0))) is None
    given = iter(goals)
    first = next(given)
    assert first is not None and first.quat_xyzw.tolist() == [0.0, 0.0, 0.0, 1.0]
    # Nobody waits for the next one.
    assert next(given) is None and next(given) is None
    second = goals.on_goal(stamped(0.0, (0, 0, 2), (1, 0, 0, 0)))
    third = goals.on_goal(stamped(0.0, (0, 0, 3), (1, 0, 0, 0)))
    assert second is not None and third is not None and next(given) is second.pose
    second.withdrawn = True
    assert goals.is_withdrawn(second.pose) and not goals.is_withdrawn(first)
    goals.close("the end")
    assert list(given) == [] and third.done.is_set() and third.message == "the end" and not second.done.is_set()
    assert goals.on_goal(stamped(0.0, (0, 0, 1), (1, 0, 0, 0))) is None
    goals.end("over")
    assert second.done.is_set() and second.result is None and second.message == "over"


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
        plant.on_joint_states(joint_states(inner.joint_names, seen.joints))
        if seen.pose_stamp is not None:
            plant.on_object_pose(stamped(100.0 + seen.pose_stamp, seen.object_position, seen.object_quat_wxyz))

    # The hand has the object when the node starts, and goes on with that until the first leg begins.
    grip = np.array(inner.data.ctrl[inner.rig.motors])
    sent.append(Command(grip, grip / inner.rig.stiffness, np.zeros(len(grip))))
    clock.waited.append(world)
    for _ in range(20):
        world()
    executor = Executor(
        regrasp.Session(scene, settings=PLANNER),
        plant,
        planning=ChargedPlanning,
        stiffness=inner.rig.stiffness,
        damping=inner.rig.damping,
    )
    log = executor.run(turns(inner.pose, count=1, seed=3))
    assert log.status == "done" and log.n_reached == 1, (log.message, log.goals, log.events)


def rig_velocities(plant: MujocoPlant) -> Any:
    model = plant.rig.model
    return plant.data.qvel[[model.jnt_dofadr[model.joint(name).id] for name in plant.joint_names]]


class Stack:
    """Modules that look like those of ROS 2, around a hand in MuJoCo. Commands move the hand, and it answers with its messages."""

    def __init__(self, inner: MujocoPlant) -> None:
        self.inner = inner
        self.heard: dict[str, Callable[[Any], Any]] = {}
        self.told: list[dict[str, Any]] = []
        self.n_commands = 0
        self.interrupts = False
        self.reach: Callable[[Any], Any] | None = None
        self.joints_are_seen = True
        holding = Command(np.array(inner.data.ctrl[inner.rig.motors]), np.zeros(0), np.zeros(0))
        # Until the camera has seen the object.
        for _ in range(40):
            inner.apply(holding)

    def modules(self) -> dict[str, Any]:
        def named(*names: str) -> dict[str, Any]:
            return {name: type(name, (SimpleNamespace,), {}) for name in names}

        point = type("JointTrajectoryPoint", (SimpleNamespace,), {"__init__": lambda own: setattr(own, "time_from_start", SimpleNamespace())})
        kind = SimpleNamespace(Feedback=SimpleNamespace, Result=SimpleNamespace)
        node = SimpleNamespace(
            create_publisher=lambda _, topic, __: SimpleNamespace(publish=partial(self.publish, topic)),
            create_subscription=lambda _, topic, callback, __: self.heard.update({topic: callback}),
        )
        spinning = SimpleNamespace(add_node=lambda _: None, spin=self.send)
        content: dict[str, dict[str, Any]] = {
            "rclpy": {"init": lambda: None, "create_node": lambda _: node, "try_shutdown": lambda: None},
            "rclpy.executors": {"MultiThreadedExecutor": lambda: spinning},
            "rclpy.callback_groups": {"ReentrantCallbackGroup": lambda: None},
            "rclpy.action": {"ActionServer": self.serve, "CancelResponse": SimpleNamespace(ACCEPT=2)},
            "regrasp_msgs.action": {"ReachPose": kind},
            "sensor_msgs.msg": named("JointState"),
            "geometry_msgs.msg": named("PoseStamped"),
            "trajectory_msgs.msg": {**named("JointTrajectory"), "JointTrajectoryPoint": point},
            "std_msgs.msg": named("Float64MultiArray", "String"),
        }
        made = {}
        for name, members in content.items():
            made[name] = ModuleType(name)
            made[name].__dict__.update(members)
        return made

    def serve(self, node: Any, kind: Any, name: str, *, execute_callback: Any, cancel_callback: Any, callback_group: Any) -> None:
        assert name == "reach_pose" and cancel_callback(None) == 2
        self.reach = execute_callback

    def publish(self, topic: str, message: Any) -> None:
        if topic == "run_events":
            self.told.append(json.loads(message.data))
            return
        self.n_commands += 1
        rig = self.inner.rig
        if topic == "joint_commands":
            # The motors of the model have a spring and a damper of their own: torques without them.
            joints, velocities = self.inner.observe().joints, rig_velocities(self.inner)
            servo = np.array(message.data) + rig.stiffness * joints + rig.damping * velocities
        else:
            assert topic == "joint_trajectory" and message.joint_names == list(self.inner.joint_names)
            point = message.points[0]
            servo = rig.stiffness * np.array(point.positions) + rig.damping * np.array(point.velocities)
        self.inner.apply(Command(servo, np.zeros(0), np.zeros(0)))
        self.send()
        if self.interrupts:
            self.interrupts = False
            raise KeyboardInterrupt

    def send(self) -> None:
        """Joints and pose of now."""
        seen = self.inner.observe()
        if self.joints_are_seen:
            self.heard["joint_states"](joint_states(self.inner.joint_names, seen.joints, rig_velocities(self.inner)))
        if seen.object_position is not None:
            self.heard["object_pose"](stamped(time.time(), seen.object_position, seen.object_quat_wxyz))

    def send_until(self, is_over: Callable[[], bool]) -> None:
        """Messages while the hand has no command yet."""
        limit = time.time() + 60.0
        while not is_over():
            assert time.time() < limit, self.told
            if self.n_commands == 0 and "object_pose" in self.heard:
                self.send()
            time.sleep(0.01)

    def ask(self, pose: regrasp.Pose) -> Any:
        """The handle of an action, on a thread of its own."""
        x, y, z, w = pose.quat_xyzw
        handle = SimpleNamespace(request=SimpleNamespace(pose=stamped(0.0, pose.position, (w, x, y, z))), is_cancel_requested=False)
        handle.feedback, handle.outcome = [], ""
        handle.publish_feedback = lambda feedback: handle.feedback.append((feedback.distance, feedback.angle))
        for outcome in ("succeed", "abort", "canceled"):
            setattr(handle, outcome, partial(setattr, handle, "outcome", outcome))
        assert self.reach is not None
        reach = self.reach
        handle.thread = threading.Thread(target=lambda: setattr(handle, "result", reach(handle)), daemon=True)
        handle.thread.start()
        return handle


@pytest.mark.skipif(importlib.util.find_spec("rclpy") is not None, reason="ROS 2 is here")
def test_the_node_serves_actions_and_goals_as_they_come(monkeypatch: pytest.MonkeyPatch) -> None:
    inner = MujocoPlant.of(SCENES / "sphere_90x.toml", PlantSettings(seed=2), seed=2)
    stack = Stack(inner)
    for name, module in stack.modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    codes: list[int] = []
    arguments = [str(SCENES / "sphere_90x.toml"), "--stiffness", str(inner.rig.stiffness[0]), "--damping", str(inner.rig.damping[0])]
    arguments += ["--tick", str(inner.tick)]
    node = threading.Thread(target=lambda: codes.append(ros2.main(arguments)), daemon=True)
    node.start()
    stack.send_until(lambda: stack.reach is not None)
    time.sleep(0.1)
    assert stack.n_commands == 0, "before the first leg the hand holds as it did"
    first, second, third = turns(inner.pose, count=3, seed=3, largest=0.3)

    # One goal alone is executed at once: nobody waits for another one.
    handle = stack.ask(first)
    stack.send_until(lambda: not handle.thread.is_alive())
    assert handle.outcome == "succeed" and handle.result.reached and handle.result.message == "", stack.told
    assert handle.result.distance < 0.002 and handle.feedback and handle.feedback[-1][1] < handle.feedback[0][1]
    # The hand goes on holding while there is nothing to do.
    before = stack.n_commands
    stack.send_until(lambda: stack.n_commands > before + 10)

    # A goal that is withdrawn while the hand moves.
    handle = stack.ask(second)
    stack.send_until(lambda: len(handle.feedback) > 3)
    handle.is_cancel_requested = True
    stack.send_until(lambda: not handle.thread.is_alive())
    assert handle.outcome == "canceled" and not handle.result.reached and handle.result.message == "withdrawn"
    assert any(told.get("event", {}).get("kind") == "withdrawn" for told in stack.told)

    # A goal by the topic, then one that the end of the run leaves open.
    x, y, z, w = third.quat_xyzw
    stack.heard["goal"](stamped(0.0, third.position, (w, x, y, z)))
    stack.send_until(lambda: sum("goal" in told for told in stack.told) == 3)
    assert [told["goal"]["reached"] for told in stack.told if "goal" in told] == [True, False, True]
    stack.interrupts = True
    node.join(timeout=20.0)
    assert codes == [0]
    late = stack.ask(first)
    late.thread.join(timeout=5.0)
    assert late.outcome == "abort" and "over" in late.result.message
    # The last command holds.
    for _ in range(200):
        inner.apply(Command(np.array(inner.data.ctrl[inner.rig.motors]), np.zeros(0), np.zeros(0)))
    assert inner.touching() >= 3


@pytest.mark.skipif(importlib.util.find_spec("rclpy") is not None, reason="ROS 2 is here")
@pytest.mark.parametrize("drives", ["position", "effort"])
def test_the_node_waits_for_joints_and_goes_without_an_action(
    drives: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    inner = MujocoPlant.of(SCENES / "sphere_90x.toml", PlantSettings(seed=2), seed=2)
    stack = Stack(inner)
    stack.joints_are_seen = False
    modules = stack.modules()
    modules["regrasp_msgs.action"] = None
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    codes: list[int] = []
    arguments = [str(SCENES / "sphere_90x.toml"), "--stiffness", str(inner.rig.stiffness[0]), "--damping", str(inner.rig.damping[0])]
    arguments += ["--drives", drives, "--tick", str(inner.tick)]
    node = threading.Thread(target=lambda: codes.append(ros2.main(arguments)), daemon=True)
    node.start()
    stack.send_until(lambda: {"waiting_for": list(inner.joint_names)} in stack.told)
    goal = next(turns(inner.pose, count=1, seed=3, largest=0.3))
    x, y, z, w = goal.quat_xyzw
    stack.heard["goal"](stamped(0.0, goal.position, (w, x, y, z)))
    time.sleep(0.2)
    assert stack.n_commands == 0 and not codes
    stack.joints_are_seen = True
    stack.send_until(lambda: any("goal" in told for told in stack.told))
    assert [told["goal"]["reached"] for told in stack.told if "goal" in told] == [True]
    stack.interrupts = True
    node.join(timeout=20.0)
    assert codes == [0] and "regrasp_msgs was not built" in capsys.readouterr().err


@pytest.mark.skipif(importlib.util.find_spec("rclpy") is not None, reason="ROS 2 is here")
def test_without_ros_the_node_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert ros2.main([str(SCENES / "sphere_90x.toml"), "--stiffness", "1"]) == 2
    assert "ROS 2" in capsys.readouterr().err
