//! Robot files that are refused.

use super::load;
use regrasp_robot::LoadOptions;

const ARM: &str = r#"<robot name="arm"><link name="base"/><link name="a"/><link name="b"/><link name="flange"/><link name="side"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="0.2" upper="1"/></joint>
<joint name="jf" type="fixed"><parent link="b"/><child link="flange"/><origin xyz="0 0 0.3"/></joint>
<joint name="js" type="revolute"><parent link="a"/><child link="side"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
</robot>"#;
const HAND: &str = r#"<robot name="hand"><link name="palm"/><link name="f1"/><link name="f2"/>
<joint name="g1" type="revolute"><parent link="palm"/><child link="f1"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="g2" type="revolute"><parent link="f1"/><child link="f2"/><origin xyz="0 0 0.1"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
</robot>"#;
const HAND_FILE: &str = "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\n[[fingers]]\nname = \"f\"\n\
                         tip_link = \"f2\"\ntip = { shape = \"point\", position = [0.0, 0.0, 0.05] }\n";
const MODEL: &str = "[[models]]\nurdf = \"arm.urdf\"\n";
const ONE_ARM: &str = "[[arms]]\nname = \"arm\"\nbase_link = \"base\"\nmount_link = \"flange\"\n";
const ONE_HAND: &str = "[[hands]]\nname = \"hand\"\nhand = \"hand.toml\"\narm = \"arm\"\n";

fn seen(text: &str) -> Result<regrasp_robot::Manipulator, String> {
    let files = [("arm.urdf", ARM), ("hand.urdf", HAND), ("hand.toml", HAND_FILE)];
    load(text, &files, &LoadOptions::default()).map_err(|errors| errors.join("\n"))
}

#[test]
fn the_robot_that_the_bad_ones_are_made_of_is_good() {
    let robot = seen(&format!("{MODEL}{ONE_ARM}{ONE_HAND}")).unwrap();
    // The side link hangs on the arm: its joint is the arm's, behind the chain.
    assert_eq!(robot.layout.names(), ["j1", "j2", "js", "hand/g1", "hand/g2"]);
    // Home is where the limits come nearest to zero.
    assert_eq!(robot.arms[0].home, [0.0, 0.2]);
}

#[test]
fn bad_robot_files_are_refused() {
    for (text, expected) in [
        (String::new(), "U202 robot.toml:1:1: has neither `models` nor `hands`"),
        ("[[model]]\nurdf = \"arm.urdf\"\n".into(), "U202 robot.toml:1:1: has neither `models` nor `hands`"),
        (format!("{MODEL}[[arms]]\nname = \"arm\"\n"), "U202 robot.toml:5:1 table \"arms[0]\": has no `base_link`"),
        (
            format!("{MODEL}{MODEL}"),
            "U211 robot.toml:3:1 key \"models[0]\": has no name; expected a name of its own, because there are several",
        ),
        (
            format!("{MODEL}name = \"x\"\n{MODEL}name = \"x\"\n"),
            "U211 robot.toml:6:1 key \"models[1]\": has the name of another model",
        ),
        (
            format!("{MODEL}{}", ONE_ARM.replace("flange", "flnge")),
            "U205 robot.toml:8:14 key \"arms[0].mount_link\": the robot has no link \"flnge\"",
        ),
        (
            format!("{MODEL}{}", ONE_ARM.replace("\"base\"", "\"side\"")),
            "U206 robot.toml:8:14 key \"arms[0].mount_link\": link \"flange\" is not carried by base link \"side\"",
        ),
        (
            format!("{MODEL}{}", ONE_ARM.replace("\"base\"", "\"b\"")),
            "U207 robot.toml:8:14 key \"arms[0].mount_link\": no joint moves between \"b\" and \"flange\"",
        ),
        (
            format!("{MODEL}{ONE_ARM}{}", ONE_ARM.replace("\"arm\"", "\"other\"").replace("flange", "side")),
            "U208 robot.toml:11:13 key \"arms[1].base_link\": arm \"other\" shares joints with arm \"arm\"",
        ),
        (
            format!("{MODEL}{ONE_ARM}{ONE_ARM}"),
            "U211 robot.toml:10:8 key \"arms[1].name\": is \"arm\", the name of another arm",
        ),
        (
            format!("{MODEL}{ONE_ARM}home = {{ j2 = 0.0 }}\n"),
            "U212 robot.toml:9:15 joint \"j2\": home position 0 is outside the limits; expected 0.2..1",
        ),
        (
            format!("{MODEL}{ONE_ARM}home = {{ j3 = 0.0 }}\n"),
            "U205 robot.toml:9:15 key \"home\": arm \"arm\" has no independent joint \"j3\"; expected one of j1, j2",
        ),
        (
            format!("{MODEL}{ONE_ARM}{}", ONE_HAND.replace("\"arm\"", "\"amr\"")),
            "U224 robot.toml:12:7 key \"hands[0].arm\": there is no arm \"amr\"; expected one of arm",
        ),
        (
            format!("{MODEL}{ONE_ARM}{ONE_HAND}mount_link = \"a\"\n"),
            "U213 robot.toml:13:14 key \"hands[0].mount_link\": stands beside `arm`",
        ),
        (
            format!("{MODEL}{ONE_ARM}{ONE_HAND}{ONE_HAND}"),
            "U211 robot.toml:14:8 key \"hands[1].name\": is \"hand\", the name of another hand",
        ),
        (
            format!("{MODEL}{ONE_ARM}{ONE_HAND}{}", ONE_HAND.replace("\"hand\"", "\"other\"")),
            "U226 robot.toml:16:7 key \"hands[1].arm\": link \"flange\" carries hand \"hand\" already; expected one hand on an arm",
        ),
        (
            format!("{MODEL}name = \"m\"\n{ONE_ARM}{ONE_HAND}model = \"m\"\n"),
            "U225 robot.toml:12:8 key \"hands[0].hand\": is about hand.urdf, which is not the URDF of the model",
        ),
        (
            format!(
                "{MODEL}name = \"hand\"\n{MODEL}name = \"m\"\n{}{ONE_HAND}",
                ONE_ARM.replace("link = \"", "link = \"m/")
            ),
            "U223 robot.toml joint \"hand/mount\": two models or hands bring this name",
        ),
        (
            format!(
                "{MODEL}{ONE_ARM}[[couplings]]\njoint = \"js\"\nleader = \"j1\"\n[[arms]]\nname = \"s\"\nbase_link = \"a\"\n\
                     mount_link = \"side\"\n"
            ),
            "U209 robot.toml:12:1 arm \"s\": joint \"js\" follows joint \"j1\"",
        ),
        (
            format!("{MODEL}{ONE_ARM}{ONE_HAND}position = [0.0, 0.0]\n"),
            "U203 robot.toml:13:12 key \"hands[0].position\"",
        ),
        (
            format!("{MODEL}{ONE_ARM}{ONE_HAND}quat_xyzw = [0.0, 0.0, 0.0, 2.0]\n"),
            "U213 robot.toml:13:13 key \"hands[0].quat_xyzw\": has length 2; expected a unit quaternion",
        ),
        (format!("{MODEL}{ONE_ARM}wrist = \"a\"\n"), "U201 robot.toml:9:1 key \"arms[0].wrist\": is not a key"),
        (format!("{MODEL}allow = [[\"a\", \"x\"]]\n"), "U201 robot.toml:5:1 key \"models[0].allow\": is not a key"),
    ] {
        let seen = seen(&text).map(|robot| robot.name).unwrap_err();
        assert!(seen.starts_with(expected), "{text}\n{seen}\nexpected {expected}");
    }
}
