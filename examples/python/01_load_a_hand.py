"""Reads a hand file and says where its fingertips rest.

    python examples/python/01_load_a_hand.py my_hand.toml
"""

import sys
from pathlib import Path

import numpy as np

import regrasp

BUNDLED = Path(__file__).resolve().parents[2] / "assets/hands/wide_four_finger/hand.toml"

hand = regrasp.load_hand(sys.argv[1] if len(sys.argv) > 1 else BUNDLED)
for note in hand.notes:
    print(f"note: {note}")
print(f"{hand.name}: {len(hand.fingers)} fingers, {len(hand.joints)} joints")

rest = [angle for finger in hand.fingers for angle in finger.rest]
for finger, tip_in_base in zip(hand.fingers, hand.tips(rest)):
    x, y, z = 1e3 * tip_in_base
    print(f"  {finger.name}: tip, a {finger.tip.shape}, rests at [{x:.1f} {y:.1f} {z:.1f}] mm")
    for name, angle in zip(finger.joint_names, finger.rest):
        print(f"    {name:24} {np.degrees(angle):7.1f} deg")
