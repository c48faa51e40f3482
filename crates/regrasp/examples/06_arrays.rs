//! Reads a plan as arrays: how far joints go, how long fingers hold.

#![allow(clippy::print_stdout, reason = "examples talk")]

use regrasp::export::PlanArrays;
use regrasp::export::arrays::CONTACT_MODES;
use regrasp::robot::import::LoadOptions;
use regrasp::scene::load_scene;
use regrasp::{Budget, InHandSettings, plan_in_hand};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_180z.toml");
    let loaded = load_scene(&path, &LoadOptions::default())?;
    let (query, budget) = (loaded.task().query(3), Budget::work(5_000_000));
    let plan =
        plan_in_hand(&loaded.view(), query.as_in_hand().unwrap(), &InHandSettings::default(), 3, &budget, &|_| {})?;

    // Every array travels with its names: rows are waypoints, columns are `joint_names` or `fingers`.
    let arrays = PlanArrays::new(&plan);
    let (n_joints, n_fingers) = (arrays.joint_names.len(), arrays.fingers.len());
    let duration = arrays.times[arrays.n_waypoints - 1];
    println!("{} waypoints, {duration:.1} s", arrays.n_waypoints);
    for (column, name) in arrays.joint_names.iter().enumerate() {
        let of_joint: Vec<f64> = arrays.joints.iter().skip(column).step_by(n_joints).copied().collect();
        let travel: f64 = of_joint.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
        println!("  {name:24} goes {:6.1} deg", travel.to_degrees());
    }
    for (column, name) in arrays.fingers.iter().enumerate() {
        let modes = arrays.contact_modes.iter().skip(n_fingers + column).step_by(n_fingers);
        let steps = arrays.times.windows(2).map(|pair| pair[1] - pair[0]);
        let held = modes.zip(steps).filter(|(mode, _)| CONTACT_MODES[usize::from(**mode)] != "free");
        println!(
            "  {name:8} holds for {:5.1} % of the time",
            100.0 * held.map(|(_, step)| step).sum::<f64>() / duration
        );
    }
    Ok(())
}
