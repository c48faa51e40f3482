//! Where the picture is taken from.

use nalgebra::Matrix3;
use regrasp_geometry::{Point, Vector};

/// A pinhole camera with square pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Centre of projection, in the world.
    pub eye: Point,
    /// Rows: to the right, up, and into the picture; in the world.
    pub axes: Matrix3<f64>,
    /// Pixels per unit of (offset over depth).
    pub focal: f64,
    /// Where the line of sight meets the picture, in pixels from its upper left corner.
    pub center: [f64; 2],
}

/// What is seen of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Pixels to the right of the picture's left edge.
    pub x: f64,
    /// Pixels below the picture's upper edge.
    pub y: f64,
    /// Distance along the line of sight, in metres.
    pub depth: f64,
}

impl Camera {
    /// Looks along `toward` at `target` from `distance` metres, with +z of the world up (or +y, where it looks along z).
    pub fn looking(toward: &Vector, target: &Point, distance: f64, focal: f64, center: [f64; 2]) -> Self {
        let forward = toward.normalize();
        let up = if forward.z.abs() > 0.999 { Vector::y() } else { Vector::z() };
        let right = forward.cross(&up).normalize();
        let upward = right.cross(&forward);
        let axes = Matrix3::from_rows(&[right.transpose(), upward.transpose(), forward.transpose()]);
        Camera { eye: target - forward * distance, axes, focal, center }
    }

    /// Where `point` is seen; its depth may be negative, which means behind the camera.
    pub fn see(&self, point: &Point) -> Seen {
        let local = self.axes * (point - self.eye);
        let scale = self.focal / local.z;
        Seen { x: self.center[0] + scale * local.x, y: self.center[1] - scale * local.y, depth: local.z }
    }

    /// Direction from the eye through a place of the picture; its depth is 1.
    pub fn ray(&self, x: f64, y: f64) -> Vector {
        let local = Vector::new((x - self.center[0]) / self.focal, (self.center[1] - y) / self.focal, 1.0);
        self.axes.transpose() * local
    }

    /// The same view of a picture `factor` times as large.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let center = self.center.map(|c| c * factor);
        Camera { focal: self.focal * factor, center, ..self.clone() }
    }

    /// Direction of the line of sight.
    pub fn forward(&self) -> Vector {
        self.axes.row(2).transpose()
    }
}
