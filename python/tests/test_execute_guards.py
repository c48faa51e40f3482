"""Callers that give an executor what it cannot use: wrong names, settings, goals, observations. It says so, and the hand holds."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp

pytest.importorskip("mujoco")

from regrasp.execute import (  # noqa: E402
    Command,
    Executor,
    ExecutorSessions,
    ExecutorSettings,
    FaultyPlant,
    ForeignSettings,
    MujocoPlant,
    Observation,
    PlantSettings,
    RunLog,
    execute,
    holding_command,
    turns,
)
from regrasp.execute import settings_check  # noqa: E402
from regrasp.execute.__main__ import main  # noqa: E402
from regrasp.execute.settings import PLANNER  # noqa: E402
from regrasp.simulate.model import Settings  # noqa: E402

SCENES = Path(__file__).parents[2] / "scenes"
NAN, INF = float("nan"), float("inf")


@pytest.fixture(scope="module")
def scene() -> regrasp.Scene:
    return regrasp.load_scene(SCENES / "sphere_90x.toml")


@pytest.fixture(scope="module")
def session(scene: regrasp.Scene) -> regrasp.Session:
    return regrasp.Session(scene, settings=PLANNER)


def plant_of(scene: regrasp.Scene) -> MujocoPlant:
    return MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)


class Minimal:
    """A plant with the members of the protocol alone. It counts commands that are no finite numbers."""

    def __init__(self, inner: MujocoPlant, observe: Callable[[Observation], Any] | None = None, **members: Any) -> None:
        self.inner = inner
        self.joint_names, self.fingers, self.tick = inner.joint_names, inner.fingers, inner.tick
        self.n_commands = self.n_seen = 0
        self._change = observe
        vars(self).update(members)

    def observe(self) -> Any:
        self.n_seen += 1
        seen = self.inner.observe()
        return seen if self._change is None else self._change(seen)

    def apply(self, command: Command) -> None:
        self.n_commands += 1
        for values in (command.servo, command.positions, command.velocities):
            assert values.shape == (len(self.inner.joint_names),) and np.isfinite(values).all()
        self.inner.apply(command)


class Simulated(Minimal):
    """The same, with time that is charged for planning: its runs do not depend on the machine."""

    def __init__(self, inner: MujocoPlant, observe: Callable[[Observation], Any] | None = None, **members: Any) -> None:
        super().__init__(inner, observe, rig=inner.rig, data=inner.data, truth=inner.truth, **members)


def first(plant: MujocoPlant, count: int = 1) -> Iterator[regrasp.Pose]:
    return turns(plant.pose, count=count, seed=3, largest=0.4)


def kinds(log: RunLog) -> list[str]:
    return [event.kind for event in log.events]


def held(plant: MujocoPlant) -> bool:
    """Whether the object stays in the hand for another second with the last command."""
    import mujoco

    before, _ = plant.truth()
    mujoco.mj_step(plant.rig.model, plant.data, 500)
    after, _ = plant.truth()
    return plant.touching() >= 2 and float(np.linalg.norm(after - before)) < 0.003


# ------------------------------------------------------------------------------------------------------------------- the plant


@pytest.mark.parametrize("name", ["sphere_90x", "box_90x"])
def test_a_plant_with_the_documented_members_alone_holds_the_object_from_the_first_tick(name: str) -> None:
    scene = regrasp.load_scene(SCENES / f"{name}.toml")
    inner = plant_of(scene)
    plant = Minimal(inner)
    log = Executor.of(ExecutorSessions.of(scene), plant).run(first(inner, 2))
    assert log.status == "done" and log.n_reached == 2, (log.message, log.events)
    assert held(inner)


def test_a_hold_is_found_from_the_pose_that_is_seen_and_from_where_the_scene_has_the_object(scene: regrasp.Scene, session: regrasp.Session) -> None:
    inner = plant_of(scene)
    executor = Executor(session, Minimal(inner))
    # The first poses come late.
    assert inner.observe().pose_stamp is None
    executor._first_pose()
    assert executor._last_command is not None and inner.touching() == 4
    for _ in range(100):
        executor._wait()
    position, _ = inner.truth()
    assert np.linalg.norm(position - scene.start.position) < 0.001 and held(inner)


def test_without_a_hold_no_command_is_given(scene: regrasp.Scene, session: regrasp.Session) -> None:
    inner = plant_of(scene)

    def elsewhere(seen: Observation) -> Observation:
        return replace(seen, joints=seen.joints + 0.5)

    plant = Minimal(inner, elsewhere)
    log = Executor(session, plant, ExecutorSettings(patience=0.1)).run(first(inner))
    assert log.status == "gave_up" and plant.n_commands == 0
    assert 'no command that holds the object is known' in log.message and '"holding"' in log.message
    # Nor where a joint is missing, which used to be sent to zero.
    plant = Minimal(plant_of(scene), lambda seen: replace(seen, joints=np.where(np.arange(len(seen.joints)) == 2, NAN, seen.joints)))
    log = Executor(session, plant, ExecutorSettings(patience=0.1)).run(first(inner))
    assert log.status == "gave_up" and plant.n_commands == 0 and "not every joint was seen" in log.message


def test_the_command_that_holds_as_a_plan_begins_is_public(scene: regrasp.Scene, session: regrasp.Session) -> None:
    plan = regrasp.plan(scene, seed=1)
    assert isinstance(plan, regrasp.Plan)
    inner = MujocoPlant(plan, PlantSettings(seed=1))
    holding = holding_command(plan, tick=inner.tick)
    assert np.allclose(holding.servo, inner.data.ctrl[inner.rig.motors], atol=1e-6) and not holding.velocities.any()
    plant = Minimal(inner, holding=holding)
    executor = Executor(session, plant)
    executor._first_pose()
    assert executor._last_command is holding
    log = executor.run(first(inner))
    assert log.status == "done" and log.n_reached == 1
    for wrong in ("grip", replace(holding, servo=np.zeros(3)), replace(holding, positions=np.full(12, NAN))):
        with pytest.raises(regrasp.InputError, match="holding.*12 finite numbers"):
            Executor(session, Minimal(_once(scene), holding=wrong)).run([])
    with pytest.raises(regrasp.InputError, match="stiffness.*12 finite numbers above 0"):
        holding_command(plan, stiffness=np.ones(3))


def test_a_faulty_plant_has_the_optional_members_of_its_plant(scene: regrasp.Scene) -> None:
    inner = plant_of(scene)
    plant: Any = FaultyPlant(Minimal(inner, holding="as it was", wait=lambda: None))
    assert plant.holding == "as it was" and callable(plant.wait) and not hasattr(plant, "rig")


BAD_PLANTS: dict[str, tuple[Callable[[MujocoPlant], dict[str, Any]], str]] = {
    "reversed": (lambda plant: {"joint_names": plant.joint_names[::-1]}, "the right names in another order.*reorder what the plant observes"),
    "unknown": (lambda plant: {"joint_names": ("foo", *plant.joint_names[1:])}, 'joint_names has "foo", which is no name of the hand'),
    "twice": (lambda plant: {"joint_names": (plant.joint_names[1], *plant.joint_names[1:])}, "which is there twice"),
    "one less": (lambda plant: {"joint_names": plant.joint_names[1:]}, "joint_names has 11 names"),
    "none": (lambda plant: {"joint_names": ()}, "joint_names has 0 names"),
    "no strings": (lambda plant: {"joint_names": tuple(range(12))}, "has 0, which is no string"),
    "a string": (lambda plant: {"joint_names": "abc"}, "joint_names is 'abc'"),
    "a number": (lambda plant: {"joint_names": 3}, "joint_names is 3"),
    "fingers": (lambda plant: {"fingers": ("a", "b", "c", "d")}, 'fingers has "a".*finger.name for finger in'),
    "fingers reversed": (lambda plant: {"fingers": plant.fingers[::-1]}, "fingers has the right names in another order"),
    "no fingers": (lambda plant: {"fingers": ()}, "fingers has 0 names"),
    **{f"tick {tick}": ((lambda tick: lambda _: {"tick": tick})(tick), "tick is") for tick in (0, -0.004, NAN, INF, 5.0, "a", None, True)},
}


@pytest.mark.parametrize("case", list(BAD_PLANTS))
def test_a_plant_of_another_hand_is_refused_before_the_first_command(session: regrasp.Session, scene: regrasp.Scene, case: str) -> None:
    changes, message = BAD_PLANTS[case]
    inner = _once(scene)
    plant = Minimal(inner)
    vars(plant).update(changes(inner))
    with pytest.raises(regrasp.InputError, match=message) as raised:
        Executor(session, plant)
    assert raised.value.code == "A510" and plant.n_commands == plant.n_seen == 0


def test_names_may_be_a_list_or_an_array(session: regrasp.Session, scene: regrasp.Scene) -> None:
    inner = _once(scene)
    Executor(session, Minimal(inner, joint_names=list(inner.joint_names), fingers=np.array(inner.fingers), tick=np.float64(inner.tick)))


_PLANTS: dict[str, MujocoPlant] = {}


def _once(scene: regrasp.Scene) -> MujocoPlant:
    """A plant that is not run."""
    if scene.name not in _PLANTS:
        _PLANTS[scene.name] = plant_of(scene)
    return _PLANTS[scene.name]


@pytest.mark.parametrize(
    ("gains", "message"),
    [
        ({"stiffness": np.full(12, NAN)}, "has nan at index 0"),
        ({"stiffness": np.zeros(12)}, "has 0.0 at index 0.*above 0"),
        ({"stiffness": -np.ones(12)}, "has -1.0"),
        ({"stiffness": np.ones(2)}, "12 finite numbers"),
        ({"stiffness": 3.0}, "is 3.0"),
        ({"stiffness": "abc"}, "is 'abc'"),
        ({"stiffness": np.ones(12), "damping": np.full(12, INF)}, "damping.*has inf"),
        ({"stiffness": np.ones(12), "damping": -np.ones(12)}, "from 0"),
        ({"damping": np.ones(12)}, "without stiffness"),
        ({"control": Settings(speed=NAN)}, "speed.*is nan"),
        ({"control": {"speed": 1.0}}, "control"),
    ],
)
def test_gains_that_are_none_are_refused(session: regrasp.Session, scene: regrasp.Scene, gains: dict[str, Any], message: str) -> None:
    with pytest.raises(regrasp.InputError, match=message):
        Executor(session, _once(scene), **gains)


# ------------------------------------------------------------------------------------------------------------------ settings


def test_every_setting_has_a_rule_that_its_default_keeps() -> None:
    for kind, rules in ((ExecutorSettings, settings_check.EXECUTOR), (ForeignSettings, settings_check.FOREIGN)):
        assert {field.name for field in fields(kind)} == set(rules)
        kind()
    assert {field.name for field in fields(PlantSettings)} == {*settings_check.PLANT, "simulation"}


@pytest.mark.parametrize("name", [field.name for field in fields(ExecutorSettings)])
def test_no_setting_takes_what_is_no_number(name: str) -> None:
    wrong: list[Any] = [NAN, INF, -INF, -1, "3", None, [1.0], 1j]
    if name in ("time_limit",):
        wrong.remove(None)
    for value in wrong:
        with pytest.raises(regrasp.InputError, match=f'ExecutorSettings argument "{name}": is .*; expected ') as raised:
            ExecutorSettings(**{name: value})
        assert raised.value.code == "A510"


@pytest.mark.parametrize(
    "wrong",
    [
        {"threads": 0}, {"threads": 1.5}, {"choices": 0}, {"plan_attempts": 0}, {"attempts": 0}, {"attempts": True}, {"grip": "hard"},
        {"feedback": 1}, {"feedback": "no"}, {"blend_time": 0}, {"jump_count": 0}, {"work_rate": 0}, {"pose_time_constant": 0.0},
        {"patience": 0}, {"patience": 1e300}, {"time_limit": 0.0}, {"again_speed": 0.0}, {"again_share": 1.5}, {"last_reach": 0.5},
        {"deviation_distance": 0.0}, {"seed": 2**64}, {"seed": 1.0}, {"reflex_release": 0.0},
    ],
)  # fmt: skip
def test_settings_out_of_range_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(regrasp.InputError, match=f'"{next(iter(wrong))}"'):
        ExecutorSettings(**wrong)


def test_settings_that_make_sense_are_taken() -> None:
    settings = ExecutorSettings(
        seed=np.int64(3), patience=np.float64(1.0), rest_time=0, largest_offset=0.0, back_off_time=0.0, time_limit=2, most_detours=0, max_work=0
    )
    # Logs hold plain numbers.
    assert json.loads(json.dumps([settings.seed, settings.patience])) == [3, 1.0] and type(settings.seed) is int
    assert replace(settings, seed=4).seed == 4


@pytest.mark.parametrize(
    "wrong",
    [
        {"seed": -1}, {"seed": "a"}, {"pose_rate": 0.0}, {"pose_rate": NAN}, {"pose_delay": -0.1}, {"pose_noise": NAN}, {"joint_noise": INF},
        {"push": -1.0}, {"push_every": 0.0}, {"feels_forces": 1}, {"simulation": None}, {"simulation": Settings(tick=NAN)},
        {"simulation": Settings(friction_scale=-1.0)}, {"simulation": Settings(mass_scale=INF)}, {"simulation": Settings(speed=0.0)},
    ],
)  # fmt: skip
def test_settings_of_plants_are_looked_at(wrong: dict[str, Any]) -> None:
    with pytest.raises(regrasp.InputError, match="PlantSettings argument"):
        PlantSettings(**wrong)


def test_settings_of_foreign_plants_are_looked_at() -> None:
    for wrong in ({"tick": NAN}, {"friction": -1.0}, {"impratio": 0.0}, {"grip_time": -1.0}, {"carries_hand": 0}):
        with pytest.raises(regrasp.InputError, match="ForeignSettings argument"):
            ForeignSettings(**wrong)


# -------------------------------------------------------------------------------------------------------------- observations


@pytest.mark.parametrize("how", ["as it was", "back", "nan"])
def test_a_clock_that_stands_still_ends_the_run(scene: regrasp.Scene, session: regrasp.Session, how: str) -> None:
    inner = plant_of(scene)
    kept: list[float] = []

    def still(seen: Observation) -> Observation:
        if seen.time < 0.5:
            return seen
        kept.append(seen.time)
        return replace(seen, time={"as it was": kept[0], "back": kept[0] - 0.1, "nan": NAN}[how])

    plant = Simulated(inner, still)
    executor = Executor(session, plant, ExecutorSettings(patience=0.4))
    log = executor.run(first(inner, 2))
    assert log.status == "gave_up" and "clock stands still" in log.message and kinds(log)[-1] == "gave_up"
    # So many observations as fit in ``patience``, whatever else they show.
    assert len(kept) == pytest.approx(0.4 / inner.tick, abs=2)
    assert held(inner)


def test_a_clock_that_stands_still_before_the_first_leg_ends_the_run(scene: regrasp.Scene, session: regrasp.Session) -> None:
    inner = plant_of(scene)
    plant = Simulated(inner, lambda seen: replace(seen, time=7.0, pose_stamp=None))
    log = Executor(session, plant, ExecutorSettings(patience=0.2)).run(first(inner))
    assert log.status == "gave_up" and "clock stands still at 7 s" in log.message and held(inner)


def test_a_clock_may_begin_before_zero(scene: regrasp.Scene, session: regrasp.Session) -> None:
    inner = plant_of(scene)

    def early(seen: Observation) -> Observation:
        return replace(seen, time=seen.time - 50.0, pose_stamp=None if seen.pose_stamp is None else seen.pose_stamp - 50.0)

    log = Executor(session, Simulated(inner, early)).run(first(inner))
    assert log.status == "done" and log.n_reached == 1 and log.events == []


def _pose(**changes: Any) -> Callable[[Observation], Observation]:
    return lambda seen: replace(seen, **changes) if seen.pose_stamp is not None else seen


BAD_OBSERVATIONS: dict[str, tuple[Callable[[Observation], Any], str, str]] = {
    "quaternion of three": (_pose(object_quat_wxyz=np.array([1.0, 0.0, 0.0])), "bad_pose", r"\(3,\)"),
    "position of two": (_pose(object_position=np.zeros(2)), "bad_pose", r"shape \(2,\)"),
    "position of text": (_pose(object_position="here"), "bad_pose", "no number"),
    "position of objects": (_pose(object_position=[{}, {}, {}]), "bad_pose", "no number"),
    "far position": (_pose(object_position=np.full(3, 1e300)), "bad_pose", "beyond 1e"),
    "complex position": (_pose(object_position=np.zeros(3) + 1j), "bad_pose", "no number"),
    "long quaternion": (_pose(object_quat_wxyz=np.full(4, 1e200)), "bad_pose", "beyond 1e"),
    "far joint": (lambda seen: replace(seen, joints=np.where(np.arange(12) == 2, 1e300, seen.joints)), "joints_missing", r"\[2\]"),
    "joints in a table": (lambda seen: replace(seen, joints=seen.joints[:, None]), "joints_missing", r"\(12, 1\)"),
    "no joints": (lambda seen: replace(seen, joints=None), "joints_missing", "expected 12"),
    "joints of text": (lambda seen: replace(seen, joints="abc"), "joints_missing", "expected 12"),
    "two forces": (lambda seen: replace(seen, tip_forces=seen.tip_forces[:2]), "bad_forces", r"shape \(2,\).*expected 4"),
    "forces of text": (lambda seen: replace(seen, tip_forces="much"), "bad_forces", "no numbers"),
    "time of text": (lambda seen: replace(seen, time="now"), "bad_stamp", "'now'"),
    "time beyond all": (lambda seen: replace(seen, time=1e300), "bad_stamp", "1e.300"),
    "stamp of text": (_pose(pose_stamp="now"), "bad_stamp", "a pose is of nan s"),
}


@pytest.mark.parametrize("case", list(BAD_OBSERVATIONS))
def test_observations_of_a_wrong_shape_or_size_are_left_out(
    scene: regrasp.Scene, session: regrasp.Session, case: str, tmp_path: Path
) -> None:
    change, kind, message = BAD_OBSERVATIONS[case]
    inner = plant_of(scene)
    plant = Simulated(inner, lambda seen: change(seen) if 0.4 <= seen.time < 0.5 else seen)
    log = Executor(session, plant).run(first(inner))
    assert log.status == "done" and log.n_reached == 1, log.message
    assert set(kinds(log)) == {kind}
    import re

    assert re.search(message, log.events[0].message), log.events[0].message
    log.save(tmp_path / "run.json")
    assert RunLog.load(tmp_path / "run.json").to_json() == log.to_json()


def test_observations_may_be_lists(scene: regrasp.Scene, session: regrasp.Session) -> None:
    def listed(seen: Observation) -> Observation:
        changes = {name: getattr(seen, name) for name in ("joints", "object_position", "object_quat_wxyz", "tip_forces")}
        return replace(seen, **{name: None if value is None else value.tolist() for name, value in changes.items()})

    logs: list[Any] = []
    for change in (None, listed):
        inner = plant_of(scene)
        log = Executor(session, Simulated(inner, change)).run(first(inner)).to_json()
        logs.append([log["samples"], log["events"], log["goals"]])
    assert logs[0] == logs[1]


@pytest.mark.parametrize("wrong", [None, (1.0, 2.0), "seen"])
def test_what_is_no_observation_is_named(scene: regrasp.Scene, session: regrasp.Session, wrong: Any) -> None:
    inner = plant_of(scene)
    plant = Simulated(inner, lambda seen: wrong if seen.time > 0.4 else seen)
    executor = Executor(session, plant)
    with pytest.raises(regrasp.InputError, match="Simulated.observe.*expected an object of the class regrasp.execute.Observation"):
        executor.run(first(inner))
    assert executor.log.status == "interrupted" and "Observation" in executor.log.message and held(inner)


# --------------------------------------------------------------------------------------------------------------------- goals


BAD_GOALS: dict[str, tuple[Any, str]] = {
    "nan": (regrasp.Pose(np.array([NAN, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])), "goal 2 is Pose"),
    "no turn": (regrasp.Pose(np.zeros(3), np.zeros(4)), "goal 2 has a quaternion of length 0"),
    "far": (regrasp.Pose(np.array([1e300, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])), "no number beyond 1e"),
    "short": (regrasp.Pose(np.zeros(2), np.array([0.0, 0.0, 0.0, 1.0])), "goal 2 is Pose"),
    "number": (3, "goal 2 is 3; expected a regrasp.Pose"),
    "matrix": (np.eye(4), "goal 2 is array"),
    "raises": (None, "the goals died"),
}


@pytest.mark.parametrize("case", list(BAD_GOALS))
def test_the_goal_before_a_bad_one_is_finished(scene: regrasp.Scene, session: regrasp.Session, case: str) -> None:
    bad, message = BAD_GOALS[case]

    def goals(plant: MujocoPlant) -> Iterator[Any]:
        yield from first(plant)
        if bad is None:
            raise ValueError("the goals died")
        yield bad

    inner = plant_of(scene)
    executor = Executor(session, inner)
    with pytest.raises(ValueError, match=message):
        executor.run(goals(inner))
    log = executor.log
    assert [goal.reached for goal in log.goals] == [True] and log.status == "interrupted" and message.split("; ")[0] in log.message
    assert kinds(log) == ["interrupted"] and held(inner)


@pytest.mark.parametrize("wrong", [5, "goals", regrasp.Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))])
def test_goals_that_are_no_goals_are_refused(scene: regrasp.Scene, session: regrasp.Session, wrong: Any) -> None:
    with pytest.raises(regrasp.InputError, match=r'argument "goals".*\[pose\] for a single goal'):
        Executor(session, _once(scene)).run(wrong)


def test_poses_may_be_made_of_tuples(scene: regrasp.Scene, session: regrasp.Session) -> None:
    pose = regrasp.Pose((0.0, 0, 0.1), [0, 0, 0, 1])  # type: ignore[arg-type]
    assert repr(pose) == "Pose(position=[0.0, 0.0, 0.1], quat_xyzw=[0.0, 0.0, 0.0, 1.0])"
    assert pose.matrix.shape == (4, 4)
    with pytest.raises(regrasp.InputError, match='Pose argument "position": is .here.'):
        regrasp.Pose("here", (0, 0, 0, 1))  # type: ignore[arg-type]
    inner = plant_of(scene)
    goal = next(first(inner))
    log = Executor(session, inner).run([regrasp.Pose(tuple(goal.position), tuple(goal.quat_xyzw))])  # type: ignore[arg-type]
    assert log.n_reached == 1


# ------------------------------------------------------------------------------------------------------------ runs that end


class Died(RuntimeError):
    """The plant did."""


@pytest.mark.parametrize("who", ["observe", "apply", "listener"])
def test_a_run_that_something_ends_says_what(scene: regrasp.Scene, session: regrasp.Session, who: str, tmp_path: Path) -> None:
    inner = plant_of(scene)
    counted = [0]

    def die(*_: Any) -> Any:
        counted[0] += 1
        if who == "listener" or counted[0] > 200:
            raise Died("no power")
        return _[0] if _ else None

    plant = Simulated(inner, die if who == "observe" else None)
    if who == "apply":
        apply = plant.apply
        vars(plant)["apply"] = lambda command: (die(), apply(command))
    executor = Executor(session, plant, planning=None, listener=die if who == "listener" else None)
    before = set(threading.enumerate())
    with pytest.raises(Died, match="no power"):
        executor.run(first(inner, 2))
    log = executor.log
    assert log.status == "interrupted" and log.message == "Died: no power" and kinds(log)[-1] == "interrupted"
    assert set(threading.enumerate()) <= before and held(inner)
    log.save(tmp_path / "run.json")
    log.page(tmp_path / "run.html")
    assert RunLog.load(tmp_path / "run.json").message == "Died: no power"


def test_the_goal_that_a_run_ends_at_is_in_its_log(scene: regrasp.Scene, session: regrasp.Session, tmp_path: Path) -> None:
    inner = plant_of(scene)

    def interrupt(seen: Observation) -> Observation:
        if seen.time > 3.0:
            raise KeyboardInterrupt
        return seen

    executor = Executor(session, Simulated(inner, interrupt))
    with pytest.raises(KeyboardInterrupt):
        executor.run(turns(inner.pose, count=9, seed=3))
    log = executor.log
    assert log.status == "interrupted" and log.message == "the caller asked to stop"
    last = log.goals[-1]
    assert not last.reached and last.why_not == "not finished: the caller asked to stop" and not last.is_finished
    assert all(goal.is_finished for goal in log.goals[:-1]) and log.legs[-1].goal == log.events[-1].goal == len(log.goals) - 1
    assert last.legs == sum(leg.goal == len(log.goals) - 1 for leg in log.legs)
    assert last.time - last.start_time >= last.motion_time > 0.0
    log.save(tmp_path / "run.json")
    log.page(tmp_path / "run.html")
    assert "not finished" in (tmp_path / "run.html").read_text()
    # A second run goes on, with goals of its own.
    vars(executor._plant)["_change"] = None
    executor.run(first(inner))
    assert log.status == "done" and log.message == "" and log.goals[-1].reached and log.legs[-1].goal == len(log.goals) - 1


def test_a_lost_object_leaves_the_goal_in_the_log(scene: regrasp.Scene) -> None:
    inner = plant_of(scene)
    at = inner.rig.object_qpos
    gone: list[bool] = []

    def taken(seen: Observation) -> Observation:
        if not gone and seen.time > 0.8:
            inner.data.qpos[at] += 0.3
            gone.append(True)
        return seen

    log = execute(FaultyPlant(inner, observe=taken), turns(inner.pose, count=6, seed=4))
    assert log.status == "lost" and log.goals[-1].why_not == f"not finished: {log.message}" and not log.goals[-1].is_finished


# -------------------------------------------------------------------------------------------------------------- command line


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--goals", "0"], "whole number from 1"),
        (["--goals", "-1"], "whole number from 1"),
        (["--goals", "a"], "whole number from 1"),
        (["--seed", "-1"], "whole number from 0"),
        (["--largest", "nan"], "finite number above 0"),
        (["--largest", "0"], "finite number above 0"),
        (["--friction-scale", "0"], "finite number above 0"),
        (["--mass-scale", "inf"], "finite number above 0"),
        (["--push", "-1"], "finite number from 0"),
        (["--package", "models"], "expected NAME=DIR"),
        (["-o", "nowhere/run.json"], "the folder nowhere does not exist"),
        (["--page", "."], "is a folder"),
    ],
)
def test_arguments_of_the_command_line_are_looked_at(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main([str(SCENES / "sphere_90x.toml"), *arguments])
    assert ended.value.code == 2 and message in capsys.readouterr().err


def test_the_command_line_says_what_became_of_each_goal(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    scene, log = SCENES / "sphere_90x.toml", tmp_path / "run.json"
    assert main([str(scene), "--goals", "2", "--largest", "20", "-o", str(log)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("goal 1 of 2: ") and lines[1].endswith("reached") and lines[2].startswith("DONE  2 of 2 goals reached")
    assert RunLog.load(log).status == "done"


def test_ctrl_c_on_the_command_line_leaves_a_log_and_a_page(tmp_path: Path) -> None:
    if os.name != "posix":
        pytest.skip("signals of other systems")
    command = [sys.executable, "-m", "regrasp.execute", str(SCENES / "sphere_90x.toml"), "--goals", "500", "-o", "run.json", "--page", "run.html"]
    # A process that runs in the background may have been told to ignore Ctrl-C.
    running = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert running.stdout is not None
    # The run is on its way.
    assert running.stdout.readline().startswith("goal 1 of 500")
    running.send_signal(signal.SIGINT)
    _, errors = running.communicate(timeout=60)
    assert running.returncode == 130 and errors == ""
    log = RunLog.load(tmp_path / "run.json")
    assert log.status == "interrupted" and log.n_reached >= 1 and kinds(log)[-1] == "interrupted"
    assert "interrupted" in (tmp_path / "run.html").read_text()
