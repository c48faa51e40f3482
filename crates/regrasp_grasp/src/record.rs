//! What plan files and grasp lists share: poses, and the files that they were made from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pose on disk.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct PoseData {
    /// Position, in metres.
    pub position: [f64; 3],
    /// Orientation as a unit quaternion, x y z w, with w >= 0.
    pub quat_xyzw: [f64; 4],
}

impl PoseData {
    /// Every number of the pose.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + use<> {
        self.position.into_iter().chain(self.quat_xyzw)
    }
}

impl From<&regrasp_geometry::Pose> for PoseData {
    fn from(pose: &regrasp_geometry::Pose) -> Self {
        let (position, quat_xyzw) = regrasp_geometry::frame::parts_of(pose);
        PoseData { position, quat_xyzw }
    }
}

impl From<&PoseData> for regrasp_geometry::Pose {
    fn from(data: &PoseData) -> Self {
        regrasp_geometry::pose_from(data.position, data.quat_xyzw)
    }
}

/// A file the plan was made from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct PlanInput {
    /// What it is for: `scene`, `hand`, `urdf`, `srdf`, `mesh`.
    pub role: String,
    /// How the scene names it: relative to the scene file, or `package://`.
    pub name: String,
    /// SHA-256 of its bytes, lower-case hexadecimal.
    pub sha256: String,
}
