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
    []
);

refused!(
    a_package_without_a_path,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="package://allegro"/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    an_empty_file_name,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename=""/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    a_mesh_without_a_file_name,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    a_mesh_on_the_network,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="http://example.com/tip.stl"/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    a_mesh_that_is_not_there,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="tip.stl"/>
</geometry></collision></link>
</robot>"#,
    []
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
    []
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
    []
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
    []
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
    []
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
    []
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
    []
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
    []
);

refused!(
    a_box_of_two_numbers,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <box size="1 2"/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    a_box_without_a_size,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <box/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    a_negative_radius,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <sphere radius="-0.01"/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    geometry_that_is_not_known,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <cone radius="0.01"/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    a_collision_without_geometry,
    r#"<robot name="r">
<link name="a">
<collision/></link>
</robot>"#,
    []
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
    []
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
    []
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
    []
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
    []
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
    []
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
    []
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
    []
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
    []
);

refused!(
    a_joint_without_a_type,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j"><parent link="a"/><child link="b"/></joint>
</robot>"#,
    []
);

refused!(
    a_joint_without_a_name,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint type="fixed"><parent link="a"/><child link="b"/></joint>
</robot>"#,
    []
);

refused!(
    a_link_without_a_name,
    r#"<robot name="r">
<link/>
<link name="a"/>
</robot>"#,
    []
);

refused!(
    a_joint_without_a_child,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/></joint>
</robot>"#,
    []
);

refused!(
    an_unknown_parent,
    r#"<robot name="r">
<link name="palm"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="plam"/><child link="b"/></joint>
</robot>"#,
    []
);

refused!(
    an_unknown_child,
    r#"<robot name="r">
<link name="a"/>
<joint name="j" type="fixed"><parent link="a"/>
<child link="finger"/></joint>
</robot>"#,
    []
);

refused!(
    two_roots,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
</robot>"#,
    []
);

refused!(
    a_cycle,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>
</robot>"#,
    []
);

refused!(
    a_link_that_carries_itself,
    r#"<robot name="r">
<link name="a"/>
<joint name="j" type="fixed"><parent link="a"/><child link="a"/></joint>
</robot>"#,
    []
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
    []
);

refused!(
    a_link_carried_twice,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
<joint name="k" type="fixed"><parent link="a"/><child link="b"/></joint>
</robot>"#,
    []
);

refused!(
    two_links_of_one_name,
    r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
</robot>"#,
    []
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
    []
);

refused!(
    no_links,
    r#"<robot name="r">

</robot>"#,
    []
);

refused!(
    a_leader_that_does_not_exist,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="laed"/></joint>
</robot>"#,
    []
);

refused!(
    a_multiplier_of_zero,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="lead" multiplier="0"/></joint>
</robot>"#,
    []
);

refused!(
    joints_that_follow_each_other,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/><mimic joint="follow"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="lead"/></joint>
</robot>"#,
    []
);

refused!(
    a_joint_that_follows_itself,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="follow"/></joint>
</robot>"#,
    []
);

refused!(
    a_leader_that_is_fixed,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="fixed"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="lead"/></joint>
</robot>"#,
    []
);

refused!(
    a_follower_that_can_never_be_where_it_must,
    r#"<robot name="r">
<link name="a"/><link name="b"/><link name="c"/>
<joint name="lead" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
<mimic joint="lead" offset="5"/></joint>
</robot>"#,
    []
);

refused!(
    a_scale_of_zero,
    r#"<robot name="r">
<link name="a"><collision><geometry>
  <mesh filename="box.obj" scale="1 0 1"/>
</geometry></collision></link>
</robot>"#,
    []
);

refused!(
    an_entity_bomb,
    r#"<!DOCTYPE lolz [<!ENTITY lol "lol"><!ENTITY lol2 "&lol;&lol;">]>
<robot name="&lol2;"/>"#,
    []
);

refused!(another_root_element, r#"<sdf version="1.6"/>"#, []);

refused!(
    a_truncated_file,
    r#"<robot name="r">
<link name="a"/>
<joi"#,
    []
);

refused!(an_empty_file, r#""#, []);

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
<joint name="k" type="planar"><parent link="a"/><child link="x"/></joint>
</robot>"#,
    []
);
