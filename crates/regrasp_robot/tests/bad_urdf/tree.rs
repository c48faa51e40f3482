//! Links and joints as one tree.

use super::messages;

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
