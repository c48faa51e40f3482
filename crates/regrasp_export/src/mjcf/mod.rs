//! A MuJoCo model of a plan's scene: hands, objects, supports, obstacles, and a keyframe for every waypoint.
//!
//! What may touch in the model is what the checker keeps apart (`regrasp_scene::collision_pairs`), pair by pair; pairs that
//! the hand allows never touch. Servos hold the hands that the plan does not move. An object that the plan does not move stands
//! on its support, or a weld holds it. A round fingertip touches the object with its ball, as the plan means it, and everything else
//! with the shapes of its link. MuJoCo collides with convex shapes only: an object that is not convex is cut into
//! convex parts, and a note says by how much they exceed it. `docs/reference/replay.md` has the settings and where they come from.

mod clear;
mod geom;
pub(crate) mod grasps;
mod hand;
mod inertia;
mod model;
mod names;
mod object;
mod robot;
mod solid;
mod tip;
mod xml;

pub use robot::robot_to_mjcf;

use regrasp_plan::Plan;
use regrasp_scene::Manipulation;
use solid::ObjectSolid;

/// A model, ready to be written to a file or loaded from memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mjcf {
    /// The MJCF document; it names no other file.
    pub xml: String,
    /// Where the model differs from the scene.
    pub notes: Vec<String>,
}

/// Why there is no model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MjcfError {
    /// Joints or fingers of plan and scene differ.
    #[error("the plan is for another hand: its {what} are {plan}, those of the scene's hand {scene}")]
    AnotherHand {
        /// `joints` or `fingers`.
        what: &'static str,
        /// Names in the plan.
        plan: String,
        /// Names in the scene.
        scene: String,
    },
}

/// The MuJoCo model of the scene of `task`, with the waypoints of `plan` as keyframes `segment_waypoint`, both from 0.
///
/// Names: bodies and joints as links and joints of the robot; the object is the body `object` (with underscores where a link
/// has that name) with the free joint of the same name; of each finger the site `FINGER:tip` at the tip's centre and, for
/// a round tip, the geom `FINGER:tip`; other geoms are `LINK:k`, `obstacle:NAME`, `support:NAME` and `object`, with `object:1`
/// and so on for further convex parts. In scenes of
/// several hands or objects the name of the hand or object and a slash stand before each: `right/palm`, `box/object`.
///
/// Errors: the plan is not for this scene's hand.
pub fn to_mjcf(task: &Manipulation, plan: &Plan) -> Result<Mjcf, MjcfError> {
    must_be_of_hand(task, &plan.joint_names, &plan.fingers)?;
    let solids: Vec<ObjectSolid> = task.scene.objects.iter().map(ObjectSolid::of).collect();
    Ok(model::write(task, plan, &solids))
}

/// Joints and fingers have the names of the hand's.
fn must_be_of_hand(task: &Manipulation, joint_names: &[String], fingers_named: &[String]) -> Result<(), MjcfError> {
    let fingers: Vec<String> = task.hand().fingers.iter().map(|finger| finger.name.clone()).collect();
    for (what, in_plan, in_scene) in
        [("joints", joint_names, task.hand().joint_names()), ("fingers", fingers_named, fingers)]
    {
        if in_plan != in_scene {
            return Err(MjcfError::AnotherHand { what, plan: in_plan.join(", "), scene: in_scene.join(", ") });
        }
    }
    Ok(())
}
