//! `regrasp`: plans what a multi-fingered hand has to do to turn an object, and judges the plan independently.
//!
//! Load a scene, plan, check:
//! [`scene`] reads files, [`planners`] plans, [`plan`] holds the plan and its checker. Frames, units and the glossary are in
//! `CONVENTIONS.md`; the tower of crates is in `ARCHITECTURE.md`.

/// What a written file calls another one.
pub mod file_names;
/// Failures and roadmaps as the data that pages are made of.
pub mod pictures;
/// Scenes in which an object is to be placed.
pub mod placing;
/// One entry for every kind of task.
pub mod planning;
/// Roadmaps of robots.
pub mod robot_roadmap;
/// Scene files as text.
pub mod scene_text;
/// Many queries of one scene, from where things really are.
pub mod session;
/// Settings from several places.
pub mod settings;
/// Grasp lists of tasks of pick and place.
pub mod task_grasps;

pub use regrasp_arms as arms;
pub use regrasp_base as base;
pub use regrasp_export as export;
pub use regrasp_geometry as geometry;
pub use regrasp_grasp as grasp;
pub use regrasp_grasp_lists as grasp_lists;
pub use regrasp_plan as plan;
pub use regrasp_planners as planners;
pub use regrasp_roadmap as roadmap;
pub use regrasp_robot as robot;
pub use regrasp_scene as scene;
pub use regrasp_tasks as tasks;
pub use regrasp_viewer as viewer;

pub use planning::{plan_any, plan_task};
pub use regrasp_base::{Budget, InputError};
pub use regrasp_grasp::GraspList;
pub use regrasp_grasp_lists::{GraspSettings, list_grasps};
pub use regrasp_plan::{AnyPlan, Plan, RobotPlan};
pub use regrasp_planners::{
    Failure, InHandSettings, Method, PlannerSettings, TrackingMethod, TrackingSettings, plan_in_hand, plan_tracking,
};
pub use regrasp_scene::{HandView, InHandQuery, Manipulation, MotionQuery, Query, Scene, State, TrackingQuery};
pub use session::Session;
