//! The scene files of the points, with the files that they name.

use super::{Curve, Point, ellipsoid, hand, obstacles};
use regrasp_base::files::write_atomic;
use std::io;
use std::path::{Path, PathBuf};

/// Half axes of the ellipsoid, in metres.
const RADII: [f64; 3] = [0.030, 0.028, 0.034];
/// Torsion radius of soft fingertips, in metres; as in `assets/hands/soft_pair`.
const TORSION_RADIUS: f64 = 0.005;
/// Seed of the obstacles: which ones there are is no part of the trial.
const OBSTACLE_SEED: u64 = 0;

/// Writes the scene of a point into `folder`, which exists, with its hand and mesh; returns the scene file.
pub fn write_scene(point: &Point, folder: &Path) -> io::Result<PathBuf> {
    let n_fingers = if point.curve == Curve::Fingers { point.size as usize } else { 4 };
    let urdf = format!("hand_{n_fingers}.urdf");
    let hand_file = format!("hand_{n_fingers}.toml");
    write_atomic(&folder.join(&urdf), hand::urdf(n_fingers).as_bytes())?;
    write_atomic(&folder.join(&hand_file), hand::hand_toml(&urdf, n_fingers).as_bytes())?;
    let mesh_file = format!("{}_{}.stl", point.object, point.size);
    if point.curve == Curve::Triangles {
        write_atomic(&folder.join(&mesh_file), &ellipsoid::stl(RADII, point.size as usize))?;
    }
    let path = folder.join(scene_name(point)).with_extension("toml");
    write_atomic(&path, scene_toml(point, &hand_file, &mesh_file).as_bytes())?;
    Ok(path)
}

/// Points that differ in threads only have one scene.
fn scene_name(point: &Point) -> String {
    let Point { curve, object, size } = point;
    match curve {
        Curve::Threads => format!("threads_{object}"),
        _ => format!("{}_{object}_{size}", curve.name()),
    }
}

fn scene_toml(point: &Point, hand_file: &str, mesh_file: &str) -> String {
    let contact = match point.curve {
        // Three hard fingers cannot hold while one of them is away; all sizes have the same tips.
        Curve::Fingers => format!("contact = \"soft_finger\"\ntorsion_radius = {TORSION_RADIUS}\n"),
        _ => String::new(),
    };
    let shape = match point.object {
        "sphere" => "sphere = { radius = 0.032 }".to_owned(),
        "box" => "box = { size = [0.050, 0.050, 0.060] }".to_owned(),
        // With few triangles edges fold by more than the default allows; no size has creases.
        _ => format!("mesh = {{ file = \"{mesh_file}\" }}\ncrease_angle_deg = 90"),
    };
    let start = match point.curve {
        // The queries of a batch differ.
        Curve::Threads => "position_within = 0.003\n",
        _ => "",
    };
    let obstacles = match point.curve {
        Curve::Obstacles => obstacles::obstacles_toml(point.size as usize, OBSTACLE_SEED),
        _ => String::new(),
    };
    format!(
        "# {}: {} of {}; written by `regrasp growth`.\n\
         format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n\n\
         [hand]\nfile = \"{hand_file}\"\n{contact}\n\
         [object]\nname = \"{}\"\n{shape}\nmass = 0.1\nfriction = 0.8\n{obstacles}\n\
         [start]\nposition = [0.0, 0.0, 0.078]\n{start}\n\
         [goal]\nturn = {{ axis = \"x\", angle_deg = 90 }}\n",
        point.object,
        point.size,
        point.curve.name(),
        point.object
    )
}
