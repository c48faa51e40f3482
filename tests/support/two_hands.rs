//! A good scene of two wide hands, half a metre apart, for tests. Included by its path, as `places.rs`.

/// Text of a scene file beside `hand.toml`, the bundled wide hand. The left hand is turned about x: the sine is 0.96, the cosine 0.28.
pub const SCENE: &str = r#"format = "regrasp-scene"
format_version = 2

[[robot.hands]]
name = "right"
file = "hand.toml"

[[robot.hands]]
name = "left"
file = "hand.toml"
world_from_hand = { position = [0.5, 0.0, 0.05], quat_xyzw = [0.6, 0.0, 0.0, 0.8] }
rest = { west_abduction = 0.25 }

[[objects]]
name = "ball"
sphere = { radius = 0.032 }
mass = 0.1
friction = 0.8
position = [0.0, 0.0, 0.078]

[[objects]]
name = "box"
box = { size = [0.05, 0.05, 0.06] }
mass = 0.1
friction = 0.8
position = [0.5, -0.07488, 0.07184]
quat_xyzw = [0.6, 0.0, 0.0, 0.8]

[[supports]]
name = "table"
box = { size = [1.2, 0.8, 0.02] }
position = [0.25, 0.0, -0.2]

[[obstacles]]
name = "lamp"
sphere = { radius = 0.02 }
position = [0.25, 0.1, 0.3]

[[tasks]]
name = "turn_ball"
task = "in_hand"
hand = "right"
object = "ball"
goal = { turn = { axis = "x", angle_deg = 90 } }

[[tasks]]
name = "turn_box"
task = "in_hand"
hand = "left"
object = "box"
goal = { turn = { axis = "x", angle_deg = 45 } }
"#;
