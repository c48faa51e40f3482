//! Shortest paths on a triangle mesh, between points inside its triangles.
//!
//! Xin, Wang 2007, "Efficiently determining a locally exact shortest path on polyhedral surfaces": a strip of
//! triangles is unrolled, the funnel algorithm (Lee, Preparata 1984) pulls the path taut in it, and where the path
//! hangs on a vertex with less than pi of surface on the other side, the strip is led round that side. These are the
//! steps of Sharp, Crane 2020 (FlipOut) on a strip instead of on an intrinsic triangulation; the result is the same
//! kind of path: locally shortest, and in practice within a few percent of the shortest.

use super::{MeshSurface, barycentric};
use crate::frame::Point;
use crate::surface::SurfacePoint;
use crate::surface::geodesic::{Bend, Geodesic, Leg};
use crate::surface::mesh_topology::{NONE, angle_at};
use crate::surface::sparse::Sparse;
use nalgebra::Vector2;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::PI;

/// Angle below pi at which a strip is led round the other side of a vertex, in radians.
const ANGLE_SLACK: f64 = 1e-9;

/// The edge between two triangles of a strip, unrolled; left and right as seen along the strip.
#[derive(Debug, Clone, Copy)]
struct Portal {
    left: Vector2<f64>,
    right: Vector2<f64>,
    left_vertex: u32,
    right_vertex: u32,
}

/// A taut path in a strip.
struct TautPath {
    /// Where each portal is crossed, as the share of the way from its right to its left end.
    shares: Vec<f64>,
    /// Vertices on which the path hangs: portal and vertex.
    bends: Vec<(usize, u32)>,
}

pub(super) fn geodesic(mesh: &MeshSurface, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic> {
    // Two first guesses, because each misjudges some meshes: triangles those with long thin fans, edges those where
    // they all run aslant.
    let first = straightened(mesh, strip_over_triangles(mesh, a, b)?, a, b);
    let Some(strip) = strip_over_vertices(mesh, a, b) else { return Some(first) };
    let second = straightened(mesh, strip, a, b);
    Some(if second.length() < first.length() { second } else { first })
}

fn straightened(mesh: &MeshSurface, mut strip: Vec<u32>, a: &SurfacePoint, b: &SurfacePoint) -> Geodesic {
    let mut portals = Vec::new();
    // Every change shortens the path, so this ends; the cap is for rounding.
    let mut n_left = 10_000;
    loop {
        let end = unroll(mesh, &strip, a, b, &mut portals);
        let path = pull_taut(&portals, end);
        n_left -= 1;
        if n_left == 0 || !lead_round_vertices(mesh, &mut strip, &portals, &path, a, b) {
            return Geodesic::of_legs(legs(mesh, &strip, &portals, &path, a, b));
        }
    }
}

/// The strip along the shortest way over edges, from a corner of the triangle of `a` to one of that of `b`: A* over
/// vertices. None where a fan is interrupted by an open edge.
fn strip_over_vertices(mesh: &MeshSurface, a: &SurfacePoint, b: &SurfacePoint) -> Option<Vec<u32>> {
    // Cost, the vertex before, and a triangle at the vertex.
    let mut reached = Sparse::new((f64::INFINITY, NONE, NONE));
    let mut heap = BinaryHeap::new();
    let to_goal = |v: u32| (mesh.vertices[v as usize] - b.point_in_object).norm();
    let key = |total: f64, v: u32| Reverse((total.to_bits(), v));
    for v in mesh.topology.triangles[a.facet as usize] {
        let cost = (mesh.vertices[v as usize] - a.point_in_object).norm();
        reached.set(v, (cost, NONE, a.facet));
        heap.push(key(cost + to_goal(v), v));
    }
    let mut fan = Vec::new();
    let goals = mesh.topology.triangles[b.facet as usize];
    let last = loop {
        let Reverse((total, v)) = heap.pop()?;
        if goals.contains(&v) {
            break v;
        }
        let (cost, _, triangle) = reached.get(v);
        if f64::from_bits(total) > cost + to_goal(v) {
            continue;
        }
        mesh.topology.fan(triangle as usize, mesh.topology.corner_at(triangle as usize, v)?, |_, _| false, &mut fan);
        for &i in &fan {
            for w in mesh.topology.triangles[i as usize] {
                let next = cost + (mesh.vertices[w as usize] - mesh.vertices[v as usize]).norm();
                if next < reached.get(w).0 {
                    reached.set(w, (next, v, i));
                    heap.push(key(next + to_goal(w), w));
                }
            }
        }
    };
    let mut way = vec![last];
    loop {
        let (_, before, _) = reached.get(way[way.len() - 1]);
        if before == NONE {
            break;
        }
        way.push(before);
    }
    way.reverse();
    let mut strip = vec![a.facet];
    for (i, &v) in way.iter().enumerate() {
        let is_goal = |j: u32| match way.get(i + 1) {
            Some(next) => mesh.topology.triangles[j as usize].contains(next),
            None => j == b.facet,
        };
        let at = strip[strip.len() - 1];
        strip.extend(round_vertex(mesh, at, v, is_goal)?);
    }
    Some(without_loops(&strip))
}

/// Triangles after `start` on the way round `vertex` to the first for which `is_goal` holds, by the side with fewer.
fn round_vertex(mesh: &MeshSurface, start: u32, vertex: u32, is_goal: impl Fn(u32) -> bool) -> Option<Vec<u32>> {
    if is_goal(start) {
        return Some(Vec::new());
    }
    let by_side = |side: usize| {
        let (mut way, mut at) = (Vec::new(), start);
        loop {
            let corner = mesh.topology.corner_at(at as usize, vertex)?;
            at = mesh.topology.neighbours[at as usize][(corner + side) % 3];
            if at == NONE || at == start {
                return None;
            }
            way.push(at);
            if is_goal(at) {
                return Some(way);
            }
        }
    };
    match (by_side(0), by_side(2)) {
        (Some(one), Some(other)) => Some(if other.len() < one.len() { other } else { one }),
        (one, other) => one.or(other),
    }
}

/// The strip without what lies between two visits to the same triangle: a shortest path visits none twice.
fn without_loops(strip: &[u32]) -> Vec<u32> {
    let mut kept: Vec<u32> = Vec::with_capacity(strip.len());
    let mut place_of = BTreeMap::new();
    for &i in strip {
        match place_of.get(&i) {
            Some(&place) => {
                for dropped in kept.drain(place + 1..) {
                    place_of.remove(&dropped);
                }
            }
            None => {
                place_of.insert(i, kept.len());
                kept.push(i);
            }
        }
    }
    kept
}

/// Triangles from that of `a` to that of `b`: A* over triangles, each standing at the middle of the edge by which it is
/// entered.
fn strip_over_triangles(mesh: &MeshSurface, a: &SurfacePoint, b: &SurfacePoint) -> Option<Vec<u32>> {
    let (start, goal) = (a.facet, b.facet);
    // Cost, where one stands, and the triangle before.
    let mut reached = Sparse::new((f64::INFINITY, Point::origin(), NONE));
    let mut heap = BinaryHeap::new();
    let goal_point = b.point_in_object;
    let key = |total: f64, i: u32| Reverse((total.to_bits(), i));
    reached.set(start, (0.0, a.point_in_object, NONE));
    heap.push(key((goal_point - a.point_in_object).norm(), start));
    while let Some(Reverse((total, i))) = heap.pop() {
        if i == goal {
            let mut strip = vec![goal];
            let mut at = goal;
            while at != start {
                at = reached.get(at).2;
                strip.push(at);
            }
            strip.reverse();
            return Some(strip);
        }
        let (cost, at, _) = reached.get(i);
        if f64::from_bits(total) > cost + (goal_point - at).norm() {
            continue;
        }
        let corners = mesh.corners(i);
        for k in 0..3 {
            let j = mesh.topology.neighbours[i as usize][k];
            if j == NONE {
                continue;
            }
            let middle = toward(&corners[k], &corners[(k + 1) % 3], &at, &goal_point);
            let next_cost = cost + (middle - at).norm();
            if next_cost < reached.get(j).0 {
                reached.set(j, (next_cost, middle, i));
                heap.push(key(next_cost + (goal_point - middle).norm(), j));
            }
        }
    }
    None
}

/// Lays the strip flat, with the start at the origin; fills `portals` and returns where the end comes to lie.
fn unroll(
    mesh: &MeshSurface,
    strip: &[u32],
    a: &SurfacePoint,
    b: &SurfacePoint,
    portals: &mut Vec<Portal>,
) -> Vector2<f64> {
    portals.clear();
    let [p, q, r] = mesh.corners(strip[0]);
    let x = (q - p).normalize();
    let y = (q - p).cross(&(r - p)).normalize().cross(&x);
    let flat = |point: &Point| Vector2::new((point - a.point_in_object).dot(&x), (point - a.point_in_object).dot(&y));
    let mut vertices = mesh.topology.triangles[strip[0] as usize];
    let mut corners = [flat(&p), flat(&q), flat(&r)];
    for pair in strip.windows(2) {
        let (here, next) = (pair[0] as usize, pair[1]);
        let k = (0..3).find(|&k| mesh.topology.neighbours[here][k] == next).expect("a strip joins neighbours");
        let (m, n) = (k, (k + 1) % 3);
        let (right_vertex, left_vertex) = (vertices[m], vertices[n]);
        let (right, left) = (corners[m], corners[n]);
        portals.push(Portal { left, right, left_vertex, right_vertex });
        let next_vertices = mesh.topology.triangles[next as usize];
        let apex = (0..3)
            .find(|&k| next_vertices[k] != left_vertex && next_vertices[k] != right_vertex)
            .expect("a triangle has three different corners");
        let vertex = |i: u32| mesh.vertices[i as usize];
        let edge = vertex(left_vertex) - vertex(right_vertex);
        let to_apex = vertex(next_vertices[apex]) - vertex(right_vertex);
        let length = edge.norm();
        let along = (left - right) / length;
        let outward = Vector2::new(along.y, -along.x);
        let apex_at = right + along * (to_apex.dot(&edge) / length) + outward * (to_apex.cross(&edge).norm() / length);
        vertices = next_vertices;
        corners = vertices.map(|v| match v {
            v if v == left_vertex => left,
            v if v == right_vertex => right,
            _ => apex_at,
        });
    }
    let weights = barycentric(&mesh.corners(b.facet), &b.point_in_object);
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// The funnel algorithm from the origin through all portals to `end`.
fn pull_taut(portals: &[Portal], end: Vector2<f64>) -> TautPath {
    let n = portals.len();
    let target = Portal { left: end, right: end, left_vertex: NONE, right_vertex: NONE };
    let portal = |i: usize| if i < n { portals[i] } else { target };
    let mut bends = Vec::new();
    let mut shares = vec![0.0; n];
    let mut done = 0;
    let mut cross_up_to = |from: Vector2<f64>, to: Vector2<f64>, last: usize| {
        for i in done..last.min(n) {
            let (left, right) = (portals[i].left, portals[i].right);
            let (l, r) = (cross(to - from, left - from), cross(from - to, right - from));
            shares[i] = if l + r > 0.0 { (r / (l + r)).clamp(0.0, 1.0) } else { 0.5 };
            // A path that ends on a portal's end crosses it exactly there.
            if left == to || left == from {
                shares[i] = 1.0;
            } else if right == to || right == from {
                shares[i] = 0.0;
            }
        }
        done = done.max(last);
    };
    let mut apex = Vector2::zeros();
    let (mut left, mut right) = (portal(0).left, portal(0).right);
    let (mut left_at, mut right_at) = (0, 0);
    let mut i = 1;
    while i <= n {
        let next = portal(i);
        if cross(right - apex, next.right - apex) >= 0.0 {
            if apex == right || cross(left - apex, next.right - apex) < 0.0 {
                (right, right_at) = (next.right, i);
            } else {
                bends.push((left_at, portal(left_at).left_vertex));
                cross_up_to(apex, left, left_at + 1);
                apex = left;
                (left_at, right_at, right) = (left_at, left_at, apex);
                i = left_at + 1;
                continue;
            }
        }
        if cross(left - apex, next.left - apex) <= 0.0 {
            if apex == left || cross(right - apex, next.left - apex) > 0.0 {
                (left, left_at) = (next.left, i);
            } else {
                bends.push((right_at, portal(right_at).right_vertex));
                cross_up_to(apex, right, right_at + 1);
                apex = right;
                (left_at, left) = (right_at, apex);
                i = right_at + 1;
                continue;
            }
        }
        i += 1;
    }
    cross_up_to(apex, end, n);
    bends.retain(|&(i, _)| i < n);
    TautPath { shares, bends }
}

fn crossing(mesh: &MeshSurface, portal: &Portal, share: f64) -> Point {
    let (left, right) = (mesh.vertices[portal.left_vertex as usize], mesh.vertices[portal.right_vertex as usize]);
    right + (left - right) * share
}

/// Changes the strip at every vertex where that shortens the path; false when there is none.
fn lead_round_vertices(
    mesh: &MeshSurface,
    strip: &mut Vec<u32>,
    portals: &[Portal],
    path: &TautPath,
    a: &SurfacePoint,
    b: &SurfacePoint,
) -> bool {
    let touches = |i: usize, vertex: u32| portals[i].left_vertex == vertex || portals[i].right_vertex == vertex;
    let mut changed = false;
    // From the end, so that places in the strip before the change stay what they are.
    let mut untouched = strip.len();
    for &(at, vertex) in path.bends.iter().rev() {
        let (mut first, mut last) = (at, at);
        while first > 0 && touches(first - 1, vertex) {
            first -= 1;
        }
        while last + 1 < portals.len() && touches(last + 1, vertex) {
            last += 1;
        }
        // The triangles first..=last + 1 lie round the vertex.
        if last + 1 >= untouched {
            continue;
        }
        let before =
            if first == 0 { a.point_in_object } else { crossing(mesh, &portals[first - 1], path.shares[first - 1]) };
        let after = if last + 1 == portals.len() {
            b.point_in_object
        } else {
            crossing(mesh, &portals[last + 1], path.shares[last + 1])
        };
        let Some(way) = other_way(mesh, strip, first, last, vertex, &before, &after) else { continue };
        strip.splice(first..=last + 1, way);
        untouched = first + 1;
        changed = true;
    }
    if changed {
        *strip = without_loops(strip);
    }
    changed
}

/// The triangles on the other side of `vertex`, when there is less than pi between the path's two pieces there.
fn other_way(
    mesh: &MeshSurface,
    strip: &[u32],
    first: usize,
    last: usize,
    vertex: u32,
    before: &Point,
    after: &Point,
) -> Option<Vec<u32>> {
    let center = mesh.vertices[vertex as usize];
    if (before - center).norm() == 0.0 || (after - center).norm() == 0.0 {
        return None;
    }
    let (start, goal) = (strip[first], strip[last + 1]);
    // The edge at the vertex by which the strip does not leave its first triangle.
    let corner = mesh.topology.corner_at(start as usize, vertex)?;
    let leaves_by_next = mesh.topology.neighbours[start as usize][corner] == strip[first + 1];
    let mut side = if leaves_by_next { 2 } else { 0 };
    let other_end = |i: u32, side: usize| -> Option<Point> {
        let corner = mesh.topology.corner_at(i as usize, vertex)?;
        Some(mesh.corners(i)[if side == 0 { (corner + 1) % 3 } else { (corner + 2) % 3 }])
    };
    let mut way = vec![start];
    let mut angle;
    if start == goal && last > first {
        // The strip goes all the way round.
        angle = 0.0;
    } else {
        angle = angle_at(&center, before, &other_end(start, side)?);
        let mut at = start;
        loop {
            let corner = mesh.topology.corner_at(at as usize, vertex)?;
            let next = mesh.topology.neighbours[at as usize][(corner + side) % 3];
            if next == NONE || way.len() > mesh.n_triangles() {
                return None;
            }
            // Neighbours wound alike pass the fan in the same sense.
            way.push(next);
            at = next;
            if at == goal {
                break;
            }
            let corner = mesh.topology.corner_at(at as usize, vertex)?;
            let [p, q, r] = mesh.corners(at);
            let ends = [p, q, r];
            angle += angle_at(&center, &ends[(corner + 1) % 3], &ends[(corner + 2) % 3]);
        }
        // The goal is entered by the edge at the vertex that the strip does not enter it by.
        let corner = mesh.topology.corner_at(goal as usize, vertex)?;
        let entered_by_next = mesh.topology.neighbours[goal as usize][corner] == strip[last];
        side = if entered_by_next { 2 } else { 0 };
        angle += angle_at(&center, &other_end(goal, side)?, after);
    }
    (angle < PI - ANGLE_SLACK).then_some(way)
}

fn legs(
    mesh: &MeshSurface,
    strip: &[u32],
    portals: &[Portal],
    path: &TautPath,
    a: &SurfacePoint,
    b: &SurfacePoint,
) -> Vec<Leg> {
    let mut legs = Vec::with_capacity(strip.len());
    let mut start = a.point_in_object;
    for (i, &facet) in strip.iter().enumerate() {
        let end = if i < portals.len() { crossing(mesh, &portals[i], path.shares[i]) } else { b.point_in_object };
        let (start_normal, end_normal) = (mesh.normal_at(facet, &start), mesh.normal_at(facet, &end));
        let length = (end - start).norm();
        legs.push(Leg { start, end, start_normal, end_normal, facet, bend: Bend::Straight, length });
        start = end;
    }
    legs
}

/// The point of the edge `pq`, but for its ends, that comes nearest to lying straight between `at` and `goal`.
fn toward(p: &Point, q: &Point, at: &Point, goal: &Point) -> Point {
    let (edge, way) = (q - p, goal - at);
    let (a, b, c) = (edge.norm_squared(), edge.dot(&way), way.norm_squared());
    let from = at - p;
    let (d, e) = (edge.dot(&from), way.dot(&from));
    let denominator = a * c - b * b;
    let share = if denominator > 1e-12 * a * c { (d * c - b * e) / denominator } else { 0.5 };
    p + edge * share.clamp(0.05, 0.95)
}
