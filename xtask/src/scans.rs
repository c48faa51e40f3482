//! `cargo xtask bench-scans`: scanned objects that are not convex, turned in the Allegro hand.

use crate::matrix;
use crate::run::{Outcome, models, number, out, package, regrasp, regrasp_with};
use std::fs;
use std::path::Path;

/// Objects of `matrix` by name, and orientations (x, y, z, w) with the longest extent of the file along z and the middle one along y.
const OBJECTS: [(&str, [f64; 4]); 11] = [
    ("bull", [0.0, H, H, 0.0]),
    ("horse", [-0.5, -0.5, -0.5, 0.5]),
    ("gso_mug", [-0.5, -0.5, -0.5, 0.5]),
    ("ycb_mug", [0.0, -H, 0.0, H]),
    ("banana", [0.5, 0.5, 0.5, 0.5]),
    ("drill", [0.5, 0.5, 0.5, 0.5]),
    ("mustard", [0.0, 0.0, H, H]),
    ("marker", [0.5, 0.5, 0.5, 0.5]),
    ("gso_screwdriver", [-0.5, -0.5, -0.5, 0.5]),
    ("ycb_screwdriver", [0.0, -H, 0.0, H]),
    ("bottle", [0.0, 0.0, 0.0, 1.0]),
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
                fs::write(&path, scene(&root, object, axis, friction)?)
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

fn scene(root: &Path, (name, quat): &(&str, [f64; 4]), axis: &str, friction: f64) -> Result<String, String> {
    let (file, is_fitted) = matrix::object(name)?;
    let scale = if is_fitted { ", scale = \"fit:0.06\"" } else { "" };
    let hand = root.join("assets/hands/allegro_right/hand.toml");
    Ok(format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n\n[hand]\nfile = {:?}\n\n[object]\nname = \"{name}\"\n\
         mesh = {{ file = \"package://models/objects/{file}\"{scale}, origin = \"center\" }}\nmass = 0.1\nfriction = {friction}\n\n\
         [start]\nposition = [0.082, 0.003, 0.005]\nquat_xyzw = {quat:?}\nposition_within = 0.005\n\n\
         [goal]\nturn = {{ axis = \"{axis}\", angle_deg = 90 }}\n",
        hand.display().to_string()
    ))
}
