"""Writes `horse.obj`: a standing horse as one closed mesh. Its extents are those of the statuette of Saut 2010, sec. VI.

    python3 make_horse.py

A body of rings; legs, neck with head, and tail each take the place of a block of its faces and are swept along a line. Nose along +x, up
along +z, hooves at z = 0. Lengths in metres.
"""

import math
from pathlib import Path

COLUMNS = 16
# Rings of the body from tail to chest: x, height of the centre, half width, half height.
BODY = [
    (-0.107, 0.152, 0.018, 0.022), (-0.099, 0.151, 0.028, 0.034), (-0.086, 0.150, 0.035, 0.042), (-0.070, 0.149, 0.038, 0.046),
    (-0.054, 0.148, 0.039, 0.047), (-0.034, 0.146, 0.038, 0.046), (-0.012, 0.144, 0.037, 0.045), (0.010, 0.143, 0.036, 0.045),
    (0.030, 0.144, 0.036, 0.046), (0.046, 0.146, 0.036, 0.047), (0.062, 0.149, 0.035, 0.047), (0.076, 0.152, 0.032, 0.044),
    (0.088, 0.155, 0.026, 0.035), (0.095, 0.157, 0.018, 0.023),
]
# Blocks of faces: first ring, rings, first column, columns. Column 0 is at the right (-y); columns go over the belly to the left.
LEGS = {"hind": 2, "front": 8}
RIGHT_LEG, LEFT_LEG = 1, 5
NECK = (8, 4, 10, 4)
TAIL = (0, 2, 11, 2)


def add(a, b, share=1.0):
    return [p + share * q for p, q in zip(a, b)]


def minus(a, b):
    return [p - q for p, q in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = math.hypot(*a)
    return [value / length for value in a]


class Mesh:
    def __init__(self):
        self.points, self.faces = [], []

    def point(self, place):
        self.points.append([round(value, 6) for value in place])
        return len(self.points) - 1

    def quad(self, a, b, c, d):
        """Two triangles with the shorter diagonal."""
        p = self.points
        if math.dist(p[a], p[c]) <= math.dist(p[b], p[d]):
            self.faces += [(a, b, c), (a, c, d)]
        else:
            self.faces += [(a, b, d), (b, c, d)]

    def join(self, loop, other):
        """Faces between two loops of as many points."""
        for k in range(len(loop)):
            n = (k + 1) % len(loop)
            self.quad(loop[k], loop[n], other[n], other[k])

    def cap(self, loop, way):
        """A point ahead of the middle of the loop, and a fan to it."""
        middle = [sum(self.points[k][axis] for k in loop) / len(loop) for axis in range(3)]
        top = self.point(add(middle, way))
        for k in range(len(loop)):
            self.faces.append((loop[k], loop[(k + 1) % len(loop)], top))

    def sweep(self, loop, line, side, end):
        """Rings from the loop along a line of (point, tangent, half width along `side`, half width across), and a cap."""
        first = line[0]
        across = unit(cross(side, first[1]))
        # The angle of every point of the loop about the line, evenly spread from the first point on.
        flat = [minus(self.points[k], first[0]) for k in loop]
        angles = [math.atan2(sum(map(lambda a, b: a * b, f, across)), sum(map(lambda a, b: a * b, f, side))) for f in flat]
        for k in range(1, len(angles)):
            while angles[k] < angles[k - 1] - math.pi:
                angles[k] += 2 * math.pi
            while angles[k] > angles[k - 1] + math.pi:
                angles[k] -= 2 * math.pi
        turn = math.copysign(2 * math.pi, angles[-1] - angles[0])
        even = [turn * k / len(loop) for k in range(len(loop))]
        start = sum(a - e for a, e in zip(angles, even)) / len(loop)
        before = loop
        for place, tangent, wide, deep in line:
            across = unit(cross(side, unit(tangent)))
            ring = []
            for angle in even:
                offset = add([wide * math.cos(start + angle) * s for s in side], across, deep * math.sin(start + angle))
                ring.append(self.point(add(place, offset)))
            self.join(before, ring)
            before = ring
        self.cap(before, end)


def boundary(grid, block):
    """The points around a block of faces, in the order in which faces of the hole's border have to be joined."""
    ring, rings, column, columns = block
    at = lambda i, j: grid[ring + i][(column + j) % COLUMNS]
    loop = [at(0, j) for j in range(columns)] + [at(i, columns) for i in range(rings)]
    return loop + [at(rings, columns - j) for j in range(columns)] + [at(rings - i, 0) for i in range(rings)]


def horse():
    mesh = Mesh()
    grid = []
    for x, height, wide, deep in BODY:
        angles = [math.pi + 2 * math.pi * k / COLUMNS for k in range(COLUMNS)]
        grid.append([mesh.point([x, wide * math.cos(a), height + deep * math.sin(a)]) for a in angles])
    blocks = [NECK, TAIL] + [(ring, 2, column, 2) for ring in LEGS.values() for column in (RIGHT_LEG, LEFT_LEG)]
    holes = set()
    for ring, rings, column, columns in blocks:
        holes |= {(ring + i, (column + j) % COLUMNS) for i in range(rings) for j in range(columns)}
    for i in range(len(BODY) - 1):
        for j in range(COLUMNS):
            if (i, j) not in holes:
                n = (j + 1) % COLUMNS
                mesh.quad(grid[i][j], grid[i][n], grid[i + 1][n], grid[i + 1][j])
    mesh.cap(grid[0][::-1], [-0.004, 0, 0])
    mesh.cap(grid[-1], [0.004, 0, 0])
    for name, ring in LEGS.items():
        for column, sign in ((RIGHT_LEG, -1), (LEFT_LEG, 1)):
            x = BODY[ring + 1][0]
            bend = {"hind": (0.006, -0.012), "front": (0.004, 0.002)}[name]
            # Height, x, y, half widths along x and y.
            rows = [
                (0.102, x, 0.0300, 0.0170, 0.0160), (0.092, x + bend[0], 0.0345, 0.0150, 0.0140),
                (0.079, x + bend[0], 0.0390, 0.0130, 0.0120), (0.065, x, 0.0435, 0.0115, 0.0110),
                (0.050, x + bend[1] / 2, 0.0480, 0.0105, 0.0105), (0.035, x + bend[1], 0.0520, 0.0100, 0.0100),
                (0.021, x + bend[1], 0.0545, 0.0100, 0.0100), (0.014, x + bend[1] / 2, 0.0550, 0.0125, 0.0120),
                (0.000, x + bend[1] / 2, 0.0550, 0.0150, 0.0145),
            ]
            line = [([px, sign * y, z], [0, 0, -1], wide, deep) for z, px, y, wide, deep in rows]
            mesh.sweep(boundary(grid, (ring, 2, column, 2)), line, [1, 0, 0], [0, 0, 0])
    # Neck and head in the plane y = 0: x, z, angle of the way in degrees, half widths across and along.
    rows = [
        (0.070, 0.200, 65, 0.0240, 0.0250), (0.077, 0.213, 62, 0.0205, 0.0205), (0.084, 0.225, 56, 0.0185, 0.0175),
        (0.092, 0.2345, 42, 0.0175, 0.0160), (0.102, 0.2415, 20, 0.0170, 0.0160), (0.1135, 0.2425, -8, 0.0170, 0.0160),
        (0.1245, 0.2375, -32, 0.0165, 0.0160), (0.135, 0.2275, -43, 0.0145, 0.0145), (0.145, 0.2165, -46, 0.0125, 0.0120),
        (0.1545, 0.2065, -46, 0.0100, 0.0095),
    ]
    turned = [([x, 0, z], [math.cos(math.radians(a)), 0, math.sin(math.radians(a))], w, d) for x, z, a, w, d in rows]
    mesh.sweep(boundary(grid, NECK), turned, [0, 1, 0], [0.0022, 0, -0.0023])
    rows = [
        (-0.111, 0.181, 165, 0.0095, 0.0085), (-0.124, 0.180, 190, 0.0080, 0.0075), (-0.136, 0.174, 220, 0.0080, 0.0075),
        (-0.143, 0.162, 250, 0.0085, 0.0080), (-0.146, 0.147, 265, 0.0090, 0.0085), (-0.147, 0.131, 270, 0.0090, 0.0085),
        (-0.147, 0.115, 270, 0.0075, 0.0070), (-0.147, 0.101, 270, 0.0045, 0.0045),
    ]
    turned = [([x, 0, z], [math.cos(math.radians(a)), 0, math.sin(math.radians(a))], w, d) for x, z, a, w, d in rows]
    mesh.sweep(boundary(grid, TAIL), turned, [0, 1, 0], [0, 0, -0.004])
    return mesh


def checked(mesh):
    """The mesh, if it is closed, wound outwards and without flat faces."""
    edges = {}
    for face in mesh.faces:
        for k in range(3):
            edge = (face[k], face[(k + 1) % 3])
            assert edge not in edges, f"edge {edge} has two faces on one side"
            edges[edge] = face
    assert all((b, a) in edges for a, b in edges), "the mesh is open"
    volume = 0.0
    for face in mesh.faces:
        a, b, c = (mesh.points[k] for k in face)
        normal = cross(minus(b, a), minus(c, a))
        assert math.hypot(*normal) > 1e-7, f"face {face} is flat"
        volume += sum(p * q for p, q in zip(a, normal)) / 6
    assert volume > 0, "wound inwards"
    extents = [max(p[k] for p in mesh.points) - min(p[k] for p in mesh.points) for k in range(3)]
    print(f"{len(mesh.points)} vertices, {len(mesh.faces)} triangles, {volume * 1e6:.1f} cm3, extents {extents}")
    return mesh


def without_unused_points(mesh):
    used = sorted({k for face in mesh.faces for k in face})
    place = {k: n for n, k in enumerate(used)}
    mesh.points = [mesh.points[k] for k in used]
    mesh.faces = [tuple(place[k] for k in face) for face in mesh.faces]
    return mesh


def files():
    """The text of every file, by name."""
    mesh = checked(without_unused_points(horse()))
    lines = ["# Written by assets/objects/make_horse.py"]
    lines += ["v " + " ".join(f"{value:.6f}" for value in point) for point in mesh.points]
    lines += ["f " + " ".join(str(k + 1) for k in face) for face in mesh.faces]
    return {"horse.obj": "\n".join(lines) + "\n"}


def main():
    for name, text in files().items():
        (Path(__file__).parent / name).write_text(text)


if __name__ == "__main__":
    main()
