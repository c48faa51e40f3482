//! Stories and pages, compared with other ways of knowing the same.

mod charts;
mod judged;
mod page;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod render;
mod sample;
mod scene;
mod several;
mod storyboard;
mod tessellation;
mod tracking;
#[path = "../../../../tests/support/two_hands.rs"]
mod two_hands;
