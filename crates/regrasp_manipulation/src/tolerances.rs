//! Tolerances that plans promise.

/// Largest distance of a holding fingertip from its contact that plans promise, in metres (issue: at most 0.5 mm).
pub const CONTACT_TOLERANCE: f64 = 0.0005;

/// Largest slip of a rolling fingertip in a segment that plans promise, in metres (issue: 0.1 mm).
pub const SLIP_TOLERANCE: f64 = 0.0001;
