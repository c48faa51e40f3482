//! Triangles of shapes: closed, counter-clockwise seen from outside.
//!
//! Round shapes are inscribed: vertices lie on the surface, and no point of a triangle is farther from it than
//! `DEVIATION` times the largest radius.

use regrasp_geometry::{Point, Shape, Vector};
use std::f64::consts::PI;

/// Largest distance of a triangle from the surface it stands for, as a share of the largest radius.
pub const DEVIATION: f64 = 0.005;
/// Sides of a circle. The chord of a circle of radius one strays by `1 - cos(pi / n)`, twice that for two curvatures.
const SIDES: usize = 48;
/// Faces that meet at a smaller angle are parts of one curved surface, in radians.
const SMOOTH_BELOW: f64 = 0.55;

/// Triangles, in the frame of what they stand for.
#[derive(Debug, Clone, PartialEq)]
pub struct Triangles {
    /// Vertices.
    pub vertices: Vec<Point>,
    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Angle below which neighbouring faces share a normal, in radians; 0 for polyhedra.
    pub smooth_below: f64,
}

/// The surface of `shape` as triangles. A mesh is taken as it is.
pub fn tessellate(shape: &Shape) -> Triangles {
    match shape {
        Shape::Sphere { radius } => lathe(&arc(*radius, 0.0, -0.5, 0.5)),
        Shape::Ellipsoid { radii } => {
            let mut ball = lathe(&arc(1.0, 0.0, -0.5, 0.5));
            ball.vertices.iter_mut().for_each(|v| *v = Point::from(v.coords.component_mul(radii)));
            ball
        }
        Shape::Capsule { half_length, radius } => {
            let mut profile = arc(*radius, -half_length, -0.5, 0.0);
            profile.extend(arc(*radius, *half_length, 0.0, 0.5));
            lathe(&profile)
        }
        Shape::Cylinder { half_length, radius } => {
            lathe(&[(0.0, -half_length), (*radius, -half_length), (*radius, *half_length), (0.0, *half_length)])
        }
        Shape::Cuboid { half_extents } => cuboid(half_extents),
        Shape::Convex(hull) => Triangles {
            vertices: hull.vertices().to_vec(),
            triangles: hull.triangles().to_vec(),
            smooth_below: SMOOTH_BELOW,
        },
        Shape::Mesh(mesh) => Triangles {
            vertices: mesh.vertices().to_vec(),
            triangles: mesh.triangles().to_vec(),
            smooth_below: SMOOTH_BELOW,
        },
    }
}

/// Points `(distance from z, height)` of a circle about height `z`, between two latitudes in units of pi.
fn arc(radius: f64, z: f64, from: f64, to: f64) -> Vec<(f64, f64)> {
    let n = (SIDES as f64 / 2.0 * (to - from)).round() as usize;
    let point = |i: usize| {
        let share = from + (to - from) * i as f64 / n as f64;
        // Poles are exactly on the axis.
        let across = if share.abs() == 0.5 { 0.0 } else { (share * PI).cos() };
        (radius * across, z + radius * (share * PI).sin())
    };
    (0..=n).map(point).collect()
}

/// The surface that a profile from pole to pole, upwards, sweeps about z.
fn lathe(profile: &[(f64, f64)]) -> Triangles {
    let n_rings = profile.len() - 2;
    let mut vertices = vec![Point::new(0.0, 0.0, profile[0].1)];
    for &(across, z) in &profile[1..=n_rings] {
        vertices.extend((0..SIDES).map(|i| {
            let angle = 2.0 * PI * i as f64 / SIDES as f64;
            Point::new(across * angle.cos(), across * angle.sin(), z)
        }));
    }
    vertices.push(Point::new(0.0, 0.0, profile[n_rings + 1].1));
    let (bottom, top) = (0, vertices.len() as u32 - 1);
    let at = |ring: usize, side: usize| (1 + ring * SIDES + side % SIDES) as u32;
    let mut triangles = Vec::new();
    for side in 0..SIDES {
        triangles.push([bottom, at(0, side + 1), at(0, side)]);
        for ring in 0..n_rings - 1 {
            let [a, b] = [at(ring, side), at(ring, side + 1)];
            let [c, d] = [at(ring + 1, side), at(ring + 1, side + 1)];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
        triangles.push([top, at(n_rings - 1, side), at(n_rings - 1, side + 1)]);
    }
    Triangles { vertices, triangles, smooth_below: SMOOTH_BELOW }
}

fn cuboid(half: &Vector) -> Triangles {
    let sign = |k: usize, bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
    let vertices = (0..8).map(|k| Point::new(sign(k, 0) * half.x, sign(k, 1) * half.y, sign(k, 2) * half.z)).collect();
    let faces: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Triangles { vertices, triangles, smooth_below: 0.0 }
}
