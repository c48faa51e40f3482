//! Exports a plan: arrays for numpy, a trajectory for ROS 2.

#![allow(clippy::print_stdout, reason = "examples talk")]

use regrasp::export::{PlanArrays, to_npz, to_ros2};
use regrasp::robot::import::LoadOptions;
use regrasp::scene::load_scene;
use regrasp::{Budget, InHandSettings, plan_in_hand};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
    let loaded = load_scene(&path, &LoadOptions::default())?;
    let (query, budget) = (loaded.task().query(1), Budget::work(5_000_000));
    let plan =
        plan_in_hand(&loaded.view(), query.as_in_hand().unwrap(), &InHandSettings::default(), 1, &budget, &|_| {})?;

    let arrays = PlanArrays::new(&plan);
    println!("{} waypoints of {} joints", arrays.n_waypoints, arrays.joint_names.len());
    println!("plan.npz: {} bytes, for numpy.load", to_npz(&plan)?.len());
    println!("trajectory.yaml: {} lines, for `ros2 topic pub --once`", to_ros2(&plan)?.lines().count());
    Ok(())
}
