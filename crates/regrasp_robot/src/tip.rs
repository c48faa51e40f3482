//! Fingertips: what of the last link touches.

use crate::contact_model::ContactModel;
use crate::robot::LinkId;
use nalgebra::{Matrix3, SMatrix, SVector, Translation3, UnitQuaternion};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{ConvexHull, Point, Pose, Shape, UnitVector, Vector};
use smooth_hull::SmoothHull;
use std::sync::Arc;

/// Smooth surfaces near convex polyhedra.
pub mod smooth_hull;

/// What the fingertip is, for contact.
#[derive(Debug, Clone, PartialEq)]
pub enum TipShape {
    /// A sharp tip: contact at one point of the link (Saut 2011, sec. 3.1).
    Point,
    /// A ball: contact anywhere on it that the object's normal selects.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// An ellipsoid: contact anywhere on it that the object's normal selects.
    Ellipsoid(TipEllipsoid),
    /// The convex hull of collision geometry of the tip link, about [`Tip::center_in_body`] and in the axes of that body. It
    /// touches where a smooth surface near it does.
    Hull {
        /// The hull.
        hull: Arc<ConvexHull>,
        /// The surface that touches.
        surface: HullSurface,
        /// How far that is off the hull over the pad, in metres; scenes refuse more than [`LARGEST_MISFIT`].
        misfit: f64,
        /// Which `<collision>` elements of the tip link it is made of, from 0; all of them where empty.
        elements: Vec<usize>,
    },
}

/// The smooth surface that stands for the hull of a tip.
#[derive(Debug, Clone, PartialEq)]
pub enum HullSurface {
    /// The ellipsoid nearest to it over the pad, where that is within [`ELLIPSOID_FITS`]. See [`fit`].
    Ellipsoid(TipEllipsoid),
    /// A smooth surface that follows any hull.
    Smooth(Arc<SmoothHull>),
}

/// Most that the smooth surface of a tip may differ from its hull over the pad, in metres: what fingertips may press into
/// objects by default is 0.3 mm.
pub const LARGEST_MISFIT: f64 = 0.2e-3;

/// Most that an ellipsoid may differ from a hull for which it stands, over the pad, in metres.
pub const ELLIPSOID_FITS: f64 = 0.1e-3;

/// A curved fingertip that is no ball: the point that touches depends on how its link stands.
#[derive(Debug, Clone, Copy)]
pub enum CurvedTip<'a> {
    /// An ellipsoid.
    Ellipsoid(&'a TipEllipsoid),
    /// A smooth surface near the hull of a mesh.
    Smooth(&'a SmoothHull),
}

impl<'a> From<&'a TipEllipsoid> for CurvedTip<'a> {
    fn from(ellipsoid: &'a TipEllipsoid) -> Self {
        CurvedTip::Ellipsoid(ellipsoid)
    }
}

impl CurvedTip<'_> {
    /// From the centre to the point whose outward normal is `normal_in_body`, a unit vector; in the same frame.
    #[inline]
    pub fn arm(&self, normal_in_body: &Vector) -> Vector {
        match self {
            CurvedTip::Ellipsoid(ellipsoid) => ellipsoid.arm(normal_in_body),
            CurvedTip::Smooth(surface) => surface.point(normal_in_body),
        }
    }

    /// Radius of a ball that stands for the tip when contacts are drawn: for an ellipsoid one that holds it where it touches.
    /// Faces of meshes are nearly flat; there it is the distance of the tip's farthest point from its centre.
    pub fn settle_radius(&self) -> f64 {
        match self {
            CurvedTip::Ellipsoid(ellipsoid) => ellipsoid.flattest(),
            CurvedTip::Smooth(surface) => surface.reach(),
        }
    }
}

/// An ellipsoid about [`Tip::center_in_body`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipEllipsoid {
    /// Half axes, in metres.
    pub radii: Vector,
    /// How it stands in the frame of the chain's last moving body.
    pub body_from_ellipsoid: UnitQuaternion<f64>,
    /// `R diag(radii^2) R^T` in the frame of the last moving body.
    gram: Matrix3<f64>,
}

impl TipEllipsoid {
    /// The ellipsoid with these half axes and axes.
    pub fn new(radii: Vector, body_from_ellipsoid: UnitQuaternion<f64>) -> Self {
        let turn = body_from_ellipsoid.to_rotation_matrix();
        let gram = turn.matrix() * Matrix3::from_diagonal(&radii.component_mul(&radii)) * turn.matrix().transpose();
        TipEllipsoid { radii, body_from_ellipsoid, gram }
    }

    /// From the centre to the point whose outward normal is `normal_in_body`, a unit vector; in the same frame.
    #[inline]
    pub fn arm(&self, normal_in_body: &Vector) -> Vector {
        let along = self.gram * normal_in_body;
        along / along.dot(normal_in_body).sqrt()
    }

    /// Largest radius of curvature. A ball of this radius that touches where the ellipsoid does holds all of it (Blaschke).
    pub fn flattest(&self) -> f64 {
        self.radii.max().powi(2) / self.radii.min()
    }

    /// Smallest radius of curvature.
    pub fn sharpest(&self) -> f64 {
        self.radii.min().powi(2) / self.radii.max()
    }
}

/// The part of a fingertip that may touch: where its outward normal is within an angle of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pad {
    /// Axis, in the frame of the chain's last moving body.
    pub axis_in_body: UnitVector,
    /// Cosine of the largest angle.
    pub cosine: f64,
}

impl Pad {
    /// True when the point of the tip with this outward normal, a unit vector, belongs to the pad.
    #[inline]
    pub fn holds(&self, normal_in_body: &Vector) -> bool {
        self.axis_in_body.dot(normal_in_body) >= self.cosine
    }
}

/// A fingertip.
#[derive(Debug, Clone, PartialEq)]
pub struct Tip {
    /// Link that carries the tip, as the user names it.
    pub link: LinkId,
    /// Its shape.
    pub shape: TipShape,
    /// The point of the tip (its centre, for a sphere or an ellipsoid), in the frame of the chain's last moving body.
    pub center_in_body: Point,
    /// Where it may touch; anywhere without one.
    pub pad: Option<Pad>,
    /// What it can transmit where it touches.
    pub contact: ContactModel,
}

impl Tip {
    /// Largest distance of the surface that touches from [`Tip::center_in_body`]; the radius of a ball.
    pub fn radius(&self) -> f64 {
        match &self.shape {
            TipShape::Point => 0.0,
            TipShape::Sphere { radius } => *radius,
            TipShape::Ellipsoid(ellipsoid) | TipShape::Hull { surface: HullSurface::Ellipsoid(ellipsoid), .. } => {
                ellipsoid.radii.max()
            }
            TipShape::Hull { surface: HullSurface::Smooth(surface), .. } => surface.reach(),
        }
    }

    /// The surface that touches, for tips that are neither balls nor sharp.
    pub fn curved(&self) -> Option<CurvedTip<'_>> {
        match &self.shape {
            TipShape::Point | TipShape::Sphere { .. } => None,
            TipShape::Ellipsoid(ellipsoid) | TipShape::Hull { surface: HullSurface::Ellipsoid(ellipsoid), .. } => {
                Some(CurvedTip::Ellipsoid(ellipsoid))
            }
            TipShape::Hull { surface: HullSurface::Smooth(surface), .. } => Some(CurvedTip::Smooth(surface)),
        }
    }

    /// The tip's own surface in the frame of the chain's last moving body; None for sharp tips, and for hulls, which are the
    /// link's collision geometry.
    pub fn own_shape(&self) -> Option<PlacedShape> {
        let center = Translation3::from(self.center_in_body.coords);
        match &self.shape {
            TipShape::Point | TipShape::Hull { .. } => None,
            TipShape::Sphere { radius } => Some(PlacedShape {
                parent_from_shape: Pose::from_parts(center, UnitQuaternion::identity()),
                shape: Shape::Sphere { radius: *radius },
            }),
            TipShape::Ellipsoid(ellipsoid) => Some(PlacedShape {
                parent_from_shape: Pose::from_parts(center, ellipsoid.body_from_ellipsoid),
                shape: Shape::Ellipsoid { radii: ellipsoid.radii },
            }),
        }
    }
}

/// Lengths and angles below which two surfaces are the same, in metres and radians.
const SAME: f64 = 1e-9;

/// True when two balls or ellipsoids in one frame are the same; balls may be turned. False for all other shapes.
pub fn is_same_surface(a: &PlacedShape, b: &PlacedShape) -> bool {
    let [at, from] = [a, b].map(|placed| placed.parent_from_shape);
    let is_alike = match (&a.shape, &b.shape) {
        (Shape::Sphere { radius: a }, Shape::Sphere { radius: b }) => (a - b).abs() < SAME,
        (Shape::Ellipsoid { radii: a }, Shape::Ellipsoid { radii: b }) => {
            (a - b).norm() < SAME && at.rotation.angle_to(&from.rotation) < SAME
        }
        _ => false,
    };
    is_alike && (at.translation.vector - from.translation.vector).norm() < SAME
}

/// An ellipsoid that was fitted to points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Its centre.
    pub center: Point,
    /// The ellipsoid, about its centre.
    pub ellipsoid: TipEllipsoid,
    /// Largest difference of the support functions of the points' hull and the ellipsoid over the directions, in metres.
    pub misfit: f64,
}

/// Directions over which the difference of an ellipsoid from a hull is judged.
const DIRECTIONS: usize = 2000;
/// Steps of Levenberg and Marquardt's method.
const FIT_STEPS: usize = 200;

/// The ellipsoid nearest to the hull of `points` over the directions of `pad`, all of them without one: least squares of the
/// support functions, `c u + |L^T u|` for centre `c` and a lower triangular `L`. None for points that span no volume.
pub fn fit(points: &[Point], pad: Option<&Pad>) -> Option<Fit> {
    let support = |u: &Vector| points.iter().map(|p| p.coords.dot(u)).fold(f64::NEG_INFINITY, f64::max);
    let directions: Vec<(Vector, f64)> =
        spiral(DIRECTIONS).filter(|u| pad.is_none_or(|pad| pad.holds(u))).map(|u| (u, support(&u))).collect();
    let middle = points.iter().map(|p| p.coords).sum::<Vector>() / points.len().max(1) as f64;
    let size = points.iter().map(|p| (p.coords - middle).norm()).fold(0.0, f64::max);
    if directions.len() < 9 || !(size > 0.0) {
        return None;
    }
    let mut known = SVector::<f64, 9>::zeros();
    known.fixed_rows_mut::<3>(0).copy_from(&middle);
    // L by columns: (0,0), (1,0), (2,0), (1,1), (2,1), (2,2).
    for k in [3, 6, 8] {
        known[k] = size;
    }
    let lower = |k: &SVector<f64, 9>| Matrix3::new(k[3], 0.0, 0.0, k[4], k[6], 0.0, k[5], k[7], k[8]);
    let residual = |k: &SVector<f64, 9>, (u, h): &(Vector, f64)| {
        k.fixed_rows::<3>(0).dot(u) + (lower(k).transpose() * u).norm() - h
    };
    let cost = |k: &SVector<f64, 9>| directions.iter().map(|d| residual(k, d).powi(2)).sum::<f64>();
    let (mut damping, mut now) = (1e-3, cost(&known));
    for _ in 0..FIT_STEPS {
        let (mut normal, mut slope) = (SMatrix::<f64, 9, 9>::zeros(), SVector::<f64, 9>::zeros());
        for direction in &directions {
            let u = &direction.0;
            let w = (lower(&known).transpose() * u).try_normalize(1e-12)?;
            let row = SVector::<f64, 9>::from_column_slice(&[
                u.x,
                u.y,
                u.z,
                u.x * w.x,
                u.y * w.x,
                u.z * w.x,
                u.y * w.y,
                u.z * w.y,
                u.z * w.z,
            ]);
            slope += row * residual(&known, direction);
            normal += row * row.transpose();
        }
        let mut damped = normal;
        for k in 0..9 {
            damped[(k, k)] += damping * normal[(k, k)].max(1e-12);
        }
        let Some(step) = damped.cholesky().map(|factor| factor.solve(&slope)) else { break };
        let (trial, better) = (known - step, cost(&(known - step)));
        if better < now {
            let gained = now - better;
            (known, now, damping) = (trial, better, (0.3 * damping).max(1e-12));
            if gained < 1e-12 * now {
                break;
            }
        } else if damping > 1e12 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    let eigen = (lower(&known) * lower(&known).transpose()).symmetric_eigen();
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let radii = eigen.eigenvalues.map(|square| square.max(0.0).sqrt());
    let turn = UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(axes));
    let misfit = directions.iter().map(|direction| residual(&known, direction).abs()).fold(0.0, f64::max);
    (radii.min() > 1e-6).then(|| Fit {
        center: Point::from(known.fixed_rows::<3>(0).into_owned()),
        ellipsoid: TipEllipsoid::new(radii, turn),
        misfit,
    })
}

/// Unit vectors spread evenly over the sphere, by a spiral of golden angles.
pub(crate) fn spiral(n: usize) -> impl Iterator<Item = Vector> {
    const GOLDEN_ANGLE: f64 = 2.399963229728653;
    (0..n).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f64 / n as f64;
        let across = (1.0 - z * z).sqrt();
        let (sine, cosine) = (GOLDEN_ANGLE * k as f64).sin_cos();
        Vector::new(across * cosine, across * sine, z)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    fn ellipsoid() -> TipEllipsoid {
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.8, 1.1);
        TipEllipsoid::new(Vector::new(0.009, 0.007, 0.006), turn)
    }

    #[test]
    fn arms_end_on_the_surface_with_the_normal_asked_for() {
        let ellipsoid = ellipsoid();
        let mut rng = Rng::keyed(1, "arms", 0);
        for _ in 0..200 {
            let normal = Vector::from(rng.direction());
            let arm = ellipsoid.body_from_ellipsoid.inverse() * ellipsoid.arm(&normal);
            let scaled = arm.component_div(&ellipsoid.radii);
            assert!((scaled.norm() - 1.0).abs() < 1e-12);
            let gradient = ellipsoid.body_from_ellipsoid * scaled.component_div(&ellipsoid.radii);
            assert!((gradient.normalize() - normal).norm() < 1e-9);
        }
    }

    /// Curvature by finite differences: normals that differ by an angle have points that are radius times angle apart.
    #[test]
    fn radii_of_curvature_are_bounds_that_are_met() {
        let ellipsoid = ellipsoid();
        let mut rng = Rng::keyed(2, "curvature", 0);
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for _ in 0..20_000 {
            let normal = Vector::from(rng.direction());
            let aside = normal.cross(&Vector::from(rng.direction())).normalize() * 1e-5;
            let radius = (ellipsoid.arm(&(normal + aside).normalize()) - ellipsoid.arm(&normal)).dot(&aside) / 1e-10;
            (least, most) = (least.min(radius), most.max(radius));
        }
        assert!(least >= ellipsoid.sharpest() * (1.0 - 1e-4) && least < 1.1 * ellipsoid.sharpest(), "{least}");
        assert!(most <= ellipsoid.flattest() * (1.0 + 1e-4) && most > 0.9 * ellipsoid.flattest(), "{most}");
    }

    #[test]
    fn an_ellipsoid_is_found_again_from_points_on_it() {
        let truth = ellipsoid();
        let center = Point::new(0.002, -0.001, 0.03);
        let points: Vec<Point> = spiral(3000).map(|normal| center + truth.arm(&normal)).collect();
        for pad in [None, Some(Pad { axis_in_body: Vector::x_axis(), cosine: 0.3 })] {
            let fit = fit(&points, pad.as_ref()).unwrap();
            assert!((fit.center - center).norm() < 2e-5, "{}", fit.center);
            assert!(fit.misfit < 2e-5, "{}", fit.misfit);
            let (mut found, mut given) = (fit.ellipsoid.radii, truth.radii);
            found.as_mut_slice().sort_by(f64::total_cmp);
            given.as_mut_slice().sort_by(f64::total_cmp);
            assert!((found - given).norm() < 5e-5, "{found}");
        }
    }

    #[test]
    fn surfaces_are_the_same_to_rounding_and_balls_however_they_are_turned() {
        let placed = |shape: Shape, x: f64, angle: f64| PlacedShape {
            parent_from_shape: Pose::new(Vector::new(x, 0.0, 0.0), Vector::new(0.0, 0.0, angle)),
            shape,
        };
        let ball = || Shape::Sphere { radius: 0.005 };
        let egg = || Shape::Ellipsoid { radii: Vector::new(0.009, 0.007, 0.006) };
        assert!(is_same_surface(&placed(ball(), 0.01, 0.0), &placed(ball(), 0.01 + 1e-12, 1.0)));
        assert!(!is_same_surface(&placed(ball(), 0.01, 0.0), &placed(ball(), 0.01001, 0.0)));
        assert!(is_same_surface(&placed(egg(), 0.01, 0.3), &placed(egg(), 0.01, 0.3 + 1e-12)));
        assert!(!is_same_surface(&placed(egg(), 0.01, 0.3), &placed(egg(), 0.01, 0.4)));
        assert!(!is_same_surface(&placed(egg(), 0.01, 0.3), &placed(ball(), 0.01, 0.3)));
        let cube = || Shape::Cuboid { half_extents: Vector::repeat(0.005) };
        assert!(!is_same_surface(&placed(cube(), 0.0, 0.0), &placed(cube(), 0.0, 0.0)));
    }

    #[test]
    fn what_is_no_ellipsoid_has_a_misfit_and_what_is_flat_none() {
        let corners: Vec<Point> =
            (0..8).map(|k| Point::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 0.01).collect();
        assert!(fit(&corners, None).unwrap().misfit > 3e-4);
        assert!(fit(&corners[..1], None).is_none());
        assert!(fit(&[], None).is_none());
    }
}
