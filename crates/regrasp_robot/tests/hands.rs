//! Bundled and shared hands against published dimensions.

#[path = "../../../tests/support/places.rs"]
mod places;

use places::{repository, shared_models};
use regrasp_base::Rng;
use regrasp_geometry::Point;
use regrasp_robot::inspect::{InspectSettings, hand_file_text, inspect};
use regrasp_robot::{Hand, LoadOptions, TipShape, load_hand, load_robot};
use std::fs;
use std::path::{Path, PathBuf};

/// A bundled hand.
fn bundled(name: &str) -> PathBuf {
    repository().join("assets/hands").join(name).join("hand.toml")
}

#[test]
fn bundled_hands_follow_the_closed_form_of_their_fingers() {
    // tip = x inward + h (cos t1 z - sin t1 y), x = l1 sin t2 + l2 sin(t2 + t3), h = l1 cos t2 + l2 cos(t2 + t3), in the
    // finger frame whose x points inward.
    for (name, n_fingers, base_radius) in [
        ("wide_four_finger", 4, 0.045),
        ("tight_four_finger", 4, 0.045),
        ("soft_pair", 2, 0.045),
        ("six_finger", 6, 0.055),
    ] {
        let loaded = load_hand(&bundled(name), &LoadOptions::default()).unwrap();
        assert_eq!(loaded.notes, Vec::<String>::new());
        let hand = loaded.hand;
        assert_eq!(hand.fingers.len(), n_fingers);
        assert_eq!(hand.n_joints(), 3 * n_fingers);
        for (k, finger) in hand.fingers.iter().enumerate() {
            assert!(finger.chain.within_limits(&finger.rest, 0.0));
            let azimuth = k as f64 * std::f64::consts::TAU / n_fingers as f64;
            let outward = nalgebra::Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
            let (inward, up) = (-outward, nalgebra::Vector3::z());
            let sideways = up.cross(&inward);
            for [t1, t2, t3] in [[0.0f64, 0.0, 0.0], [0.2, -0.5, 1.1], [-0.3, 0.9, 0.4]] {
                let (x, h) = (0.058 * t2.sin() + 0.05 * (t2 + t3).sin(), 0.058 * t2.cos() + 0.05 * (t2 + t3).cos());
                let expected = base_radius * outward + x * inward + h * (t1.cos() * up - t1.sin() * sideways);
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

/// Files below `folder` that end in `.urdf`, sorted.
fn urdfs_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(dir) = waiting.pop() {
        for entry in fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else if path.extension().is_some_and(|extension| extension == "urdf") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn every_shared_robot_is_read_or_refused_for_a_missing_package() {
    let Some(models) = shared_models() else { return };
    let all = urdfs_below(&models);
    assert!(all.len() >= 20, "{}", all.len());
    let mut n_refused = 0;
    for path in all {
        match load_robot(&path, &LoadOptions::default()) {
            Ok(loaded) => {
                // What was read is a tree that reaches every link.
                let robot = &loaded.robot;
                assert_eq!(robot.joints.len() + 1, robot.links.len(), "{}", path.display());
                assert!((0..robot.links.len()).all(|k| {
                    let joints = robot.joints_to(regrasp_robot::LinkId(k));
                    joints.first().is_none_or(|joint| robot.joints[joint.0].parent == robot.root)
                }));
            }
            Err(error) => {
                n_refused += 1;
                let missing = "package://motion_bench_maker/";
                assert!(error.diagnostics.iter().all(|d| d.code == "U101" && d.problem.contains(missing)), "{error}");
                let package = ("motion_bench_maker".to_owned(), models.join("benchmarks/mbm_configs"));
                let resolve = regrasp_robot::ResolveOptions { packages: vec![package], ..Default::default() };
                // Only the folder names inside the package differ from the original's.
                let error = load_robot(&path, &LoadOptions { resolve, ..Default::default() }).unwrap_err();
                assert!(error.to_string().contains("--package: "), "{error}");
            }
        }
    }
    assert_eq!(n_refused, 3);
}

#[test]
fn independent_joints_of_shared_robots_are_as_listed() {
    let Some(models) = shared_models() else { return };
    // INDEX.md: links, independent joints, mimic joints.
    for (file, links, independent, followers) in [
        ("hands/shadow/shadow_right.urdf", 33, 24, 0),
        ("hands/barrett/barrett.urdf", 9, 8, 0),
        ("hands/trifingeredu/trifingeredu.urdf", 17, 9, 0),
        ("robots/pr2/pr2.urdf", 82, 20, 10),
        ("robots/baxter/baxter.urdf", 49, 14, 0),
        ("robots/tiago_dual_hey5/tiago_dual.urdf", 130, 101, 0),
        ("robots/dual_iiwa14/dual_iiwa14_spheres.urdf", 21, 14, 0),
    ] {
        let robot = load_robot(&models.join(file), &LoadOptions::default()).unwrap().robot;
        let moving: Vec<_> = robot.joints.iter().filter(|j| j.kind != regrasp_robot::JointKind::Fixed).collect();
        let n_followers = moving.iter().filter(|joint| joint.coupling.is_some()).count();
        let seen = (robot.links.len(), moving.len() - n_followers, n_followers);
        assert_eq!(seen, (links, independent, followers), "{file}");
    }
}

/// Largest difference of corresponding tips, bases and limits of two hands, at rest and at mid-range.
fn difference(a: &Hand, b: &Hand) -> f64 {
    let mut largest: f64 = 0.0;
    for (x, y) in a.fingers.iter().zip(&b.fingers) {
        assert_eq!(x.chain.names, y.chain.names);
        assert_eq!((x.name.as_str(), x.tip.link, x.shapes.len()), (y.name.as_str(), y.tip.link, y.shapes.len()));
        for q in [x.rest.clone(), x.chain.lower.clone(), x.chain.upper.clone()] {
            let tips = (x.chain.tip(&q, &x.tip.center_in_body), y.chain.tip(&q, &y.tip.center_in_body));
            largest = largest.max((tips.0 - tips.1).norm());
        }
        largest = largest.max((x.tip.radius() - y.tip.radius()).abs());
    }
    largest
}

#[test]
fn the_hand_file_that_inspect_writes_works_unedited() {
    let Some(models) = shared_models() else { return };
    // Radius of the tip, and distance of its centre from the last joint, from the prototype's notes.
    for (file, n_fingers, radius, distances) in [
        ("allegro/allegro_left.urdf", 4, 0.012, vec![0.0267, 0.0267, 0.0267, 0.0423]),
        ("allegro/allegro_right.urdf", 4, 0.012, vec![0.0267, 0.0267, 0.0267, 0.0423]),
        ("dclaw/dclaw.urdf", 3, 0.010, vec![0.073; 3]),
        ("trifingerpro/trifingerpro.urdf", 3, 0.010, vec![0.1611; 3]),
    ] {
        let path = models.join("hands").join(file);
        let mut rng = Rng::keyed(1, "inspect", 0);
        let seen = inspect(&path, &LoadOptions::default(), &InspectSettings { n_postures: 500 }, &mut rng).unwrap();
        let (hand, table) = seen.hand.unwrap();
        assert_eq!(seen.robot.suspicions, []);
        assert_eq!(hand.fingers.len(), n_fingers, "{file}");
        for (finger, distance) in hand.fingers.iter().zip(distances) {
            assert!((finger.tip.radius() - radius).abs() < 1e-4, "{file} {:?}", finger.tip);
            assert!((finger.tip.center_in_body.coords.norm() - distance).abs() < 1e-4, "{file} {:?}", finger.tip);
            assert!(finger.shapes.iter().any(|shape| shape.is_tip), "{file}");
        }
        assert!(table.pairs.at_rest.is_empty(), "{file} {:?}", table.pairs.at_rest);
        let text = hand_file_text(&hand, &path.display().to_string(), &table.pairs.always_ids);
        let folder = tempfile::tempdir().unwrap();
        let written = folder.path().join("hand.toml");
        fs::write(&written, &text).unwrap();
        let again = load_hand(&written, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert!(difference(&hand, &again.hand) < 2e-6, "{file} {}", difference(&hand, &again.hand));
        assert_eq!(again.hand.allowed_pairs.len(), hand.allowed_pairs.len() + table.pairs.always_ids.len());
    }
}

#[test]
fn a_straight_finger_of_a_bundled_hand_touches_nothing() {
    for name in ["wide_four_finger", "tight_four_finger"] {
        let mut rng = Rng::keyed(1, "inspect", 0);
        let seen =
            inspect(&bundled(name), &LoadOptions::default(), &InspectSettings { n_postures: 2_000 }, &mut rng).unwrap();
        let (mut hand, table) = seen.hand.unwrap();
        assert!(table.pairs.always.is_empty() && table.pairs.at_rest.is_empty());
        // Fingers are far enough apart that random postures touch in less than a tenth of all cases.
        assert!(table.pairs.sometimes.iter().all(|row| row.share < 0.1), "{:?}", table.pairs.sometimes);
        for finger in &mut hand.fingers {
            finger.rest = vec![0.0; 3];
        }
        let straight = regrasp_robot::inspect::inspect_hand(&hand, &InspectSettings { n_postures: 0 }, &mut rng);
        assert!(straight.pairs.at_rest.is_empty(), "{:?}", straight.pairs.at_rest);
    }
}

#[test]
fn trifinger_first_joints_meet_on_the_axis() {
    let Some(models) = shared_models() else { return };
    let hand = load_hand(&models.join("hands/trifingerpro/trifingerpro.urdf"), &LoadOptions::default()).unwrap().hand;
    for finger in &hand.fingers {
        // FACTS.md: first axes pass through (0, 0, 290) mm; segments 53.2 and 167.7, last joint to tip 161.1 mm.
        let mut poses = Vec::new();
        finger.chain.forward(&[0.0; 3], &mut poses);
        let origins: Vec<_> = poses.iter().map(|pose| pose.translation.vector).collect();
        assert!((origins[0] - nalgebra::Vector3::new(0.0, 0.0, 0.29)).norm() < 1e-9);
        assert!(((origins[1] - origins[0]).norm() - 0.0532).abs() < 0.06e-3);
        assert!(((origins[2] - origins[1]).norm() - 0.1677).abs() < 0.06e-3);
        let tip = finger.chain.tip(&[0.0; 3], &finger.tip.center_in_body);
        assert!(((tip.coords - origins[2]).norm() - 0.1611).abs() < 0.06e-3);
    }
}

#[test]
fn frames_agree_with_products_of_matrices() {
    let Some(models) = shared_models() else { return };
    // Origins of frames, from Rodrigues matrices over the URDF's numbers in another language; rpy is Rz Ry Rx.
    let cases: [(&str, &str, &[f64], [f64; 3]); 4] = [
        (
            "allegro/allegro_right.urdf",
            "link_15.0_tip",
            &[0.5, 0.3, 0.7, -0.1],
            [0.070675302, 0.13480602, -0.022035439],
        ),
        ("allegro/allegro_left.urdf", "link_3.0_tip", &[0.2, 0.3, 0.7, 0.4], [0.084685085, 0.068908312, 0.09191265]),
        ("dclaw/dclaw.urdf", "link_f2_head", &[0.2, 0.3, 0.7], [0.042826327, 0.07204462, 0.221787349]),
        (
            "trifingerpro/trifingerpro.urdf",
            "finger_tip_link_240",
            &[0.2, 0.3, -0.7],
            [-0.043043628, 0.003601154, -0.021324676],
        ),
    ];
    for (file, link, coordinates, expected) in cases {
        let hand = load_hand(&models.join("hands").join(file), &LoadOptions::default()).unwrap().hand;
        let link = hand.robot.link_named(link).unwrap();
        let last = *hand
            .robot
            .joints_to(link)
            .iter()
            .rfind(|j| hand.robot.joints[j.0].kind != regrasp_robot::JointKind::Fixed)
            .unwrap();
        let name = &hand.robot.joints[last.0].name;
        let finger = hand.fingers.iter().find(|finger| finger.chain.names.last() == Some(name)).unwrap();
        let origin_in_body = Point::from(hand.robot.fixed_pose_in_body(link).translation.vector);
        let origin = finger.chain.tip(coordinates, &origin_in_body);
        assert!((origin.coords - nalgebra::Vector3::from(expected)).norm() < 2e-9, "{file} {origin}");
    }
}

/// Links that may touch without the hand file saying so, worked out from the tree alone: walking from a link to the root, fixed
/// joints and bodies without shapes are passed, and the first other body with shapes is a neighbour. The planner and the
/// checker share this rule, so that a mistake in it would hide from both.
#[test]
fn links_that_may_touch_are_neighbours_in_the_tree() {
    for name in ["wide_four_finger", "tight_four_finger", "six_finger", "soft_pair"] {
        let hand = load_hand(&bundled(name), &LoadOptions::default()).unwrap().hand;
        let robot = &hand.robot;
        // The link at the root of the body that carries `link`, by fixed joints alone.
        let body_of = |mut link: usize| {
            while let Some(joint) = robot.links[link].parent_joint.map(|id| &robot.joints[id.0]) {
                if joint.kind != regrasp_robot::JointKind::Fixed {
                    break;
                }
                link = joint.parent.0;
            }
            link
        };
        let has_shapes =
            |body: usize| (0..robot.links.len()).any(|l| body_of(l) == body && !robot.links[l].collision.is_empty());
        let parent_body = |body: usize| {
            let mut above = body;
            loop {
                above = body_of(robot.joints[robot.links[above].parent_joint?.0].parent.0);
                if has_shapes(above) {
                    return Some(above);
                }
            }
        };
        let with_shapes: Vec<usize> =
            (0..robot.links.len()).filter(|&l| !robot.links[l].collision.is_empty()).collect();
        for &a in &with_shapes {
            for &b in with_shapes.iter().filter(|&&b| b != a) {
                let (body_a, body_b) = (body_of(a), body_of(b));
                let expected =
                    body_a == body_b || parent_body(body_a) == Some(body_b) || parent_body(body_b) == Some(body_a);
                let found = hand.may_touch(regrasp_robot::LinkId(a), regrasp_robot::LinkId(b));
                let names = [a, b].map(|link| robot.links[link].name.as_str());
                assert_eq!(found, expected, "{name}: {names:?}");
            }
        }
    }
}

/// A coupled joint is where its coupling says, for the planner's chains and by the numbers of the robot file alike.
#[test]
fn coupled_joints_follow_the_numbers_of_the_robot_file() {
    let Some(models) = shared_models() else { return };
    let options = LoadOptions::default();
    let robot =
        load_robot(&models.join("robots/pr2/pr2.urdf"), &LoadOptions { lenient: true, ..options }).unwrap().robot;
    let text = fs::read_to_string(models.join("robots/pr2/pr2.urdf")).unwrap();
    let document = text.split("<joint ").skip(1).map(|part| part.split("</joint>").next().unwrap());
    let mut n_coupled = 0;
    for part in document.filter(|part| part.contains("<mimic ")) {
        let attribute = |text: &str, key: &str| {
            let value = text.split(&format!("{key}=\"")).nth(1)?;
            Some(value.split('"').next().unwrap().to_owned())
        };
        let mimic = part.split("<mimic ").nth(1).unwrap().split('>').next().unwrap();
        let number = |key: &str, default: f64| attribute(mimic, key).map_or(default, |text| text.parse().unwrap());
        let joint = &robot.joints[robot.joint_named(&attribute(part, "name").unwrap()).unwrap().0];
        let found = joint.coupling.as_ref().expect("it is coupled");
        let (leader, multiplier) = found.single().expect("it follows one joint");
        assert_eq!(robot.joints[leader.0].name, attribute(mimic, "joint").unwrap());
        assert_eq!((multiplier, found.offset), (number("multiplier", 1.0), number("offset", 0.0)), "{}", joint.name);
        n_coupled += 1;
    }
    assert_eq!(n_coupled, 10);
}
