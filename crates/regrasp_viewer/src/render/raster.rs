//! Which triangle is seen at a sample.
//!
//! Corners are rounded to 1/256 of a sample and edges decided in whole numbers, with the top-left rule: of two triangles
//! that share an edge exactly one owns each sample on it, so that closed surfaces have no holes.

use super::camera::{Camera, Seen};
use super::model::PlacedSurface;
use regrasp_geometry::Point;

/// Steps per sample to which corners are rounded.
const STEPS: f64 = 256.0;
/// Corners farther out than this, in samples, are not drawn: edges must not overflow.
const FARTHEST: f64 = 1e6;
/// What is nearer to the camera than this, in metres, is not drawn.
const NEAREST: f64 = 1e-3;

/// No triangle.
pub const NONE: u32 = u32::MAX;

/// What is seen at every sample of a picture.
#[derive(Debug, Clone)]
pub struct Samples {
    /// Samples in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// One over the depth of what is seen; 0 where there is nothing.
    pub inverse_depth: Vec<f64>,
    /// Number of the triangle that is seen, counted through all models; [`NONE`] where there is nothing.
    pub triangle: Vec<u32>,
}

impl Samples {
    /// Nothing is seen.
    pub fn empty(width: usize, height: usize) -> Self {
        let n = width * height;
        Samples { width, height, inverse_depth: vec![0.0; n], triangle: vec![NONE; n] }
    }

    /// What `camera` sees of `models`, sides and backs of triangles alike.
    pub fn of(models: &[PlacedSurface], camera: &Camera, width: usize, height: usize) -> Self {
        let mut seen = Samples::empty(width, height);
        let mut number = 0;
        for model in models {
            for corners in model.world_corners() {
                seen.draw(&corners, camera, number);
                number += 1;
            }
        }
        seen
    }

    /// Draws one triangle where it is nearer than what is there; of two at the same depth the first stays.
    fn draw(&mut self, corners: &[Point; 3], camera: &Camera, number: u32) {
        let seen = corners.map(|p| camera.see(&p));
        let is_out = |p: &Seen| !(p.depth > NEAREST && p.x.abs() < FARTHEST && p.y.abs() < FARTHEST);
        if seen.iter().any(is_out) {
            return;
        }
        let mut fixed = seen.map(|p| [(p.x * STEPS).round() as i64, (p.y * STEPS).round() as i64]);
        let mut inverse = seen.map(|p| 1.0 / p.depth);
        let mut area = cross(&fixed[0], &fixed[1], &fixed[2]);
        if area == 0 {
            return;
        }
        if area < 0 {
            fixed.swap(1, 2);
            inverse.swap(1, 2);
            area = -area;
        }
        let range = |k: usize, end: usize| {
            let values = fixed.map(|p| p[k]);
            let [low, high] = [values.iter().min(), values.iter().max()].map(|v| v.copied().unwrap_or(0));
            let steps = STEPS as i64;
            let first = low.div_euclid(steps).clamp(0, end as i64) as usize;
            let last = (high.div_euclid(steps) + 1).clamp(0, end as i64) as usize;
            first..last
        };
        let (columns, rows) = (range(0, self.width), range(1, self.height));
        let edges = [edge(&fixed[1], &fixed[2]), edge(&fixed[2], &fixed[0]), edge(&fixed[0], &fixed[1])];
        let steps = STEPS as i64;
        let middle = |c: usize| c as i64 * steps + steps / 2;
        // From one column to the next every weight changes by the same whole number.
        let [step_a, step_b, step_c] =
            [-edges[0].along[1] * steps, -edges[1].along[1] * steps, -edges[2].along[1] * steps];
        let [least_a, least_b, least_c] = [edges[0].least, edges[1].least, edges[2].least];
        for row in rows {
            let (x, y) = (middle(columns.start), middle(row));
            let (mut a, mut b, mut c) = (edges[0].value(x, y), edges[1].value(x, y), edges[2].value(x, y));
            for at in row * self.width + columns.start..row * self.width + columns.end {
                if a >= least_a && b >= least_b && c >= least_c {
                    let value = (a as f64 * inverse[0] + b as f64 * inverse[1] + c as f64 * inverse[2]) / area as f64;
                    if value > self.inverse_depth[at] {
                        self.inverse_depth[at] = value;
                        self.triangle[at] = number;
                    }
                }
                (a, b, c) = (a + step_a, b + step_b, c + step_c);
            }
        }
    }
}

fn cross(a: &[i64; 2], b: &[i64; 2], c: &[i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Twice the signed area of the triangle of an edge and a place, as a function of the place.
struct Edge {
    along: [i64; 2],
    from: [i64; 2],
    /// Places with at least this value are inside: 0 on top and left edges, which own what lies on them, else 1.
    least: i64,
}

impl Edge {
    fn value(&self, x: i64, y: i64) -> i64 {
        self.along[0] * (y - self.from[1]) - self.along[1] * (x - self.from[0])
    }
}

fn edge(a: &[i64; 2], b: &[i64; 2]) -> Edge {
    let along = [b[0] - a[0], b[1] - a[1]];
    let owns = along[1] < 0 || (along[1] == 0 && along[0] > 0);
    Edge { along, from: *a, least: if owns { 0 } else { 1 } }
}
