"""A chain of goals in MuJoCo, planned while the hand moves, and the page of the run.

    python examples/python/chain_of_goals.py scenes/sphere_90x.toml run.html
"""

import sys

import numpy as np

from regrasp.execute import MujocoPlant, PlantSettings, execute, turns


def main(scene: str, page: str) -> None:
    # The camera sees the object 30 times a second, 30 ms late, with errors of half a millimetre and half a degree.
    plant = MujocoPlant.of(scene, PlantSettings(seed=1))
    log = execute(plant, turns(plant.pose, count=5, seed=1))
    for number, goal in enumerate(log.goals, start=1):
        word = "reached" if goal.reached else f"missed ({goal.why_not})"
        print(f"goal {number}: {word} in {goal.time - goal.start_time:.1f} s, {np.degrees(goal.turn):.0f} degrees")
    print(f"{log.n_reached} of {len(log.goals)} goals, {log.n_replans} replans, {len(log.events)} events")
    log.page(page)
    print(f"open {page}")


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["scenes/sphere_90x.toml", "run.html"]))
