//! Contacts that a finger could take, and how far it could follow with them.

use super::model::Model;
use super::relocate::{Foothold, lift_is_within_reach};
use super::roll::RollStep;
use super::state::GraspState;
use super::transfer::ik_settings;
use super::workspace::{TipMode, Workspace};
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, UnitVector, Vector, interpolate_pose};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings};

/// Moments of the way to the target at which a finger is asked whether it can still follow.
const LOOK_AHEAD: usize = 6;
/// Largest change of a joint between such moments.
const LOOK_AHEAD_STEP: f64 = 1.0;
/// How strongly rays are drawn towards the finger. By hand: half of the rays fall within 55 degrees.
const PULL: f64 = 0.9;

/// A contact that a finger can take, or a free posture, with everything else ignored but object, palm and obstacles.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The contact; None for a free posture.
    pub contact: Option<Contact>,
    /// Joints there.
    pub joints: Coordinates,
    /// Share of the way to the target that the finger can follow with it, or that it is not in the way of.
    pub follow: f64,
}

impl Candidate {
    /// Where `finger` is in `state`: it may stay.
    pub fn present(state: &GraspState, finger: usize) -> Self {
        Candidate { contact: state.contact(finger), joints: state.joints[finger].clone(), follow: 1.0 }
    }
}

/// The way of the object that is looked ahead along.
#[derive(Debug, Clone)]
pub struct Way {
    from: Placement,
    moments: Vec<(Pose, Placement)>,
}

impl Way {
    /// The way from `from` to `to`, at [`LOOK_AHEAD`] moments after the start.
    pub fn new(from: &Pose, to: &Pose) -> Self {
        let moments = (1..=LOOK_AHEAD)
            .map(|k| {
                let pose = interpolate_pose(from, to, k as f64 / LOOK_AHEAD as f64);
                (pose, Placement::from(&pose))
            })
            .collect();
        Way { from: Placement::from(from), moments }
    }
}

/// Draws a contact on the object that lies towards `finger`, with the object at `world_from_object`.
///
/// A ray from a random inner point within a wide cone about the finger's working place: twice as quick as drawing by
/// area (in-hand-notes, 5). The contact is where the ray leaves the solid: where that happens more than once, any of them.
///
/// None too when the work allowed is spent on contacts that do not fit.
pub fn draw_contact(
    workspace: &mut Workspace,
    finger: usize,
    world_from_object: &Placement,
    rng: &mut Rng,
) -> Option<Contact> {
    if workspace.is_spent_on_draws() {
        return None;
    }
    let mut n_measured = 0;
    let draw = |_| draw_contact_once(workspace.model, finger, world_from_object, rng, &mut n_measured);
    let found = (0..RAYS).find_map(draw);
    // A contact that is found costs what is done with it; one that is not would cost nothing.
    let free = if found.is_some() { MEASURED_FREE } else { 0 };
    workspace.count_draws(n_measured.saturating_sub(free) / MEASURED_PER_WORK);
    found
}

/// Distances from the surface that the draw of a contact may take at no cost where one is found; most take a few.
const MEASURED_FREE: u64 = 100;
/// Distances from the surface that count as a configuration: on a mesh of ten thousand triangles they take as long.
const MEASURED_PER_WORK: u64 = 10;

/// Rays drawn for one contact: most of those that miss the finger's reach cost little.
const RAYS: usize = 24;

fn draw_contact_once(
    model: &Model,
    finger: usize,
    world_from_object: &Placement,
    rng: &mut Rng,
    n_measured: &mut u64,
) -> Option<Contact> {
    let object = &model.view.object;
    let inner = object.center_of_mass + Vector::from(rng.direction()) * (0.4 * model.frame.torque_scale * rng.unit());
    let towards = world_from_object.point_to_child(&model.fingers[finger].tip_at_rest) - inner;
    let direction = towards.normalize() * PULL + Vector::from(rng.direction());
    let direction = UnitVector::try_new(direction, 1e-9)?;
    let mut exits = object.surface.exits(&inner, &direction);
    let chosen = match exits.len() {
        0 => return None,
        1 => 0,
        n => rng.below(n),
    };
    let hit = exits.swap_remove(chosen);
    let finger_model = &model.fingers[finger];
    let rough = Contact { point_in_object: hit.point_in_object, normal_in_object: hit.normal_in_object };
    if !finger_model.may_reach(world_from_object, &rough) {
        return None;
    }
    let hit = object.surface.settle_counted(&hit, finger_model.settle_radius, n_measured)?;
    if object.surface.crease_distance(&hit) < object.edge_distance {
        return None;
    }
    Some(Contact { point_in_object: hit.point_in_object, normal_in_object: hit.normal_in_object })
}

/// Joints of `finger` at `contact` from which it can be lifted again, clear of everything but the other fingers; the
/// workspace has the object in place.
pub fn reach(
    workspace: &mut Workspace,
    finger: usize,
    contact: &Contact,
    world_from_object: &Placement,
    rng: &mut Rng,
) -> Option<Coordinates> {
    let model = workspace.model;
    let normal = UnitVector::new_unchecked(world_from_object.vector(&contact.normal_in_object));
    let settings = ik_settings(model, finger, normal);
    let joints = model.fingers[finger].touch_random(world_from_object, contact, &settings, rng)?;
    if !lift_is_within_reach(model, world_from_object, finger, &Foothold { contact: Some(contact), joints: &joints }) {
        return None;
    }
    workspace.set_finger(finger, &joints);
    let mode = TipMode::Near { finger, normal_in_world: normal.into_inner() };
    workspace.finger_alone_is_clear(finger, mode).then_some(joints)
}

/// Share of the way, from its beginning, along which `finger` can keep `contact` or roll from it, looked at alone and only now
/// and then.
pub fn follow_share(
    workspace: &mut Workspace,
    finger: usize,
    contact: &Contact,
    joints: &Coordinates,
    way: &Way,
) -> f64 {
    let model = workspace.model;
    let (mut current, mut contact, mut from) = (joints.clone(), *contact, &way.from);
    let mut n_followed = 0;
    for (pose, world_from_object) in &way.moments {
        // Moments are far apart; what matters here is reach, not continuity, so the step may be larger.
        let next = if model.rolls(finger) {
            let step = RollStep::new(model, finger, &contact, &current, from, world_from_object);
            let Some(rolled) = step.coarse(LOOK_AHEAD_STEP) else { break };
            if !rolled.keeps_off_edges(model) {
                break;
            }
            contact = rolled.contact;
            rolled.joints
        } else {
            let normal = UnitVector::new_unchecked(world_from_object.vector(&contact.normal_in_object));
            let settings = IkSettings { max_step: LOOK_AHEAD_STEP, ..ik_settings(model, finger, normal) };
            let next = model.fingers[finger].touch_near(world_from_object, &contact, &current, &settings);
            let Some(next) = next else { break };
            next
        };
        from = world_from_object;
        let normal = world_from_object.vector(&contact.normal_in_object);
        workspace.place_object_and_finger(pose, finger, &next);
        if !workspace.finger_alone_is_clear(finger, TipMode::Near { finger, normal_in_world: normal }) {
            break;
        }
        current = next;
        n_followed += 1;
    }
    f64::from(n_followed) / LOOK_AHEAD as f64
}

/// Share of the way along which `finger`, free with these joints, is clear of the object, palm and obstacles, looked at now
/// and then; None when it is not at the beginning, with the object at `world_from_object`.
pub fn clear_share(
    workspace: &mut Workspace,
    finger: usize,
    joints: &Coordinates,
    world_from_object: &Pose,
    way: &Way,
) -> Option<f64> {
    let mode = TipMode::Away { finger, clearance: workspace.model.free_clearance() };
    let mut is_clear = |pose: &Pose| {
        workspace.place_object_and_finger(pose, finger, joints);
        workspace.finger_alone_is_clear(finger, mode)
    };
    if !is_clear(world_from_object) {
        return None;
    }
    let n_clear = way.moments.iter().take_while(|(pose, _)| is_clear(pose)).count();
    Some(n_clear as f64 / LOOK_AHEAD as f64)
}

/// Draws contacts of `finger` that it can take, with its joints there: up to `n_wanted`, each given to `found`.
///
/// The workspace has the object at `world_from_object` and keeps it there; the finger is left anywhere.
pub fn draw_footholds(
    workspace: &mut Workspace,
    finger: usize,
    world_from_object: &Placement,
    n_wanted: usize,
    rng: &mut Rng,
    mut found: impl FnMut(Contact, Coordinates),
) {
    let mut n_found = 0;
    for _ in 0..8 * n_wanted {
        if n_found == n_wanted {
            return;
        }
        let Some(contact) = draw_contact(workspace, finger, world_from_object, rng) else { continue };
        let Some(joints) = reach(workspace, finger, &contact, world_from_object, rng) else { continue };
        found(contact, joints);
        n_found += 1;
    }
}

/// A random pose near the way from `start` to `goal` (in-hand-notes, 3: biased poses).
pub fn draw_pose(model: &Model, start: &Pose, goal: &Pose, rng: &mut Rng) -> Pose {
    let settings = &model.settings;
    let is_far = rng.chance(settings.far_share);
    let (distance, angle) = (settings.wander_distance, settings.wander_angle);
    let distance = if is_far { distance.max(model.turn_length()) } else { distance };
    let along = interpolate_pose(start, goal, rng.unit());
    let shift = Vector::from(rng.direction()) * (distance * rng.unit().cbrt());
    let turn = Vector::new(rng.normal(), rng.normal(), rng.normal()) * angle;
    let center = along * model.view.object.center_of_mass;
    let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn) * along.rotation;
    // Turn about the centre of mass, then shift.
    let origin: Point = center + shift - rotation * model.view.object.center_of_mass.coords;
    Pose::from_parts(origin.coords.into(), rotation)
}
