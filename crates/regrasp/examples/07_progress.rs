//! Watches a search, and stops it.

#![allow(clippy::print_stdout, reason = "examples talk")]

use regrasp::planners::in_hand::ImprovementSettings;
use regrasp::planners::{FailureKind, Progress};
use regrasp::robot::import::LoadOptions;
use regrasp::scene::load_scene;
use regrasp::{Budget, InHandSettings, plan_in_hand};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/six_finger_box_90x.toml");
    let loaded = load_scene(&path, &LoadOptions::default())?;
    // Improving without end, were it not for the flag.
    let settings = InHandSettings {
        improvement: ImprovementSettings { improve_work: u64::MAX, ..ImprovementSettings::default() },
        ..InHandSettings::default()
    };
    let budget = Budget::unlimited();
    let cancelled = Arc::clone(&budget.cancelled);
    // Called by whichever thread is searching; the flag may be set from any thread, such as that of a signal handler.
    let watch = |progress: Progress| {
        println!("  {:8} configurations, {:.2} rad left", progress.work, progress.angle_left);
        if progress.work > 100_000 {
            cancelled.store(true, Ordering::Relaxed);
        }
    };
    match plan_in_hand(&loaded.view(), loaded.task().query(0).as_in_hand().unwrap(), &settings, 0, &budget, &watch) {
        Ok(plan) => println!("stopped with the best plan so far: {} relocations", plan.statistics.relocations),
        Err(failure) if failure.kind == FailureKind::Interrupted => println!("stopped before a plan was found"),
        Err(failure) => return Err(failure.into()),
    }
    Ok(())
}
