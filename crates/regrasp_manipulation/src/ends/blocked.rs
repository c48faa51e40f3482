//! Object poses that no grasp can have.

use crate::ends::end::End;
use crate::failure::Failure;
use crate::model::{Body, Carrier, FingerModel, Model};
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::ContactModel;
use regrasp_grasp::closure::may_close;

/// Refuses an object pose at which the object itself is in collision with palm or obstacles.
pub fn refuse_buried_object(model: &Model, end: End, world_from_object: &Pose) -> Result<(), Failure> {
    let Some(body) = object_blocked_by(model, world_from_object) else { return Ok(()) };
    Err(end.failure(
        format!(
            "at the {} the object \"{}\" is in collision with \"{}\", or nearer than {} m; nothing was moved",
            end.name(),
            model.bodies[model.object].name,
            body.name,
            model.settings.clearance
        ),
        "move the object away from it, or make the clearance smaller",
    ))
}

/// The body of palm or obstacles that the object is too near to at a pose, if there is one.
pub fn object_blocked_by<'m>(model: &'m Model, world_from_object: &Pose) -> Option<&'m Body> {
    let object = &model.bodies[model.object];
    let at_object = Placement::from(world_from_object).then(&object.carrier_from_body);
    let clearance = model.settings.clearance;
    let palm = model.pairs.iter().filter(|pair| pair.b == model.object).map(|pair| pair.a);
    let is_fixed = |&other: &usize| matches!(model.bodies[other].carrier, Carrier::World);
    let obstacles = model.obstacles_near(&at_object.point(&object.center), (object.radius + clearance) * (1.0 + 1e-9));
    palm.filter(is_fixed).chain(obstacles).map(|other| &model.bodies[other]).find(|body| {
        let mut direction = Vector::zeros();
        let answer = separation(
            Placed { shape: &object.shape, at: &at_object },
            Placed { shape: &body.shape, at: &body.carrier_from_body },
            clearance,
            clearance,
            &mut direction,
            &mut [0; 2],
        );
        let exactly_apart = || {
            let outside = |mesh: &Body, mesh_at: &Placement, other: &Body, at: &Placement| {
                let mesh_from_other = mesh_at.inverse_then(at);
                mesh.tree.as_ref().is_some_and(|tree| {
                    tree.is_outside(&other.shape, &other.middle, &mesh_from_other, clearance, &mut 0.0)
                })
            };
            outside(object, &at_object, body, &body.carrier_from_body)
                || outside(body, &body.carrier_from_body, object, &at_object)
        };
        !matches!(answer, Separation::SeparatedBy(_)) && !exactly_apart()
    })
}

/// Refuses a pose at which too few fingers can touch the object without going farther than the scene allows.
pub fn refuse_object_out_of_reach(model: &Model, end: End, world_from_object: &Pose) -> Result<(), Failure> {
    let Some(reach) = model.view.reach else { return Ok(()) };
    let placement = Placement::from(world_from_object);
    let surface = &model.view.object.surface;
    let gap = |finger: &FingerModel| {
        let (_, distance) = surface.project_signed(&placement.point_to_child(&finger.tip_at_rest));
        distance.abs() - finger.tip_radius
    };
    let touching = model.fingers.iter().filter(|&finger| !(gap(finger) > reach));
    let touching: Vec<ContactModel> = touching.map(|finger| finger.contact).collect();
    if may_close(&touching, model.frame.friction) {
        return Ok(());
    }
    let message = format!(
        "at the {} only {} of {} fingers can touch the object \"{}\" within the reach of {reach} m that the scene allows",
        end.name(),
        touching.len(),
        model.n_fingers(),
        model.bodies[model.object].name
    );
    Err(end
        .failure(message, "move the object nearer to where the fingertips rest, or allow a larger reach (hand.reach)"))
}
