//! Convex polyhedra with their faces, edges and vertices (Cherif 1999, sec. 3.2 and appendix A).

use super::chart::ChartedSurface;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use regrasp_geometry::hull::HullError;
use regrasp_geometry::{ConvexHull, Point, Pose, Shape, UnitVector, Vector};

/// A part of the boundary, by number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// A face.
    Face(usize),
    /// An edge.
    Edge(usize),
    /// A vertex.
    Vertex(usize),
}

/// A convex polygon of the boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Outward normal.
    pub normal: UnitVector,
    /// Vertices, counter-clockwise seen from outside.
    pub corners: Vec<usize>,
    /// Edges; edge `k` goes from corner `k` to the next.
    pub edges: Vec<usize>,
    /// Frame of the face: origin at the mean of its corners, z along the normal, x along its first edge.
    pub object_from_face: Pose,
}

/// Where two faces meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// First and last vertex.
    pub ends: [usize; 2],
    /// The faces to the left and to the right of the way from the first to the last, seen from outside.
    pub faces: [usize; 2],
    /// Unit vector from the first vertex to the last.
    pub direction: UnitVector,
    /// In metres.
    pub length: f64,
    /// By how much the normal turns from the left face to the right one about the direction, in radians: pi less the angle
    /// between the faces inside.
    pub exterior_angle: f64,
}

/// A convex polyhedron, in the object frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyhedron {
    vertices: Vec<Point>,
    faces: Vec<Face>,
    edges: Vec<Edge>,
    /// Per vertex the unit vectors along its edges, away from it.
    spokes: Vec<Vec<Vector>>,
}

/// Why a shape is no convex polyhedron.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotPolyhedron {
    /// Neither a box nor a convex polyhedron.
    #[error("a {kind} is no convex polyhedron; expected a box or a convex shape")]
    Kind {
        /// Kind of shape.
        kind: &'static str,
    },
    /// Its points have no hull.
    #[error(transparent)]
    Hull(#[from] HullError),
    /// Its faces do not close: some of them are planes within rounding only.
    #[error("the faces of the polyhedron do not meet in edges near vertex {vertex}; simplify it")]
    Open {
        /// A vertex on an edge of only one face.
        vertex: usize,
    },
}

/// Angle between triangles of one face, in radians, and distance of its vertices from its plane, over the size.
const FLAT: f64 = 1e-9;

impl Polyhedron {
    /// The polyhedron of a box or a convex shape; triangles in one plane become one face.
    pub fn of(shape: &Shape) -> Result<Self, NotPolyhedron> {
        match shape {
            Shape::Cuboid { half_extents } => {
                let corner = |k: usize| Point::from(Vector::from_fn(|i, _| half_extents[i] * [-1.0, 1.0][k >> i & 1]));
                Polyhedron::of_hull(&ConvexHull::new(&(0..8).map(corner).collect::<Vec<_>>())?)
            }
            Shape::Convex(hull) => Polyhedron::of_hull(hull),
            Shape::Sphere { .. }
            | Shape::Capsule { .. }
            | Shape::Cylinder { .. }
            | Shape::Ellipsoid { .. }
            | Shape::Mesh(_) => Err(NotPolyhedron::Kind { kind: shape.kind() }),
        }
    }

    fn of_hull(hull: &ConvexHull) -> Result<Self, NotPolyhedron> {
        let vertices = hull.vertices().to_vec();
        let size = vertices.iter().map(|v| (v - vertices[0]).norm()).fold(0.0, f64::max);
        let faces: Vec<Face> = planes(hull, size).iter().map(|(n, at)| face(&vertices, n, at, size)).collect();
        let mut polyhedron =
            Polyhedron { spokes: vec![Vec::new(); vertices.len()], vertices, faces, edges: Vec::new() };
        polyhedron.join_faces()?;
        Ok(polyhedron)
    }

    /// Makes the edges.
    fn join_faces(&mut self) -> Result<(), NotPolyhedron> {
        let mut sides: Vec<([usize; 2], usize, usize)> = Vec::new();
        for (f, face) in self.faces.iter().enumerate() {
            for (k, &a) in face.corners.iter().enumerate() {
                sides.push(([a, face.corners[(k + 1) % face.corners.len()]], f, k));
            }
        }
        sides.sort_unstable();
        for &([a, b], left, k) in &sides {
            let Ok(other) = sides.binary_search_by(|side| side.0.cmp(&[b, a])) else {
                return Err(NotPolyhedron::Open { vertex: a });
            };
            let (_, right, j) = sides[other];
            if a > b {
                continue;
            }
            let way = self.vertices[b] - self.vertices[a];
            let direction = UnitVector::new_normalize(way);
            let [p, q] = [left, right].map(|f| self.faces[f].normal.into_inner());
            let exterior_angle = p.cross(&q).dot(&direction).atan2(p.dot(&q));
            let edge = Edge { ends: [a, b], faces: [left, right], direction, length: way.norm(), exterior_angle };
            self.faces[left].edges[k] = self.edges.len();
            self.faces[right].edges[j] = self.edges.len();
            self.spokes[a].push(direction.into_inner());
            self.spokes[b].push(-direction.into_inner());
            self.edges.push(edge);
        }
        Ok(())
    }

    /// The faces.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The edges.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The vertices, those that no edge ends at too.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// The plane of a face with the coordinates of its frame, for [`super::ContactPair`].
    pub fn chart(&self, face: usize) -> ChartedSurface {
        ChartedSurface::plane(self.faces[face].object_from_face)
    }

    /// The feature nearest to a point outside, the nearest point of it and the distance. None inside.
    pub fn nearest(&self, point: &Point) -> Option<(Feature, Point, f64)> {
        let height = |face: &Face| face.normal.dot(&(point - self.vertices[face.corners[0]]));
        if self.faces.iter().all(|face| height(face) <= 0.0) {
            return None;
        }
        let faces = self.faces.iter().enumerate().filter(|(_, face)| height(face) > 0.0).filter_map(|(f, face)| {
            let foot = point - face.normal.into_inner() * height(face);
            self.depths(f, &foot).all(|depth| depth >= 0.0).then_some((Feature::Face(f), foot))
        });
        let edges = self.edges.iter().enumerate().filter_map(|(e, edge)| {
            let s = (point - self.vertices[edge.ends[0]]).dot(&edge.direction);
            let foot = self.vertices[edge.ends[0]] + edge.direction.into_inner() * s;
            (s >= 0.0 && s <= edge.length).then_some((Feature::Edge(e), foot))
        });
        let vertices = self.vertices.iter().enumerate().map(|(v, vertex)| (Feature::Vertex(v), *vertex));
        faces
            .chain(edges)
            .chain(vertices)
            .map(|(feature, foot)| (feature, foot, (point - foot).norm()))
            .min_by(|a, b| a.2.total_cmp(&b.2))
    }

    /// Unit vectors from a vertex along its edges.
    pub fn spokes(&self, vertex: usize) -> &[Vector] {
        &self.spokes[vertex]
    }

    /// A corner of a face.
    pub(super) fn corner(&self, face: usize, k: usize) -> Point {
        self.vertices[self.faces[face].corners[k]]
    }

    /// Unit vector along side `k` of a face, counter-clockwise.
    pub(super) fn side(&self, face: usize, k: usize) -> Vector {
        let edge = &self.edges[self.faces[face].edges[k]];
        if edge.faces[0] == face { edge.direction.into_inner() } else { -edge.direction.into_inner() }
    }

    /// Distances of a point of a face's plane from the lines of its sides, positive inside, by side.
    pub fn depths(&self, face: usize, point: &Point) -> impl Iterator<Item = f64> + '_ {
        let (n, point) = (self.faces[face].normal.into_inner(), *point);
        (0..self.faces[face].corners.len())
            .map(move |k| (point - self.corner(face, k)).dot(&n.cross(&self.side(face, k))))
    }
}

/// The planes of a hull's triangles: normal, and a point.
fn planes(hull: &ConvexHull, size: f64) -> Vec<(UnitVector, Point)> {
    let mut found: Vec<(UnitVector, Point, f64)> = Vec::new();
    for corners in hull.triangles() {
        let [a, b, c] = corners.map(|i| hull.vertices()[i as usize]);
        let across = (b - a).cross(&(c - a));
        let area = across.norm();
        let Some(normal) = UnitVector::try_new(across, 1e-12 * size * size) else { continue };
        let same = found.iter_mut().find(|(n, at, _)| {
            n.dot(&normal) > 0.0
                && n.cross(&normal).norm() < FLAT.sqrt()
                && n.dot(&(a - *at)).abs() < FLAT * size
                && normal.dot(&(*at - a)).abs() < FLAT * size
        });
        match same {
            // The largest triangle knows the plane best.
            Some(plane) if plane.2 < area => *plane = (normal, a, area),
            Some(_) => {}
            None => found.push((normal, a, area)),
        }
    }
    found.into_iter().map(|(n, at, _)| (n, at)).collect()
}

/// The face in a plane, with its edges still to be numbered.
fn face(vertices: &[Point], normal: &UnitVector, at: &Point, size: f64) -> Face {
    let near = |v: &Point| normal.dot(&(v - at)).abs() < FLAT * size;
    let mut corners: Vec<usize> = (0..vertices.len()).filter(|&i| near(&vertices[i])).collect();
    let middle = |corners: &[usize]| {
        Point::from(corners.iter().map(|&i| vertices[i].coords).sum::<Vector>() / corners.len() as f64)
    };
    let center = middle(&corners);
    let (x, y) = regrasp_geometry::frame::tangents(normal);
    let angle = |i: usize| (vertices[i] - center).dot(&y).atan2((vertices[i] - center).dot(&x));
    corners.sort_by(|&i, &j| angle(i).total_cmp(&angle(j)));
    let n = corners.len();
    // Vertices within a side are no corners.
    let corners: Vec<usize> = (0..n)
        .filter(|&k| {
            let [a, b, c] = [k + n - 1, k, k + 1].map(|j| vertices[corners[j % n]]);
            normal.dot(&(b - a).cross(&(c - b))) > FLAT * size * (c - a).norm()
        })
        .map(|k| corners[k])
        .collect();
    let along = UnitVector::new_normalize(vertices[corners[1 % corners.len()]] - vertices[corners[0]]).into_inner();
    let y = normal.cross(&along);
    let axes = Matrix3::from_columns(&[y.cross(normal), y, normal.into_inner()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let object_from_face = Pose::from_parts(middle(&corners).coords.into(), rotation);
    Face { normal: *normal, edges: vec![0; corners.len()], corners, object_from_face }
}
