//! Exports, read back by other means than they were written with.

mod grasps;
mod mjcf;
#[path = "../../../../tests/support/moving_robot.rs"]
mod moving_robot;
mod npz;
mod robots;
mod ros2;
mod sample;
mod several;
#[path = "../../../../tests/support/two_hands.rs"]
mod two_hands;
