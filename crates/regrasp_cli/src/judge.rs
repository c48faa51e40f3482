//! What the checker said, in words and as an event.

use crate::talk::Talk;
use regrasp::{Plan, Scene};
use serde_json::json;
use std::time::Duration;

/// What the checker said.
#[derive(Debug)]
pub struct Verdict {
    violations: Vec<String>,
}

impl Verdict {
    /// True when nothing is wrong.
    pub fn is_accepted(&self) -> bool {
        self.violations.is_empty()
    }
}

/// Judges.
pub fn judge(_scene: &Scene, _plan: &Plan) -> Verdict {
    Verdict { violations: vec!["waits for branch plan".into()] }
}

/// Says what the checker said.
pub fn say(verdict: &Verdict, elapsed: Duration, talk: &Talk) {
    talk.event("check", json!({ "accepted": verdict.is_accepted(), "seconds": elapsed.as_secs_f64() }));
    talk.say(format!("check  {} violations", verdict.violations.len()));
}
