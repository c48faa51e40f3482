//! How a finger that relocates passes over the object, and how often that failed.

/// How a finger passes from above one contact to above another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PassingOver {
    /// Over the surface, else straight in the joints, else by RRT-Connect.
    SurfaceFirst,
    /// By RRT-Connect alone (Saut 2011, sec. 4.2.3).
    RrtOnly,
}

/// Runs of RRT-Connect.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RrtRuns {
    /// All of them.
    pub all: u64,
    /// Those that found nothing: more iterations might.
    pub failed: u64,
}
