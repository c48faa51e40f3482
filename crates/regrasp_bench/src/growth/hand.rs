//! Hands of n equal fingers, evenly placed: the finger of `assets/hands/six_finger`, on its circle.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Radius of the circle of the first joints, in metres.
const CIRCLE: f64 = 0.055;

/// Name of a finger, from 0.
fn name(finger: usize) -> String {
    format!("finger_{}", finger + 1)
}

/// The robot description.
pub fn urdf(n_fingers: usize) -> String {
    let mut out = format!(
        r#"<?xml version="1.0"?>
<!-- {n_fingers} equal fingers on a circle of radius 55 mm. The palm plane is z = 0, +z points out of the palm. -->
<robot name="{n_fingers}_fingers">
  <link name="palm">
    <collision>
      <origin xyz="0 0 -0.013"/>
      <geometry><cylinder radius="0.065" length="0.01"/></geometry>
    </collision>
  </link>
"#
    );
    for finger in 0..n_fingers {
        finger_urdf(&name(finger), TAU * finger as f64 / n_fingers as f64, &mut out);
    }
    out.push_str("</robot>\n");
    out
}

/// One finger at `angle` about z. Its frame: x inward, z out of the palm.
fn finger_urdf(name: &str, angle: f64, out: &mut String) {
    let (x, y, yaw) = (CIRCLE * angle.cos(), CIRCLE * angle.sin(), angle + PI);
    let _ = write!(
        out,
        r#"
  <joint name="{name}_abduction" type="revolute">
    <parent link="palm"/>
    <child link="{name}_base"/>
    <origin xyz="{x:.15} {y:.15} 0" rpy="0 0 {yaw:.15}"/>
    <axis xyz="1 0 0"/>
    <limit lower="-0.6108652382" upper="0.6108652382" effort="1.0" velocity="4.0"/>
  </joint>
  <link name="{name}_base"/>
  <joint name="{name}_proximal_flexion" type="revolute">
    <parent link="{name}_base"/>
    <child link="{name}_proximal"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1.308996939" upper="1.047197551" effort="1.0" velocity="4.0"/>
  </joint>
  <link name="{name}_proximal">
    <collision>
      <origin xyz="0 0 0.029"/>
      <geometry><capsule radius="0.007" length="0.058"/></geometry>
    </collision>
  </link>
  <joint name="{name}_distal_flexion" type="revolute">
    <parent link="{name}_proximal"/>
    <child link="{name}_distal"/>
    <origin xyz="0 0 0.058"/>
    <axis xyz="0 1 0"/>
    <limit lower="0.0872664626" upper="2.00712864" effort="1.0" velocity="4.0"/>
  </joint>
  <link name="{name}_distal">
    <collision>
      <origin xyz="0 0 0.025"/>
      <geometry><capsule radius="0.004" length="0.05"/></geometry>
    </collision>
  </link>
  <joint name="{name}_tip_mount" type="fixed">
    <parent link="{name}_distal"/>
    <child link="{name}_tip"/>
    <origin xyz="0 0 0.05"/>
  </joint>
  <link name="{name}_tip">
    <collision>
      <geometry><sphere radius="0.005"/></geometry>
    </collision>
  </link>
"#
    );
}

/// The hand file beside `urdf`; the scene says what the tips transmit.
pub fn hand_toml(urdf: &str, n_fingers: usize) -> String {
    let mut out = format!(
        "# {n_fingers} equal fingers on a circle of radius 55 mm.\nformat = \"regrasp-hand\"\nformat_version = 1\n\
         urdf = \"{urdf}\"\nbase_link = \"palm\"\n"
    );
    for name in (0..n_fingers).map(name) {
        let _ = write!(
            out,
            r#"
[[fingers]]
name = "{name}"
tip_link = "{name}_tip"
tip = {{ shape = "sphere", radius = 0.005, center = [0, 0, 0] }}
rest = {{ {name}_abduction = 0.0, {name}_proximal_flexion = -0.8, {name}_distal_flexion = 1.2 }}
"#
        );
    }
    out
}
