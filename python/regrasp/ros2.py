"""A node for ROS 2 that brings the object to a goal: joint states and the object's pose in, joint commands out.

    ros2 run ... python -m regrasp.ros2 scene.toml --drives position

| what | name | type |
|---|---|---|
| in | ``joint_states`` | ``sensor_msgs/JointState`` |
| in | ``object_pose`` | ``geometry_msgs/PoseStamped``, in the frame of the scene's world |
| in | ``goal`` | ``geometry_msgs/PoseStamped``: a pose to reach; a newer one waits for its turn |
| out | ``joint_trajectory`` | ``trajectory_msgs/JointTrajectory``, one point ahead, for position drives |
| out | ``joint_commands`` | ``std_msgs/Float64MultiArray``, torques, for effort drives |
| out | ``run_events`` | ``std_msgs/String``: events and results, as JSON |

Goals come as a topic and not as an action: actions need types that are built with a workspace. ``docs/how-to/execute.md`` says what drivers
of Allegro and LEAP hands need. Everything but `main` works without ROS 2: it is tested against messages and a clock that look alike.
"""

from __future__ import annotations

import argparse
import json
import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from importlib import import_module
from typing import Any, Protocol

import numpy as np

from ._model import Pose
from .execute.executor import Executor
from .execute.planning import ThreadPlanning
from .execute.plant import Command, Observation
from .execute.sessions import ExecutorSessions
from .simulate.reference import Array

#: How long a driver may take to reach the next point of a trajectory, in ticks.
AHEAD = 2


class Clock(Protocol):
    """Time of the robot, and waiting for it."""

    def now(self) -> float:
        """Seconds."""
        ...

    def sleep_until(self, when: float) -> None:
        """Waits."""
        ...


class WallClock:
    """The time of this machine."""

    def now(self) -> float:
        return time.time()

    def sleep_until(self, when: float) -> None:
        time.sleep(max(0.0, when - time.time()))


class RosPlant:
    """A robot behind messages. Callbacks may come from another thread; the newest message of each kind counts."""

    def __init__(
        self,
        joint_names: Sequence[str],
        fingers: Sequence[str],
        send: Callable[[Command, float], None],
        *,
        clock: Clock | None = None,
        tick: float = 0.01,
    ) -> None:
        """send: gives a command to the drives, which is due at a time of the clock."""
        self.joint_names = tuple(joint_names)
        self.fingers = tuple(fingers)
        self.tick = tick
        self._send = send
        self._clock = clock or WallClock()
        self._lock = threading.Lock()
        self._joints = np.full(len(self.joint_names), np.nan)
        self._pose: tuple[float, Array, Array] | None = None
        self._due = self._clock.now()

    def on_joint_states(self, message: Any) -> None:
        """Of ``sensor_msgs/JointState``: joints that are no joints of the hand are passed over."""
        known = {name: position for name, position in zip(message.name, message.position)}
        with self._lock:
            self._joints = np.array([float(known.get(name, np.nan)) for name in self.joint_names])

    def on_object_pose(self, message: Any) -> None:
        """Of ``geometry_msgs/PoseStamped``."""
        stamp = float(message.header.stamp.sec) + 1e-9 * float(message.header.stamp.nanosec)
        position, quat = message.pose.position, message.pose.orientation
        with self._lock:
            self._pose = (
                stamp,
                np.array([position.x, position.y, position.z], dtype=np.float64),
                np.array([quat.w, quat.x, quat.y, quat.z], dtype=np.float64),
            )

    def observe(self) -> Observation:
        """The newest of everything."""
        with self._lock:
            stamp, position, quat = self._pose if self._pose is not None else (None, None, None)
            return Observation(self._clock.now(), self._joints.copy(), stamp, position, quat)

    def apply(self, command: Command) -> None:
        """Sends a command, and waits until the next is due. A late caller is not made up for."""
        self._due = max(self._due + self.tick, self._clock.now())
        self._send(command, self._due + AHEAD * self.tick)
        self._clock.sleep_until(self._due)


class Goals:
    """Goals as they come, for an executor that runs until it is closed."""

    def __init__(self) -> None:
        self._waiting: queue.Queue[Pose | None] = queue.Queue()

    def on_goal(self, message: Any) -> None:
        """Of ``geometry_msgs/PoseStamped``."""
        position, quat = message.pose.position, message.pose.orientation
        xyzw = np.array([quat.x, quat.y, quat.z, quat.w], dtype=np.float64)
        norm = float(np.linalg.norm(xyzw))
        if np.isfinite(norm) and norm > 1e-6:
            self._waiting.put(Pose(np.array([position.x, position.y, position.z], dtype=np.float64), xyzw / norm))

    def close(self) -> None:
        """No more goals."""
        self._waiting.put(None)

    def __iter__(self) -> Iterator[Pose]:
        while (goal := self._waiting.get()) is not None:
            yield goal


def trajectory(message: Any, point: Any, joint_names: Sequence[str], command: Command, seconds: float) -> Any:
    """Fills an empty ``JointTrajectory`` with one point, for position drives: targets that hold the stiffness's share of the
    torque."""
    point.positions = [float(value) for value in command.positions]
    point.velocities = [float(value) for value in command.velocities]
    point.time_from_start.sec = int(seconds)
    point.time_from_start.nanosec = round(1e9 * (seconds - int(seconds)))
    message.joint_names = list(joint_names)
    message.points = [point]
    return message


def efforts(message: Any, command: Command, joints: Array, stiffness: Array) -> Any:
    """Fills an empty ``Float64MultiArray`` with torques, for effort drives."""
    message.data = [float(value) for value in command.servo - stiffness * joints]
    return message


def main(arguments: list[str] | None = None) -> int:
    """The node. Exit code 2 where ROS 2 is absent."""
    parser = argparse.ArgumentParser(prog="python -m regrasp.ros2", description="Brings the object of a scene to goals, on a robot.")
    parser.add_argument("scene")
    parser.add_argument("--package", action="append", default=[], metavar="NAME=DIR")
    parser.add_argument("--drives", choices=["position", "effort"], default="position")
    parser.add_argument("--stiffness", type=float, required=True, help="of the joints' drives, in N m/rad, as the driver has it")
    parser.add_argument("--damping", type=float, default=0.0, help="in N m s/rad")
    parser.add_argument("--tick", type=float, default=0.01, help="seconds between two commands")
    asked = parser.parse_args(arguments)
    try:
        rclpy: Any = import_module("rclpy")
    except ImportError:
        print("error: rclpy is not here; source a ROS 2 installation first", file=sys.stderr)
        return 2
    types = {name: getattr(import_module(f"{package}.msg"), name) for package, name in _TYPES}
    from ._model import load_scene

    scene = load_scene(asked.scene, packages=dict(entry.split("=", 1) for entry in asked.package))
    sessions = ExecutorSessions.of(scene)
    session = sessions.usual
    n_joints = len(session.hand.joint_names)
    stiffness, damping = np.full(n_joints, asked.stiffness), np.full(n_joints, asked.damping)
    rclpy.init()
    node: Any = rclpy.create_node("regrasp")
    out: Any = (
        node.create_publisher(types["JointTrajectory"], "joint_trajectory", 1)
        if asked.drives == "position"
        else node.create_publisher(types["Float64MultiArray"], "joint_commands", 1)
    )
    told: Any = node.create_publisher(types["String"], "run_events", 10)

    def send(command: Command, due: float) -> None:
        if asked.drives == "position":
            message, point = types["JointTrajectory"](), types["JointTrajectoryPoint"]()
            out.publish(trajectory(message, point, plant.joint_names, command, max(due - time.time(), 0.001)))
        else:
            out.publish(efforts(types["Float64MultiArray"](), command, plant.observe().joints, stiffness))

    plant = RosPlant(session.hand.joint_names, [finger.name for finger in session.hand.fingers], send, tick=asked.tick)
    goals = Goals()
    node.create_subscription(types["JointState"], "joint_states", plant.on_joint_states, 1)
    node.create_subscription(types["PoseStamped"], "object_pose", plant.on_object_pose, 1)
    node.create_subscription(types["PoseStamped"], "goal", goals.on_goal, 10)
    listener = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)
    listener.start()
    executor = Executor.of(sessions, plant, planning=ThreadPlanning, stiffness=stiffness, damping=damping)
    try:
        log = executor.run(goals)
        told.publish(types["String"](data=json.dumps({"status": log.status, "goals": [asdict(goal) for goal in log.goals]})))
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()
        listener.join(timeout=2.0)
    return 0


_TYPES = (
    ("sensor_msgs", "JointState"),
    ("geometry_msgs", "PoseStamped"),
    ("trajectory_msgs", "JointTrajectory"),
    ("trajectory_msgs", "JointTrajectoryPoint"),
    ("std_msgs", "Float64MultiArray"),
    ("std_msgs", "String"),
)


if __name__ == "__main__":
    sys.exit(main())
