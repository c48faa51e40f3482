//! A start grasp of the planner's own choice: it knows nothing of the goal.

use crate::tracking::forces::{Choice, Forces};
use crate::tracking::grasp::TrackingGrasp;
use crate::tracking::step::{Beginning, Roles, Stepper};
use nalgebra::Rotation3;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::Contact;
use regrasp_manipulation::ends::end::End;
use regrasp_manipulation::ends::given_grasp::{Near, given_grasp_at};
use regrasp_manipulation::grasp::contact::draw_contact;
use regrasp_manipulation::grasp::state::Contacts;
use regrasp_manipulation::workspace::Workspace;
use regrasp_scene::GraspRequest;

/// Contacts of each finger, and draws for them.
const CONTACTS: usize = 24;
const DRAWS: usize = 400;
/// Combinations of them that are looked at.
const COMBINATIONS: usize = 4000;
/// Grasps that hold, of which the one is taken from which the object turns most freely. By measurement, diamond and football turned
/// by 60 to 94 degrees, 40 starts each: 150 of 160 solved with one, 156 with ten, which take 10 ms.
const GRASPS: usize = 10;
/// Freedom to turn that is enough: no further grasp is looked at. By hand.
const ENOUGH: f64 = 0.6;
/// Angle by which the object is turned to look how freely it turns there, where contacts turn with it.
const TURNED: f64 = 0.9;
/// Fingers that rest where the freedom is looked at. With two there is nearly always some, and it tells nothing.
const MOST_RESTING: usize = 3;

/// A grasp of all fingers with the object at `pose`, clear, closed and with forces that balance the weight: of some drawn by `seed`
/// the one from which the object turns most freely, whatever the direction. Another `attempt` draws others.
pub fn choose_start(stepper: &Stepper, pose: &Pose, seed: u64, attempt: u64) -> Option<(TrackingGrasp, Forces)> {
    let model = stepper.model;
    let mut rng = Rng::keyed(seed, "tracking_start", attempt);
    let of_fingers: Vec<Vec<Contact>> =
        (0..model.n_fingers()).map(|finger| draw_contacts(stepper, pose, finger, &mut rng)).collect();
    if of_fingers.iter().any(Vec::is_empty) {
        return None;
    }
    let mut best: Option<(f64, TrackingGrasp)> = None;
    let mut n_found = 0;
    for _ in 0..COMBINATIONS {
        let contacts: Contacts = of_fingers.iter().map(|contacts| contacts[rng.below(contacts.len())]).collect();
        if model.closure_margin(&contacts, model.all_fingers()) < model.settings.closure_margin {
            continue;
        }
        let points: Vec<Point> = contacts.iter().map(|contact| contact.point_in_object).collect();
        let request = GraspRequest::Contacts(points);
        let Ok(Some(state)) = given_grasp_at(model, End::Start, pose, &request, Near::Rest) else { continue };
        let Some(grasp) = TrackingGrasp::of(model, &state) else { continue };
        if stepper.balanced_at_rest(&grasp, Choice::Any).is_err() {
            continue;
        }
        let worth = freedom(stepper, &grasp);
        n_found += 1;
        if best.as_ref().is_none_or(|(most, _)| worth > *most) {
            best = Some((worth, grasp));
        }
        if n_found == GRASPS || best.as_ref().is_some_and(|(most, _)| *most >= ENOUGH) {
            break;
        }
    }
    let (_, grasp) = best?;
    let forces = stepper.balanced_at_rest(&grasp, Choice::Best).ok()?;
    Some((grasp, forces))
}

/// How freely the object turns: for the direction in which it turns worst, the cosine to the nearest turn for which some roles have
/// forces. On polyhedra the mean over some orientations about that of the start, as fingers stay on their faces; else of the start's.
fn freedom(stepper: &Stepper, grasp: &TrackingGrasp) -> f64 {
    let surface = &stepper.model.view.object.surface;
    // Any will do: three fingers that rest leave one turn, and its direction both ways.
    let oblique = Vector::new(1.0, 0.9, 0.8);
    let both_ways = |roles: Roles| [oblique, -oblique].map(|wanted| stepper.beginning(grasp, roles, &wanted));
    let beginnings: Vec<Beginning> =
        Roles::all(stepper.model.n_fingers(), MOST_RESTING).flat_map(both_ways).flatten().collect();
    let weight = stepper.forces.weight_in_world();
    let freedom_under = |weight: &Vector| {
        let held = beginnings.iter().filter(|beginning| stepper.is_held_under(weight, grasp, beginning));
        freedom_of(&held.map(|beginning| beginning.turn.normalize()).collect::<Vec<Vector>>())
    };
    if !surface.crease_distance(&grasp.touches[0].foot).is_finite() {
        return freedom_under(&weight);
    }
    let axes = [Vector::x(), Vector::y(), Vector::z()];
    let turned =
        axes.iter().flat_map(|axis| [Rotation3::new(axis * TURNED) * weight, Rotation3::new(-axis * TURNED) * weight]);
    let all: Vec<f64> = std::iter::once(weight).chain(turned).map(|weight| freedom_under(&weight)).collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// Of the 26 directions to the neighbours in a grid, for the worst the cosine to the nearest of these turns.
fn freedom_of(turns: &[Vector]) -> f64 {
    let mut least = f64::INFINITY;
    for k in (0..27).filter(|k| *k != 13) {
        let direction = Vector::new(f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1), f64::from(k / 9 - 1)).normalize();
        let nearest = turns.iter().map(|turn| turn.dot(&direction)).fold(0.0, f64::max);
        least = least.min(nearest);
    }
    least
}

/// Contacts on the side of `finger`, with its tip within the reach that the scene gives it.
fn draw_contacts(stepper: &Stepper, pose: &Pose, finger: usize, rng: &mut Rng) -> Vec<Contact> {
    let model = stepper.model;
    let placement = Placement::from(pose);
    let mut workspace = Workspace::new(model);
    let mut found = Vec::with_capacity(CONTACTS);
    for _ in 0..DRAWS {
        let Some(contact) = draw_contact(&mut workspace, finger, &placement, rng) else { continue };
        let tip = model.fingers[finger].center_over(&placement, &contact);
        let away = (tip - model.fingers[finger].tip_at_rest).norm();
        if model.view.reach.is_none_or(|reach| away < INSIDE * reach) {
            found.push(contact);
            if found.len() == CONTACTS {
                break;
            }
        }
    }
    found
}

/// Share of its reach that a finger has used up at the start at most: the rest is for the motion.
const INSIDE: f64 = 0.6;
