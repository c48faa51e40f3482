"""Merges data sets: shards of several folders into one, each episode once."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._arguments import StrPath
from .folder import about_of, read_manifest, shards_in, write_whole
from .tables import fault


@dataclass
class Merged:
    """What `merge` did."""

    shards: int = 0
    """Shards copied."""
    known: int = 0
    """Shards that were there already, or came twice."""


def merge(folders: Sequence[StrPath], output: StrPath, *, say: Callable[[str], object] = lambda _: None) -> Merged:
    """Copies the shards of data sets into one folder: parts of one specification, or other tasks.

    Two parts may hold the same shard; it is kept once. Raises `InputError` where tasks of one name differ (D120), or shards hold
    the same episodes but not the same bytes (D125).
    """
    out, parts = Path(os.fspath(output)), [Path(os.fspath(folder)) for folder in folders]
    manifests = [read_manifest(part) for part in parts]
    if (out / "dataset.json").exists() and out not in parts:
        parts.insert(0, out)
        manifests.insert(0, read_manifest(out))
    manifest = _together(manifests, parts)
    merged = Merged()
    owners: dict[tuple[str, int], Path] = {}
    for part in parts:
        for path in shards_in(part):
            _copy_shard(part, path, out, owners, merged, say)
        for path in sorted((part / "files").glob("*")):
            if not (out / "files" / path.name).exists():
                write_whole(out / "files" / path.name, path.read_bytes())
    write_whole(out / "dataset.json", (json.dumps(manifest, indent=1, sort_keys=True) + "\n").encode())
    first = parts[0] / "dataset.toml"
    if first.exists() and not (out / "dataset.toml").exists():
        shutil.copyfile(first, out / "dataset.toml")
    return merged


def _copy_shard(
    part: Path, path: Path, out: Path, owners: dict[tuple[str, int], Path], merged: Merged, say: Callable[[str], object]
) -> None:
    try:
        about = about_of(path)
    except ValueError as error:
        say(f"D121 {path}: {error}; it is left out")
        return
    at, target = (about["task"], about["first"]), out / path.relative_to(part)
    if at in owners and owners[at].name != target.name:
        problem = f"holds the same episodes as {owners[at].name}, but other rows or another number of them"
        raise fault("D125", str(path), problem, fix="make both with one version of regrasp, or leave one out")
    owners[at] = target
    if target.exists():
        if target.read_bytes() != path.read_bytes():
            raise fault("D125", str(path), f"has the name of {target}, but other bytes", fix="`verify` says which is damaged")
        merged.known += 1
        return
    write_whole(target, path.read_bytes())
    merged.shards += 1


def _together(manifests: list[dict[str, Any]], parts: list[Path]) -> dict[str, Any]:
    tasks: dict[str, dict[str, Any]] = {}
    for manifest, part in zip(manifests, parts):
        for task in manifest["tasks"]:
            known = tasks.setdefault(task["name"], task)
            if known["hash"] != task["hash"]:
                problem = f"has a task {task['name']!r} that differs from that of another part"
                raise fault("D120", str(part / "dataset.json"), problem, fix="give it another name in its specification")
            if task["episodes"] > known["episodes"]:
                tasks[task["name"]] = task
    return {**manifests[0], "tasks": list(tasks.values())}
