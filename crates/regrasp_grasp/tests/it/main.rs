//! Closure and forces against second ways of knowing.

mod closed_forms;
mod closure;
mod forces;
mod isaac_noise;
mod list;
mod polyhedral;
mod sample;
