//! Reads a hand file and says where its fingertips rest and in how many ways each finger reaches that point.

#![allow(clippy::print_stdout, reason = "examples talk")]

use regrasp::robot::import::{LoadOptions, load_hand};
use regrasp::robot::kinematics::finger_ik::IkSettings;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // cargo run -p regrasp --example 01_load_a_hand -- my_hand.toml
    let bundled = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/hands/wide_four_finger/hand.toml");
    let path = std::env::args_os().nth(1).map_or_else(|| PathBuf::from(bundled), PathBuf::from);
    let loaded = load_hand(&path, &LoadOptions::default())?;
    for note in &loaded.notes {
        println!("note: {note}");
    }
    let hand = loaded.hand;
    println!("{}: {} fingers, {} joints", hand.robot.name, hand.fingers.len(), hand.n_joints());
    for finger in &hand.fingers {
        let tip_in_base = finger.ik.tip(&finger.rest);
        let mut postures = Vec::new();
        finger.ik.solve_all(&tip_in_base, &IkSettings::default(), &mut postures);
        let [x, y, z] = (tip_in_base * 1e3).into();
        println!(
            "  {}: tip rests at [{x:.1} {y:.1} {z:.1}] mm, postures found that reach it: {}",
            finger.name,
            postures.len()
        );
        for (name, angle) in finger.chain.names.iter().zip(&finger.rest) {
            println!("    {name:24} {:7.1} deg", angle.to_degrees());
        }
    }
    Ok(())
}
