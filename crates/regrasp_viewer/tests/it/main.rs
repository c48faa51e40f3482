//! Stories and pages, compared with other ways of knowing the same.

mod judged;
mod page;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod sample;
mod scene;
mod tessellation;
