//! `[limits]`: what a plan may ask of hand and object.

use crate::limits::Limits;
use regrasp_base::toml_table::{Found, Table};

/// Largest speed of a fingertip that makes sense, in metres per second.
const MAX_SPEED: f64 = 10.0;
/// Largest velocity of a joint, in radians or metres per second.
const MAX_JOINT_VELOCITY: f64 = 100.0;
/// Largest acceleration of a joint, in radians or metres per second squared.
const MAX_JOINT_ACCELERATION: f64 = 1e4;
/// Largest force of a fingertip, in newtons.
const MAX_NORMAL_FORCE: f64 = 1e4;
/// Largest friction margin.
const MAX_FRICTION_MARGIN: f64 = 100.0;

/// The limits stated, the others by default.
///
/// Errors: not a table or not numbers (`S103`), out of range (`S107`), an unknown key (`S101`).
pub(super) fn limits(root: &mut Table, found: &mut Found) -> Limits {
    let mut limits = Limits::default();
    let Some(mut table) = root.optional("limits").and_then(|entry| entry.table(found)) else { return limits };
    let mut read = |key: &'static str, least: f64, most: f64| {
        let expected = format!("a number from {least} to {most}");
        table.optional(key)?.number_that(found, &expected, |x| (least..=most).contains(&x))
    };
    let known = [
        ("largest_speed", MAX_SPEED, &mut limits.largest_speed),
        ("joint_velocity", MAX_JOINT_VELOCITY, &mut limits.joint_velocity),
        ("joint_acceleration", MAX_JOINT_ACCELERATION, &mut limits.joint_acceleration),
        ("normal_force", MAX_NORMAL_FORCE, &mut limits.normal_force),
    ];
    for (key, most, limit) in known {
        *limit = read(key, 1e-3, most).unwrap_or(*limit);
    }
    limits.friction_margin = read("friction_margin", 1.0, MAX_FRICTION_MARGIN);
    table.finish(found);
    limits
}
