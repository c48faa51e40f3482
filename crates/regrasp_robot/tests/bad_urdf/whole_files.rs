//! What is wrong with a file as a whole.

use super::messages;

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
    a_xacro_file,
    r#"<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:include filename="finger.xacro"/>
</robot>"#,
    [r#"U107 hand.urdf:2:1: is a xacro file that was not expanded: it has <xacro:include>; expected plain XML
  fix: run xacro first: xacro hand.urdf -o hand.expanded.urdf"#]
);

refused!(
    an_expression_of_xacro,
    r#"<robot name="r">
<link name="${side}_palm"/>
</robot>"#,
    [
        r#"U107 hand.urdf:2:1: is a xacro file that was not expanded: <link> has an expression in ${} or $(); expected plain XML
  fix: run xacro first: xacro hand.urdf -o hand.expanded.urdf"#
    ]
);

refused!(
    a_model_of_mujoco,
    r#"<mujoco model="hand"><worldbody/></mujoco>"#,
    [r#"U108 hand.urdf:1:1: is a model of MuJoCo (MJCF); expected a URDF
  fix: python -m regrasp.from_mjcf hand.urdf -o hand    # writes hand.toml into that folder"#]
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

#[test]
fn too_many_links_are_one_complaint() {
    let links: String = (0..1200).map(|i| format!("<link name='l{i}'/>")).collect();
    let joints: String = (1..1200)
        .map(|i| format!("<joint name='j{i}' type='fixed'><parent link='l0'/><child link='l{i}'/></joint>"))
        .collect();
    let found = messages(&format!("<robot name='r'>{links}{joints}</robot>"));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("U105 hand.urdf:1:") && found[0].contains("more than 1000 links"), "{found:?}");
}
