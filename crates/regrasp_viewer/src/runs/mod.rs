//! Runs of the executor: what `regrasp.execute` writes as `run.json`, read and drawn. `docs/reference/run-format.md` describes the file.

/// Charts over the time of a run.
mod chart;
/// The file as bytes.
pub mod format;
/// When every finger was to hold, leg by leg.
mod gait;
/// One HTML file.
mod page;
/// What a run may not say.
mod validate;

pub use page::html;

use serde::{Deserialize, Serialize};

/// Value of [`Run::format`].
pub const FORMAT: &str = "regrasp-run";
/// Value of [`Run::format_version`].
pub const FORMAT_VERSION: u32 = 1;

/// What happened in a run. Metres, radians, seconds, newtons; times are of the plant's clock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// [`FORMAT`].
    pub format: String,
    /// [`FORMAT_VERSION`].
    pub format_version: u32,
    /// Name of the scene.
    pub scene: String,
    /// How it ended.
    pub status: RunStatus,
    /// Why it ended, where it is not done.
    pub message: String,
    /// Settings of the executor.
    pub settings: serde_json::Map<String, serde_json::Value>,
    /// Moments, in the order of time.
    pub samples: Vec<Sample>,
    /// What was not planned, and what was done about it.
    pub events: Vec<Event>,
    /// Plans that were executed.
    pub legs: Vec<Leg>,
    /// What became of each goal.
    pub goals: Vec<Goal>,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunStatus {
    /// It has not.
    Running,
    /// All goals were tried.
    Done,
    /// Nothing helped, and the object is held.
    GaveUp,
    /// No finger touches the object.
    Lost,
    /// The caller asked to stop.
    Interrupted,
}

/// What the hand did at a moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Doing {
    /// The plan of the leg.
    Run,
    /// It passed from the commands of one leg to those of the next.
    Blend,
    /// It held.
    Hold,
    /// It held at the end of a leg until the object was where it should be.
    Settle,
}

/// What was done about an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// The hand held.
    Hold,
    /// The hand held until the object had come back, and the leg went on.
    Resume,
    /// The hand went back on the leg to before a finger had lifted.
    Back,
    /// A new plan was made.
    Replan,
    /// The fingers pressed harder for a moment.
    Grip,
    /// The observation was left out.
    Ignore,
    /// The run ended with the hand holding.
    GiveUp,
    /// Nothing.
    None,
}

/// One moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// When.
    pub time: f64,
    /// Index of the leg.
    pub leg: usize,
    /// Control tick of the leg.
    pub tick: u64,
    /// What the hand did.
    pub state: Doing,
    /// Of the estimated object from where the leg has it.
    pub distance: f64,
    /// The same in orientation.
    pub angle: f64,
    /// Of the real object, where the plant knows it.
    pub true_distance: Option<f64>,
    /// The same in orientation.
    pub true_angle: Option<f64>,
    /// Of the fingertip that slipped farthest.
    pub slip: f64,
    /// Normal force felt at every fingertip.
    pub forces: Option<Vec<f64>>,
    /// Of the joint that is farthest from its target.
    pub joint_error: f64,
}

/// Something that was not planned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    /// When.
    pub time: f64,
    /// What it was.
    pub kind: String,
    /// The same in words.
    pub message: String,
    /// What was done about it.
    pub answer: Answer,
    /// Index of the goal; the number of goals for an event after the last.
    pub goal: usize,
    /// Index of the leg; -1 before the first.
    pub leg: i64,
}

/// A plan that was executed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leg {
    /// When it began.
    pub start_time: f64,
    /// Index of its goal.
    pub goal: usize,
    /// Seed of its search.
    pub seed: u64,
    /// Time of its motion.
    pub duration: f64,
    /// Time of the search, on the machine that planned.
    pub search_seconds: f64,
    /// Time of the check.
    pub check_seconds: f64,
    /// What was neither.
    pub overhead_seconds: f64,
    /// How far its start is from what was observed.
    pub moved: Moved,
    /// True where it was planned while the leg before ran.
    pub prepared: bool,
    /// Names of the fingers that were free at its start.
    pub free: Vec<String>,
}

/// How far a start is from what was observed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moved {
    /// Of the object.
    pub object: f64,
    /// The same in orientation.
    pub object_turn: f64,
    /// Of the fingertip that moved farthest.
    pub tip: f64,
    /// Of the joint that moved farthest.
    pub joint: f64,
}

/// What became of a goal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Where the object was to be, in the world.
    pub position: [f64; 3],
    /// And how turned.
    pub quat_xyzw: [f64; 4],
    /// True where it was, by the estimate.
    pub reached: bool,
    /// When the executor turned to it.
    pub start_time: f64,
    /// When it turned to the next.
    pub time: f64,
    /// Number of legs.
    pub legs: u64,
    /// Time in which the hand moved.
    pub motion_time: f64,
    /// Angle from the goal before.
    pub turn: f64,
    /// Of the estimated object from the goal at the end.
    pub distance: f64,
    /// The same in orientation.
    pub angle: f64,
    /// Of the real object, where the plant knows it.
    pub true_distance: Option<f64>,
    /// The same in orientation.
    pub true_angle: Option<f64>,
    /// Why it was not reached; empty where it was.
    pub why_not: String,
}

impl Run {
    /// Goals that were reached.
    pub fn n_reached(&self) -> usize {
        self.goals.iter().filter(|goal| goal.reached).count()
    }

    /// Legs beyond one per goal.
    pub fn n_replans(&self) -> u64 {
        self.goals.iter().fold(0, |sum, goal| sum.saturating_add(goal.legs.saturating_sub(1)))
    }

    /// First and last time of anything in it.
    fn span(&self) -> (f64, f64) {
        let of_samples = self.samples.iter().map(|sample| sample.time);
        let times = of_samples.chain(self.events.iter().map(|event| event.time));
        let times = times.chain(self.goals.iter().flat_map(|goal| [goal.start_time, goal.time]));
        let span = times.fold(None, |span: Option<(f64, f64)>, time| match span {
            None => Some((time, time)),
            Some((first, last)) => Some((first.min(time), last.max(time))),
        });
        span.unwrap_or((0.0, 1.0))
    }
}

impl RunStatus {
    /// In words.
    fn words(self) -> &'static str {
        match self {
            RunStatus::Running => "still running",
            RunStatus::Done => "done",
            RunStatus::GaveUp => "gave up",
            RunStatus::Lost => "lost the object",
            RunStatus::Interrupted => "interrupted",
        }
    }
}

impl Answer {
    /// In words.
    fn words(self) -> &'static str {
        match self {
            Answer::Hold => "hold",
            Answer::Resume => "hold, then go on",
            Answer::Back => "go back",
            Answer::Replan => "replan",
            Answer::Grip => "press harder",
            Answer::Ignore => "ignore",
            Answer::GiveUp => "give up",
            Answer::None => "none",
        }
    }

    /// Colour of its events.
    fn color(self) -> &'static str {
        match self {
            Answer::Replan => "#d55e00",
            Answer::Hold | Answer::Back => "#e69f00",
            Answer::GiveUp => "#c1121f",
            Answer::Resume | Answer::Grip | Answer::Ignore | Answer::None => "#888888",
        }
    }
}
