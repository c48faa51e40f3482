//! Arguments of `regrasp grasps`.

use super::values::{count, degrees, margin, metres, number_from_zero, place, seconds, threads, whole_number};
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use std::time::Duration;

/// `regrasp grasps`
#[derive(Debug, Args)]
pub struct Grasps {
    /// Hand file, or a URDF whose fingers are then guessed; with --pair the list of the hand that holds the object first
    pub hand: PathBuf,
    /// Mesh file, or a scene file whose object is taken; with --pair the list of the hand that takes the object
    pub object: PathBuf,
    /// Pair the grasps of two lists: double grasps
    #[arg(long)]
    pub pair: bool,
    /// With --pair: scene file of the place where the first hand takes the object, with its obstacles and supports
    #[arg(long, value_name = "SCENE.toml", requires = "pair")]
    pub start: Option<PathBuf>,
    /// With --pair: scene file of the place where the second hand leaves the object
    #[arg(long, value_name = "SCENE.toml", requires = "pair")]
    pub goal: Option<PathBuf>,
    /// With --pair: the robot's base in the world, in metres; hands that come from there score higher
    #[arg(long, value_name = "X,Y,Z", requires = "pair", value_parser = place, allow_hyphen_values = true)]
    pub robot_base: Option<[f64; 3]>,
    /// Read the grasps of an Isaac grasp file, or of a list, and keep those that hold
    #[arg(long, value_name = "FILE", conflicts_with = "pair")]
    pub import: Option<PathBuf>,
    /// Grasp list [default: stdout]
    #[arg(short, long, value_name = "grasps.json")]
    pub output: Option<PathBuf>,
    /// Write a page with a picture of every grasp too
    #[arg(long, value_name = "PAGE.html")]
    pub report: Option<PathBuf>,
    /// How grasps come about
    #[arg(long, value_parser = PossibleValuesParser::new(["precision", "gripper", "closing"]))]
    pub kind: Option<String>,
    /// Grasps that are kept [default: 100]
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub grasps: Option<u64>,
    /// Frames of the grid [default: 345600]
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub frames: Option<u64>,
    /// Force-closure margin of every grasp, in [0, 1) [default: 0.01]
    #[arg(long, value_parser = margin, allow_negative_numbers = true)]
    pub margin: Option<f64>,
    /// The object's friction coefficient is divided by this number, at least 1 [default: 1.5]
    #[arg(long, value_name = "F", value_parser = number_from_zero, allow_negative_numbers = true)]
    pub friction_margin: Option<f64>,
    /// Settings of the search, with the keys of "settings" in a grasp list; other flags win over the file
    #[arg(long, value_name = "FILE.json")]
    pub settings: Option<PathBuf>,
    /// Mass of a mesh, in kilograms [default: 0.1]
    #[arg(long, value_name = "KG", value_parser = number_from_zero, allow_negative_numbers = true)]
    pub mass: Option<f64>,
    /// Friction coefficient between fingertips and a mesh [default: 0.8]
    #[arg(long, value_name = "MU", value_parser = number_from_zero, allow_negative_numbers = true)]
    pub friction: Option<f64>,
    /// Scale of a mesh [default: 1]
    #[arg(long, value_name = "F", value_parser = number_from_zero, allow_negative_numbers = true)]
    pub scale: Option<f64>,
    /// Contacts keep this distance from creases of a mesh, in metres
    #[arg(long, value_name = "M", value_parser = metres, allow_negative_numbers = true)]
    pub edge_distance: Option<f64>,
    /// Edges of a mesh that fold by more than this are creases
    #[arg(long, value_name = "DEG", value_parser = degrees, allow_negative_numbers = true)]
    pub crease_angle: Option<f64>,
    /// Soft fingertips of this torsion radius, in metres, where the hand file names no contact model
    #[arg(long, value_name = "M", value_parser = metres, allow_negative_numbers = true)]
    pub torsion_radius: Option<f64>,
    /// Seed
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub seed: u64,
    /// Threads [default: all cores]; the list does not depend on it
    #[arg(long, value_parser = threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Time limit in seconds: what was found until then is the list
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub time_limit: Option<Duration>,
    /// Work limit, in configurations examined: the same on every machine
    #[arg(long, value_name = "N", default_value_t = 100_000_000, value_parser = whole_number, allow_negative_numbers = true)]
    pub max_work: u64,
}
