//! Rest postures: in the middle of the limits, flexion bent towards the palm.

use crate::import::assemble::HandSpec;
use crate::robot::Robot;

/// Sets the rest posture of every finger of `spec`.
pub(super) fn bend_towards_palm(_robot: &Robot, _spec: &mut HandSpec) {}
