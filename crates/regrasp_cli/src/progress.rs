//! What is printed while a search runs: one line per interval, no carriage returns.

use crate::talk::Talk;
use crate::words::grouped;
use regrasp::planners::Progress;
use serde_json::json;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Prints a search as it goes on.
pub struct ProgressLines<'a> {
    talk: &'a Talk,
    started: Instant,
    interval: Duration,
    last: Mutex<Option<Instant>>,
}

impl<'a> ProgressLines<'a> {
    /// Starts now: a line every half second when somebody watches, else every five seconds.
    pub fn new(talk: &'a Talk) -> Self {
        let interval = Duration::from_millis(if talk.is_watched() { 500 } else { 5000 });
        ProgressLines { talk, started: Instant::now(), interval, last: Mutex::new(None) }
    }

    /// Called by the search, from any thread.
    pub fn report(&self, progress: Progress) {
        let now = Instant::now();
        let Ok(mut last) = self.last.lock() else { return };
        if now.duration_since(last.unwrap_or(self.started)) < self.interval {
            return;
        }
        if last.is_none() {
            self.talk.say("   time      nodes  configurations  restarts  angle left");
        }
        *last = Some(now);
        drop(last);
        let elapsed = now.duration_since(self.started).as_secs_f64();
        self.talk.say(format!(
            "{elapsed:>5.1} s {:>10} {:>15} {:>9} {:>7.1} deg",
            grouped(progress.nodes),
            grouped(progress.work),
            progress.restarts,
            progress.angle_left.to_degrees()
        ));
        self.talk.event(
            "progress",
            json!({
                "elapsed": elapsed,
                "nodes": progress.nodes,
                "work": progress.work,
                "restarts": progress.restarts,
                "angle_left": progress.angle_left,
            }),
        );
    }
}
