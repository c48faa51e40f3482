//! Arguments of `regrasp roadmap`.

use super::Judging;
use super::values::{count, degrees, margin, metres, threads, whole_number};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// `regrasp roadmap`
#[derive(Debug, Args)]
pub struct Roadmap {
    /// What to do with it.
    #[command(subcommand)]
    pub action: RoadmapAction,
}

/// What can be done with a roadmap.
#[derive(Debug, Subcommand)]
pub enum RoadmapAction {
    /// Build the roadmap of a scene's hand and object, or of its robot
    Build(RoadmapBuild),
    /// Plan the turn of a scene with a roadmap, check the plan, then write it
    Query(RoadmapQuery),
    /// Show hand, object and size of a roadmap
    Info {
        /// Roadmap file
        roadmap: PathBuf,
    },
    /// Draw a roadmap, and the answer to a query if a scene is given
    Picture(RoadmapPicture),
    /// Answer random queries with a roadmap and print a table
    Bench(RoadmapBench),
}

/// `regrasp roadmap build`
#[derive(Debug, Args)]
pub struct RoadmapBuild {
    /// Scene file
    pub scene: PathBuf,
    /// Roadmap file; of a robot it is JSON, and plans find SCENE.roadmap.json beside the scene
    #[arg(short, long, value_name = "FILE.roadmap")]
    pub output: PathBuf,
    /// Object poses that the graph is built over [default: 400]
    #[arg(long, value_parser = count, allow_negative_numbers = true)]
    pub places: Option<u64>,
    /// How far the object may be from start and goal position, along each axis, in metres
    #[arg(long, value_name = "M", default_value_t = 0.01, value_parser = metres, allow_negative_numbers = true)]
    pub within: f64,
    /// Largest angle from the start orientation, in degrees; 180 is every orientation
    #[arg(long, value_name = "DEG", default_value_t = 180.0, value_parser = degrees, allow_negative_numbers = true)]
    pub angle: f64,
    /// All settings of the build, as `roadmap info --json` shows them; other flags go before it
    #[arg(long, value_name = "FILE.json")]
    pub build_settings: Option<PathBuf>,
    /// Settings of the planner, with the keys of a plan file
    #[arg(long, value_name = "FILE.json")]
    pub settings: Option<PathBuf>,
    /// Force-closure margin that the holding fingers keep, in [0, 1) [default: 0.02, or 0.005 where
    /// that connects more of the region; with --settings that of the file]
    #[arg(long, value_parser = margin, allow_negative_numbers = true)]
    pub margin: Option<f64>,
    /// Seed
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub seed: u64,
    /// Threads [default: all cores]; the graph does not depend on it
    #[arg(long, value_parser = threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

/// `regrasp roadmap picture`
#[derive(Debug, Args)]
pub struct RoadmapPicture {
    /// Roadmap file
    pub roadmap: PathBuf,
    /// Scene file, of the same hand and object, whose turn is planned on the graph. Needed for a robot's roadmap: the one it was built for
    pub scene: Option<PathBuf>,
    /// Picture
    #[arg(short, long, value_name = "FILE.svg")]
    pub output: PathBuf,
    /// Seed of the query
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub seed: u64,
    /// Work limit of the query, in configurations looked at
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = whole_number, allow_negative_numbers = true)]
    pub max_work: u64,
}

/// `regrasp roadmap query`
#[derive(Debug, Args)]
pub struct RoadmapQuery {
    /// Roadmap file
    pub roadmap: PathBuf,
    /// Scene file, of the same hand and object
    pub scene: PathBuf,
    /// Plan file [default: stdout]
    #[arg(short, long, value_name = "plan.json")]
    pub output: Option<PathBuf>,
    /// Seed
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub seed: u64,
    /// Add start and goal to the graph and save it
    #[arg(long)]
    pub grow: bool,
    /// Join successive transfers where that is free of collisions: shorter motions, slower answers
    #[arg(long)]
    pub smooth: bool,
    /// Settings that the plan must keep; refused if the roadmap was built with others
    #[arg(long, value_name = "FILE.json")]
    pub settings: Option<PathBuf>,
    /// Force-closure margin that the plan must keep; refused if the roadmap was built with another
    #[arg(long, value_parser = margin, allow_negative_numbers = true)]
    pub margin: Option<f64>,
    /// Work limit, in configurations examined: the same on every machine
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = whole_number, allow_negative_numbers = true)]
    pub max_work: u64,
    /// By what plans are judged.
    #[command(flatten)]
    pub judging: Judging,
}

/// `regrasp roadmap bench`
#[derive(Debug, Args)]
pub struct RoadmapBench {
    /// Roadmap file
    pub roadmap: PathBuf,
    /// Scene file, of the same hand and object
    pub scene: PathBuf,
    /// Queries: start and goal drawn uniformly from the graph's region, by seeds 0, 1, ...
    #[arg(long, default_value_t = 1000, value_parser = count, allow_negative_numbers = true)]
    pub queries: u64,
    /// Of these, how many are planned without the graph too
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub single: u64,
    /// First seed
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub first_seed: u64,
    /// Join successive transfers where that is free of collisions: shorter motions, slower answers
    #[arg(long)]
    pub smooth: bool,
    /// Write one row per query and method
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write what the graph is like and how long it takes to load
    #[arg(long, value_name = "FILE.json")]
    pub graph: Option<PathBuf>,
    /// Write every plan: DIR/roadmap/SEED.json, and DIR/single/SEED.json of those planned without the graph. Each says its start and
    /// goal, so that `regrasp check --own-query` judges it
    #[arg(long, value_name = "DIR")]
    pub plans: Option<PathBuf>,
    /// Do not judge the plans
    #[arg(long)]
    pub no_check: bool,
    /// By what plans are judged.
    #[command(flatten)]
    pub judging: Judging,
}
