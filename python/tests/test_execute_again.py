"""What the executor does where a leg went wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp

pytest.importorskip("mujoco")

from regrasp.execute import Executor, ExecutorSessions, ExecutorSettings, MujocoPlant, PlantSettings, turns  # noqa: E402
from regrasp.execute.estimate import PoseFilter  # noqa: E402
from regrasp.execute.goals import between, towards  # noqa: E402
from regrasp.execute.monitor import Monitor, Trigger  # noqa: E402
from regrasp.execute.planning import ChargedPlanning, Ticket  # noqa: E402
from regrasp.execute.settings import NEAR, PLANNER, careful_settings  # noqa: E402
from regrasp.simulate.reference import quat_exp, quat_product  # noqa: E402

SCENES = Path(__file__).parents[2] / "scenes"


def angle_between(a: Any, b: Any) -> float:
    return 2.0 * float(np.arccos(min(1.0, abs(float(np.dot(a, b))))))


def test_between_goes_its_share_of_the_way() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        quats = rng.normal(size=(2, 4))
        quats /= np.linalg.norm(quats, axis=1)[:, None]
        start, goal = (regrasp.Pose(rng.normal(size=3), quat) for quat in quats)
        whole = angle_between(start.quat_xyzw, goal.quat_xyzw)
        for share in (0.0, 0.3, 1.0):
            found = between(start, goal, share)
            assert np.linalg.norm(found.quat_xyzw) == pytest.approx(1.0)
            assert angle_between(start.quat_xyzw, found.quat_xyzw) == pytest.approx(share * whole, abs=1e-6)
            assert angle_between(found.quat_xyzw, goal.quat_xyzw) == pytest.approx((1.0 - share) * whole, abs=1e-6)
            assert np.allclose(found.position, start.position + share * (goal.position - start.position))


def test_a_late_image_moves_all_poses_since() -> None:
    rng = np.random.default_rng(5)
    pose_filter = PoseFilter(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), 0.0, 0.2)
    poses: list[tuple[float, Any, Any]] = []
    for tick in range(300):
        pose_filter.predict(0.004 * tick, *(1e-3 * rng.normal(size=(2, 3))))
        poses.append((0.004 * tick, pose_filter.position, pose_filter.quat))
    shift, turn = 1e-2 * rng.normal(size=(2, 3))
    pose_filter.restart(shift, turn, 1.0)
    for time, position, quat in poses[60::24]:
        moved = quat_product(quat_exp(turn), quat)
        off, angle = pose_filter.innovation(position + shift, moved, time)
        assert np.abs(off).max() < 1e-15 and np.abs(angle).max() < 1e-14
        assert np.linalg.norm(pose_filter.innovation(position, quat, time)[0]) == pytest.approx(np.linalg.norm(shift))


class Told(ChargedPlanning):
    """Remembers what it was asked."""

    tickets: list[Ticket] = []

    def ask(self, *args: Any, **more: Any) -> Ticket:
        ticket = super().ask(*args, **more)
        Told.tickets.append(ticket)
        return ticket


@pytest.mark.parametrize(("name", "share", "speed"), [("sphere_90x", 0.5, 0.3), ("box_90x", 1.0, 1.0)])
def test_legs_after_a_miss_aim_nearer_run_slower_and_press_less_on_round_objects(name: str, share: float, speed: float) -> None:
    scene = regrasp.load_scene(SCENES / f"{name}.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    goal = next(turns(plant.pose, count=1, seed=3, largest=0.3))
    Told.tickets = []
    # No leg ever comes so near.
    settings = ExecutorSettings(attempts=3, reached_turn=1e-9)
    careful = [regrasp.Session(scene, settings=kind) for kind in careful_settings(scene.objects[0])]
    executor = Executor(regrasp.Session(scene, settings=PLANNER), plant, settings, planning=Told, careful=careful)
    log = executor.run([goal])
    assert [event.kind for event in log.events if event.kind == "missed"] == ["missed"] * 3
    assert len(Told.tickets) == len(log.plans) == 3
    for attempt, (ticket, leg, plan) in enumerate(zip(Told.tickets, log.legs, log.plans)):
        asked, left = (angle_between(ticket.start.world_from_object.quat_xyzw, pose.quat_xyzw) for pose in (ticket.goal, goal))
        assert asked == pytest.approx((share if attempt else 1.0) * left, abs=1e-6)
        is_slow = attempt > 0 and plan.statistics["relocations"] == 0
        is_careful = attempt == 0 or speed == 1.0
        assert plan.promises["friction_margin"] == (2.0 if is_careful else 1.5)
        assert leg.duration == pytest.approx(plan.duration / (speed if is_slow else 1.0), abs=3 * plant.tick)
    assert any(plan.statistics["relocations"] == 0 for plan in log.plans[1:]), "no leg shows the speed"


class Strict:
    """A session that has no start within less than this."""

    def __init__(self, session: regrasp.Session, least: float) -> None:
        self._session, self._least = session, least
        self.asked: list[tuple[float, float]] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._session, name)

    def project(self, *args: Any, distance: float = 0.001, turn: float = 0.02, **more: Any) -> Any:
        self.asked.append((distance, turn))
        answer = self._session.project(*args, distance=distance, turn=turn, **more)
        if distance >= self._least:
            return answer
        elsewhere = regrasp.Pose(np.array([0.0, 0.0, 9.0]), np.array([0.0, 0.0, 0.0, 1.0]))
        return self._session.project(elsewhere, *args[1:], distance=distance, turn=turn, **more)


def test_sessions_for_near_starts_are_asked_last_and_for_no_plans() -> None:
    scene = regrasp.load_scene(SCENES / "sphere_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    # The usual session refuses every start, so all are those of the other.
    strict: Any = Strict(regrasp.Session(scene, settings=PLANNER), 1.0)
    near: Any = Strict(regrasp.Session(scene, settings=NEAR), 0.0)
    asked_for_plans: list[Any] = []

    def planning(sessions: Any, *rest: Any) -> ChargedPlanning:
        asked_for_plans.extend(sessions)
        return ChargedPlanning(sessions, *rest)

    executor = Executor(strict, plant, ExecutorSettings(anytime=False), planning=planning, near=[near])
    assert asked_for_plans == [strict]
    log = executor.run(turns(plant.pose, count=2, seed=3))
    assert log.status == "done" and log.n_reached == 2, log.message
    assert len(strict.asked) == len(near.asked) >= 2
    assert all(plan.settings["clearance"] == 0.0002 for plan in log.plans)


@pytest.mark.parametrize(("least", "status"), [(0.0035, "done"), (0.007, "done"), (0.0085, "gave_up")])
def test_a_start_farther_off_is_good_enough_before_the_hand_gives_up(least: float, status: str) -> None:
    scene = regrasp.load_scene(SCENES / "sphere_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    strict: Any = Strict(regrasp.Session(scene, settings=PLANNER), least)
    settings = ExecutorSettings(anytime=False, most_retreats=0)
    log = Executor(strict, plant, settings).run(turns(plant.pose, count=1, seed=3))
    assert log.status == status, log.message
    # The usual limits are asked again and again, for as long as the hand is patient; then angles grow first.
    growing = [(0.002, 0.04), (0.002, 0.08), (0.004, 0.08), (0.002, 0.16), (0.008, 0.16)]
    assert settings.project_distance == 0.002 and settings.project_turn == 0.04
    first = [growing.index(asked) for asked in dict.fromkeys(strict.asked)]
    assert first == list(range(3 if least < 0.004 else 5)), strict.asked
    assert strict.asked.count(growing[0]) > 3 and all(strict.asked.count(asked) == 1 for asked in growing[3:] if asked in strict.asked)
    events = [event for event in log.events if event.kind == "no_start"]
    assert len(events) == 1
    assert plant.touching() >= 2


@pytest.mark.parametrize(("name", "regrips"), [("sphere_90x", True), ("sphere_90x", False), ("box_90x", True)])
def test_where_a_leg_went_wrong_a_round_object_is_taken_hold_of_anew(
    name: str, regrips: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = regrasp.load_scene(SCENES / f"{name}.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    goal = next(turns(plant.pose, count=1, seed=3, largest=0.5))
    Told.tickets = []
    careful = regrasp.Session(scene, settings=careful_settings(scene.objects[0])[1])
    settings = ExecutorSettings(regrips_round=regrips, anytime=False)
    executor = Executor(regrasp.Session(scene, settings=PLANNER), plant, settings, planning=Told, careful=[careful])
    look = Monitor.look

    def slips_once(own: Monitor, k: int, senses: Any, targets: Any) -> Trigger | None:
        found = look(own, k, senses, targets)
        return Trigger("slip", "said by the test") if len(executor.log.legs) == 1 and k >= 40 else found

    monkeypatch.setattr(Monitor, "look", slips_once)
    log = executor.run([goal])
    assert log.n_reached == 1 and log.events[0].message == "said by the test"
    second = Told.tickets[1]
    away = angle_between(second.start.world_from_object.quat_xyzw, second.goal.quat_xyzw)
    if name == "sphere_90x" and regrips:
        assert 0.0 < away < 0.01 and isinstance(second.answer, regrasp.Plan)
        # A grasp that holds well is kept.
        assert (log.plans[1] is second.answer) == (second.answer.statistics["relocations"] > 0)
        assert Told.tickets[2].goal is goal
    else:
        assert second.goal is goal


def test_where_a_grasp_is_weak_it_is_changed_while_the_object_hardly_moves() -> None:
    scene = regrasp.load_scene(SCENES / "sphere_90x.toml")
    plan = regrasp.plan(scene, seed=3)
    assert isinstance(plan, regrasp.Plan)
    session = regrasp.Session(scene, settings=careful_settings(scene.objects[0])[1])
    goal = regrasp.Pose(plan.object_positions[-1], plan.object_quat_xyzw[-1])
    found: set[bool] = set()
    for index in range(0, len(plan.joints), 4):
        start = session.project(regrasp.Pose(plan.object_positions[index], plan.object_quat_xyzw[index]), plan.joints[index])
        if not isinstance(start, regrasp.Start):
            continue
        as_it_is = session.plan(start, start.world_from_object, seed=5)
        anew = session.plan(start, towards(start.world_from_object, goal, 0.002), seed=5)
        assert isinstance(as_it_is, regrasp.Plan) and isinstance(anew, regrasp.Plan)
        is_weak = as_it_is.promises["kept_margin"] < 0.02
        assert (anew.statistics["relocations"] > 0) == is_weak
        found.add(is_weak)
        if is_weak:
            end = regrasp.Pose(anew.object_positions[-1], anew.object_quat_xyzw[-1])
            ended = session.project(end, anew.joints[-1])
            assert isinstance(ended, regrasp.Start)
            held = session.plan(ended, ended.world_from_object, seed=5)
            assert isinstance(held, regrasp.Plan) and held.promises["kept_margin"] > 0.019
    assert found == {True, False}


class Barren:
    """A session that has no start, or no plan, while ``is_barren``."""

    def __init__(self, session: regrasp.Session, of: str) -> None:
        self._session, self._of, self.is_barren = session, of, False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._session, name)

    def project(self, *args: Any, **more: Any) -> Any:
        far = regrasp.Pose(np.array([0.0, 0.0, 9.0]), np.array([0.0, 0.0, 0.0, 1.0]))
        rest = (far, *args[1:]) if self.is_barren and self._of == "start" else args
        return self._session.project(*rest, **more)

    def plan(self, start: regrasp.Start, goal: regrasp.Pose, **more: Any) -> Any:
        # From the hand's own base: no search finds that.
        buried = regrasp.Pose(np.zeros(3), goal.quat_xyzw)
        return self._session.plan(start, buried if self.is_barren and self._of == "plan" else goal, **more)


@pytest.mark.parametrize("of", ["start", "plan"])
def test_a_leg_goes_on_where_nothing_else_is_left_and_the_object_is_on_its_way(of: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    goal = next(turns(plant.pose, count=1, seed=3, largest=0.5))
    barren: Any = Barren(regrasp.Session(scene, settings=PLANNER), of)
    executor = Executor(barren, plant, ExecutorSettings(anytime=False, patience=0.5, least_progress=0.05))
    look = Monitor.look
    slips: list[int] = []

    def slips_thrice(own: Monitor, k: int, senses: Any, targets: Any) -> Trigger | None:
        found = look(own, k, senses, targets)
        if len(slips) < 3 and k >= 15 * (1 + len(slips)):
            slips.append(k)
            # From the first slip on there is nothing.
            barren.is_barren = True
            return Trigger("slip", "said by the test")
        return found

    monkeypatch.setattr(Monitor, "look", slips_thrice)
    monkeypatch.setattr(Monitor, "is_sudden", property(lambda _: False))
    monkeypatch.setattr(Executor, "_comes_back", lambda *_: False)
    log = executor.run([goal])
    # One plan, stopped three times, led all the way there.
    assert len(slips) == 3 and len(log.plans) == 1 and log.n_reached == 1, log.message
    resumed = [event.kind for event in log.events if event.answer == "resume"]
    assert resumed == [f"no_{of}"] * 3


@pytest.mark.parametrize(("least_progress", "n_resumed"), [(0.0, 2), (0.5, 1)])
def test_a_leg_that_went_on_often_enough_or_gets_nowhere_does_not_go_on_again(
    least_progress: float, n_resumed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    goal = next(turns(plant.pose, count=1, seed=3, largest=0.5))
    barren: Any = Barren(regrasp.Session(scene, settings=PLANNER), "start")
    executor = Executor(barren, plant, ExecutorSettings(anytime=False, patience=0.3, most_resumes=2, most_retreats=0, least_progress=least_progress))

    def always_slips(own: Monitor, k: int, senses: Any, targets: Any) -> Trigger | None:
        barren.is_barren = True
        return Trigger("slip", "said by the test")

    monkeypatch.setattr(Monitor, "look", always_slips)
    monkeypatch.setattr(Executor, "_comes_back", lambda *_: False)
    log = executor.run([goal])
    assert log.status == "gave_up" and len([event for event in log.events if event.answer == "resume"]) == n_resumed
    assert plant.touching() >= 2


@pytest.mark.parametrize("helps", [True, False])
def test_without_a_start_the_hand_goes_back_to_where_the_finger_had_lifted(
    helps: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    wanted = regrasp.plan(scene, seed=1)
    assert isinstance(wanted, regrasp.Plan)
    barren: Any = Barren(regrasp.Session(scene, settings=PLANNER), "start")
    ticks: list[int] = []

    def listen(event: Any) -> None:
        if getattr(event, "answer", "") == "back":
            ticks.append(executor._k)
            barren.is_barren = not helps

    executor = Executor(barren, plant, ExecutorSettings(anytime=False, patience=0.3), listener=listen)
    look = Monitor.look
    stopped: list[int] = []

    def slips_in_the_air(own: Monitor, k: int, senses: Any, targets: Any) -> Trigger | None:
        leg = executor._leg
        assert leg is not None
        if not stopped and k > 60 and not leg.ref.holds[k - 60 : k + 1].all(axis=1).any():
            stopped.append(k)
            barren.is_barren = True
            return Trigger("slip", "said by the test")
        return look(own, k, senses, targets)

    monkeypatch.setattr(Monitor, "look", slips_in_the_air)
    monkeypatch.setattr(Monitor, "is_sudden", property(lambda _: False))
    monkeypatch.setattr(Executor, "_may_go_on", lambda _: False)
    monkeypatch.setattr(Executor, "_comes_back", lambda *_: False)
    log = executor.run([wanted.goal])
    leg = executor._leg
    assert len(stopped) == 1 and leg is not None and plant.touching() >= 2
    if helps:
        assert [(event.kind, event.answer) for event in log.events] == [("slip", "replan"), ("no_start", "hold"), ("no_start", "back")]
        assert log.n_reached == 1 and len(log.plans) == 2
        log.page(tmp_path / "run.html")
        assert "go back" in (tmp_path / "run.html").read_text()
        return
    assert log.status == "gave_up" and 1 <= len(ticks) <= ExecutorSettings.most_retreats
    for begun, ended in zip(ticks, [*ticks[1:], executor._k]):
        # A finger holds again that did not, and no fewer hold than did.
        assert ended < begun and (leg.ref.holds[ended] & ~leg.ref.holds[begun]).any()
        assert leg.ref.holds[ended].sum() >= leg.ref.holds[begun].sum()


@pytest.mark.parametrize(
    ("phases", "back_to"),
    [
        # Tick at which each phase begins, and fingers that hold from then on.
        ([(0, "1111"), (50, "0111")], 49),
        # Another finger has taken over: that happens within some hundredths of a second.
        ([(0, "1011"), (50, "0011"), (65, "0111")], 49),
        ([(0, "1011"), (50, "1111"), (65, "0111")], 64),
        # Here it took longer, so the step before is another one.
        ([(0, "1011"), (50, "0011"), (80, "0111")], None),
        # No finger has lifted: one has landed, or nothing happened. The leg began with a start.
        ([(0, "0111"), (50, "1111")], 0),
        ([(0, "0111")], 0),
    ],
)
def test_going_back_ends_before_the_finger_lifted_or_where_the_leg_began(phases: list[tuple[int, str]], back_to: int | None) -> None:
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    executor = Executor(regrasp.Session(scene, settings=PLANNER), plant)
    wanted = regrasp.plan(scene, seed=1)
    assert isinstance(wanted, regrasp.Plan)
    executor.run([wanted.goal])
    leg, last = executor._leg, executor._k
    assert leg is not None and last > 200
    for first, holds in phases:
        leg.ref.holds[first:] = [finger == "1" for finger in holds]
    executor._stopped = Monitor(leg, ExecutorSettings(), executor._senses.joints)
    assert executor._retreat("said by the test") == (back_to is not None)
    assert executor._k == (last if back_to is None else back_to)
    # What went wrong is not gone on with.
    assert (executor._stopped is None) == (back_to is not None)
    # There is nothing before the beginning.
    if back_to == 0:
        assert not executor._retreat("said by the test") and executor._k == 0
    assert plant.touching() >= 2


def test_where_no_plan_is_found_the_hand_takes_hold_anew() -> None:
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=2)
    goal = next(turns(plant.pose, count=1, seed=3, largest=0.5))
    barren: Any = Barren(regrasp.Session(scene, settings=PLANNER), "plan")
    barren.is_barren = True
    Told.tickets = []
    anew = regrasp.Session(scene, settings={**PLANNER, "end_margin": 0.05})
    executor = Executor(barren, plant, ExecutorSettings(anytime=False, most_detours=1), planning=Told, anew=[anew])
    log = executor.run([goal])
    assert log.status == "done" and log.n_reached == 0
    asked = [angle_between(ticket.start.world_from_object.quat_xyzw, ticket.goal.quat_xyzw) for ticket in Told.tickets]
    assert len(asked) == 3 and asked[1] < 0.01 < min(asked[0], asked[2]), asked
    # The box is held better after it.
    (leg,) = log.plans
    assert leg is Told.tickets[1].answer and leg.statistics["relocations"] > 0


class Guarded(Barren):
    """A session that has no plan to ``goal``, unless it begins at ``way``."""

    def __init__(self, session: regrasp.Session, goal: regrasp.Pose, way: regrasp.Pose) -> None:
        super().__init__(session, "plan")
        self._goal, self._way = goal, way

    def plan(self, start: regrasp.Start, goal: regrasp.Pose, **more: Any) -> Any:
        is_there = angle_between(start.world_from_object.quat_xyzw, self._way.quat_xyzw) < 0.1
        self.is_barren = angle_between(goal.quat_xyzw, self._goal.quat_xyzw) < 0.1 and not is_there
        return super().plan(start, goal, **more)


@pytest.mark.parametrize(("way", "most_detours"), [("home", 2), ("first goal", 3), ("first goal", 2)])
def test_where_no_plan_is_found_the_hand_goes_back_to_where_one_may_be(way: str, most_detours: int) -> None:
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    home = plant.pose
    turned = [
        regrasp.Pose(home.position, quat_product(quat_exp(np.array([angle, 0.0, 0.0])), np.array(home.quat_xyzw)[[3, 0, 1, 2]])[[1, 2, 3, 0]])
        for angle in (0.3, 0.6, 0.9)
    ]
    ways = {"home": home, "first goal": turned[0]}
    guarded: Any = Guarded(regrasp.Session(scene, settings=PLANNER), turned[2], ways[way])
    Told.tickets = []
    settings = ExecutorSettings(anytime=False, plan_attempts=1, choices=1, most_detours=most_detours)
    log = Executor(guarded, plant, settings, planning=Told).run(turned)
    # The first detour would be a new grasp, for which there is no session here; then it goes home, then to the first goal.
    expected = [*turned, turned[2], home, turned[2], turned[0], turned[2]][: 4 + 2 * (most_detours - 1)]
    asked = [angle_between(ticket.goal.quat_xyzw, pose.quat_xyzw) for ticket, pose in zip(Told.tickets, expected, strict=True)]
    assert max(asked) < 0.03, asked
    is_there = (way, most_detours) != ("first goal", 2)
    assert log.status == "done" and [result.reached for result in log.goals] == [True, True, is_there]
    last = [event.answer for event in log.events if event.kind == "no_plan"][-1]
    assert last == ("replan" if is_there else "hold")
    assert plant.touching() >= 2


def test_where_a_leg_went_wrong_no_detour_is_made() -> None:
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    plant = MujocoPlant.of(scene, PlantSettings(seed=1), seed=1)
    goal = next(turns(plant.pose, count=1, seed=3, largest=0.5))
    barren: Any = Barren(regrasp.Session(scene, settings=PLANNER), "plan")

    def listen(entry: Any) -> None:
        barren.is_barren |= getattr(entry, "kind", "") == "missed"

    Told.tickets = []
    # No leg ever comes so near.
    settings = ExecutorSettings(anytime=False, attempts=3, plan_attempts=1, choices=1, reached_turn=1e-9)
    log = Executor(barren, plant, settings, planning=Told, listener=listen).run([goal])
    assert [event.kind for event in log.events] == ["missed", "no_plan", "no_plan"]
    assert [angle_between(ticket.goal.quat_xyzw, goal.quat_xyzw) < 0.01 for ticket in Told.tickets] == [True] * 3
    assert log.status == "done" and log.n_reached == 0


def test_the_hand_rests_while_a_plan_is_made_from_where_the_object_was_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Feedback goes on where a leg was planned ahead: that begins where the leg before ends."""
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    waits: list[tuple[bool, float]] = []
    wait_for = Executor._wait_for

    def watched(self: Executor, ticket: Ticket, *, rests: bool) -> None:
        feedback = None if self._leg is None else self._leg.feedback
        before = None if feedback is None else feedback.offsets.copy()
        wait_for(self, ticket, rests=rests)
        if feedback is not None:
            assert not feedback.is_frozen
            waits.append((rests, float(np.abs(feedback.offsets - before).max())))

    monkeypatch.setattr(Executor, "_wait_for", watched)
    for anytime in (False, True):
        plant = MujocoPlant.of(scene, PlantSettings(seed=2), seed=2)
        # Plans take half a second, and three where they are made ahead, longer than legs.
        settings = ExecutorSettings(anytime=anytime, planning_overhead=3.0 if anytime else 0.5)
        log = Executor.of(ExecutorSessions.of(scene), plant, settings).run(turns(plant.pose, count=3, seed=1, largest=0.6))
        assert log.status == "done" and log.n_reached == 3
    assert [moved for rests, moved in waits if rests] and all(moved == 0.0 for rests, moved in waits if rests)
    assert any(moved > 0.0 for rests, moved in waits if not rests)
