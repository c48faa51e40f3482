//! The poses of a query that planning begins with, passes and ends at.

use crate::failure::{Failure, FailureKind};

/// Which pose of the query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The start.
    Start,
    /// A pose on the way, by its number from 1.
    Way(usize),
    /// The goal.
    Goal,
}

impl End {
    /// In words.
    pub fn name(self) -> String {
        match self {
            End::Start => "start".into(),
            End::Way(number) => format!("way pose {number}"),
            End::Goal => "goal".into(),
        }
    }

    /// The failure of a query whose pose of this kind is bad.
    pub fn failure(self, message: String, advice: &str) -> Failure {
        let kind = match self {
            End::Start => FailureKind::StartInvalid,
            End::Way(_) => FailureKind::WayInvalid,
            End::Goal => FailureKind::GoalInvalid,
        };
        Failure::bare(kind, message, advice)
    }
}
