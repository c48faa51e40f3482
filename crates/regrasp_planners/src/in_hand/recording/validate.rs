//! Validating a plan once at the planner's resolution: the floor of planning time.
//!
//! This is a measure, not a judge: it shares everything with the planner. The judge is `regrasp_plan::check`.

use crate::settings::InHandSettings;
use regrasp_geometry::Pose;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::in_world::plan_in_hand_frame;
use regrasp_manipulation::model::Model;
use regrasp_manipulation::recording::waypoint::{contact_of, joints_of};
use regrasp_manipulation::relocation::air::{End, ends_of, in_air};
use regrasp_manipulation::workspace::start::distances_to_keep;
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_plan::plan::{Plan, Segment, SegmentKind, Waypoint};
use regrasp_robot::kinematics::finger_ik::Coordinates;
use regrasp_scene::HandView;

/// What could not be proven of a plan at the planner's resolution.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotProven {
    /// Index of the segment.
    pub segment: usize,
    /// Index of the waypoint at which the step ends that was not proven.
    pub waypoint: usize,
    /// What is in the way, in words.
    pub cause: String,
}

impl std::fmt::Display for NotProven {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "not proven at the planner's resolution: segment {}, waypoint {}: ", self.segment, self.waypoint)?;
        f.write_str(&self.cause)
    }
}

impl std::error::Error for NotProven {}

/// Steps through every waypoint of `plan` once, as the planner does: kinematics, collision and closure.
///
/// Errors: the first step that is not proven.
pub fn validate_once(view: &HandView, plan: &Plan, settings: &InHandSettings) -> Result<(), NotProven> {
    let plan = &plan_in_hand_frame(view, plan);
    let mut model = Model::new(view, &settings.physics);
    // A start that the planner chose keeps the clearance; one that was observed keeps what it has.
    let is_observed = plan.asked.is_some();
    if let Some(start) = plan.segments.first().and_then(|segment| segment.waypoints.first()).filter(|_| is_observed) {
        model.kept = distances_to_keep(&model, &state_at(&model, start));
    }
    let mut workspace = Workspace::new(&model);
    for (index, segment) in plan.segments.iter().enumerate() {
        validate_segment(&model, &mut workspace, segment).map_err(|(waypoint, cause)| NotProven {
            segment: index,
            waypoint,
            cause,
        })?;
    }
    Ok(())
}

fn state_at(model: &Model, waypoint: &Waypoint) -> GraspState {
    let pose = Pose::from(&waypoint.world_from_object);
    GraspState::of(pose, waypoint.contacts.iter().map(contact_of).zip(joints_of(model, waypoint)))
}

/// Errors: index of the waypoint and what is wrong with the step to it.
fn validate_segment(model: &Model, workspace: &mut Workspace, segment: &Segment) -> Result<(), (usize, String)> {
    let waypoints = segment.waypoints.as_slice();
    let ends = waypoints.first().zip(waypoints.last());
    let Some((start, end)) = ends.map(|(first, last)| (state_at(model, first), state_at(model, last))) else {
        return Err((0, "the segment has no waypoints".into()));
    };
    let moving = segment.moving_finger.as_ref().and_then(|name| model.view.hand.finger_named(name)).map(|id| id.0);
    let holding = start.holding & !moving.map_or(0, |finger| 1 << finger);
    let margin = model.closure_margin(&start.contacts, holding);
    if margin < model.settings.closure_margin {
        return Err((0, not_closed(model, margin)));
    }
    let pose = start.world_from_object;
    workspace.set_state(&start);
    match (segment.kind, moving) {
        (SegmentKind::Transfer, _) => {
            for (k, waypoint) in waypoints.iter().enumerate().skip(1) {
                let here = state_at(model, waypoint);
                if waypoint.contacts != waypoints[k - 1].contacts {
                    let margin = model.closure_margin(&here.contacts, here.holding);
                    if margin < model.settings.closure_margin {
                        return Err((k, not_closed(model, margin)));
                    }
                    workspace.roll_to(&here.contacts);
                }
                if !workspace.step(&here.world_from_object, &here.joints, TipMode::AllHold)
                    && !is_clear_backwards(workspace, &here, &state_at(model, &waypoints[k - 1]))
                {
                    return Err((k, in_the_way(workspace)));
                }
            }
        }
        (SegmentKind::Regrasp, Some(finger)) => {
            let path: Vec<Coordinates> =
                waypoints.iter().map(|waypoint| joints_of(model, waypoint).remove(finger)).collect();
            let contacts = [start.contact(finger), end.contact(finger)];
            follow_relocation(workspace, &pose, finger, contacts.each_ref().map(Option::as_ref), &path)
                .map_err(|k| (k, in_the_way(workspace)))?;
        }
        (SegmentKind::Regrasp, None) => return Err((0, "a regrasp without a moving finger".into())),
        (SegmentKind::Tracking, _) => return Err((0, "tracking, which this planner does not do".into())),
    }
    Ok(())
}

fn not_closed(model: &Model, margin: f64) -> String {
    format!("closure margin {margin:.4} of {}", model.settings.closure_margin)
}

/// True when the step from `before` to `here` is proven from its end: the search grows a tree from the goal too, whose transfers are
/// proven backwards. A step with a tip that rolls is tested with the contact normals of the end that it leads to, so that one way may
/// be proven where the other is not. The workspace is left at `here`.
fn is_clear_backwards(workspace: &mut Workspace, here: &GraspState, before: &GraspState) -> bool {
    let blocking_pair = workspace.blocking_pair;
    workspace.set_state(here);
    workspace.roll_to(&before.contacts);
    let is_clear = workspace.step(&before.world_from_object, &before.joints, TipMode::AllHold);
    workspace.set_state(here);
    if !is_clear {
        // What stood in the way forwards is what is told.
        workspace.blocking_pair = blocking_pair;
    }
    is_clear
}

/// The bodies that stopped the last step.
fn in_the_way(workspace: &Workspace) -> String {
    workspace.blocking_pair.map_or("a step that is not clear".into(), |pair| {
        let bodies = &workspace.model.bodies;
        format!("\"{}\" comes too close to \"{}\"", bodies[pair.a].name, bodies[pair.b].name)
    })
}

/// Moves `finger` along `path`, which begins where it is, from one contact to another (None: it is free there), everything
/// else being where `workspace` has it. Errors: index of the joints that are not reached.
pub fn follow_relocation(
    workspace: &mut Workspace,
    pose: &Pose,
    finger: usize,
    contacts: [Option<&Contact>; 2],
    path: &[Coordinates],
) -> Result<(), usize> {
    let model = workspace.model;
    let ends = ends_of(model, finger, pose, contacts, path);
    let air = in_air(model, finger, &ends, path);
    for k in 1..path.len() {
        let near = |end: &End| TipMode::Near { finger, normal_in_world: end.normal };
        let mode = match &ends {
            [Some(end), _] if k <= *air.start() => near(end),
            [_, Some(end)] if k > *air.end() => near(end),
            _ => TipMode::Away { finger, clearance: 0.0 },
        };
        if !workspace.step_finger(finger, &path[k], mode) {
            return Err(k);
        }
    }
    Ok(())
}
