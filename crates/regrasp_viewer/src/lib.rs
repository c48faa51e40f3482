//! Pictures of plans: one self-contained page, storyboards and charts. Reads scene and plan only; [`runs`] reads what became of plans.
//!
//! [`story`] gathers everything that a picture needs to know, [`page`] makes one HTML file of it, [`storyboard`] a PNG of key
//! frames, [`charts`] and [`roadmap_picture`] make SVG pictures.

/// Charts of a plan.
pub mod charts;
/// The gallery of a grasp list.
pub mod gallery;
/// One self-contained HTML file.
pub mod page;
/// One colour per finger, the same in every picture.
pub mod palette;
/// Small software renderer.
pub mod render;
/// A manipulation graph in the plane.
pub mod roadmap_picture;
/// Plans of whole robots.
pub mod robots;
/// Runs of the executor.
pub mod runs;
/// What a page is told.
pub mod story;
/// Key frames of a plan in one picture.
pub mod storyboard;
/// A plan read along time.
pub mod timeline;

pub use story::Story;
