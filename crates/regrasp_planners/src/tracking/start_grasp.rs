//! A start grasp of the planner's own choice: it knows nothing of the goal.

use crate::tracking::forces::Forces;
use crate::tracking::grasp::TrackingGrasp;
use crate::tracking::step::Stepper;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose};
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
/// Grasps that hold, of which the one with the largest closure margin is taken.
const GRASPS: usize = 8;

/// A grasp of all fingers with the object at `pose`, clear, closed and with forces that balance the weight: of some drawn by `seed`
/// the one that closes best.
pub fn choose_start(stepper: &Stepper, pose: &Pose, seed: u64) -> Option<(TrackingGrasp, Forces)> {
    let model = stepper.model;
    let mut rng = Rng::keyed(seed, "tracking_start", 0);
    let of_fingers: Vec<Vec<Contact>> =
        (0..model.n_fingers()).map(|finger| draw_contacts(stepper, pose, finger, &mut rng)).collect();
    if of_fingers.iter().any(Vec::is_empty) {
        return None;
    }
    let mut best: Option<(f64, TrackingGrasp, Forces)> = None;
    let mut n_found = 0;
    for _ in 0..COMBINATIONS {
        let contacts: Contacts = of_fingers.iter().map(|contacts| contacts[rng.below(contacts.len())]).collect();
        let margin = model.closure_margin(&contacts, model.all_fingers());
        if margin < model.settings.closure_margin || best.as_ref().is_some_and(|(most, _, _)| margin <= *most) {
            continue;
        }
        let points: Vec<Point> = contacts.iter().map(|contact| contact.point_in_object).collect();
        let request = GraspRequest::Contacts(points);
        let Ok(Some(state)) = given_grasp_at(model, End::Start, pose, &request, Near::Rest) else { continue };
        let Some(grasp) = TrackingGrasp::of(model, &state) else { continue };
        let Ok(forces) = stepper.balanced_at_rest(&grasp) else { continue };
        best = Some((margin, grasp, forces));
        n_found += 1;
        if n_found == GRASPS {
            break;
        }
    }
    best.map(|(_, grasp, forces)| (grasp, forces))
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
const INSIDE: f64 = 0.9;
