"""A hand that nobody here tuned: the Shadow hand of gymnasium-robotics turns its block (docs/how-to/execute.md).

    pip install ".[sim]" gymnasium-robotics
    python -m regrasp.execute.gymnasium_shadow out/shadow --page run.html
"""

from __future__ import annotations

import argparse
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from .._model import Pose, load_scene
from .._plan import Plan
from .._planning import plan as plan_scene
from .._session import Session
from ..from_mjcf import convert
from .executor import Executor
from .foreign_plant import ForeignPlant, ForeignSettings
from .goals import turns
from .sessions import ExecutorSessions
from .settings import CAREFUL, LOOSE, NEAR, ExecutorSettings

MODEL = "envs/assets/hand/manipulate_block.xml"
#: A tendon with 0.001 m of play couples the last two joints of four fingers. Under load it rests at one end; in radians of the last joint.
PLAY = -0.001 / 0.00705
#: The same tendon at the joint before the last, over that of the last one, in metres.
RATIO = 0.00805 / 0.00705
#: Bodies of the fingertips.
TIPS = {"index": "ff", "middle": "mf", "ring": "rf", "little": "lf", "thumb": "th"}
#: The palm faces up. The block is that of the model, where fingers reach it.
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
#: With gains of 1 N m/rad fingertips rest millimetres from where they are told to be.
SETTINGS = ExecutorSettings(
    project_distance=0.005,
    project_turn=0.1,
    slip_distance=0.006,
    deviation_distance=0.01,
    deviation_turn=float(np.radians(15.0)),
    stall_error=0.4,
)


def main(arguments: list[str] | None = None) -> int:
    """Exit codes: 0 every goal was reached, 1 not, 2 the model or a plan to begin with is not there."""
    parser = argparse.ArgumentParser(prog="python -m regrasp.execute.gymnasium_shadow", description=__doc__)
    parser.add_argument("folder", type=Path, help="where the converted hand and the scene go")
    parser.add_argument("--model", type=Path, help="manipulate_block.xml [default: that of gymnasium-robotics]")
    parser.add_argument("--page", metavar="FILE.html")
    parser.add_argument("--goals", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--impratio", type=float, help="stiffer friction than the model's: held objects creep less")
    asked = parser.parse_args(arguments)
    model: Path | None = asked.model or _installed()
    if model is None:
        print("error: gymnasium-robotics is not installed, and --model names no file", file=sys.stderr)
        return 2
    folder: Path = asked.folder
    made = convert(model, folder)
    assert made.hand_file is not None, "the hand has fingers"
    for file, before, after in ((made.hand_file, "offset = 0.0", "offset = {}"), (made.urdf, 'offset="0.0"', 'offset="{}"')):
        file.write_text(file.read_text().replace(before, after.format(PLAY)))
    (folder / "scene.toml").write_text(SCENE)
    # A fingertip that has crept is still one that holds: contacts may be nearer to an edge than planned ones.
    (folder / "crept.toml").write_text(SCENE.replace("edge_distance = 0.008", "edge_distance = 0.001"))
    scene, crept = load_scene(folder / "scene.toml"), load_scene(folder / "crept.toml")
    plan = plan_scene(scene, seed=asked.seed, settings=CAREFUL)
    if not isinstance(plan, Plan):
        print(f"error: no plan to begin with: {plan.message}", file=sys.stderr)
        return 2
    plant = ForeignPlant(
        str(model),
        plan,
        root="robot0:palm",
        object_body="object",
        world_from_root=Pose(np.zeros(3), np.array([-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])),
        tips={finger: f"robot0:{TIPS[finger]}distal" for finger in plan.fingers},
        followers={f"robot0:{finger}J0": (f"robot0:{finger}J1", RATIO, PLAY) for finger in ("FF", "MF", "RF", "LF")},
        settings=ForeignSettings(seed=asked.seed, impratio=asked.impratio),
    )
    sessions = ExecutorSessions.of(scene)
    executor = Executor.of(
        sessions,
        plant,
        SETTINGS,
        loose=[sessions.loose, Session(crept, settings=LOOSE)],
        near=[sessions.near, Session(crept, settings=NEAR)],
        stiffness=plant.stiffness,
        damping=plant.damping,
    )
    up = np.array([0.0, 0.0, 1.0])
    log = executor.run(turns(plant.pose, count=asked.goals, seed=asked.seed, largest=float(np.radians(30.0)), axis=up))
    for number, goal in enumerate(log.goals, start=1):
        off = f"{1e3 * (goal.true_distance or 0.0):.1f} mm and {np.degrees(goal.true_angle or 0.0):.1f} degrees off"
        print(f"goal {number}: {np.degrees(goal.turn):.0f} degrees, {'reached' if goal.reached else goal.why_not}, {off}")
    print(f"{log.status}: {log.n_reached} of {asked.goals} goals, {log.n_replans} replans, {plant.touching()} fingertips touch {log.message}")
    if asked.page:
        log.page(asked.page)
    return 0 if log.n_reached == asked.goals else 1


def _installed() -> Path | None:
    """The model, without an import of the package."""
    found = find_spec("gymnasium_robotics")
    return None if found is None or found.origin is None else Path(found.origin).parent / MODEL


if __name__ == "__main__":
    sys.exit(main())
