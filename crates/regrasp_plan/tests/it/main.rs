//! Tests of plan files and of the checker.

mod check;
mod format;
mod mutation;
mod sample;
