//! Hands that close: grippers, and fingers with a motor each.

use crate::sample::{bundled, check, list, settings};
use regrasp_grasp::list::GraspKind;
use regrasp_grasp::list::format::to_json;
use regrasp_grasp_lists::GraspSettings;

fn of(kind: GraspKind, grasps: usize) -> GraspSettings {
    GraspSettings { kind, frames: 20_000, ..settings(grasps) }
}

#[test]
fn a_gripper_whose_jaws_share_a_motor_grasps_antipodal_points() {
    for object in ["sphere_90x.toml", "box_90x.toml", "pencil.toml"] {
        let scene = bundled("parallel_gripper", object);
        let list = list(&scene, &of(GraspKind::Gripper, 20), 1).unwrap_or_else(|failure| panic!("{object}: {failure}"));
        let report = check(&scene, &list);
        assert!(report.accepted(), "{object}: {:?}", report.violations.first());
        assert_eq!(list.grasps.len(), 20, "{object}");
        for grasp in &list.grasps {
            assert_eq!(grasp.contacts.len(), 2);
            let [a, b] = [0, 1].map(|k| regrasp_geometry::Vector::from(grasp.contacts[k].normal_in_object));
            assert!(a.dot(&b) < -0.5, "{object}: {}", a.dot(&b));
            for joints in [&grasp.joints, &grasp.open_joints] {
                assert!((joints[0] - joints[1]).abs() < 1e-12, "{object}: {joints:?}");
            }
        }
    }
}

#[test]
fn fingers_with_a_motor_each_close_until_they_touch() {
    for object in ["sphere_90x.toml", "box_90x.toml"] {
        let scene = bundled("closing_three", object);
        let list = list(&scene, &of(GraspKind::Closing, 10), 1).unwrap_or_else(|failure| panic!("{object}: {failure}"));
        let report = check(&scene, &list);
        assert!(report.accepted(), "{object}: {:?}", report.violations.first());
        assert!(list.grasps.len() >= 5, "{object}: {}", list.grasps.len());
        assert!(list.grasps.iter().all(|grasp| grasp.contacts.len() == 3));
    }
}

#[test]
fn jaws_that_do_not_follow_their_motor_are_rejected() {
    let scene = bundled("parallel_gripper", "box_90x.toml");
    let list = list(&scene, &of(GraspKind::Gripper, 3), 1).unwrap();
    for open in [false, true] {
        let mut broken = list.clone();
        let grasp = &mut broken.grasps[0];
        (if open { &mut grasp.open_joints } else { &mut grasp.joints })[1] += 1e-6;
        let report = check(&scene, &broken);
        assert!(report.violations.iter().any(|violation| violation.message.contains("off the joints that it follows")));
        assert_eq!(report.rejected, [0]);
    }
}

#[test]
fn threads_change_nothing() {
    let scene = bundled("parallel_gripper", "box_90x.toml");
    let with = |n_threads: usize| {
        let settings = GraspSettings { n_threads, ..of(GraspKind::Gripper, 8) };
        to_json(&list(&scene, &settings, 5).unwrap())
    };
    assert_eq!(with(1), with(2));
    assert_eq!(with(1), with(8));
}

#[test]
fn hands_of_another_kind_are_refused_with_the_reason() {
    let scene = bundled("wide_four_finger", "box_90x.toml");
    let failure = list(&scene, &of(GraspKind::Gripper, 3), 0).unwrap_err();
    assert!(failure.message.contains("two fingers; this one has 4"), "{failure}");
}
