//! What lies inside a mesh: the checker's way.
//!
//! A point is inside where the triangles wind about it by more than half a turn. Crossings of a ray are counted for the mesh
//! with its holes closed by cones, which is a whole number; then the cones are taken off by their solid angles. So holes cost
//! as much as they have edges, and a closed mesh costs one ray. Crossings are counted in the plane across the ray by the signs
//! of the same products for both triangles of an edge: none is lost and none is counted twice (the half-open rule for polygons).

use crate::frame::{Point, Vector};
use crate::mesh::{TriangleMesh, edge_sides};
use nalgebra::{Matrix3, Rotation3};
use std::f64::consts::PI;

/// Triangles of a leaf.
const LEAF_SIZE: usize = 8;

/// Tells which points a mesh holds.
#[derive(Debug, Clone)]
pub struct Inside {
    /// Rays run along the third axis of this frame, in which the faces of no usual mesh are upright.
    ray_from_mesh: Matrix3<f64>,
    /// In the frame of the rays; the last one is the apex of the cones, where there are any.
    vertices: Vec<Vector>,
    /// Triangles of the mesh and of the cones, in the order of the leaves.
    triangles: Vec<[u32; 3]>,
    nodes: Vec<Node>,
    /// Triangles of the cones that close the holes.
    cones: Vec<[u32; 3]>,
    /// 1, or -1 for a mesh that is wound inside out.
    orientation: f64,
}

#[derive(Debug, Clone)]
struct Node {
    low: [f64; 2],
    high: [f64; 2],
    top: f64,
    /// Leaf: first triangle; inner node: index of the left child, after which the right one's is `count`.
    first: u32,
    count: u32,
    is_leaf: bool,
}

impl Inside {
    /// Prepares a mesh.
    pub fn of(mesh: &TriangleMesh) -> Self {
        let turn = Rotation3::from_scaled_axis(Vector::new(0.4713, -0.8329, 0.6177));
        let ray_from_mesh = *turn.matrix();
        let mut vertices: Vec<Vector> = mesh.vertices().iter().map(|vertex| ray_from_mesh * vertex.coords).collect();
        let cones = cones(mesh.triangles(), vertices.len() as u32);
        if !cones.is_empty() {
            let (low, high) = mesh.bounds();
            // Beside the middle of the box, so that no symmetry puts a point that is asked for on a cone.
            let share = Vector::new(0.4687, 0.5231, 0.4419);
            vertices.push(ray_from_mesh * (low.coords + (high - low).component_mul(&share)));
        }
        let mut triangles = mesh.triangles().to_vec();
        triangles.extend(&cones);
        let mut nodes = Vec::new();
        build(&vertices, &mut triangles, 0, &mut nodes);
        let orientation = if mesh.signed_volume() < 0.0 { -1.0 } else { 1.0 };
        Inside { ray_from_mesh, vertices, triangles, nodes, cones, orientation }
    }

    /// True when `point`, in the mesh frame, is inside.
    pub fn holds(&self, point: &Point) -> bool {
        self.orientation * self.winding(point) > 0.5
    }

    /// Turns that the triangles of the mesh wind about `point`.
    pub fn winding(&self, point: &Point) -> f64 {
        let at = self.ray_from_mesh * point.coords;
        let of_cones: f64 = self.cones.iter().map(|cone| self.turns_of(cone, &at)).sum();
        f64::from(self.crossings(&at)) - of_cones
    }

    /// How often the ray from `at` upwards leaves the closed mesh, less how often it enters.
    fn crossings(&self, at: &Vector) -> i32 {
        let mut count = 0;
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let node: &Node = &self.nodes[index];
            let is_beside = (0..2).any(|k| at[k] < node.low[k] || at[k] > node.high[k]);
            if is_beside || node.top < at.z {
                continue;
            }
            if node.is_leaf {
                let first = node.first as usize;
                let triangles = &self.triangles[first..first + node.count as usize];
                count += triangles.iter().map(|triangle| self.crossing(triangle, at)).sum::<i32>();
            } else {
                stack.extend([node.first as usize, node.count as usize]);
            }
        }
        count
    }

    /// 1 where the ray leaves through the triangle, -1 where it enters, else 0.
    fn crossing(&self, triangle: &[u32; 3], at: &Vector) -> i32 {
        let corners = triangle.map(|i| self.vertices[i as usize] - at);
        let mut winding = 0;
        let mut sides = [0.0; 3];
        for k in 0..3 {
            let (a, b) = (&corners[k], &corners[(k + 1) % 3]);
            // Exactly the negative of what the neighbour finds for the same edge.
            let side = a.x * b.y - b.x * a.y;
            sides[(k + 2) % 3] = side;
            if a.y <= 0.0 && b.y > 0.0 && side > 0.0 {
                winding += 1;
            } else if a.y > 0.0 && b.y <= 0.0 && side < 0.0 {
                winding -= 1;
            }
        }
        if winding == 0 || corners.iter().all(|corner| corner.z < 0.0) {
            return 0;
        }
        if corners.iter().all(|corner| corner.z >= 0.0) {
            return winding;
        }
        // Where the ray meets the plane, by the corners' shares of the area.
        let area: f64 = sides.iter().sum();
        let height: f64 = (0..3).map(|k| sides[k] * corners[k].z).sum();
        if height * area > 0.0 { winding } else { 0 }
    }

    /// Turns that one triangle winds about `at` (Van Oosterom, Strackee 1983).
    fn turns_of(&self, triangle: &[u32; 3], at: &Vector) -> f64 {
        let [a, b, c] = triangle.map(|i| self.vertices[i as usize] - at);
        let [p, q, r] = [a.norm(), b.norm(), c.norm()];
        a.dot(&b.cross(&c)).atan2(p * q * r + a.dot(&b) * r + b.dot(&c) * p + c.dot(&a) * q) / (2.0 * PI)
    }
}

/// Triangles from the edges that are not walked both ways alike to `apex`; with them, every edge is.
fn cones(triangles: &[[u32; 3]], apex: u32) -> Vec<[u32; 3]> {
    let mut cones = Vec::new();
    for sides in edge_sides(triangles).chunk_by(|a, b| a.same_edge(b)) {
        let [low, high] = sides[0].ends();
        let n_up = sides.iter().filter(|side| triangles[side.triangle()][side.corner()] == low).count();
        let n_down = sides.len() - n_up;
        for _ in n_down..n_up {
            cones.push([high, low, apex]);
        }
        for _ in n_up..n_down {
            cones.push([low, high, apex]);
        }
    }
    cones
}

fn build(vertices: &[Vector], triangles: &mut [[u32; 3]], first: usize, nodes: &mut Vec<Node>) -> u32 {
    let corners = || triangles.iter().flatten().map(|&i| &vertices[i as usize]);
    let (mut low, mut high, mut top) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], f64::NEG_INFINITY);
    for corner in corners() {
        for k in 0..2 {
            low[k] = low[k].min(corner[k]);
            high[k] = high[k].max(corner[k]);
        }
        top = top.max(corner.z);
    }
    let index = nodes.len();
    nodes.push(Node { low, high, top, first: first as u32, count: triangles.len() as u32, is_leaf: true });
    if triangles.len() > LEAF_SIZE {
        let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
        let key = |corners: &[u32; 3]| corners.iter().map(|&i| vertices[i as usize][axis]).sum::<f64>();
        let middle = triangles.len() / 2;
        triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        let (left_part, right_part) = triangles.split_at_mut(middle);
        let left = build(vertices, left_part, first, nodes);
        let right = build(vertices, right_part, first + middle, nodes);
        let node = &mut nodes[index];
        (node.first, node.count, node.is_leaf) = (left, right, false);
    }
    index as u32
}
