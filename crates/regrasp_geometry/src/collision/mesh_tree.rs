//! Convex shapes against triangle meshes, through a tree of boxes.
//!
//! A mesh counts as its surface: a shape wholly inside a closed mesh is apart from it. Motions start outside and are
//! checked continuously, so that nothing gets inside without crossing the surface.

use super::gjk::{Answer, separation};
use super::placement::Placement;
use crate::frame::Point;
use crate::mesh::TriangleMesh;
use crate::shape::Shape;
use nalgebra::Matrix3;

/// A tree of axis-aligned boxes over the triangles of a mesh.
#[derive(Debug, Clone)]
pub struct MeshTree {
    nodes: Vec<Node>,
    corners: Vec<[Point; 3]>,
}

#[derive(Debug, Clone)]
struct Node {
    low: Point,
    high: Point,
    /// Leaf: first triangle; inner node: index of the left child.
    first: u32,
    /// Number of triangles of a leaf; 0 for inner nodes.
    n_triangles: u32,
    /// Inner node: index of the right child.
    right: u32,
}

const LEAF_SIZE: usize = 4;

impl MeshTree {
    /// The tree over `mesh`, split at the median of the longest side.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let mut corners: Vec<[Point; 3]> = (0..mesh.triangles().len()).map(|i| mesh.corners(i)).collect();
        let mut nodes = Vec::with_capacity(corners.len());
        build(&mut corners, 0, &mut nodes);
        MeshTree { nodes, corners }
    }

    /// True when the convex `shape`, placed in the mesh frame, is proved to be apart from every triangle by at least
    /// `required`. `smallest` receives a lower bound of the distance when true.
    pub fn is_apart(&self, shape: &Shape, mesh_from_shape: &Placement, required: f64, smallest: &mut f64) -> bool {
        self.all_near(shape, mesh_from_shape, required, smallest, &mut |_| false)
    }

    /// As [`MeshTree::is_apart`], but a triangle that is too near passes when `excuse` says so of its corners.
    pub fn all_near(
        &self,
        shape: &Shape,
        mesh_from_shape: &Placement,
        required: f64,
        smallest: &mut f64,
        excuse: &mut dyn FnMut(&[Point; 3]) -> bool,
    ) -> bool {
        let (center, radius) = shape.bounding_sphere();
        let center = mesh_from_shape.point(&center);
        *smallest = f64::INFINITY;
        let mut stack = [0u32; 64];
        let mut n_stack = 1;
        while n_stack > 0 {
            n_stack -= 1;
            let node = &self.nodes[stack[n_stack] as usize];
            let outside = box_distance(&node.low, &node.high, &center) - radius;
            if outside > required {
                *smallest = smallest.min(outside);
                continue;
            }
            let half = (node.high - node.low) / 2.0;
            let at_box = Placement {
                rotation: Matrix3::identity(),
                translation: nalgebra::center(&node.low, &node.high).coords,
            };
            let cuboid = Shape::Cuboid { half_extents: half };
            let mut direction = at_box.translation - mesh_from_shape.translation;
            let answer =
                separation(shape, mesh_from_shape, &cuboid, &at_box, required, required, &mut direction, &mut [0; 2]);
            if let Answer::SeparatedBy(d) = answer {
                *smallest = smallest.min(d);
                continue;
            }
            if node.n_triangles == 0 {
                stack[n_stack] = node.first;
                stack[n_stack + 1] = node.right;
                n_stack += 2;
                continue;
            }
            let first = node.first as usize;
            for corners in &self.corners[first..first + node.n_triangles as usize] {
                match triangle_separation(shape, mesh_from_shape, corners, required) {
                    Answer::SeparatedBy(d) => *smallest = smallest.min(d),
                    _ if excuse(corners) => {}
                    _ => return false,
                }
            }
        }
        true
    }
}

/// Distance of a point from an axis-aligned box; zero inside.
fn box_distance(low: &Point, high: &Point, point: &Point) -> f64 {
    let mut squared = 0.0;
    for k in 0..3 {
        let outside = (low[k] - point[k]).max(point[k] - high[k]).max(0.0);
        squared += outside * outside;
    }
    squared.sqrt()
}

/// Separation of a convex shape from one triangle, both in the mesh frame.
fn triangle_separation(shape: &Shape, mesh_from_shape: &Placement, corners: &[Point; 3], required: f64) -> Answer {
    super::gjk::separation_from_points(shape, mesh_from_shape, corners, required)
}

fn build(corners: &mut [[Point; 3]], first: usize, nodes: &mut Vec<Node>) -> u32 {
    let (low, high) = corners.iter().flatten().fold((corners[0][0], corners[0][0]), |(l, h), p| (l.inf(p), h.sup(p)));
    let index = nodes.len();
    nodes.push(Node { low, high, first: first as u32, n_triangles: corners.len() as u32, right: 0 });
    if corners.len() > LEAF_SIZE {
        let axis = (high - low).imax();
        let key = |c: &[Point; 3]| c[0][axis] + c[1][axis] + c[2][axis];
        let middle = corners.len() / 2;
        corners.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        let (left_part, right_part) = corners.split_at_mut(middle);
        let left = build(left_part, first, nodes);
        let right = build(right_part, first + middle, nodes);
        nodes[index] = Node { low, high, first: left, n_triangles: 0, right };
    }
    index as u32
}
