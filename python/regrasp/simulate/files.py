"""Plans and their models from files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .._arguments import StrPath
from .reference import Plan, PlanError


def load(
    path: StrPath,
    *,
    scene: StrPath | None = None,
    packages: Mapping[str, StrPath] | None = None,
    mjcf: StrPath | None = None,
) -> tuple[Plan, str]:
    """The plan in ``path`` and its MuJoCo model: from ``mjcf``, else made from the scene that the plan names.

    Raises ``PlanError`` or ``OSError``.
    """
    try:
        plan: Any = json.loads(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise PlanError(f"{path}: not JSON ({error})") from None
    if not _is_plan(plan):
        raise PlanError(f"{path}: not a plan of format version 2")
    if mjcf is not None:
        return plan, Path(mjcf).read_text(encoding="utf-8")
    import regrasp

    try:
        return plan, regrasp.export_mjcf(path, scene=scene, packages=packages)
    except regrasp.RegraspError as error:
        raise PlanError(str(error)) from None


def _is_plan(content: Any) -> bool:
    return isinstance(content, dict) and (content.get("format"), content.get("format_version")) == ("regrasp-plan", 2)  # pyright: ignore[reportUnknownMemberType]
