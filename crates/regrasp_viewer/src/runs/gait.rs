//! When every finger was to hold, leg by leg: the plans of the legs on the clock of the run.

use super::{Doing, Run};
use crate::timeline::{self, Stretch};
use regrasp_plan::Plan;

/// Times of the run over times of the plan of leg `index`, in order: what the samples of its motion say. Empty where it did not move.
fn clock(run: &Run, index: usize, plan: &Plan) -> Vec<(f64, f64)> {
    let moving: Vec<(f64, f64)> = run
        .samples
        .iter()
        .filter(|sample| sample.leg == index && sample.state == Doing::Run)
        .map(|sample| (sample.tick as f64, sample.time))
        .collect();
    // Ticks are as long as they are where nothing is waited for.
    let lengths = moving.windows(2).filter(|pair| pair[1].0 > pair[0].0).map(|pair| {
        let [before, after] = [pair[0], pair[1]];
        (after.1 - before.1) / (after.0 - before.0)
    });
    let tick = lengths.filter(|length| *length > 0.0).fold(f64::INFINITY, f64::min);
    if !tick.is_finite() {
        return Vec::new();
    }
    let (first, last) = timeline::span(plan);
    let duration = run.legs[index].duration;
    let speed = if duration > 0.0 { (last - first) / duration } else { 1.0 };
    let mut clock: Vec<(f64, f64)> =
        moving.into_iter().map(|(ticks, time)| (first + ticks * tick * speed, time)).collect();
    clock.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some(&(plan_time, time)) = clock.first() {
        clock.insert(0, (first, time - (plan_time - first) / speed.max(1e-9)));
    }
    clock
}

/// The time of the run at which the plan is at `plan_time`; the last one where it did not come so far.
fn at(clock: &[(f64, f64)], plan_time: f64) -> f64 {
    let after = clock.partition_point(|entry| entry.0 < plan_time);
    match (after.checked_sub(1).map(|before| clock[before]), clock.get(after)) {
        (Some((from, begin)), Some(&(until, end))) if until > from => {
            begin + (end - begin) * (plan_time - from) / (until - from)
        }
        (_, Some(&(_, time))) | (Some((_, time)), None) => time,
        (None, None) => 0.0,
    }
}

/// What `finger` was to do in leg `index`, at times of the run, as far as the leg came.
pub(super) fn stretches(run: &Run, index: usize, plan: &Plan, finger: usize) -> Vec<Stretch> {
    let clock = clock(run, index, plan);
    if clock.is_empty() {
        return Vec::new();
    }
    let planned = timeline::stretches(plan, finger).into_iter();
    let real =
        planned.map(|stretch| Stretch { from: at(&clock, stretch.from), until: at(&clock, stretch.until), ..stretch });
    real.filter(|stretch| stretch.until > stretch.from).collect()
}
