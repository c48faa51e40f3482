"""Data sets of checked plans, on one machine or on a Ray cluster.

    from regrasp.dataset import make, read_specification, verify
    make(read_specification("datasets/small.toml"), "out/small", workers=2)
    assert verify("out/small").ok

`python -m regrasp.dataset` does the same from the command line. Needs the extra `data`: ``pip install "regrasp[data]"``;
`docs/how-to/datasets.md` goes on from here.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .info import Summary, summary
    from .make import Made, make
    from .merge import Merged, merge
    from .reading import Episode, read_episodes
    from .specification import Replay, Specification, TaskSpec, read_specification, specification_of
    from .verify import Verdict, verify

__all__ = [
    "Episode",
    "Made",
    "Merged",
    "Replay",
    "Specification",
    "Summary",
    "TaskSpec",
    "Verdict",
    "make",
    "merge",
    "read_episodes",
    "read_specification",
    "specification_of",
    "summary",
    "verify",
]

_HOMES = {
    "Episode": "reading",
    "Made": "make",
    "Merged": "merge",
    "Replay": "specification",
    "Specification": "specification",
    "Summary": "info",
    "TaskSpec": "specification",
    "Verdict": "verify",
    "make": "make",
    "merge": "merge",
    "read_episodes": "reading",
    "read_specification": "specification",
    "specification_of": "specification",
    "summary": "info",
    "verify": "verify",
}


def __getattr__(name: str) -> Any:
    # pyarrow is imported where it is needed.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)
