//! Attempts, one after the other or several at once: the lowest that succeeds makes the plan, whatever the threads.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::attempt::tally::Tally;
use rayon::prelude::*;
use regrasp_base::Interrupt;
use regrasp_geometry::{Pose, frame};
use regrasp_manipulation::failure::{Failure, FailureKind, NearestMiss};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::outline::Outline;
use regrasp_plan::plan::{PoseData, Statistics};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Advice where no search found a grasp.
pub const MOVE_THE_START: &str = "move the start pose to where the fingers reach around the object";

/// What an attempt left behind, whether it succeeded or not.
#[derive(Debug, Default, Clone)]
pub struct Left {
    /// Why its attempts failed.
    pub tally: Tally,
    /// Units of work.
    pub work: u64,
    /// Nodes.
    pub n_nodes: u64,
    /// Samples.
    pub n_samples: u64,
    /// Index of the farthest leg begun.
    pub leg: usize,
    /// The state nearest to the goal of that leg, with its distance.
    pub nearest: Option<(f64, regrasp_manipulation::grasp::state::GraspState)>,
    /// What was reached on that leg.
    pub reached: Option<Box<Outline>>,
    /// True when a wall-clock limit cut something that a plan was found without.
    pub cut_by_time: bool,
}

impl Left {
    /// What `search` leaves.
    pub fn of(search: &Search) -> Self {
        Left {
            tally: search.whole_tally(),
            work: search.workspace.work,
            n_nodes: search.n_nodes,
            n_samples: search.n_samples,
            leg: search.leg,
            nearest: search.nearest.clone(),
            reached: search.reached.clone(),
            cut_by_time: search.cut_by_time,
        }
    }

    /// Counts for the plan file.
    pub fn statistics(&self, n_restarts: usize) -> Statistics {
        Statistics {
            nodes: self.n_nodes,
            samples: self.n_samples,
            work: self.work,
            restarts: n_restarts as u64,
            cut_by_time: self.cut_by_time,
            failures: self.tally.counts(),
            ..Statistics::default()
        }
    }

    /// The failure that all attempts together are; `poses` are those of the query, from start to goal.
    pub fn failure(self, model: &Model, poses: &[Pose], interrupt: Interrupt, n_attempts: usize) -> Failure {
        let limit = match interrupt {
            Interrupt::WorkSpent => "within the work allowed",
            Interrupt::Deadline => "within the time limit",
            Interrupt::Cancelled => "until interrupted",
        };
        let n_legs = poses.len() - 1;
        let goal = &poses[self.leg + 1];
        let nearest_miss = self.nearest.as_ref().map(|(_, state)| NearestMiss {
            world_from_object: PoseData::from(&state.world_from_object),
            angle_left: frame::rotation_between(&state.world_from_object, goal).norm(),
            distance_left: (state.world_from_object.translation.vector - goal.translation.vector).norm(),
            joints: state.joints.iter().flatten().copied().collect(),
        });
        let nearest_miss = nearest_miss.map(Box::new);
        let end = if self.leg + 1 == n_legs { "the goal".to_owned() } else { format!("way pose {}", self.leg + 1) };
        let no_grasp = match interrupt {
            Interrupt::WorkSpent => "no grasp was found at the start pose",
            Interrupt::Deadline | Interrupt::Cancelled => "no grasp was found at the start pose before that",
        };
        let reached = nearest_miss
            .as_ref()
            .map_or(no_grasp.to_owned(), |miss| format!("the object came {} of {end}", within(miss)));
        let bound = self.tally.bound_fingers(model).map_or(String::new(), |bound| format!("; {bound}"));
        let in_the_way = self.tally.tried.in_words(model);
        let leg = (n_legs > 1).then_some(self.leg + 1);
        let where_stuck = leg.map_or(String::new(), |leg| format!("leg {leg} of {n_legs} failed: "));
        let causes = self.tally.causes(model);
        let more = allow_more(interrupt.into());
        let advice = match (self.tally.weak_joints(model), causes.first()) {
            (Some(weak), _) => format!("lower the mass of the object, or use stronger motors: {weak}"),
            _ if in_the_way.is_some() => self.tally.tried.advice(model).into(),
            (None, Some(cause)) if nearest_miss.is_none() => {
                format!("{MOVE_THE_START} (mostly: {})", cause.reason)
            }
            (None, Some(cause)) => format!("{more}, or ease what stops it most: {}", cause.reason),
            (None, None) => more.into(),
        };
        Failure {
            kind: interrupt.into(),
            message: format!(
                "no plan {limit} (not a proof), searching from scratch {}: {where_stuck}{reached}{bound}{}",
                times(n_attempts),
                in_the_way.as_ref().map_or(String::new(), |told| format!("; {told}"))
            ),
            advice,
            causes,
            leg,
            nearest_miss,
            robot_miss: None,
            reached: self.reached.clone(),
            statistics: Statistics {
                cut_by_time: interrupt != Interrupt::WorkSpent,
                ..self.statistics(n_attempts.saturating_sub(1))
            },
        }
    }

    fn add(&mut self, other: Left) {
        self.tally.merge(&other.tally);
        self.work += other.work;
        self.n_nodes += other.n_nodes;
        self.n_samples += other.n_samples;
        self.cut_by_time |= other.cut_by_time;
        let n_reached = |left: &Left| left.reached.as_ref().map_or(0, |reached| reached.nodes.len());
        if other.leg > self.leg || (other.leg == self.leg && n_reached(&other) > n_reached(self)) {
            self.reached.clone_from(&other.reached);
        }
        if other.leg > self.leg {
            (self.leg, self.nearest) = (other.leg, other.nearest);
        } else if let Some((distance, _)) = &other.nearest
            && other.leg == self.leg
            && self.nearest.as_ref().is_none_or(|(least, _)| distance < least)
        {
            self.nearest = other.nearest;
        }
    }
}

/// How far the object was from where it should go.
pub fn within(miss: &NearestMiss) -> String {
    format!("within {:.1} degrees and {:.1} mm", miss.angle_left.to_degrees(), miss.distance_left * 1e3)
}

/// What helps a search that had too little time, or too little work.
pub fn allow_more(kind: FailureKind) -> &'static str {
    match kind {
        FailureKind::WorkSpent => "allow more work (--max-work, max_work)",
        _ => "allow more time (--time-limit, time_limit)",
    }
}

/// What helps a search whose own work was too little (`search_work`), with more allowed.
pub const ALLOW_MORE_SEARCH: &str = "allow the search more work (the setting search_work)";

fn times(n: usize) -> String {
    match n {
        0 => "not even once".into(),
        1 => "once".into(),
        n => format!("{n} times"),
    }
}

/// Work that attempt `index` may do: `base`, growing so that hard queries get long attempts too.
pub fn work_of_attempt(base: u64, index: usize) -> u64 {
    base.saturating_mul(1 + index as u64 / 4)
}

/// Runs attempts until one succeeds or the budget ends.
///
/// `run(index, work_limit, winner)` is one attempt. The result is that of the lowest index that succeeded, with what
/// all attempts up to it left behind and that index; so it is the same on any number of threads. Err: what ended it, what
/// the attempts left behind, and how many were begun.
#[expect(clippy::result_large_err, reason = "success carries what the attempts left behind too, so is no smaller")]
pub fn run_attempts<T: Send>(
    n_threads: usize,
    base_work: u64,
    max_work: u64,
    run: impl Fn(usize, u64, &AtomicUsize) -> (Result<T, Stop>, Left) + Sync,
) -> Result<(T, Left, usize), (Interrupt, Left, usize)> {
    let winner = AtomicUsize::new(usize::MAX);
    let one = |index: usize, limit: u64| {
        let outcome = run(index, limit, &winner);
        if outcome.0.is_ok() {
            winner.fetch_min(index, Ordering::Relaxed);
        }
        outcome
    };
    let mut left = Left::default();
    let (mut index, mut planned) = (0usize, 0u64);
    loop {
        let mut round = Vec::with_capacity(n_threads);
        while round.len() < n_threads.max(1) && planned < max_work {
            let limit = work_of_attempt(base_work, index).min(max_work - planned);
            planned += limit;
            round.push((index, limit));
            index += 1;
        }
        if round.is_empty() {
            return Err((Interrupt::WorkSpent, left, index));
        }
        let outcomes: Vec<_> = if round.len() == 1 {
            round.iter().map(|&(index, limit)| one(index, limit)).collect()
        } else {
            round.par_iter().with_max_len(1).map(|&(index, limit)| one(index, limit)).collect()
        };
        for (&(attempt, _), (result, from_attempt)) in round.iter().zip(outcomes) {
            left.add(from_attempt);
            match result {
                Ok(value) => return Ok((value, left, attempt)),
                Err(Stop::Budget(interrupt)) => return Err((interrupt, left, attempt + 1)),
                Err(Stop::Restart | Stop::Overtaken) => {}
            }
        }
    }
}
