//! Beyond Cherif 1999: where tracking gets no farther, as a finger is out of reach or no forces balance the weight, one finger is
//! relocated through the air while the others hold, and tracking goes on (`method = "tracking+gaiting"`).
//!
//! The relocation is one of in-hand planning (Saut 2011, sec. 4.2.3): off along the normal, over, down along the normal, with
//! the others closed and their forces within their cones. Which finger lands where is found by looking ahead: of some
//! footholds of every finger that may leave, that one is taken from which tracking leads farthest towards the goal.

use crate::tracking::forces::Choice;
use crate::tracking::grasp::{TrackingGrasp, turn_to};
use crate::tracking::local::Local;
use crate::tracking::step::{Stepper, TrackingStep};
use nalgebra::UnitQuaternion;
use regrasp_grasp::Contact;
use regrasp_manipulation::forces::along::add_forces;
use regrasp_manipulation::grasp::contact::draw_footholds;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::model::{Model, releasable};
use regrasp_manipulation::recording::recorder::{Joins, Recorder};
use regrasp_manipulation::relocation::{Foothold, relocate};
use regrasp_plan::plan::Segment;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Footholds of each finger that tracking is tried from. By hand.
const FOOTHOLDS: usize = 4;
/// Turn towards the goal that is looked ahead for, in radians: what the local planner has time for. By hand.
const LOOK_AHEAD: f64 = 0.2;
/// Share of what tracking gains that counts where no finger may leave any more in the end. By hand.
const STUCK: f64 = 0.3;
/// Share of its reach that a finger keeps to on its way through the air: joints move linearly between waypoints, tips do not.
const AIR_REACH: f64 = 0.98;

/// A motion of a tracking plan.
#[derive(Debug, Clone)]
pub enum Move {
    /// All fingers touch, one moves.
    Step(Box<TrackingStep>),
    /// One finger goes through the air.
    Relocation(Box<Relocation>),
}

impl Move {
    /// The grasp that it ends in.
    pub fn end(&self) -> &TrackingGrasp {
        match self {
            Move::Step(step) => &step.end,
            Move::Relocation(relocation) => &relocation.end,
        }
    }
}

impl From<TrackingStep> for Move {
    fn from(step: TrackingStep) -> Self {
        Move::Step(Box::new(step))
    }
}

/// A finger went through the air to another contact.
#[derive(Debug, Clone)]
pub struct Relocation {
    /// As plans have it, with forces, without times.
    pub segment: Segment,
    /// Closure margin of the fingers that hold.
    pub margin: f64,
    /// The grasp at its end.
    pub end: TrackingGrasp,
}

/// A grasp that differs in one finger.
struct Change {
    finger: usize,
    grasp: TrackingGrasp,
    /// Steps from there towards the goal.
    steps: Vec<TrackingStep>,
    /// Angle gained by them, less where they end in a grasp that no finger may leave.
    worth: f64,
}

/// Relocates the finger by which tracking from `from` then comes farthest towards `goal`, and tracks so far. None where nothing
/// leads nearer.
pub fn change_grasp(local: &mut Local, from: &TrackingGrasp, goal: &UnitQuaternion<f64>) -> Option<Vec<Move>> {
    let mut options = options(local, from);
    let tolerance = local.stepper.settings.goal_tolerance;
    let orientation = from.orientation();
    let left = turn_to(&orientation, goal);
    let target = match left.norm() > LOOK_AHEAD {
        true => UnitQuaternion::from_scaled_axis(left * (LOOK_AHEAD / left.norm())) * orientation,
        false => *goal,
    };
    for option in &mut options {
        option.steps = local.plan(&option.grasp, &target, tolerance, None).steps;
        let end = option.steps.last().map_or(&option.grasp, |step| &step.end);
        let left_then = turn_to(&end.orientation(), goal).norm();
        let gained = left.norm() - left_then;
        let goes_on = left_then <= tolerance || may_leave(local.stepper.model, end) != 0;
        option.worth = if goes_on { gained } else { STUCK * gained };
    }
    options.retain(|option| option.worth > tolerance);
    // Stable: of equal worth the first.
    options.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    options.into_iter().find_map(|option| {
        let relocation = carry_out(local, from, &option)?;
        let mut moves = vec![Move::Relocation(Box::new(relocation))];
        moves.extend(option.steps.into_iter().map(Move::from));
        Some(moves)
    })
}

/// Fingers that may leave a grasp, as bits: the others are closed. None where a finger is on an edge, or near one: in-hand planning
/// holds on faces only.
fn may_leave(model: &Model, grasp: &TrackingGrasp) -> u32 {
    let object = &model.view.object;
    let on_faces = grasp.touches.iter().all(|touch| object.keeps_off_edges(&touch.foot));
    if on_faces { releasable(model, &grasp.contacts(), model.all_fingers()) } else { 0 }
}

/// Some footholds of every finger that may leave.
fn options(local: &mut Local, from: &TrackingGrasp) -> Vec<Change> {
    let Local { stepper, rng, .. } = local;
    let model = stepper.model;
    let leaving = may_leave(model, from);
    let work_before = stepper.workspace.work;
    let state = as_state(from);
    let mut options = Vec::new();
    for finger in (0..model.n_fingers()).filter(|finger| leaving & (1 << finger) != 0) {
        stepper.workspace.set_state(&state);
        let mut footholds: Vec<(Contact, Coordinates)> = Vec::new();
        let found = |contact, joints| footholds.push((contact, joints));
        draw_footholds(&mut stepper.workspace, finger, &from.world_from_object, FOOTHOLDS, rng, found);
        for (contact, joints) in footholds {
            let mut state = state.clone();
            state.set_contact(finger, Some(contact));
            state.joints[finger] = joints;
            let Some(grasp) = TrackingGrasp::of(model, &state) else { continue };
            if is_near(stepper, &grasp.tip_in_world(model, finger), finger)
                && stepper.balanced_at_rest(&grasp, Choice::Any).is_ok()
            {
                options.push(Change { finger, grasp, steps: Vec::new(), worth: 0.0 });
            }
        }
    }
    stepper.work += stepper.workspace.work - work_before;
    options
}

/// True where a tip is so near to where it rests that it may go through the air there.
fn is_near(stepper: &Stepper, tip: &regrasp_geometry::Point, finger: usize) -> bool {
    let model = stepper.model;
    model.view.reach.is_none_or(|reach| (tip - model.fingers[finger].tip_at_rest).norm() <= AIR_REACH * reach)
}

/// The relocation that leads to `option`; none where no way through the air is found, or nothing holds meanwhile.
fn carry_out(local: &mut Local, from: &TrackingGrasp, option: &Change) -> Option<Relocation> {
    let Local { stepper, rng, .. } = local;
    let model = stepper.model;
    let (finger, end) = (option.finger, &option.grasp);
    let pose = from.world_from_object.to_pose();
    let (leaves, lands) = (from.touches[finger].contact(), end.touches[finger].contact());
    let state = as_state(from);
    let work_before = stepper.workspace.work;
    stepper.workspace.set_state(&state);
    let path = relocate(
        &mut stepper.workspace,
        &pose,
        finger,
        Foothold { contact: Some(&leaves), joints: &from.joints[finger] },
        Foothold { contact: Some(&lands), joints: &end.joints[finger] },
        rng,
    );
    stepper.work += stepper.workspace.work - work_before;
    let path = path?;
    if !path.iter().all(|joints| is_near(stepper, &model.fingers[finger].ik.tip(joints), finger)) {
        return None;
    }
    let mut recorder = Recorder::at(model, &state, Joins::Nothing);
    recorder.begin_regrasp(finger, Some(&lands), path.len());
    path.iter().for_each(|joints| recorder.finger_at(finger, joints.iter().copied()));
    recorder.end_regrasp();
    let mut segments = recorder.into_segments();
    add_forces(model, &mut segments).ok()?;
    let margin = model.closure_margin(&from.contacts(), model.all_fingers() & !(1 << finger));
    Some(Relocation { segment: segments.pop()?, margin, end: end.clone() })
}

/// The grasp as in-hand planning has it.
fn as_state(grasp: &TrackingGrasp) -> GraspState {
    GraspState::held_by_all(grasp.world_from_object.to_pose(), grasp.contacts(), grasp.joints.clone())
}
