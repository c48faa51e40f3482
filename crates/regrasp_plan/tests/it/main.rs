//! Tests of plan files and of the checker.

mod check;
mod format;
mod motion;
mod mutation;
mod rolled;
mod sample;
