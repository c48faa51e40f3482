//! Bundled and shared hands against published dimensions.

use regrasp_geometry::Point;
use regrasp_robot::{LoadOptions, TipShape, load_hand};
use std::path::{Path, PathBuf};

/// A bundled hand.
fn bundled(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands").join(name).join("hand.toml")
}

/// The folder of shared models: `REGRASP_MODELS`, else `shared/models` beside a folder above this crate.
fn shared_models() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("REGRASP_MODELS") {
        return Some(PathBuf::from(given));
    }
    let crate_root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let found = crate_root.ancestors().map(|dir| dir.join("shared/models")).find(|dir| dir.is_dir());
    if found.is_none() {
        println!("SKIPPED: no shared models");
    }
    found
}

#[test]
fn bundled_hands_follow_the_closed_form_of_their_fingers() {
    // tip = x inward + h (cos t1 z - sin t1 y), x = l1 sin t2 + l2 sin(t2 + t3), h = l1 cos t2 + l2 cos(t2 + t3), in the
    // finger frame whose x points inward.
    for name in ["wide_four_finger", "tight_four_finger"] {
        let loaded = load_hand(&bundled(name), &LoadOptions::default()).unwrap();
        assert_eq!(loaded.notes, Vec::<String>::new());
        let hand = loaded.hand;
        assert_eq!(hand.fingers.len(), 4);
        assert_eq!(hand.n_joints(), 12);
        for (k, finger) in hand.fingers.iter().enumerate() {
            assert!(finger.chain.within_limits(&finger.rest, 0.0));
            let azimuth = k as f64 * std::f64::consts::FRAC_PI_2;
            let outward = nalgebra::Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
            let (inward, up) = (-outward, nalgebra::Vector3::z());
            let sideways = up.cross(&inward);
            for [t1, t2, t3] in [[0.0f64, 0.0, 0.0], [0.2, -0.5, 1.1], [-0.3, 0.9, 0.4]] {
                let (x, h) = (0.058 * t2.sin() + 0.05 * (t2 + t3).sin(), 0.058 * t2.cos() + 0.05 * (t2 + t3).cos());
                let expected = 0.045 * outward + x * inward + h * (t1.cos() * up - t1.sin() * sideways);
                let tip = finger.chain.tip(&[t1, t2, t3], &finger.tip.center_in_body);
                assert!((tip.coords - expected).norm() < 1e-12, "{name} {} {tip} {expected}", finger.name);
            }
        }
    }
}

#[test]
fn allegro_has_the_published_joint_positions_and_tips() {
    let Some(models) = shared_models() else { return };
    let loaded = load_hand(&models.join("hands/allegro/allegro_right.urdf"), &LoadOptions::default()).unwrap();
    let hand = loaded.hand;
    assert_eq!(hand.fingers.len(), 4);
    assert_eq!(hand.n_joints(), 16);
    // FACTS.md, millimetres: base positions, distances between joints, last joint to tip frame.
    let bases = [[0.0, 43.5, -1.5], [0.0, 0.0, 0.7], [0.0, -43.5, -1.5], [-18.2, 19.3, -46.0]];
    let segments = [[16.4, 54.0, 38.4], [16.4, 54.0, 38.4], [16.4, 54.0, 38.4], [48.4, 17.7, 51.4]];
    let last_to_tip_frame = [38.7, 38.7, 38.7, 54.3];
    for (k, finger) in hand.fingers.iter().enumerate() {
        let mut poses = Vec::new();
        finger.chain.forward(&[0.0; 4], &mut poses);
        let origins: Vec<Point> = poses.iter().map(|pose| Point::from(pose.translation.vector)).collect();
        let base = Point::new(bases[k][0], bases[k][1], bases[k][2]) / 1e3;
        assert!((origins[0] - base).norm() < 0.11e-3, "{}: {}", finger.name, origins[0]);
        for s in 0..3 {
            assert!(((origins[s + 1] - origins[s]).norm() - segments[k][s] / 1e3).abs() < 0.06e-3);
        }
        // The tip is a ball of 12 mm, 12 mm before the tip frame.
        let TipShape::Sphere { radius } = finger.tip.shape else { panic!("{:?}", finger.tip) };
        assert!((radius - 0.012).abs() < 1e-4, "{} {radius}", finger.name);
        let expected = Point::new(0.0, 0.0, last_to_tip_frame[k] / 1e3 - 0.012);
        assert!((finger.tip.center_in_body - expected).norm() < 1e-4, "{}", finger.tip.center_in_body);
    }
}
