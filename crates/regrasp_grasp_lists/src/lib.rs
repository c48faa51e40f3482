//! Lists of grasps of one hand and one object (Saut, Gharbi, Cortes, Sidobre, Simeon 2010, sec. IV-A).
//!
//! [`list_grasps`] looks at frames of a grid, finds contacts finger by finger, keeps grasps that close the object, hold its weight in
//! every direction and have a free way in, chooses those that differ most, and refines them.

/// Stable poses in which a hand stays above the support.
mod above;
/// Fingers that close until they touch.
mod driven;
/// What is prepared of the fingers.
mod fingers;
/// A grasp that was found.
mod found;
/// Grasp frames.
mod frames;
/// Grasps of other tools.
pub mod import;
/// Points in a tree.
mod kd_tree;
/// Which joints of a hand one motor drives.
mod motors;
/// Two hands that hold one object.
pub mod pairs;
/// What is prepared once.
mod prepared;
/// The list of what was found.
mod record;
/// Better margins.
mod refine;
/// A rough look at collisions.
mod rough;
/// Frames in batches, on several threads.
mod run;
/// The search in one frame.
mod search;
/// Which grasps make the list.
mod select;
/// Settings.
pub mod settings;
/// Contacts spread over the surface.
mod surface;
/// The way of the hand.
mod way;
/// The hand with all that hangs on it.
mod whole_hand;

pub use regrasp_manipulation::failure::{Cause, Failure, FailureKind};
pub use run::Progress;
pub use settings::GraspSettings;

use prepared::Prepared;
use regrasp_base::Budget;
use regrasp_grasp::list::GraspList;
use regrasp_manipulation::model::Model;
use regrasp_robot::Hand;
use regrasp_scene::{Gravity, HandView, Limits, Object};
use std::borrow::Cow;

/// Grasps of `object` by `hand`. The same list for the same hand, object, settings and seed, on any number of threads. A budget
/// that runs out leaves a shorter list; where a time limit or the caller cut it, the list says so.
///
/// Errors: why there is no grasp.
pub fn list_grasps(
    hand: &Hand,
    object: &Object,
    settings: &GraspSettings,
    seed: u64,
    budget: &Budget,
) -> Result<GraspList, Failure> {
    list_grasps_telling(hand, object, settings, seed, budget, &|_| {})
}

/// As [`list_grasps`]; `progress` is called now and then.
pub fn list_grasps_telling(
    hand: &Hand,
    object: &Object,
    settings: &GraspSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<GraspList, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    let whole = whole_hand::whole_hand(hand).map_err(|problem| {
        Failure::bare(FailureKind::Impossible, problem, "give the link a collision shape with an inside")
    })?;
    let hand = &whole;
    let view = view_of(hand, object);
    Failure::refuse_many_fingers(&view)?;
    let model = Model::new(&view, &settings.physics());
    refuse_few_fingers(&model)?;
    let threads = run::threads(settings)?;
    threads.install(|| run::run(&Prepared::new(&model, settings, seed)?, budget, progress))
}

/// Hand and object by themselves; the hand stands still.
fn view_of<'a>(hand: &'a Hand, object: &'a Object) -> HandView<'a> {
    HandView {
        hand_index: 0,
        object_index: 0,
        hand_name: "hand",
        hand,
        held_joints: hand.held_joints(),
        world_from_hand: regrasp_geometry::Pose::identity(),
        reach: None,
        object,
        obstacles: Cow::Borrowed(&[]),
        n_beside_palm: 0,
        gravity: Gravity::Any,
        limits: Limits::default(),
        inputs: &[],
    }
}

/// Refuses hands that can never close an object with their fingertips.
fn refuse_few_fingers(model: &Model) -> Result<(), Failure> {
    let contacts: Vec<_> = model.fingers.iter().map(|finger| finger.contact).collect();
    if regrasp_grasp::closure::may_close(&contacts, model.frame.friction) {
        return Ok(());
    }
    let message = format!(
        "a hand of {} cannot close an object with friction {}: force closure needs three fingertips with friction, or two \
         soft ones",
        regrasp_manipulation::model::fingers_in_words(model),
        regrasp_manipulation::model::friction_in_words(model),
    );
    let advice = "name more fingers in the hand file, make the fingertips soft (torsion_radius), or use --kind gripper";
    Err(Failure::bare(FailureKind::Impossible, message, advice))
}
