//! The relocation of one finger while the others hold the object still: off along the normal, over, down along the
//! normal (Saut 2011, sec. 4.2.3).

/// The part in the air.
pub mod air;
/// Straight ways.
mod straight;

pub use straight::straightened;

use crate::model::Model;
use crate::passing::PassingOver;
use crate::rolling::follow::ik_settings;
use crate::workspace::{TipMode, Workspace};
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_roadmap::rrt_connect::{RrtConnect, RrtSettings};
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings};

/// Longest step of a joint along a joint line, in radians or metres.
const JOINT_LINE_STEP: f64 = 0.08;

/// Distance that a free finger keeps from its joint limits: less than a holding one, so that it can get away.
const FREE_LIMIT_MARGIN: f64 = 1e-4;

/// Inverse kinematics of a finger that is on its way.
fn free_ik_settings(model: &Model, finger: usize, normal_in_world: UnitVector) -> IkSettings {
    IkSettings { limit_margin: FREE_LIMIT_MARGIN, ..ik_settings(model, finger, normal_in_world) }
}

/// True when `finger` can leave its contact, with everything where `workspace` has it; it is left anywhere.
pub fn can_lift(workspace: &mut Workspace, world_from_object: &Pose, finger: usize, from: &Foothold) -> bool {
    let placement = Placement::from(world_from_object);
    lift(workspace, &placement, finger, from, LEAST_LIFT).is_some()
}

/// True when the finger's joints let it leave a foothold at all, whatever is in the way.
pub fn lift_is_within_reach(model: &Model, world_from_object: &Placement, finger: usize, from: &Foothold) -> bool {
    let Some(contact) = from.contact else { return true };
    hover(model, world_from_object, finger, contact, from.joints, LEAST_LIFT).is_some()
}

/// Joints of `finger` at `height` over `contact`, near those that it has there.
pub fn hover(
    model: &Model,
    world_from_object: &Placement,
    finger: usize,
    contact: &Contact,
    joints: &Coordinates,
    height: f64,
) -> Option<Coordinates> {
    let normal = world_from_object.vector(&contact.normal_in_object);
    let tip = model.fingers[finger].center_touching(world_from_object, contact, joints);
    if model.fingers[finger].closes() {
        let mut hovering = joints.clone();
        for _ in 0..HOVER_STEPS {
            hovering = push(model, finger, &hovering, &normal, height / HOVER_STEPS as f64)?;
        }
        return Some(hovering);
    }
    let settings = free_ik_settings(model, finger, UnitVector::new_unchecked(normal));
    model.fingers[finger].ik.solve_near(&(tip + normal * height), joints, &settings)
}

/// Joints of a finger that reaches no points after a step of its tip away from a contact with the outward normal `normal`, as straight as it
/// can.
fn push(model: &Model, finger: usize, joints: &Coordinates, normal: &Vector, height: f64) -> Option<Coordinates> {
    model.fingers[finger].ik.push(joints, normal, height, (FREE_LIMIT_MARGIN, STEEPEST_LIFT))
}

/// Steps in which a finger that reaches no points comes to a height.
const HOVER_STEPS: usize = 4;

/// Largest way beside the normal per way along it of a lift of such a finger: the tangent of 50 degrees, where checks allow 60.
const STEEPEST_LIFT: f64 = 1.19;

/// Height that counts as having left, in metres.
const LEAST_LIFT: f64 = 0.001;

/// One end of a relocation.
#[derive(Debug, Clone)]
pub struct Foothold<'a> {
    /// The contact; None where the finger is free.
    pub contact: Option<&'a Contact>,
    /// Joints of the finger there.
    pub joints: &'a Coordinates,
}

/// Moves `finger` from one foothold to another, with everything else where `workspace` has it.
///
/// RRT-Connect is tried at the first height only that both ends can be lifted to: it seldom finds lower what it did not
/// find there. Returns the joints after the start, the last ones being exactly those of the goal. The workspace is left
/// with the finger anywhere.
pub fn relocate(
    workspace: &mut Workspace,
    world_from_object: &Pose,
    finger: usize,
    from: Foothold,
    to: Foothold,
    rng: &mut Rng,
) -> Option<Vec<Coordinates>> {
    let model = workspace.model;
    if to.contact.is_some_and(|contact| !model.may_land(contact)) {
        return None;
    }
    let placement = Placement::from(world_from_object);
    let mut may_go_around = true;
    for &height in &model.settings.lift_heights {
        let Some(up) = lift(workspace, &placement, finger, &from, height) else { continue };
        let Some(mut down) = lift(workspace, &placement, finger, &to, height) else { continue };
        let mode = TipMode::Away { finger, clearance: tip_clearance(model, height) };
        // A free finger is above already; a contact is the last to be reached.
        let above_start = up.last().unwrap_or(from.joints).clone();
        let (above_goal, landing) = match down.pop() {
            Some(above) => (above, Some(to.joints.clone())),
            None => (to.joints.clone(), None),
        };
        let mut over = match workspace.passing_over {
            PassingOver::SurfaceFirst => {
                pass_over(workspace, &placement, finger, &above_start, &above_goal, height, mode)
            }
            PassingOver::RrtOnly => None,
        };
        if over.is_none() && std::mem::take(&mut may_go_around) {
            over = around(workspace, finger, &above_start, &above_goal, mode, rng);
            workspace.rrt_runs.all += 1;
            workspace.rrt_runs.failed += u64::from(over.is_none());
        }
        let Some(over) = over else { continue };
        let mut path = up;
        path.extend(over);
        down.reverse();
        path.extend(down);
        path.extend(landing);
        return Some(path);
    }
    None
}

/// Clearance of a free tip that passes at `height`.
fn tip_clearance(model: &Model, height: f64) -> f64 {
    model.settings.clearance.min(0.5 * height)
}

/// Joints after the contact, from it straight up along the normal; the last ones are at `height` and clear. None at all from
/// a free posture, which must be clear.
fn lift(
    workspace: &mut Workspace,
    world_from_object: &Placement,
    finger: usize,
    foothold: &Foothold,
    height: f64,
) -> Option<Vec<Coordinates>> {
    let model = workspace.model;
    let clear = TipMode::Away { finger, clearance: tip_clearance(model, height) };
    let Some(contact) = foothold.contact else {
        workspace.set_finger(finger, foothold.joints);
        return workspace.finger_is_clear(finger, clear).then(Vec::new);
    };
    let normal = world_from_object.vector(&contact.normal_in_object);
    let base =
        world_from_object.point(&contact.point_in_object) - model.fingers[finger].arm_with(foothold.joints, &normal);
    let mode = TipMode::Near { finger, normal_in_world: normal };
    // No turning of the finger here: it would move the tip sideways between waypoints, over the surface.
    let settings =
        IkSettings { preference: None, ..free_ik_settings(model, finger, UnitVector::new_unchecked(normal)) };
    workspace.set_finger(finger, foothold.joints);
    // Short steps near the contact: between waypoints joints move linearly and the tip strays sideways with the square of
    // the step, which must not be a slide over the surface.
    let n_steps = 2 * (height / model.settings.step).ceil().max(1.0) as usize;
    let mut path = Vec::with_capacity(n_steps);
    let mut joints = foothold.joints.clone();
    for k in 1..=n_steps {
        let target = base + normal * (height * (k as f64 / n_steps as f64).powi(2));
        joints = match model.fingers[finger].closes() {
            true => push(model, finger, &joints, &normal, height * (2 * k - 1) as f64 / (n_steps * n_steps) as f64)?,
            false => model.fingers[finger].ik.solve_near(&target, &joints, &settings)?,
        };
        if !workspace.step_finger(finger, &joints, mode) {
            return None;
        }
        path.push(joints.clone());
    }
    workspace.finger_is_clear(finger, clear).then_some(path)
}

/// From above one contact to above the other: along the surface, else straight in the joints.
fn pass_over(
    workspace: &mut Workspace,
    world_from_object: &Placement,
    finger: usize,
    start: &Coordinates,
    goal: &Coordinates,
    height: f64,
    mode: TipMode,
) -> Option<Vec<Coordinates>> {
    slide(workspace, world_from_object, finger, start, goal, height, mode).or_else(|| {
        let mut path = Vec::new();
        workspace.set_finger(finger, start);
        joint_line(workspace, finger, start, goal, mode, &mut path).then_some(path)
    })
}

/// Follows the surface at `height`: the tip turns about the object's centre of mass and is pushed out where it comes
/// too low. None for fingers that reach no points.
fn slide(
    workspace: &mut Workspace,
    world_from_object: &Placement,
    finger: usize,
    start: &Coordinates,
    goal: &Coordinates,
    height: f64,
    mode: TipMode,
) -> Option<Vec<Coordinates>> {
    let model = workspace.model;
    if model.fingers[finger].closes() {
        return None;
    }
    let ik = &model.fingers[finger].ik;
    let away = model.fingers[finger].tip_radius + height;
    let center = model.frame.center_of_mass;
    let arm = |joints: &Coordinates| world_from_object.point_to_child(&ik.tip(joints)) - center;
    let (first, last) = (arm(start), arm(goal));
    let (first_length, last_length) = (first.norm(), last.norm());
    let angle = first.angle(&last);
    if !(angle < 2.6) || first_length == 0.0 || last_length == 0.0 {
        return None;
    }
    let length = angle * first_length.max(last_length) + (first_length - last_length).abs();
    let n_steps = (length / (1.5 * model.settings.step)).ceil().max(1.0) as usize;
    workspace.set_finger(finger, start);
    let mut path = Vec::with_capacity(n_steps + 1);
    let mut joints = start.clone();
    for k in 1..n_steps {
        let t = k as f64 / n_steps as f64;
        let direction = turned(&(first / first_length), &(last / last_length), angle, t);
        let mut tip = center + direction * (first_length + t * (last_length - first_length));
        let normal = push_out(model, &mut tip, away)?;
        let settings = free_ik_settings(model, finger, UnitVector::new_unchecked(world_from_object.vector(&normal)));
        joints = ik.solve_near(&world_from_object.point(&tip), &joints, &settings)?;
        if !workspace.step_finger(finger, &joints, mode) {
            return None;
        }
        path.push(joints.clone());
    }
    joint_line(workspace, finger, &joints, goal, mode, &mut path).then_some(path)
}

/// Direction at share `t` of the turn from `from` to `to`, unit vectors `angle` apart.
fn turned(from: &Vector, to: &Vector, angle: f64, t: f64) -> Vector {
    if angle < 1e-9 {
        return *from;
    }
    (from * ((1.0 - t) * angle).sin() + to * (t * angle).sin()) / angle.sin()
}

/// Moves `tip` (object frame) out to the distance `away` from the surface if it is nearer; the direction of the surface.
fn push_out(model: &Model, tip: &mut Point, away: f64) -> Option<Vector> {
    let surface = &model.view.object.surface;
    for _ in 0..4 {
        let (foot, distance) = surface.project_signed(tip);
        let outward =
            if distance > 1e-6 { (*tip - foot.point_in_object) / distance } else { foot.normal_in_object.into_inner() };
        if distance >= away - 1e-6 {
            return Some(outward);
        }
        *tip = foot.point_in_object + outward * away;
    }
    None
}

/// Straight in the joints; appends the joints after the start.
fn joint_line(
    workspace: &mut Workspace,
    finger: usize,
    start: &Coordinates,
    goal: &Coordinates,
    mode: TipMode,
    path: &mut Vec<Coordinates>,
) -> bool {
    let ik = &workspace.model.fingers[finger].ik;
    let largest = start.iter().zip(goal).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
    let tip_motion = (ik.tip(goal) - ik.tip(start)).norm();
    let n_steps = (largest / JOINT_LINE_STEP).max(tip_motion / (2.0 * workspace.model.settings.step)).ceil().max(1.0);
    for k in 1..=n_steps as usize {
        let t = k as f64 / n_steps;
        let joints: Coordinates =
            if t >= 1.0 { goal.clone() } else { start.iter().zip(goal).map(|(a, b)| a + t * (b - a)).collect() };
        if !workspace.step_finger(finger, &joints, mode) {
            return false;
        }
        path.push(joints);
    }
    true
}

/// By RRT-Connect in the finger's joints.
fn around(
    workspace: &mut Workspace,
    finger: usize,
    start: &Coordinates,
    goal: &Coordinates,
    mode: TipMode,
    rng: &mut Rng,
) -> Option<Vec<Coordinates>> {
    let model = workspace.model;
    let chain = model.fingers[finger].ik.chain();
    let margin = FREE_LIMIT_MARGIN;
    let lower: Vec<f64> = chain.lower.iter().zip(start).map(|(l, q)| (l + margin).max(q - 3.2)).collect();
    let upper: Vec<f64> = chain.upper.iter().zip(start).map(|(u, q)| (u - margin).min(q + 3.2)).collect();
    let settings = RrtSettings { max_iterations: workspace.rrt_iterations, ..RrtSettings::default() };
    let as_joints = |q: &[f64]| -> Coordinates { q.iter().copied().collect() };
    let corners = RrtConnect::new().plan(start, goal, [&lower, &upper], &settings, rng, |from, to| {
        workspace.set_finger(finger, &as_joints(from));
        // The limits of sums hold between configurations that keep them.
        chain.within_linear_limits(to, 0.0)
            && chain.within_linear_limits(from, 0.0)
            && joint_line(workspace, finger, &as_joints(from), &as_joints(to), mode, &mut Vec::new())
    })?;
    let mut path = Vec::new();
    workspace.set_finger(finger, start);
    for pair in corners.windows(2) {
        if !joint_line(workspace, finger, &as_joints(&pair[0]), &as_joints(&pair[1]), mode, &mut path) {
            return None;
        }
    }
    Some(path)
}
