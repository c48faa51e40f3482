//! The shapes a link, an object or an obstacle can have.

use crate::frame::{Point, Pose, Vector};
use crate::hull::{ConvexHull, ball_of};
use crate::mesh::TriangleMesh;
use std::sync::Arc;

/// A solid in its own frame; of an open sheet of triangles only the surface is left. Lengths in metres, all positive.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Ball about the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Ball swept along z from `-half_length` to `half_length`.
    Capsule {
        /// Half the distance between the two end centres.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// Box about the origin.
    Cuboid {
        /// Half the edge lengths.
        half_extents: Vector,
    },
    /// Cylinder about z.
    Cylinder {
        /// Half the height.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// Ellipsoid about the origin with half axes along x, y, z.
    Ellipsoid {
        /// Half axes.
        radii: Vector,
    },
    /// Convex polyhedron.
    Convex(Arc<ConvexHull>),
    /// Triangle mesh, not necessarily convex or closed.
    Mesh(Arc<TriangleMesh>),
}

impl Shape {
    /// Short name of the kind, as it is spelt in files.
    pub fn kind(&self) -> &'static str {
        match self {
            Shape::Sphere { .. } => "sphere",
            Shape::Capsule { .. } => "capsule",
            Shape::Cuboid { .. } => "box",
            Shape::Cylinder { .. } => "cylinder",
            Shape::Ellipsoid { .. } => "ellipsoid",
            Shape::Convex(_) => "convex",
            Shape::Mesh(_) => "mesh",
        }
    }

    /// True for every kind but [`Shape::Mesh`], which may or may not be convex.
    pub fn is_convex(&self) -> bool {
        !matches!(self, Shape::Mesh(_))
    }

    /// A ball that contains the shape: centre in the shape's frame, and radius.
    pub fn bounding_sphere(&self) -> (Point, f64) {
        match self {
            Shape::Sphere { radius } => (Point::origin(), *radius),
            Shape::Capsule { half_length, radius } => (Point::origin(), half_length + radius),
            Shape::Cuboid { half_extents } => (Point::origin(), half_extents.norm()),
            Shape::Cylinder { half_length, radius } => (Point::origin(), half_length.hypot(*radius)),
            Shape::Ellipsoid { radii } => (Point::origin(), radii.max()),
            Shape::Convex(hull) => hull.ball(),
            Shape::Mesh(mesh) => ball_of(mesh.vertices()),
        }
    }

    /// Some point of a convex shape; of a mesh the mean of its vertices.
    pub fn middle(&self) -> Point {
        let mean = |points: &[Point]| {
            Point::from(points.iter().map(|p| p.coords).sum::<Vector>() / points.len().max(1) as f64)
        };
        match self {
            Shape::Convex(hull) => mean(hull.vertices()),
            Shape::Mesh(mesh) => mean(mesh.vertices()),
            _ => Point::origin(),
        }
    }

    /// Lowest and highest coordinates in the shape's frame.
    pub fn bounds(&self) -> (Point, Point) {
        let half = match self {
            Shape::Sphere { radius } => Vector::repeat(*radius),
            Shape::Capsule { half_length, radius } => Vector::new(*radius, *radius, half_length + radius),
            Shape::Cuboid { half_extents } => *half_extents,
            Shape::Cylinder { half_length, radius } => Vector::new(*radius, *radius, *half_length),
            Shape::Ellipsoid { radii } => *radii,
            Shape::Convex(hull) => return bounds_of(hull.vertices()),
            Shape::Mesh(mesh) => return mesh.bounds(),
        };
        (Point::from(-half), Point::from(half))
    }

    /// Largest distance of a point of the shape from `center` (in the shape's frame); an upper bound, tight for
    /// polyhedra.
    pub fn reach_from(&self, center: &Point) -> f64 {
        match self {
            Shape::Convex(hull) => hull.vertices().iter().map(|v| (v - center).norm()).fold(0.0, f64::max),
            Shape::Mesh(mesh) => mesh.vertices().iter().map(|v| (v - center).norm()).fold(0.0, f64::max),
            Shape::Cuboid { half_extents } => {
                (0..3).map(|k| (center[k].abs() + half_extents[k]).powi(2)).sum::<f64>().sqrt()
            }
            _ => {
                let (middle, radius) = self.bounding_sphere();
                (middle - center).norm() + radius
            }
        }
    }
}

fn bounds_of(points: &[Point]) -> (Point, Point) {
    points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)))
}

/// A shape at a fixed place in a parent frame (a link, the object, the world).
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedShape {
    /// Pose of the shape's frame in the parent's.
    pub parent_from_shape: Pose,
    /// The shape.
    pub shape: Shape,
}
