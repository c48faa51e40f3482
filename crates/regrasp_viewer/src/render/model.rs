//! Triangles with normals, placed and painted.

use crate::story::tessellate::Triangles;
use nalgebra::Point3;
use regrasp_geometry::{Point, Pose, Vector};
use std::sync::Arc;

/// A surface made of triangles, with the normals it is shaded with, in its own frame.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Corners of each triangle, counter-clockwise seen from outside.
    pub corners: Vec<[Point; 3]>,
    /// Unit normals at these corners.
    pub normals: Vec<[Vector; 3]>,
}

impl Surface {
    /// The surface that triangles make: at every corner the mean of the normals of the triangles there that fold by less
    /// than `smooth_below`, weighted with their angles. Triangles without an area are left out.
    pub fn of(mesh: &Triangles) -> Self {
        let place = |t: &[u32; 3]| t.map(|i| mesh.vertices[i as usize]);
        let normal_of = |[a, b, c]: [Point; 3]| (b - a).cross(&(c - a)).try_normalize(0.0);
        let kept = mesh.triangles.iter().filter_map(|t| Some((*t, place(t), normal_of(place(t))?)));
        let kept: Vec<([u32; 3], [Point; 3], Vector)> = kept.collect();
        let mut around: Vec<Vec<(usize, f64)>> = vec![Vec::new(); mesh.vertices.len()];
        for (i, (triangle, corners, _)) in kept.iter().enumerate() {
            for k in 0..3 {
                let [here, next, last] = [0, 1, 2].map(|step| corners[(k + step) % 3]);
                let cosine = (next - here).normalize().dot(&(last - here).normalize());
                around[triangle[k] as usize].push((i, libm::acos(cosine.clamp(-1.0, 1.0))));
            }
        }
        let least_cosine = libm::cos(mesh.smooth_below);
        let normal = |i: usize, k: usize| {
            let (triangle, _, own) = &kept[i];
            let is_alike = |j: &usize| mesh.smooth_below > 0.0 && own.dot(&kept[*j].2) >= least_cosine;
            let alike = around[triangle[k] as usize].iter().filter(|(j, _)| *j == i || is_alike(j));
            alike.map(|(j, angle)| kept[*j].2 * *angle).sum::<Vector>().try_normalize(0.0).unwrap_or(*own)
        };
        let normals = (0..kept.len()).map(|i| [0, 1, 2].map(|k| normal(i, k))).collect();
        Surface { corners: kept.iter().map(|(_, corners, _)| *corners).collect(), normals }
    }
}

/// Colour of a surface, as linear light: red, green, blue in 0..=1.
#[derive(Debug, Clone, PartialEq)]
pub enum Paint {
    /// The same everywhere.
    Plain([f64; 3]),
    /// Two tones in the eight octants about a point of the surface's frame, and a dot where each positive half axis comes
    /// out: every orientation looks different.
    Octants {
        /// The point.
        center: Point,
        /// Turns the surface's frame into the one whose axes divide it.
        axes: nalgebra::UnitQuaternion<f64>,
        /// The tones.
        tones: [[f64; 3]; 2],
        /// Colours of the dots on +x, +y, +z.
        dots: [[f64; 3]; 3],
        /// Half the angle of a dot, seen from the centre, as its cosine.
        dot_cosine: f64,
    },
}

impl Paint {
    /// Colour at a point of the surface's frame.
    pub fn at(&self, point: &Point) -> [f64; 3] {
        match self {
            Paint::Plain(color) => *color,
            Paint::Octants { center, axes, tones, dots, dot_cosine } => {
                let offset = axes * (point - center);
                let length = offset.norm();
                let (axis, largest) = (offset.imax(), offset.max());
                if largest > 0.0 && largest >= dot_cosine * length {
                    return dots[axis];
                }
                let negative = offset.iter().filter(|c| **c < 0.0).count();
                tones[negative % 2]
            }
        }
    }
}

/// A surface at its place.
#[derive(Debug, Clone)]
pub struct PlacedSurface {
    /// Pose of the surface's frame in the world.
    pub world_from_surface: Pose,
    /// The surface.
    pub surface: Arc<Surface>,
    /// Its colour.
    pub paint: Paint,
    /// Models with the same number have no outline against each other where they touch.
    pub body: u32,
}

impl PlacedSurface {
    /// Corners of all triangles in the world.
    pub fn world_corners(&self) -> impl Iterator<Item = [Point; 3]> + '_ {
        let placed = self.world_from_surface.to_homogeneous();
        self.surface.corners.iter().map(move |corners| corners.map(|p| place(&placed, &p)))
    }
}

fn place(placed: &nalgebra::Matrix4<f64>, p: &Point) -> Point {
    let row = |k: usize| placed[(k, 0)] * p.x + placed[(k, 1)] * p.y + placed[(k, 2)] * p.z + placed[(k, 3)];
    Point3::new(row(0), row(1), row(2))
}

/// Linear light of an sRGB colour `#rrggbb`.
pub fn linear(color: &str) -> [f64; 3] {
    crate::palette::bytes(color).map(|byte| to_linear(f64::from(byte) / 255.0))
}

fn to_linear(value: f64) -> f64 {
    if value <= 0.040_45 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
}

/// `from` and `to` mixed: 0 gives `from`.
pub fn mixed(from: [f64; 3], to: [f64; 3], share: f64) -> [f64; 3] {
    [0, 1, 2].map(|k| from[k] + (to[k] - from[k]) * share)
}
