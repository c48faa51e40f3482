"""How plans are executed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from .._model import Hand, Object
from .settings_check import EXECUTOR, check_settings

#: Settings of the planner that execution plans with, where nothing else is said: the speed that scenes allow by default, and short ramps.
#: Every plan is improved a little, and the more the more relocations it has, by weights that are about the time that the motions take: at
#: 0.1 m/s a relocation is worth 12 cm. A search for a first plan ends after ``search_work``: of 60 queries of a cube in the Allegro
#: hand 48 have a plan by then, and 51 after twice as much.
PLANNER: dict[str, Any] = {
    "speed": {"largest_speed": 0.1, "ramp": 0.06},
    "search_work": 400_000,
    "improve_work": 60_000,
    "shorten_relocation": 20_000,
    "cost": {"relocation": 1.0, "object_path": 8.0, "joint_path": 0.05, "margin": 0.05},
}
#: ``PLANNER`` with a firmer grip, for all objects: with friction 0.7 of the scene's spheres fell where it loosened as such a leg began after a
#: careful one, and of a cube in the Allegro hand fewer goals were reached (docs/benchmarks/execute.md).
FIRMER: dict[str, Any] = {**PLANNER, "forces": {"squeeze": 6.0}}
#: ``FIRMER`` for objects with edges: fingertips never land quite where they should, and links stray.
EDGED: dict[str, Any] = {**FIRMER, "clearance": 0.0006, "edge_margin": 0.001}
#: ``EDGED`` with more room for friction that is lower than thought. Plans are sought with these first: of 60 queries of that cube 23 have
#: such a plan, 22 of them within this work.
CAREFUL: dict[str, Any] = {**EDGED, "friction_margin": 2.0, "search_work": 300_000}
#: These instead of ``CAREFUL`` for spheres and ellipsoids, which are soon squeezed out of the hand where fingertips slip. The grip is
#: firmer: a fingertip that is not quite where it should be pushes along the surface, and slips less the more it presses. And the next
#: plan begins with the grasp that one ends with, so that must hold well. By measurement with friction 0.7 of the scene's:
#: docs/benchmarks/execute.md. A cube in the Allegro hand was given up or dropped with these.
CAREFUL_ROUND: dict[str, Any] = {**FIRMER, "friction_margin": 2.0, "end_margin": 0.02}
#: These before ``CAREFUL_ROUND``: links keep farther away. A fingertip may touch a sphere beside the link that carries it. Where the sphere is
#: a little off, that link presses in place of the tip, and no start is found any more. The wide hand's links stand back 1 mm behind their
#: fingertips: in two runs with much trouble (friction 0.7) 8 of 80 legs had no plan with 0.6 mm.
CLEAR_ROUND: dict[str, Any] = {**CAREFUL_ROUND, "clearance": 0.0006}
#: ``PLANNER`` for starts that are worse than plans may be: grasps may hold less.
LOOSE: dict[str, Any] = {**PLANNER, "closure_margin": 0.001}
#: The same with the grip of ``FIRMER``, for objects with edges.
LOOSE_EDGED: dict[str, Any] = {**LOOSE, "forces": FIRMER["forces"]}
#: ``LOOSE`` for starts at which links are nearer to the object than plans keep them. Nothing is planned with this: planners let what is near
#: at a start stay so, and a plan with this clearance brought another link within 0.1 mm of a cube, where it pressed in place of the fingertip.
NEAR: dict[str, Any] = {**LOOSE, "clearance": 2e-5}
#: ``PLANNER`` with more room for friction and a firmer grip: legs are planned with these first where ``grip`` says so. Origin: pushes of 4 N on the bundled box.
FIRM: dict[str, Any] = {**PLANNER, "friction_margin": 2.0, "forces": {"squeeze": 12.0, "normal_force": [2.0, 30.0]}}
#: ``FIRMER`` with a better grasp at the end: so the hand takes hold of the object anew, where no plan leads on from the present grasp.
ANEW: dict[str, Any] = {**FIRMER, "end_margin": 0.03}

#: Shapes that are round everywhere.
ROUND = frozenset({"sphere", "ellipsoid"})

#: A configuration of a hand whose fingertips are meshes takes as long as so many of other hands. By measurement on queries between
#: random poses of a sphere: 22 microseconds (LEAP) and 2.5 (Allegro).
MESH_TIPS = 8.0


def work_share(hand: Hand) -> float:
    """Share of the work that legs of this hand get for more plans and better ones, so that a leg is planned about as fast in any hand."""
    return 1.0 / MESH_TIPS if any(finger.tip.surface == "smooth_hull" for finger in hand.fingers) else 1.0


def careful_settings(moved: Object) -> tuple[dict[str, Any], ...]:
    """The settings with which plans for this object are sought first, in order."""
    return (CLEAR_ROUND, CAREFUL_ROUND, FIRMER) if moved.shape.kind in ROUND else (CAREFUL, EDGED, FIRMER)


def usual_settings(moved: Object) -> dict[str, Any]:
    """The settings with which plans are sought where those of `careful_settings` find none. Round objects need a grip of 4 N after a miss; in
    chains of a cube with friction 0.7 of the scene's long plans with 4 N were those that went wrong (docs/benchmarks/execute.md)."""
    return PLANNER if moved.shape.kind in ROUND else FIRMER


def loose_settings(moved: Object) -> dict[str, Any]:
    """The settings for starts that are worse than plans may be."""
    return LOOSE if moved.shape.kind in ROUND else LOOSE_EDGED


@dataclass(frozen=True)
class ExecutorSettings:
    """How plans are executed. Metres, radians, seconds. Numbers without an origin are by hand."""

    feedback: bool = True
    """Controller ``C2``, which feeds the object's pose back; else ``B``."""
    largest_offset: float = 0.004
    """Feedback moves the target of a fingertip by so much at most, along each axis of the world. In legs that went well (wide hand, Allegro, LEAP)
    it was 2.7 mm at most. Where a link is in the way, no offset brings the object to where it should be, and larger ones push it out."""
    replanning: bool = True
    """Observes after every leg, and replans where a leg goes wrong. Else legs follow each other as planned, whatever happens."""
    slip_trigger: bool = True
    """Replans where a fingertip has slipped, also if the object is where it should be."""
    anytime: bool = True
    """Plans the next leg while the present one runs."""

    reached_distance: float = 0.002
    """A goal counts as reached within this distance of the centre of mass,"""
    reached_turn: float = float(np.radians(2.0))
    """and within this angle."""
    settled_distance: float = 0.0007
    """At the end of a leg the executor waits for feedback to bring the object this near,"""
    settled_turn: float = float(np.radians(0.8))
    """and as near as this angle, and goes on from there with the next leg as it was planned,"""
    settled_after: float = 0.5
    """but for at least this: of what the estimate of the pose did not know when the motion ended (``pose_time_constant``) a twelfth is
    left then,"""
    settle_time: float = 1.0
    """and for no longer than this."""
    rest_time: float = 0.25
    """Rest before a state counts as observed, for noise to average out."""
    blend_time: float = 0.15
    """Time in which commands pass from one leg to the next."""

    deviation_distance: float = 0.004
    """Farther from where it should be than this,"""
    deviation_turn: float = float(np.radians(7.0))
    """or by this angle, the object has left the plan."""
    resume_within: float = 0.6
    """Where the object is off, a fingertip slips or a contact is lost, the hand holds for so long. The leg goes on if all comes back."""
    resume_after: float = 0.1
    """It has come back when it has been for so long"""
    resume_share: float = 0.5
    """within this share of the distances and angles at which it counts as off, with every contact felt."""
    sudden_within: float = 0.25
    """Where an object drifts off for longer than this, nothing comes back by itself: the hand does not wait."""
    most_resumes: int = 5
    """A leg goes on again so often,"""
    least_progress: float = 0.5
    """but not where it goes wrong again sooner than after so long."""
    slip_distance: float = 0.003
    """A fingertip that has moved so far over the object since it landed, beyond what is planned, slips."""
    slip_round: float = 0.00195
    """The same on spheres and ellipsoids, where that is less: a fingertip presses in another direction there, and the object is soon
    squeezed out of the hand. By measurement on spheres of 32 mm; with 2 mm for all objects a cube in the Allegro hand did worse."""
    lost_after: float = 0.1
    """A contact that should hold is lost when it is not felt for so long."""
    lost_force: float = 0.02
    """Below this normal force, in newtons, nothing is felt."""
    stall_error: float = 0.2
    """A joint this far from its target"""
    stall_after: float = 0.3
    """for so long is stalled."""

    pose_time_constant: float = 0.2
    """Of the complementary filter: slower errors follow the camera, faster motion the fingers."""
    jump_distance: float = 0.012
    """A pose estimate that is farther off than this,"""
    jump_turn: float = float(np.radians(20.0))
    """or by this angle, is a jump, and not believed"""
    jump_count: int = 10
    """until so many in a row agree."""
    stale_after: float = 0.3
    """Poses older than this are stale: the hand holds."""
    patience: float = 2.0
    """The hand gives up, and holds, when nothing has helped for so long."""

    grip: Literal["usual", "firm after trouble", "firm"] = "usual"
    """When plans are sought with a firmer grip first: never; from the first slip, deviation, lost contact or missed goal on; always."""
    reflex_press: float = 0.0
    """Where a holding fingertip feels a sudden change, all fingers press harder by so many times the planned forces. 1 keeps more objects that
    are pushed; where nothing pushes it does harm (docs/benchmarks/execute.md)."""
    reflex_force: float = 1.5
    """A change is sudden where the normal force changes by more than this beyond what is planned, in newtons, within 12 ms. By measurement: 0.8 N is felt now and
    then where nothing pushes, several newtons where 4 N push an object of 0.1 kg."""
    reflex_time: float = 0.4
    """The fingers press harder for so long after a sudden change,"""
    reflex_release: float = 0.3
    """and then, for so long, less and less."""
    back_off_time: float = 0.3
    """Where there is no start, the hand goes back on its way for so long, and looks again."""
    gone_distance: float = 0.02
    """An object that is seen at least so far from every fingertip, and not felt by two fingers,"""
    gone_after: float = 0.2
    """for so long, is gone. So is one that is not seen for ``patience``, and not felt."""

    project_distance: float = 0.002
    """How far a start may be from what was observed,"""
    project_turn: float = 0.04
    """and by which angle, of the object and of any joint."""
    last_reach: float = 4.0
    """Where no such start is found for ``patience``, it may be twice as far, then up to this many times, before the hand gives up."""
    most_retreats: int = 2
    """Where there is none of these either, the hand goes back on its leg to before the last finger lifted, so often at most, and looks again."""
    attempts: int = 4
    """Legs that are tried for one goal. After the first, queries without a plan count too."""
    most_detours: int = 5
    """Where no plan leads to a goal, and no leg to it has gone wrong, the hand goes elsewhere first, so often at most: it takes hold of the
    object anew, goes where the run began, or to the first goal that it reached."""
    again_speed: float = 1.0
    """All but the first run at this share of their plan's speed, where no finger relocates."""
    again_share: float = 1.0
    """Where a leg came to its end but not to the goal, the next one goes this share of what is left."""
    again_speed_round: float = 0.3
    """The same for spheres and ellipsoids, where that is less."""
    again_share_round: float = 0.5
    """The same for spheres and ellipsoids, where that is less. By measurement: a sphere came to rest a few degrees beyond its goal, and every
    new leg pushed it as far beyond on the other side. Against that these two help, together with the usual grip, which legs after a miss
    have (docs/benchmarks/execute.md). On other shapes the share was not measured, and slow legs did harm where fingers relocate."""
    regrips_round: bool = True
    """Where a leg of a sphere or ellipsoid went wrong on its way, the hand first takes hold of it anew, where it is, if the grasp that is left is
    weak: else the next leg begins with that, and slips sooner."""
    threads: int = 2
    """Searches for a leg that run at once: while careful plans are sought, so are the next less careful ones. Plans do not depend on it
    (without ``time_limit``), only how soon they are there."""
    plan_attempts: int = 3
    """Seeds that are tried for one leg."""
    choices: int = 20
    """Plans that are made for one leg: the one whose motion takes the least time is executed."""
    choice_work: int = 250_000
    """Another one is made only while all of a leg are likely to stay below this work, in configurations; in hands whose fingertips are
    meshes below an eighth of it (``work_share``)."""
    max_work: int = 1_000_000
    """Work of one search and of what makes its plan better, in configurations."""
    time_limit: float | None = None
    """Wall-clock limit of one search, in seconds; with one, runs depend on the machine."""
    work_rate: float = 300_000.0
    """Configurations per second that a simulation charges for planning, an eighth of them in hands whose fingertips are meshes: simulated
    time passes as it would on a robot."""
    planning_overhead: float = 0.05
    """Beside these, in seconds: check, preparation."""
    seed: int = 0

    def __post_init__(self) -> None:
        """Raises ``InputError`` (A510) for a setting that no run can have."""
        check_settings(self, EXECUTOR)

    def for_object(self, moved: Object) -> ExecutorSettings:
        """The same with what holds for this object."""
        if moved.shape.kind not in ROUND:
            return self
        return replace(
            self,
            slip_distance=min(self.slip_distance, self.slip_round),
            again_speed=min(self.again_speed, self.again_speed_round),
            again_share=min(self.again_share, self.again_share_round),
        )
