//! The native module `regrasp._regrasp`. The package in `python/regrasp` wraps it; users see that one only.
//!
//! Plain data crosses the border: JSON for records, little-endian bytes for arrays. Every function that Python can call runs
//! in `guard::guarded`, so that no panic gets past it.

/// Scenes and hands as JSON.
mod describe;
/// TOML documents with the lines of their keys.
mod document;
/// Rust errors as Python exceptions.
mod error;
/// Grasp lists.
mod grasps;
/// No panic crosses the border.
mod guard;
/// Hands and scenes, read.
mod model;
/// Where to hold an object.
mod place;
/// Plans.
mod plan;
/// Plans of whole robots.
mod robot_plan;
/// Searching and judging.
mod search;
/// Sessions.
mod session;
/// What judging is asked and what it says.
mod verdict;
/// Pages of plans.
mod view;
/// Searches that the interpreter watches.
mod watch;

use pyo3::prelude::*;

#[pymodule]
mod _regrasp {
    #[pymodule_export]
    use super::document::parse_toml;
    #[pymodule_export]
    use super::grasps::{check_grasps, grasps_mjcf, list_grasps};
    #[pymodule_export]
    use super::guard::panic_for_tests;
    #[pymodule_export]
    use super::model::{Hand, Scene, hand_file};
    #[pymodule_export]
    use super::place::place;
    #[pymodule_export]
    use super::plan::Plan;
    #[pymodule_export]
    use super::robot_plan::RobotPlan;
    #[pymodule_export]
    use super::search::{check, find_scene, plan, plan_motion};
    #[pymodule_export]
    use super::session::{Session, Start};
    #[pymodule_export]
    use super::view::{page, run_file, run_page, storyboard};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::guard::catch_messages();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
