"""Every example runs, and has a twin in Rust under the same number."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import REPOSITORY

EXAMPLES = sorted((REPOSITORY / "examples/python").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_runs(path: Path, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, path], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout and not done.stderr
    assert list(tmp_path.iterdir()) == [], "examples leave nothing behind"


def test_there_are_twins() -> None:
    assert len(EXAMPLES) >= 5
    rust = sorted((REPOSITORY / "crates/regrasp/examples").glob("*.rs"))
    assert [path.stem for path in EXAMPLES] == [path.stem for path in rust]
