"""A chain of goals in MuJoCo, each planned while the hand still moves to the one before; and the page of the run.

    python examples/python/08_chain_of_goals.py run.html
"""

import sys
from pathlib import Path

import numpy as np

from regrasp.execute import MujocoPlant, PlantSettings, execute, turns

SCENES = Path(__file__).resolve().parents[2] / "scenes"

# The camera sees the object 30 times a second, 30 ms late, with errors of half a millimetre and half a degree.
plant = MujocoPlant.of(SCENES / "sphere_90x.toml", PlantSettings(seed=1))
log = execute(plant, turns(plant.pose, count=5, seed=1))
for number, goal in enumerate(log.goals, start=1):
    word = "reached" if goal.reached else f"missed ({goal.why_not})"
    print(f"goal {number}: {np.degrees(goal.turn):.0f} degrees, {word} in {goal.time - goal.start_time:.1f} s")
print(f"{log.n_reached} of {len(log.goals)} goals, {log.n_replans} replans, {len(log.events)} events")
if len(sys.argv) > 1:
    log.page(sys.argv[1])
    print(f"open {sys.argv[1]}")
