//! Volume, centre of mass and inertia of solids of uniform density.
//!
//! Meshes by the divergence theorem (Tonon 2004, "Explicit exact formulas for the 3-D tetrahedron inertia tensor").

use crate::frame::{Point, Vector};
use crate::mesh::{TriangleMesh, rims};
use crate::shape::Shape;
use nalgebra::Matrix3;
use std::f64::consts::PI;

/// Holes count as closed where what closes them has at most this share of the mesh's area: the share of open edges up to which
/// a part of a surface encloses something.
const LARGEST_HOLES: f64 = 0.05;

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
    /// Area that was added to close holes, as a share of the mesh's: worth a note to the user where it is not zero.
    pub closed_share: f64,
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
        let center_of_mass = Point::origin();
        Ok(Solid { volume, center_of_mass, inertia_per_density: inertia, was_inside_out: false, closed_share: 0.0 })
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
            if statistics.is_closed() {
                return of_triangles(mesh.vertices(), mesh.triangles());
            }
            let (vertices, triangles, closed_share) = with_holes_closed(mesh);
            if closed_share > LARGEST_HOLES {
                return Err(SolidError::NotWatertight {
                    open_edges: statistics.open_edges,
                    non_manifold_edges: statistics.non_manifold_edges,
                    flipped_edges: statistics.flipped_edges,
                });
            }
            Ok(Solid { closed_share, ..of_triangles(&vertices, &triangles)? })
        }
    }
}

/// The mesh with a cone over every rim, from the middle of its corners, and the area of the cones as a share of the mesh's.
fn with_holes_closed(mesh: &TriangleMesh) -> (Vec<Point>, Vec<[u32; 3]>, f64) {
    let mut vertices = mesh.vertices().to_vec();
    let mut triangles = mesh.triangles().to_vec();
    let area_of = |vertices: &[Point], corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| vertices[i as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let area: f64 = triangles.iter().map(|corners| area_of(&vertices, corners)).sum();
    let rims = rims(&triangles);
    // Rims that share corners are one: each corner leads towards the lowest that can be reached.
    let mut towards: Vec<u32> = (0..vertices.len() as u32).collect();
    let lowest = |towards: &mut [u32], mut corner: u32| {
        while towards[corner as usize] != corner {
            towards[corner as usize] = towards[towards[corner as usize] as usize];
            corner = towards[corner as usize];
        }
        corner
    };
    for rim in &rims {
        let [from, to] = rim.map(|corner| lowest(&mut towards, corner));
        towards[from.max(to) as usize] = from.min(to);
    }
    let mut by_label: Vec<(u32, [u32; 2])> = rims.iter().map(|&rim| (lowest(&mut towards, rim[0]), rim)).collect();
    by_label.sort_unstable();
    let mut closing = 0.0;
    for hole in by_label.chunk_by(|(a, _), (b, _)| a == b) {
        let mut corners: Vec<u32> = hole.iter().flat_map(|(_, rim)| *rim).collect();
        corners.sort_unstable();
        corners.dedup();
        let sum: Vector = corners.iter().map(|&corner| vertices[corner as usize].coords).sum();
        let apex = vertices.len() as u32;
        vertices.push(Point::from(sum / corners.len() as f64));
        for (_, [from, to]) in hole {
            let cone = [*to, *from, apex];
            closing += area_of(&vertices, &cone);
            triangles.push(cone);
        }
    }
    (vertices, triangles, closing / area)
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
    Ok(Solid { volume, center_of_mass: origin + center, inertia_per_density, was_inside_out, closed_share: 0.0 })
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
        // Without one of the largest triangles: half a face of 1.0 x 1.8, of an area of 5.32.
        let area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|i| mesh.vertices()[i as usize]);
            (b - a).cross(&(c - a)).norm()
        };
        let mut triangles = mesh.triangles().to_vec();
        triangles.sort_by(|a, b| area(b).total_cmp(&area(a)));
        let open = TriangleMesh::new(mesh.vertices().to_vec(), triangles[1..].to_vec()).unwrap();
        let error = solid_properties(&Shape::Mesh(Arc::new(open))).unwrap_err();
        assert!(matches!(error, SolidError::NotWatertight { open_edges: 3, .. }), "{error}");
    }

    #[test]
    fn small_holes_are_closed_and_shared_edges_are_no_holes() {
        let mut rng = Rng::keyed(2, "mass", 0);
        let round: Vec<Point> = (0..3000).map(|_| Point::from(Vector::from(rng.direction()))).collect();
        let round = ConvexHull::new(&round).unwrap();
        let (vertices, triangles) = (round.vertices().to_vec(), round.triangles().to_vec());
        let whole = TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap();
        let exact = solid_properties(&Shape::Mesh(Arc::new(whole))).unwrap();
        assert_eq!(exact.closed_share, 0.0);
        // Without two of some 6000 triangles.
        let mut holed = triangles.clone();
        holed.swap_remove(2000);
        holed.swap_remove(7);
        let holed = TriangleMesh::new(vertices.clone(), holed).unwrap();
        let solid = solid_properties(&Shape::Mesh(Arc::new(holed))).unwrap();
        assert!((solid.volume / exact.volume - 1.0).abs() < 1e-4, "{}", solid.volume);
        assert!((solid.center_of_mass - exact.center_of_mass).norm() < 1e-4);
        assert!(solid.closed_share > 0.0 && solid.closed_share < 1e-3);
        // Two boxes that touch along an edge: four triangles there, and a volume all the same.
        let corner = |i: usize| Point::from(Vector::from_fn(|k, _| if i >> k & 1 == 1 { 1.0 } else { 0.0 }));
        let hull = ConvexHull::new(&(0..8).map(corner).collect::<Vec<_>>()).unwrap();
        let shift = Vector::new(1.0, 1.0, 0.0);
        let n = hull.vertices().len() as u32;
        let both: Vec<Point> =
            hull.vertices().iter().copied().chain(hull.vertices().iter().map(|v| v + shift)).collect();
        let more = hull.triangles().iter().map(|corners| corners.map(|i| i + n));
        let mesh = TriangleMesh::new(both, hull.triangles().iter().copied().chain(more).collect()).unwrap();
        assert!(!mesh.statistics().is_watertight() && mesh.statistics().is_closed());
        let solid = solid_properties(&Shape::Mesh(Arc::new(mesh))).unwrap();
        assert!((solid.volume - 2.0).abs() < 1e-12 && solid.closed_share == 0.0);
    }
}
