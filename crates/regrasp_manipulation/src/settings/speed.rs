//! Settings of times.

use serde::{Deserialize, Serialize};

/// How fast plans are carried out. Plans are quasi-static: forces balance the weight, not accelerations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SpeedSettings {
    /// Largest speed of fingertips and of the object's surface, in metres per second. Origin: replays in simulation at
    /// 0.04 and 0.1 (docs/reference/replay.md).
    pub largest_speed: f64,
    /// Largest velocity of joints whose robot file states none, in radians or metres per second. What small servos
    /// reach.
    pub joint_velocity: f64,
    /// Largest acceleration of joints, in radians or metres per second squared, as robot files state none. It reaches
    /// the velocity above in a tenth of a second.
    pub joint_acceleration: f64,
    /// Time in which contact forces change between two segments, in seconds. Origin: replays of 41 plans of seven scenes, which
    /// end as near with it as with 0.25 (docs/reference/replay.md).
    pub ramp: f64,
}

impl Default for SpeedSettings {
    fn default() -> Self {
        SpeedSettings { largest_speed: 0.1, joint_velocity: 2.0, joint_acceleration: 20.0, ramp: 0.06 }
    }
}

impl SpeedSettings {
    /// What is wrong with the settings, if anything.
    pub fn validate(&self) -> Result<(), String> {
        let SpeedSettings { largest_speed, joint_velocity, joint_acceleration, ramp } = *self;
        let positive = [
            ("largest_speed", largest_speed),
            ("joint_velocity", joint_velocity),
            ("joint_acceleration", joint_acceleration),
        ];
        match positive.iter().find(|(_, value)| !(*value >= LEAST_SPEED && *value <= MAX_SPEED)) {
            Some((name, value)) => {
                Err(format!("speed.{name} is {value}; it must be between {LEAST_SPEED} and {MAX_SPEED}"))
            }
            None if !(0.0..=60.0).contains(&ramp) => {
                Err(format!("speed.ramp is {ramp}; it must be between 0 and 60 seconds"))
            }
            None => Ok(()),
        }
    }
}

/// Slowest and fastest that a plan may be carried out: times stay numbers that make sense.
const LEAST_SPEED: f64 = 1e-6;

/// See there.
const MAX_SPEED: f64 = 1e6;
