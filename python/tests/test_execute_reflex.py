"""The grip becomes firmer where fingertips feel a sudden change."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import regrasp
from conftest import SCENES

pytest.importorskip("mujoco")

from regrasp.execute import Executor, ExecutorSettings, MujocoPlant, PlantSettings, turns  # noqa: E402
from regrasp.execute.executor import RunLog  # noqa: E402
from regrasp.execute.reflex import LOOKS, Reflex  # noqa: E402
from regrasp.execute.sessions import ExecutorSessions  # noqa: E402
from regrasp.simulate import Settings  # noqa: E402

TICK = 0.004


@dataclass
class Hand:
    """Fingers that feel what they are told, on a leg of which only the forces matter."""

    planned: Any
    holds: Any
    settings: ExecutorSettings = ExecutorSettings(reflex_press=1.0)

    def __post_init__(self) -> None:
        self.leg: Any = SimpleNamespace(normal_forces=self.planned, ref=SimpleNamespace(holds=self.holds))
        self.reflex = Reflex(self.settings)

    def told(self, felt: Any, blends: bool = False) -> tuple[list[int], list[float]]:
        """Ticks at which a change is felt, and how much harder the hand presses at each."""
        ticks: list[int] = []
        extra: list[float] = []
        for k in range(len(self.planned)):
            forces = None if felt is None else felt[k]
            if self.reflex.look(k * TICK, self.leg, k, forces, blends=blends):
                ticks.append(k)
            extra.append(self.reflex.extra)
        return ticks, extra


def constant(n: int = 300) -> tuple[Any, Any]:
    """Planned forces of three fingers, of which two hold."""
    return np.tile([4.0, 5.0, 3.0], (n, 1)), np.tile([True, True, False], (n, 1))


def test_a_jump_of_a_force_makes_the_hand_press_harder_for_a_while() -> None:
    planned, holds = constant()
    felt = planned + 0.3
    felt[50:, 1] -= 2.0
    settings = ExecutorSettings(reflex_press=1.0)
    ticks, extra = Hand(planned, holds, settings).told(felt)
    assert ticks == [50]
    assert extra[49] == 0.0 and extra[50] == settings.reflex_press
    # As long as the change is in the window it counts anew; not while that has two presses in it.
    end = 50 + round(settings.reflex_time / TICK)
    assert all(now == settings.reflex_press for now in extra[50:end])
    middle = extra[end + LOOKS + round(0.5 * settings.reflex_release / TICK)]
    assert 0.3 < middle < 0.7 * settings.reflex_press
    assert extra[end + LOOKS + round(settings.reflex_release / TICK) + 1] == 0.0


def test_what_is_no_sudden_change_is_left_alone() -> None:
    planned, holds = constant()
    quiet: list[tuple[Any, Any, dict[str, Any]]] = []
    # Slowly; of a free finger; of sensors that fail, and come back; no sensor at all; while commands pass from one leg to the next.
    slow = planned.copy()
    slow[:, 0] += np.linspace(0.0, 10.0, len(slow))
    free = planned.copy()
    free[50:, 2] += 5.0
    numb = planned.copy()
    numb[50:80] = 0.0
    jump = planned.copy()
    jump[50:, 0] += 5.0
    quiet += [(planned, slow, {}), (planned, free, {}), (planned, numb, {}), (planned, None, {}), (planned, jump, {"blends": True})]
    # Planned; and planned, but felt four ticks late.
    ramp = planned.copy()
    ramp[50:66, :2] += np.linspace(0.0, 6.0, 16)[:, None]
    ramp[66:, :2] += 6.0
    late = np.vstack((ramp[:1].repeat(4, axis=0), ramp[:-4]))
    quiet += [(ramp, ramp, {}), (ramp, late, {})]
    for plan, felt, how in quiet:
        ticks, extra = Hand(plan, holds).told(felt, **how)
        assert not ticks and not any(extra)
    ticks, extra = Hand(planned, holds, ExecutorSettings()).told(jump)
    assert not ticks and not any(extra)
    # The same jump is felt where nothing of that is so.
    assert Hand(planned, holds).told(jump)[0] == [50]


def run(reflex: bool, seed: int) -> tuple[RunLog, int]:
    """A chain of goals of the box with friction 0.5 of the scene's, pushed with 4 N; what became of it, and how many fingers touch at the end."""
    scene = regrasp.load_scene(SCENES / "box_90x.toml")
    simulation = Settings(hold_time=0.0, friction_scale=0.5)
    plant = MujocoPlant.of(scene, PlantSettings(simulation=simulation, push=4.0, seed=seed), seed=seed, max_work=5_000_000)
    settings = ExecutorSettings(reflex_press=1.0) if reflex else ExecutorSettings()
    log = Executor.of(ExecutorSessions.of(scene), plant, settings).run(turns(plant.pose, count=5, seed=seed))
    return log, plant.touching()


@pytest.mark.parametrize("seed", [8, 13])
def test_a_box_that_is_pushed_out_stays_with_the_reflex(seed: int) -> None:
    """Of the seeds 0 to 23 six lose it without (0, 8, 13, 14, 15, 21), and none of these with it; with 0 and 14 one goal is missed."""
    log, touching = run(reflex=True, seed=seed)
    assert log.status == "done" and log.n_reached == 5 and touching >= 3, log.message
    assert [event.answer for event in log.events if event.kind == "sudden_force"]
    log, _ = run(reflex=False, seed=seed)
    assert log.status == "lost" and log.n_reached < 5
    assert not [event for event in log.events if event.kind == "sudden_force"]
