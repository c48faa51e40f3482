//! Motions of the object in which soft fingertips do not turn about their contacts' normals.
//!
//! A soft fingertip resists turning about the normal, so it must roll without sliding and without spinning: four conditions on
//! its motion over the object. A finger of three joints has three velocities to meet them with, so the fourth is a condition
//! on the object's twist (shift `v` of its centre of mass and turning rate `w`, in the world). With the contact at `r` from the centre
//! of mass, the finger follows with a velocity `v + w x r` of the point that touches; its link then turns about the normal `n` by
//! `g . (v + w x r)`, where `g` comes from the finger's Jacobian. It does not spin where `g . v + (r x g - n) . w = 0`.
//!
//! `k` such fingers leave the object `6 - k` directions. A transfer goes towards its goal as far as these directions lead
//! ([`pursue`]). It seldom ends exactly there: two transfers with different grasps can meet exactly ([`meet`]), as
//! `k + k'` conditions on their common pose leave a choice for up to six.

/// Transfers that end exactly at their goal, by themselves.
mod arrive;

use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::Model;

use regrasp_manipulation::rolling::step::{NoStep, STEP_SPIN};

use regrasp_manipulation::grasp::state::{GraspState, Moment};

use crate::in_hand::moving::step::{Spins, is_closed, step_joints};

use arrayvec::ArrayVec;

pub use arrive::{Arrival, LOOP_REACH, arrive, arrive_by_loop};

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector6};

use regrasp_geometry::collision::Placement;

use regrasp_geometry::{Pose, Vector, frame};

use regrasp_grasp::Contact;

use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Shift of the centre of mass, and turn times a length, in the world, in metres.
pub type Twist = Vector6<f64>;

/// Corrections of a step by the turns about normals that it leaves.
const CORRECTIONS: usize = 8;

/// Least share of the way wanted that a step must make, else the transfer ends. By hand.
const LEAST_HEADWAY: f64 = 0.15;

/// Way left, as a share of a step, that is not worth another one.
const LEAST_WAY: f64 = 0.02;

/// Most often that a step is halved.
const MAX_HALVINGS: i32 = 4;

/// Steps of a transfer that does not go straight, for each straight one.
const MOST_STEPS: usize = 4;

/// How far from both ends transfers may meet: a multiple of the distance between them, and a distance, in metres. By hand.
const FARTHEST_MEETING: (f64, f64) = (2.5, 0.03);

/// True when some finger of `holding` leaves the object only some directions.
pub fn is_restricted(model: &Model, holding: u32) -> bool {
    (0..model.n_fingers()).any(|finger| holding & (1 << finger) != 0 && model.restricts_motion(finger))
}

/// The twist from one pose of the object to another.
pub fn twist_between(model: &Model, from: &Pose, to: &Pose) -> Twist {
    let center = &model.frame.center_of_mass;
    let shift = to * center - from * center;
    let turn = frame::rotation_between(from, to) * turn_length(model);
    Twist::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Where a twist takes the object.
fn moved(model: &Model, from: &Pose, twist: &Twist) -> Pose {
    let center = &model.frame.center_of_mass;
    let shift = Vector::new(twist[0], twist[1], twist[2]);
    let turn = Vector::new(twist[3], twist[4], twist[5]) / turn_length(model);
    let rotation = UnitQuaternion::from_scaled_axis(turn) * from.rotation;
    let origin = from * center + shift - rotation * center.coords;
    Pose::from_parts(origin.coords.into(), rotation)
}

/// The turn of `finger` about its contact's normal per twist of the object, with the object at `placement`. None near a
/// singularity.
pub fn condition(
    model: &Model,
    finger: usize,
    placement: &Placement,
    contact: &Contact,
    joints: &Coordinates,
) -> Option<Twist> {
    let center = placement.point(&model.frame.center_of_mass);
    let normal = placement.vector(&contact.normal_in_object);
    let point = placement.point(&contact.point_in_object);
    let ik = model.fingers[finger].ik;
    let gradient = ik.turn_per_motion(joints, &(point - ik.tip(joints)), &normal)?;
    let by_turn = ((point - center).cross(&gradient) - normal) / turn_length(model);
    Some(Twist::new(gradient.x, gradient.y, gradient.z, by_turn.x, by_turn.y, by_turn.z))
}

/// Turns about contact normals per twist of the object: one row for each finger that restricts it.
#[derive(Debug, Clone, Default)]
struct Conditions {
    rows: ArrayVec<Twist, { 2 * MAX_FINGERS }>,
}

impl Conditions {
    /// Those of the fingers of `holding`. None where a finger is near a singularity.
    fn of(model: &Model, holding: u32, here: &Moment) -> Option<Self> {
        let placement = Placement::from(&here.world_from_object);
        let mut rows = ArrayVec::new();
        for finger in (0..model.n_fingers()).filter(|&f| holding & (1 << f) != 0 && model.restricts_motion(f)) {
            rows.push(condition(model, finger, &placement, &here.contacts[finger], &here.joints[finger])?);
        }
        Some(Conditions { rows })
    }

    /// Both sets.
    fn and(mut self, others: &Self) -> Self {
        self.rows.extend(others.rows.iter().copied());
        self
    }

    fn turns(&self, twist: &Twist) -> Spins {
        self.rows.iter().map(|row| row.dot(twist)).collect()
    }

    /// The least twist that makes these turns. None where the conditions contradict each other.
    fn least(&self, turns: &[f64]) -> Option<Twist> {
        let n = self.rows.len();
        let square = DMatrix::from_fn(n, n, |i, j| self.rows[i].dot(&self.rows[j]));
        let damping = 1e-9 * square.trace();
        let solved = (square + DMatrix::identity(n, n) * damping).cholesky()?.solve(&DVector::from_row_slice(turns));
        Some(self.rows.iter().zip(solved.iter()).fold(Twist::zeros(), |sum, (row, share)| sum + row * *share))
    }

    /// The part of a twist in which nothing turns about a normal.
    fn project(&self, twist: &Twist) -> Option<Twist> {
        // Twice: what damping leaves of the first.
        let once = twist - self.least(&self.turns(twist))?;
        Some(once - self.least(&self.turns(&once))?)
    }
}

fn are_still(spins: &[f64]) -> bool {
    spins.iter().all(|spin| spin.abs() <= STEP_SPIN)
}

/// The step by `twist`, corrected until nothing turns about a normal.
fn step(model: &Model, holding: u32, here: &Moment, twist: &Twist, conditions: &Conditions) -> Result<Moment, NoStep> {
    let mut twist = *twist;
    for _ in 0..CORRECTIONS {
        let pose = moved(model, &here.world_from_object, &twist);
        let (there, spins) = step_joints(model, holding, here, &pose)?;
        if are_still(&spins) {
            return if is_closed(model, &there, holding) { Ok(there) } else { Err(NoStep::OutOfReach) };
        }
        twist -= conditions.least(&spins).ok_or(NoStep::OutOfReach)?;
    }
    Err(NoStep::TooLong)
}

/// The step to exactly `pose`, if nothing turns about a normal.
fn step_to(model: &Model, holding: u32, here: &Moment, pose: &Pose) -> Option<Moment> {
    let (there, spins) = step_joints(model, holding, here, pose).ok()?;
    (are_still(&spins) && is_closed(model, &there, holding)).then_some(there)
}

/// Moves the object from `start` towards `goal` as far as the hand can follow without turning about normals; as
/// [`crate::in_hand::moving::transfer::follow`] otherwise.
pub fn pursue(
    model: &Model,
    start: &GraspState,
    goal: &Pose,
    moments: &mut Vec<Moment>,
    mut is_clear: impl FnMut(&Moment) -> bool,
) -> f64 {
    let full = model.settings.step;
    let whole = twist_between(model, &start.world_from_object, goal).norm();
    let mut here = start.moment();
    let mut length = full;
    let mut best = whole;
    let mut pushed = 0;
    for _ in 0..MOST_STEPS * ((whole / full).ceil() as usize + 1) {
        let left = twist_between(model, &here.world_from_object, goal);
        let distance = left.norm();
        if distance <= full
            && let Some(there) = step_to(model, start.holding, &here, goal)
        {
            if !is_clear(&there) {
                break;
            }
            moments.push(there);
            return 1.0;
        }
        let Some(conditions) = Conditions::of(model, start.holding, &here) else { break };
        let wanted = left * (length / distance).min(1.0);
        let Some(way) = conditions.project(&wanted) else { break };
        if way.norm() < LEAST_HEADWAY * wanted.norm() || way.norm() < LEAST_WAY * full {
            break;
        }
        match step(model, start.holding, &here, &way, &conditions) {
            Ok(there) if is_clear(&there) => {
                let after = twist_between(model, &there.world_from_object, goal).norm();
                if after >= best {
                    break;
                }
                best = after;
                here = there.clone();
                moments.push(there);
                pushed += 1;
                length = full;
            }
            Err(NoStep::TooLong) if length > full * 0.5f64.powi(MAX_HALVINGS) => length *= 0.5,
            _ => break,
        }
    }
    // It has not arrived, whatever is left.
    if pushed == 0 { 0.0 } else { (1.0 - best / whole).clamp(0.0, 1.0 - 1e-9) }
}

/// Where the object can come no nearer to `goal` because fingertips would turn about their normals: the largest of these turns
/// on the rest of the way, in radians, to first order. None where something else stops it.
pub fn turn_needed(model: &Model, state: &GraspState, goal: &Pose) -> Option<f64> {
    let left = twist_between(model, &state.world_from_object, goal);
    let conditions = Conditions::of(model, state.holding, &state.moment())?;
    let way = conditions.project(&left)?;
    let is_stopped = way.norm() < LEAST_HEADWAY * left.norm() || way.norm() < LEAST_WAY * model.settings.step;
    is_stopped.then(|| conditions.turns(&left).iter().fold(0.0, |most: f64, turn| most.max(turn.abs())))
}

/// Transfers of two grasps to a pose of the object that both reach without turning about normals.
pub struct Meeting {
    /// Moments of each grasp after its start; the last ones have the same pose.
    pub moments: [Vec<Moment>; 2],
}

/// Looks for a pose between `states` at which both arrive. Collisions and forces are not looked at. Steps of the
/// object count as `work`.
pub fn meet(model: &Model, states: [&GraspState; 2], work: &mut u64) -> Option<Meeting> {
    let full = model.settings.step;
    let mut moments = [Vec::new(), Vec::new()];
    let mut here = states.map(GraspState::moment);
    let apart = |here: &[Moment; 2]| twist_between(model, &here[0].world_from_object, &here[1].world_from_object);
    let whole = apart(&here).norm();
    let mut made = [0.0_f64; 2];
    let mut length = full;
    for _ in 0..MOST_STEPS * ((whole / full).ceil() as usize + 2) {
        let conditions =
            [Conditions::of(model, states[0].holding, &here[0])?, Conditions::of(model, states[1].holding, &here[1])?];
        let both = conditions[0].clone().and(&conditions[1]);
        if both.rows.len() > 6 {
            return None;
        }
        let d = apart(&here);
        let first = first_way(&conditions, &both, &d)?;
        let ways = [first, first - d];
        let longest = ways[0].norm().max(ways[1].norm());
        if made[0].max(made[1]) + longest > FARTHEST_MEETING.0 * whole + FARTHEST_MEETING.1 {
            return None;
        }
        if longest <= length
            && let Some(last) = step_together(model, states.map(|state| state.holding), &here, &first, &both)
        {
            let [a, b] = last;
            moments[0].push(a);
            moments[1].push(b);
            return Some(Meeting { moments });
        }
        let share = (length / longest).min(0.5);
        *work += 2;
        let steps = [0, 1].map(|k| step(model, states[k].holding, &here[k], &(ways[k] * share), &conditions[k]));
        match steps {
            [Ok(a), Ok(b)] => {
                for (k, there) in [a, b].into_iter().enumerate() {
                    made[k] += ways[k].norm() * share;
                    here[k] = there.clone();
                    moments[k].push(there);
                }
                length = full;
            }
            [Err(NoStep::OutOfReach), _] | [_, Err(NoStep::OutOfReach)] => return None,
            _ if length > full * 0.5f64.powi(MAX_HALVINGS) => length *= 0.5,
            _ => return None,
        }
    }
    None
}

/// Of two grasps that are `d` apart the first goes by `x` and the second by `x - d` so that they meet: neither turns about
/// a normal, and the sum of squares is least. To first order.
fn first_way(conditions: &[Conditions; 2], both: &Conditions, d: &Twist) -> Option<Twist> {
    let mut wanted: Spins = conditions[0].rows.iter().map(|_| 0.0).collect();
    wanted.extend(conditions[1].turns(d));
    let halfway = d * 0.5;
    let lacking: Spins = wanted.iter().zip(both.turns(&halfway)).map(|(a, b)| a - b).collect();
    Some(halfway + both.least(&lacking)?)
}

/// How far the one that goes farther would have to go to meet, to first order. None where they cannot.
pub fn way_to_meeting(model: &Model, states: [&GraspState; 2]) -> Option<f64> {
    let here = states.map(GraspState::moment);
    let conditions =
        [Conditions::of(model, states[0].holding, &here[0])?, Conditions::of(model, states[1].holding, &here[1])?];
    let both = conditions[0].clone().and(&conditions[1]);
    let d = twist_between(model, &here[0].world_from_object, &here[1].world_from_object);
    let first = if both.rows.len() > 6 { None } else { first_way(&conditions, &both, &d) }?;
    let longest = first.norm().max((first - d).norm());
    (longest < FARTHEST_MEETING.0 * d.norm() + FARTHEST_MEETING.1).then_some(longest)
}

/// The last step of both to one pose, about `first` from where the first one is.
fn step_together(
    model: &Model,
    holding: [u32; 2],
    here: &[Moment; 2],
    first: &Twist,
    both: &Conditions,
) -> Option<[Moment; 2]> {
    let mut twist = *first;
    for _ in 0..CORRECTIONS {
        let pose = moved(model, &here[0].world_from_object, &twist);
        let (a, mut spins) = step_joints(model, holding[0], &here[0], &pose).ok()?;
        let (b, others) = step_joints(model, holding[1], &here[1], &pose).ok()?;
        spins.extend(others);
        if are_still(&spins) {
            let closed = is_closed(model, &a, holding[0]) && is_closed(model, &b, holding[1]);
            return closed.then_some([a, b]);
        }
        twist -= both.least(&spins)?;
    }
    None
}

/// Length by which turns are weighed against shifts here: about that of a finger's links, as a turn that a finger has to go along
/// with shifts its tip by so much. By measurement on the spheres of D'Claw and TriFinger.
fn turn_length(model: &Model) -> f64 {
    2.0 * model.turn_length()
}

#[cfg(test)]
mod tests;
