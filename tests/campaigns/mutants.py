#!/usr/bin/env python3
"""Runs the whole program on structure-aware mutants of every kind of file that it reads.

    tests/campaigns/mutants.py --runs 20000                # cargo xtask fuzz-program
    tests/campaigns/mutants.py --only 1234 -o out          # one mutant again, its files kept

Every run has a folder of its own with good files of which one is broken, and one command. Good are exit codes 0, 1 and 2 within 10 s
of processor time and 1 GB of memory, no panic, and no verdict that the exit code does not say. Everything else is a fault: its folder
is kept, and the exit code of the campaign is 1. Run `i` is a function of the seed and of `i`.
"""

import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile

import mutate

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
SECONDS = 10
WALL_SECONDS = 120
MEGABYTES = 1024

SPHERE = """format = "regrasp-scene"
format_version = 1
task = "in_hand"

[hand]
file = "hand.toml"
reach = 0.2

[object]
name = "ball"
sphere = { radius = 0.032 }
mass = 0.1
friction = 0.8

[start]
position = [0.0, 0.0, 0.078]

[goal]
turn = { axis = "x", angle_deg = 90 }

[[obstacles]]
name = "box"
box = { size = [0.02, 0.02, 0.02] }
position = [0.2, 0.0, 0.1]
"""
SUFFIXES = ("obj", "stl", "ply", "dae", "glb")
MESH = SPHERE.replace("sphere = { radius = 0.032 }", 'mesh = { file = "mesh.SUFFIX", origin = "center", scale = "fit:0.056" }')
CUBE = [(x, y, z) for x in (-0.028, 0.028) for y in (-0.028, 0.028) for z in (-0.028, 0.028)]
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]


def run(program, arguments, folder, environment):
    """One run: exit code (negative: a signal), seconds of processor time, peak memory in MB, stdout, stderr."""
    limits = f'ulimit -v {MEGABYTES * 1024}; ulimit -t {SECONDS}; ulimit -c 0; exec "$0" "$@"'
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = subprocess.Popen(
            ["/bin/sh", "-c", limits, program, *arguments], cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=err
        )
        timer = __import__("threading").Timer(WALL_SECONDS, child.kill)
        timer.start()
        _, status, usage = os.wait4(child.pid, 0)
        timer.cancel()
        # Popen must not wait for what was waited for.
        child.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read(4 << 20).decode("utf-8", "replace"))
    return child.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, *texts


def good_files(program, folder, environment):
    """Good files of every kind, made by the program itself where it writes them."""
    hand = REPOSITORY / "assets/hands/wide_four_finger"
    for name in ("hand.urdf", "hand.toml"):
        shutil.copy(hand / name, folder / name)
    (folder / "scene.toml").write_text(SPHERE)
    for suffix in SUFFIXES:
        (folder / f"{suffix}.toml").write_text(MESH.replace("SUFFIX", suffix))
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in CUBE)
    (folder / "mesh.obj").write_text(vertices + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES))
    facets = b"".join(mutate.struct.pack("<12fH", 0, 0, 0, *(x for v in face for x in CUBE[v]), 0) for face in FACES)
    (folder / "mesh.stl").write_bytes(bytes(80) + mutate.struct.pack("<I", len(FACES)) + facets)
    seeds = {"ply": "ply/little.ply", "dae": "dae/triangles.dae", "glb": "glb/two.glb"}
    for suffix, seed in seeds.items():
        shutil.copy(REPOSITORY / "fuzz/seeds" / seed, folder / f"mesh.{suffix}")
    for name in ("football.toml", "cubic.toml"):
        text = (REPOSITORY / "scenes" / name).read_text()
        (folder / name).write_text(text.replace('file = "../', f'file = "{REPOSITORY}/'))
    steps = [
        ["plan", "scene.toml", "-o", "plan.json", "--seed", "1", "--threads", "1"],
        ["plan", "cubic.toml", "-o", "relocated.json", "--threads", "1"],
        ["plan", "football.toml", "-o", "tracked.json", "--threads", "1"],
        ["roadmap", "build", "scene.toml", "-o", "graph.roadmap", "--places", "6", "--angle", "60", "--threads", "1"],
    ]
    for arguments in steps:
        done = subprocess.run([program, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"a good file cannot be made: {arguments}: {done.stderr}")
    plans = [folder / name for name in ("plan.json", "relocated.json", "tracked.json")]
    settings = {path.name: json.loads(path.read_text())["settings"] for path in plans}
    (folder / "settings.json").write_text(json.dumps(settings["plan.json"]))


def plan_of(scene, *more):
    """Plans with little work."""
    return ["plan", scene, "-o", "out.json", "--threads", "1", "--max-work", "1500", "--time-limit", "5", *more]


def commands(rng, target):
    """The command that reads the broken file."""
    common = rng.choice([[], [], ["--quiet"], ["--json"], ["--lenient"]])
    plan, scene = {
        "relocated.json": ("relocated.json", "cubic.toml"),
        "tracked.json": ("tracked.json", "football.toml"),
        "cubic.toml": ("relocated.json", "cubic.toml"),
        "football.toml": ("tracked.json", "football.toml"),
    }.get(target, ("plan.json", "scene.toml"))
    of_plan = [
        ["check", plan, "--scene", scene],
        ["check", plan, "--scene", scene],
        ["check", plan],
        ["view", plan, scene, "-o", "page.html", "--story", "story.json"],
        ["view", plan, scene, "--svg", "charts"],
        ["view", plan, scene, "--png", "board.png", "--width", "300", "--frames", "2"],
        ["export", plan, "--scene", scene, "--npz", "a.npz", "--ros2", "a.yaml", "--mjcf", "a.xml"],
        ["export", plan, "--scene", scene, "--npz", "a.npz", "--no-check"],
        ["export", plan, "--ros2", "a.yaml", "--no-check"],
        ["export", plan, "--scene", scene, "--mjcf", "a.xml", "--no-check"],
        ["simulate", plan],
    ]
    of_scene = [plan_of(scene), plan_of(scene, "--report", "page.html", "--failure", "why"), of_plan[0]]
    of_scene.append(["bench", scene, "--seeds", "2", "--max-work", "1000", "--time-limit", "3", "--csv", "rows.csv"])
    of_graph = ["graph.roadmap", "scene.toml"]
    by_target = {
        "hand.urdf": [["inspect", "hand.urdf", "--samples", "50", "-o", "made.toml"], ["inspect", "hand.toml", "--samples", "20"], *of_scene],
        "hand.toml": [["inspect", "hand.toml", "--samples", "50", "-o", "made.toml"], *of_scene],
        **{f"mesh.{suffix}": [plan_of(f"{suffix}.toml")] for suffix in SUFFIXES},
        "obj.toml": [plan_of("obj.toml")],
        "settings.json": [plan_of("scene.toml", "--settings", "settings.json")],
        "graph.roadmap": [
            ["roadmap", "info", "graph.roadmap"],
            ["roadmap", "query", *of_graph, "-o", "out.json", "--max-work", "2000"],
            ["roadmap", "query", *of_graph, "-o", "out.json", "--max-work", "2000", "--grow"],
            ["roadmap", "picture", *of_graph, "-o", "graph.svg", "--max-work", "2000"],
            ["roadmap", "bench", *of_graph, "--queries", "2"],
            ["view", "plan.json", "scene.toml", "-o", "page.html", "--with-roadmap", "graph.roadmap"],
        ],
    }
    choices = by_target.get(target, of_plan if target.endswith(".json") else of_scene)
    return [*rng.choice(choices), *common]


# Plans and scenes have most kinds of places.
TARGETS = {
    "hand.urdf": 20, "hand.toml": 12, "scene.toml": 18, "obj.toml": 4, "cubic.toml": 3, "football.toml": 5, "mesh.obj": 8, "mesh.stl": 6,
    "mesh.ply": 5, "mesh.dae": 5, "mesh.glb": 5,
    "plan.json": 10, "relocated.json": 10, "tracked.json": 6, "settings.json": 5, "graph.roadmap": 14,
}
ACCEPTED = re.compile(r"^check  ACCEPTED", re.MULTILINE)


def fault(command, code, seconds, megabytes, out, err):
    """What is wrong with a run; none where nothing is."""
    if code == -signal.SIGXCPU or seconds > SECONDS:
        return f"more than {SECONDS} s"
    if code == -signal.SIGKILL:
        return "killed"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if megabytes > MEGABYTES:
        return f"{megabytes:.0f} MB"
    if "panicked" in err or "internal error" in err or '"internal_error"' in out:
        return "a panic"
    if command[0] == "check" and code != 0 and ACCEPTED.search(err):
        return "says accepted, and exits otherwise"
    if len(err) > 200_000:
        return f"{len(err)} characters of talk"
    if code == 2 and not err.strip() and "--json" not in command:
        return "refuses in silence"
    return None


def one(index, options, good, environment):
    """Run `index`: what it was, what came of it."""
    rng = random.Random(f"{options.seed}:{index}")
    target = rng.choices(list(TARGETS), weights=TARGETS.values())[0]
    folder = pathlib.Path(tempfile.mkdtemp(prefix=f"run{index}_", dir=options.work))
    for file in good.iterdir():
        (folder / file.name).symlink_to(file)
    broken = folder / target
    data = broken.read_bytes()
    broken.unlink()
    broken.write_bytes(mutate.BY_SUFFIX[broken.suffix](rng, data))
    command = commands(rng, target)
    if "--grow" in command and (folder / "graph.roadmap").is_symlink():
        shutil.copy(good / "graph.roadmap", folder / "graph.roadmap")
    code, seconds, megabytes, out, err = run(options.program, command, folder, environment)
    wrong = fault(command, code, seconds, megabytes, out, err)
    if wrong or options.only is not None:
        kept = options.output / str(index)
        shutil.rmtree(kept, ignore_errors=True)
        shutil.copytree(folder, kept)
        (kept / "command.txt").write_text(f"regrasp {' '.join(command)}\n{wrong}\nexit code {code}, {seconds:.1f} s, {megabytes:.0f} MB\n\n{err}")
    shutil.rmtree(folder)
    return {"run": index, "target": target, "command": command, "code": code, "seconds": seconds, "megabytes": megabytes, "fault": wrong}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0, help="index of the first run")
    parser.add_argument("--only", type=int, help="this run alone; its folder is kept")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--program", default=str(REPOSITORY / "target/release/regrasp"))
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("out/mutants"), help="folder for faults")
    options = parser.parse_args()
    options.program = str(pathlib.Path(options.program).resolve())
    options.output.mkdir(parents=True, exist_ok=True)
    environment = {"PATH": os.environ.get("PATH", ""), "RUST_BACKTRACE": "0"}
    with tempfile.TemporaryDirectory(prefix="regrasp_mutants_") as work:
        options.work = work
        good = pathlib.Path(work) / "good"
        good.mkdir()
        good_files(options.program, good, environment)
        indices = [options.only] if options.only is not None else range(options.first, options.first + options.runs)
        results = []
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for result in pool.map(lambda index: one(index, options, good, environment), indices):
                results.append(result)
                if result["fault"]:
                    print(f"FAULT  run {result['run']}: {result['fault']}: {' '.join(result['command'])} ({result['target']} broken)", flush=True)
                if len(results) % 1000 == 0:
                    print(f"       {len(results)} runs", flush=True)
    report(results)
    with open(options.output / "runs.jsonl", "w", encoding="utf-8") as file:
        file.writelines(json.dumps(result) + "\n" for result in results)
    return 1 if any(result["fault"] for result in results) else 0


def report(results):
    """Counts by exit code, and the extremes."""
    codes = collections.Counter(result["code"] for result in results)
    faults = collections.Counter(result["fault"] for result in results if result["fault"])
    print(f"{len(results)} runs: " + ", ".join(f"exit code {code}: {count}" for code, count in sorted(codes.items())))
    print(f"longest {max(result['seconds'] for result in results):.1f} s, most memory {max(result['megabytes'] for result in results):.0f} MB")
    print("faults: " + (", ".join(f"{name}: {count}" for name, count in faults.most_common()) or "none"))


if __name__ == "__main__":
    sys.exit(main())
