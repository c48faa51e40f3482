//! Tests of the planners through their public functions, on the bundled scenes.

mod in_hand_methods;
mod segments;
mod way_poses;
