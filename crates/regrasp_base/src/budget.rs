//! Work budgets. Budgets count work, so that the same seed gives the same plan; a deadline may only cut.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Why a search stopped before it was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interrupt {
    /// The work allowed is used up: the same on every machine.
    WorkSpent,
    /// The deadline of the caller has passed: depends on the machine, and the plan says so.
    Deadline,
    /// The caller asked to stop.
    Cancelled,
}

/// How much a search may do. One unit of work is one configuration looked at (kinematics and collision).
#[derive(Debug, Clone)]
pub struct Budget {
    /// Units of work allowed.
    pub max_work: u64,
    /// Wall-clock instant after which the search is cut.
    pub deadline: Option<Instant>,
    /// Wall-clock time after the first solution, at the end of which looking for a better one is cut.
    pub improve_for: Option<Duration>,
    /// Set by the caller, from any thread, to stop the search.
    pub cancelled: Arc<AtomicBool>,
}

impl Budget {
    /// Only work is limited: fully reproducible.
    pub fn work(max_work: u64) -> Self {
        Budget { max_work, deadline: None, improve_for: None, cancelled: Arc::new(AtomicBool::new(false)) }
    }

    /// No limit but cancellation.
    pub fn unlimited() -> Self {
        Budget::work(u64::MAX)
    }

    /// The same budget with a deadline.
    pub fn with_deadline(mut self, deadline: Instant) -> Self {
        self.deadline = Some(deadline);
        self
    }

    /// What is left for improving a solution that has just been found: the deadline is at most `improve_for` from now.
    pub fn of_improvement(&self) -> Self {
        // A time beyond what clocks count cuts nothing.
        let end = self.improve_for.and_then(|time| Instant::now().checked_add(time));
        let deadline = [self.deadline, end].into_iter().flatten().min();
        Budget { deadline, ..self.clone() }
    }

    /// Err when `work_done` units are too many, the deadline has passed or the caller cancelled.
    ///
    /// The clock is read on every call (about 25 ns); call it once per unit of work that costs more than that.
    pub fn check(&self, work_done: u64) -> Result<(), Interrupt> {
        if work_done >= self.max_work {
            return Err(Interrupt::WorkSpent);
        }
        self.check_caller()
    }

    /// Err when the deadline has passed or the caller cancelled, whatever work was done.
    ///
    /// Reads the clock, as [`Budget::check`] does.
    pub fn check_caller(&self) -> Result<(), Interrupt> {
        if self.cancelled.load(Ordering::Relaxed) {
            return Err(Interrupt::Cancelled);
        }
        match self.deadline {
            Some(deadline) if Instant::now() >= deadline => Err(Interrupt::Deadline),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_limit_is_named() {
        assert_eq!(Budget::work(3).check(2), Ok(()));
        assert_eq!(Budget::work(3).check(3), Err(Interrupt::WorkSpent));
        assert_eq!(Budget::unlimited().with_deadline(Instant::now()).check(0), Err(Interrupt::Deadline));
        let budget = Budget::unlimited();
        budget.cancelled.store(true, Ordering::Relaxed);
        assert_eq!(budget.check(0), Err(Interrupt::Cancelled));
        assert_eq!(budget.check_caller(), Err(Interrupt::Cancelled));
        let hasty = Budget { improve_for: Some(Duration::ZERO), ..Budget::unlimited() };
        assert_eq!(hasty.check(0), Ok(()), "the first solution is waited for");
        assert_eq!(hasty.of_improvement().check(0), Err(Interrupt::Deadline));
        let endless = Budget { improve_for: Some(Duration::MAX), ..Budget::unlimited() };
        assert_eq!(endless.of_improvement().check(0), Ok(()));
        assert_eq!(Budget::work(0).check_caller(), Ok(()), "work is not asked about");
    }
}
