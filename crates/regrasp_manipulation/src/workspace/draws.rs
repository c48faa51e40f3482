//! What draws of contacts cost: on a surface that fingertips hardly fit, such as that of a thin mesh, more than all else.

use crate::workspace::Workspace;

/// Work of draws.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    /// Units so far.
    work: u64,
    /// Work of the whole search at which draws that cost something end.
    pub work_limit: u64,
}

impl Default for Draws {
    fn default() -> Self {
        Draws { work: 0, work_limit: u64::MAX }
    }
}

impl Workspace<'_> {
    /// Counts units of work for draws.
    pub fn count_draws(&mut self, units: u64) {
        self.work += units;
        self.draws.work += units;
    }

    /// True when the work allowed is spent, some of it on draws: more of them would take time that no limit bounds.
    pub fn is_spent_on_draws(&self) -> bool {
        self.draws.work > 0 && self.work >= self.draws.work_limit
    }
}
