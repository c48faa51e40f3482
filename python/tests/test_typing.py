"""The stub of the native module matches it, and examples are clean under pyright's strict mode."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
import regrasp
from conftest import REPOSITORY

PACKAGE = Path(regrasp.__file__).parent


def run(folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", *command], cwd=folder, capture_output=True, text=True, timeout=600)


def test_the_package_is_marked_as_typed() -> None:
    assert (PACKAGE / "py.typed").is_file() and (PACKAGE / "_regrasp.pyi").is_file()


def test_the_stub_matches_the_module(tmp_path: Path) -> None:
    if importlib.util.find_spec("mypy") is None:
        pytest.skip("mypy is not installed")
    done = run(tmp_path, "mypy.stubtest", "regrasp._regrasp", "--concise")
    assert done.returncode == 0, done.stdout + done.stderr


def test_package_and_examples_are_clean_under_pyright() -> None:
    if importlib.util.find_spec("pyright") is None:
        pytest.skip("pyright is not installed")
    if run(REPOSITORY, "pyright", "--version").returncode != 0:
        pytest.skip("pyright cannot get what it needs (node, or the package pyright of npm)")
    done = run(REPOSITORY, "pyright", "--pythonpath", sys.executable)
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_public_is_exported_and_documented() -> None:
    assert regrasp.__all__ == sorted(regrasp.__all__, key=str)
    for name in regrasp.__all__:
        value = getattr(regrasp, name)
        if callable(value):
            assert value.__doc__ and not value.__doc__.startswith(f"{name}("), f"{name} has no docstring"


def test_options_are_keyword_only() -> None:
    import inspect

    for function, positional in [(regrasp.plan, 1), (regrasp.check, 2), (regrasp.load_scene, 1), (regrasp.load_hand, 1)]:
        kinds = [parameter.kind for parameter in inspect.signature(function).parameters.values()]
        assert kinds.count(inspect.Parameter.POSITIONAL_OR_KEYWORD) == positional, function
