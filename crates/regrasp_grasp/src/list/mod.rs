//! Lists of grasps of one hand and one object: what `regrasp grasps` finds and the checker judges.
//!
//! `docs/reference/grasp-list-format.md` and `schema/grasps.schema.json` say the same. All poses and points are in the object
//! frame: a list knows no world. The margin is that of [`crate::margin`] with the friction that the list counts on.

/// Double grasps.
pub mod double;
/// Grasps of other tools.
mod foreign;
/// The file as bytes.
pub mod format;
/// Hand, object and promises of a list.
mod heading;
/// Isaac grasp files.
pub mod isaac;
/// The terms of a grasp's score.
pub mod score;
/// What a grasp list may not say.
mod validate;

pub use double::{DoubleGrasp, DoubleGraspList, DoubleGraspSide};
pub use foreign::{ForeignGrasp, ForeignGrasps};
pub use heading::{GraspPromises, GraspSource, GraspStatistics, HandRecord, MeshRecord, ObjectRecord, StablePose};
pub use score::{ScoreWeights, Scores};

use crate::record::{PlanInput, PoseData};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Value of [`GraspList::format`].
pub const FORMAT: &str = "regrasp-grasps";
/// Value of [`GraspList::format_version`].
pub const FORMAT_VERSION: u32 = 1;

/// How the grasps of a list come about.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GraspKind {
    /// Fingertips on contacts chosen one by one (Saut 2010, sec. IV-A).
    #[default]
    Precision,
    /// Two opposed jaws or fingertips on antipodal points.
    Gripper,
    /// Fingers close along their couplings until the fingertips touch.
    Closing,
}

impl GraspKind {
    /// All of them.
    pub const ALL: [GraspKind; 3] = [GraspKind::Precision, GraspKind::Gripper, GraspKind::Closing];

    /// The name in files and arguments.
    pub fn name(self) -> &'static str {
        match self {
            GraspKind::Precision => "precision",
            GraspKind::Gripper => "gripper",
            GraspKind::Closing => "closing",
        }
    }
}

/// A finger on the object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ListedContact {
    /// The finger.
    pub finger: String,
    /// The link of the hand that touches. In this version always the fingertip's link.
    pub link: String,
    /// Contact point in the object frame, in metres.
    pub point_in_object: [f64; 3],
    /// Outward normal of the object there.
    pub normal_in_object: [f64; 3],
    /// Force of the finger on the object, in newtons, in the object frame. All forces of a grasp add up to zero; they leave room
    /// for the object's weight in every direction.
    pub force_in_object: [f64; 3],
    /// Moment of the finger on the object about the outward normal, in newton metres; absent: zero. Soft fingers only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion: Option<f64>,
}

/// The straight line on which the open hand comes to the object, without turning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Approach {
    /// Direction in which the hand moves, a unit vector in the object frame.
    pub direction_in_object: [f64; 3],
    /// Length of the line, in metres. It ends at the grasp.
    pub distance: f64,
}

/// One grasp: where the hand is, how its fingers touch, and the way to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ListedGrasp {
    /// Pose of the hand's base link in the object frame.
    pub object_from_hand: PoseData,
    /// Joint positions of the grasp, in the order of `hand.joint_names`, in radians or metres.
    pub joints: Vec<f64>,
    /// Joint positions of the open hand. From here the joints move to the grasp on a straight line in joint space.
    pub open_joints: Vec<f64>,
    /// The way of the open hand to the grasp.
    pub approach: Approach,
    /// Fingers that touch, in the order of `hand.fingers`.
    pub contacts: Vec<ListedContact>,
    /// Torques, or forces of sliding joints, with which the joints make the contact forces.
    pub joint_torques: Vec<f64>,
    /// Closure margin with the friction that the list counts on: a proven lower bound.
    pub margin: f64,
    /// The margin that the grasp had before refinement; absent where it was not refined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin_before_refinement: Option<f64>,
    /// Weighted mean of `scores`, from 0 to 1. Larger is better.
    pub score: f64,
    /// The terms of the score.
    pub scores: Scores,
    /// Indices of the list's `stable_poses` in which the hand stays above the support: in the grasp, open, and on its whole way.
    pub stable_poses: Vec<usize>,
}

/// Grasps of one hand and one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GraspList {
    /// Always `regrasp-grasps`.
    pub format: String,
    /// Version of the format.
    pub format_version: u32,
    /// Tool and version that wrote it.
    pub tool: String,
    /// How the grasps come about.
    pub kind: GraspKind,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Settings of the search; for people and tools, the checker does not need them.
    pub settings: serde_json::Value,
    /// The files of hand and object, as the command named them; absent in lists that no file was read for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<GraspSource>,
    /// All files that were read.
    pub inputs: Vec<PlanInput>,
    /// The hand.
    pub hand: HandRecord,
    /// The object.
    pub object: ObjectRecord,
    /// What holds for every grasp.
    pub promises: GraspPromises,
    /// Poses in which the object stands on a plane by itself.
    pub stable_poses: Vec<StablePose>,
    /// Counts of the search.
    pub statistics: GraspStatistics,
    /// The grasps, best score first.
    pub grasps: Vec<ListedGrasp>,
}

impl GraspList {
    /// Every floating-point number of the list.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let poses = self.stable_poses.iter().flat_map(StablePose::numbers);
        let grasps = self.grasps.iter().flat_map(ListedGrasp::numbers);
        let held = self.hand.held_joints.values().copied();
        self.object.numbers().chain(self.promises.numbers()).chain(held).chain(poses).chain(grasps)
    }
}

impl ListedGrasp {
    /// Every floating-point number of the grasp.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let joints = self.joints.iter().chain(&self.open_joints).chain(&self.joint_torques).copied();
        let approach = self.approach.direction_in_object.into_iter().chain([self.approach.distance]);
        let of_contact = |contact: &ListedContact| {
            let vectors = [contact.point_in_object, contact.normal_in_object, contact.force_in_object];
            vectors.into_iter().flatten().chain(contact.torsion)
        };
        let contacts = self.contacts.iter().flat_map(of_contact);
        let margins = [self.margin, self.score].into_iter().chain(self.margin_before_refinement);
        let numbers = self.object_from_hand.numbers().chain(joints).chain(approach).chain(contacts);
        numbers.chain(margins).chain(self.scores.numbers())
    }
}
