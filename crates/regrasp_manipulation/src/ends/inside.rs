//! A hand that is inside something is refused before any search.

use crate::failure::{Failure, FailureKind};
use crate::model::{Body, Carrier, Model};
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_robot::kinematics::chain::JointMotion;

/// Radius of a ball that stands for a point, in metres.
const POINT: f64 = 1e-9;

/// Refuses a hand of which the palm, or what a finger begins with, is inside an obstacle or inside the object at the start.
pub fn refuse_hand_inside(model: &Model, world_from_object_start: &Pose) -> Result<(), Failure> {
    let object = &model.bodies[model.object];
    let at_object = Placement::from(world_from_object_start).then(&object.carrier_from_body);
    let obstacles = model.bodies[model.first_obstacle()..].iter();
    let solids = obstacles.map(|body| (body, body.carrier_from_body)).chain([(object, at_object)]);
    for (solid, at) in solids {
        if let Some(part) = palm_inside(model, solid, &at).or_else(|| finger_inside(model, solid, &at)) {
            let message = format!("at the start \"{part}\" is inside \"{}\"; nothing was moved", solid.name);
            let advice = "move the hand, the object or the obstacle; correct world_from_hand or the mesh's scale";
            return Err(Failure::bare(FailureKind::StartInvalid, message, advice));
        }
    }
    Ok(())
}

/// Refuses a palm that overlaps another hand, another object or a robot that does not carry it. Neither moves: once is enough.
pub fn refuse_palm_overlap(model: &Model) -> Result<(), Failure> {
    let around = &model.bodies[model.first_obstacle() + model.view.n_beside_palm..];
    let palm = || model.bodies[..model.object].iter().filter(|body| matches!(body.carrier, Carrier::World));
    for other in around {
        if let Some(part) = palm().find(|part| !are_apart(part, other)) {
            let message = format!("\"{}\" overlaps \"{}\", and neither moves", part.name, other.name);
            return Err(Failure::bare(
                FailureKind::Impossible,
                message,
                "move the hand or the other body in the scene file",
            ));
        }
    }
    Ok(())
}

/// True when two bodies that stand still are proved to be apart.
fn are_apart(part: &Body, other: &Body) -> bool {
    let (at, there) = (&part.carrier_from_body, &other.carrier_from_body);
    if let Some(tree) = &other.tree {
        let seen = there.inverse_then(at);
        let is_outside = !tree.holds(&there.point_to_child(&at.point(&part.middle)));
        return is_outside && tree.is_apart(&part.shape, &seen, 0.0, &mut 0.0);
    }
    let (first, second) = (Placed { shape: &part.shape, at }, Placed { shape: &other.shape, at: there });
    matches!(separation(first, second, 0.0, 0.0, &mut Vector::zeros(), &mut [0; 2]), Separation::SeparatedBy(_))
}

/// The first part of the palm, when all of its parts are inside: a mount may hold one of them.
fn palm_inside<'m>(model: &'m Model, solid: &Body, at: &Placement) -> Option<&'m str> {
    let palm = || model.bodies[..model.object].iter().filter(|body| matches!(body.carrier, Carrier::World));
    let middle = |body: &Body| body.carrier_from_body.point(&body.middle);
    let is_inside = palm().all(|body| holds(solid, at, &middle(body)));
    palm().next().filter(|_| is_inside).map(|body| body.name.as_str())
}

/// A first body of a finger that is inside whatever its joint does: the ball in which it turns is.
fn finger_inside<'m>(model: &'m Model, solid: &Body, at: &Placement) -> Option<&'m str> {
    model.fingers.iter().find_map(|finger| {
        let first = finger.ik.chain().joints.first()?;
        let base = Point::from(first.parent_from_joint.translation.vector);
        let begins = |body: &&Body| matches!(body.carrier, Carrier::Finger { link: 0, .. });
        let bodies = || model.bodies[finger.bodies.clone()].iter().filter(begins);
        let reach = |body: &Body| body.carrier_from_body.point(&body.center).coords.norm() + body.radius;
        let radius = bodies().map(reach).fold(0.0, f64::max);
        let slides = matches!(first.motion, JointMotion::Slide);
        let tree = solid.tree.as_ref()?;
        let ball = Placement { translation: base.coords, ..Placement::IDENTITY };
        let seen = at.inverse_then(&ball);
        let is_deep = !slides
            && radius > 0.0
            && tree.is_apart(&Shape::Sphere { radius }, &seen, 0.0, &mut 0.0)
            && tree.holds(&Point::from(seen.translation));
        bodies().next().filter(|_| is_deep).map(|body| body.name.as_str())
    })
}

/// True when `point`, in the world, is inside `solid`.
fn holds(solid: &Body, at: &Placement, point: &Point) -> bool {
    if let Some(tree) = &solid.tree {
        return tree.holds(&at.point_to_child(point));
    }
    let speck = Shape::Sphere { radius: POINT };
    let there = Placement { translation: point.coords, ..Placement::IDENTITY };
    let mut direction = Vector::zeros();
    let answer = separation(
        Placed { shape: &speck, at: &there },
        Placed { shape: &solid.shape, at },
        0.0,
        0.0,
        &mut direction,
        &mut [0; 2],
    );
    !matches!(answer, Separation::SeparatedBy(_))
}
