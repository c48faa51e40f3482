"""Pages: `regrasp.view`, and plans in notebooks."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

import pytest
import regrasp
from conftest import SCENES


def story(page: str) -> dict[str, Any]:
    """What a page was told."""
    found = re.search(r'<script type="application/json" id="story">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found.group(1))


def test_a_page_has_the_plan_and_the_verdict(plan: regrasp.Plan, tmp_path: Path) -> None:
    path = tmp_path / "plan.html"
    page = regrasp.view(plan, path, title="<i>x</i>")
    assert path.read_text(encoding="utf-8") == page
    told = story(page)
    assert told["plan"] == json.loads(plan.to_json())
    assert told["title"] == "<i>x</i>" and "<i>" not in page.split("<body>")[0]
    assert told["judged"]["accepted"] and len(told["judged"]["margin"]) == plan.n_waypoints
    assert regrasp.view(plan, title="<i>x</i>") == page


def test_a_plan_file_finds_its_scene_as_check_does(plan: regrasp.Plan, tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    plan.save(path)
    named = regrasp.view(path, scene=SCENES / "box_90x.toml")
    assert story(named)["title"] == "box_90x"
    with pytest.raises(regrasp.InputError):
        regrasp.view(tmp_path / "missing.json")


def test_the_command_line_writes_the_same_page(plan: regrasp.Plan, tmp_path: Path, regrasp_cli: Any) -> None:
    plan.save(tmp_path / "plan.json")
    run = regrasp_cli("view", "plan.json", SCENES / "box_90x.toml", "-o", "plan.html")
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "plan.html").read_text(encoding="utf-8") == regrasp.view(plan, scene=SCENES / "box_90x.toml")


def test_a_notebook_shows_the_page_in_a_frame(plan: regrasp.Plan) -> None:
    shown = plan._repr_html_()
    found = re.search(r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts"', shown)
    assert found
    assert html.unescape(found.group(1)) == regrasp.view(plan)
    # Outside of the attribute there is nothing of the page.
    assert "<script" not in shown


def test_without_its_scene_a_plan_is_a_table(plan: regrasp.Plan) -> None:
    alone = regrasp.Plan.from_json(plan.to_json())
    assert "<table>" in alone._repr_html_() and "<iframe" not in alone._repr_html_()
