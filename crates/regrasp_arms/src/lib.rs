//! Motions of whole robots among obstacles.
//!
//! Bodies are covered by balls. Eight configurations are looked at together (`lanes`), so that the compiler uses vector
//! instructions. A motion is *sampled* (configurations at a step, balls only) or *certified* (every moment, by bounds of how far
//! each body moves between two moments).

/// Blocks of eight numbers.
pub mod lanes;
/// The robot as planning sees it.
pub mod model;
/// Are motions free?
pub mod motion;
/// From a query to a plan.
pub mod plan;
/// Roadmaps for many queries.
pub mod roadmap;
/// Paths from configuration to configuration.
pub mod search;
/// Times along paths.
pub mod times;
/// What stands around the robot.
pub mod world;

pub use model::ArmModel;
pub use motion::Collider;
pub use plan::leg::{Leg, LegTimes, plan_leg};
pub use plan::problem::{Covers, Problem};
pub use plan::{Stage, plan_in_stages, plan_motion};
pub use world::World;
