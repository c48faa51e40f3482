//! Fingertips as the model has them.

use nalgebra::UnitQuaternion;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape};
use regrasp_robot::{Finger, TipShape};

/// Radius of the ball that stands for a sharp tip, in metres: its surface is this far from the point, no more than a
/// plan may promise.
const POINT_RADIUS: f64 = 0.0005;

/// Name of the site of a fingertip, and of its geom where it is round.
pub(super) fn tip_name(finger: &Finger) -> String {
    format!("{}:tip", finger.name)
}

/// The ball or ellipsoid of a tip: a small ball for a sharp tip; None for hulls, which are the link's collision geometry.
pub(super) fn own_tip(finger: &Finger) -> Option<PlacedShape> {
    match finger.tip.shape {
        TipShape::Point => Some(PlacedShape {
            parent_from_shape: Pose::from_parts(finger.tip.center_in_body.coords.into(), UnitQuaternion::identity()),
            shape: Shape::Sphere { radius: POINT_RADIUS },
        }),
        TipShape::Sphere { .. } | TipShape::Ellipsoid(_) | TipShape::Hull { .. } => finger.tip.own_shape(),
    }
}
