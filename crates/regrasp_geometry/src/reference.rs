//! Distance and penetration by parry: the checker's second way of knowing. Nothing else in the workspace sees parry.

use crate::frame::Point;
use crate::hull::HullError;
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

/// TEMPORARY stand-in until branch `geometry` is merged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Answer {
    /// Separated.
    SeparatedBy(f64),
    /// Penetrating.
    Penetrating(f64),
    /// Unresolved.
    Unresolved,
}

/// TEMPORARY stand-in.
#[derive(Clone)]
pub struct ReferenceShape(parry3d_f64::shape::SharedShape);

impl ReferenceShape {
    /// TEMPORARY stand-in.
    pub fn new(shape: &crate::Shape) -> Self {
        use parry3d_f64::shape::SharedShape;
        ReferenceShape(match shape {
            crate::Shape::Sphere { radius } => SharedShape::ball(*radius),
            crate::Shape::Capsule { half_length, radius } => SharedShape::capsule_z(*half_length, *radius),
            crate::Shape::Cuboid { half_extents: h } => SharedShape::cuboid(h.x, h.y, h.z),
            _ => unimplemented!(),
        })
    }
}

/// TEMPORARY stand-in.
pub fn distance(
    a: &ReferenceShape,
    pose_a: &crate::Pose,
    b: &ReferenceShape,
    pose_b: &crate::Pose,
    max: f64,
) -> Answer {
    let convert = |pose: &crate::Pose| {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        parry3d_f64::math::Pose {
            translation: ParryVector::new(t.x, t.y, t.z),
            rotation: parry3d_f64::math::Rotation::from_xyzw(q.x, q.y, q.z, q.w),
        }
    };
    match parry3d_f64::query::contact(&convert(pose_a), &*a.0, &convert(pose_b), &*b.0, max) {
        Ok(None) => Answer::SeparatedBy(max),
        Ok(Some(contact)) if contact.dist > 0.0 => Answer::SeparatedBy(contact.dist),
        Ok(Some(contact)) => Answer::Penetrating(-contact.dist),
        Err(_) => Answer::Unresolved,
    }
}
