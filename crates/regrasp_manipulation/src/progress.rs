//! What a running search tells its caller.

/// What a running search tells its caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Nodes so far, in this attempt.
    pub nodes: u64,
    /// Configurations looked at so far, in this attempt.
    pub work: u64,
    /// Index of the attempt.
    pub restarts: u64,
    /// Angle from the goal of the nearest pose reached, in radians.
    pub angle_left: f64,
}
