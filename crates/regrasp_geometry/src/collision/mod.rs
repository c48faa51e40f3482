//! Separation of shapes, at rest and along motions.
