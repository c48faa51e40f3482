"""Judges a data set again, from its folder alone: every solved row by the checker, every failure by its key."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from .._arguments import StrPath
from .._errors import InputError, RegraspError
from .._model import Scene
from .draws import key_of, units
from .episodes import judged, plan_of, seed_of_key
from .folder import about_of, read_manifest, rows_of, scene_in, shards_in


@dataclass
class Verdict:
    """What `verify` found."""

    shards: int = 0
    episodes: int = 0
    """Rows seen."""
    judged: int = 0
    """Plans judged again."""
    accepted: int = 0
    problems: list[str] = field(default_factory=list[str])
    """What is wrong: episode or shard, and why."""

    @property
    def ok(self) -> bool:
        """True when nothing is wrong."""
        return not self.problems

    def add(self, other: Verdict) -> None:
        """Counts another one in."""
        self.shards += other.shards
        self.episodes += other.episodes
        self.judged += other.judged
        self.accepted += other.accepted
        self.problems += other.problems


def verify(
    folder: StrPath, *, share: float = 1.0, seed: int = 0, workers: int = 1, say: Callable[[str], object] = lambda _: None
) -> Verdict:
    """Judges a random share of the plans of a data set, all of them where nothing is said.

    seed: of the choice of the plans. Raises `InputError` where `folder` holds no data set.
    """
    place = Path(os.fspath(folder))
    tasks = {task["name"]: task for task in read_manifest(place)["tasks"]}
    verdict, paths = Verdict(), shards_in(place)
    seen: dict[tuple[str, int], Path] = {}
    for path in paths:
        try:
            about = about_of(path)
        except ValueError as error:
            verdict.problems.append(f"D121 {path}: {error}")
            continue
        at = about["task"], about["first"]
        if at in seen:
            verdict.problems.append(f"D122 {path}: holds the same episodes as {seen[at]}")
        seen[at] = path
    good = list(seen.values())
    for done, part in enumerate(_verdicts(place, tasks, good, share, seed, workers), 1):
        verdict.add(part)
        if done % 20 == 0 or done == len(good):
            say(f"{done} of {len(good)} shards, {verdict.accepted:,} of {verdict.judged:,} plans accepted")
    return verdict


def _verdicts(
    place: Path, tasks: dict[str, Any], paths: list[Path], share: float, seed: int, workers: int
) -> Iterator[Verdict]:
    if workers <= 1 or len(paths) < 2:
        scenes: dict[str, Scene] = {}
        for path in paths:
            yield _shard(place, tasks, path, share, seed, scenes)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin, initargs=(place, tasks, share, seed)) as pool:
        yield from pool.map(_shard_of_worker, paths)


_WORKER: dict[str, Any] = {}


def _begin(place: Path, tasks: dict[str, Any], share: float, seed: int) -> None:
    _WORKER.update(place=place, tasks=tasks, share=share, seed=seed, scenes={})


def _shard_of_worker(path: Path) -> Verdict:
    return _shard(_WORKER["place"], _WORKER["tasks"], path, _WORKER["share"], _WORKER["seed"], _WORKER["scenes"])


def _shard(place: Path, tasks: dict[str, Any], path: Path, share: float, seed: int, scenes: dict[str, Scene]) -> Verdict:
    verdict, about = Verdict(shards=1), about_of(path)
    task = tasks.get(about["task"])
    if task is None or task["hash"] != about["task_hash"]:
        verdict.problems.append(f"D122 {path}: belongs to task {about['task']!r} of another specification")
        return verdict
    try:
        scene = scenes.setdefault(about["task"], scene_in(place, task))
        for index, row in enumerate(rows_of(path), about["first"]):
            verdict.episodes += 1
            problem = _problem(row, index, task, scene, verdict, share, seed)
            if problem:
                verdict.problems.append(f"{path}, episode {index}: {problem}")
    except InputError as error:
        verdict.problems.append(str(error))
    return verdict


def _problem(
    row: dict[str, Any], index: int, task: dict[str, Any], scene: Scene, verdict: Verdict, share: float, seed: int
) -> str:
    """What is wrong with a row; empty where nothing is."""
    key = key_of(task["hash"], index)
    if (row["task"], row["episode"], row["key"], row["seed"]) != (task["name"], index, key, seed_of_key(key)):
        return "is not the episode of its number"
    if not row["solved"] or next(units(key, f"verify {seed}")) >= share:
        return ""
    verdict.judged += 1
    try:
        values = json.loads(row["values"])
        plan = plan_of(row)
        seed_of_plan = json.loads(row["plan"])["seed"]
        if seed_of_plan != row["seed"]:
            return f"its plan was made with seed {seed_of_plan}"
        report = judged(plan, scene.with_keys(values) if values else scene, task["level"])
    except (RegraspError, ValueError, KeyError, IndexError) as error:
        return f"its plan cannot be judged: {str(error).splitlines()[0]}"
    verdict.accepted += report.ok
    return "" if report.ok else f"the checker rejects the plan: {report.violations[0]}"
