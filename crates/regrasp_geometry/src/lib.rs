//! Shapes, surfaces, distance and continuous collision. Knows no robot.
//!
//! Everything is `f64`, in metres. Transforms are `parent_from_child`.

/// Separation of shapes, at rest and along motions.
pub mod collision;
/// Poses, and motion between two poses.
pub mod frame;
/// Convex hulls with adjacency, for support queries.
pub mod hull;
/// Readers of mesh files: STL, OBJ, PLY, COLLADA and binary glTF.
pub mod import;
/// Volume, centre of mass and inertia of solids.
pub mod mass;
/// Triangle meshes as read, validated, with their statistics.
pub mod mesh;
/// Solids in convex parts.
pub mod parts;
/// Distance and penetration by parry: the checker's second way of knowing.
pub mod reference;
/// The shapes a link, an object or an obstacle can have.
pub mod shape;
/// Poses in which an object stands on a plane.
pub mod stable;
/// Surfaces one can sample by area, walk by geodesics, and ask for normals, curvature and creases.
pub mod surface;

pub use frame::{Point, Pose, UnitVector, Vector, interpolate_pose, pose_from};
pub use hull::ConvexHull;
pub use mesh::TriangleMesh;
pub use shape::Shape;
pub use surface::{Surface, SurfacePoint};
