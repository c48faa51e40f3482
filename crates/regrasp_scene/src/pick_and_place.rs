//! Pick and place: an object stands somewhere, and shall stand somewhere else.

use regrasp_geometry::Pose;
use std::path::PathBuf;

/// The task of a [`PickAndPlaceQuery`], as scene and plan files spell it.
pub const PICK_AND_PLACE: &str = "pick_and_place";

/// An object stands on a support, and shall stand on a support somewhere else. How it gets there is the planner's choice: one hand
/// carries it, hands give it to each other, it is put down and taken again (Saut 2010). All poses are in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct PickAndPlaceQuery {
    /// Name of the task in the scene file; empty where the file has only one.
    pub name: String,
    /// The robot, by its index in `Scene::robots`.
    pub robot: usize,
    /// The object, by its index in `Scene::objects`. All other objects rest.
    pub object: usize,
    /// Where the object stands at the start.
    pub world_from_object_start: Pose,
    /// Where it shall stand.
    pub world_from_object_goal: Pose,
    /// Values of all coordinates at the start, in the order of the robot's layout. No hand holds anything.
    pub start: Vec<f64>,
    /// Values of all coordinates at the end.
    pub end: Vec<f64>,
}

/// A list of grasps that the scene names for one hand and one object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GraspFile {
    /// The object, by its index in `Scene::objects`.
    pub object: usize,
    /// The hand, by its index in `Scene::hands`.
    pub hand: usize,
    /// How the scene file names it.
    pub name: String,
    /// Where it was found.
    pub path: PathBuf,
}
