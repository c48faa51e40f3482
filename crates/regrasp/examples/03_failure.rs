//! Not to find a plan is a result, not an error: it says why, how near it came, and what to try.

#![allow(clippy::print_stdout, reason = "examples talk")]

use regrasp::robot::import::LoadOptions;
use regrasp::scene::load_scene;
use regrasp::{Budget, InHandSettings, plan_in_hand};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let loaded = load_scene(&scenes.join("box_180x.toml"), &LoadOptions::default())?;
    let budget = Budget::work(2_000);
    let result = plan_in_hand(
        &loaded.view(),
        loaded.task().query(0).as_in_hand().unwrap(),
        &InHandSettings::default(),
        0,
        &budget,
        &|_| {},
    );
    let Err(failure) = result else {
        return Err("two thousand configurations are not enough for half a turn of a box".into());
    };
    println!("{:?}: {}", failure.kind, failure.message);
    for cause in failure.causes.iter().take(3) {
        println!("  {:6} times: {}", cause.count, cause.reason);
    }
    if let Some(miss) = &failure.nearest_miss {
        println!("  came within {:.2} rad of the goal", miss.angle_left);
    }
    println!("  try: {}", failure.advice);

    // Being asked nonsense is an error, with code, place and fix.
    match load_scene(&scenes.join("no_such_scene.toml"), &LoadOptions::default()) {
        Ok(_) => Err("there is no such scene".into()),
        Err(error) => {
            println!("{error}");
            Ok(())
        }
    }
}
