//! Plans a bundled scene, has the plan judged by the independent checker, and says which finger let go when.

#![allow(clippy::print_stdout, reason = "examples talk")]

use regrasp::plan::check::{CheckSettings, check};
use regrasp::plan::plan::SegmentKind;
use regrasp::robot::import::LoadOptions;
use regrasp::scene::load_scene;
use regrasp::{Budget, InHandSettings, plan_in_hand};
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // cargo run --release -p regrasp --example 02_plan_and_check -- my_scene.toml
    let bundled = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/box_90x.toml");
    let path = std::env::args_os().nth(1).map_or_else(|| PathBuf::from(bundled), PathBuf::from);
    let loaded = load_scene(&path, &LoadOptions::default())?;
    let seed = 7;
    let query = loaded.task().query(seed);

    // The budget counts configurations looked at, so that every machine finds the same plan.
    let budget = Budget::work(5_000_000);
    let plan = match plan_in_hand(
        &loaded.view(),
        query.as_in_hand().unwrap(),
        &InHandSettings::default(),
        seed,
        &budget,
        &|_| {},
    ) {
        Ok(plan) => plan,
        Err(failure) => return Err(format!("no plan: {failure}").into()),
    };
    for segment in &plan.segments {
        let n_waypoints = segment.waypoints.len();
        match (segment.kind, &segment.moving_finger) {
            (SegmentKind::Regrasp, Some(finger)) => {
                println!("{finger} moves to another contact, {n_waypoints} waypoints")
            }
            _ => println!("all fingers hold, the object moves, {n_waypoints} waypoints"),
        }
    }

    let report = check((&loaded.scene, &loaded.state), Some(&query), &plan, &CheckSettings::default());
    for violation in &report.violations {
        println!("{violation}");
    }
    println!("accepted: {}, smallest margin {:.4}", report.accepted(), report.min_margin.unwrap_or(0.0));
    if report.accepted() { Ok(()) } else { Err("rejected".into()) }
}
