"""The text of a URDF, and meshes as STL."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable

import numpy as np

from ._names import unused
from ._source import Body, FloatArray, Geom, Joint, Mesh, Placed, Source, moved, turned

Element = ElementTree.Element
MARK = "Written by python -m regrasp.from_mjcf"
"""How the comment in front of every URDF of ours begins."""


def urdf_text(source: Source, files: dict[int, str], velocity: float | None = None) -> str:
    """The URDF. `files` has the name of each mesh's file by `id`; `velocity` is the highest speed of all joints, where known."""
    robot = Element("robot", name=source.name)
    taken = {body.name for body in source.bodies}
    joint_names = {joint.name for joint in source.joints}
    for body in source.bodies:
        chain = _joint_elements(body, taken, joint_names, velocity)
        for element in chain:
            if element.tag == "link":
                robot.append(element)
        robot.append(_link(body, files))
        robot.extend(element for element in chain if element.tag == "joint")
    ElementTree.indent(robot)
    comment = f"<!-- {MARK} from {_comment(source.path.name)}. Metres, radians. -->\n"
    return '<?xml version="1.0" encoding="utf-8"?>\n' + comment + ElementTree.tostring(robot, encoding="unicode") + "\n"


def _comment(text: str) -> str:
    return re.sub(r"[^ -~]|--", "_", text)


def _link(body: Body, files: dict[int, str]) -> Element:
    link = Element("link", name=body.name)
    if body.mass > 0.0:
        inertial = ElementTree.SubElement(link, "inertial")
        inertial.append(_origin(body.body_from_inertia))
        ElementTree.SubElement(inertial, "mass", value=_number(body.mass))
        xx, yy, zz = (_number(value) for value in body.inertia)
        ElementTree.SubElement(inertial, "inertia", ixx=xx, ixy="0", ixz="0", iyy=yy, iyz="0", izz=zz)
    for tag, wanted in (
        ("visual", [geom.visible for geom in body.geoms]),
        ("collision", [geom.collides for geom in body.geoms]),
    ):
        for geom, is_wanted in zip(body.geoms, wanted, strict=True):
            if is_wanted:
                link.append(_shape(tag, geom, files))
    return link


def _shape(tag: str, geom: Geom, files: dict[int, str]) -> Element:
    element = Element(tag, name=geom.name)
    element.append(_origin(geom.body_from_geom))
    geometry = ElementTree.SubElement(element, "geometry")
    if geom.mesh is not None:
        ElementTree.SubElement(geometry, "mesh", filename=files[id(geom.mesh)])
    elif geom.kind == "box":
        ElementTree.SubElement(geometry, "box", size=_numbers(geom.size))
    elif geom.kind == "sphere":
        ElementTree.SubElement(geometry, "sphere", radius=_number(geom.size[0]))
    else:
        radius, length = geom.size
        ElementTree.SubElement(geometry, geom.kind, radius=_number(radius), length=_number(length))
    return element


def _joint_elements(body: Body, taken: set[str], joint_names: set[str], velocity: float | None) -> list[Element]:
    """The joints from the parent link to the body's own, with massless links between them.

    The link of a joint turns about its own origin, so that a joint beside the body's origin needs a fixed joint back.
    """
    if body.parent is None:
        return []
    elements: list[Element] = []
    link, before = body.parent, body.parent_from_body
    for index, joint in enumerate(body.joints):
        is_last = index + 1 == len(body.joints) and not joint.anchor.any()
        child = body.name if is_last else unused(f"{body.name}/{joint.name}", taken)
        if not is_last:
            elements.append(Element("link", name=child))
        elements.append(_moving(joint, link, child, before.then(moved(joint.anchor)).then(_at_zero(joint)), velocity))
        link, before = child, moved(-joint.anchor)
    if link != body.name:
        elements.append(_joint(unused(f"{body.name}_fixed", joint_names), "fixed", link, body.name, before))
    return elements


def _at_zero(joint: Joint) -> Placed:
    """The joint at position 0, as seen from its reference position, where the model's poses are given."""
    if joint.reference == 0.0:
        return moved(np.zeros(3))
    if joint.kind == "prismatic":
        return moved(-joint.reference * joint.axis)
    return turned(joint.axis, -joint.reference)


def _moving(joint: Joint, parent: str, child: str, origin: Placed, velocity: float | None) -> Element:
    if joint.held_at is not None:
        motion = moved(joint.held_at * joint.axis) if joint.kind == "prismatic" else turned(joint.axis, joint.held_at)
        return _joint(joint.name, "fixed", parent, child, origin.then(motion))
    element = _joint(joint.name, joint.kind, parent, child, origin)
    ElementTree.SubElement(element, "axis", xyz=_numbers(joint.axis))
    limit: dict[str, str] = {}
    if joint.limits is not None:
        limit = {"lower": _number(joint.limits[0]), "upper": _number(joint.limits[1])}
    if joint.effort is not None:
        limit["effort"] = _number(joint.effort)
    if velocity is not None:
        limit["velocity"] = _number(velocity)
    if limit:
        ElementTree.SubElement(element, "limit", limit)
    if joint.damping or joint.friction:
        ElementTree.SubElement(element, "dynamics", damping=_number(joint.damping), friction=_number(joint.friction))
    if joint.coupling is not None:
        leader, factor, offset = joint.coupling.leader, joint.coupling.multiplier, joint.coupling.offset
        ElementTree.SubElement(element, "mimic", joint=leader, multiplier=_number(factor), offset=_number(offset))
    return element


def _joint(name: str, kind: str, parent: str, child: str, origin: Placed) -> Element:
    element = Element("joint", name=name, type=kind)
    element.append(_origin(origin))
    ElementTree.SubElement(element, "parent", link=parent)
    ElementTree.SubElement(element, "child", link=child)
    return element


def _origin(placed: Placed) -> Element:
    return Element("origin", xyz=_numbers(placed.position), rpy=_numbers(angles(placed.rotation)))


def angles(rotation: FloatArray) -> tuple[float, float, float]:
    """Roll, pitch and yaw: R = Rz(yaw) Ry(pitch) Rx(roll).

    Yaw first, then what it leaves: near pitch 90 degrees, where yaw is arbitrary, the three still make the rotation.
    """
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    left = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    return math.atan2(-left[1, 2], left[1, 1]), math.atan2(-left[2, 0], left[0, 0]), yaw


def _numbers(values: Iterable[float]) -> str:
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    """All digits; no sign at zero."""
    return repr(float(value) + 0.0)


def mesh_files(source: Source) -> dict[int, tuple[str, Mesh]]:
    """A file name for every mesh of the hand, by the mesh's `id`."""
    files: dict[int, tuple[str, Mesh]] = {}
    taken: set[str] = set()
    for geom in (geom for body in source.bodies for geom in body.geoms if geom.visible or geom.collides):
        if geom.mesh is not None and id(geom.mesh) not in files:
            # Letter case does not tell files apart everywhere.
            plain = re.sub(r"[^A-Za-z0-9._-]+", "_", geom.mesh.name).strip("._").lower() or "mesh"
            files[id(geom.mesh)] = (f"meshes/{unused(plain, taken)}.stl", geom.mesh)
    return files


def stl(mesh: Mesh) -> bytes:
    """A binary STL. Vertices are single precision, as MuJoCo keeps them."""
    corners = mesh.vertices.astype("<f4")[mesh.faces]
    a, b, c = (corners[:, k].astype(np.float64) for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    record = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    record["normal"] = normals / np.where(lengths > 0, lengths, 1.0)
    record["corners"] = corners
    return b"STL written by regrasp.from_mjcf".ljust(80) + np.uint32(len(corners)).tobytes() + record.tobytes()
