//! Bounding volume hierarchy over boxes, for nearest items and rays.
//!
//! Binned surface area heuristic (Wald 2007); each node holds the boxes of both its children.

use crate::frame::{Point, Vector};

/// Items per leaf at most.
const LEAF: usize = 4;
const BINS: usize = 12;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aabb {
    pub low: Vector,
    pub high: Vector,
}

impl Aabb {
    pub fn empty() -> Self {
        Aabb { low: Vector::repeat(f64::INFINITY), high: Vector::repeat(f64::NEG_INFINITY) }
    }

    pub fn of(points: &[Point]) -> Self {
        points.iter().fold(Aabb::empty(), |b, p| Aabb { low: b.low.inf(&p.coords), high: b.high.sup(&p.coords) })
    }

    pub fn union(&self, other: &Aabb) -> Self {
        Aabb { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    pub fn overlaps(&self, other: &Aabb) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    fn half_area(&self) -> f64 {
        let d = self.high - self.low;
        if d.x < 0.0 { 0.0 } else { d.x * d.y + d.y * d.z + d.z * d.x }
    }

    #[inline]
    fn distance_squared(&self, p: &Vector) -> f64 {
        let mut sum = 0.0;
        for k in 0..3 {
            let excess = (self.low[k] - p[k]).max(p[k] - self.high[k]).max(0.0);
            sum += excess * excess;
        }
        sum
    }

    /// Where the ray enters, if it does before `t_max`.
    #[inline]
    fn entry(&self, origin: &Vector, inverse: &Vector, t_max: f64) -> Option<f64> {
        let (mut enter, mut leave): (f64, f64) = (0.0, t_max);
        for k in 0..3 {
            let (a, b) = ((self.low[k] - origin[k]) * inverse[k], (self.high[k] - origin[k]) * inverse[k]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // Rounding of the three products must not lose a hit on the boundary.
        (enter <= leave * (1.0 + 1e-15)).then_some(enter)
    }
}

/// A child: an inner node (`count == 0`) or `count` items from `start`.
#[derive(Debug, Clone, Copy)]
struct Child {
    bounds: Aabb,
    start: u32,
    count: u32,
}

#[derive(Debug, Clone)]
pub(super) struct Bvh {
    root: Child,
    nodes: Vec<[Child; 2]>,
    /// Items in the order of the leaves.
    order: Vec<u32>,
}

impl Bvh {
    pub fn new(boxes: &[Aabb]) -> Self {
        // A little padding, so that no ray runs within the very plane of a side.
        let whole = boxes.iter().fold(Aabb::empty(), |all, b| all.union(b));
        let padding = Vector::repeat(1e-13 * whole.low.abs().sup(&whole.high.abs()).max());
        let pad = |b: &Aabb| Aabb { low: b.low - padding, high: b.high + padding };
        let boxes: Vec<Aabb> = boxes.iter().map(pad).collect();
        let boxes = &boxes[..];
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(boxes.len() / 2 + 1);
        let root = build(boxes, &mut order, 0, &mut nodes, 0);
        Bvh { root, nodes, order }
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
        if self.root.count > 0 {
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
            let [a, b] = &self.nodes[node as usize];
            let (da, db) = (a.bounds.distance_squared(p), b.bounds.distance_squared(p));
            let (near, dn, far, df) = if da <= db { (a, da, b, db) } else { (b, db, a, da) };
            // Far leaves are looked at after the near subtree only when they are inner nodes; leaves are cheap.
            if dn < best.1 && near.count > 0 {
                scan(near, &mut best);
            }
            if df < best.1 {
                if far.count > 0 {
                    scan(far, &mut best);
                } else {
                    stack[height] = (far.start, df);
                    height += 1;
                }
            }
            if dn < best.1 && near.count == 0 {
                stack[height] = (near.start, dn);
                height += 1;
            }
        }
        (best.0 != usize::MAX).then_some(best)
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
        if self.root.count > 0 {
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
            let [a, b] = &self.nodes[node as usize];
            let mut hits = [(a, a.bounds.entry(o, &inverse, limit)), (b, b.bounds.entry(o, &inverse, limit))];
            if let (Some(ta), Some(tb)) = (hits[0].1, hits[1].1)
                && ta < tb
            {
                hits.swap(0, 1);
            }
            // The farther one is pushed first.
            for (child, t) in hits {
                let Some(t) = t else { continue };
                if child.count > 0 {
                    scan(child, &mut limit);
                } else {
                    stack[height] = (child.start, t);
                    height += 1;
                }
            }
        }
    }
}

fn build(boxes: &[Aabb], order: &mut [u32], start: usize, nodes: &mut Vec<[Child; 2]>, depth: usize) -> Child {
    let bounds = order.iter().fold(Aabb::empty(), |all, &i| all.union(&boxes[i as usize]));
    if order.len() <= LEAF {
        return Child { bounds, start: start as u32, count: order.len() as u32 };
    }
    let middle_of = |i: u32| boxes[i as usize].low + boxes[i as usize].high;
    let centers = order.iter().fold(Aabb::empty(), |all, &i| {
        let c = middle_of(i);
        all.union(&Aabb { low: c, high: c })
    });
    // Below half the stack's depth the heuristic decides, after that halves: the stacks cannot overflow.
    let split = if depth < 48 { best_split(boxes, order, &centers, middle_of) } else { None };
    let middle = split.unwrap_or_else(|| {
        let extent = centers.high - centers.low;
        let axis = extent.imax();
        let middle = order.len() / 2;
        order
            .select_nth_unstable_by(middle, |&i, &j| middle_of(i)[axis].total_cmp(&middle_of(j)[axis]).then(i.cmp(&j)));
        middle
    });
    let node = nodes.len();
    let placeholder = Child { bounds, start: 0, count: 0 };
    nodes.push([placeholder; 2]);
    let (left, right) = order.split_at_mut(middle);
    let a = build(boxes, left, start, nodes, depth + 1);
    let b = build(boxes, right, start + middle, nodes, depth + 1);
    nodes[node] = [a, b];
    Child { bounds, start: node as u32, count: 0 }
}

/// Partitions `order` where the surface area heuristic is least; None when all centres fall into one bin.
fn best_split(boxes: &[Aabb], order: &mut [u32], centers: &Aabb, middle_of: impl Fn(u32) -> Vector) -> Option<usize> {
    let mut best = (f64::INFINITY, 0, 0);
    for axis in 0..3 {
        let extent = centers.high[axis] - centers.low[axis];
        if extent <= 0.0 {
            continue;
        }
        let bin_of = |i: u32| bin(middle_of(i)[axis], centers.low[axis], extent);
        let mut bins = [(Aabb::empty(), 0usize); BINS];
        for &i in order.iter() {
            let entry = &mut bins[bin_of(i)];
            *entry = (entry.0.union(&boxes[i as usize]), entry.1 + 1);
        }
        for cut in 1..BINS {
            let gather =
                |part: &[(Aabb, usize)]| part.iter().fold((Aabb::empty(), 0), |(all, n), (b, m)| (all.union(b), n + m));
            let ((left, n_left), (right, n_right)) = (gather(&bins[..cut]), gather(&bins[cut..]));
            let cost = left.half_area() * n_left as f64 + right.half_area() * n_right as f64;
            if n_left > 0 && n_right > 0 && cost < best.0 {
                best = (cost, axis, cut);
            }
        }
    }
    let (cost, axis, cut) = best;
    if !cost.is_finite() {
        return None;
    }
    let extent = centers.high[axis] - centers.low[axis];
    let is_left = |i: u32| bin(middle_of(i)[axis], centers.low[axis], extent) < cut;
    order.sort_by_key(|&i| !is_left(i));
    Some(order.iter().filter(|&&i| is_left(i)).count())
}

fn bin(value: f64, low: f64, extent: f64) -> usize {
    (((value - low) / extent * BINS as f64) as usize).min(BINS - 1)
}
