//! Frames in batches on several threads. Batches are the same whatever the number of threads, and results are taken in the order
//! of the frames.

use crate::found::{Found, Reason};
use crate::prepared::Prepared;
use crate::search::frame::{Miss, try_frame};
use crate::settings::GraspSettings;
use crate::{record, refine, select};
use rayon::prelude::*;
use regrasp_base::{Budget, Interrupt};
use regrasp_grasp::list::{GraspList, GraspStatistics};
use regrasp_manipulation::failure::{Cause, Failure, FailureKind};
use regrasp_manipulation::workspace::Workspace;
use std::collections::BTreeMap;

/// Frames that one workspace looks at, one after the other.
const FRAMES_PER_TASK: u64 = 16;
/// Tasks of a batch.
const TASKS_PER_BATCH: u64 = 32;

/// Frames after which a search for so many grasps is a long one, for each grasp that is kept. By hand.
const FRAMES_PER_GRASP: u64 = 50;

/// What a running search tells its caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Frames looked at.
    pub frames: u64,
    /// Grasps found.
    pub found: u64,
}

/// Counts of a search.
#[derive(Default)]
struct Tally {
    frames_tried: u64,
    work: u64,
    reasons: BTreeMap<Reason, u64>,
    out_of_reach: BTreeMap<usize, u64>,
    margin: f64,
}

/// What one task found.
struct Outcome {
    results: Vec<Result<Found, Miss>>,
    work: u64,
}

/// The threads of a search.
pub fn threads(settings: &GraspSettings) -> Result<rayon::ThreadPool, Failure> {
    rayon::ThreadPoolBuilder::new().num_threads(settings.n_threads.max(1)).build().map_err(|error| {
        Failure::bare(FailureKind::SettingsInvalid, format!("no threads: {error}"), "ask for fewer threads")
    })
}

/// Searches, chooses, refines, on the threads that this is called on.
pub fn run(prepared: &Prepared, budget: &Budget, progress: &(dyn Fn(Progress) + Sync)) -> Result<GraspList, Failure> {
    let settings = prepared.settings;
    let mut tally = Tally::default();
    let (found, mut cut) = search(prepared, budget, progress, &mut tally);
    if found.is_empty() {
        return Err(failure(prepared, &tally, cut));
    }
    let chosen = select::diverse(&found, settings.grasps, prepared.model.frame.torque_scale);
    let finish = |index: &usize| {
        // What is not refined any more is a grasp all the same.
        let is_cut = budget.check_caller().is_err();
        let mut workspace = Workspace::new(prepared.model);
        (refine::finish(prepared, &mut workspace, &found[*index], is_cut), workspace.work, is_cut)
    };
    let finished: Vec<_> = chosen.par_iter().map(finish).collect();
    let mut grasps = Vec::with_capacity(finished.len());
    for (grasp, work, is_cut) in finished {
        tally.work += work;
        if is_cut {
            cut = cut.or(budget.check_caller().err());
        }
        grasps.push(grasp);
    }
    grasps.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.frame.cmp(&b.frame)));
    let statistics = statistics(prepared, &tally, found.len(), cut);
    Ok(record::list(prepared, statistics, &grasps))
}

/// Frames until enough grasps are found, in order.
fn search(
    prepared: &Prepared,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
    tally: &mut Tally,
) -> (Vec<Found>, Option<Interrupt>) {
    let settings = prepared.settings;
    let n_enough = (settings.grasps as f64 * settings.found_per_grasp).ceil() as usize;
    let n_frames = prepared.n_frames();
    let mut found = Vec::new();
    let mut first = 0;
    while first < n_frames {
        if let Err(cut) = budget.check(tally.work) {
            return (found, Some(cut));
        }
        let end = n_frames.min(first + FRAMES_PER_TASK * TASKS_PER_BATCH);
        let tasks: Vec<u64> = (first..end).step_by(FRAMES_PER_TASK as usize).collect();
        let outcomes: Vec<Option<Outcome>> =
            tasks.par_iter().map(|&begin| task(prepared, budget, begin..end.min(begin + FRAMES_PER_TASK))).collect();
        for outcome in outcomes {
            // A task that the caller cut ends the search: later ones are dropped, so that frames stay in order.
            let Some(outcome) = outcome else { return (found, budget.check_caller().err()) };
            tally.work += outcome.work;
            for result in outcome.results {
                tally.frames_tried += 1;
                match result {
                    Ok(grasp) => found.push(grasp),
                    Err(miss) => tally.miss(&miss),
                }
                // Where grasps are rare, as many as are kept are enough.
                let is_long = tally.frames_tried >= FRAMES_PER_GRASP * settings.grasps as u64;
                if found.len() >= n_enough || (is_long && found.len() >= settings.grasps) {
                    return (found, None);
                }
            }
        }
        progress(Progress { frames: tally.frames_tried, found: found.len() as u64 });
        first = end;
    }
    (found, None)
}

/// Some frames, one after the other; None where the caller asks to stop.
fn task(prepared: &Prepared, budget: &Budget, frames: std::ops::Range<u64>) -> Option<Outcome> {
    let mut workspace = Workspace::new(prepared.model);
    let mut results = Vec::with_capacity(frames.end as usize - frames.start as usize);
    for index in frames {
        budget.check_caller().ok()?;
        results.push(try_frame(prepared, &mut workspace, index));
    }
    Some(Outcome { results, work: workspace.work })
}

impl Tally {
    fn miss(&mut self, miss: &Miss) {
        *self.reasons.entry(miss.reason).or_default() += 1;
        if let Some(finger) = miss.out_of_reach {
            *self.out_of_reach.entry(finger).or_default() += 1;
        }
        self.margin = self.margin.max(miss.margin);
    }

    /// The finger that reached no contact most often.
    fn worst_finger(&self) -> Option<usize> {
        self.out_of_reach.iter().max_by_key(|(finger, count)| (**count, usize::MAX - **finger)).map(|(f, _)| *f)
    }
}

fn names<'a>(prepared: &Prepared<'a>) -> Vec<&'a str> {
    prepared.model.view.hand.fingers.iter().map(|finger| finger.name.as_str()).collect()
}

fn statistics(prepared: &Prepared, tally: &Tally, n_found: usize, cut: Option<Interrupt>) -> GraspStatistics {
    let names = names(prepared);
    GraspStatistics {
        frames: prepared.n_frames(),
        frames_tried: tally.frames_tried,
        rejected: tally.reasons.iter().map(|(reason, count)| (reason.in_words(&names), *count)).collect(),
        found: n_found as u64,
        work: tally.work,
        cut_by_time: matches!(cut, Some(Interrupt::Deadline | Interrupt::Cancelled)),
    }
}

/// No grasp, with the causes and the nearest miss.
fn failure(prepared: &Prepared, tally: &Tally, cut: Option<Interrupt>) -> Failure {
    let names = names(prepared);
    let total: u64 = tally.reasons.values().sum();
    let mut causes: Vec<Cause> = tally
        .reasons
        .iter()
        .map(|(reason, &count)| Cause {
            reason: reason.in_words(&names),
            count,
            share: count as f64 / total.max(1) as f64,
        })
        .collect();
    causes.sort_by_key(|cause| std::cmp::Reverse(cause.count));
    let nearest = match (tally.margin > 0.0, tally.worst_finger()) {
        (true, _) => {
            format!("the best contacts seen have margin {:.4}; {} is asked for", tally.margin, prepared.settings.margin)
        }
        (false, Some(finger)) => format!("finger \"{}\" most often reaches no contact", names[finger]),
        (false, None) => "no contacts were seen that close the object".into(),
    };
    let message = format!(
        "found no grasp of \"{}\" in {} of {} frames; {nearest}",
        prepared.model.view.object.name,
        tally.frames_tried,
        prepared.n_frames()
    );
    let advice = "more --frames, a smaller --margin, another size of the object (--scale), or more friction";
    let kind = cut.map_or(FailureKind::Impossible, FailureKind::from);
    let mut failure = Failure::bare(kind, message, advice);
    failure.causes = causes;
    failure.statistics.work = tally.work;
    failure.statistics.samples = tally.frames_tried;
    failure
}
