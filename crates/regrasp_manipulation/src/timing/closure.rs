//! Whether a grasp still closes where its joints stray from their chords.
//!
//! The search tests closure halfway on the chords. Timing lets joints stray from them, so contacts that roll are elsewhere.
//! Only grasps near the required margin can lose it that way; a plan was seen to lose 0.8 % of its margin.

use crate::grasp::state::{Contacts, no_contact};
use crate::model::Model;
use crate::recording::waypoint::{contact_of, joints_of};
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::frame::interpolate_pose;
use regrasp_plan::plan::{ContactMode, Segment, SegmentKind, Waypoint};

/// Steps are looked at where a grasp at either end has a margin below this multiple of the required one.
const NEAR: f64 = 1.1;
/// A chord shorter than this is none.
const RESTS: f64 = 1e-9;

/// True where the fingers that hold close the object halfway in every step of the segment, as it is timed.
pub(super) fn is_closed_between(model: &Model, segment: &Segment) -> bool {
    segment.kind != SegmentKind::Transfer
        || segment.waypoints.windows(2).all(|pair| is_step_closed(model, &pair[0], &pair[1]))
}

fn is_step_closed(model: &Model, from: &Waypoint, to: &Waypoint) -> bool {
    if !from.contacts.iter().any(|contact| contact.mode == ContactMode::Rolling) {
        return true;
    }
    let required = model.settings.closure_margin;
    let near = |waypoint: &Waypoint| {
        let (contacts, holding) = grasp_of(waypoint);
        model.closure_margin_up_to(&contacts, holding, NEAR * required) < NEAR * required
    };
    if !near(from) && !near(to) {
        return true;
    }
    let halfway = halfway(from, to);
    let object = Placement::from(&Pose::from(&halfway.world_from_object));
    let joints = joints_of(model, &halfway);
    let (mut contacts, holding) = grasp_of(from);
    let surface = &model.view.object.surface;
    for (finger, state) in from.contacts.iter().enumerate() {
        if state.mode == ContactMode::Rolling {
            // A tip that is nowhere near has no contact, and nothing closes.
            let Some((contact, _)) = model.fingers[finger].contact_at(surface, &joints[finger], &object) else {
                return false;
            };
            contacts[finger] = contact;
        }
    }
    model.closure_margin(&contacts, holding) >= required
}

/// Contacts of a waypoint, and the fingers that have one.
fn grasp_of(waypoint: &Waypoint) -> (Contacts, u32) {
    let (mut contacts, mut holding) = (Contacts::new(), 0);
    for (finger, state) in waypoint.contacts.iter().enumerate() {
        let contact = contact_of(state);
        holding |= u32::from(contact.is_some()) << finger;
        contacts.push(contact.unwrap_or_else(no_contact));
    }
    (contacts, holding)
}

/// The middle of a step in time: `docs/reference/plan-format.md`, Time.
fn halfway(from: &Waypoint, to: &Waypoint) -> Waypoint {
    let time = to.time - from.time;
    let chord: Vec<f64> = from.joints.iter().zip(&to.joints).map(|(a, b)| b - a).collect();
    let squared = chord.iter().map(|change| change * change).sum::<f64>();
    let slope = |velocities: &[f64]| {
        let along = velocities.iter().zip(&chord).map(|(v, change)| v * change).sum::<f64>();
        if squared > RESTS * RESTS { time * along / squared } else { 1.0 }
    };
    let sigma = 0.5 + (slope(&from.joint_velocities) - slope(&to.joint_velocities)) / 8.0;
    let bend = |k: usize| time * (from.joint_velocities[k] - to.joint_velocities[k]) / 8.0;
    let joints = (0..chord.len()).map(|k| from.joints[k] + 0.5 * chord[k] + bend(k)).collect();
    let pose = interpolate_pose(&Pose::from(&from.world_from_object), &Pose::from(&to.world_from_object), sigma);
    Waypoint { joints, world_from_object: (&pose).into(), ..from.clone() }
}
