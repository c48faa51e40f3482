//! What is printed while a search runs: one line per interval, no carriage returns.

use crate::talk::Talk;
use crate::words::grouped;
use regrasp::planners::Progress;
use regrasp::planners::in_hand::placing::Tried;
use serde_json::json;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// When the next line is due: every half second when somebody watches, else every five seconds.
struct Due {
    started: Instant,
    interval: Duration,
    last: Mutex<Option<Instant>>,
}

impl Due {
    fn new(talk: &Talk) -> Self {
        let interval = Duration::from_millis(if talk.is_watched() { 500 } else { 5000 });
        Due { started: Instant::now(), interval, last: Mutex::new(None) }
    }

    /// Where a line is due, the seconds that went by, and whether it is the first one.
    fn now(&self) -> Option<(f64, bool)> {
        let now = Instant::now();
        let mut last = self.last.lock().ok()?;
        if now.duration_since(last.unwrap_or(self.started)) < self.interval {
            return None;
        }
        let is_first = last.replace(now).is_none();
        Some((now.duration_since(self.started).as_secs_f64(), is_first))
    }
}

/// Prints a search as it goes on.
pub struct ProgressLines<'a> {
    talk: &'a Talk,
    due: Due,
}

impl<'a> ProgressLines<'a> {
    /// Starts now.
    pub fn new(talk: &'a Talk) -> Self {
        ProgressLines { talk, due: Due::new(talk) }
    }

    /// Called by the search, from any thread.
    pub fn report(&self, progress: Progress) {
        let Some((elapsed, is_first)) = self.due.now() else { return };
        if is_first {
            self.talk.say("   time      nodes  configurations  restarts  angle left");
        }
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

/// Prints what `regrasp place` has tried as it goes on.
pub struct PlaceLines<'a> {
    talk: &'a Talk,
    due: Due,
}

impl<'a> PlaceLines<'a> {
    /// Starts now.
    pub fn new(talk: &'a Talk) -> Self {
        PlaceLines { talk, due: Due::new(talk) }
    }

    /// Called now and then.
    pub fn report(&self, tried: &Tried) {
        let Some((elapsed, _)) = self.due.now() else { return };
        self.talk.say(format!(
            "{elapsed:>5.1} s   {} poses looked at, {} with a grasp; searched from {}, {} solved",
            tried.looked_at, tried.with_grasp, tried.probed, tried.solved
        ));
        self.talk.event("progress", json!({ "elapsed": elapsed, "tried": tried }));
    }
}
