//! Contact forces that balance a load, inside the exact cones, between a least and a largest normal force, within joint
//! torque limits.
//!
//! Of all such forces those with the least
//! `sum |f_t|^2 + (m / e)^2 + weight (f_n - squeeze)^2 - cone_weight squeeze f_n log(1 - s^2)` (tangential force, torsion over
//! torsion radius, normal force, share of its friction that a contact needs),
//! but for a small fixed barrier before every limit that keeps them strictly inside and makes them an analytic function
//! of contacts, load and limits: along a plan they are smooth wherever these are. The last term keeps them away from where a
//! contact slips, which those of the least effort are next to. The objective is that of the notes on
//! physics (replays in MuJoCo); Buss, Hashimoto, Moore, *Dextrous hand grasping force optimization*, IEEE T-RA 12 (1996),
//! minimise over the same cones with the same kind of barrier.
//!
//! A fingertip that slides has friction of full size in a direction that is known: only its normal force is left open, and
//! counts alone. Where forces across the normal are wished for, `|f_t - wish|^2` counts instead of `|f_t|^2`.
//!
//! Joint torques carry the contact forces only: fingers whose own weight counts need that on top.

use super::barrier::{Block, Forces, Infeasible, Program, Refusal};
pub use super::barrier::{MAX_GRIPS, MAX_ROWS};
use crate::closure::GraspFrame;
use crate::contact::{ContactForce, ContactModel, Grip};
use arrayvec::ArrayVec;
use regrasp_geometry::Vector;

/// A force and a torque about the centre of mass, in the object frame, in newtons and newton metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force.
    pub force: Vector,
    /// Torque about the object's centre of mass.
    pub torque: Vector,
}

impl Wrench {
    /// No load.
    pub const ZERO: Wrench = Wrench { force: Vector::new(0.0, 0.0, 0.0), torque: Vector::new(0.0, 0.0, 0.0) };

    /// A force at the centre of mass.
    pub fn at_center_of_mass(force: Vector) -> Self {
        Wrench { force, torque: Vector::zeros() }
    }

    /// The load together with all contact forces: zero where these balance it.
    pub fn with_forces(&self, grips: &[Grip], forces: &[ContactForce], frame: &GraspFrame) -> Wrench {
        grips.iter().zip(forces).fold(*self, |sum, (grip, exerted)| {
            let arm = grip.contact.point_in_object - frame.center_of_mass;
            let torsion = grip.contact.normal_in_object.into_inner() * exerted.torsion;
            Wrench { force: sum.force + exerted.force, torque: sum.torque + arm.cross(&exerted.force) + torsion }
        })
    }
}

/// What a joint has to do for a contact force: its row of the transposed Jacobian of the contact point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRow {
    /// Torque per newton, along each axis of the object frame: N m / N, or N / N for sliding joints.
    pub per_force: Vector,
    /// Torque per newton metre of torsion about the outward normal.
    pub per_torsion: f64,
    /// Largest torque either way; infinite where there is no limit.
    pub limit: f64,
}

impl JointRow {
    /// Torque, or force, with which the joint makes its finger exert `exerted`.
    pub fn torque(&self, exerted: &ContactForce) -> f64 {
        self.per_force.dot(&exerted.force) + self.per_torsion * exerted.torsion
    }
}

/// The joints of one finger.
pub type JointRows = ArrayVec<JointRow, MAX_ROWS>;

/// What is to be kept free inside the limits of one contact, for loads that are not known yet.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reserve {
    /// Of the normal force, below and above, in newtons.
    pub normal: f64,
    /// Of the length of tangential force and torsion, in newtons.
    pub tangential: f64,
    /// Of each joint torque.
    pub joints: ArrayVec<f64, MAX_ROWS>,
}

/// What the motion of a contact says about its force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rubbing {
    /// Friction on the object per newton of normal force where the fingertip slides: across the normal, opposite to the
    /// velocity of the object over the fingertip, as long as the coefficient. None where it does not slide.
    pub sliding: Option<Vector>,
    /// Force wished for across the normal, in newtons. Of a fingertip that slides, its part along `sliding` counts.
    pub wish: Vector,
}

/// Limits and wishes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceLimits {
    /// Least normal force, in newtons; 0 or more.
    pub least: f64,
    /// Largest normal force.
    pub largest: f64,
    /// Normal force wished for, above 0.
    pub squeeze: f64,
    /// What a square of a newton beside that counts, against one of tangential force.
    pub squeeze_weight: f64,
    /// Weight of the friction that contacts need, in squeezes: the larger, the farther forces stay from where contacts slip; 0 or more.
    pub cone_weight: f64,
}

/// The most that so many fingertips could hold together, in newtons: each presses with the normal force `largest`, in newtons, along
/// the edge of its friction cone, and all of these forces point straight up.
pub fn held_at_most(n_fingers: usize, largest: f64, friction: f64) -> f64 {
    n_fingers as f64 * largest * friction.hypot(1.0)
}

/// A grasp under load.
#[derive(Debug, Clone, Copy)]
pub struct ForceProblem<'a> {
    /// Contacts that hold; at most [`MAX_GRIPS`].
    pub grips: &'a [Grip],
    /// Joints behind each; may be empty.
    pub joints: &'a [JointRows],
    /// Room to be kept at each; may be empty.
    pub reserves: &'a [Reserve],
    /// How each moves; empty where none does, and no force across the normal is wished for.
    pub rubbing: &'a [Rubbing],
    /// Centre of mass, torque scale, friction counted on.
    pub frame: &'a GraspFrame,
    /// What the contacts have to balance.
    pub load: Wrench,
    /// Limits.
    pub limits: ForceLimits,
}

/// Why there are no forces: which limit would have to give.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoForces {
    /// Forces in the cones do not balance the load, however large they are.
    NotBalanced,
    /// Only with less than the least normal force, at this contact most.
    LeastNormalForce {
        /// Index of the contact.
        grip: usize,
    },
    /// Only with more than the largest normal force, at this contact most.
    LargestNormalForce {
        /// Index of the contact.
        grip: usize,
    },
    /// Only with more than the limit of a joint, of this one most.
    JointTorque {
        /// Index of the contact.
        grip: usize,
        /// Index among the joints behind it.
        joint: usize,
    },
}

/// Forces of all contacts.
pub type BalancedForces = ArrayVec<ContactForce, MAX_GRIPS>;

/// Contact forces that balance the load, strictly inside all limits; `warm` may be forces of a similar problem.
///
/// Errors: none exist, or none that keep more than about 1e-4 of the squeeze from every limit.
///
/// Panics for no contacts, more than [`MAX_GRIPS`], or limits without room between them.
pub fn distribute(problem: &ForceProblem, warm: Option<&[ContactForce]>) -> Result<BalancedForces, NoForces> {
    if has_torsion(problem) { distribute_in::<4>(problem, warm) } else { distribute_in::<3>(problem, warm) }
}

/// The forces of [`distribute`], for callers who do not ask why there are none: that answer takes a longer search, and up to three more
/// with limits left out. Panics as [`distribute`].
pub fn distribute_if_any(problem: &ForceProblem, warm: Option<&[ContactForce]>) -> Option<BalancedForces> {
    match has_torsion(problem) {
        true => least_effort::<4>(problem, warm, Refusal::Bare).ok(),
        false => least_effort::<3>(problem, warm, Refusal::Bare).ok(),
    }
}

/// Some balanced forces inside all limits where [`distribute`] finds its own, in half of its time; of `warm` it takes what is near. Panics as
/// [`distribute`].
pub fn any_inside(problem: &ForceProblem, warm: Option<&[ContactForce]>) -> Option<BalancedForces> {
    fn inside<const D: usize>(problem: &ForceProblem, warm: Option<&[ContactForce]>) -> Option<BalancedForces> {
        let program = program::<D>(problem, Relaxed::default())?;
        let forces = program.strictly_inside_near(starting_at::<D>(problem, warm))?;
        Some(all_exerted(problem, &forces))
    }
    if has_torsion(problem) { inside::<4>(problem, warm) } else { inside::<3>(problem, warm) }
}

/// True when [`distribute`] finds forces; takes a fraction of its time.
pub fn can_balance(problem: &ForceProblem) -> bool {
    fn inside<const D: usize>(problem: &ForceProblem) -> bool {
        program::<D>(problem, Relaxed::default()).is_some_and(|program| program.strictly_inside(Refusal::Bare).is_ok())
    }
    if has_torsion(problem) { inside::<4>(problem) } else { inside::<3>(problem) }
}

fn has_torsion(problem: &ForceProblem) -> bool {
    let is_soft = |grip: &Grip| matches!(grip.model_at(problem.frame.friction), ContactModel::SoftFinger { .. });
    problem.grips.iter().any(is_soft)
}

fn distribute_in<const D: usize>(
    problem: &ForceProblem,
    warm: Option<&[ContactForce]>,
) -> Result<BalancedForces, NoForces> {
    least_effort::<D>(problem, warm, Refusal::Explained).map_err(|infeasible| match infeasible {
        Some(infeasible) => cause::<D>(problem, &infeasible),
        None => NoForces::NotBalanced,
    })
}

/// The forces of [`distribute`]. Errors: none exist; with the limits that stand most in the way, if forces without limits would balance.
fn least_effort<const D: usize>(
    problem: &ForceProblem,
    warm: Option<&[ContactForce]>,
    refusal: Refusal,
) -> Result<BalancedForces, Option<Infeasible>> {
    let program = program::<D>(problem, Relaxed::default()).ok_or(None)?;
    let forces = program.minimum(starting_at::<D>(problem, warm), refusal).map_err(Some)?;
    Ok(all_exerted(problem, &forces))
}

/// Coordinates of forces to start from.
fn starting_at<const D: usize>(problem: &ForceProblem, warm: Option<&[ContactForce]>) -> Option<Forces<D>> {
    warm.filter(|warm| warm.len() == problem.grips.len())
        .map(|warm| warm.iter().enumerate().map(|(index, exerted)| coordinates::<D>(problem, index, exerted)).collect())
}

fn all_exerted<const D: usize>(problem: &ForceProblem, forces: &Forces<D>) -> BalancedForces {
    forces.iter().enumerate().map(|(index, f)| combined(&axes_at::<D>(problem, index), f)).collect()
}

/// Which limit would have to give: the kind whose absence leaves forces, weakest first.
fn cause<const D: usize>(problem: &ForceProblem, infeasible: &Infeasible) -> NoForces {
    let without = |relaxed: Relaxed| match program::<D>(problem, relaxed) {
        Some(program) => program.strictly_inside(Refusal::Explained).err(),
        None => Some(*infeasible),
    };
    let Some(no_joints) = without(Relaxed { joints: true, ..Relaxed::default() }) else {
        let Some((grip, row)) = infeasible.joint else { return NoForces::NotBalanced };
        return NoForces::JointTorque { grip, joint: limited(problem, grip, row) };
    };
    let Some(no_largest) = without(Relaxed { joints: true, largest: true, ..Relaxed::default() }) else {
        return NoForces::LargestNormalForce { grip: no_joints.largest };
    };
    match without(Relaxed { joints: true, largest: true, least: true }) {
        None => NoForces::LeastNormalForce { grip: no_largest.least },
        Some(_) => NoForces::NotBalanced,
    }
}

/// Index, among the joints behind `grip`, of the one that the row `row` of its block stands for.
fn limited(problem: &ForceProblem, grip: usize, row: usize) -> usize {
    let rows = problem.joints[grip].iter().enumerate();
    rows.filter(|(_, joint)| joint.limit.is_finite()).nth(row).map_or(0, |(index, _)| index)
}

/// Limits that are left out.
#[derive(Debug, Clone, Copy, Default)]
struct Relaxed {
    joints: bool,
    largest: bool,
    least: bool,
}

/// Factor of the largest normal force where it is left out: what needs more is not balanced.
const NO_LIMIT: f64 = 1e3;

/// The program of `problem`; None where the load cannot be balanced by any forces.
fn program<const D: usize>(problem: &ForceProblem, relaxed: Relaxed) -> Option<Program<D>> {
    let (limits, frame) = (&problem.limits, problem.frame);
    assert!(!problem.grips.is_empty() && limits.least >= 0.0 && limits.least < limits.largest && limits.squeeze > 0.0);
    let mut blocks = ArrayVec::new();
    for (index, grip) in problem.grips.iter().enumerate() {
        let reserve = problem.reserves.get(index);
        let room = reserve.map_or(0.0, |reserve| reserve.normal);
        let rubbing = problem.rubbing.get(index);
        let slides = rubbing.is_some_and(|rubbing| rubbing.sliding.is_some());
        let rubs = !slides && grip.model_at(frame.friction) != ContactModel::Frictionless;
        let friction = if rubs { frame.friction } else { 0.0 };
        let axes = axes_at::<D>(problem, index);
        let mut block = Block {
            map: [[0.0; 6]; D],
            wish: wish(problem, rubbing, &axes),
            friction,
            shift: friction * room + reserve.map_or(0.0, |reserve| reserve.tangential),
            least: if relaxed.least { room } else { limits.least + room },
            largest: limits.largest * if relaxed.largest { NO_LIMIT } else { 1.0 } - room,
            rows: ArrayVec::new(),
            limits: ArrayVec::new(),
        };
        let arm = (grip.contact.point_in_object - frame.center_of_mass) / frame.torque_scale;
        for (column, axis) in block.map.iter_mut().zip(&axes) {
            let torque = arm.cross(&axis.force)
                + grip.contact.normal_in_object.into_inner() * (axis.torsion / frame.torque_scale);
            *column = [axis.force.x, axis.force.y, axis.force.z, torque.x, torque.y, torque.z];
        }
        let joints = problem.joints.get(index).filter(|_| !relaxed.joints);
        for (j, joint) in joints.into_iter().flatten().enumerate().filter(|(_, joint)| joint.limit.is_finite()) {
            // So scaled that the limit is the largest normal force: all slacks are newtons.
            let room = reserve.and_then(|reserve| reserve.joints.get(j)).copied().unwrap_or(0.0);
            let scale = limits.largest / joint.limit;
            block.rows.push(std::array::from_fn(|i| joint.torque(&axes[i]) * scale));
            block.limits.push(limits.largest - room * scale);
        }
        blocks.push(block);
    }
    let load = &problem.load;
    let torque = load.torque / frame.torque_scale;
    let balance = [load.force.x, load.force.y, load.force.z, torque.x, torque.y, torque.z].map(|x| -x);
    Program::new(blocks, balance, limits.squeeze, limits.squeeze_weight, limits.cone_weight)
}

/// What a unit of each coordinate exerts; nothing for those that the contact does not transmit.
pub(super) fn axes<const D: usize>(friction: f64, grip: &Grip) -> [ContactForce; D] {
    let normal = grip.contact.normal_in_object.into_inner();
    let model = grip.model_at(friction);
    let nothing = ContactForce { force: Vector::zeros(), torsion: 0.0 };
    let mut axes = [nothing; D];
    axes[0].force = -normal;
    if model != ContactModel::Frictionless {
        let helper = if normal.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
        let x = normal.cross(&helper).normalize();
        (axes[1].force, axes[2].force) = (x, normal.cross(&x));
    }
    if let (ContactModel::SoftFinger { torsion_radius }, true) = (model, D > 3) {
        axes[D - 1].torsion = torsion_radius;
    }
    axes
}

/// The same for a contact of `problem`: one that slides has a single coordinate, its normal force.
fn axes_at<const D: usize>(problem: &ForceProblem, index: usize) -> [ContactForce; D] {
    let grip = &problem.grips[index];
    match problem.rubbing.get(index).and_then(|rubbing| rubbing.sliding) {
        None => axes(problem.frame.friction, grip),
        Some(friction) => {
            let mut axes = [ContactForce { force: Vector::zeros(), torsion: 0.0 }; D];
            axes[0].force = friction - grip.contact.normal_in_object.into_inner();
            axes
        }
    }
}

/// Coordinates wished for. Where a fingertip slides, force across the normal goes with the normal force: of
/// `weight (f_n - squeeze)^2 - 2 f_t . wish` the minimum is wished for.
fn wish<const D: usize>(problem: &ForceProblem, rubbing: Option<&Rubbing>, axes: &[ContactForce; D]) -> [f64; D] {
    let mut wish = [0.0; D];
    wish[0] = problem.limits.squeeze;
    match rubbing {
        None => {}
        Some(Rubbing { sliding: Some(friction), wish: across }) => {
            wish[0] += friction.dot(across) / problem.limits.squeeze_weight;
        }
        Some(Rubbing { sliding: None, wish: across }) => {
            wish[1..].iter_mut().zip(&axes[1..]).for_each(|(wish, axis)| *wish = axis.force.dot(across));
        }
    }
    wish
}

fn coordinates<const D: usize>(problem: &ForceProblem, index: usize, exerted: &ContactForce) -> [f64; D] {
    let mut axes = axes_at::<D>(problem, index);
    // That of the normal force is no unit vector where the fingertip slides.
    axes[0].force = -problem.grips[index].contact.normal_in_object.into_inner();
    axes.map(|axis| {
        let along_torsion = if axis.torsion > 0.0 { exerted.torsion / axis.torsion } else { 0.0 };
        axis.force.dot(&exerted.force) + along_torsion
    })
}

/// What a contact exerts that has these coordinates over its axes.
pub(super) fn exerted<const D: usize>(friction: f64, grip: &Grip, coordinates: &[f64; D]) -> ContactForce {
    combined(&axes::<D>(friction, grip), coordinates)
}

fn combined<const D: usize>(axes: &[ContactForce; D], coordinates: &[f64; D]) -> ContactForce {
    let mut sum = ContactForce { force: Vector::zeros(), torsion: 0.0 };
    for (axis, x) in axes.iter().zip(coordinates) {
        sum.force += axis.force * *x;
        sum.torsion += axis.torsion * x;
    }
    sum
}
