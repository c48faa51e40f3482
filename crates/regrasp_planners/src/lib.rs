//! The planners: each a folder, each one entry function. Knows no face.
//!
//! A planner is a free function of scene, query, settings, seed and budget that returns a plan or says why not.

/// Why no plan was found.
pub mod failure;
/// In-hand manipulation by grasp subspaces (papers 000 and 004).
pub mod in_hand;
/// What a graph of grasps looks like.
pub mod outline;
/// Finger tracking (paper 003).
pub mod tracking;

pub use failure::{Cause, Failure, FailureKind, NearestMiss};
pub use in_hand::{InHandSettings, Method, Progress, plan_in_hand};
pub use outline::{Outline, OutlineEdge, OutlineNode};
pub use tracking::{TrackingSettings, plan_tracking};
