//! Meshes, numbers and shapes.

use super::messages;

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
    a_radius_of_nonsense,
    r#"<robot name="r">
<link name="a"><collision><geometry><sphere radius="1e300"/></geometry></collision></link>
</robot>"#,
    [r#"U151 hand.urdf:2:45 link "a": radius of <sphere> is 1e300; expected metres, and not millions of them"#]
);

refused!(
    an_origin_at_the_end_of_the_world,
    r#"<robot name="r">
<link name="a"/><link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 -1e300 0"/></joint>
</robot>"#,
    [r#"U151 hand.urdf:3:73 joint "j": xyz of <origin> is -1e300; expected metres, and not millions of them"#]
);
