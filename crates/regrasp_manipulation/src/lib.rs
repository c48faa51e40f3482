//! What the planners of motions in the hand share. Knows no planner.
//!
//! A planner prepares the scene once ([`model`]), asks whether motions collide ([`workspace`]), rolls fingertips ([`rolling`]),
//! relocates fingers ([`relocation`]), asks for contact forces ([`forces`]), and writes the plan down ([`recording`], [`timing`]).

/// The poses of a query, and the grasps that it gives.
pub mod ends;
/// Why no plan was found.
pub mod failure;
/// Fingers that cannot follow an object that moves.
pub mod following;
/// Contact forces of the fingers.
pub mod forces;
/// Grasps and the motions between them.
pub mod grasp;
/// From the hand's frame into the world.
pub mod in_world;
/// The scene prepared for planning.
pub mod model;
/// Settings of motions of whole robots.
pub mod motion_settings;
/// What a graph of grasps looks like.
pub mod outline;
/// How a finger that relocates passes over the object.
pub mod passing;
/// What a running search tells its caller.
pub mod progress;
/// The plan as it is written to a file.
pub mod recording;
/// The relocation of one finger.
pub mod relocation;
/// The nearest miss of a task of a whole robot.
pub mod robot_miss;
/// Fingertips that roll.
pub mod rolling;
/// Settings of motions, forces and times.
pub mod settings;
/// Settings of pick and place.
pub mod task_settings;
/// Times of waypoints.
pub mod timing;
/// Tolerances that plans promise.
pub mod tolerances;
/// Configurations and continuous collision tests.
pub mod workspace;
