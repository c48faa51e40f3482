"""Joints that follow others, efforts, and pairs that may touch."""

from __future__ import annotations

import difflib
from collections.abc import Mapping

import numpy as np

from ..simulate._mujoco import MjModel, mujoco
from ._names import Names
from ._roots import Part
from ._source import Coupling, Joint, Source

MAX_PLAY = 0.2
"""A tendon whose range leaves a joint more play than this, in radians or metres, couples nothing."""


class Constraints:
    """What the model says about joints together."""

    def __init__(self, model: MjModel, names: Names, part: Part, lenient: bool) -> None:
        self._model = model
        self._names = names
        self._part = part
        self._lenient = lenient
        self.problems: list[str] = []
        """What a URDF cannot hold."""
        self._used_tendons: set[int] = set()

    def couple(self, source: Source, stated: Mapping[str, tuple[str, float]]) -> None:
        """Equality constraints and narrow tendons become couplings, beside those that are `stated`: follower to leader and multiplier."""
        joints = {joint.name: joint for joint in source.joints}
        for name, (leader, multiplier) in stated.items():
            self._state(name, leader, multiplier, joints)
        for index in range(self._model.neq):
            self._equality(index, joints, source)
        for tendon in range(self._model.ntendon):
            if tendon not in self._used_tendons:
                self._tendon(tendon, joints, source)
        for joint in joints.values():
            self._refuse_circle(joint, joints)

    def allow(self, source: Source) -> None:
        """Contact excludes become pairs that may touch; pairs of geoms with contacts of their own are named."""
        model = self._model
        inside = set(self._part.bodies)
        for index in range(model.nexclude):
            signature = int(model.exclude_signature[index])
            first, second = signature >> 16, signature & 0xFFFF
            if first in inside and second in inside and first != second:
                source.allow.append((self._names.body(first), self._names.body(second)))
        for index in range(model.npair):
            pair = [int(model.pair_geom1[index]), int(model.pair_geom2[index])]
            if any(int(model.geom_bodyid[geom]) in inside for geom in pair):
                name = " and ".join(self._names.other(mujoco.mjtObj.mjOBJ_GEOM, geom) for geom in pair)
                source.leave_out("contact pairs (friction and condim of their own)", name)

    def _state(self, name: str, leader: str, multiplier: float, joints: dict[str, Joint]) -> None:
        for unknown in {name, leader} - joints.keys():
            meant = difflib.get_close_matches(unknown, list(joints), 1)
            self.problems.append(
                f'the hand has no joint "{unknown}"' + (f'; did you mean "{meant[0]}"?' if meant else "")
            )
        if name in joints and leader in joints:
            joints[name].coupling = Coupling(leader, multiplier, 0.0)

    def _refuse(self, problem: str, source: Source) -> None:
        if self._lenient:
            source.notes.append(f"{problem}: left out")
        else:
            self.problems.append(problem)

    def _equality(self, index: int, joints: dict[str, Joint], source: Source) -> None:
        model, kinds = self._model, mujoco.mjtEq
        kind = int(model.eq_type[index])
        name = self._names.other(mujoco.mjtObj.mjOBJ_EQUALITY, index)
        if not model.eq_active0[index]:
            source.leave_out("equality constraints that are not active", name)
        elif kind == int(kinds.mjEQ_JOINT):
            self._joints(index, name, joints, source)
        elif kind in (int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)):
            word = "connect" if kind == int(kinds.mjEQ_CONNECT) else "weld"
            if all(body in self._part.bodies for body in self._bodies_of(index)):
                self._refuse(f'{word} constraint "{name}" closes a loop of links; a URDF is a tree', source)
            else:
                source.leave_out("connect and weld constraints to what is not the hand", name)
        elif kind == int(kinds.mjEQ_TENDON):
            if not self._tendons_equal(index, joints):
                source.leave_out("equality constraints of tendons over other than two joints of the hand", name)
        else:
            source.leave_out("equality constraints of flexes", name)

    def _bodies_of(self, index: int) -> list[int]:
        model = self._model
        ids = [int(model.eq_obj1id[index]), int(model.eq_obj2id[index])]
        if hasattr(model, "eq_objtype") and int(model.eq_objtype[index]) == int(mujoco.mjtObj.mjOBJ_SITE):
            return [int(model.site_bodyid[site]) for site in ids]
        return ids

    def _joints(self, index: int, name: str, joints: dict[str, Joint], source: Source) -> None:
        model = self._model
        ids = [int(model.eq_obj1id[index]), int(model.eq_obj2id[index])]
        found = [joints.get(self._names.joint(joint)) if joint >= 0 else None for joint in ids]
        follower, leader = found
        constant, first, *higher = (float(value) for value in model.eq_data[index][:5])
        if follower is None and leader is None:
            return
        if follower is None or (leader is None and ids[1] >= 0):
            source.leave_out("equality constraints with joints outside the hand", name)
        elif leader is not None and first != 0.0 and any(higher):
            terms = ", ".join(f"{value:g}" for value in (constant, first, *higher))
            self._refuse(
                f'equality constraint "{name}": joint "{follower.name}" follows "{leader.name}" by the polynomial {terms}; '
                "a coupling is of first order",
                source,
            )
        elif leader is not None and any(higher):
            self._refuse(
                f'equality constraint "{name}": joint "{follower.name}" follows "{leader.name}" by a polynomial '
                "without a linear term; a coupling is of first order",
                source,
            )
        elif follower.coupling is not None or follower.held_at is not None:
            self._refuse(f'equality constraint "{name}": joint "{follower.name}" follows another joint already', source)
        elif leader is None or first == 0.0:
            follower.held_at = follower.reference + constant
        else:
            offset = follower.reference + constant - first * leader.reference
            follower.coupling = Coupling(leader.name, first, offset)

    def _tendons_equal(self, index: int, joints: dict[str, Joint]) -> bool:
        """Fixed tendons whose lengths a constraint ties, over two joints in all: a coupling. Over one: it is held."""
        model = self._model
        constant, first, *higher = (float(value) for value in model.eq_data[index][:5])
        tendons = [(int(model.eq_obj1id[index]), 1.0)]
        if int(model.eq_obj2id[index]) >= 0:
            tendons.append((int(model.eq_obj2id[index]), -first))
            if any(higher):
                return False
        # The sum of factor times position, over all joints, equals this length.
        length, terms = constant, dict[int, float]()
        for tendon, share in tendons:
            wraps = _fixed_wraps(model, tendon)
            if not wraps:
                return False
            length += share * float(model.tendon_length0[tendon])
            for joint, factor in wraps:
                terms[joint] = terms.get(joint, 0.0) + share * factor
        parts = [(joints.get(self._names.joint(joint)), factor) for joint, factor in terms.items() if factor != 0.0]
        known = [(joint, factor) for joint, factor in parts if joint is not None]
        if len(known) < len(parts) or len(known) > 2 or not known:
            return False
        # What no actuator moves follows; else what is farther from the palm.
        order = list(joints)
        known.sort(key=lambda part: (part[0].is_driven, -order.index(part[0].name)))
        for (follower, own), (leader, its) in zip(known, reversed(known), strict=True):
            if follower.coupling is not None or follower.held_at is not None:
                continue
            if leader is follower:
                follower.held_at = length / own
            elif self._leads_to(leader, follower, joints):
                continue
            else:
                follower.coupling = Coupling(leader.name, -its / own, length / own)
            self._used_tendons.update(tendon for tendon, _ in tendons)
            return True
        return False

    def _leads_to(self, joint: Joint, wanted: Joint, joints: dict[str, Joint]) -> bool:
        """Whether `joint` follows `wanted`, over others or not."""
        at: Joint | None = joint
        for _ in joints:
            if at is None or at is wanted or at.coupling is None:
                break
            at = joints.get(at.coupling.leader)
        return at is wanted

    def _tendon(self, tendon: int, joints: dict[str, Joint], source: Source) -> None:
        """A tendon over two joints whose length has next to no range, one of them without an actuator, is a coupling."""
        model = self._model
        name = self._names.other(mujoco.mjtObj.mjOBJ_TENDON, tendon)
        wraps = _fixed_wraps(model, tendon)
        parts = [(joints.get(self._names.joint(joint)), factor) for joint, factor in wraps]
        known = [(joint, factor) for joint, factor in parts if joint is not None]
        if wraps and not known:
            return
        if not self._is_coupling(tendon, name, known if len(known) == len(wraps) == 2 else [], source):
            source.leave_out("tendons", name)

    def _is_coupling(self, tendon: int, name: str, known: list[tuple[Joint, float]], source: Source) -> bool:
        model = self._model
        free = [
            pair for pair in known if not pair[0].is_driven and pair[0].coupling is None and pair[0].held_at is None
        ]
        if not free:
            return False
        (follower, own) = free[0] if len(free) == 1 else known[1]
        (leader, its) = next(pair for pair in known if pair[0] is not follower)
        low, high = (float(value) for value in model.tendon_range[tendon])
        play = (high - low) / (2 * abs(own))
        if model.tendon_limited[tendon] and play <= MAX_PLAY and len(free) == 1:
            follower.coupling = Coupling(leader.name, -its / own, (low + high) / (2 * own))
            source.notes.append(
                f'tendon "{name}" keeps joint "{follower.name}", which has no actuator, within {play:.3g} of '
                f'{-its / own:.4g} * "{leader.name}": written as a coupling'
            )
            return True
        leads = leader.coupling is not None and leader.coupling.leader == follower.name
        if follower.coupling is None and not leads and _pulls(model, tendon):
            source.notes.append(
                f'one actuator pulls joints "{leader.name}" and "{follower.name}" by tendon "{name}". Where one follows the other, '
                f'say so: --couple "{follower.name}={leader.name}"'
            )
        return False

    def _refuse_circle(self, joint: Joint, joints: dict[str, Joint]) -> None:
        """Joints that follow each other in a circle."""
        seen: list[str] = []
        at: Joint | None = joint
        while at is not None and at.coupling is not None and at.name not in seen:
            seen.append(at.name)
            at = joints.get(at.coupling.leader)
        if at is joint and joint.coupling is not None and joint.name == min(seen):
            self.problems.append(f"joints follow each other in a circle: {' -> '.join(seen)}")


def forces_of_joints(model: MjModel) -> dict[int, float]:
    """Largest torque or force by joint, of those whose actuators, or the joints themselves, say so."""
    forces: dict[int, float] = {}
    unknown: set[int] = set()
    for actuator in range(model.nu):
        limit = _limit(model, actuator)
        gear = abs(float(model.actuator_gear[actuator][0]))
        for joint, factor in _driven_joints(model, actuator):
            if limit is None:
                unknown.add(joint)
            else:
                forces[joint] = forces.get(joint, 0.0) + abs(factor) * gear * limit
    for joint in range(model.njnt):
        if getattr(model, "jnt_actfrclimited", np.zeros(model.njnt))[joint]:
            bound = float(np.abs(model.jnt_actfrcrange[joint]).min())
            known = forces.get(joint) if joint not in unknown else None
            forces[joint] = bound if known is None else min(bound, known)
            unknown.discard(joint)
    return {joint: force for joint, force in forces.items() if joint not in unknown and force > 0.0}


def _limit(model: MjModel, actuator: int) -> float | None:
    """The smaller of the largest forces to either side; none where the model does not bound it."""
    if model.actuator_forcelimited[actuator]:
        return float(np.abs(model.actuator_forcerange[actuator]).min())
    is_motor = int(model.actuator_biastype[actuator]) == int(mujoco.mjtBias.mjBIAS_NONE)
    is_fixed = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    if is_motor and is_fixed and model.actuator_ctrllimited[actuator]:
        control = float(np.abs(model.actuator_ctrlrange[actuator]).min())
        return abs(float(model.actuator_gainprm[actuator][0])) * control
    return None


def _driven_joints(model: MjModel, actuator: int) -> list[tuple[int, float]]:
    """The joints that an actuator moves, with their lever arms."""
    kinds = mujoco.mjtTrn
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator][0])
    if kind in (int(kinds.mjTRN_JOINT), int(kinds.mjTRN_JOINTINPARENT)):
        return [(target, 1.0)]
    return _fixed_wraps(model, target) if kind == int(kinds.mjTRN_TENDON) else []


def _fixed_wraps(model: MjModel, tendon: int) -> list[tuple[int, float]]:
    """Joints and factors of a fixed tendon; none of a spatial one."""
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    wraps = range(first, first + count)
    if any(int(model.wrap_type[wrap]) != int(mujoco.mjtWrap.mjWRAP_JOINT) for wrap in wraps):
        return []
    return [(int(model.wrap_objid[wrap]), float(model.wrap_prm[wrap])) for wrap in wraps]


def _pulls(model: MjModel, tendon: int) -> bool:
    return any(
        int(model.actuator_trntype[k]) == int(mujoco.mjtTrn.mjTRN_TENDON) and int(model.actuator_trnid[k][0]) == tendon
        for k in range(model.nu)
    )
