//! `cargo xtask bench-scans`: scanned objects that are not convex, turned in the Allegro hand.

use crate::run::{Outcome, models, number, out, package, regrasp, regrasp_with};
use std::fs;
use std::path::Path;

/// Objects: name, file, and orientation (x, y, z, w) with the longest extent of the file along z and the middle one along y. The
/// length is the middle extent they are fitted to, where they are larger.
const OBJECTS: [(&str, &str, [f64; 4], bool); 11] = [
    ("bull", "gso_Schleich_Hereford_Bull/mesh.obj", [0.0, H, H, 0.0], true),
    ("horse", "gso_Breyer_Horse_Of_The_Year_2015/mesh.obj", [-0.5, -0.5, -0.5, 0.5], true),
    ("gso_mug", "gso_Room_Essentials_Mug_White_Yellow/mesh.obj", [-0.5, -0.5, -0.5, 0.5], true),
    ("ycb_mug", "ycb_025_mug/mesh.obj", [0.0, -H, 0.0, H], true),
    ("banana", "ycb_011_banana/mesh.obj", [0.5, 0.5, 0.5, 0.5], true),
    ("drill", "ycb_035_power_drill/mesh.obj", [0.5, 0.5, 0.5, 0.5], true),
    ("mustard", "ycb_006_mustard_bottle/mesh.obj", [0.0, 0.0, H, H], true),
    ("marker", "ycb_040_large_marker/mesh.obj", [0.5, 0.5, 0.5, 0.5], false),
    ("gso_screwdriver", "gso_Craftsman_Grip_Screwdriver_Phillips_Cushion/mesh.obj", [-0.5, -0.5, -0.5, 0.5], false),
    ("ycb_screwdriver", "ycb_043_phillips_screwdriver/mesh.obj", [0.0, -H, 0.0, H], true),
    ("bottle", "robosuite_small/bottle.stl", [0.0, 0.0, 0.0, 1.0], false),
];

/// Half the square root of two.
const H: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Each object about z and x, with friction 0.8 and 1.5; `SCAN_SEEDS` seeds, `SCAN_WORK` configurations each.
pub fn task(_: &[String]) -> Outcome {
    let Some(models) = models() else { return Ok(()) };
    let program = regrasp()?;
    let folder = out("scans")?;
    let root = std::env::current_dir().map_err(|error| format!("there is no current folder: {error}"))?;
    let mut scenes = Vec::new();
    for (friction, tail) in [(1.5, "15"), (0.8, "08")] {
        for axis in ["z", "x"] {
            for object in &OBJECTS {
                let path = folder.join(format!("{}_{axis}_{tail}.toml", object.0));
                fs::write(&path, scene(&root, object, axis, friction))
                    .map_err(|error| format!("{} cannot be written: {error}", path.display()))?;
                scenes.push(path.display().to_string());
            }
        }
    }
    let (seeds, work) = (number("SCAN_SEEDS", 5)?, number("SCAN_WORK", 160_000)?);
    let limits = format!("--seeds {seeds} --max-work {work} --threads 1");
    let csv = "docs/benchmarks/scans.csv";
    regrasp_with(&program, &format!("bench {} {} {limits} --csv {csv}", scenes.join(" "), package(&models)))
}

fn scene(root: &Path, object: &(&str, &str, [f64; 4], bool), axis: &str, friction: f64) -> String {
    let (name, file, quat, is_fitted) = object;
    let scale = if *is_fitted { ", scale = \"fit:0.06\"" } else { "" };
    let hand = root.join("assets/hands/allegro_right/hand.toml");
    format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n\n[hand]\nfile = {:?}\n\n[object]\nname = \"{name}\"\n\
         mesh = {{ file = \"package://models/objects/{file}\"{scale}, origin = \"center\" }}\nmass = 0.1\nfriction = {friction}\n\n\
         [start]\nposition = [0.082, 0.003, 0.005]\nquat_xyzw = {quat:?}\nposition_within = 0.005\n\n\
         [goal]\nturn = {{ axis = \"{axis}\", angle_deg = 90 }}\n",
        hand.display().to_string()
    )
}
