"""Takes every hand of the shared models, and the hands on its robots, from the URDF to a plan.

    python suites/hands/every_hand.py target/release/regrasp ../shared/models OUT

Each hand is inspected, an object is placed for a turn of 90 degrees about z, and the turn is planned and checked. Where the hand cannot turn
objects, it is asked to hold one. Times are processor seconds of the whole command. OUT gets all files, and `hands.json`.
"""

import json
import os
import pathlib
import resource
import subprocess
import sys

HANDS = [
    ("Allegro, right", "hands/allegro/allegro_right.urdf", None),
    ("Allegro, left", "hands/allegro/allegro_left.urdf", None),
    ("Barrett", "hands/barrett/barrett.urdf", None),
    ("D'Claw", "hands/dclaw/dclaw.urdf", None),
    ("LEAP, right", "hands/leap/leap_right.urdf", None),
    ("LEAP, left", "hands/leap/leap_left.urdf", None),
    ("Shadow, right", "hands/shadow/shadow_right.urdf", None),
    ("Shadow, left", "hands/shadow/shadow_left.urdf", None),
    ("TriFinger Edu", "hands/trifingeredu/trifingeredu.urdf", None),
    ("TriFinger Pro", "hands/trifingerpro/trifingerpro.urdf", None),
    ("Hey5 on TIAGo, left", "robots/tiago_dual_hey5/tiago_dual.urdf", "hand_left_palm_link"),
    ("Hey5 on TIAGo, right", "robots/tiago_dual_hey5/tiago_dual.urdf", "hand_right_palm_link"),
    ("PR2, right gripper", "robots/pr2/pr2.urdf", "r_gripper_palm_link"),
    ("PR2, left gripper", "robots/pr2/pr2.urdf", "l_gripper_palm_link"),
    ("Panda", "robots/panda/panda.urdf", "panda_hand"),
    ("Baxter, right", "robots/baxter/baxter.urdf", "right_hand"),
]
OWN = [
    ("Barrett with couplings", "assets/hands/barrett/hand.toml"),
    ("nine motors, coupled across fingers", "assets/hands/nine_motors/hand.urdf"),
    ("three fingers, a motor each", "assets/hands/closing_three/hand.urdf"),
    ("parallel gripper", "assets/hands/parallel_gripper/hand.urdf"),
]
# What no other object, and but for the first no other tip, would change.
REFUSED = ("cannot turn objects", "one motor for several", "this version plans for")
RADII = [0.032, 0.045, 0.02]


def run(arguments: list[str], limit: float) -> tuple[int, str, float]:
    """Exit code, both streams and processor time of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(arguments, capture_output=True, text=True, timeout=limit, check=False)
        code, text = done.returncode, done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        code, text = -1, "no answer within the limit"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return code, text, after.ru_utime - before.ru_utime


def reason(text: str) -> str:
    """The line that says why."""
    lines = [line.strip() for line in text.splitlines()]
    for index, line in enumerate(lines):
        if line.startswith("NO PLAN"):
            return lines[index + 1].split(";")[0][:300]
    errors = [line for line in lines if line.startswith("error")]
    return errors[0][:300] if errors else (lines or ["nothing"])[-1][:300]


def row(name: str, source: str, base: str | None, tool: list[str], out: pathlib.Path) -> dict:
    """What became of one hand."""
    program, packages = tool[0], tool[1:]
    stem = out / name.lower().replace(" ", "_").replace(",", "").replace("'", "")
    hand = f"{stem}.toml"
    command = [program, "inspect", source, "-o", hand, *packages] + (["--base", base] if base else [])
    code, text, seconds = run(command, 120)
    found = {"name": name, "inspect": "written" if code == 0 else reason(text), "inspect_s": seconds}
    if code != 0:
        return found
    for soft in ([], ["--torsion-radius", "0.005"]):
        for radius in RADII:
            scene, ball = f"{stem}.scene.toml", f"sphere:{radius}"
            code, text, seconds = run([program, "place", hand, ball, "-o", scene, *soft, *packages, "--time-limit", "30"], 120)
            found["place_s"] = found.get("place_s", 0.0) + seconds
            if code != 0:
                found.setdefault("place", reason(text))
                if any(word in text for word in REFUSED):
                    break
                continue
            found |= {"place": f"ball of {1e3 * radius:.0f} mm{', soft tips' if soft else ''}"}
            code, text, seconds = run([program, "plan", scene, "-o", f"{stem}.plan.json", *packages, "--time-limit", "30"], 150)
            found |= {"plan": "accepted" if code == 0 else reason(text), "plan_s": seconds}
            if code == 0:
                return found
        if any(word in found.get("place", "") for word in REFUSED[1:]):
            break
    if found.get("plan") != "accepted":
        found["hold"] = hold(program, packages, hand, stem)
    return found


def hold(program: str, packages: list[str], hand: str, stem: pathlib.Path) -> str:
    """Asks whether the hand holds one of some balls."""
    for soft in ([], ["--torsion-radius", "0.005"]):
        for radius in RADII:
            scene = pathlib.Path(f"{stem}.hold.toml")
            head = f'contact = "soft_finger"\ntorsion_radius = {soft[1]}' if soft else ""
            scene.write_text(
                'format = "regrasp-scene"\nformat_version = 1\ntask = "in_hand"\n[hand]\n'
                f'file = "{os.path.basename(hand)}"\n{head}\n[object]\nname = "ball"\nsphere = {{ radius = {radius} }}\nmass = 0.1\n'
                'friction = 0.8\n[start]\nposition = "auto"\n[goal]\nturn = { axis = "z", angle_deg = 90 }\n',
                encoding="utf-8",
            )
            command = [program, "plan", str(scene), "--hold", "-o", f"{stem}.hold.json", *packages, "--time-limit", "30"]
            code, text, seconds = run(command, 90)
            if code == 0:
                return f"ball of {1e3 * radius:.0f} mm{', soft tips' if soft else ''}, {seconds:.1f} s"
            last = reason(text)
    return f"no: {last}"


def main() -> None:
    """Runs all hands, writes the table."""
    program, models, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    only = sys.argv[4:]
    out.mkdir(parents=True, exist_ok=True)
    tool = [program, "--package", f"models={models.resolve()}"]
    hands = [(name, str(models / path), base) for name, path, base in HANDS] + [(name, path, None) for name, path in OWN]
    rows = []
    for name, source, base in hands:
        if only and not any(word in name for word in only):
            continue
        rows.append(row(name, source, base, tool, out))
        print(json.dumps(rows[-1]), flush=True)
    (out / "hands.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
