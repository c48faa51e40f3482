//! Contact forces of the hand's fingers: what balances the object's weight within all limits.

use crate::forces::limits::{CAUSE_EVERY, ForceModel, Unbalanced};
use crate::grasp::state::{Contacts, HandJoints, MAX_FINGERS};
use crate::model::{Model, friction_in_words};
use crate::workspace::Workspace;
use arrayvec::ArrayVec;
use regrasp_base::diagnostic::number;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::wrench::any_direction::reserves;
use regrasp_grasp::wrench::force_distribution::MAX_ROWS;
use regrasp_grasp::wrench::{
    BalancedForces, ForceProblem, JointRow, JointRows, NoForces, Reserve, Wrench, can_balance, distribute,
};
use regrasp_grasp::{Contact, ContactForce, Grip};
use regrasp_robot::kinematics::body_frame::BodyFrame;
use regrasp_robot::kinematics::chain::JointMotion;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use regrasp_scene::{Gravity, STANDARD_GRAVITY};

impl Unbalanced {
    /// In words.
    pub fn in_words(&self, model: &Model) -> String {
        let finger_name = |f: usize| model.view.hand.fingers[f].name.as_str();
        let limits = model.forces.as_ref().map_or([0.0; 2], |forces| [forces.limits.least, forces.limits.largest]);
        let cause = match *self {
            Unbalanced::AtAnyForce => format!("friction {} does not hold it at any force", friction_in_words(model)),
            Unbalanced::TooLight(f) => {
                format!("finger \"{}\" would have to press with less than {} N", finger_name(f), limits[0])
            }
            Unbalanced::TooHard(f) => {
                format!("finger \"{}\" would have to press with more than {} N", finger_name(f), limits[1])
            }
            Unbalanced::TooWeak(f, j) => {
                let chain = &model.view.hand.fingers[f].chain;
                let slides = chain
                    .joints
                    .iter()
                    .any(|joint| joint.drive.multiplier(j) != 0.0 && joint.motion == JointMotion::Slide);
                let limit = model.forces.as_ref().map_or(0.0, |forces| forces.torques[f][j]);
                let unit = if slides { "N" } else { "N m" };
                format!("joint \"{}\" would need more than {} {unit}", chain.names[j], number(limit))
            }
        };
        let what = match model.forces.as_ref().map(|forces| forces.gravity) {
            Some(Gravity::Any) => "the weight in every direction",
            _ => "the weight",
        };
        format!("no contact forces balance {what}: {cause}")
    }
}

/// A grasp at a pose, ready to be asked about forces.
pub struct Held {
    /// Fingers that hold, in order.
    pub fingers: ArrayVec<usize, MAX_FINGERS>,
    grips: ArrayVec<Grip, MAX_FINGERS>,
    joints: ArrayVec<JointRows, MAX_FINGERS>,
    load: Wrench,
    /// Room for a weight of any direction; None where the fingers cannot answer every one.
    reserves: Option<ArrayVec<Reserve, MAX_FINGERS>>,
}

impl Held {
    /// The fingers of `holding` at their contacts; `joints` gives those of each.
    pub fn new<'j>(
        model: &Model,
        forces: &ForceModel,
        world_from_object: &Placement,
        contacts: &Contacts,
        holding: u32,
        joints: impl Fn(usize) -> &'j [f64],
    ) -> Self {
        let fingers: ArrayVec<usize, MAX_FINGERS> =
            (0..model.n_fingers()).filter(|finger| holding & (1 << finger) != 0).collect();
        let rows = |&finger: &usize| {
            joint_rows(model, finger, &forces.torques[finger], joints(finger), world_from_object, &contacts[finger])
        };
        let grips: ArrayVec<Grip, MAX_FINGERS> =
            fingers.iter().map(|&finger| model.grip(finger, &contacts[finger])).collect();
        let joints: ArrayVec<JointRows, MAX_FINGERS> = fingers.iter().map(rows).collect();
        let reserves = match forces.gravity {
            Gravity::Direction(_) => Some(ArrayVec::new()),
            Gravity::Any => reserves(&grips, &joints, &model.frame, forces.mass * STANDARD_GRAVITY),
        };
        Held { fingers, grips, joints, load: forces.load(world_from_object), reserves }
    }

    /// The forces under a load in the object frame that the grasp is not made for: `load` alone counts, for no other direction room is
    /// kept. `warm` are those of the moment before.
    pub fn forces_under(
        &self,
        model: &Model,
        forces: &ForceModel,
        load: Wrench,
        warm: Option<&BalancedForces>,
    ) -> Result<BalancedForces, NoForces> {
        let problem = self.problem_under(model, forces, load);
        distribute(&problem, warm.map(|warm| warm.as_slice()))
    }

    /// True when there are forces under a load, as [`Held::forces_under`].
    pub fn is_balanced_under(&self, model: &Model, forces: &ForceModel, load: Wrench) -> bool {
        can_balance(&self.problem_under(model, forces, load))
    }

    fn problem_under<'p>(&'p self, model: &'p Model, forces: &ForceModel, load: Wrench) -> ForceProblem<'p> {
        ForceProblem {
            grips: &self.grips,
            joints: &self.joints,
            reserves: &[],
            rubbing: &[],
            frame: &model.frame,
            load,
            limits: forces.limits,
        }
    }

    /// What the fingers touch, in the order of [`Held::fingers`].
    pub fn grips(&self) -> &[Grip] {
        &self.grips
    }

    /// None where no forces whatever will do.
    fn problem<'p>(&'p self, model: &'p Model, forces: &ForceModel) -> Option<ForceProblem<'p>> {
        let reserves = self.reserves.as_ref().filter(|_| !self.grips.is_empty())?;
        Some(ForceProblem {
            grips: &self.grips,
            joints: &self.joints,
            reserves,
            rubbing: &[],
            frame: &model.frame,
            load: self.load,
            limits: forces.limits,
        })
    }

    /// The forces of the fingers; `warm` are those of the moment before.
    pub fn forces(
        &self,
        model: &Model,
        forces: &ForceModel,
        warm: Option<&BalancedForces>,
    ) -> Result<BalancedForces, Unbalanced> {
        let problem = self.problem(model, forces).ok_or(Unbalanced::AtAnyForce)?;
        distribute(&problem, warm.map(|warm| warm.as_slice())).map_err(|cause| match cause {
            NoForces::NotBalanced => Unbalanced::AtAnyForce,
            NoForces::LeastNormalForce { grip } => Unbalanced::TooLight(self.fingers[grip]),
            NoForces::LargestNormalForce { grip } => Unbalanced::TooHard(self.fingers[grip]),
            NoForces::JointTorque { grip, joint } => Unbalanced::TooWeak(self.fingers[grip], joint),
        })
    }

    /// True when there are forces.
    pub fn is_balanced(&self, model: &Model, forces: &ForceModel) -> bool {
        self.problem(model, forces).is_some_and(|problem| can_balance(&problem))
    }

    /// Torques of all joints of the holding finger `index` for what it exerts.
    pub fn torques(&self, index: usize, exerted: &ContactForce) -> Coordinates {
        self.joints[index].iter().map(|row| row.torque(exerted)).collect()
    }
}

/// True when the fingers of `holding` can balance the weight, or nobody asks for forces; a refusal is counted,
/// and as work.
pub fn balances(
    workspace: &mut Workspace,
    world_from_object: &Pose,
    joints: &HandJoints,
    contacts: &Contacts,
    holding: u32,
) -> bool {
    let model = workspace.model;
    let Some(forces) = &model.forces else { return true };
    let pose = Placement::from(world_from_object);
    let held = Held::new(model, forces, &pose, contacts, holding, |finger| &joints[finger]);
    if held.is_balanced(model, forces) {
        return true;
    }
    let refusals = &mut workspace.refusals;
    if refusals.n_seen.is_multiple_of(CAUSE_EVERY)
        && let Err(cause) = held.forces(model, forces, None)
    {
        *refusals.counts.entry(cause).or_default() += CAUSE_EVERY;
    }
    refusals.n_seen += 1;
    workspace.work += 1;
    false
}

/// Rows of the transposed Jacobian of the point of the tip that touches, at the tip's centre less its radius along the
/// normal, in the object frame; coupled joints by virtual work.
fn joint_rows(
    model: &Model,
    finger: usize,
    limits: &[f64],
    joints: &[f64],
    world_from_object: &Placement,
    contact: &Contact,
) -> JointRows {
    let of_hand = &model.view.hand.fingers[finger];
    let chain = &of_hand.chain;
    let mut frames: ArrayVec<BodyFrame, MAX_BODIES> = (0..chain.joints.len()).map(|_| BodyFrame::IDENTITY).collect();
    chain.forward_frames(joints, &mut frames);
    let normal = world_from_object.vector(&contact.normal_in_object);
    let last = frames.last().unwrap_or(&BodyFrame::IDENTITY);
    let touching = last.point(&of_hand.tip.center_in_body).coords + model.fingers[finger].arm(last, &normal);
    let mut rows: JointRows =
        limits.iter().map(|&limit| JointRow { per_force: Vector::zeros(), per_torsion: 0.0, limit }).collect();
    for (joint, frame) in chain.joints.iter().zip(&frames) {
        let axis = frame.vector(&joint.axis);
        for &(k, multiplier) in &joint.drive.terms {
            let row = &mut rows[k];
            match joint.motion {
                JointMotion::Turn => {
                    row.per_force += axis.cross(&(touching - frame.translation)) * multiplier;
                    row.per_torsion += axis.dot(&normal) * multiplier;
                }
                JointMotion::Slide => row.per_force += axis * multiplier,
            }
        }
    }
    for row in &mut rows {
        row.per_force = world_from_object.vector_to_child(&row.per_force);
    }
    rows
}

/// Most moving bodies of a finger.
const MAX_BODIES: usize = 2 * MAX_ROWS;
