"""Reads a model of MuJoCo, with the `mujoco` package, as the hand that a URDF will be."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..simulate._mujoco import MjModel, mujoco
from ._constraints import Constraints, forces_of_joints
from ._geoms import Shapes
from ._names import Names
from ._roots import Part, choose_part
from ._source import Body, FloatArray, Joint, MjcfError, Placed, Source, moved, rotation_of


LIKELY_RANGE = 0.12
"""Hinges of a hand turn farther than this, in radians: it is 7 degrees."""


def read(
    path: Path,
    *,
    root: str | None = None,
    lenient: bool = False,
    couple: Mapping[str, tuple[str, float]] | None = None,
) -> Source:
    """The hand in the model file at `path`. Raises `MjcfError`, with every cause found.

    root: the body that becomes the root link; the only body of the world that has joints, without it. "world" takes the world.
    couple: joints that follow others, whatever the model says: follower to leader and multiplier.
    lenient: joints and constraints that a URDF cannot hold are held or left out, with a note, instead of refused.
    """
    model = compiled(path)
    names = Names(model)
    part = choose_part(model, names, root, path)
    return _Reading(model, names, part, lenient).source(path, couple or {})


def compiled(path: Path) -> MjModel:
    """The model as MuJoCo compiles it."""
    if not path.is_file():
        raise MjcfError(f"{path}: there is no such file")
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        # MuJoCo's words: file, line and cause.
        said = f"{path}: MuJoCo cannot read it: {error}"
        if "mujocoinclude" in str(error):
            said += f"; it is a part of a model: give the file that includes it{_including(path)}"
        raise MjcfError(said) from error


def _including(part: Path) -> str:
    """Which model files in the folder of `part`, and in the one above, include it, in words; nothing where none does."""
    own = part.resolve().parent
    included = re.compile(rf"<include\s+file\s*=\s*[\"'](?:[^\"']*/)?{re.escape(part.name)}[\"']")
    found: list[str] = []
    for folder in (own, own.parent):
        for file in sorted(folder.glob("*.xml")):
            text = file.read_text(errors="replace")
            if included.search(text) and "<mujocoinclude" not in text:
                found.append(os.path.relpath(file, own))
    return ", such as " + " or ".join(found[:3]) if found else ""


class _Reading:
    def __init__(self, model: MjModel, names: Names, part: Part, lenient: bool) -> None:
        self.model = model
        self.names = names
        self.part = part
        self.lenient = lenient
        self.problems: list[str] = []

    def source(self, path: Path, couple: Mapping[str, tuple[str, float]]) -> Source:
        model, names = self.model, self.names
        own_name = bytes(model.names).split(b"\0")[0].decode(errors="replace")
        # What MuJoCo calls a model without a name.
        own_name = "" if own_name == "MuJoCo Model" else own_name
        name = re.sub(r"\s+", "_", own_name.strip()) or path.stem
        source = Source(name=name, path=path, bodies=[], allow=[])
        for body in self.part.outside:
            source.leave_out("bodies outside the hand", names.body(body))
        for joint in self.part.mounts:
            source.leave_out("joints that move the root body", names.joint(joint))
        shapes = Shapes(model, names, self.part.bodies)
        efforts = forces_of_joints(model)
        for body in self.part.bodies:
            source.bodies.append(self.body(body, shapes.of_body(body, source), efforts, source))
        shapes.note_masks(source)
        constraints = Constraints(model, names, self.part, self.lenient)
        constraints.couple(source, couple)
        constraints.allow(source)
        self.problems += constraints.problems
        self.note_rest(source)
        ranges = [max(map(abs, joint.limits)) for joint in source.joints if joint.limits and joint.kind == "revolute"]
        if ranges and max(ranges) < LIKELY_RANGE:
            source.notes.append(
                f"no hinge turns by more than {max(ranges):.3g} rad: the ranges may be radians that MuJoCo takes for degrees. "
                'Add <compiler angle="radian"/> to the model then'
            )
        if self.problems:
            more = "" if self.lenient else "\n--lenient leaves out what a URDF cannot hold, and says what"
            raise MjcfError("\n".join(f"{path}: {problem}" for problem in self.problems) + more)
        return source

    def body(self, body: int, geoms: list[Any], efforts: dict[int, float], source: Source) -> Body:
        model = self.model
        is_root = body == self.part.root
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        joints = [] if is_root else [self.joint(joint, efforts, source) for joint in range(first, first + count)]
        pose = Placed(_vector(model.body_pos[body]), rotation_of(model.body_quat[body]))
        return Body(
            name=self.names.body(body),
            parent=None if is_root else self.names.body(int(model.body_parentid[body])),
            parent_from_body=moved(np.zeros(3)) if is_root else pose,
            joints=[joint for joint in joints if joint is not None],
            geoms=geoms,
            mass=float(model.body_mass[body]),
            body_from_inertia=Placed(_vector(model.body_ipos[body]), rotation_of(model.body_iquat[body])),
            inertia=_vector(model.body_inertia[body]),
        )

    def joint(self, joint: int, efforts: dict[int, float], source: Source) -> Joint | None:
        """None for a joint that is held, or refused."""
        model, name = self.model, self.names.joint(joint)
        types = mujoco.mjtJoint
        kind = int(model.jnt_type[joint])
        limits = (
            (float(model.jnt_range[joint][0]), float(model.jnt_range[joint][1])) if model.jnt_limited[joint] else None
        )
        problem = None
        if kind in (int(types.mjJNT_BALL), int(types.mjJNT_FREE)):
            word = "ball" if kind == int(types.mjJNT_BALL) else "free"
            problem = f'joint "{name}" is a {word} joint; a URDF hand has hinges and slides'
        elif kind == int(types.mjJNT_SLIDE) and limits is None:
            problem = f'joint "{name}" slides without limits; give it a range'
        if problem:
            if self.lenient:
                source.notes.append(f"{problem}: held where it is")
            else:
                self.problems.append(problem)
            return None
        slides = kind == int(types.mjJNT_SLIDE)
        dof = int(model.jnt_dofadr[joint])
        axis = _vector(model.jnt_axis[joint])
        return Joint(
            name=name,
            kind="prismatic" if slides else "continuous" if limits is None else "revolute",
            axis=axis / np.linalg.norm(axis),
            anchor=np.zeros(3) if slides else _vector(model.jnt_pos[joint]),
            reference=float(model.qpos0[model.jnt_qposadr[joint]]),
            limits=limits,
            effort=efforts.get(joint),
            # Arrays of later versions have several columns: the first is the linear one.
            damping=float(np.ravel(model.dof_damping[dof])[0]),
            friction=float(np.ravel(model.dof_frictionloss[dof])[0]),
            is_driven=_is_driven(model, joint),
        )

    def note_rest(self, source: Source) -> None:
        """What has names and no place in a URDF."""
        model, objects = self.model, mujoco.mjtObj
        inside = set(self.part.bodies)
        for kind, number, of in (
            ("sites", model.nsite, objects.mjOBJ_SITE),
            ("cameras", model.ncam, objects.mjOBJ_CAMERA),
        ):
            bodies = model.site_bodyid if kind == "sites" else model.cam_bodyid
            for index in range(number):
                if int(bodies[index]) in inside:
                    source.leave_out(kind, self.names.other(of, index))
        for kind, number, of in (
            ("sensors", model.nsensor, objects.mjOBJ_SENSOR),
            ("key frames", model.nkey, objects.mjOBJ_KEY),
            ("skins", model.nskin, objects.mjOBJ_SKIN),
            ("flexes", getattr(model, "nflex", 0), getattr(objects, "mjOBJ_FLEX", None)),
        ):
            for index in range(number):
                source.leave_out(kind, self.names.other(of, index))
        colliding = (
            geom for geom in _geoms_of(model, inside) if model.geom_contype[geom] or model.geom_conaffinity[geom]
        )
        frictions = {tuple(model.geom_friction[geom]) for geom in colliding}
        if len(frictions) > 1:
            source.notes.append(f"the geoms have {len(frictions)} different frictions; a scene has one per object")


def _geoms_of(model: MjModel, bodies: set[int]) -> Iterable[int]:
    return (geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in bodies)


def _is_driven(model: MjModel, joint: int) -> bool:
    transmissions = mujoco.mjtTrn
    of_joints = (int(transmissions.mjTRN_JOINT), int(transmissions.mjTRN_JOINTINPARENT))
    return any(
        int(model.actuator_trntype[k]) in of_joints and int(model.actuator_trnid[k][0]) == joint
        for k in range(model.nu)
    )


def _vector(values: Any) -> FloatArray:
    return np.array(values, dtype=np.float64)
