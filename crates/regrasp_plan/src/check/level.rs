//! How much a verdict covers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a plan is judged for. A higher level asks for all that the lower ones ask for.
///
/// What a plan has is judged at every level: wrong forces are wrong in a plan that is judged for its geometry only. The levels
/// say what a plan may leave out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Hash, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Poses alone: no collision, fingertips on their contacts, force closure. Fixed contacts may stay where they are on the
    /// object while a round fingertip turns over them, and a plan may have no forces.
    Geometry,
    /// Geometry, and contact forces that hold the object with the friction margin that the scene asks for.
    Forces,
    /// Forces, and a motion that moves the object: no fingertip slips, and joints and object keep to the limits of the scene at
    /// every moment. The default.
    #[default]
    Motion,
}

impl Level {
    /// All levels, the lowest first.
    pub const ALL: [Level; 3] = [Level::Geometry, Level::Forces, Level::Motion];

    /// As command lines and reports spell it.
    pub fn name(self) -> &'static str {
        match self {
            Level::Geometry => "geometry",
            Level::Forces => "forces",
            Level::Motion => "motion",
        }
    }

    /// The level of this name.
    pub fn named(name: &str) -> Option<Self> {
        Level::ALL.into_iter().find(|level| level.name() == name)
    }
}
