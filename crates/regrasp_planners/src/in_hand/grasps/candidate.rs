//! Contacts that a finger could take, and how far it could follow with them.

use arrayvec::ArrayVec;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, UnitVector, interpolate_pose};
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::state::{GraspState, MAX_FINGERS};
use regrasp_manipulation::rolling::follow::ik_settings;
use regrasp_manipulation::rolling::step::RollStep;
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings};

/// Moments of the way to the target at which a finger is asked whether it can still follow.
const LOOK_AHEAD: usize = 6;

/// Largest change of a joint between such moments.
const LOOK_AHEAD_STEP: f64 = 1.0;

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
    stays: bool,
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
        Way { from: Placement::from(from), moments, stays: from == to }
    }

    /// True where the object stays where it is.
    pub fn stays(&self) -> bool {
        self.stays
    }
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
            if !rolled.keeps_off_edges(model, &contact) {
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

/// Which candidate each finger takes.
pub type Choice = ArrayVec<usize, MAX_FINGERS>;
