//! Arguments. The spellings are a promise to scripts.

mod grasps;
mod judging;
mod place;
mod roadmap;
mod values;

pub use grasps::Grasps;
pub use judging::{Judging, JudgingLimits};
pub use place::Place;
pub use roadmap::{Roadmap, RoadmapAction, RoadmapBench, RoadmapBuild, RoadmapPicture, RoadmapQuery};
use values::{count, margin, package, seconds, threads, trials, whole_number};

use clap::builder::PossibleValuesParser;
use clap::{ArgGroup, Args, Parser, Subcommand};
use regrasp_bench::growth::Curve;
use std::path::PathBuf;
use std::time::Duration;

/// Methods of the in-hand planner, as `regrasp_planners::Method` spells them, and of tracking, as `TrackingMethod` does.
pub const METHODS: [&str; 5] = ["gait", "visibility", "classic", "tracking", "tracking+gaiting"];

/// Plans in-hand manipulation for multi-fingered hands, and checks plans independently.
///
/// First steps: `regrasp demo`; for a hand of your own `regrasp inspect hand.urdf -o hand.toml`,
/// `regrasp place hand.toml object.stl -o scene.toml`, `regrasp plan scene.toml -o plan.json`, `regrasp check plan.json`.
#[derive(Debug, Parser)]
#[command(name = "regrasp", version, max_term_width = 110, arg_required_else_help = true)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// What every command takes.
    #[command(flatten)]
    pub common: Common,
}

/// What every command takes.
#[derive(Debug, Args)]
pub struct Common {
    /// Folder of package://NAME/...; may be repeated
    #[arg(long = "package", value_name = "NAME=DIR", global = true, value_parser = package)]
    pub packages: Vec<(String, PathBuf)>,
    /// Print one JSON object per line on stdout, and nothing else
    #[arg(long, global = true)]
    pub json: bool,
    /// Print errors only
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Task of a scene that has several, by its name [default: the first; in bench: all]
    #[arg(long = "task", value_name = "NAME", global = true)]
    pub task: Option<String>,
    /// Skip elements of robot files that cannot be read and list them, instead of refusing the file
    #[arg(long, global = true)]
    pub lenient: bool,
}

/// Commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Plan and check a turn of a bundled object in a bundled hand
    Demo(Demo),
    /// Show what a hand is like and write a hand file for it
    Inspect(Inspect),
    /// Find poses of an object in a hand from which it can be turned, and write a scene
    Place(Place),
    /// Plan a scene, check the plan, then write it
    Plan(Plan),
    /// Find grasps of an object, check them, then write the list
    Grasps(Grasps),
    /// Judge a plan or a grasp list from the files alone; exit code 0 accepted, 1 rejected
    Check(Check),
    /// Show a plan: one page for a browser, with nothing to install and no network
    View(View),
    /// Write a plan in the formats of other tools
    Export(Export),
    /// Say how to replay a plan in MuJoCo, which the Python package does
    Simulate(Simulate),
    /// Plan scenes with many seeds and print a table
    Bench(Bench),
    /// Measure how loading and planning grow with fingers, triangles, obstacles and threads
    Growth(Growth),
    /// Build a roadmap of a hand and an object, and answer many queries with it
    Roadmap(Roadmap),
    /// Long tests of the tool itself: determinism, and the checker against broken plans
    #[command(hide = true)]
    Campaign(Campaign),
}

/// `regrasp demo`
#[derive(Debug, Args)]
pub struct Demo {
    /// Folder for scene, plan and picture
    #[arg(short, long, value_name = "DIR", default_value = "regrasp-demo")]
    pub output: PathBuf,
    /// Seed
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub seed: u64,
}

/// `regrasp inspect`
#[derive(Debug, Args)]
pub struct Inspect {
    /// URDF file, or a hand file
    pub urdf: PathBuf,
    /// Write a hand file; for a robot with arms a robot file, with a hand file for each hand beside it
    #[arg(short, long, value_name = "FILE.toml")]
    pub output: Option<PathBuf>,
    /// Look for arms too where the URDF is a hand as it stands
    #[arg(long, conflicts_with = "base")]
    pub robot: bool,
    /// SRDF of a robot with arms: names, mount links and pairs of links that are never tested
    #[arg(long, value_name = "FILE.srdf")]
    pub srdf: Option<PathBuf>,
    /// Base link of the hand in a URDF: its fingers are those below this link [default: guessed]
    #[arg(long, value_name = "LINK")]
    pub base: Option<String>,
    /// Postures sampled for the pairs of links that always or never touch
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000), allow_negative_numbers = true)]
    pub samples: u32,
    /// Seed of the sampled postures
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub seed: u64,
}

/// Work limit where none is given.
pub const DEFAULT_MAX_WORK: u64 = 20_000_000;

/// How to search.
#[derive(Debug, Args)]
pub struct Search {
    /// Method [default: gait; for tracking tasks: tracking]
    #[arg(long, value_parser = PossibleValuesParser::new(METHODS))]
    pub method: Option<String>,
    /// Settings of the planner, with the keys of a plan file; other flags win over the file
    #[arg(long, value_name = "FILE.json")]
    pub settings: Option<PathBuf>,
    /// Force-closure margin that the holding fingers keep, in [0, 1)
    #[arg(long, value_parser = margin, allow_negative_numbers = true)]
    pub margin: Option<f64>,
    /// Time limit in seconds (in bench: per seed) [default: 60 in plan, where no other limit is given; else none]. The check of the
    /// plan may take as long again, and at least 30 s
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub time_limit: Option<Duration>,
    /// Work limit, in configurations examined: the same on every machine
    #[arg(long, value_name = "N", default_value_t = DEFAULT_MAX_WORK, value_parser = whole_number, allow_negative_numbers = true)]
    pub max_work: u64,
    /// Improve the first plan for so many seconds
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub improve: Option<Duration>,
    /// Improve the first plan for so many configurations: the same plan on every machine
    #[arg(long, value_name = "N", value_parser = whole_number, allow_negative_numbers = true)]
    pub improve_work: Option<u64>,
}

/// `regrasp plan`
#[derive(Debug, Args)]
pub struct Plan {
    /// Scene file
    pub scene: PathBuf,
    /// Plan file [default: stdout]
    #[arg(short, long, value_name = "plan.json")]
    pub output: Option<PathBuf>,
    /// Seed
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub seed: u64,
    /// Write a page for a browser too: of the plan, or of the causes when there is none
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// When no plan is found, write pictures of the causes, and of the searched graph or the robot's nearest miss, to this folder
    #[arg(long, value_name = "DIR")]
    pub failure: Option<PathBuf>,
    /// Threads [default: all cores]; the plan does not depend on it
    #[arg(long, value_parser = threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Roadmap of the scene's robot, of `regrasp roadmap build` [default: SCENE.roadmap.json where it lies beside the scene]
    #[arg(long, value_name = "FILE.json")]
    pub roadmap: Option<PathBuf>,
    /// Add to the roadmap of the robot what the plan has and the roadmap has not, and save it
    #[arg(long)]
    pub grow: bool,
    /// How to search.
    #[command(flatten)]
    pub search: Search,
    /// By what plans are judged.
    #[command(flatten)]
    pub judging: Judging,
}

/// `regrasp check`
#[derive(Debug, Args)]
pub struct Check {
    /// Plan file, or grasp list
    pub plan: PathBuf,
    /// Scene file [default: the one that the plan names, beside the plan or in the current folder]
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Hand file of a grasp list [default: the one that the list names]
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    pub hand: Option<PathBuf>,
    /// Object of a grasp list, a mesh or a scene file [default: the one that the list names]
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    pub object: Option<PathBuf>,
    /// Time limit in seconds, for reading and judging a plan. A plan that is not judged whole is rejected [default: none]
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub time_limit: Option<Duration>,
    /// Work limit for judging a plan: configurations, samples and distances [default: 20000000, a hundred times what plans of the
    /// planner need]
    #[arg(long, value_name = "N", value_parser = whole_number, allow_negative_numbers = true)]
    pub max_work: Option<u64>,
    /// By what plans are judged.
    #[command(flatten)]
    pub judging: Judging,
}

/// `regrasp view`
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("pictures").required(true).multiple(true)))]
pub struct View {
    /// Plan file, grasp list (its page is a gallery), or run of the executor
    pub plan: PathBuf,
    /// Scene file [default: the one that the plan names, beside the plan or in the current folder]
    pub scene: Option<PathBuf>,
    /// Page: one HTML file that opens from disk
    #[arg(short, long, value_name = "plan.html", group = "pictures")]
    pub output: Option<PathBuf>,
    /// Data of the page, as JSON
    #[arg(long, value_name = "FILE.json", group = "pictures")]
    pub story: Option<PathBuf>,
    /// Storyboard: key frames in one picture; of a grasp list: some of its grasps
    #[arg(long, value_name = "FILE.png", group = "pictures")]
    pub png: Option<PathBuf>,
    /// Charts: gait, margin, clearance, joints, forces, orientation, each as a file in this folder
    #[arg(long, value_name = "DIR", group = "pictures")]
    pub svg: Option<PathBuf>,
    /// Key frames of the storyboard, or grasps
    #[arg(long, value_name = "N", default_value_t = 6, requires = "png")]
    pub frames: usize,
    /// Width of the storyboard, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1500, requires = "png")]
    pub width: usize,
    /// Key frames in a row of the storyboard [default: by their number]
    #[arg(long, value_name = "N", requires = "png")]
    pub columns: Option<usize>,
    /// Draw collision shapes in the storyboard, also of links with visual meshes
    #[arg(long, requires = "png")]
    pub collision: bool,
    /// Title of the page [default: the scene's name]
    #[arg(long)]
    pub title: Option<String>,
    /// Show the graph of this roadmap file too
    #[arg(long, value_name = "FILE.roadmap")]
    pub with_roadmap: Option<PathBuf>,
    /// By what plans are judged.
    #[command(flatten)]
    pub judging: Judging,
}

/// `regrasp export`
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("formats").required(true).multiple(true)))]
pub struct Export {
    /// Plan file, or grasp list
    pub plan: PathBuf,
    /// Arrays for numpy, without pickle
    #[arg(long, value_name = "FILE.npz", group = "formats")]
    pub npz: Option<PathBuf>,
    /// ROS 2 trajectory_msgs/JointTrajectory
    #[arg(long, value_name = "FILE.yaml", group = "formats")]
    pub ros2: Option<PathBuf>,
    /// MuJoCo model of the scene, with a keyframe for every waypoint
    #[arg(long, value_name = "FILE.xml", group = "formats")]
    pub mjcf: Option<PathBuf>,
    /// Grasp list as an Isaac grasp file
    #[arg(long, value_name = "FILE.yaml", group = "formats")]
    pub isaac: Option<PathBuf>,
    /// Grasp list as moveit_msgs/Grasp messages
    #[arg(long, value_name = "FILE.yaml", group = "formats")]
    pub moveit: Option<PathBuf>,
    /// Scene file [default: the one that the plan names, beside the plan or in the current folder]
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Write the plan even if the checker rejects it
    #[arg(long)]
    pub no_check: bool,
    /// By what plans are judged.
    #[command(flatten)]
    pub judging: Judging,
}

/// `regrasp simulate`
#[derive(Debug, Args)]
pub struct Simulate {
    /// Plan file
    pub plan: PathBuf,
}

/// `regrasp bench`
#[derive(Debug, Args)]
pub struct Bench {
    /// Scene files, or folders of them; or one suite file; with --page CSV files, facts about graphs, and suite files
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// Seeds per scene: 0, 1, ... [default: 20]; of a suite, the most trials per row
    #[arg(long, value_parser = count, allow_negative_numbers = true)]
    pub seeds: Option<u64>,
    /// First seed
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_negative_numbers = true)]
    pub first_seed: u64,
    /// Threads of one search
    #[arg(long, default_value = "1", value_parser = threads, allow_negative_numbers = true)]
    pub threads: usize,
    /// Seeds planned at the same time; more than the idle cores make times incomparable
    #[arg(long, default_value = "1", value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub at_once: usize,
    /// How to search.
    #[command(flatten)]
    pub search: Search,
    /// Write one row per scene and seed
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Folder for the results of a suite [default: the one that the suite names]
    #[arg(long, value_name = "DIR")]
    pub results: Option<PathBuf>,
    /// Do not judge the plans
    #[arg(long)]
    pub no_check: bool,
    /// Tasks of pick and place: build a roadmap of each scene first, and plan with it
    #[arg(long, conflicts_with_all = ["page", "results"])]
    pub prepare: bool,
    /// Plan a chain of N random goals per seed, each within 90 degrees of the last and from the grasp in which the last plan ended
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true, conflicts_with_all = ["page", "results", "hold"])]
    pub chain: Option<u64>,
    /// Make a Markdown page of CSV files that were written before; plans nothing
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
    /// For --page: time in seconds within which each scene should be solved
    #[arg(long, value_name = "FILE.json", requires = "page")]
    pub limits: Option<PathBuf>,
    /// By what plans are judged.
    #[command(flatten)]
    pub judging: Judging,
}

/// `regrasp growth`
#[derive(Debug, Args)]
pub struct Growth {
    /// Curves [default: all]
    #[arg(value_name = "CURVE", value_parser = PossibleValuesParser::new(Curve::ALL.map(Curve::name)))]
    pub curves: Vec<String>,
    /// Folder for the scenes, which are kept; the largest mesh has 50 MB
    #[arg(short, long, value_name = "DIR", default_value = "regrasp-growth")]
    pub output: PathBuf,
    /// Folder for CSV file and picture of each curve [default: that of the scenes]
    #[arg(long, value_name = "DIR")]
    pub results: Option<PathBuf>,
    /// Seeds per scene: 0, 1, ...; a batch over threads has ten times as many queries
    #[arg(long, default_value_t = 20, value_parser = trials, allow_negative_numbers = true)]
    pub trials: u64,
    /// Only sizes up to this one
    #[arg(long, value_name = "SIZE", value_parser = whole_number, allow_negative_numbers = true)]
    pub up_to: Option<u64>,
    /// Time limit per trial, in seconds
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds, allow_negative_numbers = true)]
    pub time_limit: Duration,
    /// Work limit per trial, in configurations looked at
    #[arg(long, value_name = "N", default_value_t = 20_000_000, value_parser = whole_number, allow_negative_numbers = true)]
    pub max_work: u64,
}

/// `regrasp campaign`
#[derive(Debug, Args)]
pub struct Campaign {
    /// Which.
    #[command(subcommand)]
    pub kind: CampaignKind,
}

/// Campaigns.
#[derive(Debug, Subcommand)]
pub enum CampaignKind {
    /// The same bytes on any number of threads
    Determinism {
        /// Scene files
        #[arg(required = true)]
        scenes: Vec<PathBuf>,
        /// Queries in all, spread over the scenes
        #[arg(long, default_value_t = 100, value_parser = count, allow_negative_numbers = true)]
        queries: u64,
        /// Numbers of threads to compare
        #[arg(long, value_delimiter = ',', default_value = "1,2,8", value_parser = threads, allow_negative_numbers = true)]
        threads: Vec<usize>,
        /// How to search.
        #[command(flatten)]
        search: Search,
    },
    /// Broken plans must be rejected, good ones accepted
    Mutations {
        /// Scene files
        #[arg(required = true)]
        scenes: Vec<PathBuf>,
        /// Broken plans per kind
        #[arg(long, default_value_t = 100, value_parser = count, allow_negative_numbers = true)]
        mutants: u64,
        /// Good plans
        #[arg(long, default_value_t = 1000, value_parser = count, allow_negative_numbers = true)]
        good: u64,
        /// How to search.
        #[command(flatten)]
        search: Search,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn methods_are_those_of_the_planner() {
        for name in METHODS {
            let value = serde_json::Value::from(name);
            let is_in_hand = serde_json::from_value::<regrasp::Method>(value.clone()).is_ok();
            let is_tracking = serde_json::from_value::<regrasp::TrackingMethod>(value).is_ok();
            assert!(is_in_hand != is_tracking, "{name}");
        }
    }

    #[test]
    fn negative_numbers_are_values_that_are_refused_with_their_reason() {
        for flag in ["--seed", "--threads", "--margin", "--time-limit", "--max-work", "--improve", "--improve-work"] {
            let error = Arguments::try_parse_from(["regrasp", "plan", "scene.toml", flag, "-3"]).unwrap_err();
            assert!(error.to_string().contains("expected a"), "{error}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["0", "-1", "inf", "NaN", "1,5", ""] {
            assert!(seconds(text).is_err(), "{text}");
        }
        for text in ["0", "-3", "10000", "two"] {
            assert!(threads(text).is_err(), "{text}");
        }
        for text in ["-1", "1.5", "18446744073709551616", "0x10", ""] {
            assert!(whole_number(text).is_err() && count(text).is_err(), "{text}");
        }
        assert!(count("0").is_err());
        assert_eq!(package("a=."), Ok(("a".into(), ".".into())));
        assert!(package("=b").is_err() && package("a").is_err());
        assert_eq!(package("a=b=c"), Err("b=c is not a folder".into()));
    }
}
