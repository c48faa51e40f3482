//! Joints, their limits, and couplings.

use super::messages;

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
    [
        r#"U142 hand.urdf:5:8 joint "follow": follows joint "lead" with multiplier 0; expected a multiplier of size 1e-6 to 1e6 that is not 0, and an offset of size up to 1e6
  fix: type="fixed" if it does not move"#
    ]
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
        r#"U143 hand.urdf:4:1 joint "follow": follows joint "lead" to 4..6, outside its own limits -1..1; expected ranges that overlap
  fix: correct multiplier or offset of its <mimic>, or its limits; without <mimic> it moves by itself"#
    ]
);
