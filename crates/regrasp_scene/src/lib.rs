//! Robots, objects and obstacles, the scene file, and who may touch whom. Knows no planner.

/// Who may not touch whom.
pub mod collision_pairs;
/// Which way things fall.
pub mod gravity;
/// What a plan may ask of hand and object.
pub mod limits;
/// The scene file.
pub mod load;
/// The object that is manipulated.
pub mod object;
/// What is asked: start and goal of the object, and how the grasps are given.
pub mod query;
/// The scene: hand, object, obstacles.
pub mod scene;

pub use collision_pairs::{CollisionPairs, FingerShapeId, collision_pairs};
pub use gravity::{Gravity, STANDARD_GRAVITY};
pub use limits::Limits;
pub use load::{Goal, InHandTask, LoadedScene, StartOrientation, load_scene};
pub use object::Object;
pub use query::{GRASP_TOLERANCE, GRASP_TURN_TOLERANCE, GraspRequest, InHandQuery, TaskKind};
pub use scene::{InputFile, Obstacle, Scene};
