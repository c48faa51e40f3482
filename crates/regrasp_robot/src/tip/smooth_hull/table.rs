//! Which points count towards a direction: cells of directions on the faces of a cube.
//!
//! Points are kept once, in blocks of four that lie near each other, and a cell lists blocks: a table is small enough to stay in
//! the nearest cache.

use regrasp_geometry::Vector;
use wide::f64x4;

/// Points that are looked at at once.
pub const LANES: usize = 4;
/// As many points: their x, y and z.
pub type Block = [f64x4; 3];

/// Most blocks: a bit each.
pub const MOST_BLOCKS: usize = u128::BITS as usize;
/// Cells along an edge of the cube.
const CELLS: usize = 20;
/// Directions tried along an edge of a cell, without its last corner.
const TRIED: usize = 2;
/// The same along an edge of the cube.
const GRID: usize = CELLS * TRIED;

/// Lists of blocks of points by direction.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalTable {
    blocks: Vec<Block>,
    /// First entry of each cell in `lists`.
    starts: Vec<u32>,
    lists: Vec<u8>,
}

impl NormalTable {
    /// For each cell the blocks of which a point reaches at least `least_share` of the farthest one in one of its directions.
    /// `points` are as [`in_blocks`] orders them.
    pub fn new(points: &[Vector], least_share: f64) -> Self {
        let mut table = NormalTable { blocks: Vec::new(), starts: vec![0], lists: Vec::new() };
        table.set_points(points);
        for face in 0..6 {
            let at = |k: usize| 2.0 * k as f64 / GRID as f64 - 1.0;
            let counts: Vec<u128> = (0..(GRID + 1) * (GRID + 1))
                .map(|k| count(&table.blocks, direction(face, at(k / (GRID + 1)), at(k % (GRID + 1))), least_share))
                .collect();
            for cell in 0..CELLS * CELLS {
                let corner = cell / CELLS * TRIED * (GRID + 1) + cell % CELLS * TRIED;
                let rows = (0..=TRIED).flat_map(|row| {
                    let start = corner + row * (GRID + 1);
                    &counts[start..=start + TRIED]
                });
                let counts = rows.fold(0, |all, counts| all | counts);
                table.lists.extend((0..MOST_BLOCKS as u8).filter(|&block| counts >> block & 1 == 1));
                table.starts.push(table.lists.len() as u32);
            }
        }
        table
    }

    /// The points have moved a little.
    pub fn set_points(&mut self, points: &[Vector]) {
        self.blocks.clear();
        self.blocks.extend(points.chunks(LANES).map(|points| {
            // The centre fills the last block.
            let lanes: [Vector; LANES] = std::array::from_fn(|lane| points.get(lane).copied().unwrap_or_default());
            std::array::from_fn(|axis| f64x4::new(lanes.map(|point| point[axis])))
        }));
    }

    /// The blocks whose points may count towards `n`, each with its number: its first point's, divided by [`LANES`].
    #[inline]
    pub fn near(&self, n: &Vector) -> impl Iterator<Item = (usize, &Block)> + Clone {
        let size = n.abs();
        let axis = size.imax();
        let (across, along) = ([(1, 2), (2, 0), (0, 1)][axis], size[axis].max(f64::MIN_POSITIVE));
        let index = |value: f64| ((0.5 * (value / along + 1.0) * CELLS as f64) as usize).min(CELLS - 1);
        let face = 2 * axis + usize::from(n[axis] < 0.0);
        let cell = (face * CELLS + index(n[across.0])) * CELLS + index(n[across.1]);
        let list = &self.lists[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        list.iter().map(|&block| (usize::from(block), &self.blocks[usize::from(block)]))
    }
}

/// The blocks that may count towards directions up to half-way to the next ones tried, as bits.
fn count(blocks: &[Block], n: Vector, least_share: f64) -> u128 {
    // Directions tried are nowhere farther from each other than in the middle of a face, where a square of them is this wide.
    let sine = f64x4::splat(0.5 * std::f64::consts::SQRT_2 * 2.0 / GRID as f64);
    let n = n.normalize();
    let n = splat(&n);
    // How far four points reach towards `n`, and how much farther or less far they may towards a direction near by.
    let reach = |points: &Block| {
        let reach = along(points, &n);
        let across = along(points, points) - reach * reach;
        (reach, sine * across.fast_max(f64x4::ZERO).sqrt())
    };
    // Whatever the direction, the farthest point reaches at least as far as this one does.
    let least = blocks.iter().map(reach).fold(f64x4::ZERO, |least, (reach, spare)| least.fast_max(reach - spare));
    let listed = least_share * largest_of(least);
    let counts = blocks.iter().map(reach).map(|(reach, spare)| largest_of(reach + spare) >= listed);
    counts.enumerate().fold(0, |all, (block, counts)| all | u128::from(counts) << block)
}

/// How far four points reach towards a direction.
#[inline]
pub fn along([x, y, z]: &Block, n: &Block) -> f64x4 {
    *x * n[0] + *y * n[1] + *z * n[2]
}

/// A direction, for four points at once.
#[inline]
pub fn splat(v: &Vector) -> Block {
    [f64x4::splat(v.x), f64x4::splat(v.y), f64x4::splat(v.z)]
}

/// The largest of four numbers and zero.
#[inline]
pub fn largest_of(lanes: f64x4) -> f64 {
    lanes.to_array().into_iter().fold(0.0, f64::max)
}

/// The points in such an order that every four lie near each other.
pub fn in_blocks(mut points: Vec<Vector>) -> Vec<Vector> {
    halve(&mut points);
    points
}

fn halve(points: &mut [Vector]) {
    if points.len() <= LANES {
        return;
    }
    let (low, high) = points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let axis = (high - low).imax();
    let middle = (points.len() / 2).next_multiple_of(LANES);
    points.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
    let (first, second) = points.split_at_mut(middle);
    halve(first);
    halve(second);
}

/// The direction through a point of a face of the cube.
fn direction(face: usize, row: f64, column: f64) -> Vector {
    let axis = face / 2;
    let (across, sign) = ([(1, 2), (2, 0), (0, 1)][axis], if face.is_multiple_of(2) { 1.0 } else { -1.0 });
    let mut n = Vector::zeros();
    (n[axis], n[across.0], n[across.1]) = (sign, row, column);
    n
}
