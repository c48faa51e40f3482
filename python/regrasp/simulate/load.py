"""Plans and their models from files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from .reference import Plan, PlanError


def load(
    path: Path,
    *,
    scene: Path | None = None,
    packages: Mapping[str, Path] | None = None,
    mjcf: Path | None = None,
) -> tuple[Plan, str]:
    """The plan in ``path`` and its MuJoCo model: from ``mjcf``, else made from the scene that the plan names.

    Raises ``PlanError`` or ``OSError``.
    """
    try:
        plan: Plan = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise PlanError(f"{path}: not JSON ({error})") from None
    if not isinstance(plan, dict) or plan.get("format") != "regrasp-plan" or plan.get("format_version") != 2:
        raise PlanError(f"{path}: not a plan of format version 2")
    if mjcf is not None:
        return plan, mjcf.read_text(encoding="utf-8")
    import regrasp

    try:
        return plan, regrasp.export_mjcf(path, scene=scene, packages=packages)
    except regrasp.RegraspError as error:
        raise PlanError(str(error)) from None
