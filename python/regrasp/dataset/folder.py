"""The folder of a data set: specification, files of the scenes by content, shards.

    dataset.toml      the specification, as it was given
    dataset.json      what it means: hash, tasks, scenes, files
    files/SHA256      every file that the scenes name
    shards/TASK/NNNNN/FIRST-KEY.parquet
    log.jsonl         how long blocks took: no part of the data

Codes: D120 the folder holds another data set, D121 a damaged shard, D122 a foreign shard, D123 no data set, D124 not writable.
"""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from .. import _regrasp
from .._model import Gravity, Scene
from ._arrow import pa, pq
from .blocks import Block
from .draws import canonical
from .schema import METADATA_KEY, SCHEMA
from .specification import Specification, TaskSpec
from .tables import fault

FORMAT = "regrasp-dataset-folder"
FORMAT_VERSION = 1


def write_whole(path: Path, content: bytes) -> None:
    """Writes a file whole or not at all: to a temporary file, which is then renamed. Raises `InputError` (D124)."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(temporary, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        try:
            temporary.unlink(missing_ok=True)
        except OSError:
            pass
        reason = error.strerror or str(error)
        fix = "free some space and run the same command again: what is done stays"
        raise fault("D124", str(path), f"cannot be written: {reason}", fix=fix) from None


def remove_temporary(folder: Path) -> int:
    """Removes what a killed run left behind; returns how many files."""
    left = [path for path in folder.rglob(".*.tmp") if path.is_file()]
    for path in left:
        path.unlink(missing_ok=True)
    return len(left)


def begin(folder: Path, specification: Specification) -> None:
    """Writes all but the shards, or finds it there. Raises `InputError` (D120) where the folder holds another data set."""
    manifest = folder / "dataset.json"
    content = _manifest(specification)
    if manifest.exists():
        there = read_manifest(folder)
        made_of = {task["name"]: (task["hash"], canonical(task["replay"])) for task in there["tasks"]}
        replays = {task.name: task.replay.to_json() if task.replay else None for task in specification.tasks}
        if made_of != {task.name: (task.hash, canonical(replays[task.name])) for task in specification.tasks}:
            fix = "name another folder with -o, or the specification that this one was made from"
            raise fault("D120", str(folder), f"holds the data set {there['name']!r} of another specification", fix=fix)
    for task in specification.tasks:
        for _, _, _, sha256, data in task.scene._native.files():
            path = folder / "files" / sha256
            if not path.exists():
                write_whole(path, data)
    write_whole(folder / "dataset.toml", specification.text.encode())
    write_whole(manifest, content)


def _manifest(specification: Specification) -> bytes:
    fields = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "name": specification.name,
        "hash": specification.hash,
        "tool": f"regrasp {_regrasp.__version__}",
        "block": specification.block,
        "tasks": [_task_fields(task) for task in specification.tasks],
    }
    return (json.dumps(fields, indent=1, sort_keys=True) + "\n").encode()


def _task_fields(task: TaskSpec) -> dict[str, Any]:
    path, _, lenient, gravity = task.scene._source
    folder = os.path.dirname(path)
    files = [
        {"role": role, "name": name, "path": os.path.relpath(where, folder or "."), "sha256": sha256}
        for role, name, where, sha256, _ in task.scene._native.files()
    ]
    return {
        "name": task.name,
        "hash": task.hash,
        "episodes": task.episodes,
        "words": task.words,
        "level": task.level,
        "max_work": task.max_work,
        "seed": task.seed,
        "scene_task": task.scene_task,
        "scene": {
            "file": os.path.basename(path),
            "text": task.scene.to_toml(),
            "lenient": lenient,
            "gravity": gravity,
            "files": files,
        },
        "vary": {name: draw.to_json() for name, draw in task.vary.items()},
        "plan": {name: draw.to_json() for name, draw in task.vary_plan.items()},
        "replay": task.replay.to_json() if task.replay else None,
    }


def read_manifest(folder: Path) -> dict[str, Any]:
    """`dataset.json`. Raises `InputError` (D123)."""
    path = folder / "dataset.json"
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
        if fields["format"] != FORMAT or fields["format_version"] != FORMAT_VERSION:
            raise ValueError(f"is {fields['format']} {fields['format_version']}")
        return fields
    except (OSError, ValueError, KeyError, TypeError) as error:
        problem = f"is no manifest of a data set: {error}"
        raise fault("D123", str(path), problem, fix="name the folder that `make` wrote with -o") from None


def scene_in(folder: Path, task: dict[str, Any]) -> Scene:
    """The scene of a task of the manifest, from the folder alone. Raises `InputError`."""
    fields = task["scene"]
    kept: list[tuple[str, str, bytes]] = []
    for entry in fields["files"]:
        try:
            content = (folder / "files" / entry["sha256"]).read_bytes()
        except OSError as error:
            raise fault("F001", str(folder / "files" / entry["sha256"]), f"cannot be read: {error.strerror}") from None
        kept.append((entry["name"], os.path.normpath(entry["path"]), content))
    gravity = cast("Gravity", fields["gravity"])
    native = _regrasp.Scene.restore(fields["text"].encode(), fields["file"], kept, fields["lenient"], gravity)
    return Scene(native, (fields["file"], {}, fields["lenient"], gravity), on_disk=False)


@dataclass(frozen=True)
class Shard:
    """A shard in a folder."""

    path: Path
    about: dict[str, Any]
    """Its metadata: task, first episode, count, content key."""


def about_of(source: Path | bytes) -> dict[str, Any]:
    """The metadata of a shard. Raises `ValueError` where it is none: truncated, or of another kind."""
    try:
        with open(source, "rb") if isinstance(source, Path) else io.BytesIO(source) as file:
            footer = pq.read_metadata(file)
    except (OSError, pa.ArrowException) as error:
        raise ValueError(f"is no whole Parquet file: {str(error).splitlines()[0]}") from None
    metadata = cast("dict[bytes, bytes]", footer.metadata or {})
    if METADATA_KEY not in metadata:
        raise ValueError("is no shard of regrasp")
    about: dict[str, Any] = json.loads(metadata[METADATA_KEY])
    if footer.num_rows != about["count"]:
        raise ValueError(f"has {footer.num_rows} rows instead of {about['count']}")
    return about


def problem_of(folder: Path, block: Block) -> str | None:
    """Why the shard of a block is not done; empty where it is not there, none where it is done."""
    path = folder / block.path
    if not path.exists():
        return ""
    try:
        about = about_of(path)
    except ValueError as error:
        return str(error)
    return None if about["content_key"] == block.key else "holds other episodes than its name says"


def shards_in(folder: Path) -> list[Path]:
    """All files that may be shards, in order."""
    return sorted((folder / "shards").rglob("*.parquet"))


def rows_of(path: Path, columns: list[str] | None = None) -> Iterator[dict[str, Any]]:
    """The rows of a shard. Raises `InputError` (D121) where it is damaged."""
    try:
        # Its own reader: paths with "=" mean partitions to others.
        with open(path, "rb") as file:
            table = pq.ParquetFile(file, page_checksum_verification=True).read(columns=columns)
    except (OSError, pa.ArrowException) as error:
        problem = f"is damaged: {str(error).splitlines()[0]}"
        raise fault("D121", str(path), problem, fix="run `make` again: the shard is made anew") from None
    names = table.column_names
    for batch in table.to_batches(max_chunksize=64):
        arrays = [_plain(batch.column(k)) for k in range(len(names))]
        for k in range(batch.num_rows):
            yield {name: values[k] for name, values in zip(names, arrays)}


def _plain(column: Any) -> Any:
    """Values of a column; lists as arrays of numpy."""
    if not pa.types.is_list(column.type):
        return column.to_pylist()
    offsets, values = column.offsets.to_numpy(), column.values.to_numpy(zero_copy_only=False)
    valid = column.is_valid().to_pylist()
    return [values[offsets[k] : offsets[k + 1]] if valid[k] else None for k in range(len(column))]


__all__ = ["SCHEMA", "Shard", "about_of", "begin", "problem_of", "read_manifest", "rows_of", "scene_in", "shards_in", "write_whole"]
