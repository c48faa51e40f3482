"""Plan files as replays read them: one hand that moves one object."""

from __future__ import annotations

from typing import Any

from .reference import Plan, PlanError

#: Versions of the plan format that can be replayed.
VERSIONS = (2, 3)


def flat(content: Any, source: str = "plan") -> Plan:
    """The plan in the content of a plan file of version 2 or 3 (docs/reference/plan-format.md).

    The result names ``hand``, ``object``, ``joint_names`` and ``fingers``. Every waypoint has one ``world_from_object``, and one
    entry of ``contacts`` per finger. What this function returned before stays as it is. Raises ``PlanError``.
    """
    if not isinstance(content, dict):
        raise PlanError(f"{source}: is no plan")
    plan: Plan = content  # pyright: ignore[reportUnknownVariableType]
    if plan.get("format") != "regrasp-plan" or plan.get("format_version") not in VERSIONS:
        raise PlanError(f"{source}: is no plan of format version {' or '.join(map(str, VERSIONS))}")
    if "joint_names" in plan:
        return plan
    hands, objects = plan["hands"], plan["objects"]
    if len(hands) != 1 or len(objects) != 1:
        raise PlanError(f"{source}: moves {len(hands)} hands and {len(objects)} objects; replays take one of each")
    fingers: list[str] = hands[0]["fingers"]
    return {
        **{key: value for key, value in plan.items() if key not in ("hands", "objects")},
        "hand": hands[0]["name"],
        "object": objects[0],
        "joint_names": hands[0]["joint_names"],
        "fingers": fingers,
        "segments": [_segment(segment, fingers) for segment in plan["segments"]],
    }


def _segment(segment: dict[str, Any], fingers: list[str]) -> dict[str, Any]:
    moving: list[str] = segment.get("moving") or []
    kept = {key: value for key, value in segment.items() if key != "moving"}
    if moving:
        kept["moving_finger"] = moving[0]
    if moving[1:]:
        kept["also_moving"] = moving[1:]
    return {**kept, "waypoints": [_waypoint(waypoint, fingers) for waypoint in segment["waypoints"]]}


def _waypoint(waypoint: dict[str, Any], fingers: list[str]) -> dict[str, Any]:
    touching = {contact["finger"]: contact for contact in waypoint["contacts"]}
    kept = {key: value for key, value in waypoint.items() if key != "world_from_objects"}
    return {
        **kept,
        "world_from_object": waypoint["world_from_objects"][0],
        "contacts": [touching.get(finger, {"mode": "free"}) for finger in fingers],
    }
