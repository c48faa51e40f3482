//! Starts from what was observed, in the world.

use super::effective;
use crate::settings::InHandSettings;
use regrasp_geometry::{Pose, Vector};
use regrasp_manipulation::ends::project;
use regrasp_manipulation::failure::Failure;
use regrasp_manipulation::model::Model;
use regrasp_scene::{GraspRequest, HandView};

pub use regrasp_manipulation::ends::project::{Moved, ProjectionLimits, Touching};

/// What was observed of a hand and its object, in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Pose of the object.
    pub world_from_object: Pose,
    /// Positions of all joints, in the order of `Hand::joint_names`, in radians or metres.
    pub joints: Vec<f64>,
    /// Velocities, where they are known.
    pub velocities: Option<ObservedVelocities>,
    /// For every finger whether it presses on something, where that is felt.
    pub presses: Option<Vec<bool>>,
}

/// Velocities of hand and object, in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedVelocities {
    /// Of all joints, in radians or metres per second.
    pub joints: Vec<f64>,
    /// Of the origin of the object's frame, in metres per second.
    pub linear: Vector,
    /// Of the object, in radians per second.
    pub angular: Vector,
}

/// A valid start.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Pose of the object in the world.
    pub world_from_object: Pose,
    /// Positions of all joints.
    pub joints: Vec<f64>,
    /// For every finger whether it holds.
    pub holds: Vec<bool>,
    /// What every finger was seen to do.
    pub touching: Vec<Touching>,
    /// How far the start is from what was observed.
    pub moved: Moved,
}

impl Start {
    /// The grasp that a query from here begins with.
    pub fn grasp(&self) -> GraspRequest {
        GraspRequest::Posture { joints: self.joints.clone(), holds: self.holds.clone() }
    }
}

/// The start nearest to `observed` that planning with `settings` does not refuse.
///
/// Errors: numbers that make no sense; no start within `limits`, and why.
pub fn nearest_start(
    view: &HandView,
    settings: &InHandSettings,
    observed: &Observation,
    limits: &ProjectionLimits,
) -> Result<Start, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    Failure::refuse_many_fingers(view)?;
    Failure::refuse_tied_fingers(view)?;
    let model = Model::new(view, &effective(settings).within(&view.limits).physics);
    let turn = view.world_from_hand.rotation.inverse();
    let seen = project::Observed {
        hand_from_object: view.hand_from(&observed.world_from_object),
        joints: observed.joints.clone(),
        velocities: observed.velocities.as_ref().map(|velocities| project::Velocities {
            joints: velocities.joints.clone(),
            linear: turn * velocities.linear,
            angular: turn * velocities.angular,
        }),
        presses: observed.presses.clone(),
    };
    let found = project::project(&model, &seen, limits)?;
    Ok(Start {
        world_from_object: view.world_from(&found.state.world_from_object),
        joints: found.state.joints.iter().flatten().copied().collect(),
        holds: (0..model.n_fingers()).map(|finger| found.state.holds(finger)).collect(),
        touching: found.touching,
        moved: found.moved,
    })
}
