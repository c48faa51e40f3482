//! Neighbours, parts, consistent winding and creases of a triangle mesh.

use super::SurfaceError;
use crate::frame::{Point, Vector};
use crate::mesh::{EdgeSide, edge_sides};
use std::f64::consts::PI;

/// No neighbour: an open edge, or one with more than two triangles.
pub(super) const NONE: u32 = u32::MAX;

/// Triangles that hang together over edges.
#[derive(Debug, Clone)]
pub(super) struct Topology {
    /// Triangles, wound alike within each part.
    pub triangles: Vec<[u32; 3]>,
    /// Triangle across the edge from corner `k` to corner `k + 1`.
    pub neighbours: Vec<[u32; 3]>,
    /// Part that each triangle belongs to.
    pub part_of: Vec<u32>,
    /// Triangles wound against the others of their part, and turned.
    pub n_turned: usize,
    /// Per part: edges without a neighbour, and edges in all.
    pub open_edges: Vec<(usize, usize)>,
}

impl Topology {
    pub fn new(triangles: &[[u32; 3]]) -> Result<Self, SurfaceError> {
        let neighbours = neighbours_of(triangles);
        let mut topology = Topology {
            triangles: triangles.to_vec(),
            neighbours,
            part_of: vec![NONE; triangles.len()],
            n_turned: 0,
            open_edges: Vec::new(),
        };
        let mut turned = vec![false; triangles.len()];
        let mut stack = Vec::new();
        for seed in 0..triangles.len() {
            if topology.part_of[seed] != NONE {
                continue;
            }
            let part = topology.open_edges.len() as u32;
            topology.part_of[seed] = part;
            let (mut open, mut all, mut members, mut n_turned) = (0, 0, vec![seed], 0);
            stack.push(seed);
            while let Some(i) = stack.pop() {
                for k in 0..3 {
                    all += 1;
                    let j = topology.neighbours[i][k] as usize;
                    if j == NONE as usize {
                        open += 1;
                        continue;
                    }
                    // Wound alike, the two walk their common edge in opposite directions.
                    let alike = !walks(&triangles[j], triangles[i][k], triangles[i][(k + 1) % 3]);
                    let turn = turned[i] == alike;
                    if topology.part_of[j] == NONE {
                        topology.part_of[j] = part;
                        turned[j] = turn;
                        n_turned += usize::from(turn);
                        members.push(j);
                        stack.push(j);
                    } else if turned[j] != turn {
                        return Err(SurfaceError::NotOrientable { triangle: j });
                    }
                }
            }
            // The majority keeps its winding.
            if 2 * n_turned > members.len() {
                members.iter().for_each(|&i| turned[i] = !turned[i]);
                n_turned = members.len() - n_turned;
            }
            topology.n_turned += n_turned;
            topology.open_edges.push((open, all));
        }
        for i in 0..triangles.len() {
            if turned[i] {
                topology.turn(i);
            }
        }
        Ok(topology)
    }

    /// Winds triangle `i` the other way.
    pub fn turn(&mut self, i: usize) {
        self.triangles[i].swap(1, 2);
        // Edges were 01, 12, 20 and are now 02, 21, 10.
        self.neighbours[i].swap(0, 2);
    }

    /// True when so few edges of `part` are open that it has an inside.
    pub fn encloses(&self, part: u32) -> bool {
        let (open, all) = self.open_edges[part as usize];
        20 * open < all
    }

    /// Corner of triangle `i` that is vertex `vertex`.
    pub fn corner_at(&self, i: usize, vertex: u32) -> Option<usize> {
        self.triangles[i].iter().position(|&v| v == vertex)
    }

    /// Triangles around corner `k` of triangle `i` in a fan that no edge for which `is_barrier` (triangle,
    /// edge) holds interrupts, `i` first.
    pub fn fan(&self, i: usize, k: usize, is_barrier: impl Fn(usize, usize) -> bool, out: &mut Vec<u32>) {
        out.clear();
        out.push(i as u32);
        let vertex = self.triangles[i][k];
        // First across the edge that leaves the vertex, then, unless the fan closed, across the one that enters it.
        for side in [0, 2] {
            let mut at = i;
            while let Some(corner) = self.corner_at(at, vertex) {
                let edge = (corner + side) % 3;
                let next = self.neighbours[at][edge];
                if next == NONE || is_barrier(at, edge) {
                    break;
                }
                if next as usize == i {
                    return;
                }
                if out.len() > self.triangles.len() {
                    break;
                }
                out.push(next);
                at = next as usize;
            }
        }
    }
}

/// True when the triangle has an edge from `a` to `b`.
fn walks(triangle: &[u32; 3], a: u32, b: u32) -> bool {
    (0..3).any(|k| triangle[k] == a && triangle[(k + 1) % 3] == b)
}

fn neighbours_of(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut neighbours = vec![[NONE; 3]; triangles.len()];
    for run in edge_sides(triangles).chunk_by(EdgeSide::same_edge) {
        if let [one, other] = run
            && one.triangle() != other.triangle()
        {
            neighbours[one.triangle()][one.corner()] = other.triangle() as u32;
            neighbours[other.triangle()][other.corner()] = one.triangle() as u32;
        }
    }
    neighbours
}

/// Unit normal of each triangle.
pub(super) fn face_normals(vertices: &[Point], triangles: &[[u32; 3]]) -> Vec<Vector> {
    let normal = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| vertices[i as usize]);
        (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vector::zeros)
    };
    triangles.iter().map(normal).collect()
}

/// Per triangle and edge: whether it is a crease, that is open, not manifold, or turning by more than `angle`.
pub(super) fn creases(topology: &Topology, normals: &[Vector], angle: f64) -> Vec<[bool; 3]> {
    let limit = angle.clamp(0.0, PI).cos();
    let is_crease = |i: usize, k: usize| {
        let j = topology.neighbours[i][k];
        j == NONE || normals[i].dot(&normals[j as usize]) < limit
    };
    (0..normals.len()).map(|i| [0, 1, 2].map(|k| is_crease(i, k))).collect()
}

/// Per triangle: number of the smooth patch it belongs to.
pub(super) fn patches(topology: &Topology, is_crease: &[[bool; 3]]) -> Vec<u32> {
    let mut patch_of = vec![NONE; is_crease.len()];
    let mut n_patches = 0;
    let mut stack = Vec::new();
    for seed in 0..is_crease.len() {
        if patch_of[seed] != NONE {
            continue;
        }
        patch_of[seed] = n_patches;
        stack.push(seed);
        while let Some(i) = stack.pop() {
            for k in 0..3 {
                let j = topology.neighbours[i][k];
                if !is_crease[i][k] && patch_of[j as usize] == NONE {
                    patch_of[j as usize] = n_patches;
                    stack.push(j as usize);
                }
            }
        }
        n_patches += 1;
    }
    patch_of
}

/// Interior angle of a triangle at `a`.
pub(super) fn angle_at(a: &Point, b: &Point, c: &Point) -> f64 {
    let (u, v) = (b - a, c - a);
    u.cross(&v).norm().atan2(u.dot(&v))
}
