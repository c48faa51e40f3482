//! The plan as it is written to a file.

use super::forces::Forces;
use super::grasp::{PerFinger, TrackingGrasp};
use super::settings::{METHOD, TrackingSettings};
use super::step::{Relative, Step, Stepper};
use crate::in_hand::model::Model;
use crate::in_hand::record::{CONTACT_TOLERANCE, SLIP_TOLERANCE, plan_of};
use crate::in_hand::timing;
use regrasp_geometry::Vector;
use regrasp_plan::plan::{
    ContactMode, ContactState, Plan, PoseData, Promises, Segment, SegmentKind, Statistics, TrackingPromises, Waypoint,
};
use regrasp_scene::InHandQuery;

/// Settings as plans have them.
pub fn settings_of(settings: &TrackingSettings) -> serde_json::Value {
    serde_json::to_value(settings).unwrap_or_default()
}

/// Turn aside, half-way in long steps, that a segment adds up: there and back it twists by twice as much, and checkers allow 2e-3.
const MOST_BENT: f64 = 5e-4;

/// Steps in a row with the same roles, modes and times, as one segment from `start`.
struct Stretch<'s> {
    start: &'s TrackingGrasp,
    steps: Vec<&'s Step>,
}

/// Makes the plan of `steps`, which begin at `start`.
pub fn record(
    stepper: &Stepper,
    query: &InHandQuery,
    seed: u64,
    (start, forces_at_rest): &(TrackingGrasp, Forces),
    steps: &[&Step],
    statistics: Statistics,
) -> Plan {
    let (model, settings) = (stepper.model, stepper.settings);
    let stretches = stretches(start, steps);
    let mut segments: Vec<Segment> = stretches.iter().map(|stretch| segment(stepper, stretch)).collect();
    if segments.is_empty() {
        segments.push(at_rest(stepper, start, forces_at_rest));
    }
    let motion = timing::limits(model);
    timing::assign_times(model, &motion, &mut segments, |index| {
        stretches.get(index).map_or(settings.time_step, |stretch| stretch.steps[0].seconds)
    });
    for (segment, stretch) in segments.iter_mut().zip(&stretches) {
        add_velocities(segment, stretch);
    }
    let promises = Promises {
        contact_tolerance: CONTACT_TOLERANCE,
        friction: model.frame.friction,
        required_margin: 0.0,
        kept_margin: 0.0,
        torque_scale: model.frame.torque_scale,
        friction_margin: model.settings.friction_margin,
        slip_tolerance: SLIP_TOLERANCE,
        tracking: Some(TrackingPromises {
            goal_tolerance: settings.goal_tolerance,
            sliding_friction: model.scene.object.friction,
        }),
        motion,
        forces: Some(stepper.forces.promises()),
    };
    Plan {
        method: METHOD.into(),
        seed,
        settings: settings_of(settings),
        statistics,
        ..plan_of(model.scene, query, promises, segments)
    }
}

fn stretches<'s>(start: &'s TrackingGrasp, steps: &[&'s Step]) -> Vec<Stretch<'s>> {
    let mut stretches: Vec<Stretch> = Vec::new();
    let mut here = start;
    let mut bent = 0.0;
    for step in steps {
        bent += step.end.bent;
        let goes_on = stretches.last().and_then(|stretch| stretch.steps.last()).is_some_and(|last| {
            bent <= MOST_BENT
                && last.roles == step.roles
                && last.seconds == step.seconds
                && last.relative.iter().zip(&step.relative).all(|(a, b)| a.mode == b.mode)
        });
        if !goes_on {
            bent = step.end.bent;
            stretches.push(Stretch { start: here, steps: Vec::new() });
        }
        if let Some(stretch) = stretches.last_mut() {
            stretch.steps.push(step);
        }
        here = &step.end;
    }
    stretches
}

fn segment(stepper: &Stepper, stretch: &Stretch) -> Segment {
    let model = stepper.model;
    let roles = stretch.steps[0].roles;
    let name = |finger: usize| Some(model.scene.hand.fingers[finger].name.clone());
    let mut here = stretch.start;
    let mut waypoints = Vec::with_capacity(1 + stretch.steps.len());
    for step in &stretch.steps {
        waypoints.push(waypoint(stepper, here, &step.relative, &step.forces[0]));
        here = &step.end;
    }
    let last = stretch.steps[stretch.steps.len() - 1];
    waypoints.push(waypoint(stepper, here, &last.relative, &last.forces[1]));
    Segment {
        kind: SegmentKind::Tracking,
        moving_finger: name(roles.moving),
        rolling_finger: name(roles.rolling),
        waypoints,
    }
}

/// The start holds still: it is the goal.
fn at_rest(stepper: &Stepper, start: &TrackingGrasp, forces: &Forces) -> Segment {
    let relative: PerFinger<Relative> = start.touches.iter().map(|_| Relative::STILL).collect();
    let waypoint = waypoint(stepper, start, &relative, forces);
    let name = |finger: usize| Some(stepper.model.scene.hand.fingers[finger].name.clone());
    Segment {
        kind: SegmentKind::Tracking,
        moving_finger: name(0),
        rolling_finger: name(1),
        waypoints: vec![waypoint.clone(), waypoint],
    }
}

fn waypoint(stepper: &Stepper, grasp: &TrackingGrasp, relative: &PerFinger<Relative>, forces: &[Vector]) -> Waypoint {
    let model: &Model = stepper.model;
    let object = &grasp.world_from_object;
    let mut joint_torques = Vec::new();
    let mut contacts = Vec::new();
    for (finger, force) in forces.iter().enumerate() {
        let contact = grasp.touches[finger].contact();
        let point_in_world = object.point(&contact.point_in_object);
        joint_torques.extend(stepper.torques(grasp, finger, &point_in_world, &object.vector(force)));
        let normal: [f64; 3] = contact.normal_in_object.into_inner().into();
        let mut state = ContactState::at(relative[finger].mode, contact.point_in_object.coords.into(), normal);
        state.force_in_object = Some((*force).into());
        let hand = &model.scene.hand;
        let body_from_tip = hand.robot.fixed_pose_in_body(hand.fingers[finger].tip.link);
        state.relative_velocity_in_object = Some([0.0; 3]);
        state.relative_turn_in_object = Some([0.0; 3]);
        let point_in_body = grasp.world_from_link[finger].point_to_child(&point_in_world);
        state.point_in_tip = Some(body_from_tip.inverse_transform_point(&point_in_body).coords.into());
        contacts.push(state);
    }
    Waypoint {
        time: 0.0,
        joints: grasp.joints.iter().flatten().copied().collect(),
        joint_velocities: vec![0.0; model.scene.hand.n_joints()],
        joint_torques,
        world_from_object: PoseData::from(&object.to_pose()),
        contacts,
    }
}

/// Relative velocities, now that the times are known: those of the way to the next waypoint, at the last of that to it.
fn add_velocities(segment: &mut Segment, stretch: &Stretch) {
    let times: Vec<f64> = segment.waypoints.iter().map(|waypoint| waypoint.time).collect();
    for (k, waypoint) in segment.waypoints.iter_mut().enumerate() {
        let step = k.min(stretch.steps.len() - 1);
        let seconds = times[step + 1] - times[step];
        for (state, relative) in waypoint.contacts.iter_mut().zip(&stretch.steps[step].relative) {
            let is_still = state.mode == ContactMode::Fixed;
            let (slid, turned) =
                if is_still { (Vector::zeros(), Vector::zeros()) } else { (relative.slid, relative.turned) };
            // What touches slides across the normal of its own moment: so the law of friction can be exact.
            let across = match state.normal_in_object.map(Vector::from).filter(|_| state.mode.slides()) {
                Some(normal) => slid - normal * normal.dot(&slid),
                None => Vector::zeros(),
            };
            state.relative_velocity_in_object = Some((across / seconds).into());
            state.relative_turn_in_object = Some((turned / seconds).into());
        }
    }
}
