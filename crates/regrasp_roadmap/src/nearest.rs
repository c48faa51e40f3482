//! Nearest neighbours, by looking at all: the fastest way for the few hundred nodes our searches keep.

/// Index of the smallest distance, the first of equals; none of an empty sequence.
pub fn nearest(distances: impl IntoIterator<Item = f64>) -> Option<usize> {
    let mut best = None;
    let mut best_distance = f64::INFINITY;
    for (i, distance) in distances.into_iter().enumerate() {
        if best.is_none() || distance < best_distance {
            (best, best_distance) = (Some(i), distance);
        }
    }
    best
}

/// Indices of the `n` smallest distances, nearest first, equals in order of their index.
pub fn nearest_few(distances: impl IntoIterator<Item = f64>, n: usize) -> Vec<usize> {
    let mut order: Vec<(f64, usize)> = distances.into_iter().enumerate().map(|(i, d)| (d, i)).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    order.truncate(n);
    order.into_iter().map(|(_, i)| i).collect()
}

/// Squared Euclidean distance.
#[inline]
pub fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_sorting() {
        let mut rng = regrasp_base::Rng::keyed(1, "nearest", 0);
        for _ in 0..100 {
            let distances: Vec<f64> = (0..20).map(|_| (rng.unit() * 10.0).floor()).collect();
            let smallest = distances.iter().copied().fold(f64::INFINITY, f64::min);
            let first = distances.iter().position(|&d| d == smallest);
            assert_eq!(nearest(distances.iter().copied()), first);
            let few = nearest_few(distances.iter().copied(), 5);
            assert_eq!(few.first().copied(), first);
            assert!(few.windows(2).all(|w| (distances[w[0]], w[0]) < (distances[w[1]], w[1])));
            let others = (0..20).filter(|i| !few.contains(i));
            assert!(others.into_iter().all(|i| distances[i] >= distances[few[4]]));
        }
        assert_eq!(nearest([]), None);
    }
}
