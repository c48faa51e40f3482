//! What contact forces balance, and their limits.

use crate::grasp::state::MAX_FINGERS;
use crate::settings::{ForceSettings, PhysicsSettings};
use arrayvec::ArrayVec;
use regrasp_geometry::Vector;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::wrench::force_distribution::MAX_ROWS;
use regrasp_grasp::wrench::{ForceLimits, Wrench};
use regrasp_plan::plan::ForcePromises;
use regrasp_scene::{Gravity, HandView};
use std::collections::BTreeMap;

/// What contact forces balance, and their limits.
#[derive(Debug)]
pub struct ForceModel {
    /// Limits and wishes.
    pub(super) limits: ForceLimits,
    /// Mass of the object.
    pub(super) mass: f64,
    /// Direction.
    pub(super) gravity: Gravity,
    /// Largest torque of every joint, finger by finger; infinite where there is no limit.
    pub(super) torques: ArrayVec<ArrayVec<f64, MAX_ROWS>, MAX_FINGERS>,
}

/// Which limit leaves no forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unbalanced {
    /// Friction: no forces do, however large.
    AtAnyForce,
    /// This finger would have to press with less than the least normal force.
    TooLight(usize),
    /// This finger would have to press with more than the largest normal force.
    TooHard(usize),
    /// This joint of this finger would need more than its limit.
    TooWeak(usize, usize),
}

impl ForceModel {
    /// Of a scene; None for plans without forces.
    pub fn new(view: &HandView, settings: &PhysicsSettings) -> Option<Self> {
        let ForceSettings { squeeze, squeeze_weight, cone_weight, normal_force: [least, largest], torque_share } =
            settings.forces?;
        let effort = |name: &String| {
            let joint = view.hand.robot.joint_named(name)?;
            view.hand.robot.joints[joint.0].limits?.effort
        };
        let torque = |name: &String| effort(name).map_or(f64::INFINITY, |effort| effort * torque_share);
        Some(ForceModel {
            limits: ForceLimits { least, largest, squeeze, squeeze_weight, cone_weight },
            mass: view.object.mass,
            gravity: view.gravity,
            torques: view.hand.fingers.iter().map(|f| f.chain.names.iter().map(torque).collect()).collect(),
        })
    }

    /// What a plan promises about its forces.
    pub fn promises(&self) -> ForcePromises {
        ForcePromises {
            mass: self.mass,
            gravity_in_world: self.gravity.in_world().map(Into::into),
            normal_force: [self.limits.least, self.limits.largest],
            joint_torques: self.torques.iter().flatten().map(|&limit| Some(limit).filter(|l| l.is_finite())).collect(),
        }
    }

    /// Limits and wishes.
    pub fn limits(&self) -> &ForceLimits {
        &self.limits
    }

    /// Weight of the object, in the world; zero where its direction is not known.
    pub fn weight_in_world(&self) -> Vector {
        self.gravity.in_world().unwrap_or_else(Vector::zeros) * self.mass
    }

    /// True when the joints of a finger can make these torques.
    pub fn allows(&self, finger: usize, torques: &[f64]) -> bool {
        self.torques[finger].iter().zip(torques).all(|(limit, torque)| torque.abs() <= *limit)
    }

    /// Weight of the object, in its frame.
    pub(super) fn load(&self, world_from_object: &Placement) -> Wrench {
        let gravity = self.gravity.in_world().unwrap_or_else(Vector::zeros);
        Wrench::at_center_of_mass(world_from_object.vector_to_child(&gravity) * self.mass)
    }
}

/// Grasps that a search refused as nothing balances them, by cause.
#[derive(Debug, Clone, Default)]
pub struct Refusals {
    pub(super) n_seen: u64,
    pub(super) counts: BTreeMap<Unbalanced, u64>,
}

/// Refusals of which one is asked for its cause, which takes several times as long as the refusal.
pub(super) const CAUSE_EVERY: u64 = 16;

impl Refusals {
    /// How many there were.
    pub fn n_seen(&self) -> u64 {
        self.n_seen
    }

    /// Causes and how often each was seen.
    pub fn counts(&self) -> impl Iterator<Item = (Unbalanced, u64)> + '_ {
        self.counts.iter().map(|(&cause, &count)| (cause, count))
    }
}
