//! Inverse kinematics of arms: joints that bring the mount link to a pose.
//!
//! Arms with spherical shoulder and wrist (S-R-S) have a closed form with all branches, and intervals of the free angle. They are
//! recognised by their axes. Every other arm of six joints or more is solved by damped least squares from many starts.

mod numeric;
mod spherical;
mod triple;
mod wave;

use super::body_frame::BodyFrame;
use super::chain::Chain;
use super::finger_ik::Coordinates;
use crate::manipulator::{Arm, Manipulator};
use numeric::Miss;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
pub use spherical::Family;
use spherical::SphericalArm;
use std::f64::consts::TAU;

/// Distance and angle from the pose that no solution exceeds, in metres and radians.
pub const POSE_TOLERANCE: f64 = 1e-9;
/// Axes meet where they pass each other within this distance, in metres. URDFs write right angles with seven digits.
const MEETING: f64 = 1e-6;
/// Joints outside their limits by less are brought to the limit, in radians.
const LIMIT_TOLERANCE: f64 = 1e-10;
/// What the numeric method goes on to where it can.
const POLISHED: f64 = 1e-13;
/// Two postures are one where no joint differs by more, in radians or metres.
const SAME_POSTURE: f64 = 1e-4;
/// What no posture has missed yet.
const NOTHING: Miss = Miss { distance: f64::INFINITY, angle: f64::INFINITY };
/// Coordinates that an arm needs to reach every pose near by.
const MIN_COORDINATES: usize = 6;

/// An arm whose mount link cannot be brought to a pose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TooFewJoints {
    /// Name of the arm.
    pub arm: String,
    /// Its independent joints.
    pub joints: usize,
}

impl std::fmt::Display for TooFewJoints {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "arm \"{}\" has {} independent joints; a pose of its wrist needs at least 6", self.arm, self.joints)
    }
}

impl std::error::Error for TooFewJoints {}

/// Why no posture of an arm was found for a pose.
#[derive(Debug, Clone, PartialEq)]
pub enum Unreachable {
    /// The wrist would be too far from the shoulder: by so many metres.
    TooFar {
        /// In metres.
        by: f64,
    },
    /// The wrist would be too near to the shoulder: by so many metres.
    TooNear {
        /// In metres.
        by: f64,
    },
    /// In every posture that reaches the pose, limits of joints are exceeded.
    Limits {
        /// In the posture with the smallest excess that was looked at: the joint with the largest one.
        joint: String,
        /// In radians.
        by: f64,
    },
    /// The numeric method found no posture; the best one misses the pose by so much.
    NotFound {
        /// In metres.
        distance: f64,
        /// In radians.
        angle: f64,
    },
}

impl std::fmt::Display for Unreachable {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Unreachable::TooFar { by } => write!(f, "the wrist would be {by:.4} m too far from the shoulder"),
            Unreachable::TooNear { by } => write!(f, "the wrist would be {by:.4} m too near to the shoulder"),
            Unreachable::Limits { joint, by } => write!(f, "joint \"{joint}\" would be {by:.4} rad outside its limits"),
            Unreachable::NotFound { distance, angle } => {
                write!(f, "the best posture found misses the pose by {distance:.4} m and {angle:.4} rad")
            }
        }
    }
}

impl std::error::Error for Unreachable {}

/// A posture that reaches a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmPosture {
    /// One value per coordinate of the arm's chain.
    pub joints: Coordinates,
    /// The free angle in `-pi..pi`, for arms with a closed form.
    pub free_angle: Option<f64>,
}

/// How much is looked at for one pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IkBudget {
    /// Postures wanted, at most.
    pub postures: usize,
    /// Starts of the numeric method, at most.
    pub starts: usize,
    /// Free angles of a closed form that are looked at in a whole turn.
    pub free_angles: usize,
    /// Seed of the starts.
    pub seed: u64,
}

impl Default for IkBudget {
    fn default() -> Self {
        IkBudget { postures: 8, starts: 200, free_angles: 36, seed: 0 }
    }
}

#[derive(Debug, Clone)]
enum Method {
    ClosedForm(Box<SphericalArm>),
    Numeric,
}

/// Inverse kinematics of one arm, prepared.
#[derive(Debug, Clone)]
pub struct ArmIk {
    chain: Chain,
    mount_from_last: BodyFrame,
    method: Method,
}

impl ArmIk {
    /// Of arm `arm` of a manipulator.
    ///
    /// Errors: fewer than six independent joints. Panics unless the manipulator has that arm.
    pub fn new(manipulator: &Manipulator, arm: usize) -> Result<Self, TooFewJoints> {
        Self::of_arm(&manipulator.arms[arm])
    }

    /// Of an arm.
    ///
    /// Errors: fewer than six independent joints.
    pub fn of_arm(arm: &Arm) -> Result<Self, TooFewJoints> {
        Self::of_chain(&arm.chain, &arm.last_from_mount)
            .ok_or_else(|| TooFewJoints { arm: arm.name.clone(), joints: arm.chain.n_coordinates() })
    }

    /// Of a chain whose last body carries a mount link at `last_from_mount`. None for fewer than six independent joints.
    pub fn of_chain(chain: &Chain, last_from_mount: &Pose) -> Option<Self> {
        if chain.n_coordinates() < MIN_COORDINATES {
            return None;
        }
        let method = SphericalArm::new(chain).map_or(Method::Numeric, |arm| Method::ClosedForm(Box::new(arm)));
        Some(ArmIk { chain: chain.clone(), mount_from_last: frame_of(&last_from_mount.inverse()), method })
    }

    /// True for arms with spherical shoulder and wrist.
    pub fn has_closed_form(&self) -> bool {
        matches!(self.method, Method::ClosedForm(_))
    }

    /// Postures with which the mount link stands at `base_from_mount` in the frame of the arm's base link, the nearest to `near` first:
    /// by the largest difference of a joint. All keep the limits, and the pose within [`POSE_TOLERANCE`].
    ///
    /// Errors: how far out of reach the pose is. Panics unless `near` has one value per coordinate.
    pub fn solve(
        &self,
        base_from_mount: &Pose,
        near: &[f64],
        budget: &IkBudget,
    ) -> Result<Vec<ArmPosture>, Unreachable> {
        assert_eq!(near.len(), self.chain.n_coordinates(), "one value per coordinate");
        let target = self.last_body(base_from_mount);
        let mut found = match &self.method {
            Method::ClosedForm(arm) => {
                let families = arm.families(&target)?;
                let mut found = arm.spread(&families, near, TAU / budget.free_angles.max(1) as f64);
                let mut best = NOTHING;
                found.retain_mut(|posture| {
                    let miss = self.polish(&mut posture.joints, &target);
                    if miss.largest() < best.largest() {
                        best = miss;
                    }
                    miss.largest() < POSE_TOLERANCE && self.chain.within_limits(&posture.joints, 0.0)
                });
                if found.is_empty() {
                    return Err(Unreachable::NotFound { distance: best.distance, angle: best.angle });
                }
                found
            }
            Method::Numeric => self.search(&target, near, budget)?,
        };
        let distance = |posture: &ArmPosture| {
            posture.joints.iter().zip(near).map(|(q, near)| (q - near).abs()).fold(0.0, f64::max)
        };
        found.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        found.truncate(budget.postures);
        Ok(found)
    }

    /// All families of postures for a pose of the mount link, of arms with a closed form: branches and feasible intervals of the free
    /// angle. None for other arms.
    ///
    /// Errors: how far out of reach the pose is.
    pub fn families(&self, base_from_mount: &Pose) -> Option<Result<Vec<Family>, Unreachable>> {
        match &self.method {
            Method::ClosedForm(arm) => Some(arm.families(&self.last_body(base_from_mount))),
            Method::Numeric => None,
        }
    }

    /// The posture of a family at a free angle, near `near` where joints may turn more than once. None outside its intervals, and for
    /// arms without a closed form.
    pub fn posture(&self, family: &Family, free_angle: f64, near: &[f64]) -> Option<Coordinates> {
        match &self.method {
            Method::ClosedForm(arm) => {
                let mut joints = arm.posture(family, free_angle, near).ok()?;
                let miss = self.polish(&mut joints, &family.base_from_last);
                (miss.largest() < POSE_TOLERANCE).then_some(joints)
            }
            Method::Numeric => None,
        }
    }

    /// The free angle of a posture as a family counts it; 0 for arms without a closed form.
    pub fn free_angle(&self, family: &Family, joints: &[f64]) -> f64 {
        match &self.method {
            Method::ClosedForm(arm) => arm.free_angle(family, joints),
            Method::Numeric => 0.0,
        }
    }

    /// The posture for a pose near that of the posture `from`, to which it leads without a jump. None where limits or a singularity are
    /// in the way.
    ///
    /// Panics unless `from` has one value per coordinate.
    pub fn follow(&self, base_from_mount: &Pose, from: &[f64]) -> Option<Coordinates> {
        assert_eq!(from.len(), self.chain.n_coordinates(), "one value per coordinate");
        let mut joints: Coordinates = from.iter().copied().collect();
        let miss = numeric::descend(&self.chain, &self.last_body(base_from_mount), &mut joints, POLISHED);
        (miss.largest() < POSE_TOLERANCE && self.chain.within_limits(&joints, 0.0)).then_some(joints)
    }

    fn last_body(&self, base_from_mount: &Pose) -> BodyFrame {
        frame_of(base_from_mount).then(&self.mount_from_last)
    }

    /// Brings a posture that nearly reaches a pose to it: axes of a URDF meet within its digits only.
    fn polish(&self, joints: &mut Coordinates, target: &BodyFrame) -> Miss {
        let miss = numeric::miss(&self.chain, joints, target);
        if miss.largest() < 0.01 * POSE_TOLERANCE {
            return miss;
        }
        numeric::descend(&self.chain, target, joints, POLISHED)
    }

    fn search(&self, target: &BodyFrame, near: &[f64], budget: &IkBudget) -> Result<Vec<ArmPosture>, Unreachable> {
        let mut found: Vec<ArmPosture> = Vec::new();
        let mut best = NOTHING;
        for start in 0..budget.starts.max(1) {
            let mut joints: Coordinates = match start {
                0 => near.iter().enumerate().map(|(k, q)| q.clamp(self.chain.lower[k], self.chain.upper[k])).collect(),
                _ => numeric::random_posture(&self.chain, &mut Rng::keyed(budget.seed, "arm_ik", start as u64)),
            };
            let miss = numeric::descend(&self.chain, target, &mut joints, POLISHED);
            if miss.largest() >= POSE_TOLERANCE {
                if miss.largest() < best.largest() {
                    best = miss;
                }
                continue;
            }
            let is_same =
                |other: &ArmPosture| other.joints.iter().zip(&joints).all(|(a, b)| (a - b).abs() < SAME_POSTURE);
            if self.chain.within_limits(&joints, 0.0) && !found.iter().any(is_same) {
                found.push(ArmPosture { joints, free_angle: None });
                if found.len() >= budget.postures {
                    break;
                }
            }
        }
        if found.is_empty() {
            return Err(Unreachable::NotFound { distance: best.distance, angle: best.angle });
        }
        Ok(found)
    }
}

fn frame_of(pose: &Pose) -> BodyFrame {
    BodyFrame { rotation: pose.rotation.to_rotation_matrix().into_inner(), translation: pose.translation.vector }
}
