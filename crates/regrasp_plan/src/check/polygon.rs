//! The convex polygon of points in a plane, and how far a point is inside.

use regrasp_geometry::{UnitVector, Vector};

/// Places nearer to each other than this are one, in metres.
const SAME_PLACE: f64 = 1e-7;
/// Places nearer to a line than this are on it, in metres.
const ON_LINE: f64 = 1e-9;

/// How far the origin is inside the convex polygon of `points`, seen along `down`; negative outside. By gift wrapping.
pub fn distance_inside(points: &[Vector], down: &Vector) -> f64 {
    let Some(axis) = UnitVector::try_new(*down, 1e-9) else { return f64::NEG_INFINITY };
    let (x, y) = regrasp_geometry::frame::tangents(&axis);
    let length = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
    let mut flat: Vec<[f64; 2]> = Vec::new();
    for p in points {
        let place = [p.dot(&x), p.dot(&y)];
        if flat.iter().all(|other| length(*other, place) > SAME_PLACE) {
            flat.push(place);
        }
    }
    let first = flat.iter().copied().reduce(|a, b| if (b[0], b[1]) < (a[0], a[1]) { b } else { a });
    let Some(first) = first else { return f64::NEG_INFINITY };
    let cross = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let (mut at, mut least, mut area) = (first, f64::INFINITY, 0.0);
    for _ in 0..=flat.len() {
        // All others are on the left of the next side.
        let next = flat.iter().copied().filter(|p| *p != at).reduce(|best, p| {
            // How far the point is on the left of the line to the best so far.
            let left = cross(at, best, p) / length(at, best);
            if left < -ON_LINE || (left <= ON_LINE && length(at, p) > length(at, best)) { p } else { best }
        });
        let Some(next) = next else { return f64::NEG_INFINITY };
        least = least.min(cross(at, next, [0.0, 0.0]) / length(at, next));
        area += cross([0.0, 0.0], at, next);
        at = next;
        if at == first {
            break;
        }
    }
    if area > 0.0 { least } else { f64::NEG_INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_inside_is_that_of_the_nearest_side_whatever_the_points_are_like() {
        let down = Vector::new(0.0, 0.0, -1.0);
        // A rectangle with points on its sides, doubled and moved by rounding.
        let mut points = Vec::new();
        for k in 0..=20 {
            let t = f64::from(k) / 20.0;
            for (x, y) in
                [(0.02 * t - 0.01, -0.03), (0.02 * t - 0.01, 0.03), (-0.01, 0.06 * t - 0.03), (0.01, 0.06 * t - 0.03)]
            {
                points.push(Vector::new(x + 1e-13 * f64::from(k % 3), y - 1e-13 * f64::from(k % 2), 0.0));
            }
        }
        assert!((distance_inside(&points, &down) - 0.01).abs() < 1e-6);
        let moved: Vec<Vector> = points.iter().map(|p| p + Vector::new(0.004, 0.0, 0.0)).collect();
        assert!((distance_inside(&moved, &down) - 0.006).abs() < 1e-6);
        let outside: Vec<Vector> = points.iter().map(|p| p + Vector::new(0.02, 0.0, 0.0)).collect();
        assert!(distance_inside(&outside, &down) < 0.0);
        assert_eq!(distance_inside(&points[..1], &down), f64::NEG_INFINITY);
        assert_eq!(distance_inside(&[], &down), f64::NEG_INFINITY);
    }
}
