"""Plans a bundled scene, saves the plan, has it judged again by the independent checker, and says which finger let go when.

    python examples/python/02_plan_and_check.py my_scene.toml
"""

import sys
import tempfile
from pathlib import Path

import regrasp

SCENES = Path(__file__).resolve().parents[2] / "scenes"

scene = regrasp.load_scene(sys.argv[1] if len(sys.argv) > 1 else SCENES / "box_90x.toml")
print(scene)

result = regrasp.plan(scene, seed=7)
if not result:
    sys.exit(str(result))

print(result)
for segment in result.segments:
    what = f"{segment.moving_finger} moves to another contact" if segment.moving_finger else "the object moves"
    print(f"  from {result.times[segment.start]:5.1f} s: {what}")

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "plan.json"
    result.save(path)
    report = regrasp.check(path, scene)
print(report)
if not report:
    sys.exit(1)
