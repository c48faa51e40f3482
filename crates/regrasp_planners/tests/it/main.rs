//! Tests of the planners through their public functions, on the bundled scenes.

mod above_base;
mod advice;
mod carried;
mod closing_fingers;
mod contact_kinematics;
mod edge_margin;
mod folds;
mod free_fingers;
mod improvement;
mod in_hand_methods;
mod leap;
mod pads;
mod physics;
mod pinching;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod placing;
mod queries;
mod reach;
mod roadmaps;
mod segments;
mod several;
mod soft_and_coupled;
mod solids;
mod straight;
mod tips;
mod tracking;
mod tracking_gaits;
mod tracking_starts;
#[path = "../../../../tests/support/two_hands.rs"]
mod two_hands;
mod way_poses;
