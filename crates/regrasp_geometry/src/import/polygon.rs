//! Cutting polygons into triangles by clipping ears (Meisters 1975) in the polygon's plane (Newell's normal).

use crate::frame::Point;
use nalgebra::Vector2;

/// Most corners of a polygon that is not convex; ear clipping is quadratic at best.
const MAX_CONCAVE: usize = 2_000;

/// Comparisons of a corner with an ear for all polygons of a file: a second or two. Polygons that cross themselves may need their number of
/// corners to the third power.
const MAX_COMPARED: u64 = 300_000_000;

/// Cuts the polygons of one file.
#[derive(Default)]
pub(super) struct Cutter {
    n_compared: u64,
}

impl Cutter {
    /// Appends the triangles of the polygon `face`, wound like it.
    ///
    /// Errors: it is concave and too large, or all such polygons together are; what was expected of it.
    pub(super) fn triangulate(
        &mut self,
        face: &[u32],
        vertices: &[Point],
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<(), String> {
        match triangulate(face, vertices, triangles, &mut self.n_compared) {
            true => Ok(()),
            false if face.len() > MAX_CONCAVE => Err(format!("at most {MAX_CONCAVE} where it is not convex")),
            false => Err("few polygons that are not convex, and none that crosses itself".into()),
        }
    }
}

fn triangulate(face: &[u32], vertices: &[Point], triangles: &mut Vec<[u32; 3]>, n_compared: &mut u64) -> bool {
    if let [a, b, c] = *face {
        triangles.push([a, b, c]);
        return true;
    }
    let flat = flattened(face, vertices);
    let n = face.len();
    let turn = |a: usize, b: usize, c: usize| {
        let (u, v) = (flat[b] - flat[a], flat[c] - flat[b]);
        u.x * v.y - u.y * v.x
    };
    // Convex: no corner turns back and the turns add up to one round; a fan will do.
    let rising = |i: usize| flat[i].x <= flat[(i + 1) % n].x;
    let n_reversals = (0..n).filter(|&i| rising(i) != rising((i + 1) % n)).count();
    if n_reversals <= 2 && (0..n).all(|i| turn(i, (i + 1) % n, (i + 2) % n) >= 0.0) {
        triangles.extend((1..n - 1).map(|i| [face[0], face[i], face[i + 1]]));
        return true;
    }
    if n > MAX_CONCAVE {
        return false;
    }
    let mut left: Vec<usize> = (0..n).collect();
    while left.len() > 3 {
        if *n_compared > MAX_COMPARED {
            return false;
        }
        let m = left.len();
        let mut n_here = 0;
        let corner = |i: usize| [left[(i + m - 1) % m], left[i], left[(i + 1) % m]];
        let mut is_ear = |i: &usize| {
            n_here += 1;
            let [a, b, c] = corner(*i);
            turn(a, b, c) > 0.0
                && left.iter().all(|&p| {
                    n_here += 1;
                    // Repeated positions, as bridges to holes have, do not block.
                    let apart = flat[p] != flat[a] && flat[p] != flat[b] && flat[p] != flat[c];
                    !(apart && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0)
                })
        };
        // A polygon that crosses itself may have no ear; then the straightest corner goes.
        let straightest = || {
            (0..m).min_by(|&i, &j| {
                let [a, b, c] = corner(i);
                let [d, e, f] = corner(j);
                turn(a, b, c).abs().total_cmp(&turn(d, e, f).abs())
            })
        };
        let Some(ear) = (0..m).find(&mut is_ear).or_else(straightest) else { break };
        *n_compared += n_here;
        let [a, b, c] = corner(ear);
        triangles.push([face[a], face[b], face[c]]);
        left.remove(ear);
    }
    if let [a, b, c] = left[..] {
        triangles.push([face[a], face[b], face[c]]);
    }
    true
}

/// The polygon seen along its normal, counter-clockwise.
fn flattened(face: &[u32], vertices: &[Point]) -> Vec<Vector2<f64>> {
    let at = |i: usize| vertices[face[i % face.len()] as usize];
    let origin = at(0);
    let mut normal = crate::frame::Vector::zeros();
    for i in 0..face.len() {
        normal += (at(i) - origin).cross(&(at(i + 1) - origin));
    }
    // A polygon without area gives triangles without area, which the mesh counts and drops.
    let normal = nalgebra::Unit::try_new(normal, 0.0).unwrap_or_else(crate::frame::Vector::z_axis);
    let (x, y) = crate::frame::tangents(&normal);
    (0..face.len()).map(|i| Vector2::new((at(i) - origin).dot(&x), (at(i) - origin).dot(&y))).collect()
}
