//! The surface of a fingertip: balls, sharp tips, and ellipsoids, which touch with another point whenever the link turns.

use nalgebra::Matrix3;
use regrasp_geometry::{ConvexHull, Vector};
use regrasp_robot::tip::{Tip, TipEllipsoid, TipShape};
use std::sync::Arc;

/// The surface with which a finger touches, about its centre.
#[derive(Debug, Clone)]
pub enum TipSurface {
    /// A ball of [`FingerModel::radius`](crate::check::model::FingerModel::radius); sharp when that is zero.
    Ball,
    /// An ellipsoid.
    Ellipsoid {
        /// Half axes.
        radii: Vector,
        /// Rotation of its axes in the frame of the last moving body.
        link_from_axes: Matrix3<f64>,
        /// The hull that it stands for, about the tip's centre and in the frame of the last moving body.
        hull: Option<Arc<ConvexHull>>,
    },
}

impl TipSurface {
    /// The surface of `tip`.
    pub fn of(tip: &Tip) -> Self {
        let ellipsoid = |ellipsoid: &TipEllipsoid, hull| TipSurface::Ellipsoid {
            radii: ellipsoid.radii,
            link_from_axes: *ellipsoid.body_from_ellipsoid.to_rotation_matrix().matrix(),
            hull,
        };
        match &tip.shape {
            TipShape::Point | TipShape::Sphere { .. } => TipSurface::Ball,
            TipShape::Ellipsoid(own) => ellipsoid(own, None),
            TipShape::Hull { hull, fitted, .. } => ellipsoid(fitted, Some(hull.clone())),
        }
    }

    /// Smallest and largest radius of curvature of an ellipsoid; none for balls.
    pub fn curvature_radii(&self) -> Option<[f64; 2]> {
        match self {
            TipSurface::Ball => None,
            TipSurface::Ellipsoid { radii, .. } => {
                Some([radii.min() * radii.min() / radii.max(), radii.max() * radii.max() / radii.min()])
            }
        }
    }

    /// Bound, in metres per radian of the link's turn over the object, of how far the place that faces a direction wanders
    /// over the tip; for a hull also of how fast what it is off its ellipsoid there changes.
    pub fn wander(&self) -> f64 {
        let TipSurface::Ellipsoid { radii, hull, .. } = self else { return 0.0 };
        let flattest = self.curvature_radii().map_or(0.0, |[_, flattest]| flattest);
        let apart = |hull: &Arc<ConvexHull>| {
            // A support function changes by its point times the turn.
            radii.max() + hull.vertices().iter().map(|p| p.coords.norm()).fold(0.0, f64::max)
        };
        flattest + hull.as_ref().map_or(0.0, apart)
    }
}
