"""How many resting states of replays are starts: ``python -m regrasp.execute.resting SCENE...``.

A replay is stopped where the plan rests, between two segments. What the simulation has there is projected, and what comes of it is
planned from, with a little work: planning must not refuse it. Both with the sessions of the executor: that for starts with links nearer to
the object projects, and makes no plans.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections import Counter

import numpy as np

from .._model import Pose, load_scene
from .._plan import Plan
from .._planning import export_mjcf
from .._planning import plan as plan_scene
from .._session import Start
from ..simulate import replay
from ..simulate.controllers import Controller
from ..simulate.model import Settings, make_rig
from ..simulate.plans import flat
from ..simulate.reference import reference
from .sessions import ExecutorSessions


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m regrasp.execute.resting", description=__doc__)
    parser.add_argument("scenes", nargs="+", metavar="SCENE")
    parser.add_argument("--states", type=int, default=200, help="of each scene")
    parser.add_argument("--package", action="append", default=[], metavar="NAME=DIR")
    asked = parser.parse_args(arguments)
    packages = dict(entry.split("=", 1) for entry in asked.package)
    print("| scene | states | starts | refused later | median, ms | 99 %, ms | largest, mm | largest turn, rad | largest joint, rad | why not |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    all_states = all_starts = 0
    for path in asked.scenes:
        scene = load_scene(path, packages=packages)
        sessions = ExecutorSessions.of(scene)
        n_states, n_starts, n_late = 0, 0, 0
        times: list[float] = []
        moved: list[tuple[float, float, float]] = []
        causes: Counter[str] = Counter()
        seed = 0
        while n_states < asked.states and seed < 400:
            plan = plan_scene(scene, seed=seed, max_work=400_000)
            seed += 1
            if not isinstance(plan, Plan):
                continue
            for pose, joints in resting_states(plan):
                if n_states == asked.states:
                    break
                n_states += 1
                begun = time.perf_counter()
                start = sessions.near.project(pose, joints)
                times.append(time.perf_counter() - begun)
                if not isinstance(start, Start):
                    causes[start.message] += 1
                    continue
                n_starts += 1
                moved.append((max(start.moved["object"], start.moved["tip"]), start.moved["object_turn"], start.moved["joint"]))
                later = sessions.loose.plan(start, plan.goal, seed=seed, max_work=300)
                if not isinstance(later, Plan) and later.kind in ("start_invalid", "rejected"):
                    n_late += 1
                    causes[f"later: {later.message}"] += 1
        all_states, all_starts = all_states + n_states, all_starts + n_starts
        most = np.max(moved, axis=0) if moved else np.full(3, np.nan)
        why = "; ".join(f"{count}: {message}" for message, count in causes.most_common(3))
        print(
            f"| {scene.name} | {n_states} | {n_starts} | {n_late} | {1e3 * np.median(times):.2f} | {1e3 * np.quantile(times, 0.99):.2f} "
            f"| {1e3 * most[0]:.2f} | {most[1]:.4f} | {most[2]:.4f} | {why} |",
            flush=True,
        )
    print(f"\n{all_starts} of {all_states} states are starts ({100 * all_starts / max(all_states, 1):.2f} %).")
    return 0


def resting_states(plan: Plan) -> list[tuple[Pose, np.ndarray[tuple[int], np.dtype[np.float64]]]]:
    """Poses of the object and joints where a replay with feedback rests, until the object is lost."""
    settings = Settings(controller="C2", hold_time=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        xml = export_mjcf(plan)
    content = flat(json.loads(plan.to_json()))
    rig = make_rig(xml, content, settings)
    ref = reference(content, tick=settings.tick)
    controller = Controller(rig, ref, settings)
    track = replay.replay(rig, ref, controller, replay.grip(rig, controller, settings), settings)
    model = rig.model
    joints = [int(model.jnt_qposadr[model.joint(name).id]) for name in rig.joint_names]
    # The last tick of every segment, and the end of the rest after the plan.
    ends = [k for k in range(ref.n_ticks - 1) if ref.segment[k] != ref.segment[k + 1]]
    found: list[tuple[Pose, np.ndarray[tuple[int], np.dtype[np.float64]]]] = []
    for k in [*ends, track.n_ticks - 1]:
        if k >= track.n_ticks or np.linalg.norm(track.object_position[k] - ref.object_position[min(k, ref.n_ticks - 1)]) > 0.01:
            break
        quat = track.object_quat_wxyz[k]
        found.append((Pose(track.object_position[k].copy(), quat[[1, 2, 3, 0]].copy()), track.qpos[k][joints].copy()))
    return found


if __name__ == "__main__":
    sys.exit(main())
