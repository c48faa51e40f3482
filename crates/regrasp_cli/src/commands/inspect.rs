//! `regrasp inspect`: what a hand is like, and a hand file for it.

use crate::args::{self, Common};
use crate::stop::Stop;
use crate::talk::Talk;

/// Prints the report; writes the hand file when asked.
pub fn run(_arguments: &args::Inspect, _common: &Common, _talk: &Talk) -> Result<(), Stop> {
    Err(Stop::Internal("waits for branch robot".into()))
}
