"""Not to find a plan is a result, not an exception: it says why, how near it came, and what to try."""

from pathlib import Path

import regrasp

SCENES = Path(__file__).resolve().parents[2] / "scenes"

scene = regrasp.load_scene(SCENES / "box_180x.toml")
result = regrasp.plan(scene, max_work=2_000)
if result:
    raise SystemExit("two thousand configurations are not enough for half a turn of a box")
print(f"{result.kind}: {result.message}")
for cause in result.causes[:3]:
    print(f"  {cause.count:6} times: {cause.reason}")
if result.nearest_miss is not None:
    print(f"  came within {result.nearest_miss.angle_left:.2f} rad of the goal")
print(f"  try: {result.advice}")

# Being asked nonsense is an error, with code, place and fix.
try:
    regrasp.load_scene(SCENES / "no_such_scene.toml")
except regrasp.InputError as error:
    print(f"{error.code} in {Path(error.file).name}: {error.problem}")
