//! Scenes times seeds to tables, and campaigns that try the tool itself. Prints nothing; `regrasp_cli` does.
//!
//! Times are taken around calls, in wall-clock and in processor time; planners never see a clock.

/// Trials side by side.
pub mod at_once;
/// Chains of goals.
pub mod chain;
/// Curves as SVG.
mod chart;
/// Rows as CSV, written whole or appended one by one, and read back.
pub mod csv;
/// The same bytes on any number of threads.
pub mod determinism;
/// How loading and planning grow with fingers, triangles, obstacles and threads.
pub mod growth;
/// First and improved plans side by side.
pub mod improvement;
/// Times within which scenes should be solved.
pub mod limits;
/// The checker against good and broken plans.
pub mod mutations;
/// `docs/benchmarks.md` from CSV files.
pub mod page;
/// Random queries on a roadmap, and what a graph is like.
pub mod roadmap;
/// One seed of one scene: plan, judge, measure.
pub mod row;
/// The tables and figures of a paper, measured again.
pub mod suite;
/// Smallest, median, mean and largest per scene and method.
pub mod summary;
/// Tasks of pick and place.
pub mod task;
/// Text for pages.
mod text;

pub use limits::Limits;
pub use row::{Problem, Row, RunSettings, run};
pub use summary::{Spread, Summary, summarise};
