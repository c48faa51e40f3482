//! Convex polyhedra of many corners: the farthest corner by a walk over the edges instead of a look at all.

use parry3d_f64::math::Vector as ParryVector;
use parry3d_f64::shape::{ConvexPolyhedron, SupportMap};

/// Up to this many corners a look at all is as fast.
const LOOK_AT_ALL: usize = 128;
/// Cells along an edge of the cube of directions; each has a corner to start from.
const CELLS: usize = 8;

/// A convex polyhedron.
#[derive(Clone)]
pub(super) struct Polyhedron {
    shape: ConvexPolyhedron,
    walk: Option<Walk>,
}

/// Who is next to whom, and where walks start.
#[derive(Clone)]
struct Walk {
    /// Neighbours of corner `i` are `neighbours[first[i]..first[i + 1]]`.
    first: Vec<u32>,
    neighbours: Vec<u32>,
    starts: Vec<u32>,
}

impl Polyhedron {
    /// Prepares a polyhedron with these faces.
    pub fn new(shape: ConvexPolyhedron, triangles: &[[u32; 3]]) -> Self {
        let walk = (shape.points().len() > LOOK_AT_ALL).then(|| Walk::new(shape.points(), triangles));
        Polyhedron { shape, walk }
    }

    /// Its corners.
    pub fn points(&self) -> &[ParryVector] {
        self.shape.points()
    }
}

impl SupportMap for Polyhedron {
    fn local_support_point(&self, direction: ParryVector) -> ParryVector {
        match &self.walk {
            Some(walk) if direction.is_finite() => walk.farthest(self.shape.points(), direction),
            _ => self.shape.local_support_point(direction),
        }
    }
}

impl Walk {
    fn new(points: &[ParryVector], triangles: &[[u32; 3]]) -> Self {
        let mut next_to: Vec<Vec<u32>> = vec![Vec::new(); points.len()];
        for corners in triangles {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                next_to[a as usize].push(b);
                next_to[b as usize].push(a);
            }
        }
        let mut walk = Walk { first: vec![0], neighbours: Vec::new(), starts: vec![0; 6 * CELLS * CELLS] };
        for list in &mut next_to {
            list.sort_unstable();
            list.dedup();
            walk.neighbours.extend_from_slice(list);
            walk.first.push(walk.neighbours.len() as u32);
        }
        for (cell, start) in (0..6 * CELLS * CELLS).map(middle_of).map(|n| farthest_of_all(points, n)).enumerate() {
            walk.starts[cell] = start;
        }
        walk
    }

    fn farthest(&self, points: &[ParryVector], direction: ParryVector) -> ParryVector {
        let mut at = self.starts[cell_of(direction)] as usize;
        let mut reached = points[at].dot(direction);
        loop {
            let mut better = at;
            for &next in &self.neighbours[self.first[at] as usize..self.first[at + 1] as usize] {
                let reaches = points[next as usize].dot(direction);
                if reaches > reached {
                    (better, reached) = (next as usize, reaches);
                }
            }
            if better == at {
                return points[at];
            }
            at = better;
        }
    }
}

fn farthest_of_all(points: &[ParryVector], direction: ParryVector) -> u32 {
    let reaches = points.iter().map(|point| point.dot(direction)).enumerate();
    reaches.fold((0, f64::NEG_INFINITY), |best, one| if one.1 > best.1 { one } else { best }).0 as u32
}

/// The cell of a direction: the face of the cube that it goes through, and where.
fn cell_of(direction: ParryVector) -> usize {
    let components = [direction.x, direction.y, direction.z];
    let size = components.map(f64::abs);
    let axis = if size[0] >= size[1] && size[0] >= size[2] {
        0
    } else if size[1] >= size[2] {
        1
    } else {
        2
    };
    let along = size[axis].max(f64::MIN_POSITIVE);
    let index = |k: usize| ((0.5 * (components[k] / along + 1.0) * CELLS as f64) as usize).min(CELLS - 1);
    let face = 2 * axis + usize::from(components[axis] < 0.0);
    (face * CELLS + index((axis + 1) % 3)) * CELLS + index((axis + 2) % 3)
}

/// The direction through the middle of a cell.
fn middle_of(cell: usize) -> ParryVector {
    let (face, row, column) = (cell / (CELLS * CELLS), cell / CELLS % CELLS, cell % CELLS);
    let at = |index: usize| (2 * index + 1) as f64 / CELLS as f64 - 1.0;
    let (axis, mut components) = (face / 2, [0.0; 3]);
    components[axis] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    components[(axis + 1) % 3] = at(row);
    components[(axis + 2) % 3] = at(column);
    ParryVector::new(components[0], components[1], components[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ConvexHull;
    use crate::frame::{Point, Vector};
    use regrasp_base::Rng;

    #[test]
    fn walks_end_where_a_look_at_all_does() {
        let mut rng = Rng::keyed(3, "walks", 0);
        // An egg, and a bar with flat faces of many corners.
        let egg: Vec<Point> = (0..2000)
            .map(|_| Point::from(Vector::from(rng.direction()).component_mul(&Vector::new(0.01, 0.02, 0.03))))
            .collect();
        let bar: Vec<Point> = (0..400)
            .map(|k| {
                let (sine, cosine) = (std::f64::consts::TAU * f64::from(k / 2) / 200.0).sin_cos();
                Point::new(0.01 * cosine, 0.02 * sine, if k % 2 == 0 { 0.03 } else { -0.03 })
            })
            .collect();
        for points in [egg, bar] {
            let hull = ConvexHull::new(&points).unwrap();
            let corners: Vec<ParryVector> = hull.vertices().iter().map(super::super::vector).collect();
            let shape = ConvexPolyhedron::from_convex_mesh(corners, hull.triangles()).unwrap();
            let polyhedron = Polyhedron::new(shape.clone(), hull.triangles());
            assert!(polyhedron.walk.is_some());
            for _ in 0..5000 {
                let d = rng.direction();
                let direction = ParryVector::new(d[0], d[1], d[2]) * rng.uniform(0.1, 3.0);
                let far = |point: ParryVector| point.dot(direction);
                let (walked, known) = (polyhedron.local_support_point(direction), shape.local_support_point(direction));
                assert!((far(walked) - far(known)).abs() <= 1e-15, "{walked} {known}");
            }
        }
    }
}
