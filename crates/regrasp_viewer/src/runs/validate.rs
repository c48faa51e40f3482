//! What a run may not say.

use super::Run;
use regrasp_base::InputError;
use regrasp_base::diagnostic::Diagnostics;
use regrasp_base::json_place::{PathStep, diagnostic};
use std::path::Path;

/// Most entries of a list: at one sample every 10 ms, eleven hours.
const MOST: usize = 4_000_000;
/// Most fingertips.
const MOST_FINGERS: usize = 64;
/// Largest time of a clock, in seconds: those that count from 1970 are at 1.8e9.
const LARGEST_TIME: f64 = 1e11;
/// The largest of all other numbers: pages can draw them.
const LARGEST: f64 = 1e9;
/// How far the length of a quaternion may be from one.
const QUATERNION_TOLERANCE: f64 = 1e-2;

/// `run`, which stands in `text`, if it makes sense.
pub(super) fn validate(path: &Path, text: &str, run: Run) -> Result<Run, InputError> {
    let mut found = Diagnostics::default();
    let lists = [run.samples.len(), run.events.len(), run.legs.len(), run.goals.len()];
    for (name, length) in ["samples", "events", "legs", "goals"].into_iter().zip(lists) {
        if length > MOST {
            let problem = format!("has {length} entries, more than the limit of {MOST}");
            return Err(diagnostic(path, text, "E808", &[PathStep::Key(name)], problem).into());
        }
    }
    let mut add = |code: &'static str, steps: &[PathStep], problem: &dyn Fn() -> String, expected: &str| {
        if !found.counted_only() {
            found.push(diagnostic(path, text, code, steps, problem()).expected(expected));
        }
    };
    for ((list, index, key, may_be_negative), value) in numbers(&run) {
        let steps = [PathStep::Key(list), PathStep::Index(index), PathStep::Key(key)];
        let largest = if matches!(key, "time" | "start_time") { LARGEST_TIME } else { LARGEST };
        let lowest = if may_be_negative { -largest } else { 0.0 };
        if !(lowest..=largest).contains(&value) {
            add("E804", &steps, &|| format!("is {value}"), &format!("a number from {lowest} to {largest}"));
        }
    }
    for (index, pair) in run.samples.windows(2).enumerate() {
        if pair[1].time < pair[0].time {
            let steps = [PathStep::Key("samples"), PathStep::Index(index + 1), PathStep::Key("time")];
            add(
                "E804",
                &steps,
                &|| format!("is {}, after {}", pair[1].time, pair[0].time),
                "times that do not go back",
            );
        }
    }
    let (n_legs, n_goals) = (run.legs.len(), run.goals.len());
    let n_fingers = run.samples.iter().find_map(|sample| sample.forces.as_ref().map(Vec::len)).unwrap_or(0);
    for (index, sample) in run.samples.iter().enumerate() {
        let steps = |key| [PathStep::Key("samples"), PathStep::Index(index), PathStep::Key(key)];
        if sample.leg >= n_legs {
            add("E805", &steps("leg"), &|| format!("is {}", sample.leg), &format!("the index of one of {n_legs} legs"));
        }
        let n_forces = sample.forces.as_ref().map_or(n_fingers, Vec::len);
        if n_forces != n_fingers || n_forces > MOST_FINGERS {
            let expected = format!("{n_fingers}, at most {MOST_FINGERS}, as in the first sample with forces");
            add("E807", &steps("forces"), &|| format!("has {n_forces} numbers"), &expected);
        }
    }
    for (index, event) in run.events.iter().enumerate() {
        let steps = |key| [PathStep::Key("events"), PathStep::Index(index), PathStep::Key(key)];
        // The last may be one whose goal was not finished.
        if event.goal > n_goals {
            add(
                "E805",
                &steps("goal"),
                &|| format!("is {}", event.goal),
                &format!("at most the number of goals, {n_goals}"),
            );
        }
        let is_leg = event.leg == -1 || usize::try_from(event.leg).is_ok_and(|leg| leg < n_legs);
        if !is_leg {
            add(
                "E805",
                &steps("leg"),
                &|| format!("is {}", event.leg),
                &format!("-1, or the index of one of {n_legs} legs"),
            );
        }
    }
    for (index, leg) in run.legs.iter().enumerate() {
        if leg.goal > n_goals {
            let steps = [PathStep::Key("legs"), PathStep::Index(index), PathStep::Key("goal")];
            add("E805", &steps, &|| format!("is {}", leg.goal), &format!("at most the number of goals, {n_goals}"));
        }
    }
    for (index, goal) in run.goals.iter().enumerate() {
        let length = goal.quat_xyzw.iter().map(|part| part * part).sum::<f64>().sqrt();
        if !((length - 1.0).abs() <= QUATERNION_TOLERANCE) {
            let steps = [PathStep::Key("goals"), PathStep::Index(index), PathStep::Key("quat_xyzw")];
            add("E806", &steps, &|| format!("has length {length:.3}"), "length 1");
        }
    }
    found.into_result(run)
}

/// Where a number stands: list, index, key, and whether it may be negative.
type NumberPlace = (&'static str, usize, &'static str, bool);

/// Every number of a run but those of its settings, with where it stands.
pub(super) fn numbers(run: &Run) -> impl Iterator<Item = (NumberPlace, f64)> {
    let samples = run.samples.iter().enumerate().flat_map(|(index, sample)| {
        let own = [
            (("samples", index, "time", true), Some(sample.time)),
            (("samples", index, "distance", false), Some(sample.distance)),
            (("samples", index, "angle", false), Some(sample.angle)),
            (("samples", index, "true_distance", false), sample.true_distance),
            (("samples", index, "true_angle", false), sample.true_angle),
            (("samples", index, "slip", false), Some(sample.slip)),
            (("samples", index, "joint_error", false), Some(sample.joint_error)),
        ];
        let own = own.into_iter().filter_map(|(place, value)| Some((place, value?)));
        own.chain(sample.forces.iter().flatten().map(move |force| (("samples", index, "forces", true), *force)))
    });
    let events = run.events.iter().enumerate().map(|(index, event)| (("events", index, "time", true), event.time));
    let legs = run.legs.iter().enumerate().flat_map(|(index, leg)| {
        let moved = [leg.moved.object, leg.moved.object_turn, leg.moved.tip, leg.moved.joint];
        let own = [
            (("legs", index, "start_time", true), leg.start_time),
            (("legs", index, "duration", false), leg.duration),
            (("legs", index, "search_seconds", false), leg.search_seconds),
            (("legs", index, "check_seconds", false), leg.check_seconds),
            // The difference of two clocks.
            (("legs", index, "overhead_seconds", true), leg.overhead_seconds),
        ];
        own.into_iter().chain(moved.into_iter().map(move |value| (("legs", index, "moved", false), value)))
    });
    let goals = run.goals.iter().enumerate().flat_map(|(index, goal)| {
        let own = [
            (("goals", index, "start_time", true), Some(goal.start_time)),
            (("goals", index, "time", true), Some(goal.time)),
            (("goals", index, "motion_time", false), Some(goal.motion_time)),
            (("goals", index, "turn", false), Some(goal.turn)),
            (("goals", index, "distance", false), Some(goal.distance)),
            (("goals", index, "angle", false), Some(goal.angle)),
            (("goals", index, "true_distance", false), goal.true_distance),
            (("goals", index, "true_angle", false), goal.true_angle),
        ];
        let own = own.into_iter().filter_map(|(place, value)| Some((place, value?)));
        let pose = goal.position.iter().map(move |value| (("goals", index, "position", true), *value));
        own.chain(pose).chain(goal.quat_xyzw.iter().map(move |value| (("goals", index, "quat_xyzw", true), *value)))
    });
    samples.chain(events).chain(legs).chain(goals)
}
