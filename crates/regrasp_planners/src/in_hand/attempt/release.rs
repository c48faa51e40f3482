//! What letting a finger go was seen to come to.

/// How the others hold without a finger, over the closed grasps in which it holds.
#[derive(Debug, Clone, Copy, Default)]
pub struct Held {
    /// Closed grasps looked at.
    pub n_grasps: u64,
    /// Of these, grasps that the others hold with the margin asked for.
    pub n_held: u64,
    /// Largest margin of the others, up to the one asked for.
    pub best: f64,
}

impl Held {
    /// Adds what was seen elsewhere.
    pub fn add(&mut self, other: &Held) {
        self.n_grasps += other.n_grasps;
        self.n_held += other.n_held;
        self.best = self.best.max(other.best);
    }
}
