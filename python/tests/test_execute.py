"""The executor in MuJoCo: chains of goals, faults, and what is left behind."""

from __future__ import annotations

import json
import os
import subprocess
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp

pytest.importorskip("mujoco")

from regrasp.execute import (  # noqa: E402
    ExecutorSettings,
    Executor,
    FaultyPlant,
    MujocoPlant,
    Observation,
    PlantSettings,
    RunLog,
    execute,
    faults,
    turns,
)
from regrasp.execute.planning import ThreadPlanning  # noqa: E402
from regrasp.execute.settings import FIRM, PLANNER  # noqa: E402

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.fixture(scope="module")
def scene() -> regrasp.Scene:
    return regrasp.load_scene(SCENES / "sphere_90x.toml")


def plant_of(scene: regrasp.Scene, **settings: Any) -> MujocoPlant:
    return MujocoPlant.of(scene, PlantSettings(seed=1, **settings), seed=1)


def held(plant: MujocoPlant) -> bool:
    """Whether the object stays in the hand for another second with the last command."""
    import mujoco

    before, _ = plant.truth()
    mujoco.mj_step(plant.rig.model, plant.data, 500)
    after, _ = plant.truth()
    return plant.touching() >= 2 and float(np.linalg.norm(after - before)) < 0.003


def test_slips_count_earlier_on_round_objects_alone(scene: regrasp.Scene) -> None:
    box = regrasp.load_scene(SCENES / "box_90x.toml")
    for moved, wanted in ((scene, 0.002), (box, 0.003)):
        session = regrasp.Session(moved)
        executor = Executor(session, plant_of(moved), ExecutorSettings(slip_distance=0.003, slip_round=0.002))
        assert executor.log.settings["slip_distance"] == wanted
    assert ExecutorSettings(slip_distance=0.001).for_object(scene.objects[0]).slip_distance == 0.001


def test_goals_in_a_row_are_reached(scene: regrasp.Scene, tmp_path: Path) -> None:
    plant = plant_of(scene)
    log = execute(plant, turns(plant.pose, count=4, seed=3))
    assert log.status == "done" and log.n_reached == 4
    settings = ExecutorSettings()
    for goal in log.goals:
        # Watched until the estimate knows what the fingers did not tell: goals that were not reached used to count as reached.
        settled = [s.time for s in log.samples if s.state == "settle" and goal.start_time <= s.time <= goal.time]
        assert settled[-1] - settled[0] > settings.settled_after - 0.1 and np.exp(-settings.settled_after / settings.pose_time_constant) < 0.1
        assert goal.true_distance is not None and goal.true_distance < 0.002
        assert goal.true_angle is not None and goal.true_angle < np.radians(2.0)
    assert any(leg.prepared for leg in log.legs), "no leg was planned while the one before ran"
    assert held(plant)
    log.save(tmp_path / "run.json")
    again = RunLog.load(tmp_path / "run.json")
    assert again.to_json() == log.to_json()
    # Every leg is a plan file that the checker judges by itself.
    for number in range(1, len(log.legs) + 1):
        assert regrasp.check(tmp_path / f"run.leg{number}.json", scene, own_query=True)
    assert len(again.plans) == len(log.plans)
    page = tmp_path / "run.html"
    again.page(page)
    text = page.read_text()
    assert "which finger holds when" in text and "http:" not in text.replace("http://www.w3.org", "") and "https:" not in text
    # The command line draws the same page.
    tool = os.environ.get("REGRASP_CLI")
    if tool:
        subprocess.run([tool, "view", str(tmp_path / "run.json"), "-o", str(tmp_path / "cli.html")], check=True)
        assert (tmp_path / "cli.html").read_bytes() == page.read_bytes()
    (tmp_path / "run.leg2.json").unlink()
    assert len(RunLog.load(tmp_path / "run.json").plans) == 1
    broken = (tmp_path / "run.json").read_text().replace('"settle"', '"flies"')
    (tmp_path / "broken.json").write_text(broken)
    with pytest.raises(regrasp.InputError, match="E801 .*broken.json:1:"):
        RunLog.load(tmp_path / "broken.json")
    with pytest.raises(regrasp.InputError, match="F001"):
        RunLog.load(tmp_path / "nowhere.json")


def test_the_same_run_twice_is_the_same(scene: regrasp.Scene) -> None:
    def run() -> Any:
        plant = plant_of(scene)
        content = execute(plant, turns(plant.pose, count=2, seed=5)).to_json()
        for leg in content["legs"]:
            for key in ("search_seconds", "check_seconds", "overhead_seconds"):
                del leg[key]
        return content

    assert run() == run()


def test_without_feedback_and_replanning_legs_follow_each_other(scene: regrasp.Scene) -> None:
    plant = plant_of(scene)
    log = execute(plant, turns(plant.pose, count=2, seed=3), settings=ExecutorSettings(feedback=False, replanning=False))
    assert log.status == "done" and log.n_replans == 0 and len(log.legs) == 2


def kinds(log: RunLog) -> set[str]:
    return {event.kind for event in log.events}


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        (faults.pose_jumps(0.1), "pose_jump"),
        (faults.pose_is_nan, "bad_pose"),
        (faults.pose_is_stale(), "stale_pose"),
        (faults.stamps_run_ahead, "bad_stamp"),
        (faults.joints_are_missing([3, 4]), "joints_missing"),
    ],
)
def test_bad_observations_make_the_hand_hold_and_go_on(scene: regrasp.Scene, fault: Any, kind: str) -> None:
    # Jumps that last would be believed in the end.
    inner = plant_of(scene)
    plant = FaultyPlant(inner, observe=fault, begin=0.6, end=0.6 + (0.2 if kind == "pose_jump" else 0.8))
    log = execute(plant, turns(inner.pose, count=2, seed=3))
    assert kind in kinds(log)
    assert log.status == "done" and log.n_reached == 2, log.message
    assert held(inner)


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        (faults.pose_is_nan, "stale_pose"),
        (faults.joints_are_missing([0]), "joints_missing"),
    ],
)
def test_bad_observations_that_last_end_with_the_object_held(scene: regrasp.Scene, fault: Any, kind: str) -> None:
    inner = plant_of(scene)
    log = execute(FaultyPlant(inner, observe=fault, begin=0.6), turns(inner.pose, count=3, seed=3))
    assert kind in kinds(log) and log.status == "gave_up" and kind in log.message
    assert held(inner)


def test_a_camera_that_errs_for_good_does_not_make_the_hand_let_go(scene: regrasp.Scene) -> None:
    inner = plant_of(scene)
    log = execute(FaultyPlant(inner, observe=faults.pose_jumps(0.1), begin=0.6), turns(inner.pose, count=3, seed=3))
    assert "pose_jump" in kinds(log) and log.status == "gave_up", log.message
    assert held(inner), "the pose was wrong, and the hand let go"


@pytest.mark.parametrize(("in_sight", "feels"), [(True, True), (True, False), (False, True)])
def test_an_object_that_is_gone_has_its_own_event(scene: regrasp.Scene, in_sight: bool, feels: bool) -> None:
    inner = plant_of(scene, feels_forces=feels)
    first = inner.rig.object_qpos
    gone: list[bool] = []

    def taken(seen: Observation) -> Observation:
        if not gone:
            inner.data.qpos[first] += 0.3
            gone.append(True)
        return seen if in_sight else faults.pose_is_nan(seen)

    log = execute(FaultyPlant(inner, observe=taken, begin=0.8), turns(inner.pose, count=6, seed=4))
    assert log.status == "lost" and log.events[-1].kind == "object_gone" and "gave_up" not in kinds(log), log.message
    assert log.events[-1].answer == "give_up" and ("out of sight" in log.message) == (not in_sight)


def test_a_finger_that_does_not_move_is_found(scene: regrasp.Scene) -> None:
    inner = plant_of(scene)
    first = inner.rig.fingers[0].joints.tolist()
    plant = FaultyPlant(inner, apply=faults.finger_is_stuck(first), begin=0.3)
    log = execute(plant, turns(inner.pose, count=8, seed=4))
    assert kinds(log) & {"stalled_joint", "deviation", "slip", "lost_contact", "missed", "no_start"}
    assert inner.touching() >= 2, "the object fell"


def test_trouble_that_passes_does_not_stop_the_leg(scene: regrasp.Scene) -> None:
    inner = plant_of(scene)

    def numb(seen: Observation) -> Observation:
        assert seen.tip_forces is not None
        return replace(seen, tip_forces=np.zeros_like(seen.tip_forces))

    # Longer than a contact may be away (0.1 s), shorter than the hand waits (0.6 s).
    plant = FaultyPlant(inner, observe=numb, begin=0.5, end=0.8)
    log = execute(plant, turns(inner.pose, count=2, seed=4))
    assert log.status == "done" and log.n_reached == 2, log.message
    assert [(event.kind, event.answer) for event in log.events] == [("lost_contact", "resume")]
    assert [goal.legs for goal in log.goals] == [1, 1]
    # What lasts longer ends the leg.
    inner = plant_of(scene)
    plant = FaultyPlant(inner, observe=numb, begin=0.5, end=1.5)
    log = execute(plant, turns(inner.pose, count=2, seed=4))
    assert ("lost_contact", "replan") in [(event.kind, event.answer) for event in log.events]
    assert held(inner)


def test_a_link_in_the_way_makes_the_hand_go_back(scene: regrasp.Scene) -> None:
    plant = plant_of(scene)
    executor = Executor(regrasp.Session(scene, settings=PLANNER), plant)
    executor.run(turns(plant.pose, count=1, seed=4))
    leg, last = executor._leg, executor._k
    assert leg is not None and last == leg.n_ticks - 1
    assert executor._go_back()
    k = executor._k
    assert last - round(0.3 / plant.tick) <= k < last
    # No finger lands or lifts on the way back, and the object is where the leg had it then.
    assert (leg.ref.holds[k] == leg.ref.holds[last]).all()
    executor._hold_for(0.5)
    now, _ = plant.truth()
    assert np.linalg.norm(now - leg.ref.object_position[k]) < 0.001
    assert held(plant)
    # Never farther than its own segment.
    while executor._go_back():
        assert (leg.ref.holds[executor._k] == leg.ref.holds[last]).all()
    assert executor._k == 0 or (leg.ref.holds[executor._k - 1] != leg.ref.holds[last]).any()


def test_trouble_makes_the_grip_firmer(scene: regrasp.Scene) -> None:
    plant = plant_of(scene)
    firm = regrasp.Session(scene, settings=FIRM)
    settings = ExecutorSettings(grip="firm after trouble")
    executor = Executor(regrasp.Session(scene, settings=PLANNER), plant, settings, firm=[firm])

    executor.run(turns(plant.pose, count=1, seed=4))
    usual = executor.log.plans[-1]
    executor._event("slip", "as if", "none")
    ticket = executor._query(next(iter(turns(plant.pose, count=1, seed=5))))
    assert isinstance(ticket.answer, regrasp.Plan)
    assert ticket.answer.settings["forces"]["squeeze"] == 12.0 and usual.settings["forces"]["squeeze"] == 4.0


def test_a_motion_that_is_as_short_as_can_be_is_planned_once(scene: regrasp.Scene) -> None:
    plant = plant_of(scene)
    executor = Executor(regrasp.Session(scene, settings=PLANNER), plant)
    executor._first_pose()
    near, far = (next(iter(turns(plant.pose, count=1, seed=5, largest=largest, axis=np.eye(3)[2]))) for largest in (0.02, 1.5))
    short, long = executor._query(near), executor._query(far)
    assert isinstance(short.answer, regrasp.Plan) and short.answer.statistics["relocations"] == 0
    assert short.work == short.answer.statistics["work"], "more plans were made"
    assert isinstance(long.answer, regrasp.Plan) and long.answer.statistics["relocations"] > 0
    assert long.work > long.answer.statistics["work"], "only one plan was made"


def test_a_planner_out_of_budget_leaves_the_hand_holding() -> None:
    plant = plant_of(regrasp.load_scene(SCENES / "box_180x.toml"))
    settings = ExecutorSettings(max_work=1, plan_attempts=1, attempts=2)
    log = execute(plant, turns(plant.pose, count=2, seed=3, axis=np.eye(3)[0]), settings=settings)
    assert "no_plan" in kinds(log) and log.n_reached == 0
    assert all("no plan" in goal.why_not for goal in log.goals)
    assert held(plant)


def test_a_goal_out_of_reach_is_left_out(scene: regrasp.Scene) -> None:
    plant = plant_of(scene)
    here = plant.pose
    far = regrasp.Pose(here.position + np.array([0.0, 0.0, 0.5]), here.quat_xyzw)
    log = execute(plant, [far, *turns(here, count=1, seed=3)])
    assert [goal.reached for goal in log.goals] == [False, True] and "no plan" in log.goals[0].why_not
    assert held(plant)


def test_ctrl_c_leaves_the_hand_holding_and_no_thread(scene: regrasp.Scene) -> None:
    inner = plant_of(scene)
    before = set(threading.enumerate())

    def interrupt(seen: Observation) -> Observation:
        raise KeyboardInterrupt

    plant = FaultyPlant(inner, observe=interrupt, begin=1.0)
    executor = Executor(regrasp.Session(scene, settings=PLANNER), plant, planning=ThreadPlanning)
    with pytest.raises(KeyboardInterrupt):
        executor.run(turns(inner.pose, count=3, seed=3))
    assert executor.log.status == "interrupted" and "interrupted" in kinds(executor.log)
    assert set(threading.enumerate()) <= before
    assert held(inner)


def test_a_search_on_a_thread_ends_when_nobody_wants_it() -> None:
    # A query that takes long, and one that nobody waits for.
    scene = regrasp.load_scene(SCENES / "box_180x.toml")
    session = regrasp.Session(scene, settings={"shortcuts": 1_000_000})
    plan = regrasp.plan(scene, seed=0)
    assert plan
    start = session.project(regrasp.Pose(plan.object_positions[0], plan.object_quat_xyzw[0]), plan.joints[0])
    assert start
    settings = ExecutorSettings(max_work=2**40)
    planning = ThreadPlanning([session], settings, lambda plan, _: plan)
    ticket = planning.ask(start, plan.goal, 0, 0.0)
    assert not ticket.done.wait(0.3)
    planning.close()
    assert ticket.done.is_set() and ticket.answer is None and ticket.error is None


def test_sessions_answer_and_refuse(scene: regrasp.Scene) -> None:
    session = regrasp.Session(scene)
    plan = regrasp.plan(scene, seed=1)
    assert plan
    pose = regrasp.Pose(plan.object_positions[0], plan.object_quat_xyzw[0])
    start = session.project(pose, plan.joints[0])
    assert start and all(start.holds) and set(start.touching) == {"holds"}
    found = session.plan(start, plan.goal, seed=2)
    assert found and found.report and session.check(found)
    asked = json.loads(found.to_json())["asked"]
    assert asked["free"] == [] and len(asked["joints"]) == len(plan.joint_names)
    assert session.times is not None and session.times.overhead < 0.002
    far = regrasp.Pose(plan.object_positions[0] + 0.1, plan.object_quat_xyzw[0])
    refused = session.project(far, plan.joints[0])
    assert not refused and "touches" in refused.message
    with pytest.raises(regrasp.InputError, match="A510"):
        session.project(pose, plan.joints)
    with pytest.raises(regrasp.InputError, match="A510"):
        regrasp.Session(scene, task="elsewhere")
    with pytest.raises(regrasp.InputError):
        regrasp.Session(scene, settings={"no_such_setting": 1})


def test_a_session_asks_its_roadmap_first(scene: regrasp.Scene, tmp_path: Path) -> None:
    tool = os.environ.get("REGRASP_CLI")
    if not tool:
        pytest.skip("REGRASP_CLI names no command line tool that builds a roadmap")
    graph = tmp_path / "graph.roadmap"
    build = [tool, "roadmap", "build", str(SCENES / "sphere_90x.toml"), "--places", "40", "-o", str(graph)]
    subprocess.run(build, check=True, capture_output=True)
    session = regrasp.Session(scene, roadmap=graph)
    plan = regrasp.plan(scene, seed=1)
    assert plan
    start = session.project(regrasp.Pose(plan.object_positions[0], plan.object_quat_xyzw[0]), plan.joints[0])
    assert start
    found = [session.plan(start, goal, seed=1) for goal in turns(start.world_from_object, count=5, seed=1)]
    assert all(plan and session.check(plan) for plan in found)
    assert "roadmap" in {plan.method for plan in found if plan}
    with pytest.raises(regrasp.InputError, match="R615.*friction_margin"):
        regrasp.Session(scene, settings={"friction_margin": 2.0}, roadmap=graph)
    with pytest.raises(regrasp.InputError, match="R611"):
        regrasp.Session(SCENES / "box_90x.toml", roadmap=graph)
    with pytest.raises(regrasp.InputError, match="F001"):
        regrasp.Session(scene, roadmap=tmp_path / "nowhere.roadmap")


def test_a_thousand_queries_take_no_more_memory(scene: regrasp.Scene) -> None:
    import resource

    session = regrasp.Session(scene)
    plan = regrasp.plan(scene, seed=1)
    assert plan
    pose = regrasp.Pose(plan.object_positions[0], plan.object_quat_xyzw[0])

    def ask(count: int) -> int:
        for seed in range(count):
            start = session.project(pose, plan.joints[0])
            assert start
            session.plan(start, plan.goal, seed=seed)
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    first = ask(60)
    # Kilobytes on Linux: the heap may round up, and no more.
    assert ask(200) - first < 6000


def test_a_gif_reads_back() -> None:
    from regrasp.execute import film

    rng = np.random.default_rng(0)
    values = bytes(rng.integers(0, 40, size=30_000).astype(np.uint8).tolist())
    assert decoded(film._lzw(values)) == values
    frame = np.zeros((4, 6, 3), np.uint8)
    assert film.gif([frame, frame], 0.1)[:6] == b"GIF89a"


def decoded(content: bytes) -> bytes:
    """GIF's LZW, read as the standard says (GIF89a, appendix F)."""
    bits = int.from_bytes(content, "little")
    out, size, table, before = bytearray(), 9, [bytes((k,)) for k in range(256)] + [b"", b""], b""
    while True:
        code = bits & ((1 << size) - 1)
        bits >>= size
        if code == 257:
            return bytes(out)
        if code == 256:
            size, table, before = 9, table[:258], b""
            continue
        entry = table[code] if code < len(table) else before + before[:1]
        if before:
            table.append(before + entry[:1])
        out += entry
        before = entry
        if len(table) == 1 << size and size < 12:
            size += 1
