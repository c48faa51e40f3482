//! Closure against second ways of knowing.

mod closed_forms;
mod closure;
mod polyhedral;
mod sample;
