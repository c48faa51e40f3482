//! Bounding volume hierarchy over boxes, for nearest items, all near ones, and rays.
//!
//! Binned surface area heuristic (Wald 2007); each node holds the boxes of both its children, in single precision.
//! Over triangles, nodes of some tens of them have a box along the surface besides (`Sheet`).

use crate::frame::{Point, UnitVector, Vector, tangents};

/// Items per leaf at most.
const LEAF: usize = 4;
const BINS: usize = 12;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Aabb {
    pub low: Vector,
    pub high: Vector,
}

impl Aabb {
    pub fn empty() -> Self {
        Aabb { low: Vector::repeat(f64::INFINITY), high: Vector::repeat(f64::NEG_INFINITY) }
    }

    pub fn of(points: &[Point]) -> Self {
        points.iter().fold(Aabb::empty(), |b, p| b.union(&Aabb { low: p.coords, high: p.coords }))
    }

    #[inline]
    pub fn union(&self, other: &Aabb) -> Self {
        // Nothing here is NaN: plain comparisons, one instruction each, instead of `f64::min`.
        let lower = |a: f64, b: f64| if a < b { a } else { b };
        let higher = |a: f64, b: f64| if a > b { a } else { b };
        Aabb { low: self.low.zip_map(&other.low, lower), high: self.high.zip_map(&other.high, higher) }
    }

    pub fn overlaps(&self, other: &Aabb) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    fn half_area(&self) -> f64 {
        let d = self.high - self.low;
        if d.x < 0.0 { 0.0 } else { d.x * d.y + d.y * d.z + d.z * d.x }
    }
}

/// A box in single precision, rounded outwards: half the memory, which is what queries in large trees wait for.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl From<&Aabb> for Bounds {
    fn from(aabb: &Aabb) -> Self {
        let below = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
        let above = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
        Bounds {
            low: [below(aabb.low.x), below(aabb.low.y), below(aabb.low.z)],
            high: [above(aabb.high.x), above(aabb.high.y), above(aabb.high.z)],
        }
    }
}

impl Bounds {
    #[inline]
    fn distance_squared(&self, p: &Vector) -> f64 {
        let mut sum = 0.0;
        for k in 0..3 {
            let excess = (f64::from(self.low[k]) - p[k]).max(p[k] - f64::from(self.high[k])).max(0.0);
            sum += excess * excess;
        }
        sum
    }

    /// Where the ray enters, if it does before `t_max`.
    #[inline]
    fn entry(&self, origin: &Vector, inverse: &Vector, t_max: f64) -> Option<f64> {
        let (mut enter, mut leave): (f64, f64) = (0.0, t_max);
        for k in 0..3 {
            let (a, b) =
                ((f64::from(self.low[k]) - origin[k]) * inverse[k], (f64::from(self.high[k]) - origin[k]) * inverse[k]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // Rounding of the three products must not lose a hit on the boundary.
        (enter <= leave * (1.0 + 1e-15)).then_some(enter)
    }
}

/// A child: an inner node (`count == 0`, or from `FIRST_SHEET` on), or `count` items from `start`.
#[derive(Debug, Clone, Copy)]
struct Child {
    bounds: Bounds,
    start: u32,
    count: u32,
}

/// Where `count` of an inner node is as much or more, the difference is the index of its sheet.
const FIRST_SHEET: u32 = 1 << 31;

impl Child {
    #[inline]
    fn is_leaf(&self) -> bool {
        self.count != 0 && self.count < FIRST_SHEET
    }
}

/// Both children of a node: one line of a processor's cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Node([Child; 2]);

#[derive(Debug, Clone)]
pub(crate) struct Bvh {
    root: Child,
    nodes: Vec<Node>,
    /// Items in the order of the leaves.
    order: Vec<u32>,
    /// Boxes along the surface, of some inner nodes.
    sheets: Vec<Sheet>,
}

impl Bvh {
    pub fn new(boxes: &[Aabb]) -> Self {
        // A little padding, so that no ray runs within the very plane of a side.
        let whole = boxes.iter().fold(Aabb::empty(), |all, b| all.union(b));
        let padding = Vector::repeat(1e-13 * whole.low.abs().sup(&whole.high.abs()).max());
        let pad = |b: &Aabb| Aabb { low: b.low - padding, high: b.high + padding };
        let mut items: Vec<Item> =
            boxes.iter().zip(0..).map(|(bounds, index)| Item { bounds: pad(bounds), index }).collect();
        let mut nodes = Vec::with_capacity(boxes.len() / 2 + 1);
        let root = build(&mut items, &mut Vec::new(), 0, &mut nodes, 0);
        let order = items.iter().map(|item| item.index).collect();
        Bvh { root, nodes, order, sheets: Vec::new() }
    }

    /// Bounds nodes of some tens of triangles along the surface too, where [`Bvh::nearest`] then turns back; the results are
    /// the same. `corners` are the triangles in the order of the queries.
    pub fn add_sheets(&mut self, corners: &[[Point; 3]]) {
        if !self.root.is_leaf() && !self.nodes.is_empty() {
            self.add_sheets_below(self.root.start, corners);
        }
    }

    /// The ranks of the items below a node.
    fn add_sheets_below(&mut self, node: u32, corners: &[[Point; 3]]) -> std::ops::Range<usize> {
        let ranges = [0, 1].map(|side| {
            let child = self.nodes[node as usize].0[side];
            match child.is_leaf() {
                true => child.start as usize..(child.start + child.count) as usize,
                false => self.add_sheets_below(child.start, corners),
            }
        });
        let [a, b] = &ranges;
        let all = a.start.min(b.start)..a.end.max(b.end);
        if all.len() > SHEET {
            for (side, range) in ranges.into_iter().enumerate() {
                let child = &mut self.nodes[node as usize].0[side];
                if let (false, 0..=SHEET) = (child.is_leaf(), range.len())
                    && let Some(sheet) = Sheet::around(&corners[range])
                {
                    child.count = FIRST_SHEET + self.sheets.len() as u32;
                    self.sheets.push(sheet);
                }
            }
        }
        all
    }

    /// Lower bound of the squared distance of the items of an inner child, of which that of its box is `of_box`.
    #[inline]
    fn bound_of(&self, child: &Child, of_box: f64, p: &Vector) -> f64 {
        match child.count.checked_sub(FIRST_SHEET) {
            Some(index) => of_box.max(self.sheets[index as usize].distance_squared(p)),
            None => of_box,
        }
    }

    /// Items in the order in which the queries count them.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Visits items (by rank in [`Bvh::order`]) nearest boxes first; `visit` gives an item's squared distance, or
    /// infinity. Returns the nearest item's rank and squared distance, if one is nearer than `limit_squared`.
    #[inline]
    pub fn nearest(
        &self,
        point: &Point,
        limit_squared: f64,
        mut visit: impl FnMut(usize) -> f64,
    ) -> Option<(usize, f64)> {
        let p = &point.coords;
        let mut best = (usize::MAX, limit_squared);
        let mut stack = [(0u32, 0.0f64); 96];
        let mut height = 0;
        let mut scan = |child: &Child, best: &mut (usize, f64)| {
            for rank in child.start as usize..(child.start + child.count) as usize {
                let d = visit(rank);
                if d < best.1 {
                    *best = (rank, d);
                }
            }
        };
        if self.root.is_leaf() {
            scan(&self.root, &mut best);
        } else if !self.nodes.is_empty() {
            stack[0] = (self.root.start, 0.0);
            height = 1;
        }
        while height > 0 {
            height -= 1;
            let (node, bound) = stack[height];
            if bound >= best.1 {
                continue;
            }
            let Node([a, b]) = &self.nodes[node as usize];
            let (da, db) = (a.bounds.distance_squared(p), b.bounds.distance_squared(p));
            let (near, dn, far, df) = if da <= db { (a, da, b, db) } else { (b, db, a, da) };
            // Far leaves are looked at after the near subtree only when they are inner nodes; leaves are cheap.
            if dn < best.1 && near.is_leaf() {
                scan(near, &mut best);
            }
            if df < best.1 {
                if far.is_leaf() {
                    scan(far, &mut best);
                } else {
                    stack[height] = (far.start, self.bound_of(far, df, p));
                    height += 1;
                }
            }
            if dn < best.1 && !near.is_leaf() {
                stack[height] = (near.start, self.bound_of(near, dn, p));
                height += 1;
            }
        }
        (best.0 != usize::MAX).then_some(best)
    }

    /// Visits items (by rank in [`Bvh::order`]), at least all whose boxes are nearer to `point` than `limit_squared`. Returns
    /// a lower bound of the squared distance of the boxes that were not visited.
    #[inline]
    pub fn within(&self, point: &Point, limit_squared: f64, mut visit: impl FnMut(usize)) -> f64 {
        let p = &point.coords;
        let mut others = f64::INFINITY;
        let mut stack = [0u32; 96];
        let mut height = 0;
        let mut look_at = |child: &Child, stack: &mut [u32; 96], height: &mut usize| {
            let d = child.bounds.distance_squared(p);
            if d >= limit_squared {
                others = others.min(d);
            } else if child.is_leaf() {
                (child.start..child.start + child.count).for_each(|rank| visit(rank as usize));
            } else {
                stack[*height] = child.start;
                *height += 1;
            }
        };
        if self.root.is_leaf() || !self.nodes.is_empty() {
            look_at(&self.root, &mut stack, &mut height);
        }
        while height > 0 {
            height -= 1;
            for child in &self.nodes[stack[height] as usize].0 {
                look_at(child, &mut stack, &mut height);
            }
        }
        others
    }

    /// Visits items whose boxes the ray meets; `visit` takes a rank and the present limit and may lower the limit.
    #[inline]
    pub fn along_ray(&self, origin: &Point, direction: &Vector, mut visit: impl FnMut(usize, f64) -> f64) {
        let o = &origin.coords;
        // No infinity: zero times infinity would lose rays that run within the plane of a box's side.
        let inverse = direction.map(|d| 1.0 / if d.abs() < 1e-200 { 1e-200f64.copysign(d) } else { d });
        let mut limit = f64::INFINITY;
        let mut stack = [(0u32, 0.0f64); 96];
        let mut height = 0;
        if self.root.bounds.entry(o, &inverse, limit).is_none() {
            return;
        }
        let mut scan = |child: &Child, limit: &mut f64| {
            for rank in child.start as usize..(child.start + child.count) as usize {
                *limit = visit(rank, *limit);
            }
        };
        if self.root.is_leaf() {
            scan(&self.root, &mut limit);
        } else if !self.nodes.is_empty() {
            stack[0] = (self.root.start, 0.0);
            height = 1;
        }
        while height > 0 {
            height -= 1;
            let (node, bound) = stack[height];
            if bound > limit {
                continue;
            }
            let Node([a, b]) = &self.nodes[node as usize];
            let mut hits = [(a, a.bounds.entry(o, &inverse, limit)), (b, b.bounds.entry(o, &inverse, limit))];
            if let (Some(ta), Some(tb)) = (hits[0].1, hits[1].1)
                && ta < tb
            {
                hits.swap(0, 1);
            }
            // The farther one is pushed first.
            for (child, t) in hits {
                let Some(t) = t else { continue };
                if child.is_leaf() {
                    scan(child, &mut limit);
                } else {
                    stack[height] = (child.start, t);
                    height += 1;
                }
            }
        }
    }
}

/// Most triangles of a sheet. By hand: few enough to be nearly flat, so many that all sheets of a million fit into a cache.
const SHEET: usize = 64;

/// A box along a piece of surface, which is thin where boxes along the axes stand out: a point near a surface of many
/// triangles is nearer to the boxes of hundreds of them than to any triangle. In single precision.
#[derive(Debug, Clone, Copy)]
struct Sheet {
    center: [f32; 3],
    axes: [[f32; 3]; 3],
    half: [f32; 3],
}

impl Sheet {
    /// None where the triangles face no common side.
    fn around(corners: &[[Point; 3]]) -> Option<Self> {
        let normal = corners.iter().fold(Vector::zeros(), |sum, [a, b, c]| sum + (b - a).cross(&(c - a)));
        let normal = UnitVector::try_new(normal, 1e-300)?;
        let (u, v) = tangents(&normal);
        let points = || corners.iter().flatten();
        let whole = points().fold(Aabb::empty(), |all, p| all.union(&Aabb { low: p.coords, high: p.coords }));
        let center = ((whole.low + whole.high) / 2.0).map(|x| x as f32);
        let axes = [u, v, normal].map(|axis| axis.map(|x| x as f32).into());
        let mut sheet = Sheet { center: center.into(), axes, half: [0.0; 3] };
        let along = |k: usize| points().map(|p| sheet.along(k, &p.coords).abs()).fold(0.0, f64::max);
        sheet.half = [0, 1, 2].map(|k| (along(k) as f32).next_up());
        Some(sheet)
    }

    /// Coordinate of a point along an axis, from the centre.
    #[inline]
    fn along(&self, k: usize, p: &Vector) -> f64 {
        (0..3).map(|i| f64::from(self.axes[k][i]) * (p[i] - f64::from(self.center[i]))).sum()
    }

    /// A lower bound of the squared distance.
    #[inline]
    fn distance_squared(&self, p: &Vector) -> f64 {
        let excess = |k: usize| (self.along(k, p).abs() - f64::from(self.half[k])).max(0.0);
        // The axes are orthonormal but for the rounding to single precision.
        (0..3).map(|k| excess(k) * excess(k)).sum::<f64>() * (1.0 - 1e-6)
    }
}

/// An item on its way into the tree.
#[derive(Debug, Clone, Copy)]
struct Item {
    bounds: Aabb,
    index: u32,
}

impl Item {
    /// Twice the centre.
    #[inline]
    fn middle(&self) -> Vector {
        self.bounds.low + self.bounds.high
    }
}

fn build(items: &mut [Item], right_side: &mut Vec<Item>, start: usize, nodes: &mut Vec<Node>, depth: usize) -> Child {
    let bounds = items.iter().fold(Aabb::empty(), |all, item| all.union(&item.bounds));
    let bounds = Bounds::from(&bounds);
    if items.len() <= LEAF {
        return Child { bounds, start: start as u32, count: items.len() as u32 };
    }
    let centers = items.iter().fold(Aabb::empty(), |all, item| {
        let c = item.middle();
        all.union(&Aabb { low: c, high: c })
    });
    // Below half the stack's depth the heuristic decides, after that halves: the stacks cannot overflow.
    let split = if depth < 48 { best_split(items, right_side, &centers) } else { None };
    let middle = split.unwrap_or_else(|| {
        let axis = (centers.high - centers.low).imax();
        let middle = items.len() / 2;
        let before = |a: &Item, b: &Item| a.middle()[axis].total_cmp(&b.middle()[axis]).then(a.index.cmp(&b.index));
        items.select_nth_unstable_by(middle, before);
        middle
    });
    let node = nodes.len();
    let placeholder = Child { bounds, start: 0, count: 0 };
    nodes.push(Node([placeholder; 2]));
    let (left, right) = items.split_at_mut(middle);
    let a = build(left, right_side, start, nodes, depth + 1);
    let b = build(right, right_side, start + middle, nodes, depth + 1);
    nodes[node] = Node([a, b]);
    Child { bounds, start: node as u32, count: 0 }
}

/// Partitions `items` where the surface area heuristic is least, keeping their order on either side; None when all
/// centres fall into one bin. `right_side` is room to work in.
fn best_split(items: &mut [Item], right_side: &mut Vec<Item>, centers: &Aabb) -> Option<usize> {
    let extent = centers.high - centers.low;
    let mut bins = [[(Aabb::empty(), 0usize); BINS]; 3];
    for item in items.iter() {
        let middle = item.middle();
        for axis in (0..3).filter(|&axis| extent[axis] > 0.0) {
            let entry = &mut bins[axis][bin(middle[axis], centers.low[axis], extent[axis])];
            *entry = (entry.0.union(&item.bounds), entry.1 + 1);
        }
    }
    let mut best = (f64::INFINITY, 0, 0);
    for (axis, bins) in bins.iter().enumerate() {
        // Half area and number of items from each bin on.
        let mut from = [(0.0, 0); BINS];
        let (mut bounds, mut n) = (Aabb::empty(), 0);
        for k in (0..BINS).rev() {
            (bounds, n) = (bounds.union(&bins[k].0), n + bins[k].1);
            from[k] = (bounds.half_area(), n);
        }
        let (mut bounds, mut n_left) = (Aabb::empty(), 0);
        for cut in 1..BINS {
            (bounds, n_left) = (bounds.union(&bins[cut - 1].0), n_left + bins[cut - 1].1);
            let (right, n_right) = from[cut];
            let cost = bounds.half_area() * n_left as f64 + right * n_right as f64;
            if n_left > 0 && n_right > 0 && cost < best.0 {
                best = (cost, axis, cut);
            }
        }
    }
    let (cost, axis, cut) = best;
    if !cost.is_finite() {
        return None;
    }
    right_side.clear();
    let mut n_left = 0;
    for i in 0..items.len() {
        let item = items[i];
        if bin(item.middle()[axis], centers.low[axis], extent[axis]) < cut {
            items[n_left] = item;
            n_left += 1;
        } else {
            right_side.push(item);
        }
    }
    items[n_left..].copy_from_slice(right_side);
    Some(n_left)
}

fn bin(value: f64, low: f64, extent: f64) -> usize {
    (((value - low) / extent * BINS as f64) as usize).min(BINS - 1)
}

#[cfg(test)]
mod tests {
    use super::super::mesh::nearest_on_triangle;
    use super::*;
    use regrasp_base::Rng;

    /// A bumpy sheet of triangles, folded over at one side, and loose triangles in front of it.
    fn triangles(rng: &mut Rng) -> Vec<[Point; 3]> {
        let n = 40;
        let height: Vec<f64> = (0..=n).flat_map(|_| (0..=n).map(|_| 0.01 * rng.unit()).collect::<Vec<_>>()).collect();
        let at = |i: usize, j: usize| {
            let fold = if i > 30 { 0.3 - 0.01 * i as f64 } else { 0.0 };
            Point::new(0.01 * i as f64 + 2.0 * fold, 0.01 * j as f64, height[i * (n + 1) + j] - fold)
        };
        let mut found = Vec::new();
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            found.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            found.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        for _ in 0..200 {
            let corner = |rng: &mut Rng| Point::from(Vector::from(rng.direction()) * rng.unit() * 0.3);
            found.push([corner(rng), corner(rng), corner(rng)]);
        }
        found
    }

    #[test]
    fn sheets_change_nothing_and_the_nearest_is_that_of_all() {
        let mut rng = Rng::keyed(5, "sheets", 0);
        let corners = triangles(&mut rng);
        let boxes: Vec<Aabb> = corners.iter().map(|corners| Aabb::of(corners)).collect();
        let without = Bvh::new(&boxes);
        let corners: Vec<[Point; 3]> = without.order().iter().map(|&index| corners[index as usize]).collect();
        let mut with = without.clone();
        with.add_sheets(&corners);
        assert!(with.sheets.len() > 40 && without.sheets.is_empty(), "{}", with.sheets.len());
        let mut n_spared = 0;
        for _ in 0..2000 {
            let point = Point::from(Vector::from(rng.direction()) * 0.5 * rng.unit());
            let mut n_seen = [0; 2];
            let [plain, sheeted] = [&without, &with].map(|tree| {
                let seen = &mut n_seen[usize::from(!tree.sheets.is_empty())];
                let visit = |rank: usize| {
                    *seen += 1;
                    (nearest_on_triangle(&corners[rank], &point).0 - point).norm_squared()
                };
                tree.nearest(&point, f64::INFINITY, visit)
            });
            assert_eq!(plain, sheeted);
            let distance = |corners: &[Point; 3]| (nearest_on_triangle(corners, &point).0 - point).norm_squared();
            let least = corners.iter().map(distance).fold(f64::INFINITY, f64::min);
            assert_eq!(sheeted.unwrap().1, least);
            n_spared += n_seen[0] - n_seen[1];
        }
        assert!(n_spared > 1000, "{n_spared}");
    }
}
