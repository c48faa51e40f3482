//! Tests of plan files and of the checker.

mod check;
mod couplings;
mod format;
mod levels;
mod loaded;
mod loaded_tests;
mod motion;
mod rolled;
mod rolled_tests;
mod sample;
mod several;
mod tracked;
mod tracking;
