//! Tests of plan files and of the checker.

mod check;
mod couplings;
mod format;
mod levels;
mod loaded;
mod loaded_tests;
#[path = "../../../../tests/support/made_by_hand.rs"]
mod made_by_hand;
mod motion;
#[allow(dead_code)]
#[path = "../../../../tests/support/moving_robot.rs"]
mod moving_robot;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod robots;
mod rolled;
mod rolled_tests;
mod sample;
mod several;
mod tasks;
mod tracked;
mod tracking;
