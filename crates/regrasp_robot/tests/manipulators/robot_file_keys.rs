//! Keys of robot files: held and common joints, accelerations, sphere models, models on links of others, couplings across parts.

use super::places::{repository, shared_models};
use super::{assert_consistent, difference, load, options, random_state, text};
use regrasp_base::Rng;
use regrasp_geometry::{Shape, Vector};
use regrasp_robot::{LoadOptions, Manipulator, Part, load_manipulator};

const BODY: &str = r#"<robot name="body"><link name="base"/><link name="torso"/><link name="chest"/><link name="wheel"/>
<link name="a1"><collision><geometry><box size="0.1 0.1 0.3"/></geometry></collision></link><link name="a2"/><link name="rod"/>
<joint name="lift" type="prismatic"><parent link="base"/><child link="torso"/><axis xyz="0 0 1"/><limit lower="0" upper="0.5"/></joint>
<joint name="lean" type="revolute"><parent link="torso"/><child link="chest"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="roll" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 1 0"/></joint>
<joint name="j1" type="revolute"><parent link="chest"/><child link="a1"/><origin xyz="0 0.2 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
<joint name="j2" type="revolute"><parent link="a1"/><child link="a2"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
<joint name="jr" type="revolute"><parent link="a1"/><child link="rod"/><axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5"/></joint>
</robot>"#;
const BALLS: &str = r#"<robot name="body"><link name="base"/><link name="a1">
<collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.08"/></geometry></collision>
<collision><geometry><sphere radius="0.08"/></geometry></collision></link>
<joint name="f" type="fixed"><parent link="base"/><child link="a1"/></joint></robot>"#;
const FILE: &str =
    "[[models]]\nurdf = \"body.urdf\"\n[[arms]]\nname = \"arm\"\nbase_link = \"chest\"\nmount_link = \"a2\"\n";

fn seen(text: &str) -> Result<Manipulator, String> {
    let files = [("body.urdf", BODY), ("balls.urdf", BALLS)];
    load(text, &files, &LoadOptions::default()).map_err(|errors| errors.join("\n"))
}

/// The position of a joint by its name, from those of coordinates.
type Position<'a> = &'a dyn Fn(&str, &dyn Fn(&str) -> f64) -> f64;

/// A tree from the text, and positions of joints: by name, else a coordinate of the state.
fn compare(robot: &Manipulator, position: Position) {
    let tree = text::Tree::of(BODY);
    let mut rng = Rng::keyed(1, "keys", 0);
    let mut poses = Vec::new();
    for _ in 0..20 {
        let state = random_state(robot, &mut rng);
        robot.link_poses(&state, &mut poses);
        let of_state = |name: &str| state[robot.layout.index_of(name).unwrap()];
        for link in tree.links() {
            let id = robot.robot.link_named(link).unwrap();
            let expected = tree.root_from(link, &|joint| position(joint, &of_state));
            assert!(difference(&poses[id.0], &expected) < 1e-13, "{link}");
        }
        assert_consistent(robot, &state);
    }
}

#[test]
fn held_joints_are_no_coordinates_and_followers_of_them_stand_still() {
    let more = "[[couplings]]\njoint = \"jr\"\nterms = [{ leader = \"lean\", multiplier = 0.5 }, { leader = \"j1\", multiplier = -1.0 }]\n\
                [held]\nroll = 0.7\nlean = -0.4\n";
    let robot = seen(&format!("{FILE}{more}")).unwrap();
    assert_eq!(robot.layout.names(), ["lift", "j1", "j2"]);
    let held: Vec<_> = robot.held_joints.iter().map(|(name, at)| (name.as_str(), *at)).collect();
    assert_eq!(held, [("lean", -0.4), ("roll", 0.7)]);
    compare(&robot, &|joint, of_state| match joint {
        "roll" => 0.7,
        "lean" => -0.4,
        "jr" => 0.5 * -0.4 - of_state("j1"),
        joint => of_state(joint),
    });
    // The follower's limits -1.5..1.5 leave j1 -1.7..1.3.
    let j1 = &robot.layout.coordinates[1];
    assert!((j1.lower + 1.7).abs() < 1e-12 && (j1.upper - 1.3).abs() < 1e-12, "{j1:?}");
    let all = "[[couplings]]\njoint = \"jr\"\nleader = \"lean\"\n[held]\nroll = 0.7\nlean = -0.4\n";
    let robot = seen(&format!("{FILE}{all}")).unwrap();
    compare(&robot, &|joint, of_state| match joint {
        "roll" => 0.7,
        "lean" | "jr" => -0.4,
        joint => of_state(joint),
    });
}

#[test]
fn a_joint_follows_leaders_in_other_parts() {
    let more = "[[couplings]]\njoint = \"jr\"\nterms = [{ leader = \"lean\", multiplier = 1.0 }, { leader = \"lift\", multiplier = -2.0 }]\n\
                [[couplings]]\njoint = \"roll\"\nleader = \"j2\"\nmultiplier = 3.0\noffset = 0.1\n";
    let robot = seen(&format!("{FILE}{more}")).unwrap();
    assert_eq!(robot.layout.names(), ["lift", "lean", "j1", "j2"]);
    assert_eq!((robot.layout.range(Part::Common), robot.layout.range(Part::Arm(0))), (0..2, 2..4));
    compare(&robot, &|joint, of_state| match joint {
        "jr" => of_state("lean") - 2.0 * of_state("lift"),
        "roll" => 3.0 * of_state("j2") + 0.1,
        joint => of_state(joint),
    });
    // The rod is on the arm, and moves with lift and lean twice over.
    let link = |name: &str| robot.robot.link_named(name).unwrap();
    assert_eq!(robot.part_of(link("rod")), Part::Arm(0));
    assert_eq!(robot.coordinates_above(link("rod")), [0, 1, 2]);
    assert_eq!(robot.coordinates_above(link("wheel")), [3]);
    // -1.5 <= lean - 2 lift <= 1.5.
    let limit = &robot.layout.linear_limits[0];
    assert_eq!((limit.joint.as_str(), limit.lower, limit.upper), ("jr", -1.5, 1.5));
    assert!(robot.layout.within_limits(&[0.2, -0.9, 0.0, 0.0], 0.0));
    assert!(!robot.layout.within_limits(&[0.4, -0.9, 0.0, 0.0], 0.0));
}

#[test]
fn accelerations_are_those_of_the_file() {
    let robot = seen(&format!("{FILE}[accelerations]\ndefault = 5.0\nj2 = 7.5\n")).unwrap();
    let seen_at = |robot: &Manipulator| robot.layout.coordinates.iter().map(|c| c.acceleration).collect::<Vec<_>>();
    assert_eq!(seen_at(&robot), [Some(5.0), Some(5.0), Some(5.0), Some(5.0), Some(7.5), Some(5.0)]);
    assert_eq!(seen_at(&seen(&format!("{FILE}[accelerations]\nj1 = 2\n")).unwrap())[3..], [Some(2.0), None, None]);
    assert_eq!(seen_at(&seen(FILE).unwrap()), [None; 6]);
    let path = repository().join("assets/robots/upper_body/robot.toml");
    let robot = load_manipulator(&path, &LoadOptions::default()).unwrap().manipulator;
    let of = |name: &str| robot.layout.coordinates[robot.layout.index_of(name).unwrap()].acceleration;
    assert_eq!([of("torso_1"), of("left_arm_4"), of("right/fore_mid")], [Some(8.57), Some(11.36), Some(20.0)]);
}

#[test]
fn balls_stand_for_links_that_have_them() {
    let robot = seen(&FILE.replace("\"body.urdf\"", "\"body.urdf\"\nspheres = \"balls.urdf\"")).unwrap();
    let shapes = &robot.arms[0].shapes;
    assert_eq!(shapes.len(), 2);
    assert!(shapes.iter().all(|shape| matches!(shape.placed.shape, Shape::Sphere { radius } if radius == 0.08)));
    assert_eq!(shapes[0].placed.parent_from_shape.translation.vector, Vector::new(0.0, 0.0, 0.1));
    let Some(models) = shared_models() else { return };
    let text = "[[models]]\nurdf = \"package://models/robots/panda/panda.urdf\"\nspheres = \"package://models/robots/panda/panda_spherized.urdf\"\n";
    let panda = load(text, &[], &options(&models)).unwrap();
    let n_balls = |robot: &Manipulator| {
        let all = robot.robot.links.iter().flat_map(|link| &link.collision);
        all.filter(|placed| matches!(placed.shape, Shape::Sphere { .. })).count()
    };
    assert_eq!((n_balls(&panda), panda.robot.links.iter().map(|link| link.collision.len()).sum::<usize>()), (59, 59));
}

#[test]
fn models_stand_on_links_of_models_before_them() {
    let arm = |name: &str, parent: &str, y: f64| {
        format!(
            "[[models]]\nname = \"{name}\"\nurdf = \"body.urdf\"\nparent = \"{parent}\"\nposition = [0.0, {y:?}, 0.1]\n"
        )
    };
    let cart = "[[models]]\nname = \"cart\"\nurdf = \"body.urdf\"\n";
    let robot = seen(&format!("{cart}{}", arm("arm", "cart/chest", 0.3))).unwrap();
    let mut poses = Vec::new();
    let mut rng = Rng::keyed(1, "parents", 0);
    for _ in 0..10 {
        let state = random_state(&robot, &mut rng);
        robot.link_poses(&state, &mut poses);
        let [chest, base] = ["cart/chest", "arm/base"].map(|name| poses[robot.robot.link_named(name).unwrap().0]);
        let expected = chest * nalgebra::Translation3::new(0.0, 0.3, 0.1);
        assert!(difference(&base, &expected.to_homogeneous()) < 1e-14);
    }
    let seen = seen(&format!("{cart}{}", arm("arm", "cart/chets", 0.3))).unwrap_err();
    let expected = "U205 robot.toml:9:10 key \"parent\": the models before this one have no link \"cart/chets\"";
    assert!(seen.starts_with(expected), "{seen}");
}

/// A link that a model does without keeps its place in the tree, so that names of sphere models keep their meaning.
#[test]
fn links_that_a_model_does_without_have_no_geometry_and_no_joints() {
    let model = "spheres = \"balls.urdf\"\nwithout = [\"rod\", \"wheel\"]";
    let file = FILE.replace("\"body.urdf\"", &format!("\"body.urdf\"\n{model}"));
    let robot = seen(&file).unwrap();
    assert_eq!(robot.layout.names(), ["lift", "lean", "j1", "j2"]);
    compare(&robot, &|joint, of_state| if ["jr", "roll"].contains(&joint) { 0.0 } else { of_state(joint) });
    let arm = "[[models]]\nurdf = \"body.urdf\"\nwithout = [\"a1\"]\n";
    let robot = seen(arm).unwrap();
    assert_eq!(robot.layout.names(), ["lift", "lean", "roll"]);
    assert!(robot.common.shapes.is_empty(), "the box of a1 is gone");
}

#[test]
fn bad_keys_are_refused() {
    let common = |joints: &str| format!("{FILE}[common]\njoints = [{joints}]\n");
    seen(&common("\"lift\", \"lean\", \"roll\"")).unwrap();
    for (text, expected) in [
        (
            common("\"lift\", \"lean\""),
            "U228 robot.toml:10:10 key \"common.joints\": joints on no arm and no hand are not in the list: roll; expected every joint of the common part",
        ),
        (
            common("\"lift\", \"lean\", \"roll\", \"j1\""),
            "U227 robot.toml:10:35 key \"common.joints[3]\": joint \"j1\" is on arm \"arm\"",
        ),
        (common("\"lfit\""), "U205 robot.toml:10:11 key \"common.joints[0]\": the robot has no joint \"lfit\""),
        (
            format!("{FILE}[held]\nlean = 1.5\n"),
            "U212 robot.toml:10:8 key \"held.lean\": joint \"lean\" is held at 1.5, outside its limits; expected -1..1",
        ),
        (
            format!("{FILE}[held]\nlaen = 0.5\n"),
            "U205 robot.toml:10:8 key \"held.laen\": the robot has no joint \"laen\"",
        ),
        (
            format!("{FILE}[[couplings]]\njoint = \"lean\"\nleader = \"lift\"\n[held]\nlean = 0.0\n"),
            "U220 robot.toml:13:8 key \"held.lean\": joint \"lean\" follows another joint",
        ),
        (
            format!("{FILE}[accelerations]\ndefault = 0.0\n"),
            "U213 robot.toml:10:11 key \"accelerations.default\": is 0; expected a number above 0 and at most 1000000",
        ),
        (
            format!("{FILE}[accelerations]\nj3 = 1.0\n"),
            "U205 robot.toml:10:6 key \"accelerations.j3\": the robot has no joint \"j3\"",
        ),
        (
            format!(
                "{FILE}[[couplings]]\njoint = \"lean\"\nleader = \"lift\"\n[[couplings]]\njoint = \"lift\"\nleader = \"lean\"\n"
            ),
            "U141 robot.toml:10:9 key \"couplings[0].joint\": joint \"lean\" follows itself",
        ),
        (
            FILE.replace("\"body.urdf\"", "\"body.urdf\"\nwithout = [\"rdo\"]"),
            "U205 robot.toml:5:12 key \"models[0].without[0]\": the robot has no link \"rdo\"",
        ),
        (
            FILE.replace("\"body.urdf\"", "\"body.urdf\"\nwithout = [\"base\"]"),
            "U206 robot.toml:5:12 key \"models[0].without[0]\": is the root of the model, and the model does without it",
        ),
        (
            FILE.replace("\"body.urdf\"", "\"balls.urdf\"\nspheres = \"body.urdf\""),
            "U213 robot.toml:5:11 key \"models[0].spheres\": has a box on link \"a1\"; expected <sphere> as the only",
        ),
    ] {
        let seen = seen(&text).map(|robot| robot.name).unwrap_err();
        assert!(seen.starts_with(expected), "{text}\n{seen}\nexpected {expected}");
    }
}
