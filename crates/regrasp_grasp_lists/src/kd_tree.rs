//! Points in a tree: which are near a place?

use regrasp_geometry::Point;

/// Most points of a leaf.
const LEAF: usize = 8;

/// Points sorted by halving boxes: the middle of a range splits it, along an axis that changes from level to level by extent.
#[derive(Debug, Clone)]
pub struct KdTree {
    points: Vec<Point>,
    /// Index of each sorted point among those given.
    indices: Vec<u32>,
    /// Axis and place of the split of each range, at its middle.
    splits: Vec<(u8, f64)>,
}

impl KdTree {
    /// A tree of `points`.
    pub fn new(points: &[Point]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut splits = vec![(0u8, 0.0); points.len()];
        split(points, &mut order, &mut splits);
        KdTree { points: order.iter().map(|&i| points[i as usize]).collect(), indices: order, splits }
    }

    /// Appends the indices of the points within `radius` of `center` to `found`, in the order of the tree.
    pub fn within(&self, center: &Point, radius: f64, found: &mut Vec<u32>) {
        self.visit(0..self.points.len(), center, radius, found);
    }

    fn visit(&self, range: std::ops::Range<usize>, center: &Point, radius: f64, found: &mut Vec<u32>) {
        if range.len() <= LEAF {
            let near = range.filter(|&k| (self.points[k] - center).norm_squared() <= radius * radius);
            found.extend(near.map(|k| self.indices[k]));
            return;
        }
        let middle = range.start + range.len() / 2;
        let (axis, place) = self.splits[middle];
        let beyond = center[usize::from(axis)] - place;
        if beyond <= radius {
            self.visit(range.start..middle, center, radius, found);
        }
        if beyond >= -radius {
            self.visit(middle..range.end, center, radius, found);
        }
    }

    /// Distance of the nearest point, if it is below `limit`; else `limit`.
    pub fn nearest(&self, center: &Point, limit: f64) -> f64 {
        let mut best = limit * limit;
        self.look(0..self.points.len(), center, &mut best);
        best.sqrt()
    }

    fn look(&self, range: std::ops::Range<usize>, center: &Point, best: &mut f64) {
        if range.len() <= LEAF {
            for k in range {
                *best = best.min((self.points[k] - center).norm_squared());
            }
            return;
        }
        let middle = range.start + range.len() / 2;
        let (axis, place) = self.splits[middle];
        let beyond = center[usize::from(axis)] - place;
        let (near, far) = (range.start..middle, middle..range.end);
        let (near, far) = if beyond <= 0.0 { (near, far) } else { (far, near) };
        self.look(near, center, best);
        if beyond * beyond <= *best {
            self.look(far, center, best);
        }
    }
}

fn split(points: &[Point], order: &mut [u32], splits: &mut [(u8, f64)]) {
    if order.len() <= LEAF {
        return;
    }
    let first = points[order[0] as usize].coords;
    let (low, high) = order.iter().fold((first, first), |(low, high), &i| {
        let point = points[i as usize].coords;
        (low.inf(&point), high.sup(&point))
    });
    let axis = (high - low).imax();
    let middle = order.len() / 2;
    let key = |i: &u32| points[*i as usize][axis];
    order.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    splits[middle] = (axis as u8, points[order[middle] as usize][axis]);
    let (left, right) = order.split_at_mut(middle);
    let (left_splits, right_splits) = splits.split_at_mut(middle);
    split(points, left, left_splits);
    split(points, right, right_splits);
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn answers_are_those_of_looking_at_all_points() {
        let mut rng = Rng::keyed(1, "kd_tree", 0);
        for n_points in [0, 1, 8, 9, 17, 100, 3000] {
            let mut draw = || Point::new(rng.unit(), (8.0 * rng.unit()).floor() / 8.0, 0.1 * rng.unit());
            let points: Vec<Point> = (0..n_points).map(|_| draw()).collect();
            let tree = KdTree::new(&points);
            for _ in 0..50 {
                let (center, radius) = (draw(), 0.3 * draw().x);
                let mut found = Vec::new();
                tree.within(&center, radius, &mut found);
                found.sort_unstable();
                let all = (0..n_points as u32).filter(|&i| (points[i as usize] - center).norm() <= radius);
                assert_eq!(found, all.collect::<Vec<_>>());
                let nearest = points.iter().map(|p| (p - center).norm()).fold(0.2, f64::min);
                assert!((tree.nearest(&center, 0.2) - nearest).abs() < 1e-12);
            }
        }
    }
}
