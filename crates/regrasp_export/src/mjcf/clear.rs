//! Balls beside the object that its convex parts should not cover, because fingers and palms are there.
//!
//! A part that stands out where a fingertip touches makes another grasp of the planned one, and a part that stands out where a link
//! passes pushes the object away.

use super::geom::as_collided;
use regrasp_base::random::Rng;
use regrasp_geometry::frame::tangents;
use regrasp_geometry::parts::Clear;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Surface, UnitVector, Vector};
use regrasp_robot::Finger;
use regrasp_robot::tip::TipShape;

/// How far a convex part may stand out towards a fingertip at its contact, in metres.
const OUTSTANDING: f64 = 3e-4;
/// Radius of fingertips that are no balls, in metres.
const TIP_RADIUS: f64 = 0.008;
/// Rings of points on a fingertip about its contact, and the angle of the last.
const RINGS: i32 = 8;
const LARGEST_ANGLE: f64 = 1.2;
/// Radius of the balls that are kept clear, as a share of the way to the object, and the largest, in metres.
const SHARE: f64 = 0.1;
const LARGEST_BALL: f64 = 5e-4;
/// Area of the object for each ray towards the links of hands, in m^2, and most rays.
const AREA: f64 = 4e-6;
const MOST_RAYS: f64 = 20_000.0;
/// How far rays go, in metres.
const FAR: f64 = 0.01;

/// A fingertip where it touches the object, in the object's frame.
pub(super) struct Touch {
    /// Of its ball, in metres; `TIP_RADIUS` where it is none.
    radius: f64,
    point: Point,
    outward: UnitVector,
}

impl Touch {
    pub fn of(finger: &Finger, point_in_object: [f64; 3], normal_in_object: [f64; 3]) -> Self {
        let radius = if let TipShape::Sphere { radius } = finger.tip.shape { radius } else { TIP_RADIUS };
        let outward = UnitVector::new_normalize(Vector::from(normal_in_object));
        Touch { radius, point: Point::from(point_in_object), outward }
    }
}

/// A collision shape of a link of a hand.
pub(super) struct LinkShape {
    /// Which of the poses of a moment is the link's.
    link: usize,
    shape_from_link: Pose,
    surface: Surface,
    /// A ball around it, in the frame of the link.
    ball: (Point, f64),
}

impl LinkShape {
    /// None where the shape has no surface.
    pub fn new(link: usize, placed: &PlacedShape) -> Option<Self> {
        let shape = as_collided(&placed.shape);
        let (center, radius) = shape.bounding_sphere();
        let surface = Surface::of(&shape).ok()?;
        let ball = (placed.parent_from_shape * center, radius);
        Some(LinkShape { link, shape_from_link: placed.parent_from_shape.inverse(), surface, ball })
    }
}

/// Points of fingertips, where they touch.
pub(super) fn around_tips(surface: &Surface, touches: &[Touch]) -> Vec<Clear> {
    let mut found = Vec::new();
    for Touch { radius, point, outward } in touches {
        let (x, y) = tangents(outward);
        let center = point + *radius * **outward;
        for ring in 0..=RINGS {
            let angle = LARGEST_ANGLE * f64::from(ring) / f64::from(RINGS);
            for k in 0..if ring == 0 { 1 } else { 4 * ring } {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(4 * ring.max(1))).sin_cos();
                let across = cos * x.into_inner() + sin * y.into_inner();
                let point = center + (radius - OUTSTANDING) * (angle.sin() * across - angle.cos() * **outward);
                found.extend(outside(surface, point));
            }
        }
    }
    found
}

/// A ball about a point, if it is outside of the object.
fn outside(surface: &Surface, point: Point) -> Option<Clear> {
    let (nearest, distance) = surface.project_signed(&point);
    let radius = (SHARE * distance).min(LARGEST_BALL);
    (distance > 0.5 * OUTSTANDING).then_some(Clear { center: point, radius, nearest: nearest.point_in_object })
}

/// On rays along outward normals of the object, the nearest points of links. Each of the `moments` has the poses of all links in the
/// object's frame.
pub(super) fn beside_links(
    surface: &Surface,
    shapes: &[LinkShape],
    moments: impl Iterator<Item = Vec<Pose>>,
) -> Vec<Clear> {
    let n_rays = (surface.area() / AREA).clamp(1.0, MOST_RAYS) as u64;
    let rays: Vec<(Point, UnitVector)> = (0..n_rays)
        .map(|k| surface.sample(&mut Rng::keyed(0, "parts beside links", k)))
        .map(|at| (at.point_in_object, at.normal_in_object))
        .collect();
    let mut nearest = vec![f64::INFINITY; rays.len()];
    for object_from_links in moments {
        for shape in shapes {
            let object_from_link = object_from_links[shape.link];
            let (middle, reach) = (object_from_link * shape.ball.0, shape.ball.1 + FAR);
            if surface.signed_distance(&middle) > reach {
                continue;
            }
            let shape_from_object = shape.shape_from_link * object_from_link.inverse();
            for ((from, outward), nearest) in rays.iter().zip(&mut nearest) {
                if (from - middle).norm_squared() <= reach * reach {
                    let ray = (shape_from_object * from, shape_from_object * outward.into_inner());
                    *nearest = reached(&shape.surface, ray, nearest.min(FAR)).unwrap_or(*nearest);
                }
            }
        }
    }
    let clear = |((from, outward), height): (&(Point, UnitVector), f64)| {
        // A little nearer than the link: it does not follow the plan exactly.
        let height = (height - OUTSTANDING).max(0.75 * OUTSTANDING);
        let point = from + height * outward.into_inner();
        if height <= FAR { outside(surface, point) } else { None }
    };
    // What touches is the business of fingertips.
    let pairs = rays.iter().zip(nearest).filter(|(_, height)| *height > OUTSTANDING);
    pairs.filter_map(clear).collect()
}

/// Where a ray meets a surface, by spheres around its points, as far as `far`.
fn reached(surface: &Surface, (from, along): (Point, Vector), far: f64) -> Option<f64> {
    let mut height = 0.0;
    while height < far {
        let distance = surface.signed_distance(&(from + height * along));
        if distance < 0.1 * OUTSTANDING {
            return Some(height);
        }
        height += distance;
    }
    None
}
