//! Settings of motions, forces and times: what all planners of motions in the hand share.

/// Contact forces.
mod forces;
/// Motions.
mod physics;
/// Times.
mod speed;

pub use forces::ForceSettings;
pub use physics::{PhysicsSettings, TransferMode};
pub use speed::SpeedSettings;
