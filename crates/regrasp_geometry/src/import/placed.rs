//! Triangles of a scene whose parts are placed by matrices, and of strips and fans.

use super::{Faults, MAX_TRIANGLES, too_many};
use crate::frame::Point;
use crate::mesh::TriangleMesh;
use nalgebra::Matrix4;
use regrasp_base::InputError;
use std::path::Path;

/// Corners of a triangle.
pub(super) type Corners = [Point; 3];

/// Triangles of a strip: each corner after the second makes one with the two before it, every other one turned.
pub(super) fn strip<T: Copy>(corners: &[T]) -> impl Iterator<Item = [T; 3]> {
    corners.windows(3).enumerate().map(|(k, c)| if k % 2 == 0 { [c[0], c[1], c[2]] } else { [c[1], c[0], c[2]] })
}

/// Triangles of a fan: each corner after the second makes one with the first and the one before it.
pub(super) fn fan<T: Copy>(corners: &[T]) -> impl Iterator<Item = [T; 3]> {
    corners.windows(2).skip(1).map(|c| [corners[0], c[0], c[1]])
}

/// Triangles in the frame of the file.
pub(super) struct Placed<'a> {
    path: &'a Path,
    vertices: Vec<Point>,
}

impl<'a> Placed<'a> {
    pub(super) fn new(path: &'a Path) -> Self {
        Placed { path, vertices: Vec::new() }
    }

    /// Adds `triangles`, placed. A matrix that mirrors would turn them inside out: they are turned back. Errors: too many (`M220`).
    pub(super) fn add(&mut self, triangles: &[Corners], file_from_part: &Matrix4<f64>) -> Result<(), InputError> {
        let n_triangles = self.vertices.len() / 3 + triangles.len();
        if n_triangles > MAX_TRIANGLES {
            return Err(too_many(self.path, n_triangles));
        }
        let linear = file_from_part.fixed_view::<3, 3>(0, 0).into_owned();
        let offset = file_from_part.fixed_view::<3, 1>(0, 3).into_owned();
        let is_mirrored = linear.determinant() < 0.0;
        for &[a, b, c] in triangles {
            let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
            self.vertices.extend(corners.map(|point| Point::from(linear * point.coords + offset)));
        }
        Ok(())
    }

    /// The mesh of all of them. Errors: no triangles (`M202`), numbers that are not finite (`M203`).
    pub(super) fn finish(self) -> Result<TriangleMesh, InputError> {
        let triangles = (0..self.vertices.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Faults::new(self.path).finish(self.vertices, triangles)
    }
}
