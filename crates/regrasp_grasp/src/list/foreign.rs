//! Grasps of other tools: poses and joints by name, without contacts.

use crate::list::GraspList;
use crate::record::PoseData;
use std::collections::BTreeMap;

/// A grasp that another tool made.
#[derive(Debug, Clone, PartialEq)]
pub struct ForeignGrasp {
    /// Its name.
    pub name: String,
    /// Pose of the hand's link in the object frame.
    pub object_from_link: PoseData,
    /// What the other tool thinks of it.
    pub confidence: Option<f64>,
    /// Joint positions of the grasp.
    pub joints: BTreeMap<String, f64>,
    /// Joint positions of the open hand.
    pub open_joints: Option<BTreeMap<String, f64>>,
}

/// Grasps that another tool made.
#[derive(Debug, Clone, PartialEq)]
pub struct ForeignGrasps {
    /// The link of the hand whose pose is given.
    pub hand_link: String,
    /// The grasps.
    pub grasps: Vec<ForeignGrasp>,
}

impl From<&GraspList> for ForeignGrasps {
    /// A list of ours as one of another tool.
    fn from(list: &GraspList) -> Self {
        let named = |joints: &[f64]| list.hand.joint_names.iter().cloned().zip(joints.iter().copied()).collect();
        let grasps = list.grasps.iter().enumerate().map(|(index, grasp)| ForeignGrasp {
            name: format!("grasp_{index}"),
            object_from_link: grasp.object_from_hand,
            confidence: Some(grasp.score),
            joints: named(&grasp.joints),
            open_joints: Some(named(&grasp.open_joints)),
        });
        ForeignGrasps { hand_link: list.hand.base_link.clone(), grasps: grasps.collect() }
    }
}
