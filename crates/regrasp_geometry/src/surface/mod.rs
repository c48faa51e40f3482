//! Surfaces one can sample by area, walk by geodesics, and ask for normals, curvature and creases.
//!
//! Each kind of surface is a file with the same functions in the same order (`SurfaceKind`). Points and normals are
//! in the shape's own frame, called the object frame here.

pub(crate) mod bvh;
mod capsule;
mod cuboid;
mod cylinder;
mod ellipsoid;
mod geodesic;
mod mesh;
mod mesh_topology;
mod settle;
mod smooth_geodesic;
mod sparse;
mod sphere;

#[cfg(test)]
mod tests;

use crate::frame::{Point, UnitVector, Vector};
use crate::mesh::TriangleMesh;
use crate::shape::Shape;
use nalgebra::Matrix3;
use regrasp_base::Rng;
use std::sync::Arc;

pub use geodesic::Geodesic;
pub(crate) use mesh::nearest_on_triangle;
pub use mesh::{MeshRepairs, MeshSurface};

/// Edges of a mesh whose triangles turn by more than this are creases, in radians; by hand: an icosphere of 162
/// vertices (20 degrees) is smooth, an octagonal prism (45 degrees) is not.
pub const DEFAULT_CREASE_ANGLE: f64 = 30.0 * std::f64::consts::PI / 180.0;

/// A point of an object's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Position, in the object frame.
    pub point_in_object: Point,
    /// Outward unit normal, in the object frame.
    pub normal_in_object: UnitVector,
    /// Face of a primitive or triangle of a mesh that the point lies on.
    pub facet: u32,
}

impl SurfacePoint {
    pub(crate) fn new(point_in_object: Point, normal_in_object: UnitVector, facet: u32) -> Self {
        SurfacePoint { point_in_object, normal_in_object, facet }
    }
}

/// What a surface is near the point that is nearest to another one, as long as that moves little: all that is equally far from a plane, a
/// line or a point. Of polyhedra these are faces, edges and corners themselves; of round bodies axes and centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Facing {
    /// A plane, with its outward normal.
    Face(UnitVector),
    /// A straight line, with its direction.
    Edge(UnitVector),
    /// A point.
    Corner,
}

/// Why a shape has no usable surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// A length is zero, negative, NaN or infinite.
    #[error("the {kind} has a length of {value} m; every length has to be positive and finite")]
    Length {
        /// Kind of shape.
        kind: &'static str,
        /// The offending length.
        value: f64,
    },
    /// The polyhedron cannot be made into a mesh.
    #[error("the polyhedron has no surface: {0}")]
    Mesh(#[from] crate::mesh::MeshError),
    /// Triangles are wound so that no side can be called outside, as on a Moebius strip.
    #[error("the mesh has no outside: its triangles cannot be wound alike (triangle {triangle}); repair the mesh")]
    NotOrientable {
        /// Where the contradiction was found.
        triangle: usize,
    },
    /// All triangles lie inside other parts of the mesh.
    #[error("no triangle of the mesh lies on its outer surface")]
    NoOuterSurface,
}

/// The functions every kind of surface has, in the order in which each file has them.
trait SurfaceKind: std::fmt::Debug + Send + Sync {
    fn area(&self) -> f64;
    fn sample(&self, rng: &mut Rng) -> SurfacePoint;
    fn cast_ray(&self, origin: &Point, direction: &UnitVector) -> Option<SurfacePoint>;
    /// Where the ray leaves the solid, nearest first.
    fn exits(&self, origin: &Point, direction: &UnitVector) -> Vec<SurfacePoint> {
        // A convex shape is left once.
        self.cast_ray(origin, direction).into_iter().collect()
    }
    fn project(&self, point: &Point) -> SurfacePoint;
    /// The normal at a point of the surface, not interpolated.
    fn flat_normal(&self, at: &SurfacePoint) -> UnitVector {
        at.normal_in_object
    }
    fn signed_distance(&self, point: &Point) -> f64;
    /// Both, of a point that is no farther from the surface than `reach`.
    fn project_signed(&self, point: &Point, _reach: f64) -> (SurfacePoint, f64) {
        (self.project(point), self.signed_distance(point))
    }
    /// See [`Surface::facing`].
    fn facing(&self, _at: &SurfacePoint, _from: &Point) -> Option<(Facing, Point)> {
        None
    }
    fn crease_distance(&self, at: &SurfacePoint) -> f64;
    fn same_face(&self, a: &SurfacePoint, b: &SurfacePoint) -> bool;
    fn curvature(&self, at: &SurfacePoint) -> [f64; 2];
    fn shape_operator(&self, at: &SurfacePoint) -> Matrix3<f64>;
    fn geodesic(&self, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic>;
}

/// The outer surface of a shape.
#[derive(Debug, Clone)]
pub struct Surface {
    kind: Arc<dyn SurfaceKind>,
    mesh: Option<Arc<MeshSurface>>,
}

impl Surface {
    /// The surface of `shape`, with creases of meshes at [`DEFAULT_CREASE_ANGLE`].
    pub fn of(shape: &Shape) -> Result<Self, SurfaceError> {
        Surface::with_crease_angle(shape, DEFAULT_CREASE_ANGLE)
    }

    /// The surface of `shape`; edges of meshes that turn by more than `crease_angle` (radians) are creases.
    pub fn with_crease_angle(shape: &Shape, crease_angle: f64) -> Result<Self, SurfaceError> {
        let kind: Arc<dyn SurfaceKind> = match shape {
            Shape::Sphere { radius } => {
                Arc::new(sphere::SphereSurface { radius: checked_length(shape.kind(), *radius)? })
            }
            Shape::Capsule { half_length, radius } => Arc::new(capsule::CapsuleSurface {
                half_length: checked_length(shape.kind(), *half_length)?,
                radius: checked_length(shape.kind(), *radius)?,
            }),
            Shape::Cuboid { half_extents } => {
                Arc::new(cuboid::CuboidSurface { half_extents: checked_lengths(shape.kind(), *half_extents)? })
            }
            Shape::Cylinder { half_length, radius } => Arc::new(cylinder::CylinderSurface {
                half_length: checked_length(shape.kind(), *half_length)?,
                radius: checked_length(shape.kind(), *radius)?,
            }),
            Shape::Ellipsoid { radii } => {
                Arc::new(ellipsoid::EllipsoidSurface { radii: checked_lengths(shape.kind(), *radii)? })
            }
            Shape::Convex(hull) => {
                let mesh = TriangleMesh::new(hull.vertices().to_vec(), hull.triangles().to_vec())?;
                return Surface::of_mesh(&mesh, crease_angle);
            }
            Shape::Mesh(mesh) => return Surface::of_mesh(mesh, crease_angle),
        };
        Ok(Surface { kind, mesh: None })
    }

    fn of_mesh(mesh: &TriangleMesh, crease_angle: f64) -> Result<Self, SurfaceError> {
        let mesh = Arc::new(MeshSurface::new(mesh, crease_angle)?);
        Ok(Surface { kind: mesh.clone(), mesh: Some(mesh) })
    }

    /// The triangles behind the surface of a mesh or convex polyhedron; None for the other kinds.
    pub fn mesh(&self) -> Option<&MeshSurface> {
        self.mesh.as_deref()
    }

    /// Area, in m^2.
    pub fn area(&self) -> f64 {
        self.kind.area()
    }

    /// A point drawn uniformly by area.
    pub fn sample(&self, rng: &mut Rng) -> SurfacePoint {
        self.kind.sample(rng)
    }

    /// The first point of the surface on the ray from `origin` along `direction`, at a distance above zero, from inside
    /// or outside.
    pub fn cast_ray(&self, origin: &Point, direction: &UnitVector) -> Option<SurfacePoint> {
        self.kind.cast_ray(origin, direction)
    }

    /// Where the ray from `origin` along `direction` leaves the solid, nearest first; for convex shapes of a ray from inside. A
    /// ray from the hollow of a cup leaves through the outer wall only.
    pub fn exits(&self, origin: &Point, direction: &UnitVector) -> Vec<SurfacePoint> {
        self.kind.exits(origin, direction)
    }

    /// The point of the surface nearest to `point`, from inside or outside.
    pub fn project(&self, point: &Point) -> SurfacePoint {
        self.kind.project(point)
    }

    /// Distance of `point` from the surface, negative inside. An open mesh has its inside behind its triangles.
    pub fn signed_distance(&self, point: &Point) -> f64 {
        self.kind.signed_distance(point)
    }

    /// The point of the surface nearest to `point` and the distance of [`Surface::signed_distance`]; cheaper than one after
    /// the other.
    pub fn project_signed(&self, point: &Point) -> (SurfacePoint, f64) {
        self.kind.project_signed(point, f64::INFINITY)
    }

    /// The same, faster for the point `on_surface` of the surface that is known to be near: nothing farther is looked at.
    pub fn project_signed_from(&self, point: &Point, on_surface: &Point) -> (SurfacePoint, f64) {
        self.kind.project_signed(point, (point - on_surface).norm())
    }

    /// What the surface is near the point `at`, which is nearest to the point `from` outside, and a point of that plane, line or point; None
    /// where it is none of these, as on rims and ellipsoids.
    pub fn facing(&self, at: &SurfacePoint, from: &Point) -> Option<(Facing, Point)> {
        self.kind.facing(at, from)
    }

    /// The contact of a ball of radius `tip_radius` that touches the surface near `near` and penetrates nowhere; its
    /// normal points from the contact to the ball's centre; that of a point, with the radius zero, is the normal of its triangle. See
    /// `settle.rs`. None when no such ball is within reach.
    pub fn settle(&self, near: &SurfacePoint, tip_radius: f64) -> Option<SurfacePoint> {
        self.settle_counted(near, tip_radius, &mut 0)
    }

    /// The same; adds the number of distances that were measured, which is what it costs, to `n_measured`.
    pub fn settle_counted(&self, near: &SurfacePoint, tip_radius: f64, n_measured: &mut u64) -> Option<SurfacePoint> {
        settle::settle(self, near, tip_radius, n_measured)
    }

    /// Straight-line distance to the nearest crease (edge of a box, rim of a cylinder, sharp or open edge of a mesh);
    /// infinite on smooth surfaces.
    pub fn crease_distance(&self, at: &SurfacePoint) -> f64 {
        self.kind.crease_distance(at)
    }

    /// True when no crease divides the faces of `a` and `b`. On a mesh a face is what one can reach without crossing a
    /// crease; a crease that ends within a face may still be crossed by the geodesic.
    pub fn same_face(&self, a: &SurfacePoint, b: &SurfacePoint) -> bool {
        self.kind.same_face(a, b)
    }

    /// Principal curvatures, larger first, in 1/m, positive where the solid is convex.
    pub fn curvature(&self, at: &SurfacePoint) -> [f64; 2] {
        self.kind.curvature(at)
    }

    /// How the outward normal turns along the surface, in the object frame and in 1/m: moving by `d` across the normal turns the
    /// normal by this times `d`. Symmetric, zero along the normal; its other eigenvalues are those of [`Surface::curvature`].
    pub fn shape_operator(&self, at: &SurfacePoint) -> Matrix3<f64> {
        self.kind.shape_operator(at)
    }

    /// A shortest path on the surface. None when none exists (parts not connected) or its direction is undefined
    /// (antipodal points of a sphere).
    pub fn geodesic(&self, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic> {
        self.kind.geodesic(a, b)
    }
}

fn checked_length(kind: &'static str, value: f64) -> Result<f64, SurfaceError> {
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(SurfaceError::Length { kind, value }) }
}

fn checked_lengths(kind: &'static str, values: Vector) -> Result<Vector, SurfaceError> {
    for value in values.iter() {
        checked_length(kind, *value)?;
    }
    Ok(values)
}

/// `v / |v|`, or `otherwise` when `v` is zero.
fn unit_or(v: Vector, otherwise: UnitVector) -> UnitVector {
    UnitVector::try_new(v, 1e-300).unwrap_or(otherwise)
}

/// Takes off what is along the unit vector `normal`.
fn across(normal: &UnitVector) -> Matrix3<f64> {
    Matrix3::identity() - normal.as_ref() * normal.transpose()
}

/// The shape operator of the side of a round bar along z.
fn bar_operator(normal: &UnitVector, radius: f64) -> Matrix3<f64> {
    let around = Vector::z().cross(normal);
    around * around.transpose() / radius
}

/// The roots, in order, of `a t^2 + 2 b t + c`, without cancellation; None when there is none.
fn quadratic_roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 || a == 0.0 {
        return None;
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let (first, second) = (q / a, if q == 0.0 { 0.0 } else { c / q });
    Some(if first <= second { [first, second] } else { [second, first] })
}
