//! The convex hull as parry computes it.

use super::HullError;
use crate::Point;

use parry3d_f64::math::Vector as ParryVector;

/// Vertices and outward triangles of the convex hull of `points`, as parry computes it, unverified.
pub fn convex_hull(points: &[Point]) -> Result<(Vec<Point>, Vec<[u32; 3]>), HullError> {
    let thickness = thickness_of(points);
    if thickness < 1e-9 {
        return Err(HullError::Flat { thickness });
    }
    let input: Vec<ParryVector> = points.iter().map(|p| ParryVector::new(p.x, p.y, p.z)).collect();
    let (vertices, triangles) = parry3d_f64::transformation::try_convex_hull(&input)
        .map_err(|error| HullError::Failed { reason: format!("{error:?}") })?;
    Ok((vertices.iter().map(|v| Point::new(v.x, v.y, v.z)).collect(), triangles))
}

/// Smallest of three extents: farthest pair from the first point, farthest from that line, farthest from that plane.
fn thickness_of(points: &[Point]) -> f64 {
    let Some(a) = points.first() else { return 0.0 };
    let farthest = |measure: &dyn Fn(&Point) -> f64| {
        points.iter().map(|p| (measure(p), p)).fold((0.0, a), |best, next| if next.0 > best.0 { next } else { best })
    };
    let (length, b) = farthest(&|p| (p - a).norm());
    if length == 0.0 {
        return 0.0;
    }
    let along = (b - a) / length;
    let (width, c) = farthest(&|p| (p - a).cross(&along).norm());
    if width == 0.0 {
        return 0.0;
    }
    let normal = along.cross(&(c - a)).normalize();
    farthest(&|p| normal.dot(&(p - a)).abs()).0.min(width)
}
