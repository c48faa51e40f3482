//! Balls beside the object that its convex parts should not cover, because fingers and palms are there.
//!
//! A part that stands out where a fingertip touches makes another grasp of the planned one, and a part that stands out where a link
//! passes pushes the object away.

use crate::mjcf::geom::as_collided;
use regrasp_base::random::Rng;
use regrasp_geometry::frame::tangents;
use regrasp_geometry::parts::Clear;
use regrasp_geometry::{Point, Pose, Surface, UnitVector, Vector};
use regrasp_plan::robot_plan::{RobotPlan, RobotSegmentKind, RobotWaypoint};
use regrasp_robot::tip::TipShape;
use regrasp_robot::{Manipulator, Part};
use regrasp_scene::Object;

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
/// Largest number of moments of a segment at which links are looked at.
const MOMENTS: usize = 4;

/// For the hands of `robot`, along the whole plan, in the frame of `object`.
pub(super) fn for_hands(robot: &Manipulator, object: &Object, plan: &RobotPlan) -> Vec<Clear> {
    if object.surface.mesh().is_none() {
        return Vec::new();
    }
    let mut clear = around_tips(robot, object, plan);
    clear.extend(beside_links(robot, object, plan));
    clear
}

/// Points of fingertips, where they touch.
fn around_tips(robot: &Manipulator, object: &Object, plan: &RobotPlan) -> Vec<Clear> {
    let mut found = Vec::new();
    let mut known: Vec<([f64; 3], &str)> = Vec::new();
    for contact in plan.waypoints().flat_map(|waypoint| &waypoint.contacts) {
        if known.contains(&(contact.point_in_object, contact.finger.as_str())) {
            continue;
        }
        known.push((contact.point_in_object, &contact.finger));
        let mounted = robot.hands.iter().find(|mounted| mounted.name == contact.hand);
        let finger = mounted
            .and_then(|mounted| mounted.hand.finger_named(&contact.finger).map(|id| &mounted.hand.fingers[id.0]));
        let Some(finger) = finger else { continue };
        let radius = if let TipShape::Sphere { radius } = finger.tip.shape { radius } else { TIP_RADIUS };
        let outward = UnitVector::new_normalize(Vector::from(contact.normal_in_object));
        let (x, y) = tangents(&outward);
        let touched = Point::from(contact.point_in_object);
        let center = touched + radius * *outward;
        for ring in 0..=RINGS {
            let angle = LARGEST_ANGLE * f64::from(ring) / f64::from(RINGS);
            for k in 0..if ring == 0 { 1 } else { 4 * ring } {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(4 * ring.max(1))).sin_cos();
                let across = cos * x.into_inner() + sin * y.into_inner();
                let point = center + (radius - OUTSTANDING) * (angle.sin() * across - angle.cos() * *outward);
                found.extend(outside(&object.surface, point));
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

/// A collision shape of a link of a hand.
struct LinkShape {
    link: usize,
    shape_from_link: Pose,
    surface: Surface,
    /// A ball around it, in the frame of the link.
    ball: (Point, f64),
}

/// On rays along outward normals of the object, the nearest points of links of hands.
fn beside_links(robot: &Manipulator, object: &Object, plan: &RobotPlan) -> Vec<Clear> {
    let shapes = shapes_of_hands(robot);
    let surface = &object.surface;
    let n_rays = (surface.area() / AREA).clamp(1.0, MOST_RAYS) as u64;
    let rays: Vec<(Point, UnitVector)> = (0..n_rays)
        .map(|k| surface.sample(&mut Rng::keyed(0, "parts beside links", k)))
        .map(|at| (at.point_in_object, at.normal_in_object))
        .collect();
    let mut nearest = vec![f64::INFINITY; rays.len()];
    let mut world_from_link = Vec::new();
    for waypoint in moments(plan) {
        let Some(object_pose) = waypoint.world_from_objects.first() else { continue };
        robot.link_poses(&waypoint.joints, &mut world_from_link);
        let object_from_world = Pose::from(object_pose).inverse();
        for shape in &shapes {
            let object_from_link = object_from_world * world_from_link[shape.link];
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

/// Moments at which hands are at the object or near it.
fn moments(plan: &RobotPlan) -> impl Iterator<Item = &RobotWaypoint> {
    let near = |kind: RobotSegmentKind| !matches!(kind, RobotSegmentKind::Transit);
    plan.segments.iter().filter(move |segment| near(segment.kind)).flat_map(|segment| {
        let last = segment.waypoints.len() - 1;
        // A carried object goes with its hand.
        let n = if segment.kind == RobotSegmentKind::Carry { 1 } else { MOMENTS.min(last) };
        (0..=n).map(move |k| &segment.waypoints[last * k / n.max(1)])
    })
}

fn shapes_of_hands(robot: &Manipulator) -> Vec<LinkShape> {
    let links = robot.robot.links.iter().enumerate();
    let of_hands = links.filter(|(l, _)| matches!(robot.part_of(regrasp_robot::LinkId(*l)), Part::Hand(_)));
    let mut shapes = Vec::new();
    for (link, placed) in of_hands.flat_map(|(l, link)| link.collision.iter().map(move |placed| (l, placed))) {
        let shape = as_collided(&placed.shape);
        let (center, radius) = shape.bounding_sphere();
        let ball = (placed.parent_from_shape * center, radius);
        let Ok(surface) = Surface::of(&shape) else { continue };
        shapes.push(LinkShape { link, shape_from_link: placed.parent_from_shape.inverse(), surface, ball });
    }
    shapes
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
