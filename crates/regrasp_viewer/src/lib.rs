//! Pictures of plans: one self-contained page, storyboards and charts. Reads scene and plan only.
//!
//! [`story`] gathers everything that a picture needs to know, [`page`] makes one HTML file of it.

/// One self-contained HTML file.
pub mod page;
/// What a page is told.
pub mod story;

pub use story::Story;
