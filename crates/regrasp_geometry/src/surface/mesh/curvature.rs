//! Curvature of a triangle mesh.
//!
//! Rusinkiewicz 2004, "Estimating curvatures and their derivatives on triangle meshes": a second fundamental form per
//! triangle from the differences of its corner normals, averaged over the fans of the triangle's corners. Fans end at
//! creases, so a flat face stays flat up to its edges.

use super::{MeshSurface, barycentric};
use crate::frame::{UnitVector, Vector, tangents};
use crate::surface::{SurfacePoint, across};
use nalgebra::{Matrix2, Matrix3};

/// Principal curvatures at `at`, larger first, convex positive.
pub(super) fn curvature(mesh: &MeshSurface, at: &SurfacePoint) -> [f64; 2] {
    let tensor = fan_tensor(mesh, at);
    let (u, v) = tangents(&at.normal_in_object);
    let entry = |a: &UnitVector, b: &UnitVector| a.dot(&(tensor * b.as_ref()));
    let (p, q, r) = (entry(&u, &u), entry(&u, &v), entry(&v, &v));
    let (mean, spread) = (0.5 * (p + r), (0.25 * (p - r).powi(2) + q * q).sqrt());
    [mean + spread, mean - spread]
}

/// The same with directions.
pub(super) fn shape_operator(mesh: &MeshSurface, at: &SurfacePoint) -> Matrix3<f64> {
    let across = across(&at.normal_in_object);
    across * fan_tensor(mesh, at) * across
}

/// The second fundamental form about `at`, from the fans of the corners of its triangle.
fn fan_tensor(mesh: &MeshSurface, at: &SurfacePoint) -> Matrix3<f64> {
    let facet = at.facet as usize;
    let weights = barycentric(&mesh.corners(at.facet), &at.point_in_object);
    let mut tensor = Matrix3::zeros();
    let mut fan = Vec::new();
    for k in 0..3 {
        mesh.topology.fan(facet, k, |j, edge| mesh.is_crease[j][edge], &mut fan);
        let (mut sum, mut total) = (Matrix3::zeros(), 0.0);
        for &i in &fan {
            let [a, b, c] = mesh.corners(i);
            let area = (b - a).cross(&(c - a)).norm();
            sum += triangle_tensor(mesh, i as usize) * area;
            total += area;
        }
        tensor += sum * (weights[k] / total);
    }
    tensor
}

/// The second fundamental form of triangle `i` as a symmetric tensor in the object frame.
fn triangle_tensor(mesh: &MeshSurface, i: usize) -> Matrix3<f64> {
    let corners = mesh.corners(i as u32);
    let (u, v) = tangents(&mesh.face_normal(i as u32));
    let normals = mesh.corner_normals[i];
    // Least squares for [e f; f g] with [e f; f g] (edge in u, v) = normal difference in u, v, for three edges.
    let (mut system, mut right) = (Matrix3::zeros(), Vector::zeros());
    for k in 0..3 {
        let edge = corners[(k + 1) % 3] - corners[k];
        let turn = normals[(k + 1) % 3] - normals[k];
        let (x, y) = (edge.dot(&u), edge.dot(&v));
        let (row_u, row_v) = (Vector::new(x, y, 0.0), Vector::new(0.0, x, y));
        system += row_u * row_u.transpose() + row_v * row_v.transpose();
        right += row_u * turn.dot(&u) + row_v * turn.dot(&v);
    }
    let Some(form) = system.cholesky().map(|factor| factor.solve(&right)) else { return Matrix3::zeros() };
    let form = Matrix2::new(form.x, form.y, form.y, form.z);
    let (u, v) = (u.into_inner(), v.into_inner());
    let product = |a: &Vector, b: &Vector| a * b.transpose();
    product(&u, &u) * form[(0, 0)] + (product(&u, &v) + product(&v, &u)) * form[(0, 1)] + product(&v, &v) * form[(1, 1)]
}
