//! Stories and pages, compared with other ways of knowing the same.

mod charts;
mod judged;
#[allow(dead_code, reason = "not every test needs every robot")]
#[path = "../../../../tests/support/moving_robot.rs"]
mod moving_robot;
mod page;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod render;
mod robots;
mod runs;
mod sample;
mod scene;
mod several;
mod storyboard;
mod tessellation;
mod tracking;
#[path = "../../../../tests/support/two_hands.rs"]
mod two_hands;
