//! The checker rejects every mutant. The good plans are those of the checker's own tests.
#![allow(dead_code)]

#[path = "../../../regrasp_plan/tests/it/loaded.rs"]
mod loaded;
#[path = "../../../../tests/support/made_by_hand.rs"]
mod made_by_hand;
#[path = "../../../../tests/support/moving_robot.rs"]
mod moving_robot;
mod mutation;
mod robots;
#[path = "../../../regrasp_plan/tests/it/rolled.rs"]
mod rolled;
#[path = "../../../regrasp_plan/tests/it/sample.rs"]
mod sample;
mod tasks;
#[path = "../../../regrasp_plan/tests/it/tracked.rs"]
mod tracked;
