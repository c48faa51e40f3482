"""Plans as columns, and columns as plans again.

Numbers are rounded to 32 binary digits (`PRECISE`) or 24 (`COARSE`, single precision), in pick and place to 40 (`FINE`); zeros compress
to nothing. The plan that the columns give back is the one that the checker judges, before it is written. Where it rejects the
rounded plan, the columns hold all 53 digits.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Row = dict[str, Any]
Floats = npt.NDArray[np.float64]

#: Binary digits of joints, times, poses, contact points and forces, and of velocities, torques and normals.
PRECISE, COARSE, EXACT = 32, 24, 53
#: In pick and place: a carried object follows a hand at the end of an arm to a nanometre, and its forces balance what accelerates it.
FINE = 40
#: Columns of numbers, and how many binary digits of them are kept.
DIGITS = {
    "time": PRECISE,
    "joints": PRECISE,
    "joint_velocities": COARSE,
    "joint_torques": COARSE,
    "object_pose": PRECISE,
    "contact_points": PRECISE,
    "contact_normals": COARSE,
    "contact_forces": PRECISE,
    "contact_torsions": PRECISE,
    "tip_points": PRECISE,
    "relative_velocities": PRECISE,
    "relative_turns": PRECISE,
}
#: Vectors that a contact may have, by their columns; those that it must have first.
VECTORS = {
    "contact_points": "point_in_object",
    "contact_normals": "normal_in_object",
    "contact_forces": "force_in_object",
    "tip_points": "point_in_tip",
    "relative_velocities": "relative_velocity_in_object",
    "relative_turns": "relative_turn_in_object",
}
_CONTACT_KEYS = {"hand", "finger", "object", "mode", "torsion", *VECTORS.values()}
_WAYPOINT_KEYS = {"time", "joints", "joint_velocities", "joint_torques", "world_from_objects", "contacts"}
MODES = ("free", "fixed", "rolling", "pure_rolling", "twisting", "pure_sliding", "sliding")


class Unpackable(ValueError):
    """A plan that the columns cannot hold."""


def rounded(values: Floats, digits: int) -> Floats:
    """To so many binary digits."""
    if digits >= EXACT:
        return values
    mantissa, exponent = np.frexp(values)
    return np.ldexp(np.rint(np.ldexp(mantissa, digits)), exponent - digits)


def pack(plan: Mapping[str, Any], *, exact: bool = False) -> Row:
    """The columns of the content of a plan file: n waypoints, j joints, f fingers of all hands, in their order; SI units, all in the
    world or the object frame.

    Raises `Unpackable` for plans that move several objects, or say something that no column holds.
    """
    objects = plan["objects"]
    if len(objects) != 1:
        raise Unpackable(f"the plan moves {len(objects)} objects; a row holds one")
    fingers = fingers_of(plan)
    index = {finger: k for k, finger in enumerate(fingers)}
    waypoints = [waypoint for segment in plan["segments"] for waypoint in segment["waypoints"]]
    n, f = len(waypoints), len(fingers)
    vectors = {name: np.full((n, f, 3), np.nan) for name in VECTORS}
    torsions, modes = np.full((n, f), np.nan), np.zeros((n, f), np.int8)
    for k, waypoint in enumerate(waypoints):
        _know(waypoint, _WAYPOINT_KEYS)
        for contact in waypoint.get("contacts", ()):
            _know(contact, _CONTACT_KEYS)
            at = k, index[contact["hand"], contact["finger"]]
            if modes[at] != 0:
                raise Unpackable(f"two contacts of finger {contact['finger']} at waypoint {k}; a row holds one")
            modes[at] = MODES.index(contact["mode"])
            torsions[at] = contact.get("torsion", np.nan)
            for name, key in VECTORS.items():
                vectors[name][at] = contact.get(key, np.nan)
    poses = [each["world_from_objects"][0] for each in waypoints]
    columns: dict[str, Floats] = {
        "time": np.array([each["time"] for each in waypoints], float),
        "joints": np.array([each["joints"] for each in waypoints], float),
        "joint_velocities": np.array([each["joint_velocities"] for each in waypoints], float),
        "object_pose": np.array([[*pose["position"], *pose["quat_xyzw"]] for pose in poses], float),
        "contact_torsions": torsions,
        **vectors,
    }
    if "joint_torques" in waypoints[0]:
        columns["joint_torques"] = np.array([each["joint_torques"] for each in waypoints], float)
    is_of_robot = plan["task"] == "pick_and_place"
    least = EXACT if exact else FINE if is_of_robot else COARSE
    row: Row = {name: rounded(array, max(least, DIGITS[name])).ravel() for name, array in columns.items()}
    for name in ("contact_torsions", *list(VECTORS)[2:]):
        if np.isnan(row[name]).all():
            row[name] = None
    row.setdefault("joint_torques", None)
    row["contact_modes"] = modes.ravel()
    lengths = [len(segment["waypoints"]) for segment in plan["segments"]]
    row["segment"] = np.repeat(np.arange(len(lengths), dtype=np.int16), lengths)
    row["digits"] = max(least, PRECISE)
    row["plan"] = _header(plan)
    return row


def fingers_of(plan: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Hand and name of every finger of a plan, in the order of the columns."""
    return [(hand["name"], finger) for hand in plan["hands"] for finger in hand["fingers"]]


def _know(entry: Mapping[str, Any], keys: set[str]) -> None:
    unknown = entry.keys() - keys
    if unknown:
        raise Unpackable(f"no column holds {', '.join(sorted(unknown))} of the plan")


def _header(plan: Mapping[str, Any]) -> str:
    """The plan file without its waypoints."""
    segments = [{key: value for key, value in segment.items() if key != "waypoints"} for segment in plan["segments"]]
    return json.dumps({**plan, "segments": segments}, separators=(",", ":"))


def unpack(row: Mapping[str, Any]) -> dict[str, Any]:
    """The content of the plan file that a row holds; unit vectors are made of length one again."""
    plan: dict[str, Any] = json.loads(row["plan"])
    name, fingers = plan["objects"][0], fingers_of(plan)
    time = np.asarray(row["time"], float)
    n, f = len(time), len(fingers)
    joints, velocities = _rows(row, "joints", n), _rows(row, "joint_velocities", n)
    torques = _rows(row, "joint_torques", n)
    poses = np.asarray(row["object_pose"], float).reshape(n, 7)
    turns = _unit(poses[:, 3:])
    modes = np.asarray(row["contact_modes"]).reshape(n, f)
    vectors = {name: np.asarray(row[name], float).reshape(n, f, 3) for name in VECTORS if row[name] is not None}
    vectors["contact_normals"] = _unit(vectors["contact_normals"])
    torsions = None if row["contact_torsions"] is None else np.asarray(row["contact_torsions"], float).reshape(n, f)
    waypoints: list[dict[str, Any]] = []
    for k in range(n):
        contacts: list[dict[str, Any]] = []
        for i, (hand, finger) in enumerate(fingers):
            if modes[k, i] == 0:
                continue
            contact: dict[str, Any] = {
                "hand": hand,
                "finger": finger,
                "object": name,
                "mode": MODES[modes[k, i]],
            }
            for column, values in vectors.items():
                if not np.isnan(values[k, i]).any():
                    contact[VECTORS[column]] = values[k, i].tolist()
            if torsions is not None and not np.isnan(torsions[k, i]):
                contact["torsion"] = float(torsions[k, i])
            contacts.append(contact)
        waypoint: dict[str, Any] = {"time": float(time[k]), "joints": joints[k].tolist(), "joint_velocities": velocities[k].tolist()}
        if row["joint_torques"] is not None:
            waypoint["joint_torques"] = torques[k].tolist()
        waypoint["world_from_objects"] = [{"position": poses[k, :3].tolist(), "quat_xyzw": turns[k].tolist()}]
        waypoint["contacts"] = contacts
        waypoints.append(waypoint)
    segment_of = np.asarray(row["segment"])
    for k, segment in enumerate(plan["segments"]):
        start, stop = np.searchsorted(segment_of, [k, k + 1])
        segment["waypoints"] = waypoints[start:stop]
    return plan


def _rows(row: Mapping[str, Any], name: str, n: int) -> Floats:
    """(n, any)."""
    return np.empty((n, 0)) if row[name] is None else np.asarray(row[name], float).reshape(n, -1)


def _unit(vectors: Floats) -> Floats:
    """Of length one; by square roots, which are the same on every machine."""
    squares = vectors * vectors
    total = squares[..., 0]
    for k in range(1, vectors.shape[-1]):
        total = total + squares[..., k]
    return vectors / np.sqrt(total)[..., None]
