"""What is in a data set: shares, times, margins, durations, relocations; as a table and as a page."""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import base64
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from .. import _regrasp
from .._arguments import StrPath
from .._errors import InputError
from .folder import about_of, read_manifest, rows_of, shards_in
from .._robot_plan import RobotPlan
from .reading import Episode, read_episodes

#: Columns that `summary` reads.
COLUMNS = [
    "task", "outcome", "solved", "message", "work", "duration", "relocations", "margin", "clearance", "n_waypoints", "goal_angle",
    "replay_kept", "replay_controller", "digits",
]  # fmt: skip
NUMBERS = {
    "duration": "duration [s]",
    "relocations": "relocations",
    "n_waypoints": "waypoints",
    "margin": "closure margin",
    "clearance": "clearance [mm]",
    "goal_angle": "turn [deg]",
    "work": "work",
}
FACTORS = {"clearance": 1e3, "goal_angle": 180.0 / np.pi}


@dataclass
class TaskSummary:
    """One task of a data set."""

    name: str
    words: str
    asked: int
    """Episodes that the specification asks for."""
    episodes: int = 0
    solved: int = 0
    outcomes: dict[str, int] = field(default_factory=dict[str, int])
    """How many episodes ended how."""
    replayed: int = 0
    kept: int = 0
    numbers: dict[str, list[float]] = field(default_factory=dict[str, list[float]])
    """Of the solved episodes, by column."""

    def add(self, row: dict[str, Any]) -> None:
        """Counts a row in."""
        self.episodes += 1
        self.solved += row["solved"]
        self.outcomes[row["outcome"]] = self.outcomes.get(row["outcome"], 0) + 1
        self.replayed += row["replay_controller"] is not None
        self.kept += bool(row["replay_kept"])
        if row["solved"]:
            for name in NUMBERS:
                if row[name] is not None:
                    self.numbers.setdefault(name, []).append(row[name] * FACTORS.get(name, 1.0))


@dataclass
class Summary:
    """A data set."""

    name: str
    hash: str
    tool: str
    shards: int
    bytes: int
    """Of all shards."""
    damaged: int
    """Shards that cannot be read."""
    seconds: float
    """Processor time of the blocks, by the log."""
    logged: int
    """Episodes in the log."""
    tasks: tuple[TaskSummary, ...]

    @property
    def episodes(self) -> int:
        """Rows of all tasks."""
        return sum(task.episodes for task in self.tasks)


def summary(folder: StrPath) -> Summary:
    """Reads a data set. Raises `InputError` where `folder` holds none (D123)."""
    place = Path(os.fspath(folder))
    manifest, paths = read_manifest(place), shards_in(place)
    tasks = {task["name"]: TaskSummary(task["name"], task["words"], task["episodes"]) for task in manifest["tasks"]}
    size, damaged, count = 0, 0, 0
    for path in paths:
        try:
            name = about_of(path)["task"]
            rows = list(rows_of(path, COLUMNS))
        except (ValueError, InputError):
            damaged += 1
            continue
        if name not in tasks:
            continue
        count += 1
        size += path.stat().st_size
        for row in rows:
            tasks[name].add(row)
    seconds, logged = _log(place)
    return Summary(
        manifest["name"], manifest["hash"], manifest["tool"], count, size, damaged, seconds, logged, tuple(tasks.values())
    )


def _log(place: Path) -> tuple[float, int]:
    try:
        lines = (place / "log.jsonl").read_text(encoding="utf-8").splitlines()
    except OSError:
        return 0.0, 0
    entries: list[dict[str, Any]] = []
    for line in lines:
        try:
            entries.append(json.loads(line))
        except ValueError:
            # The run was cut off while it wrote.
            continue
    return sum(entry["seconds"] for entry in entries), sum(entry["episodes"] for entry in entries)


def markdown(found: Summary) -> str:
    """Tables in Markdown."""
    size = found.bytes / max(found.episodes, 1)
    lines = [
        f"# Data set {found.name}",
        "",
        f"{found.episodes:,} episodes in {found.shards:,} shards, {found.bytes / 1e6:.1f} MB, {size / 1e3:.2f} kB an episode. "
        f"Made by {found.tool}; specification {found.hash[:16]}.",
    ]
    if found.damaged:
        lines.append(f"{found.damaged} shards cannot be read: `make` makes them again.")
    if found.logged:
        lines.append(f"Processor time: {1e3 * found.seconds / found.logged:.1f} ms an episode.")
    lines += ["", *_table(["task", "episodes", "asked", "solved", "replayed", "kept"], list(_shares(found)))]
    lines += ["", *_table(["task", "outcome", "episodes", "share"], list(_outcomes(found)))]
    lines += ["", *_table(["task", "of solved episodes", "least", "10 %", "median", "90 %", "largest"], list(_numbers(found)))]
    return "\n".join(lines) + "\n"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (heads, ["---"] * len(heads), *rows)]


def _share(part: int, whole: int) -> str:
    return f"{part:,} ({100 * part / whole:.1f} %)" if whole else "-"


def _shares(found: Summary) -> Iterator[list[str]]:
    for task in found.tasks:
        solved, kept = _share(task.solved, task.episodes), _share(task.kept, task.replayed)
        yield [task.name, f"{task.episodes:,}", f"{task.asked:,}", solved, f"{task.replayed:,}", kept]


def _outcomes(found: Summary) -> Iterator[list[str]]:
    for task in found.tasks:
        for outcome, count in sorted(task.outcomes.items(), key=lambda item: -item[1]):
            yield [task.name, outcome, f"{count:,}", f"{100 * count / task.episodes:.1f} %"]


def _numbers(found: Summary) -> Iterator[list[str]]:
    for task in found.tasks:
        for name, title in NUMBERS.items():
            values = task.numbers.get(name)
            if values:
                low, tenth, median, ninth, high = np.quantile(values, [0, 0.1, 0.5, 0.9, 1])
                yield [task.name, title, *(f"{value:.4g}" for value in (low, tenth, median, ninth, high))]


def page(folder: StrPath, found: Summary, *, pictures: int = 3) -> str:
    """One HTML file: the tables, histograms, and storyboards of the first solved episodes of every task."""
    parts = [f"<h1>Data set {escape(found.name)}</h1>"]
    for block in markdown(found).split("\n\n")[1:]:
        parts.append(_html_table(block) if block.startswith("|") else f"<p>{escape(block)}</p>")
    for task in found.tasks:
        parts.append(f"<h2>{escape(task.name)}</h2><p>{escape(task.words)}</p>")
        bars = [_histogram(title, task.numbers[name]) for name, title in NUMBERS.items() if task.numbers.get(name)]
        parts.append(f'<div class="bars">{"".join(bars)}</div>')
        for episode, _ in zip(read_episodes(folder, task=task.name), range(pictures)):
            parts.append(_picture(episode))
    style = (
        "body{font:15px sans-serif;max-width:1100px;margin:2em auto;padding:0 1em}table{border-collapse:collapse;margin:1em 0}"
        "td,th{border:1px solid #ccc;padding:.2em .6em;text-align:right}td:first-child,th{text-align:left}"
        ".bars{display:flex;flex-wrap:wrap;gap:1em}img{width:100%}figure{margin:1em 0}"
    )
    title = f"<title>Data set {escape(found.name)}</title>"
    return f'<!doctype html><meta charset="utf-8">{title}<style>{style}</style>{"".join(parts)}\n'


def _html_table(block: str) -> str:
    rows = [[escape(cell.strip()) for cell in line.strip("| \n").split("|")] for line in block.splitlines() if line]
    head = "".join(f"<th>{cell}</th>" for cell in rows[0])
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows[2:])
    return f"<table><tr>{head}</tr>{body}</table>"


def _histogram(title: str, values: Sequence[float]) -> str:
    """As SVG: 24 bars."""
    counts, edges = np.histogram(values, bins=24)
    top = max(int(counts.max()), 1)
    bars = "".join(
        f'<rect x="{10 * k}" y="{80 - 75 * count / top:.1f}" width="9" height="{75 * count / top:.1f}" fill="#4477aa"/>'
        for k, count in enumerate(counts.tolist())
    )
    text = f'<text x="0" y="95" font-size="11">{edges[0]:.3g}</text><text x="240" y="95" font-size="11" text-anchor="end">{edges[-1]:.3g}</text>'
    return f'<figure><figcaption>{escape(title)}</figcaption><svg width="250" height="100" role="img">{bars}{text}</svg></figure>'


def _picture(episode: Episode) -> str:
    row = episode.row
    caption = f"{row['task']}, episode {row['episode']}: {np.degrees(row['goal_angle']):.0f} degrees in {row['duration']:.1f} s"
    plan = episode.plan()
    if isinstance(plan, RobotPlan):
        kinds = ", ".join(segment.kind for segment in plan.segments)
        return f"<p>{escape(caption)}: {escape(kinds)}</p>"
    try:
        picture = _regrasp.storyboard(plan._native, episode.scene()._native, 6, 1200)
    except InputError as error:
        return f"<p>{escape(caption)}: no picture ({escape(str(error))})</p>"
    data = base64.b64encode(picture).decode()
    return f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{data}"><figcaption>{escape(caption)}</figcaption></figure>'
