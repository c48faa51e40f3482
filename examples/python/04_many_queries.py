"""Plans many queries at once: the interpreter's lock is released, and no plan depends on who else is planning."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import regrasp

SCENES = Path(__file__).resolve().parents[2] / "scenes"
SEEDS = range(24)

# A scene never changes: any number of threads may share it.
scene = regrasp.load_scene(SCENES / "sphere_90x.toml")


def solve(seed: int) -> regrasp.Plan | regrasp.Failure:
    return regrasp.plan(scene, seed=seed)


with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
    results = list(pool.map(solve, SEEDS))

plans = [result for result in results if isinstance(result, regrasp.Plan)]
print(f"{len(plans)} of {len(SEEDS)} solved, every plan accepted by the checker")
for seed, result in list(zip(SEEDS, results))[:4]:
    assert result == regrasp.plan(scene, seed=seed), "the same bytes as alone"
best = min(plans, key=lambda plan: plan.duration)
print(f"the shortest takes {best.duration:.1f} s: {best}")
