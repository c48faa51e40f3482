"""Exports to robomimic's HDF5 and to NPZ archives; `docs/reference/dataset-format.md` has the layouts."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from .._arguments import StrPath
from .draws import units
from .frames import all_frames
from .reading import Episode
from .tables import fault

#: Share of the episodes in the mask "valid", by their keys.
VALID_SHARE = 0.1


def export_npz(episodes: Iterable[Episode], folder: StrPath) -> int:
    """One archive per episode, as `Plan.to_npz` writes it (docs/reference/export-formats.md). Returns how many."""
    place = Path(os.fspath(folder))
    place.mkdir(parents=True, exist_ok=True)
    count = 0
    for episode in episodes:
        episode.plan().to_npz(place / f"{episode.row['task']}-{episode.row['episode']:09d}.npz")
        count += 1
    return count


def export_robomimic(episodes: Iterable[Episode], path: StrPath, *, fps: float = 30.0) -> int:
    """One HDF5 file: `data/demo_K` with `actions`, `obs/*`, `rewards`, `dones`, and masks `train` and `valid`. Returns how many.

    Raises `InputError` (D131) where h5py is absent.
    """
    try:
        h5py: Any = import_module("h5py")
    except ImportError:
        raise fault("D131", "export", "h5py is not installed", fix="pip install h5py") from None
    target = Path(os.fspath(path))
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(target.name + ".part")
    masks: dict[str, list[bytes]] = {"train": [], "valid": []}
    count, total, names, held = 0, 0, {}, {}
    with h5py.File(part, "w", libver="latest", track_order=True) as file:
        data = file.create_group("data")
        for frames in all_frames(episodes, fps):
            demo, n, names = data.create_group(f"demo_{count}"), len(frames.time), frames.names()
            row, held = frames.episode.row, dict(frames.layout.held_joints)
            demo.attrs.update(num_samples=n, task=row["task"], episode=row["episode"], key=row["key"], words=frames.episode.words)
            observed: dict[str, Any] = {
                "joints": frames.joints,
                "object_pose": frames.object_pose,
                "contacts": frames.contacts,
                "contact_forces": frames.forces,
                "goal_pose": np.repeat(frames.goal_pose[None], n, axis=0),
            }
            for name, values in observed.items():
                demo.create_dataset(f"obs/{name}", data=values, compression="gzip", track_times=False)
                after = np.concatenate([values[1:], values[-1:]])
                demo.create_dataset(f"next_obs/{name}", data=after, compression="gzip", track_times=False)
            ends = np.zeros(n)
            ends[-1] = 1.0
            demo.create_dataset("actions", data=frames.action, compression="gzip", track_times=False)
            demo.create_dataset("rewards", data=ends, track_times=False)
            demo.create_dataset("dones", data=ends.astype(np.int64), track_times=False)
            valid = next(units(row["key"], "robomimic mask")) < VALID_SHARE
            masks["valid" if valid else "train"].append(f"demo_{count}".encode())
            count += 1
            total += n
        data.attrs["total"] = total
        kind = {"env_name": "regrasp", "type": 1, "env_kwargs": {"fps": fps, "names": names, "held_joints": held}}
        data.attrs["env_args"] = json.dumps(kind)
        for name, demos in masks.items():
            file.create_dataset(f"mask/{name}", data=np.array(demos, dtype="S16"), track_times=False)
    part.replace(target)
    return count
