"""Scenes `shelf_N`: the Panda before a shelf with N obstacles, boards included: `shelf_scenes.py FOLDER ROBOT_FILE N QUERIES`.

Sizes in metres, postures in radians. Boxes are smaller the more there are, so that they fill alike. Each query has a scene file of its
own; a query is the same for every N. Postures are drawn without a look at the shelf: some starts and goals collide.
"""

import os
import random
import sys
from pathlib import Path

LIMITS = [(-2.3, 2.3), (-1.6, 1.6), (-2.7, 2.7), (-2.9, -0.3), (-2.7, 2.7), (0.1, 3.6), (-2.7, 2.7)]
LEVELS = [0.1, 0.45, 0.8, 1.15]
Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def boxes(n: int) -> list[Box]:
    """Size and position in the world of `n` boxes; the first seven are the boards."""
    boards: list[Box] = [((0.5, 1.2, 0.02), (0.75, 0.0, z)) for z in LEVELS]
    boards += [((0.5, 0.02, 1.1), (0.75, y, 0.6)) for y in (-0.6, 0.0, 0.6)]
    draws = random.Random(7)
    largest = 0.15 * n ** (-1 / 3)
    while len(boards) < n:
        size = (draws.uniform(0.5, 1) * largest, draws.uniform(0.5, 1) * largest, draws.uniform(0.5, 1) * largest)
        z = draws.choice(LEVELS[:3]) + 0.01 + 0.5 * size[2] + draws.uniform(0, 0.2)
        boards.append((size, (draws.uniform(0.75, 0.98), draws.uniform(-0.58, 0.58), z)))
    return boards[:n]


def main() -> None:
    folder, robot, n, n_queries = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    folder.mkdir(parents=True, exist_ok=True)
    robot_file = os.path.relpath(robot.resolve(), folder.resolve())
    text = f'format = "regrasp-scene"\nformat_version = 2\n\n[robot]\nfile = "{robot_file}"\n'
    for index, (size, position) in enumerate(boxes(n)):
        text += f'\n[[obstacles]]\nname = "box{index}"\nbox = {{ size = {list(size)} }}\nposition = {list(position)}\n'
    draws = random.Random(3)
    for query in range(n_queries):
        ends = [", ".join(f"panda_joint{k} = {draws.uniform(*limits)}" for k, limits in enumerate(LIMITS, 1)) for _ in range(2)]
        task = f'\n[[tasks]]\nname = "move"\ntask = "motion"\nstart = {{ joints = {{ {ends[0]} }} }}\ngoal = {{ joints = {{ {ends[1]} }} }}\n'
        (folder / f"{query:04}.toml").write_text(text + task, encoding="utf-8", newline="\n")


main()
