//! Tests of plan files and of the checker.

mod check;
mod couplings;
mod format;
mod levels;
mod loaded;
mod motion;
mod rolled;
mod sample;
mod several;
mod tracked;
mod tracking;
