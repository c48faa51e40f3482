//! By what plans are judged: level and gravity.

use crate::stop::Stop;
use clap::Args;
use clap::builder::PossibleValuesParser;
use regrasp::Query;
use regrasp::geometry::Pose;
use regrasp::plan::check::{CheckSettings, Level, OwnQuery};
use regrasp::scene::{Gravity, LoadedScene};
use std::time::{Duration, Instant};

/// A plan that was found in time is not lost for a check that takes a little longer.
const LEAST_CHECK_TIME: Duration = Duration::from_secs(30);

/// By what plans are judged, and gravity that they are planned under.
#[derive(Debug, Clone, Default, Args)]
pub struct Judging {
    /// What the checker judges: geometry (poses only), forces (also contact forces), motion (also slip, speeds and
    /// accelerations) [default: motion]
    #[arg(long, value_name = "LEVEL", value_parser = PossibleValuesParser::new(Level::ALL.map(Level::name)))]
    pub level: Option<String>,
    /// Gravity instead of the scene's: a direction X,Y,Z in the frame of the hand's base link, or any
    #[arg(long, value_name = "X,Y,Z", value_parser = gravity, allow_hyphen_values = true)]
    pub gravity: Option<GravityInHand>,
    /// Ask only whether the object can be held at the start: one grasp with its forces and its margin. Way and goal of the
    /// scene do not count
    #[arg(long)]
    pub hold: bool,
    /// Judge a plan of a session against the start and the goal that the plan itself says it was asked. Such a plan is rejected
    /// otherwise
    #[arg(long)]
    pub own_query: bool,
    /// Where judging ends, by the flags of the command.
    #[arg(skip)]
    pub limits: JudgingLimits,
}

/// How long the checker may judge. A plan that is not judged whole is rejected.
#[derive(Debug, Clone, Copy, Default)]
pub struct JudgingLimits {
    /// Configurations, samples and distances; the checker's own limit without it.
    pub max_work: Option<u64>,
    /// When to end.
    pub deadline: Option<Instant>,
}

impl Judging {
    /// The same within `limits`.
    pub fn within(&self, limits: JudgingLimits) -> Self {
        Judging { limits, ..self.clone() }
    }

    /// The same for a plan that was just found: judging may take as long as the search was allowed to, and [`LEAST_CHECK_TIME`] at least.
    pub fn after_search(&self, time_limit: Option<Duration>) -> Self {
        let check_time = time_limit.map(|limit| limit.max(LEAST_CHECK_TIME));
        let deadline = check_time.and_then(|time| Instant::now().checked_add(time));
        self.within(JudgingLimits { deadline, ..JudgingLimits::default() })
    }

    /// What plans are judged for.
    pub fn level(&self) -> Level {
        self.level.as_deref().and_then(Level::named).unwrap_or_default()
    }

    /// By what the checker judges.
    pub fn settings(&self) -> CheckSettings {
        let own_query = if self.own_query { OwnQuery::Allowed } else { OwnQuery::Refused };
        let usual = CheckSettings::default();
        let most_work = self.limits.max_work.unwrap_or(usual.most_work);
        CheckSettings { level: self.level(), own_query, most_work, deadline: self.limits.deadline, ..usual }
    }

    /// What is asked: `query`, or with `--hold` whether its object can be held at the start. Errors: `--hold` for tracking (`A507`).
    pub fn query(&self, query: Query) -> Result<Query, Stop> {
        if !self.hold {
            return Ok(query);
        }
        query.held().ok_or_else(|| {
            let problem = "is for tasks of kind \"in_hand\" only: others start with a given grasp, or hold nothing";
            Stop::argument("A507", "--hold", problem, "a task of kind \"in_hand\"")
        })
    }

    /// A scene under the gravity asked for, else under its own.
    pub fn scene(&self, loaded: LoadedScene) -> LoadedScene {
        let Some(asked) = self.gravity else { return loaded };
        let gravity = match asked {
            GravityInHand::Any => Some(Gravity::Any),
            GravityInHand::Direction(down) => {
                // A task of a whole robot has no hand to see gravity from: the direction is the world's.
                let is_of_robot = loaded.task().of_robot.is_some();
                let frame = if is_of_robot { Pose::identity() } else { loaded.manipulation().world_from_hand() };
                Gravity::along(&frame, &down.into())
            }
        };
        // The zero vector is refused where the argument is read.
        LoadedScene { scene: loaded.scene.under_gravity(gravity.unwrap_or_default()), ..loaded }
    }
}

/// Gravity as seen from the hand's base link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GravityInHand {
    /// Along this direction, of any length.
    Direction([f64; 3]),
    /// Any direction.
    Any,
}

fn gravity(text: &str) -> Result<GravityInHand, String> {
    if text == "any" {
        return Ok(GravityInHand::Any);
    }
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|c| c.is_finite()) && [x, y, z].iter().any(|c| *c != 0.0) => {
            Ok(GravityInHand::Direction([x, y, z]))
        }
        _ => Err("expected a direction such as 0,0,-1 in the frame of the hand's base link, or any".into()),
    }
}
