"""What a replay says about a plan: kept or dropped, errors, slip, contacts lost and contacts made that were not planned."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._mujoco import MjModel, mujoco
from .model import Rig, Settings
from .reference import Array, Reference, rotation_matrices, waypoints_of
from .replay import Drift, Track, pose_errors

#: The object is lost where its centre of mass is farther from the plan, in metres,
LARGEST_POSITION_ERROR = 0.010
#: where it is turned farther, in radians,
LARGEST_ANGLE_ERROR = np.radians(20.0)
#: or where no fingertip presses on it for longer than so many seconds.
LONGEST_OFF_FINGERS = 0.024

#: A contact that should hold counts as lost when it is away for longer, in seconds.
LOST_AFTER = 0.024


#: A free fingertip that the plan has nearer to the object may touch it: it lifts or lands, and no hand follows exactly. Metres.
NEAR = 0.001


@dataclass(frozen=True)
class LostContact:
    """A contact that should hold and did not touch."""

    segment: int
    finger: str
    time: float
    """When it was lost, in seconds from the start of the plan."""
    duration: float
    """For how long, in seconds."""


@dataclass(frozen=True)
class UnplannedContact:
    """Two geoms that touched though the plan does not let them."""

    geoms: tuple[str, str]
    segment: int
    """Segment under way when they first touched."""
    time: float
    """When, in seconds from the start of the plan."""
    duration: float
    """Sum of the times that they touched, in seconds."""


@dataclass(frozen=True)
class Dropped:
    """Where the object was lost."""

    cause: str
    """``position``, ``angle`` or ``off the fingers``."""

    segment: int
    kind: str
    """``transfer`` or ``regrasp``."""
    time: float
    """When it was, in seconds from the start of the plan."""
    finger: str | None
    """Of the fingers that should hold, the one that lost its contact first in the second before."""
    moving_finger: str | None
    """The finger that the segment moves."""


@dataclass(frozen=True)
class Report:
    """The result of a replay, in metres, radians, seconds and newtons; ``docs/reference/replay.md`` describes the keys."""

    kept: bool
    dropped: Dropped | None
    largest_position_error: float
    largest_angle_error: float
    final_position_error: float
    final_angle_error: float
    largest_slip: float
    """Largest slip of a finger in one segment."""
    slip: list[list[float | None]]
    """For each segment and finger how far it slid over the object; nothing where it never held."""
    lost_contacts: list[LostContact]
    unplanned_contacts: list[UnplannedContact]
    largest_normal_force: float
    largest_torque: float
    """Largest torque fed forward to a joint, in N m."""
    drift: Drift | None
    """Of the static hold before."""
    duration: float
    """Length of the motion replayed, in seconds."""
    settings: Settings
    gravity_in_world: tuple[float, float, float]
    scene: str
    seed: int
    method: str

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return {"format": "regrasp-replay", "format_version": 1, **asdict(self)}


def report(rig: Rig, ref: Reference, track: Track, torques: Array, drift: Drift | None, settings: Settings) -> Report:
    """Measures ``track`` against ``ref``."""
    ticks = np.minimum(np.arange(track.n_ticks), ref.n_ticks - 1)
    seen = np.concatenate((track.object_position, track.object_quat_wxyz), axis=1)
    wanted = np.concatenate((ref.object_position, ref.object_quat_wxyz), axis=1)[ticks]
    position, angle = pose_errors(rig, seen, wanted)
    lost_at = {
        "position": np.flatnonzero(~(position <= LARGEST_POSITION_ERROR)),
        "angle": np.flatnonzero(~(angle <= LARGEST_ANGLE_ERROR)),
        "off the fingers": _off_fingers(ref, track.sensors[:, rig.normal_force]),
    }
    first = {cause: int(ticks_lost[0]) for cause, ticks_lost in lost_at.items() if len(ticks_lost)}
    cause = min(first, key=lambda name: first[name], default="")
    kept = not first
    # What is flung about afterwards says nothing.
    end = track.n_ticks if kept else first[cause] + 1
    forces = track.sensors[:end, rig.normal_force]
    lost = _lost_contacts(rig, ref, ticks[:end], forces)
    slip = _slip(rig, ref, track, ticks[:end], forces)
    plan = rig.plan
    gx, gy, gz = (float(g) for g in rig.model.opt.gravity)
    return Report(
        kept=kept,
        dropped=None if kept else _dropped(rig, ref, ticks, cause, first[cause], forces),
        largest_position_error=float(position[:end].max()),
        largest_angle_error=float(angle[:end].max()),
        final_position_error=float(position[-1]),
        final_angle_error=float(angle[-1]),
        largest_slip=max((s for row in slip for s in row if s is not None), default=0.0),
        slip=slip,
        lost_contacts=lost,
        unplanned_contacts=_unplanned(rig, ref, track, ticks, end),
        largest_normal_force=float(forces.max()),
        largest_torque=float(np.abs(torques).max()),
        drift=drift,
        duration=ref.tick * ref.n_ticks,
        settings=settings,
        gravity_in_world=(gx, gy, gz),
        scene=str(plan["inputs"][0]["name"]),
        seed=int(plan["seed"]),
        method=str(plan["method"]),
    )


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First index and end of each run of true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2])]


def _lost_contacts(rig: Rig, ref: Reference, ticks: NDArray[np.int64], forces: Array) -> list[LostContact]:
    lost: list[LostContact] = []
    for f, finger in enumerate(rig.fingers):
        for first, end in _runs(ref.holds[ticks, f] & (forces[:, f] <= 0.0)):
            if (end - first) * ref.tick > LOST_AFTER:
                segment = int(ref.segment[ticks[first]])
                lost.append(LostContact(segment, finger.name, first * ref.tick, (end - first) * ref.tick))
    return sorted(lost, key=lambda contact: contact.time)


def _off_fingers(ref: Reference, forces: Array) -> NDArray[np.int64]:
    """Ticks at which no fingertip has pressed on the object for too long."""
    longest = round(LONGEST_OFF_FINGERS / ref.tick)
    runs = _runs(np.asarray((forces <= 0.0).all(axis=1), dtype=np.bool_))
    return np.array([first + longest for first, end in runs if end - first > longest], dtype=np.int64)


def _dropped(
    rig: Rig, ref: Reference, ticks: NDArray[np.int64], cause: str, at: int, forces: Array
) -> Dropped:
    segment = int(ref.segment[ticks[at]])
    described = rig.plan["segments"][segment]
    begin = max(0, at - round(1.0 / ref.tick))
    without = ref.holds[ticks[begin : at + 1]] & (forces[begin : at + 1] <= 0.0)
    first = [int(np.argmax(column)) if column.any() else at + 1 for column in without.T]
    finger = int(np.argmin(first))
    return Dropped(
        cause=cause,
        segment=segment,
        kind=described["kind"],
        time=at * ref.tick,
        finger=rig.fingers[finger].name if first[finger] <= at else None,
        moving_finger=described.get("moving_finger"),
    )


def _slip(
    rig: Rig, ref: Reference, track: Track, ticks: NDArray[np.int64], forces: Array
) -> list[list[float | None]]:
    """Sliding of tips over the object that is not planned: the relative velocity at the contact, across the normal, less that of
    the plan, integrated in the object frame; the farthest from where the segment began. Rolling without slipping gives
    zero, and so does sliding in tracking as the plan has it."""
    n = len(ticks)
    turn = rotation_matrices(track.object_quat_wxyz[:n])
    origin = track.object_position[:n]
    object_linear = track.sensors[:n, rig.linear_velocity[-1]]
    object_angular = track.sensors[:n, rig.angular_velocity[-1]]
    contacts = [[point["contacts"][f] for point in waypoints_of(rig.plan)] for f in range(len(rig.fingers))]
    segments = ref.segment[ticks]
    out: list[list[float | None]] = [[None] * len(rig.fingers) for _ in rig.plan["segments"]]
    for f in range(len(rig.fingers)):
        zero = (0.0, 0.0, 0.0)
        point = ref.blend(np.array([contact.get("point_in_object") or zero for contact in contacts[f]]))[ticks]
        normal = ref.blend(np.array([contact.get("normal_in_object") or zero for contact in contacts[f]]))[ticks]
        touches = ref.holds[ticks, f] & (forces[:, f] > 0.0)
        where = origin + np.einsum("kij,kj->ki", turn, point)
        tip_velocity = track.sensors[:n, rig.linear_velocity[f]] + np.cross(
            track.sensors[:n, rig.angular_velocity[f]], where - track.tips[:n, f]
        )
        object_velocity = object_linear + np.cross(object_angular, where - origin)
        relative = np.einsum("kji,kj->ki", turn, tip_velocity - object_velocity)
        length = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        normal = normal / length
        across = relative - np.einsum("ki,ki->k", relative, normal)[:, None] * normal
        across -= planned_sliding(rig, ref, f)[ticks]
        across[~touches] = 0.0
        for s in np.unique(segments[touches]):
            during = segments == s
            path = np.cumsum(across[during], axis=0) * ref.tick
            out[int(s)][f] = float(np.linalg.norm(path, axis=1).max())
    return out


def planned_sliding(rig: Rig, ref: Reference, finger: int) -> Array:
    """Velocity of a fingertip over the object that the plan has at every tick, in the object frame: its mean over a step goes
    with the parameter of the motion."""
    points = waypoints_of(rig.plan)
    still = (0.0, 0.0, 0.0)
    mean = np.array([point["contacts"][finger].get("relative_velocity_in_object") or still for point in points])
    times = np.array([point["time"] for point in points])
    # Between segments everything rests; after the last waypoint nothing is.
    step = np.append(np.diff(times), 0.0)[:, None] * mean
    index = np.repeat(np.arange(len(rig.plan["segments"])), [len(s["waypoints"]) for s in rig.plan["segments"]])
    step[np.append(np.diff(index) > 0, True)] = 0.0
    rate = np.diff(ref.fraction, append=ref.fraction[-1:])
    # Where a tick passes a waypoint, the part on either side counts.
    passes = np.diff(ref.waypoint, append=ref.waypoint[-1:]) > 0
    moved = np.where(passes, 1.0 - ref.fraction, rate)[:, None] * step[ref.waypoint]
    after = np.minimum(np.arange(1, ref.n_ticks + 1), ref.n_ticks - 1)
    moved += np.where(passes, ref.fraction[after], 0.0)[:, None] * step[ref.waypoint[after]]
    return moved / ref.tick


def _unplanned(
    rig: Rig, ref: Reference, track: Track, ticks: NDArray[np.int64], end: int
) -> list[UnplannedContact]:
    # What rests may stand on what rests.
    is_moved = np.isin(track.contact_geoms, list(rig.moved_geoms)).any(axis=1)
    before = (track.contact_ticks < end) & is_moved
    at, geoms = track.contact_ticks[before], np.sort(track.contact_geoms[before], axis=1)
    may_touch = ref.presses | (ref.blend(_tip_gaps(rig)) < NEAR)
    planned = np.zeros(len(at), dtype=bool)
    for f, finger in enumerate(rig.fingers):
        tip = np.isin(geoms, list(finger.touching)).any(axis=1) & np.isin(geoms, list(rig.object_geoms)).any(axis=1)
        planned |= tip & may_touch[ticks[at], f]
    found: list[UnplannedContact] = []
    at, geoms = at[~planned], geoms[~planned]
    for a, b in np.unique(geoms, axis=0).tolist():
        when = np.unique(at[(geoms == (a, b)).all(axis=1)])
        names = (_geom_name(rig.model, a), _geom_name(rig.model, b))
        segment = int(ref.segment[ticks[when[0]]])
        found.append(UnplannedContact(names, segment, float(when[0] * ref.tick), float(len(when) * ref.tick)))
    return sorted(found, key=lambda contact: contact.time)


def _tip_gaps(rig: Rig) -> Array:
    """Planned distance of each fingertip from the object at every waypoint, up to 10 mm. Shape (n_waypoints, n_fingers)."""
    data = mujoco.MjData(rig.model)
    ends = np.empty(6)
    gaps = np.empty((rig.model.nkey, len(rig.fingers)))
    for k in range(rig.model.nkey):
        mujoco.mj_resetDataKeyframe(rig.model, data, k)
        mujoco.mj_kinematics(rig.model, data)
        for f, finger in enumerate(rig.fingers):
            pairs = [(geom, part) for geom in finger.touching for part in rig.object_geoms]
            gaps[k, f] = min(mujoco.mj_geomDistance(rig.model, data, geom, part, 0.01, ends) for geom, part in pairs)
    return gaps


def _geom_name(model: MjModel, geom: int) -> str:
    return str(model.geom(geom).name)
