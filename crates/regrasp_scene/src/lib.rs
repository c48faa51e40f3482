//! Hands, objects, supports and obstacles, the scene file, and who may touch whom. Knows no planner.

/// Who may not touch whom.
pub mod collision_pairs;
/// Where an object has to go.
pub mod goal;
/// Which way things fall.
pub mod gravity;
/// The scene as one hand sees it.
pub mod hand_view;
/// What a plan may ask of hand and object.
pub mod limits;
/// The scene file.
pub mod load;
/// One hand that manipulates one object.
pub mod manipulation;
/// Motions of whole robots.
pub mod motion;
/// The object that is manipulated.
pub mod object;
/// Pick and place.
pub mod pick_and_place;
/// What is asked: start and goal of an object, and how the grasps are given.
pub mod query;
/// The scene: hands, objects, supports, obstacles.
pub mod scene;
/// What moves in a scene.
pub mod state;

pub use collision_pairs::{CollisionPairs, FingerShapeId, collision_pairs};
pub use goal::Goal;
pub use gravity::{Gravity, STANDARD_GRAVITY};
pub use hand_view::HandView;
pub use limits::Limits;
pub use load::{GraspScene, MeshObject, ObjectSource, load_grasp_scene};
pub use load::{LoadedScene, OpenStart, StartOrientation, Stock, Task, load_scene, load_scene_text, load_scene_with};
pub use manipulation::{Manipulation, is_of_hand};
pub use motion::{CarriedObject, Holder, MotionGoal, MotionQuery, WristGoal};
pub use object::Object;
pub use pick_and_place::{GraspFile, PickAndPlaceQuery};
pub use query::{GRASP_TOLERANCE, GRASP_TURN_TOLERANCE, GraspRequest, InHandQuery, Query, StartChoice, TrackingQuery};
pub use scene::{HandCarrier, InputFile, Obstacle, Scene, SceneHand, Support};
pub use state::State;
