//! Arguments of `regrasp place`.

use super::values::{metres, number_from_zero, seconds, whole_number};
use clap::Args;
use regrasp::scene_text::Turn;
use std::path::PathBuf;
use std::time::Duration;

/// `regrasp place`
#[derive(Debug, Args)]
pub struct Place {
    /// Hand file, or a URDF whose fingers are then guessed
    pub hand: PathBuf,
    /// Mesh file, scene file whose object is taken, or sphere:RADIUS, box:X,Y,Z, cylinder:RADIUS,LENGTH, capsule:RADIUS,LENGTH,
    /// ellipsoid:RX,RY,RZ in metres
    pub object: String,
    /// Turn about an axis of the world that must look possible, such as z:90; may be repeated: each becomes a task
    #[arg(long = "turn", value_name = "AXIS:DEG", default_value = "z:90", value_parser = Turn::read, allow_hyphen_values = true)]
    pub turns: Vec<Turn>,
    /// Look for poses in which the hand holds the object, as `regrasp plan --hold` asks, and turns nothing
    #[arg(long, conflicts_with = "turns")]
    pub hold: bool,
    /// Scene file; the alternatives go beside it
    #[arg(short, long, value_name = "scene.toml")]
    pub output: PathBuf,
    /// Mass of the object, in kilograms [default: 0.1, or the scene's]
    #[arg(long, value_name = "KG", value_parser = number_from_zero, allow_negative_numbers = true)]
    pub mass: Option<f64>,
    /// Friction coefficient between fingertips and object [default: 0.8, or the scene's]
    #[arg(long, value_name = "MU", value_parser = number_from_zero, allow_negative_numbers = true)]
    pub friction: Option<f64>,
    /// Scale of a mesh, as scene files have it: a factor, three factors X,Y,Z, or a text
    #[arg(long, allow_negative_numbers = true)]
    pub scale: Option<String>,
    /// What stands for the inside of a mesh: its triangles, or its convex hull, for meshes that are not closed
    #[arg(long, value_name = "SOLID", value_parser = ["mesh", "hull"])]
    pub solid: Option<String>,
    /// Soft fingertips of this torsion radius, in metres, where the hand file names no contact model
    #[arg(long, value_name = "M", value_parser = metres, allow_negative_numbers = true)]
    pub torsion_radius: Option<f64>,
    /// Write so many more scenes, of the next best poses: scene.2.toml, ...
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=5), allow_negative_numbers = true)]
    pub alternatives: u8,
    /// Draw the best five poses to this folder
    #[arg(long, value_name = "DIR")]
    pub pictures: Option<PathBuf>,
    /// Seed
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub seed: u64,
    /// Time limit in seconds; it may only cut
    #[arg(long, value_name = "S", default_value = "120", value_parser = seconds, allow_negative_numbers = true)]
    pub time_limit: Duration,
    /// Work limit, in configurations examined: the same on every machine
    #[arg(long, value_name = "N", default_value_t = 3_000_000, value_parser = whole_number, allow_negative_numbers = true)]
    pub max_work: u64,
}
