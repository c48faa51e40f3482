//! Shortcuts: replace a piece of a path by a direct connection where that is valid and shorter.

use crate::nearest::squared_distance;
use regrasp_base::Rng;

/// Tries `n_tries` random shortcuts between nodes of a path; the number that were made.
///
/// `motions[i]` leads from `points[i]` to `points[i + 1]`; the ends stay. Panics unless there is one point more than
/// motions.
pub fn shorten_path<P, M>(
    points: &mut Vec<P>,
    motions: &mut Vec<M>,
    n_tries: usize,
    rng: &mut Rng,
    mut length: impl FnMut(&M) -> f64,
    mut connect: impl FnMut(&P, &P) -> Option<M>,
) -> usize {
    assert_eq!(points.len(), motions.len() + 1, "one point more than motions");
    let mut n_made = 0;
    for _ in 0..n_tries {
        if motions.len() < 2 {
            break;
        }
        let first = rng.below(points.len() - 2);
        let last = first + 2 + rng.below(points.len() - first - 2);
        let Some(direct) = connect(&points[first], &points[last]) else { continue };
        let now: f64 = motions[first..last].iter().map(&mut length).sum();
        if length(&direct) < now {
            points.drain(first + 1..last);
            motions.splice(first..last, [direct]);
            n_made += 1;
        }
    }
    n_made
}

/// Tries `n_tries` shortcuts between random places on a polyline in real coordinates; the number that were made.
///
/// `is_valid` says whether the straight motion between two points is. The ends stay; the length never grows.
pub fn shorten_polyline(
    points: &mut Vec<Vec<f64>>,
    n_tries: usize,
    rng: &mut Rng,
    mut is_valid: impl FnMut(&[f64], &[f64]) -> bool,
) -> usize {
    let mut n_made = 0;
    for _ in 0..n_tries {
        if points.len() < 3 {
            break;
        }
        // Places in units of segments, so that short and long segments are tried alike.
        let n_segments = (points.len() - 1) as f64;
        let (a, b) = (rng.uniform(0.0, n_segments), rng.uniform(0.0, n_segments));
        let (a, b) = (a.min(b), a.max(b));
        let (first, last) = (a as usize, b as usize);
        if first == last {
            continue;
        }
        let from = between(&points[first], &points[first + 1], a - first as f64);
        let to = between(&points[last], &points[last + 1], b - last as f64);
        let mut now = distance(&from, &points[first + 1]) + distance(&points[last], &to);
        for w in points[first + 1..=last].windows(2) {
            now += distance(&w[0], &w[1]);
        }
        if distance(&from, &to) < now * (1.0 - 1e-9) && is_valid(&from, &to) {
            points.splice(first + 1..=last, [from, to]);
            n_made += 1;
        }
    }
    n_made
}

fn between(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(x, y)| x + share * (y - x)).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    squared_distance(a, b).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy_world::Toy;

    #[test]
    fn a_detour_around_a_wall_becomes_the_taut_string() {
        // A wall of one cell in the middle of a 3 x 3 world; the shortest way around it touches a corner.
        let toy = Toy::new(3, &[(1, 1)]);
        let mut rng = Rng::keyed(1, "smooth", 0);
        let mut path = vec![vec![0.5, 1.5], vec![0.5, 0.1], vec![1.5, 0.1], vec![2.9, 0.1], vec![2.5, 1.5]];
        let n_made = shorten_polyline(&mut path, 400, &mut rng, |a, b| toy.sees(a, b));
        assert!(n_made > 3);
        assert!(path.windows(2).all(|w| toy.sees(&w[0], &w[1])));
        let length: f64 = path.windows(2).map(|w| distance(&w[0], &w[1])).sum();
        let taut = 2.0 * 0.5f64.hypot(0.5) + 1.0;
        assert!(length >= taut - 1e-12 && length < 1.03 * taut, "{length} against {taut}");
        assert_eq!(
            (path[0].as_slice(), path[path.len() - 1].as_slice()),
            ([0.5, 1.5].as_slice(), [2.5, 1.5].as_slice())
        );
    }

    #[test]
    fn nodes_that_can_be_left_out_are() {
        let mut rng = Rng::keyed(2, "smooth", 0);
        let mut points: Vec<f64> = vec![0.0, 3.0, 1.0, 2.0, 5.0, 4.0];
        let mut motions: Vec<f64> = points.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        // Jumps of more than 3 are not allowed: 0 -> 1 -> 4 and 0 -> 2 -> 4 are what remains at best.
        let connect = |a: &f64, b: &f64| ((b - a).abs() <= 3.0).then_some((b - a).abs());
        shorten_path(&mut points, &mut motions, 200, &mut rng, |m| *m, connect);
        let total: f64 = motions.iter().sum();
        assert_eq!(points.len(), motions.len() + 1);
        assert!((total - 4.0).abs() < 1e-12, "{points:?}");
    }
}
