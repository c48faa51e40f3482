//! Start and goal as the query gives them: what is wrong with them is said before any search.

use super::combine::releasable;
use super::given::{self, NoTouch};
use super::inside::refuse_hand_inside;
use super::model::{Body, Carrier, FingerModel, Model};
use super::settings::Method;
use super::state::GraspState;
use super::transfer::ik_settings;
use super::workspace::{Contacts, HandJoints, TipMode, Workspace};
use crate::failure::{Failure, FailureKind};
use regrasp_base::Rng;
use regrasp_geometry::collision::{Answer, Placement, separation};
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_grasp::ContactModel;
use regrasp_grasp::closure::may_close;
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings};
use regrasp_robot::kinematics::whole_pose::{has_all_directions, joints_of_pose};
use regrasp_scene::{GRASP_TOLERANCE, GraspRequest, InHandQuery};

/// Which pose of the query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The start.
    Start,
    /// A pose on the way, by its number from 1.
    Way(usize),
    /// The goal.
    Goal,
}

impl End {
    fn name(self) -> String {
        match self {
            End::Start => "start".into(),
            End::Way(number) => format!("way pose {number}"),
            End::Goal => "goal".into(),
        }
    }

    fn failure(self, message: String, advice: &str) -> Failure {
        let kind = match self {
            End::Start => FailureKind::StartInvalid,
            End::Way(_) => FailureKind::WayInvalid,
            End::Goal => FailureKind::GoalInvalid,
        };
        Failure::bare(kind, message, advice)
    }
}

/// Refuses what no search can find: hands that cannot hold or never change their grasp, poses at which the object is buried.
pub fn refuse_hopeless(model: &Model, query: &InHandQuery) -> Result<(), Failure> {
    refuse_holding_nothing(model)?;
    let may_try_transfers = model.n_fingers() == 2 || model.settings.transfers_alone;
    if model.settings.method != Method::Gait || !may_try_transfers {
        refuse_impossible(model)?;
    }
    let way = query.world_from_object_way.iter().enumerate().map(|(index, pose)| (End::Way(index + 1), pose));
    let ends = [(End::Start, &query.world_from_object_start)].into_iter().chain(way);
    for (end, pose) in ends.chain([(End::Goal, &query.world_from_object_goal)]) {
        refuse_buried_object(model, end, pose)?;
        refuse_object_out_of_reach(model, end, pose)?;
    }
    refuse_hand_inside(model, &query.world_from_object_start)
}

/// Refuses hands of which the others can never hold while one finger is away.
pub fn refuse_impossible(model: &Model) -> Result<(), Failure> {
    if model.may_release {
        return Ok(());
    }
    Err(Failure::bare(FailureKind::Impossible, never_released(model), MORE_FINGERS))
}

/// Refuses hands that cannot hold an object even with all fingers.
fn refuse_holding_nothing(model: &Model) -> Result<(), Failure> {
    let all: Vec<ContactModel> = model.fingers.iter().map(|finger| finger.contact).collect();
    if may_close(&all, model.frame.friction) {
        return Ok(());
    }
    let message = format!(
        "the hand has {} and friction {}: all of them together cannot hold an object",
        fingers_in_words(model),
        friction_in_words(model)
    );
    Err(Failure::bare(FailureKind::Impossible, message, MORE_FINGERS))
}

const MORE_FINGERS: &str =
    "use a hand with at least 4 fingers, or declare soft fingertips, of which two can hold (contact = \"soft_finger\")";

fn fingers_in_words(model: &Model) -> String {
    let models: Vec<&str> = model.fingers.iter().map(|finger| finger.contact.name()).collect();
    format!("{} fingers with contacts {models:?}", model.n_fingers())
}

/// The friction that is planned with, and how it comes from what the scene says.
pub fn friction_in_words(model: &Model) -> String {
    let (friction, margin) = (model.view.object.friction, model.settings.friction_margin);
    if margin == 1.0 { format!("{friction}") } else { format!("{friction} of the scene over a margin of {margin}") }
}

fn never_released(model: &Model) -> String {
    format!(
        "the hand has {} and friction {}: while one of them is away the others cannot hold an object (fewer than three points \
         cannot: it turns about the line through two of them). Such a hand can never change its grasp",
        fingers_in_words(model),
        friction_in_words(model)
    )
}

/// What a search with such a hand that found no transfer comes to: `failure` with the reason for which transfers are all that
/// it has.
pub fn refuse_after_transfers(model: &Model, failure: Failure) -> Failure {
    Failure {
        kind: FailureKind::Impossible,
        message: format!("{}, and no transfer alone was found: {}", never_released(model), failure.message),
        advice: MORE_FINGERS.into(),
        ..failure
    }
}

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
            &object.shape,
            &at_object,
            &body.shape,
            &body.carrier_from_body,
            clearance,
            clearance,
            &mut direction,
            &mut [0; 2],
        );
        let exactly_apart = || {
            let outside = |mesh: &Body, mesh_at: &Placement, other: &Body, at: &Placement| {
                let mesh_from_other = mesh_at.inverse_then(at);
                mesh.tree.as_ref().is_some_and(|tree| {
                    tree.is_outside((&other.shape, &other.middle), &mesh_from_other, clearance, &mut 0.0)
                })
            };
            outside(object, &at_object, body, &body.carrier_from_body)
                || outside(body, &body.carrier_from_body, object, &at_object)
        };
        !matches!(answer, Answer::SeparatedBy(_)) && !exactly_apart()
    })
}

/// The grasp that the query gives at one end; None where the planner chooses.
pub fn given_grasp(
    model: &Model,
    end: End,
    world_from_object: &Pose,
    request: &GraspRequest,
    rng: &mut Rng,
) -> Result<Option<GraspState>, Failure> {
    let Some(state) = given_grasp_at(model, end, world_from_object, request, Near::Any(rng))? else { return Ok(None) };
    let margin = model.closure_margin(&state.contacts, model.all_fingers());
    if margin < model.settings.closure_margin {
        return Err(end.failure(
            format!(
                "the {} grasp is not force closed with the margin asked for: {margin:.4} of {}, at friction {}",
                end.name(),
                model.settings.closure_margin,
                friction_in_words(model)
            ),
            "move the contacts apart, or ask for a smaller margin",
        ));
    }
    if end == End::Start && model.may_release && releasable(model, &state.contacts, state.holding) == 0 {
        return Err(end.failure(
            "in the start grasp no finger may let go: no n-1 of the fingers are force closed".into(),
            "choose other contacts, or let the planner choose (grasp = \"automatic\")",
        ));
    }
    Ok(Some(state))
}

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
        GraspRequest::Joints(values) => from_joints(model, end, world_from_object, values)?,
        GraspRequest::Contacts(points) => from_contacts(model, end, world_from_object, points, near)?,
    };
    refuse_out_of_reach(model, end, &state.joints)?;
    let mut workspace = Workspace::new(model);
    workspace.set(world_from_object, &state.joints, &state.contacts);
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

fn from_joints(model: &Model, end: End, world_from_object: &Pose, values: &[f64]) -> Result<GraspState, Failure> {
    let placement = Placement::from(world_from_object);
    let (mut joints, mut contacts) = (HandJoints::new(), Contacts::new());
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
        contacts.push(contact);
        joints.push(own);
    }
    Ok(GraspState::held_by_all(*world_from_object, contacts, joints))
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
            Near::Any(rng) => {
                (0..REACH_TRIES).find_map(|_| super::candidates::reach(&mut workspace, f, &contact, &placement, rng))
            }
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
