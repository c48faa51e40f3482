//! Small software renderer: triangles in, one picture out, the same bytes on every machine.
//!
//! Visibility is decided in whole numbers (a pixel belongs to exactly one of two triangles that share an edge), shading in
//! `f64`, and nothing depends on threads.

/// Where the picture is taken from.
pub mod camera;
/// Triangles with normals, placed and painted.
pub mod model;
/// PNG files.
pub mod png_file;
/// Which triangle is seen at a sample.
pub mod raster;
/// Light, shadow, outlines and layers.
pub mod shade;
/// Letters and lines on a picture.
pub mod text;

pub use camera::Camera;
pub use model::{Paint, PlacedSurface, Surface};
pub use shade::{Look, Picture, render};
