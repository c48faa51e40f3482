"""A reader of URDFs of its own, with numpy alone: what the tests compare others with."""

from __future__ import annotations

import math
import struct
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np


def placed(element: ElementTree.Element) -> np.ndarray:
    """(4, 4), of an `<origin>`: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    origin = element.find("origin")
    pose = np.eye(4)
    if origin is None:
        return pose
    roll, pitch, yaw = (float(x) for x in origin.get("rpy", "0 0 0").split())
    pose[:3, :3] = turn("z", yaw) @ turn("y", pitch) @ turn("x", roll)
    pose[:3, 3] = [float(x) for x in origin.get("xyz", "0 0 0").split()]
    return pose


def turn(axis: str, angle: float) -> np.ndarray:
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[first, first] = matrix[second, second] = math.cos(angle)
    matrix[second, first] = math.sin(angle)
    matrix[first, second] = -math.sin(angle)
    return matrix


@dataclass
class Joint:
    kind: str
    parent: str
    child: str
    origin: np.ndarray
    axis: np.ndarray
    limits: tuple[float, float] | None
    effort: float | None
    mimic: tuple[str, float, float] | None

    def motion(self, position: float) -> np.ndarray:
        pose = np.eye(4)
        if self.kind == "prismatic":
            pose[:3, 3] = position * self.axis
        elif self.kind in ("revolute", "continuous"):
            x, y, z = self.axis
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            pose[:3, :3] += math.sin(position) * cross + (1 - math.cos(position)) * cross @ cross
        return pose


@dataclass
class Shape:
    link: str
    tag: str
    name: str
    link_from_shape: np.ndarray
    geometry: ElementTree.Element
    folder: Path

    def volume(self) -> float:
        kind = self.geometry.tag
        if kind == "box":
            return math.prod(float(x) for x in self.geometry.get("size", "").split())
        if kind == "mesh":
            corners = read_stl(self.folder / self.geometry.get("filename", ""))
            return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6
        radius, length = float(self.geometry.get("radius", "0")), float(self.geometry.get("length", "0"))
        ball = 4 / 3 * math.pi * radius**3 if kind in ("sphere", "capsule") else 0.0
        return ball + math.pi * radius**2 * length


def read_stl(path: Path) -> np.ndarray:
    """(n, 3, 3): the corners of a binary STL."""
    content = path.read_bytes()
    (count,) = struct.unpack_from("<I", content, 80)
    assert len(content) == 84 + 50 * count
    return np.array([struct.unpack_from("<9f", content, 84 + 50 * k + 12) for k in range(count)]).reshape(count, 3, 3)


class Urdf:
    """Links, joints and shapes of a file."""

    def __init__(self, path: Path) -> None:
        robot = ElementTree.parse(path).getroot()
        self.links = [link.get("name", "") for link in robot.iter("link") if link.get("name")]
        self.joints: dict[str, Joint] = {}
        for joint in robot.findall("joint"):
            limit, mimic, axis = joint.find("limit"), joint.find("mimic"), joint.find("axis")
            has_limits = limit is not None and limit.get("lower") is not None
            self.joints[joint.get("name", "")] = Joint(
                kind=joint.get("type", ""),
                parent=joint.find("parent").get("link", ""),
                child=joint.find("child").get("link", ""),
                origin=placed(joint),
                axis=np.array([float(x) for x in axis.get("xyz", "").split()]) if axis is not None else np.zeros(3),
                limits=(float(limit.get("lower")), float(limit.get("upper"))) if has_limits else None,
                effort=float(limit.get("effort")) if limit is not None and limit.get("effort") else None,
                mimic=(mimic.get("joint", ""), float(mimic.get("multiplier")), float(mimic.get("offset"))) if mimic is not None else None,
            )  # fmt: skip
        carried = {joint.child for joint in self.joints.values()}
        (self.root,) = (link for link in self.links if link not in carried)
        self.shapes = [
            Shape(
                link.get("name", ""),
                tag,
                shape.get("name", ""),
                placed(shape),
                next(iter(shape.find("geometry"))),
                path.parent,
            )
            for link in robot.findall("link")
            for tag in ("visual", "collision")
            for shape in link.findall(tag)
        ]
        self.masses: dict[str, float] = {}
        self.inertias: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for link in robot.findall("link"):
            inertial = link.find("inertial")
            if inertial is None:
                continue
            i = {key: float(value) for key, value in inertial.find("inertia").attrib.items()}
            tensor = np.array(
                [[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]
            )
            pose = placed(inertial)
            self.masses[link.get("name", "")] = float(inertial.find("mass").get("value"))
            self.inertias[link.get("name", "")] = (pose[:3, 3], pose[:3, :3] @ tensor @ pose[:3, :3].T)

    def position(self, name: str, positions: dict[str, float]) -> float:
        joint = self.joints[name]
        if joint.kind == "fixed":
            return 0.0
        if joint.mimic is None:
            return positions.get(name, 0.0)
        leader, multiplier, offset = joint.mimic
        return multiplier * self.position(leader, positions) + offset

    def forward(self, positions: dict[str, float], world_from_root: np.ndarray) -> dict[str, np.ndarray]:
        """World from every link."""
        poses = {self.root: world_from_root}
        waiting = dict(self.joints)
        while waiting:
            for name in [name for name, joint in waiting.items() if joint.parent in poses]:
                joint = waiting.pop(name)
                poses[joint.child] = poses[joint.parent] @ joint.origin @ joint.motion(self.position(name, positions))
        return poses
