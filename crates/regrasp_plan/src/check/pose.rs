//! Poses: how far apart two are, and what lies between them.

use crate::plan::PoseData;
use regrasp_geometry::Pose;

/// Distance and angle between two poses.
pub fn pose_difference(a: &PoseData, b: &PoseData) -> (f64, f64) {
    let (a, b) = (Pose::from(a), Pose::from(b));
    let (p, q) = (a.rotation.coords, b.rotation.coords);
    let q = if p.dot(&q) < 0.0 { -q } else { q };
    ((a.translation.vector - b.translation.vector).norm(), 4.0 * (p - q).norm().atan2((p + q).norm()))
}

/// The pose `t` of the way between two waypoints: position linear, orientation by the shorter great circle.
pub fn pose_between(from: &Pose, to: &Pose, t: f64) -> Pose {
    let a = from.rotation.coords;
    let b = if a.dot(&to.rotation.coords) < 0.0 { -to.rotation.coords } else { to.rotation.coords };
    let angle = 2.0 * (a - b).norm().atan2((a + b).norm());
    let (at_a, at_b) = if angle < 1e-9 {
        (1.0 - t, t)
    } else {
        (((1.0 - t) * angle).sin() / angle.sin(), (t * angle).sin() / angle.sin())
    };
    let coords = a * at_a + b * at_b;
    let rotation = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::from_vector(coords));
    let position = from.translation.vector * (1.0 - t) + to.translation.vector * t;
    Pose::from_parts(nalgebra::Translation3::from(position), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn the_motion_between_waypoints_is_the_one_that_plans_mean() {
        let mut rng = Rng::keyed(1, "pose_between", 0);
        for _ in 0..500 {
            let mut pose = || {
                let position = std::array::from_fn(|_| rng.uniform(-0.1, 0.1));
                regrasp_geometry::pose_from(position, rng.quat_xyzw())
            };
            let (a, b) = (pose(), pose());
            let t = rng.unit();
            let (ours, theirs) = (pose_between(&a, &b, t), regrasp_geometry::interpolate_pose(&a, &b, t));
            assert!((ours.to_homogeneous() - theirs.to_homogeneous()).norm() < 1e-9);
        }
    }
}
