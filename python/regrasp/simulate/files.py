"""Plans and their models from files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from .._arguments import StrPath
from .plans import flat
from .reference import Plan, PlanError


def load_robot(
    path: StrPath,
    *,
    scene: StrPath | None = None,
    packages: Mapping[str, StrPath] | None = None,
    lenient: bool = False,
    mjcf: StrPath | None = None,
) -> tuple[dict[str, Any], str] | None:
    """The plan of a whole robot in ``path`` and its MuJoCo model; none for plans of another kind.

    Raises ``PlanError`` or ``OSError``.
    """
    try:
        content: Any = json.loads(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise PlanError(f"{path}: not JSON ({error})") from None
    if not isinstance(content, dict):
        return None
    plan_file = cast("dict[str, Any]", content)
    if plan_file.get("task") not in ("motion", "pick_and_place"):
        return None
    if mjcf is not None:
        return plan_file, Path(mjcf).read_text(encoding="utf-8")
    import regrasp

    try:
        plan = regrasp.RobotPlan.from_file(path)
        return plan_file, plan.to_mjcf(plan.load_scene(scene, packages=packages, lenient=lenient))
    except regrasp.RegraspError as error:
        raise PlanError(str(error)) from None


def load(
    path: StrPath,
    *,
    scene: StrPath | None = None,
    packages: Mapping[str, StrPath] | None = None,
    lenient: bool = False,
    mjcf: StrPath | None = None,
) -> tuple[Plan, str]:
    """The plan in ``path``, as ``flat`` gives it, and its MuJoCo model: from ``mjcf``, else made from the scene that the plan names.

    Raises ``PlanError`` or ``OSError``.
    """
    try:
        content: Any = json.loads(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise PlanError(f"{path}: not JSON ({error})") from None
    plan = flat(content, str(path))
    if mjcf is not None:
        return plan, Path(mjcf).read_text(encoding="utf-8")
    import regrasp

    try:
        return plan, regrasp.export_mjcf(path, scene=scene, packages=packages, lenient=lenient)
    except regrasp.RegraspError as error:
        raise PlanError(str(error)) from None
