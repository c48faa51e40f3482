"""What the tests share: the repository, a scene, a plan, and the command line tool to compare with."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
import regrasp

REPOSITORY = Path(__file__).resolve().parents[2]
SCENES = REPOSITORY / "scenes"


@pytest.fixture(scope="session")
def scene() -> regrasp.Scene:
    """The sphere in the bundled wide hand."""
    return regrasp.load_scene(SCENES / "sphere_90x.toml")


@pytest.fixture(scope="session")
def box() -> regrasp.Scene:
    """The box in the bundled wide hand."""
    return regrasp.load_scene(SCENES / "box_90x.toml")


@pytest.fixture(scope="session")
def plan(box: regrasp.Scene) -> regrasp.Plan:
    """A plan with relocations."""
    found = regrasp.plan(box, seed=7)
    assert isinstance(found, regrasp.Plan), str(found)
    return found


@pytest.fixture
def regrasp_cli(tmp_path: Path):
    """Runs the command line tool, which `REGRASP_CLI` names, in `tmp_path`."""
    tool = os.environ.get("REGRASP_CLI")
    if not tool:
        pytest.skip("REGRASP_CLI names no command line tool to compare with")

    def run(*arguments: str | os.PathLike[str]) -> subprocess.CompletedProcess[str]:
        return subprocess.run([tool, *map(os.fspath, arguments)], cwd=tmp_path, capture_output=True, text=True, timeout=300)

    return run
