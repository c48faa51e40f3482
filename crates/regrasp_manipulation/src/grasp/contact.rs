//! Contacts that a finger can reach, drawn at random.

use crate::grasp::closing::draw_touch;
use crate::grasp::usable::is_usable;
use crate::model::Model;
use crate::rolling::follow::ik_settings;
use crate::workspace::Workspace;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::surface::SurfacePoint;
use regrasp_geometry::{UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// How strongly rays are drawn towards the finger. By hand: half of the rays fall within 55 degrees.
const PULL: f64 = 0.9;

/// Draws a contact on the object that lies towards `finger`, with the object at `world_from_object`.
///
/// A ray from a random inner point within a wide cone about the finger's working place: twice as quick as drawing by
/// area (by measurement on a prototype). The contact is where the ray leaves the solid: where that happens more than once, any of them.
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
    let hit = match model.folds && rng.chance(BY_AREA) {
        true => facing(model, finger, world_from_object, rng)?,
        false => from_within(model, finger, world_from_object, rng)?,
    };
    let finger_model = &model.fingers[finger];
    let rough = Contact { point_in_object: hit.point_in_object, normal_in_object: hit.normal_in_object };
    if !finger_model.may_reach(world_from_object, &rough) {
        return None;
    }
    let hit = object.surface.settle_counted(&hit, finger_model.settle_radius, n_measured)?;
    if !model.keeps_off_edges(&hit) {
        return None;
    }
    Some(Contact { point_in_object: hit.point_in_object, normal_in_object: hit.normal_in_object })
}

/// Share of draws by area on objects that fold. By hand.
const BY_AREA: f64 = 0.5;

/// A point drawn by area that faces `finger`'s working place: what lies behind a hollow, and rays from within leave elsewhere.
fn facing(model: &Model, finger: usize, world_from_object: &Placement, rng: &mut Rng) -> Option<SurfacePoint> {
    let hit = model.view.object.surface.sample(rng);
    let towards = world_from_object.point_to_child(&model.fingers[finger].tip_at_rest) - hit.point_in_object;
    (towards.dot(&hit.normal_in_object) > 0.0).then_some(hit)
}

/// A point in which a ray from within the object, drawn towards `finger`'s working place, leaves it.
fn from_within(model: &Model, finger: usize, world_from_object: &Placement, rng: &mut Rng) -> Option<SurfacePoint> {
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
    Some(exits.swap_remove(chosen))
}

/// Draws a contact uniformly by the area of the object's surface that `finger` may reach (Sahbani 2007, sec. IV-B: a facet by
/// its area, a point on it). None when none of some draws will do, or the work allowed is spent.
pub fn draw_contact_by_area(
    workspace: &mut Workspace,
    finger: usize,
    world_from_object: &Placement,
    rng: &mut Rng,
) -> Option<Contact> {
    if workspace.is_spent_on_draws() {
        return None;
    }
    let (object, finger_model) = (&workspace.model.view.object, &workspace.model.fingers[finger]);
    let mut n_measured = 0;
    let mut found = None;
    for _ in 0..RAYS {
        let drawn = object.surface.sample(rng);
        let rough = Contact { point_in_object: drawn.point_in_object, normal_in_object: drawn.normal_in_object };
        if !finger_model.may_reach(world_from_object, &rough) {
            continue;
        }
        let settled = object.surface.settle_counted(&drawn, finger_model.settle_radius, &mut n_measured);
        if let Some(settled) = settled.filter(|settled| workspace.model.keeps_off_edges(settled)) {
            let (point_in_object, normal_in_object) = (settled.point_in_object, settled.normal_in_object);
            found = Some(Contact { point_in_object, normal_in_object });
            break;
        }
    }
    let free = if found.is_some() { MEASURED_FREE } else { 0 };
    workspace.count_draws(n_measured.saturating_sub(free) / MEASURED_PER_WORK);
    found
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
    is_usable(workspace, finger, contact, &joints, world_from_object).then_some(joints)
}

/// Draws in vain after which a finger that closes is taken to find no more.
const MISSES: usize = 2;

/// Draws contacts of `finger` that it can take, with its joints there: up to `n_wanted`, each given to `found`. Fingers that reach no points
/// find theirs by closing; where only a grasp is asked for ([`Workspace::all_close`]) the others do so by turns: beside a large object hardly any
/// posture that is drawn for a contact is clear, and a finger that closes comes from where it is.
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
    if workspace.model.fingers[finger].closes() {
        let mut n_missed = 0;
        while n_found < n_wanted && n_missed < MISSES {
            match draw_touch(workspace, finger, world_from_object, rng) {
                Some((contact, joints)) => {
                    found(contact, joints);
                    n_found += 1;
                }
                None => n_missed += 1,
            }
        }
        return;
    }
    for index in 0..8 * n_wanted {
        if n_found == n_wanted {
            return;
        }
        if workspace.all_close && index % 2 == 1 {
            if let Some((contact, joints)) = draw_touch(workspace, finger, world_from_object, rng) {
                found(contact, joints);
                n_found += 1;
            }
            continue;
        }
        let Some(contact) = draw_contact(workspace, finger, world_from_object, rng) else { continue };
        let Some(joints) = reach(workspace, finger, &contact, world_from_object, rng) else { continue };
        found(contact, joints);
        n_found += 1;
    }
}
