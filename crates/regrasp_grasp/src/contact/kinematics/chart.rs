//! Charts of surfaces with their forms: metric M, curvature K, torsion T (Montana 1988; Murray, Li, Sastry 1994, 5.6).
//!
//! Charts need not be orthogonal, those of ellipsoids and superellipsoids are not. The contact frame of a point has x along
//! the first coordinate line and z along the outward normal; M is the upper triangular matrix that takes rates of (u, v) to
//! the velocity of the point in x and y, K takes that velocity to the one of the outward normal, T to the turn of x about the
//! normal. In orthogonal charts these are Montana's.

use nalgebra::{Matrix2, Matrix3, Rotation3, RowVector2, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Shape, Vector};

/// A smooth surface with charts that cover it, in the frame of its body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChartedSurface {
    kind: Kind,
    body_from_surface: Pose,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Plane,
    Cylinder {
        radius: f64,
    },
    /// With half axes `radii`: a sphere, an ellipsoid, and with exponents a superellipsoid.
    Round {
        radii: Vector,
        exponents: Option<[f64; 2]>,
    },
}

/// Coordinates of a point.
///
/// Round surfaces: longitude `u` and latitude `v` about the axis (x, y, z: 0, 1, 2), of the direction that scaling by the half
/// axes makes of the point. Cylinders: angle `u`, height `v`. Planes: x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates {
    /// Which chart; 2 on planes and cylinders.
    pub axis: usize,
    /// First coordinate.
    pub u: f64,
    /// Second coordinate.
    pub v: f64,
}

/// The forms at a point: M, K and T.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forms {
    /// M: velocity of the point in x and y over rates of `u` and `v`, upper triangular.
    pub metric: Matrix2<f64>,
    /// K: velocity of the outward normal in x and y over that of the point; symmetric, in 1/m, positive where convex.
    pub curvature: Matrix2<f64>,
    /// T: angular velocity of x about the outward normal over the velocity of the point, in 1/m.
    pub torsion: RowVector2<f64>,
}

/// Why a surface has no charts here.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoChart {
    /// A length is zero, negative, NaN or infinite.
    #[error("a length of the {kind} is {value} m; every length has to be positive and finite")]
    Length {
        /// Kind of surface.
        kind: &'static str,
        /// The offending length.
        value: f64,
    },
    /// The curvature of the superellipsoid is not finite everywhere, or not defined at its poles.
    #[error(
        "exponents {across} and {along} of a superellipsoid: both have to be at least 2 and finite, and the second above 2 \
         where the first is"
    )]
    Exponents {
        /// Of x and y.
        across: f64,
        /// Of z.
        along: f64,
    },
}

/// Sine of the latitude beyond which another chart is better.
const HIGH: f64 = 0.8;

impl ChartedSurface {
    /// The plane of x and y, outward along z.
    pub fn plane(body_from_surface: Pose) -> Self {
        ChartedSurface { kind: Kind::Plane, body_from_surface }
    }

    /// The side of a cylinder about z, without ends.
    pub fn cylinder(radius: f64, body_from_surface: Pose) -> Result<Self, NoChart> {
        checked("cylinder", radius)?;
        Ok(ChartedSurface { kind: Kind::Cylinder { radius }, body_from_surface })
    }

    /// A sphere about the origin.
    pub fn sphere(radius: f64, body_from_surface: Pose) -> Result<Self, NoChart> {
        checked("sphere", radius)?;
        Ok(ChartedSurface { kind: Kind::Round { radii: Vector::repeat(radius), exponents: None }, body_from_surface })
    }

    /// An ellipsoid about the origin with half axes along x, y, z.
    pub fn ellipsoid(radii: Vector, body_from_surface: Pose) -> Result<Self, NoChart> {
        radii.iter().try_for_each(|&radius| checked("ellipsoid", radius))?;
        Ok(ChartedSurface { kind: Kind::Round { radii, exponents: None }, body_from_surface })
    }

    /// Barr's superellipsoid `(|x/a|^p + |y/b|^p)^(q/p) + |z/c|^q = 1` with `p = across`, `q = along` (Barr 1981; his
    /// exponents are 2/p and 2/q). From 2 upwards it grows from the ellipsoid into the box.
    pub fn superellipsoid(radii: Vector, across: f64, along: f64, body_from_surface: Pose) -> Result<Self, NoChart> {
        radii.iter().try_for_each(|&radius| checked("superellipsoid", radius))?;
        let is_smooth = across >= 2.0 && along >= 2.0 && (along > 2.0 || across == 2.0);
        if !(is_smooth && across.is_finite() && along.is_finite()) {
            return Err(NoChart::Exponents { across, along });
        }
        Ok(ChartedSurface { kind: Kind::Round { radii, exponents: Some([across, along]) }, body_from_surface })
    }

    /// The surface of a sphere or ellipsoid, the side of a cylinder; None for shapes that are not smooth.
    pub fn of(shape: &Shape, body_from_shape: Pose) -> Result<Option<Self>, NoChart> {
        match shape {
            Shape::Sphere { radius } => ChartedSurface::sphere(*radius, body_from_shape).map(Some),
            Shape::Ellipsoid { radii } => ChartedSurface::ellipsoid(*radii, body_from_shape).map(Some),
            Shape::Cylinder { radius, .. } => ChartedSurface::cylinder(*radius, body_from_shape).map(Some),
            Shape::Capsule { .. } | Shape::Cuboid { .. } | Shape::Convex(_) | Shape::Mesh(_) => Ok(None),
        }
    }

    /// Coordinates of the point of the surface at or near `point_in_body`, in the chart that is best there. Exact for points
    /// of the surface; else along the line from the middle after scaling by the half axes.
    pub fn coordinates(&self, point_in_body: &Point) -> Coordinates {
        let point = self.body_from_surface.inverse_transform_point(point_in_body).coords;
        match &self.kind {
            Kind::Plane => Coordinates { axis: 2, u: point.x, v: point.y },
            Kind::Cylinder { .. } => Coordinates { axis: 2, u: point.y.atan2(point.x), v: point.z },
            Kind::Round { radii, .. } => {
                let direction = point.component_div(radii).try_normalize(0.0).unwrap_or(Vector::x());
                polar(direction.iamin(), &direction)
            }
        }
    }

    /// The same point in a chart whose pole is far, where that of `at` is near.
    pub fn in_good_chart(&self, at: &Coordinates) -> Coordinates {
        if matches!(self.kind, Kind::Round { .. }) && at.v.sin().abs() > HIGH {
            let direction = sphere_jet(at).point;
            return polar(direction.iamin(), &direction);
        }
        *at
    }

    /// The point with these coordinates, in the frame of the body.
    pub fn point(&self, at: &Coordinates) -> Point {
        self.body_from_surface * Point::from(self.jet(at).point)
    }

    /// The forms at a point.
    pub fn forms(&self, at: &Coordinates) -> Forms {
        let jet = self.jet(at);
        let [x, y, normal] = jet.axes();
        let metric = Matrix2::new(jet.u.dot(&x), jet.v.dot(&x), 0.0, jet.v.dot(&y));
        let (across, along) = (1.0 / metric[(1, 1)], 1.0 / metric[(0, 0)]);
        let inverse = Matrix2::new(along, -metric[(0, 1)] * along * across, 0.0, across);
        let second = -Matrix2::new(jet.uu.dot(&normal), jet.uv.dot(&normal), jet.uv.dot(&normal), jet.vv.dot(&normal));
        let curvature = inverse.transpose() * second * inverse;
        let torsion = RowVector2::new(jet.uu.dot(&y), jet.uv.dot(&y)) * along * inverse;
        Forms { metric, curvature, torsion }
    }

    /// The frame of a point, in the frame of the body: x along the line of growing `u`, z along the outward normal.
    pub fn body_from_contact(&self, at: &Coordinates) -> Pose {
        let jet = self.jet(at);
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&jet.axes()));
        let surface_from_contact = Pose::from_parts(jet.point.into(), UnitQuaternion::from_rotation_matrix(&rotation));
        self.body_from_surface * surface_from_contact
    }

    fn jet(&self, at: &Coordinates) -> Jet {
        let zero = Vector::zeros();
        match &self.kind {
            Kind::Plane => Jet {
                point: Vector::new(at.u, at.v, 0.0),
                u: Vector::x(),
                v: Vector::y(),
                uu: zero,
                uv: zero,
                vv: zero,
            },
            Kind::Cylinder { radius } => {
                let (sine, cosine) = at.u.sin_cos();
                let out = Vector::new(cosine, sine, 0.0) * *radius;
                let around = Vector::new(-sine, cosine, 0.0) * *radius;
                Jet { point: out + Vector::z() * at.v, u: around, v: Vector::z(), uu: -out, uv: zero, vv: zero }
            }
            Kind::Round { radii, exponents } => {
                let sphere = sphere_jet(at);
                let unit = exponents.map_or(sphere, |exponents| over_gauge(&sphere, exponents));
                unit.map(|d| d.component_mul(radii))
            }
        }
    }
}

/// A point with its first and second derivatives.
#[derive(Debug, Clone, Copy)]
struct Jet {
    point: Vector,
    u: Vector,
    v: Vector,
    uu: Vector,
    uv: Vector,
    vv: Vector,
}

impl Jet {
    /// x along the first coordinate line, y across it, the outward normal.
    fn axes(&self) -> [Vector; 3] {
        let (x, normal) = (self.u.normalize(), self.u.cross(&self.v).normalize());
        [x, normal.cross(&x), normal]
    }

    fn map(&self, f: impl Fn(&Vector) -> Vector) -> Jet {
        Jet { point: f(&self.point), u: f(&self.u), v: f(&self.v), uu: f(&self.uu), uv: f(&self.uv), vv: f(&self.vv) }
    }
}

fn checked(kind: &'static str, value: f64) -> Result<(), NoChart> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(NoChart::Length { kind, value }) }
}

/// Longitude and latitude of a direction about an axis.
fn polar(axis: usize, direction: &Vector) -> Coordinates {
    let [x, y, z] = [1, 2, 3].map(|k| direction[(axis + k) % 3]);
    Coordinates { axis, u: y.atan2(x), v: z.atan2(x.hypot(y)) }
}

/// The unit sphere.
fn sphere_jet(at: &Coordinates) -> Jet {
    let ((su, cu), (sv, cv)) = (at.u.sin_cos(), at.v.sin_cos());
    let turned = |x: f64, y: f64, z: f64| {
        let mut vector = Vector::zeros();
        for (k, value) in [x, y, z].into_iter().enumerate() {
            vector[(at.axis + k + 1) % 3] = value;
        }
        vector
    };
    Jet {
        point: turned(cv * cu, cv * su, sv),
        u: turned(-cv * su, cv * cu, 0.0),
        v: turned(-sv * cu, -sv * su, cv),
        uu: turned(-cv * cu, -cv * su, 0.0),
        uv: turned(sv * su, -sv * cu, 0.0),
        vv: turned(-cv * cu, -cv * su, -sv),
    }
}

/// `s / g(s)` for the directions `s` of `sphere`: the surface where the gauge `g` is one.
fn over_gauge(sphere: &Jet, exponents: [f64; 2]) -> Jet {
    let (value, slope, hessian) = gauge(&sphere.point, exponents);
    let first = |a: &Vector| slope.dot(a);
    let second = |a: &Vector, b: &Vector, ab: &Vector| a.dot(&(hessian * b)) + slope.dot(ab);
    let share = 1.0 / value;
    let share_first = |a: &Vector| -first(a) * share * share;
    let share_second =
        |a: &Vector, b: &Vector, ab: &Vector| (2.0 * first(a) * first(b) * share - second(a, b, ab)) * share * share;
    let (p, u, v) = (&sphere.point, &sphere.u, &sphere.v);
    let twice = |a: &Vector, b: &Vector, ab: &Vector| {
        ab * share + b * share_first(a) + a * share_first(b) + p * share_second(a, b, ab)
    };
    Jet {
        point: p * share,
        u: u * share + p * share_first(u),
        v: v * share + p * share_first(v),
        uu: twice(u, u, &sphere.uu),
        uv: twice(u, v, &sphere.uv),
        vv: twice(v, v, &sphere.vv),
    }
}

/// `((|x|^p + |y|^p)^(q/p) + |z|^q)^(1/q)` with gradient and Hessian.
fn gauge(at: &Vector, [p, q]: [f64; 2]) -> (f64, Vector, Matrix3<f64>) {
    // The part in x and y is homogeneous of degree q: taken at a point of size one, so that no power of it is lost.
    let size = at.x.abs().max(at.y.abs());
    let (x, y) = if size > 0.0 { (at.x / size, at.y / size) } else { (1.0, 0.0) };
    let power = |t: f64, exponent: f64| t.abs().powf(exponent);
    let sum = power(x, p) + power(y, p);
    let (sx, sy) = (p * power(x, p - 1.0).copysign(x), p * power(y, p - 1.0).copysign(y));
    let (sxx, syy) = (p * (p - 1.0) * power(x, p - 2.0), p * (p - 1.0) * power(y, p - 2.0));
    let ratio = q / p;
    let (outer, inner) = (ratio * sum.powf(ratio - 1.0), ratio * (ratio - 1.0) * sum.powf(ratio - 2.0));
    let (to_first, to_second) = (size.powf(q - 1.0), size.powf(q - 2.0));
    let total = size.powf(q) * sum.powf(ratio) + power(at.z, q);
    let slope = Vector::new(to_first * outer * sx, to_first * outer * sy, q * power(at.z, q - 1.0).copysign(at.z));
    let xy = to_second * inner * sx * sy;
    let hessian = Matrix3::new(
        to_second * (inner * sx * sx + outer * sxx),
        xy,
        0.0,
        xy,
        to_second * (inner * sy * sy + outer * syy),
        0.0,
        0.0,
        0.0,
        q * (q - 1.0) * power(at.z, q - 2.0),
    );
    let value = total.powf(1.0 / q);
    let scale = value / (q * total);
    let hessian = hessian * scale + slope * slope.transpose() * (scale * (1.0 / q - 1.0) / total);
    (value, slope * scale, hessian)
}
