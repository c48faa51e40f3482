//! The plan as it is written to a file.

use crate::tracking::forces::Forces;
use crate::tracking::gaiting::{Move, Relocation};
use crate::tracking::grasp::{PerFinger, TrackingGrasp};
use crate::tracking::settings::TrackingSettings;
use crate::tracking::step::{MOST_BENT_IN_SEGMENT, Relative, Roles, Stepper, TrackingStep, each};
use regrasp_geometry::Vector;
use regrasp_manipulation::model::Model;
use regrasp_manipulation::recording::plan::plan_of;
use regrasp_manipulation::timing;
use regrasp_manipulation::tolerances::{CONTACT_TOLERANCE, SLIP_TOLERANCE};
use regrasp_plan::plan::{
    ContactMode, ContactState, Plan, PoseData, Promises, Segment, SegmentKind, Statistics, TrackingPromises, Waypoint,
};
use regrasp_scene::TrackingQuery;
use regrasp_scene::query::TRACKING;

/// Settings as plans have them.
pub fn settings_of(settings: &TrackingSettings) -> serde_json::Value {
    serde_json::to_value(settings).unwrap_or_default()
}

/// What becomes a segment.
enum Stretch<'s> {
    /// Steps in a row with the same roles, modes and times, from `start`.
    Tracked { start: &'s TrackingGrasp, steps: Vec<&'s TrackingStep> },
    /// A finger goes through the air.
    Relocated(&'s Relocation),
}

impl Stretch<'_> {
    /// Closure margin of what holds while a finger goes through the air.
    fn margin(&self) -> Option<f64> {
        match self {
            Stretch::Tracked { .. } => None,
            Stretch::Relocated(relocation) => Some(relocation.margin),
        }
    }

    /// Least time from waypoint to waypoint, in seconds.
    fn least_span(&self) -> f64 {
        match self {
            Stretch::Tracked { steps, .. } => steps[0].seconds,
            Stretch::Relocated(_) => timing::LEAST_SPAN,
        }
    }
}

/// Makes the plan of `steps`, which begin at `start`.
pub fn record(
    stepper: &Stepper,
    query: &TrackingQuery,
    seed: u64,
    (start, forces_at_rest): &(TrackingGrasp, Forces),
    moves: &[&Move],
    statistics: Statistics,
) -> Plan {
    let (model, settings) = (stepper.model, stepper.settings);
    let stretches = stretches(start, moves);
    let mut segments: Vec<Segment> = stretches.iter().map(|stretch| segment(stepper, stretch)).collect();
    if segments.is_empty() {
        segments.push(at_rest(stepper, start, forces_at_rest));
    }
    let motion = timing::limits(model);
    timing::assign_times(model, &motion, &mut segments, |index| {
        stretches.get(index).map_or(settings.time_step, Stretch::least_span)
    });
    for (segment, stretch) in segments.iter_mut().zip(&stretches) {
        if let Stretch::Tracked { steps, .. } = stretch {
            add_velocities(segment, steps);
        }
    }
    let margins: Vec<f64> = stretches.iter().filter_map(Stretch::margin).collect();
    let kept_margin = margins.iter().copied().fold(f64::INFINITY, f64::min);
    // Closure is promised where fingers go through the air.
    let (required_margin, kept_margin) =
        if margins.is_empty() { (0.0, 0.0) } else { (model.settings.closure_margin, kept_margin) };
    let promises = Promises {
        contact_tolerance: CONTACT_TOLERANCE,
        friction: model.frame.friction,
        required_margin,
        kept_margin,
        torque_scale: model.frame.torque_scale,
        friction_margin: model.settings.friction_margin,
        slip_tolerance: SLIP_TOLERANCE,
        tracking: Some(TrackingPromises {
            goal_tolerance: settings.goal_tolerance,
            sliding_friction: model.view.object.friction,
        }),
        motion,
        forces: Some(stepper.forces.promises()),
    };
    let plan = plan_of(
        model.view,
        TRACKING,
        [&query.world_from_object_start, &query.world_from_object_goal],
        promises,
        segments,
    );
    Plan {
        method: settings.method.name().into(),
        seed,
        settings: settings_of(settings),
        statistics: Statistics { relocations: plan.n_relocations(), ..statistics },
        ..plan
    }
}

fn stretches<'s>(start: &'s TrackingGrasp, moves: &[&'s Move]) -> Vec<Stretch<'s>> {
    let mut stretches: Vec<Stretch> = Vec::new();
    let mut here = start;
    for &one in moves {
        match (one, stretches.last_mut()) {
            (Move::Relocation(relocation), _) => stretches.push(Stretch::Relocated(relocation)),
            (Move::Step(step), Some(Stretch::Tracked { steps, .. })) if goes_on(steps, step) => steps.push(step),
            (Move::Step(step), _) => stretches.push(Stretch::Tracked { start: here, steps: vec![step] }),
        }
        here = one.end();
    }
    stretches
}

/// True where `step` has the roles, modes and time of the steps before.
fn goes_on(steps: &[&TrackingStep], step: &TrackingStep) -> bool {
    let bent: f64 = steps.iter().map(|one| one.end.bent).sum();
    steps.last().is_some_and(|last| {
        bent + step.end.bent <= MOST_BENT_IN_SEGMENT
            && last.roles == step.roles
            && last.seconds == step.seconds
            && last.relative.iter().zip(&step.relative).all(|(a, b)| a.mode == b.mode)
    })
}

fn segment(stepper: &Stepper, stretch: &Stretch) -> Segment {
    match stretch {
        Stretch::Tracked { start, steps } => tracked(stepper, start, steps),
        Stretch::Relocated(relocation) => relocation.segment.clone(),
    }
}

fn tracked(stepper: &Stepper, start: &TrackingGrasp, steps: &[&TrackingStep]) -> Segment {
    let mut here = start;
    let mut waypoints = Vec::with_capacity(1 + steps.len());
    for (index, step) in steps.iter().enumerate() {
        let forces = stepper.best_forces_at_start(here, step);
        waypoints.push(waypoint(stepper, here, &step.relative, &forces));
        if index + 1 == steps.len() {
            let forces = stepper.best_forces_at_end(here, step);
            waypoints.push(waypoint(stepper, &step.end, &step.relative, &forces));
        }
        here = &step.end;
    }
    tracking_segment(stepper.model, &steps[0].roles, waypoints)
}

/// A segment of tracking in which the fingers have these roles.
fn tracking_segment(model: &Model, roles: &Roles, waypoints: Vec<Waypoint>) -> Segment {
    let name = |finger: usize| model.view.hand.fingers[finger].name.clone();
    let mut moving = each(roles.moving).map(name);
    Segment {
        kind: SegmentKind::Tracking,
        moving_finger: moving.next(),
        also_moving: moving.collect(),
        held_by: Vec::new(),
        rolling_finger: Some(name(roles.rolling)),
        waypoints,
    }
}

/// The start holds still: it is the goal.
fn at_rest(stepper: &Stepper, start: &TrackingGrasp, forces: &Forces) -> Segment {
    let relative: PerFinger<Relative> = start.touches.iter().map(|_| Relative::STILL).collect();
    let waypoint = waypoint(stepper, start, &relative, forces);
    tracking_segment(stepper.model, &Roles { moving: 1, rolling: 1 }, vec![waypoint.clone(), waypoint])
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
        let hand = &model.view.hand;
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
        joint_velocities: vec![0.0; model.view.hand.n_joints()],
        joint_torques,
        world_from_object: PoseData::from(&object.to_pose()),
        contacts,
    }
}

/// Relative velocities, now that the times are known: those of the way to the next waypoint, at the last of that to it.
fn add_velocities(segment: &mut Segment, steps: &[&TrackingStep]) {
    let times: Vec<f64> = segment.waypoints.iter().map(|waypoint| waypoint.time).collect();
    for (k, waypoint) in segment.waypoints.iter_mut().enumerate() {
        let step = k.min(steps.len() - 1);
        let seconds = times[step + 1] - times[step];
        for (state, relative) in waypoint.contacts.iter_mut().zip(&steps[step].relative) {
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
