"""Arguments of a session that make no sense are named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import regrasp

SCENES = Path(__file__).parents[2] / "scenes"
NAN = float("nan")


@pytest.fixture(scope="module")
def known() -> tuple[regrasp.Session, regrasp.Start, regrasp.Pose]:
    """A session, a start, and a goal that is near."""
    scene = regrasp.load_scene(SCENES / "sphere_90x.toml")
    session = regrasp.Session(scene)
    plan = regrasp.plan(scene, seed=1)
    assert isinstance(plan, regrasp.Plan)
    start = session.project(regrasp.Pose(plan.object_positions[0], plan.object_quat_xyzw[0]), plan.joints[0])
    assert isinstance(start, regrasp.Start)
    return session, start, start.world_from_object


Known = tuple[regrasp.Session, regrasp.Start, regrasp.Pose]


def project(**changes: Any) -> Callable[[Known], Any]:
    def ask(known: Known) -> Any:
        session, start, pose = known
        arguments: dict[str, Any] = {"world_from_object": pose, "joints": start.joints, **changes}
        return session.project(**{name: value(start) if callable(value) else value for name, value in arguments.items()})

    return ask


def speeds(joints: Any, linear: Any = (0.0, 0.0, 0.0)) -> Callable[[regrasp.Start], Any]:
    return lambda start: (joints if joints is not None else np.zeros(len(start.joints)), linear, (0.0, 0.0, 0.0))


CASES: dict[str, tuple[Callable[[Known], Any], str]] = {
    "joints of text": (project(joints="abc"), "Session.project argument \"joints\": is 'abc'; expected one number per joint"),
    "joints by name": (project(joints={"a": 1.0}), "argument \"joints\": is {'a': 1.0}"),
    "no joints": (project(joints=None), 'argument "joints": is None'),
    "complex joints": (project(joints=lambda start: start.joints + 1j), 'argument "joints": is array'),
    "no pose": (project(world_from_object=None), 'argument "world_from_object": is None; expected a regrasp.Pose'),
    "one press": (project(presses=[True]), "argument \"presses\": is .True.; expected 4 of True or False"),
    "presses of nothing": (project(presses=[None] * 4), 'argument "presses"'),
    "presses of text": (project(presses="yes!"), 'argument "presses"'),
    "press": (project(presses=True), 'argument "presses"'),
    "velocities of nan": (project(velocities=speeds(np.full(12, NAN))), 'argument "velocities": has array.*finite numbers: 12 of the joints'),
    "velocities of few joints": (project(velocities=speeds(np.zeros(3))), 'argument "velocities"'),
    "velocities in a plane": (project(velocities=speeds(None, (0.0, 0.0))), 'argument "velocities": has .0.0, 0.0.'),
    "two velocities": (project(velocities=lambda start: (start.joints, np.zeros(3))), 'argument "velocities"'),
    "plan from a failure": (
        lambda known: known[0].plan(known[0].project(regrasp.Pose((1, 0, 0), (0, 0, 0, 1)), known[1].joints), known[2]),  # type: ignore[arg-type]
        'Session.plan argument "start": is a Failure: no finger touches the object.*expected a Start',
    ),
    "plan from nothing": (lambda known: known[0].plan(None, known[2]), 'Session.plan argument "start": is None'),  # type: ignore[arg-type]
    "plan to nothing": (lambda known: known[0].plan(known[1], None), 'Session.plan argument "goal": is None'),  # type: ignore[arg-type]
    "plan for nothing": (lambda known: known[0].plan(known[1], known[2], level=None), 'Session.plan argument "level": is None'),  # type: ignore[arg-type]
    "plan for all": (lambda known: known[0].plan(known[1], known[2], level="all"), 'Session.plan argument "level": is .all.; expected one of'),  # type: ignore[arg-type]
    "check nothing": (lambda known: known[0].check(None), 'Session.check argument "plan": is None; expected a Plan'),  # type: ignore[arg-type]
    "check for all": (lambda known: known[0].check(_plan(known), level="x"), 'Session.check argument "level": is .x.'),  # type: ignore[arg-type]
    "settings of a number": (lambda known: regrasp.Session(known[0].scene, settings=5), 'Session argument "settings"'),  # type: ignore[arg-type]
    "settings of nan": (lambda known: regrasp.Session(known[0].scene, settings={"clearance": NAN}), 'Session argument "settings"'),
}


def _plan(known: Known) -> regrasp.Plan:
    found = known[0].plan(known[1], known[2])
    assert isinstance(found, regrasp.Plan)
    return found


@pytest.mark.parametrize("case", list(CASES))
def test_what_makes_no_sense_is_named(known: Known, case: str) -> None:
    ask, message = CASES[case]
    with pytest.raises(regrasp.InputError, match=message) as raised:
        ask(known)
    assert raised.value.code == "A510" and "\n" not in str(raised.value)


def test_what_makes_sense_is_taken(known: Known) -> None:
    session, start, pose = known
    assert session.project(pose, start.joints.tolist(), presses=np.ones(4, dtype=bool))  # type: ignore[arg-type]
    assert session.project(pose, start.joints, presses=(True, 1, np.True_, True), velocities=(np.zeros(12), [0, 0, 0], (0.0, 0.0, 0.0)))
    assert np.allclose(session.start.position, session.scene.start.position)
