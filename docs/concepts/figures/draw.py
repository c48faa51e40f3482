#!/usr/bin/env python3
"""Draws the figures of the concept pages: SVG files beside this script.

    python3 docs/concepts/figures/draw.py            # writes them
    python3 docs/concepts/figures/draw.py --check    # exit code 1 where a file differs from what would be written

The planar grasps are computed, not sketched: friction cones, the wrenches that contacts exert, closure, and margins.
"""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
COLOURS = ["#1f77b4", "#d95f02", "#2a9d5c", "#8e44ad"]
INK, GREY, LIGHT, BAD = "#222222", "#888888", "#dddddd", "#c0392b"


class Picture:
    """An SVG with a white ground, so that it can be read on pages of any colour."""

    def __init__(self, width: int, height: int, title: str) -> None:
        self.width, self.height = width, height
        self.parts = [f"<title>{title}</title>", f'<rect width="{width}" height="{height}" fill="#ffffff"/>']

    def line(self, a, b, colour=INK, width=1.5, dash=""):
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<line x1="{a[0]:.2f}" y1="{a[1]:.2f}" x2="{b[0]:.2f}" y2="{b[1]:.2f}" stroke="{colour}" stroke-width="{width}"{dashed}/>'
        )

    def arrow(self, a, b, colour=INK, width=2.0):
        self.line(a, b, colour, width)
        angle = math.atan2(b[1] - a[1], b[0] - a[0])
        wings = [(b[0] - 9 * math.cos(angle + turn), b[1] - 9 * math.sin(angle + turn)) for turn in (-0.4, 0.4)]
        self.polygon([b, *wings], fill=colour, stroke="none")

    def polygon(self, points, fill="none", stroke=INK, width=1.5, opacity=1.0, closed=True):
        text = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
        tag = "polygon" if closed else "polyline"
        self.parts.append(
            f'<{tag} points="{text}" fill="{fill}" fill-opacity="{opacity}" stroke="{stroke}" stroke-width="{width}" stroke-linejoin="round"/>'
        )

    def circle(self, centre, radius, fill="none", stroke=INK, width=1.5, opacity=1.0, dash=""):
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<circle cx="{centre[0]:.2f}" cy="{centre[1]:.2f}" r="{radius:.2f}" fill="{fill}" fill-opacity="{opacity}" stroke="{stroke}" stroke-width="{width}"{dashed}/>'
        )

    def text(self, at, words, size=14, colour=INK, anchor="middle"):
        self.parts.append(
            f'<text x="{at[0]:.2f}" y="{at[1]:.2f}" font-family="sans-serif" font-size="{size}" fill="{colour}" text-anchor="{anchor}">{words}</text>'
        )

    def svg(self) -> str:
        head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" width="{self.width}" height="{self.height}">'
        return "\n".join([head, *self.parts, "</svg>"]) + "\n"


# ---- planar grasps of a disc: a contact is an angle; its inward normal points at the centre ----


def on_disc(centre, radius, degrees):
    angle = math.radians(degrees)
    return (centre[0] + radius * math.cos(angle), centre[1] - radius * math.sin(angle))


def edge_forces(degrees, friction):
    """The two edges of the friction cone at a contact, for a unit normal force, in axes with y up."""
    angle = math.radians(degrees)
    normal, across = (-math.cos(angle), -math.sin(angle)), (-math.sin(angle), math.cos(angle))
    return [(normal[0] + side * friction * across[0], normal[1] + side * friction * across[1]) for side in (-1, 1)]


def wrenches(contacts, friction):
    """Force and torque (over the radius) of every cone edge. On a disc the torque is the tangential force."""
    found = []
    for degrees in contacts:
        for side, force in zip((-1, 1), edge_forces(degrees, friction)):
            found.append((force[0], force[1], side * friction))
    return found


def hull_2d(points):
    """Convex hull, counter-clockwise."""
    points = sorted(set((round(x, 12), round(y, 12)) for x, y in points))
    def half(ordered):
        chain = []
        for p in ordered:
            while len(chain) > 1 and cross(chain[-2], chain[-1], p) <= 1e-12:
                chain.pop()
            chain.append(p)
        return chain[:-1]
    return half(points) + half(points[::-1])


def cross(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def ball_radius(hull):
    """Radius of the largest ball about the origin in a hull in counter-clockwise order; below zero outside."""
    least = math.inf
    for a, b in zip(hull, hull[1:] + hull[:1]):
        least = min(least, cross(a, b, (0.0, 0.0)) / math.dist(a, b))
    return least


def is_closed(contacts, friction):
    """Force closure in the plane: the origin is inside the hull of the wrenches. By the planes through any three of them."""
    points = wrenches(contacts, friction)
    for i in range(len(points)):
        for j in range(i + 1, len(points)):
            for k in range(j + 1, len(points)):
                a, b, c = points[i], points[j], points[k]
                u, v = [b[n] - a[n] for n in range(3)], [c[n] - a[n] for n in range(3)]
                normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
                if sum(x * x for x in normal) < 1e-18:
                    continue
                height = [sum(n * (p[m] - a[m]) for m, n in enumerate(normal)) for p in points]
                origin = -sum(n * x for n, x in zip(normal, a))
                if max(height) < 1e-9 and origin > -1e-9 or min(height) > -1e-9 and origin < 1e-9:
                    return False
    return True


def draw_grasp(picture, centre, radius, contacts, friction, lifted=()):
    """A disc with fingertips, cones and normals; contacts in `lifted` have no cone and stand off."""
    picture.circle(centre, radius, fill="#f4f1e8", stroke=INK, width=2)
    for index, degrees in enumerate(contacts):
        colour = COLOURS[index % 4]
        point = on_disc(centre, radius, degrees)
        if index in lifted:
            picture.circle(on_disc(centre, radius + 34, degrees), 13, fill="#ffffff", stroke=colour, width=2, dash="4 3")
            continue
        picture.circle(on_disc(centre, radius + 13, degrees), 13, fill=colour, stroke="none", opacity=0.35)
        edges = [(point[0] + 46 * x, point[1] - 46 * y) for x, y in edge_forces(degrees, friction)]
        picture.polygon([point, *edges], fill=colour, stroke=colour, width=1, opacity=0.25)
        inward = on_disc(centre, radius - 46, degrees)
        picture.arrow(point, inward, colour, 1.8)
        picture.circle(point, 3.5, fill=colour, stroke="none")


FRICTION = 0.4


def force_closure():
    picture = Picture(760, 330, "Force closure: three contacts that hold the object, and three that do not")
    closed, open_ = [90, 210, 330], [210, 270, 330]
    assert is_closed(closed, FRICTION) and not is_closed(open_, FRICTION)
    draw_grasp(picture, (190, 165), 90, closed, FRICTION)
    picture.text((190, 312), "closed: some contact forces balance any push")
    draw_grasp(picture, (570, 165), 90, open_, FRICTION)
    picture.arrow((570, 20), (570, 4), BAD, 3)
    picture.line((570, 75), (570, 10), BAD, 3)
    picture.text((584, 30), "nothing resists this push", 13, BAD, "start")
    picture.text((570, 312), "not closed: no contact can push down")
    return picture


def margin():
    picture = Picture(760, 350, "Closure margin: the largest ball of wrenches that the contacts resist")
    for left, contacts, name in ((0, [90, 210, 330], "well spread"), (380, [55, 125, 270], "two contacts close together")):
        assert is_closed(contacts, FRICTION)
        draw_grasp(picture, (left + 100, 150), 58, contacts, FRICTION)
        forces = [(x, y) for x, y, _ in wrenches(contacts, FRICTION)]
        hull = hull_2d(forces)
        radius = ball_radius(hull)
        centre, scale = (left + 285, 150), 78
        picture.polygon([(centre[0] + scale * x, centre[1] - scale * y) for x, y in hull], fill="#bcd7ee", stroke=COLOURS[0], opacity=0.6)
        picture.circle(centre, scale * radius, fill="#f9c78b", stroke=COLOURS[1], opacity=0.8)
        picture.line((centre[0] - 88, centre[1]), (centre[0] + 88, centre[1]), GREY, 0.8)
        picture.line((centre[0], centre[1] - 110), (centre[0], centre[1] + 110), GREY, 0.8)
        picture.arrow(centre, (centre[0] + scale * radius * math.cos(0.6), centre[1] - scale * radius * math.sin(0.6)), INK, 1.5)
        picture.text((left + 190, 312), f"{name}: radius {radius:.2f}")
    picture.text((380, 340), "blue: forces that the contacts exert with normal forces that sum to 1 (torques left out); orange: the ball", 13, GREY)
    return picture


def release_rule():
    picture = Picture(760, 330, "Release rule: a finger may lift only if the other fingers hold the object")
    good, bad = [50, 145, 262, 325], [90, 210, 270, 330]
    rest_good, rest_bad = [good[i] for i in (0, 1, 2)], [bad[i] for i in (1, 2, 3)]
    assert is_closed(good, FRICTION) and is_closed(rest_good, FRICTION)
    assert is_closed(bad, FRICTION) and not is_closed(rest_bad, FRICTION)
    draw_grasp(picture, (190, 165), 80, good, FRICTION, lifted=(3,))
    picture.text((190, 302), "allowed: the other three are closed")
    draw_grasp(picture, (570, 165), 80, bad, FRICTION, lifted=(0,))
    picture.text((570, 302), "refused: without the top finger", 14, BAD)
    picture.text((570, 320), "nothing can push down", 14, BAD)
    return picture


def grasp_subspaces():
    picture = Picture(840, 300, "A transfer and a regrasp of a planar four-fingered hand")
    steps = [
        ("GS_4: all four hold", [45, 135, 225, 315], (), 0),
        ("transfer: the object turns", [75, 165, 255, 345], (), 30),
        ("regrasp: one finger lifts (GS_3)", [75, 165, 255, 345], (3,), 30),
        ("it lands elsewhere: GS_4 again", [75, 165, 255, 315], (), 30),
    ]
    for index, (words, contacts, lifted, turn) in enumerate(steps):
        held = [c for i, c in enumerate(contacts) if i not in lifted]
        assert is_closed(held, FRICTION), words
        centre = (105 + 210 * index, 130)
        draw_grasp(picture, centre, 58, contacts, FRICTION, lifted)
        picture.line(centre, on_disc(centre, 30, 90 + turn), INK, 3)
        picture.text((centre[0], 250), words, 13)
        if index:
            picture.arrow((centre[0] - 115, 130), (centre[0] - 95, 130), GREY, 2)
    picture.text((420, 285), "the black mark turns with the object; a dashed ring is a finger in the air", 13, GREY)
    return picture


def rolling():
    picture = Picture(760, 300, "A round fingertip rolls: the contact travels the same way on both surfaces")
    ground, radius = 210, 60
    for left, words, rolls in ((60, "rolling: both contact points travel the same way, no slip", True), (440, "contact kept: the fingertip pivots and slips", False)):
        picture.line((left - 30, ground), (left + 300, ground), INK, 2.5)
        travel = radius * math.radians(80) if rolls else 0
        a, b = (left + 50, ground - radius), (left + 50 + (travel or 100), ground - radius)
        if not rolls:
            b = a
        for centre, angle, faint in ((a, 0, True), (b, 80, False)):
            colour = LIGHT if faint and rolls else COLOURS[0]
            picture.circle(centre, radius, fill="none", stroke=colour, width=2.5)
            mark = (centre[0] - radius * math.sin(math.radians(angle)), centre[1] + radius * math.cos(math.radians(angle)))
            picture.line(centre, mark, colour, 2)
            picture.circle(mark, 5, fill=COLOURS[1], stroke="none")
        if rolls:
            picture.line((a[0], ground), (b[0], ground), COLOURS[1], 5)
            arc = [(b[0] - radius * math.sin(math.radians(t)), b[1] + radius * math.cos(math.radians(t))) for t in range(0, 81, 4)]
            picture.polygon(arc, stroke=COLOURS[1], width=5, closed=False)
            picture.text((a[0] + travel / 2, ground + 22), f"{radius * math.radians(80) / 5:.1f} mm on the object", 13)
            picture.text((b[0] - radius - 8, b[1] + 4), f"{radius * math.radians(80) / 5:.1f} mm on the tip", 13, INK, "end")
        else:
            arc = [(a[0] - radius * math.sin(math.radians(t)), a[1] + radius * math.cos(math.radians(t))) for t in range(0, 81, 4)]
            picture.polygon(arc, stroke=BAD, width=5, closed=False)
            picture.text((a[0] + 90, ground + 22), "0 mm on the object", 13)
            picture.text((a[0] + radius + 12, a[1]), f"{radius * math.radians(80) / 5:.1f} mm of slip", 13, BAD, "start")
        picture.text((left + 130, 280), words, 13)
    return picture


def roadmap():
    picture = Picture(760, 340, "A roadmap: grasps as nodes, transfers and relocations as edges, one query")
    places = [(90, 90), (90, 230), (250, 70), (250, 165), (250, 260), (410, 90), (410, 220), (560, 120), (560, 250)]
    transfers = [(0, 2), (1, 4), (2, 5), (3, 6), (4, 6), (5, 7), (6, 8)]
    regrasps = [(0, 1), (2, 3), (3, 4), (5, 6), (7, 8)]
    answer = {(1, 4), (4, 6), (5, 6), (5, 7)}
    for edges, dash in ((transfers, ""), (regrasps, "6 5")):
        for a, b in edges:
            chosen = (a, b) in answer
            picture.line(places[a], places[b], COLOURS[1] if chosen else GREY, 4 if chosen else 1.6, dash)
    for x, y in places:
        picture.circle((x, y), 9, fill="#ffffff", stroke=COLOURS[0], width=2.5)
    start, goal = (40, 285), (690, 60)
    picture.line(start, places[1], COLOURS[1], 4)
    picture.line(goal, places[7], COLOURS[1], 4)
    for at, words, below in ((start, "start", 26), (goal, "goal", -16)):
        picture.circle(at, 8, fill=COLOURS[2], stroke="none")
        picture.text((at[0], at[1] + below), words)
    picture.text((380, 325), "node: object pose and contacts; solid edge: transfer; dashed edge: regrasp; orange: the answer to a query", 13, GREY)
    return picture


FIGURES = {
    "force-closure": force_closure,
    "margin": margin,
    "release-rule": release_rule,
    "grasp-subspaces": grasp_subspaces,
    "rolling": rolling,
    "roadmap": roadmap,
}


def main() -> int:
    stale = []
    for name, draw in FIGURES.items():
        path, text = HERE / f"{name}.svg", draw().svg()
        if "--check" in sys.argv[1:]:
            if not path.is_file() or path.read_text(encoding="utf-8") != text:
                stale.append(path.name)
        else:
            path.write_text(text, encoding="utf-8")
    if stale:
        print(f"not as drawn by {Path(__file__).name}: {', '.join(stale)}; run it without --check", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
