//! Convex shapes against triangle meshes, through a tree of boxes.
//!
//! Distances are those from the triangles, and [`MeshTree::holds`] tells what is inside. A convex shape that is apart from all
//! triangles is wholly inside or wholly outside, so that one point of it is asked. Along a motion that stays apart from
//! the triangles one moment is enough.

use super::gjk::{Placed, Separation, separation, separation_from_points};
use super::placement::Placement;
use super::support::support_value;
use super::winding::{self, Dipole};
use crate::frame::{Point, Vector};
use crate::hull::ConvexHull;
use crate::mesh::TriangleMesh;
use crate::shape::Shape;
use crate::surface::nearest_on_triangle;
use nalgebra::Matrix3;
use std::sync::Arc;

/// A tree of axis-aligned boxes over the triangles of a mesh.
#[derive(Debug, Clone)]
pub struct MeshTree {
    nodes: Vec<Node>,
    corners: Vec<[Point; 3]>,
    /// By node: its triangles from far away.
    dipoles: Vec<Dipole>,
    /// 1, or -1 for a mesh that is wound inside out.
    orientation: f64,
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

/// A mesh made ready for collision tests, once and for all of them. Both parts are in the mesh frame.
#[derive(Debug, Clone)]
pub struct MeshBody {
    /// A convex shape that contains the mesh: a first test.
    pub bound: Shape,
    /// The triangles, which decide.
    pub tree: Arc<MeshTree>,
}

/// Up to this many vertices the bound of a mesh is its convex hull.
const EXACT_HULL_UP_TO: usize = 20_000;
/// A box about a flat mesh is so thick at least, as a share of its largest side: thinner ones have no hull.
const LEAST_THICKNESS: f64 = 1e-3;

impl MeshBody {
    /// Bounds `mesh` by its hull; by a little more when it has many vertices, or where rounding leaves none; by a box when it is flat.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let vertices = mesh.vertices();
        let exact =
            if vertices.len() <= EXACT_HULL_UP_TO { ConvexHull::new(vertices) } else { ConvexHull::around(vertices) };
        let hull = exact.or_else(|_| ConvexHull::around(vertices)).or_else(|_| ConvexHull::new(&box_about(mesh)));
        let bound = match hull {
            Ok(hull) => Shape::Convex(Arc::new(hull)),
            Err(_) => Shape::Sphere { radius: vertices.iter().map(|v| v.coords.norm()).fold(0.0, f64::max) },
        };
        MeshBody { bound, tree: Arc::new(MeshTree::new(mesh)) }
    }

    /// As [`MeshBody::new`]; None for shapes that are convex themselves.
    pub fn of(shape: &Shape) -> Option<Self> {
        match shape {
            Shape::Mesh(mesh) => Some(MeshBody::new(mesh)),
            _ => None,
        }
    }
}

/// Corners of a box about a mesh.
fn box_about(mesh: &TriangleMesh) -> [Point; 8] {
    let (low, high) = mesh.bounds();
    let (middle, half) = (nalgebra::center(&low, &high), (high - low) / 2.0);
    let half = half.map(|h: f64| h.max(LEAST_THICKNESS * half.max()));
    std::array::from_fn(|k| {
        let sign = |axis: usize| if k >> axis & 1 == 0 { -1.0 } else { 1.0 };
        middle + Vector::new(sign(0), sign(1), sign(2)).component_mul(&half)
    })
}

impl MeshTree {
    /// The tree over `mesh`, split at the median of the longest side.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let mut corners: Vec<[Point; 3]> = (0..mesh.triangles().len()).map(|i| mesh.corners(i)).collect();
        let mut nodes = Vec::with_capacity(corners.len());
        let mut dipoles = Vec::with_capacity(corners.len());
        build(&mut corners, 0, &mut nodes, &mut dipoles);
        MeshTree { nodes, corners, dipoles, orientation: winding::orientation(mesh) }
    }

    /// True when `point`, in the mesh frame, is inside: the triangles wind about it by more than half a turn.
    pub fn holds(&self, point: &Point) -> bool {
        let root = &self.nodes[0];
        if (0..3).any(|k| point[k] < root.low[k] || point[k] > root.high[k]) {
            return false;
        }
        let exactly = || self.corners.iter().map(|corners| winding::of_triangle(corners, point)).sum::<f64>();
        winding::is_inside(self.orientation * self.winding_about(point), || self.orientation * exactly())
    }

    /// About how many turns the triangles wind about `point`.
    fn winding_about(&self, point: &Point) -> f64 {
        let mut turns = 0.0;
        let mut stack = [0u32; 64];
        let mut n_stack = 1;
        while n_stack > 0 {
            n_stack -= 1;
            let index = stack[n_stack] as usize;
            if let Some(far) = self.dipoles[index].winding(point) {
                turns += far;
                continue;
            }
            let node = &self.nodes[index];
            if node.n_triangles == 0 {
                stack[n_stack] = node.first;
                stack[n_stack + 1] = node.right;
                n_stack += 2;
                continue;
            }
            let first = node.first as usize;
            let corners = &self.corners[first..first + node.n_triangles as usize];
            turns += corners.iter().map(|corners| winding::of_triangle(corners, point)).sum::<f64>();
        }
        turns
    }

    /// As [`MeshTree::is_apart`], but a shape that is inside the mesh is not apart from it. `middle` is any point of the shape.
    pub fn is_outside(
        &self,
        shape: &Shape,
        middle: &Point,
        mesh_from_shape: &Placement,
        required: f64,
        smallest: &mut f64,
    ) -> bool {
        self.is_apart(shape, mesh_from_shape, required, smallest) && !self.holds(&mesh_from_shape.point(middle))
    }

    /// True when the convex `shape`, placed in the mesh frame, is proved to be apart from every triangle by at least
    /// `required`, whether inside or outside. `smallest` receives a lower bound of the distance when true.
    pub fn is_apart(&self, shape: &Shape, mesh_from_shape: &Placement, required: f64, smallest: &mut f64) -> bool {
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
            // Of a ball the distance is known already.
            if !matches!(shape, Shape::Sphere { .. })
                && let Separation::SeparatedBy(d) = box_separation(shape, mesh_from_shape, node, required, &center)
            {
                *smallest = smallest.min(d);
                continue;
            }
            if node.n_triangles == 0 {
                stack[n_stack] = node.first;
                stack[n_stack + 1] = node.right;
                n_stack += 2;
                continue;
            }
            for corners in self.corners_of(node) {
                match triangle_separation(shape, mesh_from_shape, corners, required, &center) {
                    Separation::SeparatedBy(d) => *smallest = smallest.min(d),
                    _ => return false,
                }
            }
        }
        true
    }

    /// True when the convex `shape`, placed in the mesh frame, is proved not to meet any triangle above `below`: it may press into
    /// what lies lower. `ball` bounds the shape, in its own frame.
    pub fn meets_only_below(
        &self,
        shape: &Shape,
        (center, radius): (&Point, f64),
        mesh_from_shape: &Placement,
        below: &HalfSpace,
    ) -> bool {
        let center = mesh_from_shape.point(center);
        let mut hint = 0;
        // A first guess at a separating direction: from the middle to what is nearest to it. For round tips it is nearly always good.
        let mut is_beyond = |nearest: &Point, extent: &mut dyn FnMut(&Vector) -> f64| {
            let Some(direction) = (nearest - center).try_normalize(1e-12) else { return false };
            let in_shape = mesh_from_shape.vector_to_child(&direction);
            let reached = direction.dot(&mesh_from_shape.translation) + support_value(shape, &in_shape, &mut hint);
            extent(&direction) >= reached
        };
        let mut stack = [0u32; 64];
        let mut n_stack = 1;
        while n_stack > 0 {
            n_stack -= 1;
            let node = &self.nodes[stack[n_stack] as usize];
            let (middle, half) = (nalgebra::center(&node.low, &node.high), (node.high - node.low) / 2.0);
            let nearest = center.sup(&node.low).inf(&node.high);
            let along_box = |v: &Vector| v.dot(&middle.coords) - v.abs().dot(&half);
            // The cheapest test first. What is in a box costs less than the exact distance of the box.
            if (nearest - center).norm_squared() > radius * radius
                || -along_box(&-below.normal) <= below.level
                || is_beyond(&nearest, &mut |v| along_box(v))
            {
                continue;
            }
            if node.n_triangles == 0 {
                stack[n_stack] = node.first;
                stack[n_stack + 1] = node.right;
                n_stack += 2;
                continue;
            }
            for corners in self.corners_of(node) {
                let lowest = |v: &Vector| corners.iter().map(|p| v.dot(&p.coords)).fold(f64::INFINITY, f64::min);
                if -lowest(&-below.normal) <= below.level
                    || is_beyond(&nearest_on_triangle(corners, &center).0, &mut |v| lowest(v))
                {
                    continue;
                }
                if !matches!(
                    triangle_separation(shape, mesh_from_shape, corners, 0.0, &center),
                    Separation::SeparatedBy(_)
                ) {
                    return false;
                }
            }
        }
        true
    }

    /// Corners of the triangles of a leaf.
    fn corners_of(&self, leaf: &Node) -> &[[Point; 3]] {
        let first = leaf.first as usize;
        &self.corners[first..first + leaf.n_triangles as usize]
    }
}

/// The points whose coordinate along a direction is no more than a level.
#[derive(Debug, Clone, Copy)]
pub struct HalfSpace {
    /// The direction, of length one.
    pub normal: Vector,
    /// The level.
    pub level: f64,
}

/// Separation of a convex shape from the box of a node, both in the mesh frame. The search starts along the way from `center`, the
/// middle of the shape, to what is nearest to it: of round shapes that is nearly the direction sought.
fn box_separation(
    shape: &Shape,
    mesh_from_shape: &Placement,
    node: &Node,
    required: f64,
    center: &Point,
) -> Separation {
    let at_box =
        Placement { rotation: Matrix3::identity(), translation: nalgebra::center(&node.low, &node.high).coords };
    let cuboid = Shape::Cuboid { half_extents: (node.high - node.low) / 2.0 };
    let nearest = center.sup(&node.low).inf(&node.high);
    // In the box there is no such way: `separation` goes from one middle to the other then.
    let mut direction = nearest - center;
    separation(
        Placed { shape, at: mesh_from_shape },
        Placed { shape: &cuboid, at: &at_box },
        required,
        required,
        &mut direction,
        &mut [0; 2],
    )
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

/// As [`box_separation`], from one triangle.
fn triangle_separation(
    shape: &Shape,
    mesh_from_shape: &Placement,
    corners: &[Point; 3],
    required: f64,
    center: &Point,
) -> Separation {
    let nearest = nearest_on_triangle(corners, center).0 - center;
    let direction = if nearest.norm_squared() > 1e-30 { nearest } else { corners[0] - center };
    separation_from_points(shape, mesh_from_shape, corners, required, direction)
}

fn build(corners: &mut [[Point; 3]], first: usize, nodes: &mut Vec<Node>, dipoles: &mut Vec<Dipole>) -> u32 {
    let (low, high) = corners.iter().flatten().fold((corners[0][0], corners[0][0]), |(l, h), p| (l.inf(p), h.sup(p)));
    let index = nodes.len();
    nodes.push(Node { low, high, first: first as u32, n_triangles: corners.len() as u32, right: 0 });
    dipoles.push(Dipole::of(corners));
    if corners.len() > LEAF_SIZE {
        let axis = (high - low).imax();
        let key = |c: &[Point; 3]| c[0][axis] + c[1][axis] + c[2][axis];
        let middle = corners.len() / 2;
        corners.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        let (left_part, right_part) = corners.split_at_mut(middle);
        let left = build(left_part, first, nodes, dipoles);
        let right = build(right_part, first + middle, nodes, dipoles);
        nodes[index] = Node { low, high, first: left, n_triangles: 0, right };
    }
    index as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use std::f64::consts::PI;

    /// A closed ball of radius 1 with a bumpy surface, of about `2 * n * n` triangles.
    fn ball(n: u32) -> TriangleMesh {
        let point = |i: u32, j: u32| {
            let (polar, around) = (f64::from(i) / f64::from(n) * PI, f64::from(j % n) / f64::from(n) * 2.0 * PI);
            let radius = 1.0 - 0.05 * (5.0 * polar).sin() * (3.0 * around).sin();
            Point::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()) * radius
        };
        let vertices = (0..=n).flat_map(|i| (0..n).map(move |j| point(i, j))).collect();
        let at = |i: u32, j: u32| i * n + j % n;
        let quads = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let split = quads.flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        });
        TriangleMesh::new(vertices, split.collect()).unwrap()
    }

    #[test]
    fn what_a_tip_meets_above_a_plane_is_what_triangle_by_triangle_says() {
        let mesh = ball(24);
        let tree = MeshTree::new(&mesh);
        let mut rng = Rng::keyed(1, "mesh_tree", 0);
        let round: Vec<Point> = (0..300).map(|_| Point::from(Vector::from(rng.direction()) * 0.4)).collect();
        let shapes = [
            Shape::Sphere { radius: 0.4 },
            Shape::Convex(Arc::new(ConvexHull::new(&round).unwrap())),
            Shape::Cuboid { half_extents: Vector::new(0.1, 0.2, 0.3) },
        ];
        for shape in shapes {
            let (center, radius) = shape.bounding_sphere();
            let mut n_of = [0, 0];
            for _ in 0..1500 {
                let normal = Vector::from(rng.direction());
                let at = Placement { translation: normal * rng.uniform(1.05, 1.45), ..Placement::IDENTITY };
                let in_shape = at.vector_to_child(&-normal);
                let lowest = normal.dot(&at.translation) - support_value(&shape, &in_shape, &mut 0);
                let below = HalfSpace { normal, level: lowest + rng.uniform(0.0, 0.1) };
                let expected = tree.corners.iter().all(|corners| {
                    let highest = corners.iter().map(|p| normal.dot(&p.coords)).fold(f64::NEG_INFINITY, f64::max);
                    matches!(
                        triangle_separation(&shape, &at, corners, 0.0, &at.point(&center)),
                        Separation::SeparatedBy(_)
                    ) || highest <= below.level
                });
                assert_eq!(tree.meets_only_below(&shape, (&center, radius), &at, &below), expected);
                n_of[usize::from(expected)] += 1;
            }
            assert!(n_of.iter().all(|&n| n > 100), "{} {n_of:?}", shape.kind());
        }
    }

    /// A closed box from `low` to `high`, twelve triangles wound outwards.
    fn cuboid(low: [f64; 3], high: [f64; 3]) -> (Vec<Point>, Vec<[u32; 3]>) {
        let vertices =
            (0..8).map(|i| Point::from(Vector::from_fn(|k, _| if i >> k & 1 == 1 { high[k] } else { low[k] })));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        (vertices.collect(), quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
    }

    #[test]
    fn winding_numbers_are_those_of_all_triangles_and_the_checkers_other_way_agrees() {
        let bumpy = ball(40);
        // Two closed boxes that overlap, a box with a hollow, a box without a lid, a box wound inside out.
        let (mut vertices, mut triangles) = cuboid([-1.0; 3], [0.2; 3]);
        let (others, more) = cuboid([-0.2; 3], [1.0; 3]);
        vertices.extend(others);
        triangles.extend(more.iter().map(|corners| corners.map(|i| i + 8)));
        let overlapping = TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap();
        let (mut vertices, mut triangles) = cuboid([-1.0; 3], [1.0; 3]);
        let lidless = TriangleMesh::new(vertices.clone(), triangles[..10].to_vec()).unwrap();
        let inverted = TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap().flipped();
        let (others, more) = cuboid([-0.5; 3], [0.5; 3]);
        vertices.extend(others);
        triangles.extend(more.iter().map(|[a, b, c]| [a + 8, c + 8, b + 8]));
        let hollow = TriangleMesh::new(vertices, triangles).unwrap();
        let mut rng = Rng::keyed(3, "mesh_tree", 0);
        for mesh in [bumpy, overlapping, lidless, inverted, hollow] {
            let tree = MeshTree::new(&mesh);
            let other = crate::reference::Inside::of(&mesh);
            let mut n_inside = 0;
            for _ in 0..3000 {
                let point = Point::from(Vector::from(rng.direction()) * rng.uniform(0.0, 1.7));
                let exact: f64 = tree.corners.iter().map(|corners| winding::of_triangle(corners, &point)).sum();
                assert!((tree.winding_about(&point) - exact).abs() < 0.03, "{point}");
                assert!((other.winding(&point) - exact).abs() < 1e-9, "{point} {} {exact}", other.winding(&point));
                let is_inside = mesh.signed_volume().signum() * exact > 0.5;
                assert_eq!(tree.holds(&point), is_inside, "{point}");
                assert_eq!(other.holds(&point), is_inside, "{point}");
                n_inside += usize::from(is_inside);
            }
            assert!((100..2900).contains(&n_inside), "{n_inside}");
        }
    }

    #[test]
    fn an_open_sheet_holds_nothing() {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let vertices = corners.map(|[x, y]| Point::new(x, y, 0.0)).to_vec();
        let sheet = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let tree = MeshTree::new(&sheet);
        for z in [-1e-6, 1e-6, -0.01, 0.01] {
            assert!(!tree.holds(&Point::new(0.1, 0.2, z)));
        }
    }

    #[test]
    fn a_shape_inside_is_not_outside_though_it_is_apart_from_the_triangles() {
        let (vertices, triangles) = cuboid([-1.0; 3], [1.0; 3]);
        let tree = MeshTree::new(&TriangleMesh::new(vertices, triangles).unwrap());
        let shape = Shape::Sphere { radius: 0.1 };
        let middle = Point::origin();
        for (x, is_outside) in [(0.0, false), (0.8, false), (0.95, false), (1.05, false), (1.2, true)] {
            let at = Placement { translation: Vector::new(x, 0.1, 0.2), ..Placement::IDENTITY };
            assert_eq!(tree.is_outside(&shape, &middle, &at, 0.01, &mut 0.0), is_outside, "{x}");
        }
    }

    #[test]
    fn bounds_of_few_and_of_many_vertices_contain_the_mesh() {
        for n in [8, 150] {
            let mesh = ball(n);
            assert_eq!(mesh.vertices().len() > EXACT_HULL_UP_TO, n == 150);
            assert!(excess(&mesh) <= 0.02);
        }
        let flat = TriangleMesh::new(
            vec![Point::new(0.0, 0.0, 1.0), Point::new(2.0, 0.0, 1.0), Point::new(0.0, 2.0, 1.0)],
            vec![[0, 1, 2]],
        );
        // The box about a triangle has a corner more.
        assert!(excess(&flat.unwrap()) < 0.51);
    }

    /// Many corners in one plane: rounding leaves the usual way without a hull.
    #[test]
    fn meshes_with_many_corners_in_one_plane_have_their_hull_about_them() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/objects/horse.obj");
        let mesh = subdivided(&crate::import::read_mesh(&path, &std::fs::read(&path).unwrap()).unwrap());
        assert!(excess(&mesh) <= 1e-6);
    }

    /// Every triangle as four, by the middles of its edges.
    fn subdivided(mesh: &TriangleMesh) -> TriangleMesh {
        let mut vertices = mesh.vertices().to_vec();
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push(nalgebra::center(&mesh.vertices()[a as usize], &mesh.vertices()[b as usize]));
                vertices.len() as u32 - 1
            })
        };
        let triangles = mesh.triangles().iter().flat_map(|&[a, b, c]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        let triangles = triangles.collect();
        TriangleMesh::new(vertices, triangles).unwrap()
    }

    /// How far the bound reaches beyond the mesh, as a share of the size of the mesh; nowhere less far.
    fn excess(mesh: &TriangleMesh) -> f64 {
        let body = MeshBody::new(mesh);
        let mut rng = Rng::keyed(2, "mesh_tree", mesh.vertices().len() as u64);
        let (low, high) = mesh.bounds();
        let mut largest: f64 = 0.0;
        for _ in 0..200 {
            let direction = Vector::from(rng.direction());
            let reach = |p: &Point| direction.dot(&p.coords);
            let mesh_reach = mesh.vertices().iter().map(reach).fold(f64::NEG_INFINITY, f64::max);
            let beyond = crate::collision::support::support_value(&body.bound, &direction, &mut 0) - mesh_reach;
            assert!(beyond >= -1e-7, "{beyond}");
            largest = largest.max(beyond / (high - low).norm());
        }
        largest
    }
}
