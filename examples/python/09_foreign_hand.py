"""A hand that nobody here tuned: the Shadow hand of gymnasium-robotics turns its block (docs/how-to/execute.md).

    pip install ".[sim]" gymnasium-robotics
    python examples/python/09_foreign_hand.py out/shadow run.html
"""

import argparse
from pathlib import Path

import gymnasium_robotics
import numpy as np

import regrasp
from regrasp.execute import Executor, ExecutorSettings, ForeignPlant, ForeignSettings, turns
from regrasp.execute.settings import CAREFUL, LOOSE, PLANNER
from regrasp.from_mjcf import convert

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("folder", type=Path, help="where the converted hand and the scene go")
parser.add_argument("page", help="FILE.html")
parser.add_argument("--goals", type=int, default=5)
parser.add_argument("--seed", type=int, default=0)
parser.add_argument("--impratio", type=float, help="stiffer friction than the model's: held objects creep less")
asked = parser.parse_args()
folder: Path = asked.folder
model = Path(gymnasium_robotics.__file__).parent / "envs/assets/hand/manipulate_block.xml"
made = convert(model, folder)
PLAY = -0.001 / 0.00705
# A tendon with play couples the last two joints of four fingers. Under load it rests at the end of its play.
for file, before, after in ((made.hand_file, "offset = 0.0", "offset = {}"), (made.urdf, 'offset="0.0"', 'offset="{}"')):
    file.write_text(file.read_text().replace(before, after.format(PLAY)))

# The palm faces up. The block is that of the model, where fingers reach it.
SCENE = """format = "regrasp-scene"
format_version = 1
task = "in_hand"

[hand]
file = "hand.toml"
world_from_hand = { position = [0.0, 0.0, 0.0], quat_xyzw = [-0.7071067811865476, 0.0, 0.0, 0.7071067811865476] }

[object]
name = "block"
box = { size = [0.05, 0.05, 0.05] }
mass = 0.070875
friction = 1.0
edge_distance = 0.008

[start]
position = [0.013, 0.114, 0.065]
position_within = 0.02

[goal]
turn = { axis = "z", angle_deg = 30 }
"""
(folder / "scene.toml").write_text(SCENE)
scene = regrasp.load_scene(folder / "scene.toml")
# A fingertip that has crept is still one that holds: contacts may be nearer to an edge than planned ones.
(folder / "crept.toml").write_text(SCENE.replace("edge_distance = 0.008", "edge_distance = 0.001"))
crept = regrasp.load_scene(folder / "crept.toml")
plan = regrasp.plan(scene, seed=asked.seed, settings=CAREFUL)
assert plan, plan
# Tendons of 0.00705 m and 0.00805 m, with 0.001 m of play.
followers = {f"robot0:{finger}J0": (f"robot0:{finger}J1", 0.00805 / 0.00705, PLAY) for finger in ("FF", "MF", "RF", "LF")}
bodies = {"index": "ff", "middle": "mf", "ring": "rf", "little": "lf", "thumb": "th"}
plant = ForeignPlant(
    str(model),
    plan,
    root="robot0:palm",
    object_body="object",
    world_from_root=regrasp.Pose(np.zeros(3), np.array([-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])),
    tips={finger: f"robot0:{bodies[finger]}distal" for finger in plan.fingers},
    followers=followers,
    settings=ForeignSettings(seed=asked.seed, impratio=asked.impratio),
)
executor = Executor(
    regrasp.Session(scene, settings=PLANNER),
    plant,
    # With gains of 1 N m/rad fingertips rest millimetres from where they are told to be.
    ExecutorSettings(
        project_distance=0.005,
        project_turn=0.1,
        slip_distance=0.006,
        deviation_distance=0.01,
        deviation_turn=float(np.radians(15.0)),
        stall_error=0.4,
        seed=asked.seed,
    ),
    careful=[regrasp.Session(scene, settings=CAREFUL)],
    loose=[regrasp.Session(scene, settings=LOOSE), regrasp.Session(crept, settings=LOOSE)],
    stiffness=plant.stiffness,
    damping=plant.damping,
)
log = executor.run(turns(plant.pose, count=asked.goals, seed=asked.seed, largest=np.radians(30.0), axis=np.array([0.0, 0.0, 1.0])))
for number, goal in enumerate(log.goals, start=1):
    off = f"{1e3 * (goal.true_distance or 0.0):.1f} mm and {np.degrees(goal.true_angle or 0.0):.1f} degrees off"
    print(f"goal {number}: {np.degrees(goal.turn):.0f} degrees, {'reached' if goal.reached else goal.why_not}, {off}")
print(f"{log.status}: {log.n_reached} of {asked.goals} goals, {log.n_replans} replans, {plant.touching()} fingertips touch {log.message}")
log.page(asked.page)
