"""Shapes of bodies: primitives as they are, ellipsoids and meshes as triangles."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..simulate._mujoco import MjModel, mujoco
from ._names import Names
from ._source import FloatArray, Geom, Mesh, Placed, Source, rotation_of

HIDDEN_GROUP = 3
"""Geoms of this group and higher ones are not drawn by MuJoCo unless asked for: by custom they are collision geometry."""

SPLITS = 4
"""How often the triangles of an icosahedron are split for an ellipsoid: 5,120 triangles, at most 0.1 % of the radius off."""


class Shapes:
    """The geoms of a hand."""

    def __init__(self, model: MjModel, names: Names, bodies: list[int]) -> None:
        self._model = model
        self._names = names
        self._bodies = set(bodies)
        self._meshes: dict[int, Mesh] = {}
        inside = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in self._bodies]
        pairs = {int(geom) for geom in (*model.pair_geom1[: model.npair], *model.pair_geom2[: model.npair])}
        collide = [geom for geom in inside if model.geom_contype[geom] or model.geom_conaffinity[geom] or geom in pairs]
        self._none_collides = not collide
        self._collide = set(collide or inside)

    def of_body(self, body: int, source: Source) -> list[Geom]:
        """The geoms on `body`; what a URDF has no word for is left out by name."""
        model = self._model
        geoms = [int(geom) for geom in np.flatnonzero(model.geom_bodyid == body)]
        made = [(geom, self._geom(geom)) for geom in geoms]
        for geom, shape in made:
            if shape is None:
                source.leave_out("planes and height fields", self._geom_name(geom))
        return [shape for _, shape in made if shape is not None]

    def note_masks(self, source: Source) -> None:
        """What the model says about who collides with whom, and a URDF cannot."""
        model = self._model
        if self._none_collides and self._collide:
            source.notes.append(
                "no geom collides in the model (contype and conaffinity are 0): all are collision geometry now"
            )
            return
        groups = {(int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])) for geom in self._collide}
        if not all(a[0] & b[1] or b[0] & a[1] for a in groups for b in groups):
            source.notes.append(
                "contype and conaffinity keep some geoms of the hand from colliding; regrasp keeps all links apart that are "
                "not neighbours. Add pairs to `allow` in hand.toml where links may touch"
            )

    def _geom_name(self, geom: int) -> str:
        return self._names.other(mujoco.mjtObj.mjOBJ_GEOM, geom)

    def _geom(self, geom: int) -> Geom | None:
        model, kinds = self._model, mujoco.mjtGeom
        kind = int(model.geom_type[geom])
        a, b, c = (float(value) for value in model.geom_size[geom])
        shape: tuple[str, tuple[float, ...], Mesh | None]
        if kind == int(kinds.mjGEOM_SPHERE):
            shape = ("sphere", (a,), None)
        elif kind == int(kinds.mjGEOM_BOX):
            shape = ("box", (2 * a, 2 * b, 2 * c), None)
        elif kind in (int(kinds.mjGEOM_CAPSULE), int(kinds.mjGEOM_CYLINDER)):
            shape = ("capsule" if kind == int(kinds.mjGEOM_CAPSULE) else "cylinder", (a, 2 * b), None)
        elif kind == int(kinds.mjGEOM_ELLIPSOID):
            round_one = a == b == c
            shape = ("sphere", (a,), None) if round_one else ("mesh", (), self._ellipsoid(geom, (a, b, c)))
        elif kind in (int(kinds.mjGEOM_MESH), int(kinds.mjGEOM_SDF)) and int(model.geom_dataid[geom]) >= 0:
            shape = ("mesh", (), self._mesh(int(model.geom_dataid[geom])))
        else:
            return None
        return Geom(
            name=self._geom_name(geom),
            kind=shape[0],
            size=shape[1],
            body_from_geom=Placed(np.array(model.geom_pos[geom], dtype=np.float64), rotation_of(model.geom_quat[geom])),
            mesh=shape[2],
            collides=geom in self._collide,
            visible=int(model.geom_group[geom]) < HIDDEN_GROUP,
        )

    def _mesh(self, mesh: int) -> Mesh:
        if mesh not in self._meshes:
            model = self._model
            vertices = _rows(model.mesh_vert, model.mesh_vertadr, model.mesh_vertnum, mesh).astype(np.float64)
            faces = _rows(model.mesh_face, model.mesh_faceadr, model.mesh_facenum, mesh).astype(np.int64)
            name = self._names.other(mujoco.mjtObj.mjOBJ_MESH, mesh)
            self._meshes[mesh] = Mesh(name, vertices, outwards(vertices, faces))
        return self._meshes[mesh]

    def _ellipsoid(self, geom: int, radii: tuple[float, float, float]) -> Mesh:
        vertices, faces = icosphere(SPLITS)
        vertices = vertices * np.array(radii)
        name = f"ellipsoid {self._geom_name(geom)}"
        return Mesh(name, vertices, outwards(vertices, faces))


def _rows(values: Any, starts: Any, counts: Any, index: int) -> Any:
    start = int(starts[index])
    return np.array(values[start : start + int(counts[index])])


def outwards(vertices: FloatArray, faces: Any) -> Any:
    """The faces, turned where they are wound inside out."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)))
    return faces if volume >= 0 else faces[:, ::-1]


def icosphere(splits: int) -> tuple[FloatArray, Any]:
    """A unit ball of triangles, its corners on the sphere."""
    golden = (1 + 5**0.5) / 2
    corners = [[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0]]
    corners += [[z, x, y] for x, y, z in corners] + [[y, z, x] for x, y, z in corners]
    points = [np.array(corner) / np.linalg.norm(corner) for corner in corners]
    # The faces of an icosahedron: all triples of neighbours.
    edge = min(float(np.linalg.norm(points[0] - point)) for point in points[1:])
    near = [[0 < float(np.linalg.norm(p - q)) < 1.01 * edge for q in points] for p in points]
    faces = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i][j] and near[j][k] and near[i][k]
    ]
    faces = [f if np.linalg.det(np.array([points[index] for index in f])) > 0 else f[::-1] for f in faces]
    for _ in range(splits):
        middles: dict[tuple[int, int], int] = {}

        def middle(i: int, j: int, middles: dict[tuple[int, int], int] = middles) -> int:
            key = (min(i, j), max(i, j))
            if key not in middles:
                point = points[i] + points[j]
                points.append(point / np.linalg.norm(point))
                middles[key] = len(points) - 1
            return middles[key]

        split: list[tuple[int, int, int]] = []
        for i, j, k in faces:
            ij, jk, ki = middle(i, j), middle(j, k), middle(k, i)
            split += [(i, ij, ki), (ij, j, jk), (ki, jk, k), (ij, jk, ki)]
        faces = split
    return np.array(points), np.array(faces)
