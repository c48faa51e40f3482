//! The surface of a fingertip: balls, sharp tips, and ellipsoids and smooth hulls, which touch with another point whenever the
//! link turns.

use nalgebra::Matrix3;
use regrasp_geometry::{ConvexHull, Vector};
use regrasp_robot::tip::smooth_hull::SmoothHull;
use regrasp_robot::tip::{HullSurface, Pad, Tip, TipEllipsoid, TipShape};
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
    /// A smooth surface near a hull.
    Smooth(Arc<Smooth>),
}

/// A smooth surface near a hull, in the frame of the last moving body. With the points `v_i`, the exponent `p` and the rounding
/// `r` it reaches `(sum (v_i . n)^p)^(1/p) + r` from its centre towards a unit vector `n`; sums are over what is positive.
#[derive(Debug, Clone)]
pub struct Smooth {
    points: Vec<Vector>,
    exponent: f64,
    /// Points that reach less far than this share of the farthest are left out.
    least_share: f64,
    rounding: f64,
    /// The hull that it stands for, about the tip's centre.
    hull: Arc<ConvexHull>,
    /// Largest distance between the two that was measured.
    misfit: f64,
    /// Least distance from the centre to a plane that touches.
    inner_radius: f64,
    /// Planes that touch, in many directions: normal, and distance from the centre. All of the surface is behind each.
    planes: Vec<(Vector, f64)>,
}

/// Directions in which a smooth surface is measured against its hull.
const MEASURED: usize = 3001;

/// Terms smaller than this share of the largest are left out: less than rounding.
const SMALLEST_TERM: f64 = 1e-17;

/// Unit vectors spread evenly over the sphere: even in height and, by the golden angle, around.
pub fn spread(n: usize) -> impl Iterator<Item = Vector> {
    (0..n).map(move |k| {
        let z = (2 * k + 1) as f64 / n as f64 - 1.0;
        let (sine, cosine) = (2.399963229728653 * k as f64).sin_cos();
        Vector::new((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z)
    })
}

impl Smooth {
    /// The surface near `hull`, measured over `pad`.
    pub fn of(surface: &SmoothHull, hull: &Arc<ConvexHull>, pad: Option<&Pad>) -> Self {
        let mut smooth = Smooth {
            points: surface.points().to_vec(),
            exponent: f64::from(surface.exponent()),
            least_share: SMALLEST_TERM.powf(1.0 / f64::from(surface.exponent())),
            rounding: surface.rounding(),
            hull: hull.clone(),
            misfit: 0.0,
            inner_radius: f64::INFINITY,
            planes: Vec::with_capacity(MEASURED),
        };
        let mut hint = 0;
        for n in spread(MEASURED) {
            let reach = smooth.point(&n).dot(&n);
            smooth.planes.push((n, reach));
            smooth.inner_radius = smooth.inner_radius.min(reach);
            if pad.is_none_or(|pad| pad.axis_in_body.dot(&n) >= pad.cosine) {
                smooth.misfit = smooth.misfit.max(smooth.apart(&n, &mut hint));
            }
        }
        smooth
    }

    /// True where this is the surface of these points about that very hull; over which pad it was measured is not said.
    pub fn is_of(&self, surface: &SmoothHull, hull: &Arc<ConvexHull>) -> bool {
        let numbers = |exponent: f64, rounding: f64| [exponent, rounding];
        Arc::ptr_eq(&self.hull, hull)
            && numbers(self.exponent, self.rounding) == numbers(f64::from(surface.exponent()), surface.rounding())
            && self.points == surface.points()
    }

    /// The point with the outward normal `n`, a unit vector, from the centre.
    pub fn point(&self, n: &Vector) -> Vector {
        let farthest = self.points.iter().map(|point| point.dot(n)).fold(0.0, f64::max);
        let least = farthest * self.least_share;
        let (mut sum, mut weighted) = (0.0, Vector::zeros());
        for point in &self.points {
            let along = point.dot(n);
            if along > least {
                let term = (self.exponent * (along / farthest).ln()).exp();
                sum += term;
                weighted += point * (term * farthest / along);
            }
        }
        weighted * sum.powf(1.0 / self.exponent - 1.0) + n * self.rounding
    }

    /// How the point with the outward normal `n` moves when the normal turns: radii of curvature across `n`, as a matrix.
    pub fn radii(&self, n: &Vector) -> Matrix3<f64> {
        let farthest = self.points.iter().map(|point| point.dot(n)).fold(0.0, f64::max);
        let least = farthest * self.least_share;
        // Shares of the points, and the points moved along their rays to the plane that touches.
        let (mut sum, mut mean, mut squares) = (0.0, Vector::zeros(), Matrix3::zeros());
        for point in &self.points {
            let along = point.dot(n);
            if along > least {
                let term = (self.exponent * (along / farthest).ln()).exp();
                let across = point / along - n;
                sum += term;
                mean += across * term;
                squares += across * across.transpose() * term;
            }
        }
        let smoothed = farthest * sum.powf(1.0 / self.exponent);
        mean /= sum;
        let covariance = squares / sum - mean * mean.transpose();
        let across = Matrix3::identity() - n * n.transpose();
        covariance * ((self.exponent - 1.0) * smoothed) + across * self.rounding
    }

    /// Planes that touch in many directions, as outward normal and distance from the centre.
    pub fn planes(&self) -> &[(Vector, f64)] {
        &self.planes
    }

    /// How far surface and hull are apart towards `n`.
    fn apart(&self, n: &Vector, hint: &mut u32) -> f64 {
        (self.hull.support(n, hint).coords.dot(n) - self.point(n).dot(n)).abs()
    }

    /// Smallest radius of curvature that is sure.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// Radius of a ball about the centre that is inside.
    pub fn inner_radius(&self) -> f64 {
        self.inner_radius
    }

    /// How far the two are apart, towards `n` and anywhere on the pad.
    pub fn misfit(&self, n: &Vector) -> f64 {
        self.misfit.max(self.apart(n, &mut 0))
    }
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
            TipShape::Hull { hull, surface: HullSurface::Ellipsoid(fitted), .. } => {
                ellipsoid(fitted, Some(hull.clone()))
            }
            TipShape::Hull { hull, surface: HullSurface::Smooth(surface), .. } => {
                TipSurface::Smooth(Arc::new(Smooth::of(surface, hull, tip.pad.as_ref())))
            }
        }
    }

    /// Smallest and largest radius of curvature of an ellipsoid; none for others.
    pub fn curvature_radii(&self) -> Option<[f64; 2]> {
        match self {
            TipSurface::Ball | TipSurface::Smooth(_) => None,
            TipSurface::Ellipsoid { radii, .. } => {
                Some([radii.min() * radii.min() / radii.max(), radii.max() * radii.max() / radii.min()])
            }
        }
    }

    /// Bound, in metres per radian of the link's turn over the object, of how far the place that faces a direction wanders
    /// over the tip; for a hull also of how fast what it is off its ellipsoid there changes.
    ///
    /// A smooth hull may be nearly flat, so that this is metres. What is judged of it changes no faster than its points move:
    /// how far the hull is from the contact's plane, and from the contact. Both are less than what is measured, from the point
    /// that faces the normal.
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
