"""A film of a run in MuJoCo, drawn offscreen: ``python -m regrasp.execute.film scene.toml -o run.gif``."""

from __future__ import annotations

import argparse
import os
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Frame = NDArray[np.uint8]

#: Levels of red, green and blue in the palette.
LEVELS = (6, 7, 6)


def gif(frames: list[Frame], seconds: float) -> bytes:
    """An animated GIF (GIF89a) of pictures of shape (height, width, 3), each shown for so long, over and over."""
    height, width = frames[0].shape[:2]
    red, green, blue = LEVELS
    steps = [(r, g, b) for r in range(red) for g in range(green) for b in range(blue)]
    palette = b"".join(bytes((r * 255 // (red - 1), g * 255 // (green - 1), b * 255 // (blue - 1))) for r, g, b in steps)
    out = [b"GIF89a", struct.pack("<HHBBB", width, height, 0xF7, 0, 0), palette.ljust(768, b"\0")]
    out.append(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")
    for frame in frames:
        level = [np.rint(frame[..., k].astype(np.float64) * (n - 1) / 255.0).astype(np.int64) for k, n in enumerate(LEVELS)]
        index = (level[0] * green + level[1]) * blue + level[2]
        out.append(b"\x21\xf9\x04\x00" + struct.pack("<H", round(100 * seconds)) + b"\x00\x00")
        out.append(b"\x2c" + struct.pack("<HHHHB", 0, 0, width, height, 0) + b"\x08")
        coded = _lzw(bytes(index.astype(np.uint8).ravel().tolist()))
        out += [bytes((len(coded[k : k + 255]),)) + coded[k : k + 255] for k in range(0, len(coded), 255)]
        out.append(b"\x00")
    return b"".join(out) + b"\x3b"


def _lzw(values: bytes) -> bytes:
    """Codes of GIF's LZW with 8-bit symbols (Welch 1984; GIF89a, appendix F)."""
    clear, end = 256, 257
    table: dict[bytes, int] = {bytes((k,)): k for k in range(256)}
    codes: list[tuple[int, int]] = [(clear, 9)]
    size, upcoming, prefix = 9, 258, b""
    for value in values:
        longer = prefix + bytes((value,))
        if longer in table:
            prefix = longer
            continue
        codes.append((table[prefix], size))
        table[longer] = upcoming
        if upcoming == 1 << size:
            size += 1
        upcoming += 1
        if upcoming == 4096:
            codes.append((clear, size))
            table = {bytes((k,)): k for k in range(256)}
            size, upcoming = 9, 258
        prefix = bytes((value,))
    codes += [(table[prefix], size), (end, size)]
    bits, n_bits, out = 0, 0, bytearray()
    for code, width in codes:
        bits |= code << n_bits
        n_bits += width
        while n_bits >= 8:
            out.append(bits & 255)
            bits >>= 8
            n_bits -= 8
    if n_bits:
        out.append(bits & 255)
    return bytes(out)


def main(arguments: list[str] | None = None) -> int:
    """Exit codes: 0 drawn, 2 bad input or nothing that draws."""
    parser = argparse.ArgumentParser(prog="python -m regrasp.execute.film", description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.gif")
    parser.add_argument("--goals", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--every", type=float, default=0.2, metavar="S", help="simulated time from picture to picture")
    parser.add_argument("--size", type=int, nargs=2, default=(240, 180), metavar=("W", "H"))
    parser.add_argument("--package", action="append", default=[], metavar="NAME=DIR")
    asked = parser.parse_args(arguments)
    os.environ.setdefault("MUJOCO_GL", "egl")
    from .._model import load_scene
    from ..simulate._mujoco import mujoco
    from .faults import FaultyPlant
    from .goals import turns
    from .mujoco_plant import MujocoPlant, PlantSettings
    from .one_call import execute
    from .plant import Command

    scene = load_scene(asked.scene, packages=dict(entry.split("=", 1) for entry in asked.package))
    plant = MujocoPlant.of(scene, PlantSettings(seed=asked.seed), seed=asked.seed)
    try:
        renderer: Any = mujoco.Renderer(plant.rig.model, asked.size[1], asked.size[0])
    # MuJoCo's back ends fail in their own ways.
    except Exception as error:
        print(f"error: nothing can be drawn offscreen: {error}; set MUJOCO_GL to egl or osmesa", file=sys.stderr)
        return 2
    camera: Any = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(plant.rig.model, camera)
    camera.lookat[:] = plant.data.xpos[plant.rig.object_body]
    camera.distance, camera.azimuth, camera.elevation = 7.0 * plant.rig.radius, 130.0, -20.0
    frames: list[Frame] = []

    def draw(command: Command) -> Command:
        if plant.data.time >= len(frames) * asked.every:
            renderer.update_scene(plant.data, camera)
            frames.append(renderer.render().copy())
        return command

    log = execute(FaultyPlant(plant, apply=draw), turns(plant.pose, count=asked.goals, seed=asked.seed))
    asked.output.write_bytes(gif(frames, 0.5 * asked.every))
    print(f"{len(frames)} pictures, {log.n_reached} of {asked.goals} goals, {asked.output.stat().st_size // 1000} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
