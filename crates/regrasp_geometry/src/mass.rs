//! Volume, centre of mass and inertia of solids of uniform density.
//!
//! Meshes by the divergence theorem (Tonon 2004, "Explicit exact formulas for the 3-D tetrahedron inertia tensor").

use crate::frame::{Point, Vector};
use crate::mesh::TriangleMesh;
use crate::shape::Shape;
use nalgebra::Matrix3;
use std::f64::consts::PI;

/// Mass properties of a solid of density one.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Volume, in m^3; times the density it is the mass.
    pub volume: f64,
    /// Centre of mass, in the shape's frame.
    pub center_of_mass: Point,
    /// Inertia about the centre of mass, axes as the shape's, per density, in m^5.
    pub inertia_per_density: Matrix3<f64>,
    /// True when the mesh was inside out and was taken the other way: worth a note to the user.
    pub was_inside_out: bool,
}

/// Why a shape has no mass properties.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolidError {
    /// The mesh does not bound a solid.
    #[error(
        "the mesh is not a closed solid ({open_edges} open, {non_manifold_edges} non-manifold, {flipped_edges} flipped \
         edges), so its volume and centre of mass are not known"
    )]
    NotWatertight {
        /// Edges with one triangle.
        open_edges: usize,
        /// Edges with more than two triangles.
        non_manifold_edges: usize,
        /// Edges whose triangles are wound against each other.
        flipped_edges: usize,
    },
    /// The volume is zero.
    #[error("the solid has no volume")]
    NoVolume,
}

/// Volume, centre of mass and inertia of `shape`. Errors: a mesh that is open, or has no volume.
pub fn solid_properties(shape: &Shape) -> Result<Solid, SolidError> {
    let centered = |volume: f64, [x, y, z]: [f64; 3]| {
        // Second moments of the coordinates give the inertia.
        let inertia = Matrix3::from_diagonal(&Vector::new(y + z, x + z, x + y)) * volume;
        Ok(Solid { volume, center_of_mass: Point::origin(), inertia_per_density: inertia, was_inside_out: false })
    };
    match shape {
        Shape::Sphere { radius } => centered(4.0 / 3.0 * PI * radius.powi(3), [radius * radius / 5.0; 3]),
        Shape::Cuboid { half_extents: h } => centered(8.0 * h.x * h.y * h.z, h.map(|e| e * e / 3.0).into()),
        Shape::Ellipsoid { radii: r } => centered(4.0 / 3.0 * PI * r.x * r.y * r.z, r.map(|e| e * e / 5.0).into()),
        Shape::Cylinder { half_length, radius } => {
            let across = radius * radius / 4.0;
            centered(2.0 * PI * radius * radius * half_length, [across, across, half_length * half_length / 3.0])
        }
        Shape::Capsule { half_length: h, radius: r } => {
            let (side, caps) = (2.0 * PI * r * r * h, 4.0 / 3.0 * PI * r.powi(3));
            let volume = side + caps;
            let across = (side * r * r / 4.0 + caps * r * r / 5.0) / volume;
            // Half a ball reaches from h on: mean of (h + u)^2 with mean u 3 r / 8 and mean u^2 r^2 / 5.
            let along = (side * h * h / 3.0 + caps * (h * h + 0.75 * h * r + r * r / 5.0)) / volume;
            centered(volume, [across, across, along])
        }
        Shape::Convex(hull) => of_triangles(hull.vertices(), hull.triangles()),
        Shape::Mesh(mesh) => {
            let statistics = mesh.statistics();
            if !statistics.is_watertight() {
                return Err(SolidError::NotWatertight {
                    open_edges: statistics.open_edges,
                    non_manifold_edges: statistics.non_manifold_edges,
                    flipped_edges: statistics.flipped_edges,
                });
            }
            of_mesh(mesh)
        }
    }
}

fn of_mesh(mesh: &TriangleMesh) -> Result<Solid, SolidError> {
    of_triangles(mesh.vertices(), mesh.triangles())
}

/// Sums the tetrahedra from a point in the middle to each triangle.
fn of_triangles(vertices: &[Point], triangles: &[[u32; 3]]) -> Result<Solid, SolidError> {
    let (low, high) = vertices.iter().fold((vertices[0], vertices[0]), |(l, h), p| (l.inf(p), h.sup(p)));
    let origin = nalgebra::center(&low, &high);
    let (mut volume, mut first, mut second) = (0.0, Vector::zeros(), Matrix3::zeros());
    for corners in triangles {
        let [a, b, c] = corners.map(|i| vertices[i as usize] - origin);
        let piece = a.dot(&b.cross(&c)) / 6.0;
        let sum = a + b + c;
        volume += piece;
        first += sum * (piece / 4.0);
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose();
        second += (squares + sum * sum.transpose()) * (piece / 20.0);
    }
    let was_inside_out = volume < 0.0;
    if was_inside_out {
        (volume, first, second) = (-volume, -first, -second);
    }
    let size = (high - low).norm();
    if volume.is_nan() || volume <= 1e-12 * size.powi(3) {
        return Err(SolidError::NoVolume);
    }
    let center = first / volume;
    let covariance = second - center * center.transpose() * volume;
    let inertia_per_density = Matrix3::identity() * covariance.trace() - covariance;
    Ok(Solid { volume, center_of_mass: origin + center, inertia_per_density, was_inside_out })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ConvexHull;
    use regrasp_base::Rng;
    use std::sync::Arc;

    #[test]
    fn closed_forms_match_monte_carlo() {
        let shapes = [
            Shape::Sphere { radius: 0.5 },
            Shape::Capsule { half_length: 0.6, radius: 0.3 },
            Shape::Cuboid { half_extents: Vector::new(0.2, 0.5, 0.9) },
            Shape::Cylinder { half_length: 0.7, radius: 0.4 },
            Shape::Ellipsoid { radii: Vector::new(0.3, 0.6, 0.9) },
        ];
        for shape in shapes {
            let surface = crate::Surface::of(&shape).unwrap();
            let solid = solid_properties(&shape).unwrap();
            let mut rng = Rng::keyed(1, "mass", 0);
            let (low, high) = shape.bounds();
            let n = 400_000;
            let (mut inside, mut second) = (0, Matrix3::zeros());
            for _ in 0..n {
                let p = Point::from(Vector::from(std::array::from_fn::<f64, 3, _>(|k| rng.uniform(low[k], high[k]))));
                if surface.signed_distance(&p) < 0.0 {
                    inside += 1;
                    second += p.coords * p.coords.transpose();
                }
            }
            let cell = (high - low).product() / f64::from(n);
            let inertia = (Matrix3::identity() * second.trace() - second) * cell;
            assert!((f64::from(inside) * cell / solid.volume - 1.0).abs() < 0.01, "{}", shape.kind());
            let error = (inertia - solid.inertia_per_density).norm() / solid.inertia_per_density.norm();
            assert!(error < 0.02, "{} {error}", shape.kind());
        }
    }

    #[test]
    fn polyhedra_match_the_box_wherever_they_stand() {
        let half = Vector::new(0.2, 0.5, 0.9);
        let offset = Vector::new(3.0, -2.0, 7.0);
        let corner =
            |i: usize| Point::from(Vector::from_fn(|k, _| if i >> k & 1 == 1 { half[k] } else { -half[k] }) + offset);
        let hull = ConvexHull::new(&(0..8).map(corner).collect::<Vec<_>>()).unwrap();
        let mesh = TriangleMesh::new(hull.vertices().to_vec(), hull.triangles().to_vec()).unwrap();
        let exact = solid_properties(&Shape::Cuboid { half_extents: half }).unwrap();
        for (shape, inside_out) in [
            (Shape::Convex(Arc::new(hull)), false),
            (Shape::Mesh(Arc::new(mesh.clone())), false),
            (Shape::Mesh(Arc::new(mesh.clone().flipped())), true),
        ] {
            let solid = solid_properties(&shape).unwrap();
            assert!((solid.volume - exact.volume).abs() < 1e-12);
            assert!((solid.center_of_mass.coords - offset).norm() < 1e-12);
            assert!((solid.inertia_per_density - exact.inertia_per_density).norm() < 1e-12);
            assert_eq!(solid.was_inside_out, inside_out);
        }
        let open = TriangleMesh::new(mesh.vertices().to_vec(), mesh.triangles()[1..].to_vec()).unwrap();
        let error = solid_properties(&Shape::Mesh(Arc::new(open))).unwrap_err();
        assert!(matches!(error, SolidError::NotWatertight { open_edges: 3, .. }), "{error}");
    }
}
