"""Episodes of a data set, read one after the other."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._arguments import StrPath
from .._model import Scene
from .._plan import Plan
from .._robot_plan import RobotPlan
from .episodes import plan_of
from .folder import about_of, read_manifest, rows_of, scene_in, shards_in


@dataclass(frozen=True)
class Episode:
    """A row of a data set."""

    row: dict[str, Any]
    """All columns (docs/reference/dataset-format.md); lists are arrays of numpy, flat."""
    words: str
    """What was asked, in words."""
    base: Scene
    """The scene before anything varied."""

    @property
    def solved(self) -> bool:
        """True when there is a plan."""
        return self.row["solved"]

    def scene(self) -> Scene:
        """The scene of the episode. Raises `InputError` where the values that were drawn make none."""
        values = json.loads(self.row["values"])
        return self.base.with_keys(values) if values else self.base

    def plan(self) -> Plan | RobotPlan:
        """The plan of a solved episode: of a whole robot where the task is pick and place."""
        return plan_of(self.row)


def read_episodes(folder: StrPath, *, task: str | None = None, solved: bool = True, kept: bool = False) -> Iterator[Episode]:
    """The episodes of a data set, in order, shard by shard.

    task: of this task alone. solved: those with a plan alone. kept: those alone that the replay kept.

    Raises `InputError`: no data set (D123), a damaged shard (D121).
    """
    place = Path(os.fspath(folder))
    scenes: dict[str, tuple[Scene, str]] = {}
    known = {entry["name"]: entry for entry in read_manifest(place)["tasks"]}
    for path in shards_in(place):
        try:
            name = about_of(path)["task"]
        except ValueError:
            # Of no part of the data set; `verify` says so.
            continue
        if name not in known or (task is not None and name != task):
            continue
        if name not in scenes:
            scenes[name] = scene_in(place, known[name]), known[name]["words"]
        base, words = scenes[name]
        for row in rows_of(path):
            if (row["solved"] or not solved) and (row["replay_kept"] or not kept):
                yield Episode(row, words, base)
