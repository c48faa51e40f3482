//! A robot with a coupled torso, two arms and two hands, from a table of its dimensions, against published positions.

use super::{assert_consistent, load, random_state};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Vector};
use regrasp_robot::{LoadOptions, Manipulator, Part};
use std::fmt::Write;

const TABLE: &str = include_str!("two_arms.txt");
/// Length of the last segment of a finger, in metres.
const LAST_SEGMENT: f64 = 0.029;

/// The URDF of the table: link `x` is what joint `x` carries.
fn urdf() -> String {
    let mut text = "<robot name=\"two_arms\">\n<link name=\"base\"/>\n".to_owned();
    for row in TABLE.lines().filter(|line| !line.starts_with('#')) {
        let [name, parent, xyz, rpy, limits] = row.split("; ").collect::<Vec<_>>().try_into().unwrap();
        let (kind, inner) = match limits {
            "fixed" => ("fixed", String::new()),
            limits => {
                let [lower, upper]: [f64; 2] = limits
                    .split(' ')
                    .map(|v| v.parse::<f64>().unwrap().to_radians())
                    .collect::<Vec<_>>()
                    .try_into()
                    .unwrap();
                ("revolute", format!("<axis xyz=\"0 0 1\"/><limit lower=\"{lower}\" upper=\"{upper}\"/>"))
            }
        };
        let _ = writeln!(
            text,
            "<link name=\"{name}\"/><joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{name}\"/>\
             <origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>{inner}</joint>"
        );
    }
    text + "</robot>\n"
}

fn hand_file(side: &str) -> String {
    let mut text = format!(
        "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"two_arms.urdf\"\nbase_link = \"{side}_wrist\"\n"
    );
    for finger in ["thumb", "fore", "middle", "ring"] {
        let _ = writeln!(
            text,
            "[[couplings]]\njoint = \"{side}_{finger}_dist\"\nleader = \"{side}_{finger}_mid\"\n\
             [[fingers]]\nname = \"{finger}\"\ntip_link = \"{side}_{finger}_dist\"\n\
             tip = {{ shape = \"sphere\", radius = 0.013, center = [{LAST_SEGMENT}, 0.0, 0.0] }}"
        );
    }
    text
}

/// The torso stays upright: its last joint turns back what the two before it turn.
const ROBOT: &str = r#"
[[models]]
name = "body"
urdf = "two_arms.urdf"
[[couplings]]
joint = "torso_3"
terms = [{ leader = "torso_1", multiplier = -1.0 }, { leader = "torso_2", multiplier = -1.0 }]
[[arms]]
name = "right"
base_link = "right_dock"
mount_link = "right_arm_7"
[[arms]]
name = "left"
base_link = "left_dock"
mount_link = "left_arm_7"
[[hands]]
name = "right"
hand = "right.toml"
arm = "right"
model = "body"
[[hands]]
name = "left"
hand = "left.toml"
arm = "left"
model = "body"
"#;

fn robot(text: &str) -> Result<Manipulator, Vec<String>> {
    let (urdf, right, left) = (urdf(), hand_file("right"), hand_file("left"));
    load(text, &[("two_arms.urdf", &urdf), ("right.toml", &right), ("left.toml", &left)], &LoadOptions::default())
}

#[test]
fn the_layout_is_common_part_arm_hand_arm_hand() {
    let robot = robot(ROBOT).unwrap();
    // 3 of the torso, one of them coupled, 2 of the neck, 7 per arm, 13 per hand.
    let parts = [Part::Common, Part::Arm(0), Part::Hand(0), Part::Arm(1), Part::Hand(1)];
    assert_eq!(parts.map(|part| robot.layout.range(part)), [0..5, 5..12, 12..25, 25..32, 32..45]);
    assert_eq!(robot.layout.names()[..5], ["torso_yaw", "torso_1", "torso_2", "head_1", "head_2"]);
    assert_eq!(robot.layout.range(Part::Hand(1)).len(), robot.hands[1].hand.n_joints());
    // The limits of torso_3, -135..0 degrees, leave 0 <= torso_1 + torso_2 <= 135 degrees.
    let limit = &robot.layout.linear_limits[0];
    assert_eq!((robot.layout.linear_limits.len(), limit.joint.as_str()), (1, "torso_3"));
    let degrees = |torso_1: f64, torso_2: f64| {
        let mut state = robot.layout.rest();
        (state[1], state[2]) = (torso_1.to_radians(), torso_2.to_radians());
        robot.layout.within_limits(&state, 0.0)
    };
    assert!(degrees(-30.0, 60.0) && degrees(0.0, 134.9) && degrees(-69.0, 69.1));
    assert!(!degrees(-30.0, 29.0) && !degrees(30.0, 106.0) && !degrees(1.0, 135.0));
}

/// `joints` in degrees, by the ends of their names; equal angles on both sides.
fn state_of(robot: &Manipulator, joints: &[(&str, &[f64])]) -> Vec<f64> {
    let mut state = vec![0.0; robot.layout.len()];
    for (stem, values) in joints {
        let is_own = |name: &str| name.contains(stem) && (name.starts_with("right") || name.starts_with("torso"));
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
fn links_are_where_the_published_robot_has_them() {
    let robot = robot(ROBOT).unwrap();
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
    let tip = [LAST_SEGMENT, 0.0, 0.0];
    let origin = [0.0; 3];
    let mut poses = Vec::new();
    for (state, link, point, expected) in [
        (&zero, "arm_4", origin, [0.088, -0.60241, 1.0955]),
        (&zero, "arm_7", origin, [0.088, -0.94016, 1.2905]),
        (&zero, "wrist", origin, [0.088, -1.04235, 1.3495]),
        (&zero, "fore_dist", tip, [0.13275, -1.28556, 1.49338]),
        (&bent, "arm_4", origin, [0.27594, -0.53724, 0.60161]),
        (&bent, "arm_7", origin, [0.61204, -0.55828, 0.79831]),
        (&bent, "wrist", origin, [0.72461, -0.59001, 0.78266]),
        (&bent, "fore_dist", tip, [0.96823, -0.58734, 0.69580]),
        (&bent, "thumb_dist", tip, [0.94828, -0.56805, 0.71429]),
        (&bent, "middle_dist", tip, [0.94220, -0.63495, 0.67306]),
        (&bent, "ring_dist", tip, [0.96387, -0.66704, 0.68818]),
    ] {
        robot.link_poses(state, &mut poses);
        for (side, sign) in [("right", 1.0), ("left", -1.0)] {
            let id = robot.robot.link_named(&format!("{side}_{link}")).unwrap();
            let seen = poses[id.0] * Point::from(point);
            let expected = Vector::new(expected[0], sign * expected[1], expected[2]);
            assert!((seen.coords - expected).norm() < 2e-5, "{side}_{link}: {seen} instead of {expected}");
        }
        assert_consistent(&robot, state);
    }
}

#[test]
fn chains_and_tree_agree_everywhere() {
    let robot = robot(ROBOT).unwrap();
    let mut rng = Rng::keyed(1, "two arms", 0);
    for _ in 0..50 {
        assert_consistent(&robot, &random_state(&robot, &mut rng));
    }
    // The hand moves with torso and arm, and with nothing else.
    let above = robot.coordinates_above(robot.hands[0].hand.base);
    assert_eq!(above, [0, 1, 2, 5, 6, 7, 8, 9, 10, 11]);
}

#[test]
fn rest_and_home_are_taken_and_refused_outside_limits() {
    let more = "[rest]\ntorso_1 = -0.5\ntorso_2 = 1.0\n";
    assert_eq!(robot(&format!("{ROBOT}{more}")).unwrap().layout.rest()[..3], [0.0, -0.5, 1.0]);
    for (more, expected) in [
        ("[rest]\ntorso_1 = 9.0\n", "U212 robot.toml:29:11 joint \"torso_1\": rest position 9 is outside the limits"),
        (
            "[rest]\ntorso_1 = -0.5\n",
            "U212 robot.toml:29:11 joint \"torso_1\": the rest posture takes a joint that follows",
        ),
        (
            "[rest]\ntorso_3 = -0.5\n",
            "U205 robot.toml:29:11 key \"rest\": the common part has no independent joint \"torso_3\"",
        ),
        ("[rest]\nright_arm_1 = 0.0\n", "U205 robot.toml:29:15 key \"rest\": the common part has no independent joint"),
    ] {
        let seen = robot(&format!("{ROBOT}{more}")).unwrap_err().join("\n");
        assert!(seen.starts_with(expected), "{seen}\nexpected {expected}");
    }
}
