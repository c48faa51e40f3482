"""Watches a search, and stops it from the callback; Ctrl-C stops it too."""

from pathlib import Path

import regrasp

SCENES = Path(__file__).resolve().parents[2] / "scenes"


class Enough(Exception):
    """What the callback raises stops the search and comes out of `plan`."""


def watch(progress: regrasp.Progress) -> None:
    print(f"  {progress.work:8} configurations, {progress.angle_left:.2f} rad left")
    if progress.work > 100_000:
        raise Enough


scene = regrasp.load_scene(SCENES / "six_finger_box_90x.toml")
try:
    # Improving for an hour, were it not for the callback.
    regrasp.plan(scene, improve=3600, progress=watch)
except Enough:
    print("stopped by the callback")
