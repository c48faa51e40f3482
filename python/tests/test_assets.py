"""Files of the repository that scripts write are what the scripts write."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

ASSETS = Path(__file__).resolve().parents[2] / "assets"


@pytest.mark.parametrize("script", ["robots/upper_body/make.py", "objects/make_horse.py"])
def test_written_assets_are_up_to_date(script: str):
    written = runpy.run_path(str(ASSETS / script))["files"]()
    assert written
    for name, text in written.items():
        assert ((ASSETS / script).parent / name).read_text() == text, name
