//! Settings of motions of whole robots.

use serde::{Deserialize, Serialize};

/// How a motion of a whole robot is searched for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionMethod {
    /// The parts of the robot move in turn where that leads to the goal, else all of them at once.
    #[default]
    InTurn,
    /// One search over all joints at once (RRT-Connect).
    SingleQuery,
}

/// Which parts of a robot may move at the same time: arms, and the torso that carries them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PartsMove {
    /// All, where nothing forbids it.
    #[default]
    AtOnce,
    /// One after the other. All others rest meanwhile.
    InTurn,
}

/// How motions are tested for collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Validation {
    /// Every moment, by bounds of how far each body moves. What is not decided counts as collision.
    #[default]
    Certified,
    /// Configurations at the step `1 / resolution`, with the balls that cover the robot. For comparisons.
    Sampled,
}

/// Settings of motions of whole robots.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotionSettings {
    /// The method.
    pub method: MotionMethod,
    /// Which parts may move at the same time.
    pub parts: PartsMove,
    /// How the plan's motions are tested.
    pub validation: Validation,
    /// Configurations per radian or metre that the search looks at.
    pub resolution: f64,
    /// Distance that bodies keep, in metres.
    pub clearance: f64,
    /// Distance that the search keeps besides, in metres, so that its motions can be certified.
    pub search_margin: f64,
    /// Shortcuts that are tried.
    pub shortcuts: usize,
    /// Corners are rounded by at most this much of the lines before and behind them, in radians or metres; 0: the joints stop there.
    pub largest_rounding: f64,
    /// Most samples of one search.
    pub max_samples: u64,
}

impl Default for MotionSettings {
    fn default() -> Self {
        MotionSettings {
            method: MotionMethod::default(),
            parts: PartsMove::default(),
            validation: Validation::default(),
            resolution: 32.0,
            clearance: 5e-4,
            search_margin: 2e-3,
            shortcuts: 100,
            largest_rounding: 0.5,
            max_samples: 1_000_000,
        }
    }
}

impl MotionSettings {
    /// Err with what is wrong.
    pub fn validate(&self) -> Result<(), String> {
        let between = |name: &str, value: f64, low: f64, high: f64| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(format!("{name} is {value}; it must be from {low} to {high}")),
        };
        between("resolution", self.resolution, 1.0, 10_000.0)?;
        between("clearance", self.clearance, 0.0, 0.1)?;
        between("search_margin", self.search_margin, 0.0, 0.1)?;
        between("largest_rounding", self.largest_rounding, 0.0, 10.0)?;
        if self.parts == PartsMove::InTurn && self.method == MotionMethod::SingleQuery {
            return Err("parts is in_turn; the method single_query moves all of them at once".into());
        }
        if self.shortcuts > 100_000 {
            return Err(format!("shortcuts is {}; at most 100000", self.shortcuts));
        }
        Ok(())
    }
}
