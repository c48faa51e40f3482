"""A strip of pictures of a replay, rendered offscreen."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ._mujoco import MjModel, MjvCamera, mujoco
from .model import Rig
from .replay import Track
from .task import TaskTrack
from .task_reference import TaskRig

Image = NDArray[np.uint8]


class NoRenderer(RuntimeError):
    """No way to draw offscreen on this machine."""


def strip(rig: Rig, track: Track, *, pictures: int = 6, width: int = 360, height: int = 320) -> Image:
    """Pictures at even times, side by side; shape (height, pictures * width, 3). Raises ``NoRenderer``."""
    chosen = np.linspace(0, track.n_ticks - 1, pictures).round().astype(int)
    return _panels(rig.model, track.qpos[chosen], _camera(rig, track), width, height)


def task_strip(rig: TaskRig, track: TaskTrack, *, pictures: int = 8, width: int = 360, height: int = 320) -> Image:
    """Pictures of pick and place at even times, side by side. Raises ``NoRenderer``."""
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = track.qpos[:, rig.object_qpos : rig.object_qpos + 3].mean(axis=0)
    camera.distance, camera.azimuth, camera.elevation = 1.6, 140.0, -25.0
    chosen = np.linspace(0, len(track.qpos) - 1, pictures).round().astype(int)
    return _panels(rig.model, track.qpos[chosen], camera, width, height)


def _panels(model: MjModel, postures: NDArray[np.float64], camera: MjvCamera, width: int, height: int) -> Image:
    try:
        renderer = mujoco.Renderer(model, height, width)
    # MuJoCo's back ends fail in their own ways, some while they are imported.
    except Exception as error:
        raise NoRenderer(f"MuJoCo cannot draw offscreen here ({error}); set MUJOCO_GL to egl or osmesa") from error
    data = mujoco.MjData(model)
    panels: list[Image] = []
    try:
        for qpos in postures:
            data.qpos[:] = qpos
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            panels.append(renderer.render().copy())
    finally:
        renderer.close()
    return np.concatenate(panels, axis=1)


def _camera(rig: Rig, track: Track) -> MjvCamera:
    """Looks at where the object starts, from the side and from above the palm."""
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = track.object_position[0]
    camera.distance = 2.2 * max(rig.radius, max(finger.reach for finger in rig.fingers))
    view = -(0.9 * rig.palm_axis + 0.8 * rig.side_axis + 0.3 * np.cross(rig.palm_axis, rig.side_axis))
    view /= np.linalg.norm(view)
    camera.azimuth = float(np.degrees(np.arctan2(view[1], view[0])))
    camera.elevation = float(np.degrees(np.arcsin(view[2])))
    return camera


def write_png(path: Path, image: Image) -> None:
    """Writes an RGB picture."""
    height, width, _ = image.shape
    rows = np.concatenate((np.zeros((height, 1), np.uint8), image.reshape(height, -1)), axis=1)

    def chunk(kind: bytes, payload: bytes) -> bytes:
        return struct.pack(">I", len(payload)) + kind + payload + struct.pack(">I", zlib.crc32(kind + payload))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)
