//! The bundled robot with torso, two arms and two hands: published positions, mirror images, and postures without collisions.

use super::places::repository;
use super::{assert_consistent, random_state};
use regrasp_base::Rng;
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_robot::{LinkId, LoadOptions, Manipulator, Part, load_hand, load_manipulator};

fn robot() -> Manipulator {
    let path = repository().join("assets/robots/upper_body/robot.toml");
    load_manipulator(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")).manipulator
}

/// `joints` of the right side and the torso in degrees, by the ends of their names; equal angles on both sides.
fn state_of(robot: &Manipulator, joints: &[(&str, &[f64])]) -> Vec<f64> {
    let mut state = vec![0.0; robot.layout.len()];
    for (stem, values) in joints {
        let is_own = |name: &str| name.contains(stem) && !name.starts_with("left");
        let own = (0..state.len()).filter(|&k| is_own(&robot.layout.coordinates[k].name));
        for (k, value) in own.zip(values.iter()) {
            let twin = robot.layout.index_of(&robot.layout.coordinates[k].name.replace("right", "left"));
            for k in [k, twin.unwrap()] {
                state[k] = value.to_radians();
            }
        }
    }
    state
}

#[test]
fn it_has_43_joints_in_a_torso_two_arms_and_two_hands() {
    let robot = robot();
    let parts = [Part::Common, Part::Arm(0), Part::Hand(0), Part::Arm(1), Part::Hand(1)];
    assert_eq!(parts.map(|part| robot.layout.range(part)), [0..3, 3..10, 10..23, 23..30, 30..43]);
    assert_eq!(robot.layout.names()[..3], ["torso_yaw", "torso_1", "torso_2"]);
    let degrees = |name: &str| {
        let coordinate = &robot.layout.coordinates[robot.layout.index_of(name).unwrap()];
        [coordinate.lower, coordinate.upper].map(|limit| (limit.to_degrees() * 1e6).round() / 1e6)
    };
    for (name, limits) in [
        ("torso_yaw", [-140.0, 200.0]),
        ("torso_1", [-70.0, 90.0]),
        ("torso_2", [0.0, 135.0]),
        ("left_arm_6", [-45.0, 80.0]),
        ("right_arm_7", [-45.0, 135.0]),
        ("right/thumb_rotation", [0.0, 90.0]),
        ("left/ring_prox", [-19.0, 90.0]),
        ("left/fore_mid", [0.0, 70.0]),
    ] {
        assert_eq!(degrees(name), limits, "{name}");
    }
    // The limits of torso_3, -135..0 degrees, leave 0 <= torso_1 + torso_2 <= 135 degrees.
    let limits = &robot.layout.linear_limits;
    assert_eq!((limits.len(), limits[0].joint.as_str()), (1, "torso_3"));
    let leaning = |torso_1: f64, torso_2: f64| {
        let mut state = robot.layout.rest();
        (state[1], state[2]) = (torso_1.to_radians(), torso_2.to_radians());
        robot.layout.within_limits(&state, 0.0)
    };
    assert!(leaning(-30.0, 60.0) && leaning(0.0, 134.9) && leaning(-69.0, 69.1));
    assert!(!leaning(-30.0, 29.0) && !leaning(30.0, 106.0) && !leaning(1.0, 135.0));
    // Speeds and torques are stated for every joint.
    let limits = robot.layout.coordinates.iter().map(|c| robot.robot.joints[c.joint.0].limits.unwrap());
    assert!(limits.into_iter().all(|l| l.velocity.is_some() && l.effort.is_some()));
}

#[test]
fn links_are_where_the_published_robot_has_them() {
    let robot = robot();
    let bent = state_of(
        &robot,
        &[
            ("torso", &[0.0, -30.0, 60.0]),
            ("arm", &[30.0, -70.0, 15.0, 80.0, -40.0, 20.0, 35.0]),
            ("thumb", &[45.0, 10.0, 20.0, 30.0]),
            ("fore", &[5.0, 20.0, 30.0]),
            ("middle", &[-5.0, 25.0, 35.0]),
            ("ring", &[10.0, 15.0, 20.0]),
        ],
    );
    let zero = vec![0.0; robot.layout.len()];
    let tip = [0.029, 0.0, 0.0];
    let origin = [0.0; 3];
    let mut poses = Vec::new();
    for (state, link, point, expected) in [
        (&zero, "_arm_4", origin, [0.088, -0.60241, 1.0955]),
        (&zero, "_arm_7", origin, [0.088, -0.94016, 1.2905]),
        (&zero, "/palm", origin, [0.088, -1.04235, 1.3495]),
        (&zero, "/fore_dist", tip, [0.13275, -1.28556, 1.49338]),
        (&bent, "_arm_4", origin, [0.27594, -0.53724, 0.60161]),
        (&bent, "_arm_7", origin, [0.61204, -0.55828, 0.79831]),
        (&bent, "/palm", origin, [0.72461, -0.59001, 0.78266]),
        (&bent, "/fore_dist", tip, [0.96823, -0.58734, 0.69580]),
        (&bent, "/thumb_dist", tip, [0.94828, -0.56805, 0.71429]),
        (&bent, "/middle_dist", tip, [0.94220, -0.63495, 0.67306]),
        (&bent, "/ring_dist", tip, [0.96387, -0.66704, 0.68818]),
    ] {
        robot.link_poses(state, &mut poses);
        for (side, sign) in [("right", 1.0), ("left", -1.0)] {
            let id = robot.robot.link_named(&format!("{side}{link}")).unwrap();
            let seen = poses[id.0] * Point::from(point);
            let expected = Vector::new(expected[0], sign * expected[1], expected[2]);
            assert!((seen.coords - expected).norm() < 2e-5, "{side}{link}: {seen} instead of {expected}");
        }
        assert_consistent(&robot, state);
    }
}

/// Centres of the collision shapes of a link in the world, of sphere, capsule and box alike.
fn centers(robot: &Manipulator, poses: &[Pose], link: LinkId) -> Vec<Point> {
    let shapes = robot.robot.links[link.0].collision.iter();
    shapes.map(|placed| poses[link.0] * placed.parent_from_shape * Point::origin()).collect()
}

#[test]
fn equal_angles_on_both_sides_are_mirror_images_shapes_included() {
    let robot = robot();
    let mut rng = Rng::keyed(1, "mirror", 0);
    let mut poses = Vec::new();
    for _ in 0..20 {
        let mut state = random_state(&robot, &mut rng);
        state[0] = 0.0;
        for k in robot.layout.range(Part::Arm(0)).chain(robot.layout.range(Part::Hand(0))) {
            let twin = robot.layout.coordinates[k].name.replace("right", "left");
            state[robot.layout.index_of(&twin).unwrap()] = state[k];
        }
        robot.link_poses(&state, &mut poses);
        let mut n_shapes = 0;
        for (index, link) in robot.robot.links.iter().enumerate().filter(|(_, link)| link.name.starts_with("right")) {
            let twin = robot.robot.link_named(&link.name.replace("right", "left")).unwrap();
            let pairs = centers(&robot, &poses, LinkId(index)).into_iter().zip(centers(&robot, &poses, twin));
            for (right, left) in pairs {
                let mirrored = Point::new(right.x, -right.y, right.z);
                assert!((mirrored - left).norm() < 1e-12, "{}: {right} and {left}", link.name);
                n_shapes += 1;
            }
        }
        assert_eq!(n_shapes, 9 + 1 + 1 + 4 * 4);
        assert_consistent(&robot, &state);
    }
}

/// Pairs of links that touch in a state, by name.
fn touching(robot: &Manipulator, state: &[f64]) -> Vec<[String; 2]> {
    let mut poses = Vec::new();
    robot.link_poses(state, &mut poses);
    let mut found = Vec::new();
    let links: Vec<LinkId> = (0..robot.robot.links.len()).map(LinkId).collect();
    let placed = |link: LinkId| {
        let at = |placed: &regrasp_geometry::shape::PlacedShape| {
            let pose = poses[link.0] * placed.parent_from_shape;
            let rotation = pose.rotation.to_rotation_matrix().into_inner();
            (placed.shape.clone(), Placement { rotation, translation: pose.translation.vector })
        };
        robot.robot.links[link.0].collision.iter().map(at).collect::<Vec<_>>()
    };
    for &a in &links {
        for &b in links[..a.0].iter().filter(|&&b| !robot.may_touch(a, b)) {
            let touches = placed(a).iter().any(|(first, at_first)| {
                placed(b).iter().any(|(second, at_second)| {
                    let pair = [Placed { shape: first, at: at_first }, Placed { shape: second, at: at_second }];
                    let (mut direction, mut hints) = (Vector::zeros(), [0, 0]);
                    let [first, second] = pair;
                    let answer = separation(first, second, 0.0, 0.0, &mut direction, &mut hints);
                    !matches!(answer, Separation::SeparatedBy(_))
                })
            });
            if touches {
                found.push([a, b].map(|link| robot.robot.links[link.0].name.clone()));
            }
        }
    }
    found
}

#[test]
fn it_touches_itself_neither_at_home_nor_stretched_out_nor_bent() {
    let robot = robot();
    assert_eq!(touching(&robot, &robot.layout.rest()), Vec::<[String; 2]>::new());
    let stretched = state_of(&robot, &[("thumb", &[30.0, 0.0, 0.0, 10.0])]);
    assert_eq!(touching(&robot, &stretched), Vec::<[String; 2]>::new());
    let bent = state_of(
        &robot,
        &[("torso", &[0.0, -30.0, 60.0]), ("arm", &[30.0, -70.0, 15.0, 80.0, -40.0, 20.0, 35.0]), ("thumb", &[45.0])],
    );
    assert_eq!(touching(&robot, &bent), Vec::<[String; 2]>::new());
    // A test that can fail: both forearms turned to the chest.
    let crossed = state_of(&robot, &[("arm", &[0.0, 90.0, 0.0, 0.0, 0.0, 0.0, 0.0])]);
    assert_ne!(touching(&robot, &crossed), Vec::<[String; 2]>::new());
}

#[test]
fn its_hands_are_hands_of_their_own() {
    for side in ["right", "left"] {
        let path = repository().join(format!("assets/robots/upper_body/{side}_hand.toml"));
        let hand = load_hand(&path, &LoadOptions::default()).unwrap().hand;
        assert_eq!((hand.n_joints(), hand.fingers.len()), (13, 4));
        let radii: Vec<f64> = hand.fingers.iter().map(|finger| finger.tip.radius()).collect();
        assert_eq!(radii, [0.013; 4]);
        let robot = robot();
        let mounted = &robot.hands[robot.hand_named(side).unwrap()].hand;
        for (ours, theirs) in mounted.fingers.iter().zip(&hand.fingers) {
            assert_eq!((&ours.chain.lower, &ours.rest), (&theirs.chain.lower, &theirs.rest));
        }
    }
}
