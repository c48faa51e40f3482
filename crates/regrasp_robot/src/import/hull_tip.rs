//! Fingertips that are the hull of collision geometry.

use crate::tip::smooth_hull::{SmoothHull, depth_of_origin};
use crate::tip::{ELLIPSOID_FITS, HullSurface, Pad, TipShape, fit, spiral};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{ConvexHull, Point, Shape, Vector};
use std::sync::Arc;

/// What is wrong, what was expected, and what helps.
pub(crate) type Refusal = (String, &'static str, &'static str);

const GEOMETRY: &str = "collision geometry of the tip link that encloses a volume";
const ROUND: &str = "shape = \"sphere\" for a round tip";

/// A centre that is less deep inside the hull, as a share of the deepest point found, is moved there.
const DEEP_ENOUGH: f64 = 0.5;
/// Points of the rim of a cylinder, and of a round shape.
const RIM: usize = 96;
const ROUND_POINTS: usize = 2000;
/// Steps of the search for a point deep inside.
const DEPTH_STEPS: usize = 200;
/// Where that search begins, as seen from a centre outside: the mean of what is this near, in metres.
const NEIGHBOURHOOD: f64 = 0.02;

/// Surfaces of hulls, each made once: the fingers of a hand often have the same tip.
#[derive(Default)]
pub(crate) struct HullTips {
    made: Vec<Made>,
}

/// A tip made before.
#[derive(Clone)]
struct Made {
    /// Corners as seen from the centre asked for, and the pad.
    relative: Vec<Point>,
    pad: Option<Pad>,
    /// From that centre to the one taken.
    shift: Vector,
    hull: Arc<ConvexHull>,
    surface: HullSurface,
    misfit: f64,
}

impl HullTips {
    /// The tip that is the hull of `shapes` near `center`, all in the frame of its body: its centre there, and the shape.
    pub(crate) fn make(
        &mut self,
        shapes: &[&PlacedShape],
        center: &Point,
        pad: Option<&Pad>,
        elements: &[usize],
    ) -> Result<(Point, TipShape), Refusal> {
        let relative: Vec<Point> =
            shapes.iter().flat_map(|shape| corners(shape)).map(|p| Point::from(p - center)).collect();
        if relative.is_empty() {
            return Err(("tip link has no collision geometry".to_owned(), GEOMETRY, ROUND));
        }
        let known = self.made.iter().find(|made| made.pad.as_ref() == pad && made.relative == relative);
        let made = match known {
            Some(made) => made.clone(),
            None => {
                let made = make(shapes, center, relative, pad)?;
                self.made.push(made.clone());
                made
            }
        };
        let Made { shift, hull, surface, misfit, .. } = made;
        Ok((center + shift, TipShape::Hull { hull, surface, misfit, elements: elements.to_vec() }))
    }
}

fn make(shapes: &[&PlacedShape], center: &Point, relative: Vec<Point>, pad: Option<&Pad>) -> Result<Made, Refusal> {
    let no_hull = |error| (format!("tip link has no hull: {error}"), GEOMETRY, ROUND);
    let near = match shapes {
        [PlacedShape { parent_from_shape, shape: Shape::Convex(hull) }] => {
            hull.moved(|p| Point::from(parent_from_shape * p - center))
        }
        _ => ConvexHull::new(&relative).map_err(no_hull)?,
    };
    let made = |shift, hull, surface, misfit| Made {
        relative: relative.clone(),
        pad: pad.copied(),
        shift,
        hull,
        surface,
        misfit,
    };
    if let Some(fit) = fit(&relative, pad).filter(|fit| fit.misfit <= ELLIPSOID_FITS) {
        let points: Vec<Point> = relative.iter().map(|p| Point::from(p - fit.center)).collect();
        let hull = Arc::new(ConvexHull::new(&points).map_err(no_hull)?);
        return Ok(made(fit.center.coords, hull, HullSurface::Ellipsoid(fit.ellipsoid), fit.misfit));
    }
    let shift = shift_inside(&near);
    let hull = if shift == Vector::zeros() { near } else { near.moved(|p| p - shift) };
    let (surface, misfit) =
        SmoothHull::near(&hull, pad).ok_or_else(|| ("the tip's hull is too thin".to_owned(), GEOMETRY, ROUND))?;
    Ok(made(shift, Arc::new(hull), HullSurface::Smooth(Arc::new(surface)), misfit))
}

/// From the origin to a point well inside `hull` and near it; zero where the origin is well inside.
fn shift_inside(hull: &ConvexHull) -> Vector {
    let own = depth_of_origin(hull).unwrap_or(0.0);
    let nearest = hull.vertices().iter().map(|p| p.coords.norm()).fold(f64::INFINITY, f64::min);
    let near = hull.vertices().iter().filter(|p| p.coords.norm() <= nearest + NEIGHBOURHOOD);
    let (sum, n) = near.fold((Vector::zeros(), 0), |(sum, n), p| (sum + p.coords, n + 1));
    let faces = faces(hull);
    let depth = |at: &Vector| {
        let to = |&(normal, offset): &(Vector, f64)| (offset - normal.dot(at), normal);
        faces.iter().map(to).fold((f64::INFINITY, Vector::zeros()), |best, one| if one.0 < best.0 { one } else { best })
    };
    // Away from the nearest face, by ever smaller steps.
    let mut at = sum / f64::from(n.max(1));
    let mut best = (depth(&at).0, at);
    for k in 0..DEPTH_STEPS {
        at -= depth(&at).1 * (NEIGHBOURHOOD / (k + 4) as f64);
        let deep = depth(&at).0;
        if deep > best.0 {
            best = (deep, at);
        }
    }
    if own >= DEEP_ENOUGH * best.0 { Vector::zeros() } else { best.1.map(|x| (x * 1e6).round() / 1e6) }
}

/// Outward unit normals of the faces and their distances from the origin.
fn faces(hull: &ConvexHull) -> Vec<(Vector, f64)> {
    let corner = |k: u32| hull.vertices()[k as usize];
    let face = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [corner(a), corner(b), corner(c)];
        let normal = (b - a).cross(&(c - a)).try_normalize(1e-18)?;
        Some((normal, normal.dot(&a.coords)))
    };
    hull.triangles().iter().filter_map(face).collect()
}

/// Points of the surface of a shape, in the parent's frame: see [`corners_of`].
fn corners(placed: &PlacedShape) -> Vec<Point> {
    corners_of(&placed.shape).iter().map(|p| placed.parent_from_shape * p).collect()
}

/// Points of the surface of a shape, whose hull is the shape: its corners, and for round ones many points.
pub(crate) fn corners_of(shape: &Shape) -> Vec<Point> {
    let farthest = |shape: &Shape, n: &Vector| match shape {
        Shape::Sphere { radius } => Point::from(n * *radius),
        Shape::Capsule { half_length, radius } => Point::from(n * *radius + Vector::z() * half_length.copysign(n.z)),
        Shape::Ellipsoid { radii } => {
            Point::from(radii.component_mul(&radii.component_mul(n).try_normalize(1e-12).unwrap_or_else(Vector::x)))
        }
        _ => Point::origin(),
    };
    match shape {
        Shape::Convex(hull) => hull.vertices().to_vec(),
        Shape::Mesh(mesh) => mesh.vertices().to_vec(),
        Shape::Cuboid { half_extents: h } => (0..8)
            .map(|k| {
                let sign = |bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
                Point::new(sign(0) * h.x, sign(1) * h.y, sign(2) * h.z)
            })
            .collect(),
        Shape::Cylinder { half_length, radius } => (0..2 * RIM)
            .map(|k| {
                let (sine, cosine) = (std::f64::consts::TAU * (k / 2) as f64 / RIM as f64).sin_cos();
                let height = if k.is_multiple_of(2) { -half_length } else { *half_length };
                Point::new(radius * cosine, radius * sine, height)
            })
            .collect(),
        shape => spiral(ROUND_POINTS).map(|n| farthest(shape, &n)).collect(),
    }
}
