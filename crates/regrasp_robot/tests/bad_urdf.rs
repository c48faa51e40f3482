//! Every bad robot file is refused with its message: code, line, element, value, what was expected, the fix.

use regrasp_robot::{LoadOptions, load_robot};
use std::fs;

/// A tetrahedron.
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// The messages for `text` as `hand.urdf`, with the folder left out.
fn messages(text: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.urdf");
    fs::write(&path, text).unwrap();
    fs::write(folder.path().join("box.obj"), OBJ).unwrap();
    let error = load_robot(&path, &LoadOptions::default()).expect_err("the file is bad");
    let prefix = format!("{}/", folder.path().display());
    error
        .diagnostics
        .iter()
        .map(|d| d.to_string().replace(&prefix, "").replace(prefix.trim_end_matches('/'), "."))
        .collect()
}

macro_rules! refused {
    ($name:ident, $text:expr, [$($message:expr),* $(,)?]) => {
        #[test]
        fn $name() {
            let expected: Vec<&str> = vec![$($message),*];
            assert_eq!(messages($text), expected);
        }
    };
}

refused!(
    a_package_that_is_nowhere,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="package://allegro/meshes/tip.stl"/>
</geometry></collision></link>
</robot>"#,
    [
        r#"U101 hand.urdf:3:9 link "a": "package://allegro/meshes/tip.stl" not found; looked in: (1) --package allegro: not given (2) ROS_PACKAGE_PATH, AMENT_PREFIX_PATH: not set (3) package.xml above the model: none says <name>allegro</name> (4) folder of that name: . and folders above (none called allegro)
  fix: --package allegro=DIR"#
    ]
);

refused!(
    a_package_without_a_path,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="package://allegro"/>
</geometry></collision></link>
</robot>"#,
    [
        r#"U102 hand.urdf:3:9 link "a": "package://allegro" has no path after the package name; expected package://NAME/PATH"#
    ]
);

refused!(
    an_empty_file_name,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename=""/>
</geometry></collision></link>
</robot>"#,
    [r#"U102 hand.urdf:3:9 link "a": the file name is empty; expected a path or package://NAME/PATH"#]
);

refused!(
    a_mesh_without_a_file_name,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh/>
</geometry></collision></link>
</robot>"#,
    [r#"U112 hand.urdf:3:3 link "a": <mesh> has no attribute filename; expected <mesh filename="...">"#]
);

refused!(
    a_mesh_on_the_network,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="http://example.com/tip.stl"/>
</geometry></collision></link>
</robot>"#,
    [
        r#"U103 hand.urdf:3:9 link "a": "http://example.com/tip.stl" would have to be fetched; models are never fetched; expected a file
  fix: download it and name the file"#
    ]
);

refused!(
    a_mesh_that_is_not_there,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="tip.stl"/>
</geometry></collision></link>
</robot>"#,
    [
        r#"U101 hand.urdf:3:9 link "a": "tip.stl" not found; looked in: tip.stl; expected a path relative to this file, or package://NAME/PATH"#
    ]
);

refused!(
    an_origin_that_is_not_a_number,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<origin xyz="0 NaN 0"/>
</joint>
</robot>"#,
    [r#"V001 hand.urdf:7:9 joint "j": xyz is NaN; expected a finite number"#]
);

refused!(
    an_infinite_limit,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
<limit lower="-1" upper="inf"/>
</joint>
</robot>"#,
    [r#"V001 hand.urdf:7:19 joint "j": upper is infinite; expected a finite number"#]
);

refused!(
    a_decimal_comma,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
<limit lower="0,05" upper="1"/>
</joint>
</robot>"#,
    [r#"U110 hand.urdf:7:8 joint "j": cannot read lower "0,05" as a number; expected a decimal number such as 0.05
  fix: write 0.05"#]
);

refused!(
    commas_between_numbers,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0,0,1"/><limit lower="-1" upper="1"/>
</joint>
</robot>"#,
    [r#"U111 hand.urdf:6:7 joint "j": xyz of <axis> has 1 numbers: "0,0,1"; expected 3 numbers separated by spaces
  fix: separate numbers by spaces, not by commas"#]
);

refused!(
    a_hexadecimal_number,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
<limit lower="0x10" upper="20"/>
</joint>
</robot>"#,
    [r#"U110 hand.urdf:7:8 joint "j": cannot read lower "0x10" as a number; expected a decimal number such as 0.05"#]
);

refused!(
    a_number_that_is_too_large,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
<limit lower="0" upper="1e999"/>
</joint>
</robot>"#,
    [r#"U110 hand.urdf:7:18 joint "j": upper "1e999" is too large for a number"#]
);

refused!(
    an_empty_number,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
<limit lower="" upper="1"/>
</joint>
</robot>"#,
    [r#"U110 hand.urdf:7:8 joint "j": cannot read lower "" as a number; expected a decimal number such as 0.05"#]
);

refused!(
    a_box_of_two_numbers,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <box size="1 2"/>
</geometry></collision></link>
</robot>"#,
    [r#"U111 hand.urdf:3:8 link "a": size of <box> has 2 numbers: "1 2"; expected 3 numbers separated by spaces"#]
);

refused!(
    a_box_without_a_size,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <box/>
</geometry></collision></link>
</robot>"#,
    [r#"U112 hand.urdf:3:3 link "a": <box> has no attribute size; expected <box size="...">"#]
);

refused!(
    a_negative_radius,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <sphere radius="-0.01"/>
</geometry></collision></link>
</robot>"#,
    [r#"U151 hand.urdf:3:11 link "a": radius of <sphere> is -0.01; expected a length above 0, in metres"#]
);

refused!(
    geometry_that_is_not_known,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <cone radius="0.01"/>
</geometry></collision></link>
</robot>"#,
    [
        r#"U150 hand.urdf:2:27 link "a": <geometry> has only <cone>, which is not known; expected one of <box>, <cylinder>, <sphere>, <capsule>, <mesh>"#
    ]
);

refused!(
    a_collision_without_geometry,
    r#"<robot name="r">
<link name="a">
<collision/></link>
</robot>"#,
    [r#"U150 hand.urdf:3:1 link "a": <collision> has no <geometry>"#]
);

refused!(
    a_revolute_joint_without_limits,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
</joint>
</robot>"#,
    [
        r#"U120 hand.urdf:4:1 joint "j": is revolute but has no <limit>; expected <limit lower="..." upper="..." effort="..." velocity="..."/>
  fix: add the limit, or type="continuous" if it turns without end"#
    ]
);

refused!(
    a_limit_without_positions,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
<limit effort="1" velocity="1"/>
</joint>
</robot>"#,
    [
        r#"U120 hand.urdf:7:1 joint "j": is revolute but has a <limit> without lower and upper; expected <limit lower="..." upper="..." effort="..." velocity="..."/>
  fix: add the limit, or type="continuous" if it turns without end"#
    ]
);

refused!(
    a_prismatic_joint_without_limits,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="prismatic">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
</joint>
</robot>"#,
    [
        r#"U120 hand.urdf:4:1 joint "j": is prismatic but has no <limit>; expected <limit lower="..." upper="..." effort="..." velocity="..."/>
  fix: add the limit"#
    ]
);

refused!(
    limits_that_are_swapped,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/>
<limit lower="1" upper="-1"/>
</joint>
</robot>"#,
    [r#"U121 hand.urdf:7:8 joint "j": lower limit 1 is above upper limit -1; expected lower <= upper
  fix: swap them: lower="-1" upper="1""#]
);

refused!(
    an_axis_of_length_zero,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 0"/><limit lower="-1" upper="1"/>
</joint>
</robot>"#,
    [r#"U122 hand.urdf:6:7 joint "j": axis "0 0 0" has length 0; expected a direction, such as "0 0 1""#]
);

refused!(
    a_planar_joint,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="planar">
<parent link="a"/><child link="b"/>

</joint>
</robot>"#,
    [
        r#"U125 hand.urdf:4:17 joint "j": unsupported joint type "planar"; expected revolute, continuous, prismatic or fixed
  fix: type="fixed", or --lenient to hold it fixed"#
    ]
);

refused!(
    a_floating_joint,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="floating">
<parent link="a"/><child link="b"/>

</joint>
</robot>"#,
    [
        r#"U125 hand.urdf:4:17 joint "j": unsupported joint type "floating"; expected revolute, continuous, prismatic or fixed
  fix: type="fixed", or --lenient to hold it fixed"#
    ]
);

refused!(
    a_joint_type_that_is_misspelt,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolut">
<parent link="a"/><child link="b"/>

</joint>
</robot>"#,
    [r#"U126 hand.urdf:4:17 joint "j": unknown joint type "revolut"; expected revolute, continuous, prismatic or fixed
  fix: did you mean "revolute"?"#]
);

refused!(
    a_joint_without_a_type,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j"><parent link="a"/><child link="b"/></joint>
</robot>"#,
    [r#"U112 hand.urdf:4:1 joint "j": <joint> has no attribute type; expected <joint type="...">"#]
);

refused!(
    a_joint_without_a_name,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint type="fixed"><parent link="a"/><child link="b"/></joint>
</robot>"#,
    [r#"U112 hand.urdf:4:1: <joint> has no attribute name; expected <joint name="...">"#]
);

refused!(
    a_link_without_a_name,
    r#"<robot name="r">
<link/>
<link name="a"/>
</robot>"#,
    [r#"U112 hand.urdf:2:1: <link> has no attribute name; expected <link name="...">"#]
);

refused!(
    a_joint_without_a_child,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/></joint>
</robot>"#,
    [r#"U112 hand.urdf:4:1 joint "j": has no <child>; expected <child link="..."/>"#]
);

refused!(
    an_unknown_parent,
    r#"<robot name="r">
<link name="palm"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="plam"/><child link="b"/></joint>
</robot>"#,
    [r#"U132 hand.urdf:4:30 joint "j": parent link "plam" does not exist; expected the name of a <link>
  fix: did you mean "palm"?"#]
);

refused!(
    an_unknown_child,
    r#"<robot name="r">
<link name="a"/>
<joint name="j" type="fixed"><parent link="a"/>
<child link="finger"/></joint>
</robot>"#,
    [r#"U132 hand.urdf:4:1 joint "j": child link "finger" does not exist; expected the name of a <link>"#]
);

refused!(
    two_roots,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
</robot>"#,
    [r#"U133 hand.urdf:1:1: has 2 roots: "a", "b"; expected one link that no joint carries
  fix: join them by fixed joints, or remove links that are not used"#]
);

refused!(
    a_cycle,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>
</robot>"#,
    [
        r#"U134 hand.urdf:2:1 link "a": links carry each other in a cycle: "a" -> "b" -> "a"; expected a tree with one root"#
    ]
);

refused!(
    a_link_that_carries_itself,
    r#"<robot name="r">
<link name="a"/>
<joint name="j" type="fixed"><parent link="a"/><child link="a"/></joint>
</robot>"#,
    [r#"U134 hand.urdf:2:1 link "a": links carry each other in a cycle: "a" -> "a"; expected a tree with one root"#]
);

refused!(
    a_cycle_beside_a_root,
    r#"<robot name="r">
<link name="root"/>
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>
</robot>"#,
    [
        r#"U134 hand.urdf:3:1 link "a": links carry each other in a cycle: "a" -> "b" -> "a"; expected a tree with one root"#
    ]
);

refused!(
    a_link_carried_twice,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
<joint name="k" type="fixed"><parent link="a"/><child link="b"/></joint>
</robot>"#,
    [
        r#"U135 hand.urdf:5:1 joint "k": carries link "b", which joint "j" carries already; expected a tree: every link carried by one joint"#
    ]
);

refused!(
    two_links_of_one_name,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
</robot>"#,
    [r#"U131 hand.urdf:4:1 link "b": the name is used already on line 3; expected a name of its own for every link"#]
);

refused!(
    two_joints_of_one_name,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="c"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
<joint name="j" type="fixed"><parent link="a"/><child link="c"/></joint>
</robot>"#,
    [r#"U131 hand.urdf:6:1 joint "j": the name is used already on line 5; expected a name of its own for every joint"#]
);

refused!(
    no_links,
    r#"<robot name="r">

</robot>"#,
    [r#"U130 hand.urdf:1:1: has no <link>; expected at least one link with a name"#]
);

refused!(
    a_leader_that_does_not_exist,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="laed"/></joint>
</robot>"#,
    [r#"U140 hand.urdf:5:8 joint "follow": follows joint "laed", which does not exist; expected the name of a joint
  fix: did you mean "lead"?"#]
);

refused!(
    a_multiplier_of_zero,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="lead" multiplier="0"/></joint>
</robot>"#,
    [r#"U142 hand.urdf:5:8 joint "follow": follows joint "lead" with multiplier 0; expected a multiplier that is not 0
  fix: type="fixed" if it does not move"#]
);

refused!(
    joints_that_follow_each_other,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/><mimic joint="follow"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="lead"/></joint>
</robot>"#,
    [
        r#"U141 hand.urdf:3:1 joint "lead": joints follow each other in a cycle: "lead" -> "follow" -> "lead"; expected a joint at the end that follows no other"#,
        r#"U141 hand.urdf:4:1 joint "follow": joints follow each other in a cycle: "follow" -> "lead" -> "follow"; expected a joint at the end that follows no other"#
    ]
);

refused!(
    a_joint_that_follows_itself,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="follow"/></joint>
</robot>"#,
    [
        r#"U141 hand.urdf:4:1 joint "follow": joints follow each other in a cycle: "follow" -> "follow"; expected a joint at the end that follows no other"#
    ]
);

refused!(
    a_leader_that_is_fixed,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="fixed"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="lead"/></joint>
</robot>"#,
    [r#"U144 hand.urdf:5:8 joint "follow": follows joint "lead", which is fixed; expected a joint that moves"#]
);

refused!(
    a_follower_that_can_never_be_where_it_must,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="lead" offset="5"/></joint>
</robot>"#,
    [
        r#"U143 hand.urdf:4:1 joint "follow": follows joint "lead" to 4..6, outside its own limits -1..1; expected ranges that overlap"#
    ]
);

refused!(
    a_scale_of_zero,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="box.obj" scale="1 0 1"/>
</geometry></collision></link>
</robot>"#,
    [r#"U152 hand.urdf:3:28 link "a": scale of <mesh> is "1 0 1"; expected three factors that are not 0"#]
);

refused!(
    an_entity_bomb,
    r#"<!DOCTYPE lolz [<!ENTITY lol "lol"><!ENTITY lol2 "&lol;&lol;">]>
<robot name="&lol2;"/>"#,
    [r#"U104 hand.urdf:1:1: has a document type declaration (DTD); expected plain XML without entities
  fix: remove the <!DOCTYPE ...> line"#]
);

refused!(
    another_root_element,
    r#"<sdf version="1.6"/>"#,
    [r#"U106 hand.urdf:1:1: the outermost element is <sdf>; expected <robot name="...">"#]
);

refused!(
    a_truncated_file,
    r#"<robot name="r">
<link name="a"/>
<joi"#,
    [r#"U100 hand.urdf:1:1: is not well-formed XML: the root node was opened but never closed"#]
);

refused!(an_empty_file, r#""#, [r#"U100 hand.urdf: is empty"#]);

refused!(
    two_problems_in_one_run,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="revolute">
<parent link="a"/><child link="b"/>
<axis xyz="0 0 0"/>
<limit lower="0,05" upper="1"/>
</joint>
<joint name="k" type="planar"><parent link="a"/><child link="finger_7"/></joint>
</robot>"#,
    [
        r#"U122 hand.urdf:6:7 joint "j": axis "0 0 0" has length 0; expected a direction, such as "0 0 1""#,
        r#"U110 hand.urdf:7:8 joint "j": cannot read lower "0,05" as a number; expected a decimal number such as 0.05
  fix: write 0.05"#,
        r#"U125 hand.urdf:9:17 joint "k": unsupported joint type "planar"; expected revolute, continuous, prismatic or fixed
  fix: type="fixed", or --lenient to hold it fixed"#,
        r#"U132 hand.urdf:9:49 joint "k": child link "finger_7" does not exist; expected the name of a <link>"#
    ]
);
