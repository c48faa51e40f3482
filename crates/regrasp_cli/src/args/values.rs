//! Values of arguments, read and bounded.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// Most threads that may be asked for.
const MAX_THREADS: i64 = 1024;

/// Most trials that may be asked of a point of a growth curve; plans of a batch are kept until all are there.
const MAX_TRIALS: u64 = 100_000;

/// A package and its folder.
pub(super) fn package(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, folder)) if !name.is_empty() && !folder.is_empty() => match Path::new(folder).is_dir() {
            true => Ok((name.to_owned(), PathBuf::from(folder))),
            false => Err(format!("{folder} is not a folder")),
        },
        _ => Err("expected NAME=DIR, such as allegro=/models/allegro".into()),
    }
}

/// A whole number.
pub(super) fn whole_number(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("expected a whole number from 0 to {}", u64::MAX))
}

/// A whole number above zero.
pub(super) fn count(text: &str) -> Result<u64, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "expected a whole number above 0".to_owned())
}

/// A number of trials.
pub(super) fn trials(text: &str) -> Result<u64, String> {
    match text.parse() {
        Ok(n) if (1..=MAX_TRIALS).contains(&n) => Ok(n),
        _ => Err(format!("expected a number of trials between 1 and {MAX_TRIALS}")),
    }
}

/// A time above zero.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number of seconds".to_owned())?;
    if !(value > 0.0 && value <= 1e7) {
        return Err(format!("is {value}; expected a number of seconds between 0 (exclusive) and 1e7"));
    }
    Ok(Duration::from_secs_f64(value))
}

/// A closure margin.
pub(super) fn margin(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.0..1.0).contains(&value) => Ok(value),
        _ => Err("expected a number in [0, 1)".into()),
    }
}

/// A number that is not negative.
pub(super) fn number_from_zero(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if value >= 0.0 && f64::is_finite(value) => Ok(value),
        _ => Err("expected a number from 0".into()),
    }
}

/// A length up to a metre.
pub(super) fn metres(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err("expected a number of metres from 0 to 1".into()),
    }
}

/// An angle up to half a turn.
pub(super) fn degrees(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if value > 0.0 && value <= 180.0 => Ok(value),
        _ => Err("expected a number of degrees above 0 and at most 180".into()),
    }
}

/// A number of threads.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    match text.parse::<i64>() {
        Ok(n) if (1..=MAX_THREADS).contains(&n) => Ok(n as usize),
        _ => Err(format!("expected a number of threads between 1 and {MAX_THREADS}")),
    }
}

/// Three numbers in metres, with commas between.
pub fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match numbers.as_slice() {
        [x, y, z] if text.split(',').count() == 3 && numbers.iter().all(|x| x.is_finite()) => Ok([*x, *y, *z]),
        _ => Err("three numbers in metres, with commas between".into()),
    }
}
