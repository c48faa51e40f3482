"""What planning and checking answer with, beside the plan."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Any, ClassVar, Literal

from ._model import Pose, pose_of


@dataclass(frozen=True)
class Progress:
    """What a running search tells its caller."""

    nodes: int
    """Nodes so far, in this attempt."""
    work: int
    """Configurations looked at so far, in this attempt."""
    restarts: int
    """Index of the attempt."""
    angle_left: float
    """Angle of the nearest pose reached from the goal, in radians."""


@dataclass(frozen=True)
class Cause:
    """One reason for which attempts of the search failed."""

    reason: str
    """In words."""
    count: int
    """How many attempts failed for it."""
    share: float
    """Share of all failed attempts."""


@dataclass(frozen=True, eq=False)
class NearestMiss:
    """The pose nearest to the goal that was reached."""

    world_from_object: Pose
    angle_left: float
    """To the goal, in radians."""
    distance_left: float
    """To the goal, in metres."""
    joints: tuple[float, ...]
    """Joint positions there, in the order of `Hand.joint_names`."""


@dataclass(frozen=True)
class MetBody:
    """A body that meets another one."""

    name: str
    kind: str
    """"link" of the robot, "carried" object, or "resting": a support, an obstacle, another object or robot."""


@dataclass(frozen=True, eq=False)
class WantedHand:
    """A hand that no posture brings to where it should be."""

    hand: str
    world_from_hand: Pose
    """Where its base should be."""
    joints: tuple[float, ...]
    """Finger joints there."""
    wrist_at: tuple[float, float, float]
    """Where the wrist gets, in the world, in metres."""
    wrist_wanted: tuple[float, float, float]
    """Where it should be."""


@dataclass(frozen=True)
class TriedExchange:
    """A place at which hands were to exchange the object."""

    position: tuple[float, float, float]
    """Of the object's centre of mass, in the world, in metres."""
    outcome: str
    """The furthest that any pair of grasps came there: "hands_touch", "out_of_reach", "in_collision" or "no_way"."""


@dataclass(frozen=True, eq=False)
class RobotMiss:
    """The posture of a robot at which a task came nearest to being done, and what is wrong with it."""

    reason: str
    """What failed there."""
    joints: tuple[float, ...]
    """All joints of the robot, in the order of plans."""
    world_from_object: Pose | None
    """The object's pose there; None for motions without an object."""
    bodies: tuple[MetBody, MetBody] | None
    """The two that meet, where it is a collision."""
    overlap: float | None
    """How deep they overlap, in metres; negative where they are apart; None where one of them is not convex."""
    wanted: tuple[WantedHand, ...]
    """Hands that are not where they should be."""
    exchanges: tuple[TriedExchange, ...]
    """Places of the exchange that were tried, the best first."""


def _robot_miss(fields: Mapping[str, Any]) -> RobotMiss:
    meeting = fields["meeting"]
    at = fields["world_from_object"]
    return RobotMiss(
        reason=fields["reason"],
        joints=tuple(fields["joints"]),
        world_from_object=None if at is None else pose_of(at),
        bodies=None if meeting is None else (MetBody(**meeting["bodies"][0]), MetBody(**meeting["bodies"][1])),
        overlap=None if meeting is None else meeting["overlap"],
        wanted=tuple(
            WantedHand(
                hand=entry["hand"],
                world_from_hand=pose_of(entry["world_from_hand"]),
                joints=tuple(entry["joints"]),
                wrist_at=tuple(entry["wrist"][0]),
                wrist_wanted=tuple(entry["wrist"][1]),
            )
            for entry in fields["wanted"]
        ),
        exchanges=tuple(TriedExchange(tuple(entry["position"]), entry["outcome"]) for entry in fields["exchanges"]),
    )


@dataclass(frozen=True)
class Moment:
    """`fraction` of the way from a waypoint to the next one, both of one segment."""

    segment: int
    waypoint: int
    fraction: float


@dataclass(frozen=True)
class Violation:
    """One thing that is wrong with a plan."""

    kind: str
    """docs/reference/plan-format.md lists the kinds; one never changes its meaning."""
    moment: Moment | None
    """When, where it has a moment."""
    subjects: tuple[str, ...]
    """Who: a joint, a finger, a file, or the two things of a pair."""
    message: str
    """In words, with the numbers."""
    amount: float | None
    """How much, in SI units."""
    limit: float | None
    """What would have been allowed."""
    text: str
    """All of it on one line, as the command line prints it."""

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Clearance:
    """The smallest distance at a waypoint between two things that must not touch."""

    distance: float
    """Metres."""
    pair: tuple[str, str]
    moment: Moment


@dataclass(frozen=True)
class Report:
    """What the checker says. True when the plan is accepted."""

    violations: tuple[Violation, ...]
    """What is wrong, at most some of each kind; empty when accepted."""
    n_violations: int
    """How many were found, those not listed included."""
    min_margin: float | None
    """Smallest closure margin of a holding set."""
    min_clearance: Clearance | None
    max_contact_error: float
    """Largest distance of a holding fingertip from its contact, in metres, certified between waypoints."""
    max_slip: float | None
    """Largest slip of a finger that rolls, in a segment, in metres; none when no finger rolls."""
    max_hold_slip: float | None
    """Largest slip of a contact from landing to lifting, in metres; none when no contact moves."""
    level: str
    """What the plan was judged for: "geometry", "forces" or "motion"."""
    reached: str | None
    """The highest level at which nothing is wrong."""
    max_force_residual: float | None
    """Largest imbalance of forces and weight at a waypoint, in newtons; none in plans without forces."""
    max_moment_residual: float | None
    """Largest imbalance of moments, in newton metres; none in plans without forces."""
    duration: float
    """Time that the plan takes, in seconds."""
    n_waypoints: int
    """Waypoints judged."""
    n_distances: int
    """Distances measured."""
    data: Mapping[str, Any] = field(repr=False, compare=False)
    """The whole report, as `regrasp check --json` prints it."""

    @property
    def ok(self) -> bool:
        """True when nothing is wrong."""
        return self.n_violations == 0

    def __bool__(self) -> bool:
        return self.ok

    def __str__(self) -> str:
        head = f"accepted for {self.level}" if self.ok else f"rejected for {self.level}: {self.n_violations} violations"
        return "\n  ".join([head, *(violation.text for violation in self.violations)])


def report_of(fields: Mapping[str, Any]) -> Report:
    """The report that JSON says."""
    clearance = fields["min_clearance"]
    return Report(
        violations=tuple(_violation(entry) for entry in fields["violations"]),
        n_violations=fields["n_violations"],
        min_margin=fields["min_margin"],
        min_clearance=None
        if clearance is None
        else Clearance(
            distance=clearance["distance"],
            pair=(clearance["pair"][0], clearance["pair"][1]),
            moment=Moment(**clearance["at"]),
        ),
        max_contact_error=fields["max_contact_error"],
        max_slip=fields["max_slip"],
        max_hold_slip=None if fields["max_hold_slip"] is None else fields["max_hold_slip"]["slip"],
        level=fields["level"],
        reached=fields["reached"],
        max_force_residual=fields["max_force_residual"],
        max_moment_residual=fields["max_moment_residual"],
        duration=fields["duration"],
        n_waypoints=fields["n_waypoints"],
        n_distances=fields["n_distances"],
        data=fields,
    )


def _violation(fields: Mapping[str, Any]) -> Violation:
    return Violation(
        kind=fields["kind"],
        moment=None if fields["at"] is None else Moment(**fields["at"]),
        subjects=tuple(fields["subjects"]),
        message=fields["message"],
        amount=fields["amount"],
        limit=fields["limit"],
        text=fields["text"],
    )


@dataclass(frozen=True, eq=False)
class Failure:
    """No plan, and why. A result, not an exception; false."""

    kind: str
    """"start_invalid", "goal_invalid", "way_invalid", "settings_invalid", "impossible", "work_spent", "time_limit", or "rejected":
    a plan was found that the checker does not accept."""
    message: str
    """What happened, with names and numbers."""
    advice: str
    """One line; may be empty."""
    causes: tuple[Cause, ...]
    """Why attempts of the search failed, commonest first."""
    leg: int | None
    """Number of the leg that failed, from 1, for queries with way poses."""
    nearest_miss: NearestMiss | None
    """The nearest that the search came, if it got anywhere."""
    robot_miss: RobotMiss | None
    """The same for tasks of whole robots."""
    statistics: Mapping[str, Any]
    """Counts of the search, as in a plan file."""
    report: Report | None
    """What the checker said, for "rejected"."""
    rejected_plan: str | None = field(repr=False)
    """The plan file of a rejected plan, for a report of the bug: it is not a plan."""

    ok: ClassVar[Literal[False]] = False
    """A failure is not a plan."""

    def __bool__(self) -> Literal[False]:
        return False

    def __str__(self) -> str:
        lines = [f"no plan ({self.kind}): {self.message}"]
        lines += [f"  {100 * cause.share:5.1f} %  {cause.reason}" for cause in self.causes[:8]]
        if self.advice:
            lines.append(f"  try: {self.advice}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td>{100 * cause.share:.1f} %</td><td>{escape(cause.reason)}</td></tr>" for cause in self.causes)
        advice = f"<p>try: {escape(self.advice)}</p>" if self.advice else ""
        return f"<b>no plan</b> ({escape(self.kind)}): {escape(self.message)}<table>{rows}</table>{advice}"


def failure_of(text: str) -> Failure:
    """The failure that JSON says."""
    fields: dict[str, Any] = json.loads(text)
    miss = fields["nearest_miss"]
    report = fields.get("report")
    return Failure(
        kind=fields["kind"],
        message=fields["message"],
        advice=fields["advice"],
        causes=tuple(Cause(**entry) for entry in fields["causes"]),
        leg=fields["leg"],
        nearest_miss=None
        if miss is None
        else NearestMiss(
            world_from_object=pose_of(miss["world_from_object"]),
            angle_left=miss["angle_left"],
            distance_left=miss["distance_left"],
            joints=tuple(miss["joints"]),
        ),
        robot_miss=None if fields.get("robot_miss") is None else _robot_miss(fields["robot_miss"]),
        statistics=fields["statistics"],
        report=None if report is None else report_of(report),
        rejected_plan=fields.get("rejected_plan"),
    )
