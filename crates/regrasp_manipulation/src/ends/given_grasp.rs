//! The grasps that a query gives.

use crate::ends::end::End;
use crate::ends::given;
use crate::ends::given::NoTouch;
use crate::failure::Failure;
use crate::grasp::state::{Contacts, GraspState, HandJoints};
use crate::model::Model;
use crate::rolling::follow::ik_settings;
use crate::workspace::{TipMode, Workspace};
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, UnitVector};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings};
use regrasp_robot::kinematics::whole_pose::{has_all_directions, joints_of_pose};
use regrasp_scene::{GRASP_TOLERANCE, GraspRequest};

/// Which joints are taken for a contact.
pub enum Near<'r> {
    /// Any that are clear.
    Any(&'r mut Rng),
    /// Those nearest to the rest posture.
    Rest,
}

/// Turns of a joint, in radians, from the rest posture to the start.
const FROM_REST: f64 = 3.0;

/// The grasp that the query gives at one end, clear of everything; whether it is closed is not asked.
pub fn given_grasp_at(
    model: &Model,
    end: End,
    world_from_object: &Pose,
    request: &GraspRequest,
    near: Near,
) -> Result<Option<GraspState>, Failure> {
    let state = match request {
        GraspRequest::Automatic => return Ok(None),
        GraspRequest::Contacts(points) => from_contacts(model, end, world_from_object, points, near)?,
        GraspRequest::Joints(_) | GraspRequest::Posture { .. } => {
            posture_at(model, end, world_from_object, request)?.expect("joints are given")
        }
    };
    refuse_out_of_reach(model, end, &state.joints)?;
    let mut workspace = Workspace::new(model);
    workspace.set_state(&state);
    if !workspace.is_clear(TipMode::AllHold) {
        let names = workspace
            .blocking_pair
            .map_or(("?", "?"), |p| (model.bodies[p.a].name.as_str(), model.bodies[p.b].name.as_str()));
        return Err(end.failure(
            format!("at the {} \"{}\" and \"{}\" collide; nothing was moved", end.name(), names.0, names.1),
            "choose other contacts or joints",
        ));
    }
    Ok(Some(state))
}

/// The grasp of given joints, whatever they are in the way of; None where the query gives no joints.
pub fn posture_at(
    model: &Model,
    end: End,
    world_from_object: &Pose,
    request: &GraspRequest,
) -> Result<Option<GraspState>, Failure> {
    let state = match request {
        GraspRequest::Automatic | GraspRequest::Contacts(_) => return Ok(None),
        GraspRequest::Joints(values) => from_joints(model, end, world_from_object, values, |_| true)?,
        GraspRequest::Posture { joints, holds } => {
            from_joints(model, end, world_from_object, joints, |finger| holds.get(finger).copied().unwrap_or(true))?
        }
    };
    Ok(Some(state))
}

/// Refuses a grasp with a tip farther from where it rests than the scene allows.
fn refuse_out_of_reach(model: &Model, end: End, joints: &HandJoints) -> Result<(), Failure> {
    let Some(reach) = model.view.reach else { return Ok(()) };
    for (f, (finger, own)) in model.fingers.iter().zip(joints).enumerate() {
        let away = (finger.ik.tip(own) - finger.tip_at_rest).norm();
        if !(away <= reach) {
            let (name, end_name) = (&model.view.hand.fingers[f].name, end.name());
            let message = format!(
                "at the {end_name} finger \"{name}\" is {away:.3} m from where it rests, its reach is {reach} m"
            );
            return Err(end.failure(message, "choose another contact or rest posture, or a larger reach"));
        }
    }
    Ok(())
}

fn from_joints(
    model: &Model,
    end: End,
    world_from_object: &Pose,
    values: &[f64],
    holds: impl Fn(usize) -> bool,
) -> Result<GraspState, Failure> {
    let placement = Placement::from(world_from_object);
    let mut fingers: Vec<(Option<Contact>, Coordinates)> = Vec::with_capacity(model.n_fingers());
    let mut rest = values;
    for (f, finger) in model.fingers.iter().enumerate() {
        let name = &model.view.hand.fingers[f].name;
        let chain = finger.ik.chain();
        let n = chain.n_coordinates();
        assert!(rest.len() >= n, "joint vectors have one value per joint");
        let (own, others) = rest.split_at(n);
        rest = others;
        let own: Coordinates = own.iter().copied().collect();
        if !chain.within_limits(&own, 0.0) {
            return Err(end.failure(
                format!("at the {} finger \"{name}\" is outside its joint limits", end.name()),
                "give joint positions within the limits; regrasp inspect prints them",
            ));
        }
        if !holds(f) {
            fingers.push((None, own));
            continue;
        }
        let (contact, own) =
            given::touching(finger, &model.view.object.surface, &own, &placement).map_err(|no_touch| {
                let off = |gap: f64| {
                    let side = if gap < 0.0 { "inside" } else { "off" };
                    format!("is {:.2} mm {side} the surface", gap.abs() * 1e3)
                };
                let problem = match no_touch {
                    NoTouch::Inside => "has no contact: it is deep in the object".to_owned(),
                    NoTouch::Off(gap) => format!("{}; at most {} mm are put right", off(gap), GRASP_TOLERANCE * 1e3),
                    NoTouch::Stuck(gap) => format!("{}, and no joints near the given ones touch", off(gap)),
                };
                let message = format!("at the {} the tip of finger \"{name}\" {problem}", end.name());
                end.failure(
                    message,
                    "correct the joints, give contacts, or let the planner choose (grasp = \"automatic\")",
                )
            })?;
        if !finger.pad_faces(&own, &placement.vector(&contact.normal_in_object)) {
            return Err(end.failure(
                format!("at the {} finger \"{name}\" touches outside its pad", end.name()),
                "correct the joints or give contacts",
            ));
        }
        fingers.push((Some(contact), own));
    }
    Ok(GraspState::of(*world_from_object, fingers.into_iter()))
}

fn from_contacts(
    model: &Model,
    end: End,
    world_from_object: &Pose,
    points: &[Point],
    mut near: Near,
) -> Result<GraspState, Failure> {
    let placement = Placement::from(world_from_object);
    let (mut joints, mut contacts) = (HandJoints::new(), Contacts::new());
    for (f, point) in points.iter().enumerate() {
        let name = &model.view.hand.fingers[f].name;
        let (contact, distance) = given::contact_for(&model.fingers[f], &model.view.object.surface, point);
        if distance > GRASP_TOLERANCE {
            let message = format!(
                "the {} contact of finger \"{name}\" is {:.2} mm off the surface that its tip can touch; at most {} mm are put \
                 right",
                end.name(),
                distance * 1e3,
                GRASP_TOLERANCE * 1e3
            );
            return Err(end.failure(message, "give a point on the surface, in the object frame"));
        }
        let mut workspace = Workspace::new(model);
        workspace.place_object(world_from_object);
        let reached = match &mut near {
            Near::Any(rng) => (0..REACH_TRIES)
                .find_map(|_| crate::grasp::contact::reach(&mut workspace, f, &contact, &placement, rng)),
            Near::Rest => {
                let settings = IkSettings { limit_margin: 0.0, preference: None, max_step: FROM_REST };
                let (finger, rest) = (&model.fingers[f], &model.view.hand.fingers[f].rest);
                let chain = finger.ik.chain();
                if has_all_directions(chain) {
                    let rotation = chain.last_frame(rest).rotation;
                    let center = finger.center_over(&placement, &contact);
                    let translation = center.coords - rotation * finger.ik.center_in_body().coords;
                    joints_of_pose(chain, rest, &Placement { rotation, translation })
                } else {
                    finger.touch_near(&placement, &contact, rest, &settings)
                }
            }
        };
        let Some(own) = reached else {
            let normal = UnitVector::new_unchecked(placement.vector(&contact.normal_in_object));
            let settings = ik_settings(model, f, normal);
            let reachable = match &mut near {
                Near::Any(rng) => model.fingers[f].touch_random(&placement, &contact, &settings, rng).is_some(),
                Near::Rest => false,
            };
            let why = if reachable { "only in collision" } else { "not at all within its joint limits" };
            return Err(end.failure(
                format!("finger \"{name}\" reaches its {} contact {why}", end.name()),
                "choose another contact, or another pose of the object",
            ));
        };
        contacts.push(contact);
        joints.push(own);
    }
    Ok(GraspState::held_by_all(*world_from_object, contacts, joints))
}

/// Postures tried for a given contact.
const REACH_TRIES: usize = 20;
