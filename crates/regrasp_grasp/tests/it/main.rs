//! Closure and forces against second ways of knowing.

mod closed_forms;
mod closure;
mod forces;
mod list;
mod polyhedral;
mod sample;
