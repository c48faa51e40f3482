"""Hands of MuJoCo (MJCF) as URDF, meshes and hand file.

    from regrasp.from_mjcf import convert
    made = convert("right_hand.xml", "right_hand")
    print(made.hand_file, *made.notes, sep="\\n")

``python -m regrasp.from_mjcf right_hand.xml -o right_hand`` does the same; ``docs/how-to/mjcf.md`` says what is kept. Needs the extra
``sim``: ``pip install "regrasp[sim]"``.
"""

# One package, in parts: what is private to it is not private to a part.
# pyright: reportPrivateUsage=false

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from .. import _regrasp
from .._arguments import StrPath, load_options
from .._errors import InputError
from ._source import MjcfError

__all__ = ["Conversion", "MjcfError", "convert"]


@dataclass(frozen=True)
class Conversion:
    """What was written."""

    urdf: Path
    hand_file: Path | None
    """None where the URDF is not a hand as it stands; `problem` says why."""
    problem: InputError | None
    notes: tuple[str, ...]
    """What was decided, and what to look at."""
    left_out: dict[str, tuple[str, ...]]
    """What is in the model and not in the URDF: names by kind."""


def convert(
    path: StrPath,
    folder: StrPath,
    *,
    root: str | None = None,
    lenient: bool = False,
    couple: Mapping[str, tuple[str, float]] | None = None,
    velocity: float | None = None,
) -> Conversion:
    """Writes `hand.urdf`, `meshes/*.stl` and `hand.toml` into `folder`, which is made.

    root: the body that becomes the root link; "world" for the world. Without it the only body of the world with joints.
    lenient: what a URDF cannot hold (ball joints, loops, couplings of higher order) is held or left out, with a note.
    couple: joints that follow others, beside those of the model: follower to leader and multiplier.
    velocity: highest speed of all joints, in rad/s or m/s; models of MuJoCo have none.

    Raises `MjcfError`, and `ImportError` without the `mujoco` package.
    """
    try:
        from ._read import read
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise ImportError("reading MJCF needs MuJoCo: pip install 'regrasp[sim]'", name="mujoco") from error
    from ._urdf import MARK, mesh_files, stl, urdf_text

    source = read(Path(path), root=root, lenient=lenient, couple=couple)
    folder = Path(folder)
    urdf, hand_file = folder / "hand.urdf", folder / "hand.toml"
    _refuse_foreign(folder, urdf, MARK)
    (folder / "meshes").mkdir(parents=True, exist_ok=True)
    files = mesh_files(source)
    for name, mesh in files.values():
        _write(folder / name, stl(mesh))
    _write(urdf, urdf_text(source, {key: name for key, (name, _) in files.items()}, velocity).encode())
    notes = list(source.notes)
    problem = None
    try:
        text, remarks = _regrasp.hand_file(
            os.fspath(urdf), load_options("from_mjcf", None, False), urdf.name, source.allow
        )
        _write(hand_file, text.encode())
        # That fingers were guessed is what this is for.
        notes += [remark for remark in remarks if "were guessed" not in remark]
    except InputError as error:
        problem = error
    left_out = {kind: tuple(names) for kind, names in source.left_out.items()}
    return Conversion(urdf, None if problem else hand_file, problem, tuple(notes), left_out)


def _refuse_foreign(folder: Path, urdf: Path, mark: str) -> None:
    """Writes only into folders that are new, empty or of an earlier conversion: models keep meshes of the same names beside them."""
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    is_ours = urdf.is_file() and mark.encode() in urdf.read_bytes()[:400]
    if not is_ours:
        raise MjcfError(f"{folder}: is not empty and not of an earlier conversion; name a new folder")


def _write(path: Path, content: bytes) -> None:
    """All of it or nothing."""
    beside = path.with_name(f".{path.name}.part")
    beside.write_bytes(content)
    os.replace(beside, path)
