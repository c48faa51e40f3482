"""A node for ROS 2 that brings the object to a goal: joint states and the object's pose in, joint commands out.

    ros2 run ... python -m regrasp.ros2 scene.toml --drives position

| what | name | type |
|---|---|---|
| in | ``joint_states`` | ``sensor_msgs/JointState`` |
| in | ``object_pose`` | ``geometry_msgs/PoseStamped``, in the frame of the scene's world |
| in | ``goal`` | ``geometry_msgs/PoseStamped``: a pose to reach; a newer one waits for its turn |
| action | ``reach_pose`` | ``regrasp_msgs/action/ReachPose``: the same, with its distance meanwhile and its result; it can be cancelled |
| out | ``joint_trajectory`` | ``trajectory_msgs/JointTrajectory``, one point ahead, for position drives |
| out | ``joint_commands`` | ``std_msgs/Float64MultiArray``, torques, for effort drives |
| out | ``run_events`` | ``std_msgs/String``: what the node waits for, every event, what became of every goal, and of the run, as JSON |

The action is there where the package of ``ros2/regrasp_msgs`` was built in the workspace. No command is given before the first leg begins, so
that the hand holds the object as it did before. ``docs/how-to/execute.md`` says what drivers of Allegro and LEAP hands need. The node is tested
against messages, a clock and an ``rclpy`` that look alike.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from importlib import import_module
from typing import Any, Protocol

import numpy as np

from ._model import Pose
from .execute.executor import Executor
from .execute.guards import are_believable
from .execute.log import Event, GoalResult
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
        stale_after: float = 0.2,
    ) -> None:
        """send: gives a command to the drives, which is due at a time of the clock. stale_after: joints that were not heard of for so many
        seconds are missing."""
        self.joint_names = tuple(joint_names)
        self.fingers = tuple(fingers)
        self.tick = tick
        self._send = send
        self._clock = clock or WallClock()
        self._lock = threading.Lock()
        self._joints = np.full(len(self.joint_names), np.nan)
        self._velocities = np.zeros(len(self.joint_names))
        self._heard = np.full(len(self.joint_names), -np.inf)
        self._stale_after = stale_after
        self._pose: tuple[float, Array, Array] | None = None
        self._due = self._clock.now()

    def on_joint_states(self, message: Any) -> None:
        """Of ``sensor_msgs/JointState``: joints that are no joints of the hand are passed over, and positions that are no numbers. Joints may
        come in several messages, and without velocities: then those are what the position has changed since."""
        known = {name: float(position) for name, position in zip(message.name, message.position)}
        velocities = {name: float(velocity) for name, velocity in zip(message.name, message.velocity)}
        now = self._clock.now()
        with self._lock:
            for index, name in enumerate(self.joint_names):
                position, velocity = known.get(name, np.nan), velocities.get(name, np.nan)
                if not np.isfinite(position):
                    continue
                since = now - self._heard[index]
                if np.isfinite(velocity):
                    self._velocities[index] = velocity
                elif 0.0 < since <= self._stale_after:
                    self._velocities[index] = (position - self._joints[index]) / since
                else:
                    self._velocities[index] = 0.0
                self._joints[index], self._heard[index] = position, now

    def newest(self) -> tuple[Array, Array]:
        """The last positions and velocities of the joints that were heard of, however long ago."""
        with self._lock:
            return self._joints.copy(), self._velocities.copy()

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
            now = self._clock.now()
            stamp, position, quat = self._pose if self._pose is not None else (None, None, None)
            joints = np.where(now - self._heard <= self._stale_after, self._joints, np.nan)
            return Observation(now, joints, stamp, position, quat)

    def missing(self) -> list[str]:
        """What was not heard of: joints by name, and ``object_pose``."""
        seen = self.observe()
        joints = [name for name, position in zip(self.joint_names, seen.joints) if not np.isfinite(position)]
        return joints + (["object_pose"] if seen.pose_stamp is None else [])

    def apply(self, command: Command) -> None:
        """Sends a command, and waits until the next is due. A late caller is not made up for."""
        self._due = max(self._due + self.tick, self._clock.now())
        self._send(command, self._due + AHEAD * self.tick)
        self._clock.sleep_until(self._due)

    def wait(self) -> None:
        """Waits until the next command is due, and sends none."""
        self._due = max(self._due + self.tick, self._clock.now())
        self._clock.sleep_until(self._due)


@dataclass(eq=False)
class Asked:
    """A goal that was asked for."""

    pose: Pose
    withdrawn: bool = False
    result: GoalResult | None = None
    message: str = ""
    """Why there is no result."""
    done: threading.Event = field(default_factory=threading.Event)


class Goals:
    """Goals as they come, for an executor that runs until it is closed, and what became of them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._open: list[Asked] = []
        """Without a result, in the order in which they came."""
        self._n_given = 0
        """Of these, so many were given to the executor."""
        self._closed = False

    def on_goal(self, message: Any) -> Asked | None:
        """Of ``geometry_msgs/PoseStamped``. None where that is no pose, or nobody takes goals any more."""
        position, quat = message.pose.position, message.pose.orientation
        xyz = np.array([position.x, position.y, position.z], dtype=np.float64)
        xyzw = np.array([quat.x, quat.y, quat.z, quat.w], dtype=np.float64)
        norm = float(np.linalg.norm(xyzw))
        if not (are_believable(xyz) and are_believable(xyzw) and norm > 1e-6):
            return None
        with self._lock:
            if self._closed:
                return None
            asked = Asked(Pose(xyz, xyzw / norm))
            self._open.append(asked)
            return asked

    def is_withdrawn(self, pose: Pose) -> bool:
        """True where this goal is not wanted any more."""
        with self._lock:
            return any(asked.withdrawn and asked.pose is pose for asked in self._open)

    def on_happening(self, happening: Event | GoalResult) -> None:
        """Takes results over: they come in the order of the goals."""
        if isinstance(happening, GoalResult):
            with self._lock:
                asked = self._open.pop(0)
                self._n_given -= 1
                asked.result = happening
            asked.done.set()

    def close(self, message: str = "") -> None:
        """No more goals. Those that are still open get no result; message: why."""
        with self._lock:
            self._closed = True
            waiting, self._open = self._open[self._n_given :], self._open[: self._n_given]
        for asked in waiting:
            asked.message = message
            asked.done.set()

    def end(self, message: str) -> None:
        """As `close`, and the run is over: what was given has no result either."""
        with self._lock:
            self._n_given = 0
        self.close(message)

    def __iter__(self) -> Iterator[Pose | None]:
        while True:
            with self._lock:
                given = self._open[self._n_given] if self._n_given < len(self._open) else None
                self._n_given += given is not None
                is_over = given is None and self._closed
            if is_over:
                return
            yield None if given is None else given.pose


def reach(goals: Goals, handle: Any, feedback: Any, result: Any, plant: RosPlant) -> Any:
    """Carries an action out: waits until its goal has a result. Of ``regrasp_msgs/action/ReachPose``: its goal handle, and an empty feedback
    and result. Returns the result."""
    asked = goals.on_goal(handle.request.pose)
    if asked is None:
        handle.abort()
        result.reached, result.message = False, "this is no pose, or the run is over"
        return result
    while not asked.done.wait(0.1):
        asked.withdrawn = asked.withdrawn or bool(handle.is_cancel_requested)
        seen = plant.observe()
        if seen.object_position is not None and seen.object_quat_wxyz is not None:
            there = np.array(asked.pose.quat_xyzw)[[3, 0, 1, 2]]
            feedback.distance = float(np.linalg.norm(seen.object_position - asked.pose.position))
            feedback.angle = 2.0 * float(np.arccos(min(1.0, abs(float(seen.object_quat_wxyz @ there)))))
            handle.publish_feedback(feedback)
    found = asked.result
    result.reached = found is not None and found.reached
    result.message = asked.message if found is None else found.why_not
    result.distance, result.angle = (-1.0, -1.0) if found is None else (found.distance, found.angle)
    if result.reached:
        handle.succeed()
    elif asked.withdrawn and handle.is_cancel_requested:
        handle.canceled()
    else:
        handle.abort()
    return result


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


def efforts(message: Any, command: Command, joints: Array, velocities: Array, stiffness: Array, damping: Array) -> Any:
    """Fills an empty ``Float64MultiArray`` with torques, for effort drives: those of a spring and a damper, and the planned ones."""
    message.data = [float(value) for value in command.servo - stiffness * joints - damping * velocities]
    return message


def main(arguments: list[str] | None = None) -> int:
    """The node. Exit codes: 0 it was stopped, 1 it gave up or lost the object, 2 ROS 2 is absent."""
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
            out.publish(efforts(types["Float64MultiArray"](), command, *plant.newest(), stiffness, damping))

    plant = RosPlant(session.hand.joint_names, [finger.name for finger in session.hand.fingers], send, tick=asked.tick)
    goals = Goals()

    def tell(what: Any) -> None:
        told.publish(types["String"](data=json.dumps(what)))

    def listen(happening: Event | GoalResult) -> None:
        goals.on_happening(happening)
        tell({"event" if isinstance(happening, Event) else "goal": asdict(happening)})

    node.create_subscription(types["JointState"], "joint_states", plant.on_joint_states, 1)
    node.create_subscription(types["PoseStamped"], "object_pose", plant.on_object_pose, 1)
    node.create_subscription(types["PoseStamped"], "goal", goals.on_goal, 10)
    _serve_action(node, goals, plant)
    # An action waits for its goal; messages come meanwhile.
    spinning: Any = import_module("rclpy.executors").MultiThreadedExecutor()
    spinning.add_node(node)
    listener = threading.Thread(target=spinning.spin, daemon=True)
    listener.start()
    executor = Executor.of(sessions, plant, planning=ThreadPlanning, stiffness=stiffness, damping=damping, listener=listen)
    try:
        said: list[str] = []
        while missing := plant.missing():
            if missing != said:
                tell({"waiting_for": missing})
            said = missing
            time.sleep(0.05)
        log = executor.run(goals)
        tell({"status": log.status, "message": log.message})
        return 0 if log.status == "done" else 1
    except KeyboardInterrupt:
        return 0
    finally:
        goals.end(executor.log.message or "the run is over")
        rclpy.try_shutdown()
        listener.join(timeout=2.0)


def _serve_action(node: Any, goals: Goals, plant: RosPlant) -> None:
    """The action, where its type was built."""
    try:
        kind: Any = import_module("regrasp_msgs.action").ReachPose
    except ImportError:
        print("no action reach_pose: regrasp_msgs was not built (ros2/regrasp_msgs); goals come by the topic goal", file=sys.stderr)
        return
    action: Any = import_module("rclpy.action")
    group: Any = import_module("rclpy.callback_groups").ReentrantCallbackGroup()

    def execute(handle: Any) -> Any:
        return reach(goals, handle, kind.Feedback(), kind.Result(), plant)

    def cancel(_: Any) -> Any:
        return action.CancelResponse.ACCEPT

    action.ActionServer(node, kind, "reach_pose", execute_callback=execute, cancel_callback=cancel, callback_group=group)


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
