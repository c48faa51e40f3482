//! Where the fingertips are.

use crate::story::{FingerStory, SceneStory};
use regrasp_geometry::Point;

/// Centres of the fingertips in the world, in the order of the fingers.
pub fn tip_centers(scene: &SceneStory, joints: &[f64]) -> Vec<Point> {
    let world_from_link = scene.hand().world_from_links(joints);
    let tip = |finger: &FingerStory| world_from_link[finger.tip_link] * Point::from(finger.tip_center_in_link);
    scene.hand().fingers.iter().map(tip).collect()
}
