//! Which points count towards a direction: cells of directions on the faces of a cube.

use regrasp_geometry::Vector;

/// Cells along an edge of the cube.
const CELLS: usize = 10;
/// A point belongs to a cell when its share is within this factor of the least one at some direction tried: directions between
/// those tried are at most a quarter of a cell away.
const SPARE: f64 = 0.96;
/// Directions tried along an edge of a cell.
const TRIED: usize = 3;

/// Lists of points by direction.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalTable {
    starts: Vec<u32>,
    indices: Vec<u16>,
    /// The points of the indices, side by side.
    points: Vec<[f64; 3]>,
}

impl NormalTable {
    /// For each cell the points that may reach at least `least_share` of the farthest one in one of its directions.
    pub fn new(points: &[Vector], least_share: f64) -> Self {
        let mut table = NormalTable { starts: vec![0], indices: Vec::new(), points: Vec::new() };
        let mut counts = vec![false; points.len()];
        for cell in 0..6 * CELLS * CELLS {
            let (face, row, column) = (cell / (CELLS * CELLS), cell / CELLS % CELLS, cell % CELLS);
            counts.fill(false);
            for k in 0..TRIED * TRIED {
                let at = |index: usize, part: usize| {
                    let share = (index as f64 + part as f64 / (TRIED - 1) as f64) / CELLS as f64;
                    2.0 * share - 1.0
                };
                let n = direction(face, at(row, k / TRIED), at(column, k % TRIED)).normalize();
                let largest = points.iter().map(|point| point.dot(&n)).fold(0.0, f64::max);
                for (counts, point) in counts.iter_mut().zip(points) {
                    *counts |= point.dot(&n) >= SPARE * least_share * largest;
                }
            }
            table.indices.extend((0..points.len()).filter(|&i| counts[i]).map(|i| i as u16));
            table.starts.push(table.indices.len() as u32);
        }
        table.set_points(points);
        table
    }

    /// The points have moved a little.
    pub fn set_points(&mut self, points: &[Vector]) {
        self.points.clear();
        self.points.extend(self.indices.iter().map(|&i| <[f64; 3]>::from(points[usize::from(i)])));
    }

    /// The points that may count towards `n`, with their indices.
    #[inline]
    pub fn near(&self, n: &Vector) -> (&[u16], &[[f64; 3]]) {
        let size = n.abs();
        let axis = size.imax();
        let (across, along) = ([(1, 2), (2, 0), (0, 1)][axis], size[axis].max(f64::MIN_POSITIVE));
        let index = |value: f64| ((0.5 * (value / along + 1.0) * CELLS as f64) as usize).min(CELLS - 1);
        let face = 2 * axis + usize::from(n[axis] < 0.0);
        let cell = (face * CELLS + index(n[across.0])) * CELLS + index(n[across.1]);
        let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
        (&self.indices[range.clone()], &self.points[range])
    }
}

/// The direction through a point of a face of the cube.
fn direction(face: usize, row: f64, column: f64) -> Vector {
    let axis = face / 2;
    let (across, sign) = ([(1, 2), (2, 0), (0, 1)][axis], if face.is_multiple_of(2) { 1.0 } else { -1.0 });
    let mut n = Vector::zeros();
    (n[axis], n[across.0], n[across.1]) = (sign, row, column);
    n
}
