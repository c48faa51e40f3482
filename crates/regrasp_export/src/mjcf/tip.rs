//! Fingertips as the model has them.

use nalgebra::UnitQuaternion;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape};
use regrasp_robot::{ContactModel, Finger, TipShape};

/// Radius of the ball that stands for a sharp tip, in metres: its surface is this far from the point, no more than a
/// plan may promise.
const POINT_RADIUS: f64 = 0.0005;
/// Torsional friction of a fingertip that counts as a point, in metres (physics notes, section 1): none touches at a point.
pub(super) const POINT_TORSION: f64 = 0.002;
/// MuJoCo's own coefficients of rolling friction; without effect where `condim` is below 6.
pub(super) const ROLLING: f64 = 0.0001;

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

/// `condim` and MuJoCo's five friction coefficients of a fingertip on the object.
pub(super) fn friction_of(finger: &Finger, friction: f64) -> (u8, [f64; 5]) {
    let with_torsion = |torsion: f64| [friction, friction, torsion, ROLLING, ROLLING];
    match finger.tip.contact {
        ContactModel::Frictionless => (1, with_torsion(POINT_TORSION)),
        _ if friction <= 0.0 => (1, [1.0, 1.0, POINT_TORSION, ROLLING, ROLLING]),
        ContactModel::Point => (4, with_torsion(POINT_TORSION)),
        ContactModel::SoftFinger { torsion_radius } => (4, with_torsion(friction * torsion_radius)),
    }
}
