"""Export to a LeRobot data set, version 3.0: info, stats, tasks, episodes, data. No videos.

state = joints and object pose; action = next joints and joint torques; contacts, forces and goal beside.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from .._arguments import StrPath
from ._arrow import pa, pq
from .frames import Frames, all_frames
from .reading import Episode
from .tables import fault

VERSION = "v3.0"
#: Frames in a data file: some 50 MB, below the 100 MB that the format asks for.
FRAMES_IN_FILE = 100_000
FILES_IN_CHUNK = 1000
QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
#: Frames that quantiles are taken from, at most.
MOST_SAMPLES = 200_000

Array = npt.NDArray[Any]


@dataclass
class _Statistics:
    """Of one feature over all frames; quantiles over every k-th of them."""

    count: int = 0
    low: Array | None = None
    high: Array | None = None
    total: Array | None = None
    squares: Array | None = None
    samples: list[Array] = field(default_factory=list[Array])
    stride: int = 1

    def add(self, values: Array) -> None:
        """Counts frames in: (n, d)."""
        exact = values.astype(np.float64)
        low, high, total, squares = exact.min(0), exact.max(0), exact.sum(0), (exact * exact).sum(0)
        self.low = low if self.low is None else np.minimum(self.low, low)
        self.high = high if self.high is None else np.maximum(self.high, high)
        self.total = total if self.total is None else self.total + total
        self.squares = squares if self.squares is None else self.squares + squares
        first = -self.count % self.stride
        self.samples.append(values[first :: self.stride])
        self.count += len(values)
        if sum(len(each) for each in self.samples) > MOST_SAMPLES:
            self.samples = [np.concatenate(self.samples)[::2]]
            self.stride *= 2

    def to_json(self) -> dict[str, Any]:
        """As `meta/stats.json` has it."""
        assert self.low is not None and self.high is not None and self.total is not None and self.squares is not None
        mean = self.total / self.count
        std = np.sqrt(np.maximum(self.squares / self.count - mean * mean, 0.0))
        samples = np.concatenate(self.samples)
        shares = {name: np.quantile(samples, share, axis=0).tolist() for name, share in QUANTILES.items()}
        plain = {"min": self.low.tolist(), "max": self.high.tolist(), "mean": mean.tolist(), "std": std.tolist()}
        return {**plain, "count": [self.count], **shares}


@dataclass
class _Writer:
    folder: Path
    fps: int
    tasks: dict[str, int] = field(default_factory=dict[str, int])
    episodes: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    """Those whose frames wait."""
    n_episodes: int = 0
    statistics: dict[str, _Statistics] = field(default_factory=dict[str, _Statistics])
    features: dict[str, Any] = field(default_factory=dict[str, Any])
    held: dict[str, float] = field(default_factory=dict[str, float])
    """Joints that stand still all along, and where."""
    n_frames: int = 0
    n_files: int = 0
    waiting: list[Any] = field(default_factory=list[Any])
    n_waiting: int = 0

    def add(self, frames: Frames) -> None:
        """Adds an episode."""
        n, index = len(frames.time), self.n_episodes
        task = self.tasks.setdefault(frames.episode.words, len(self.tasks))
        named = {
            "observation.state": frames.state,
            "observation.contacts": frames.contacts,
            "observation.contact_forces": frames.forces,
            "observation.goal_pose": np.repeat(frames.goal_pose[None], n, axis=0),
            "action": frames.action,
        }
        whole = {
            "timestamp": frames.time.astype(np.float32),
            "frame_index": np.arange(n),
            "episode_index": np.full(n, index),
            "index": np.arange(self.n_frames, self.n_frames + n),
            "task_index": np.full(n, task),
        }
        if not self.features:
            self.features = _features(frames, named)
            self.held = dict(frames.layout.held_joints)
        about: dict[str, Any] = {
            "episode_index": index,
            "tasks": [frames.episode.words],
            "length": n,
            "data/chunk_index": self.n_files // FILES_IN_CHUNK,
            "data/file_index": self.n_files % FILES_IN_CHUNK,
            "dataset_from_index": self.n_frames,
            "dataset_to_index": self.n_frames + n,
            "meta/episodes/chunk_index": self.n_files // FILES_IN_CHUNK,
            "meta/episodes/file_index": self.n_files % FILES_IN_CHUNK,
            "regrasp/task": frames.episode.row["task"],
            "regrasp/episode": frames.episode.row["episode"],
            "regrasp/key": frames.episode.row["key"],
        }
        for name, values in {**named, **{key: column[:, None] for key, column in whole.items()}}.items():
            own = _Statistics()
            own.add(values)
            about.update({f"stats/{name}/{key}": value for key, value in own.to_json().items()})
            self.statistics.setdefault(name, _Statistics()).add(values)
        columns = {
            name: pa.FixedSizeListArray.from_arrays(pa.array(values.ravel(), pa.float32()), values.shape[1])
            for name, values in named.items()
        }
        self.waiting.append(pa.table({**columns, **{name: pa.array(column) for name, column in whole.items()}}))
        self.episodes.append(about)
        self.n_episodes += 1
        self.n_frames += n
        self.n_waiting += n
        if self.n_waiting >= FRAMES_IN_FILE:
            self.flush()

    def flush(self) -> None:
        """Writes the frames that wait to a file of their own, and what is known of their episodes to another."""
        if self.waiting:
            name = f"chunk-{self.n_files // FILES_IN_CHUNK:03d}/file-{self.n_files % FILES_IN_CHUNK:03d}.parquet"
            tables = {"data": pa.concat_tables(self.waiting), "meta/episodes": pa.Table.from_pylist(self.episodes)}
            for place, table in tables.items():
                (self.folder / place / name).parent.mkdir(parents=True, exist_ok=True)
                pq.write_table(table, self.folder / place / name, compression="zstd")
            self.n_files += 1
        self.waiting, self.episodes, self.n_waiting = [], [], 0

    def finish(self) -> None:
        """Writes what stands in `meta`."""
        self.flush()
        meta = self.folder / "meta"
        meta.mkdir(parents=True, exist_ok=True)
        pq.write_table(_tasks_table(self.tasks), meta / "tasks.parquet")
        info = {
            "codebase_version": VERSION,
            "robot_type": "hand",
            "total_episodes": self.n_episodes,
            "total_frames": self.n_frames,
            "total_tasks": len(self.tasks),
            "chunks_size": FILES_IN_CHUNK,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": self.fps,
            "splits": {"train": f"0:{self.n_episodes}"},
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": None,
            "features": self.features,
        }
        stats = {name: statistics.to_json() for name, statistics in self.statistics.items()}
        (meta / "stats.json").write_text(json.dumps(stats, indent=1) + "\n", encoding="utf-8")
        # The format has no place for them.
        if self.held:
            (meta / "held_joints.json").write_text(json.dumps(self.held, indent=1) + "\n", encoding="utf-8")
        # Last: a folder with this file is whole.
        (meta / "info.json").write_text(json.dumps(info, indent=1) + "\n", encoding="utf-8")


def _features(frames: Frames, named: dict[str, Array]) -> dict[str, Any]:
    names = frames.names()
    of_feature = {
        "observation.state": names["state"],
        "observation.contacts": names["contacts"],
        "observation.contact_forces": names["forces"],
        "observation.goal_pose": names["goal"],
        "action": names["action"],
    }
    features: dict[str, Any] = {
        name: {"dtype": "float32", "shape": [values.shape[1]], "names": of_feature[name]} for name, values in named.items()
    }
    features["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    for name in ("frame_index", "episode_index", "index", "task_index"):
        features[name] = {"dtype": "int64", "shape": [1], "names": None}
    return features


def _tasks_table(tasks: dict[str, int]) -> Any:
    """A table that pandas reads with the words as its index."""
    index = "__index_level_0__"
    text = {"field_name": index, "name": None, "pandas_type": "unicode", "numpy_type": "object", "metadata": None}
    number = {"field_name": "task_index", "name": "task_index", "pandas_type": "int64", "numpy_type": "int64", "metadata": None}
    about = {"index_columns": [index], "column_indexes": [], "columns": [number, text], "pandas_version": "2.0.0"}
    fields = [pa.field("task_index", pa.int64()), pa.field(index, pa.string())]
    schema = pa.schema(fields, metadata={b"pandas": json.dumps(about).encode()})
    return pa.table([pa.array(list(tasks.values()), pa.int64()), pa.array(list(tasks), pa.string())], schema=schema)


def export_lerobot(episodes: Iterable[Episode], folder: StrPath, *, fps: int = 30) -> int:
    """Writes a LeRobot data set to a folder that must not hold one yet; returns the number of episodes.

    Raises `InputError`: a data set is there (D127), hands differ (D126).
    """
    place = Path(os.fspath(folder))
    if (place / "data").exists() or (place / "meta").exists():
        raise fault("D127", str(place), "holds a data set already", fix="name another folder with -o, or remove this one")
    writer = _Writer(place, fps)
    for frames in all_frames(episodes, fps):
        writer.add(frames)
    writer.finish()
    return writer.n_episodes
