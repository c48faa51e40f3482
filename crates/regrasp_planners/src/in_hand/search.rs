//! What all methods of the in-hand planner share: scratch memory, random numbers, budget, tally.

use super::Progress;
use super::candidates::draw_pose;
use super::model::Model;
use super::passage::Passages;
use super::state::GraspState;
use super::tally::{Reason, Tally};
use super::workspace::Workspace;
use crate::failure::FailureKind;
use crate::outline::Outline;
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_geometry::{Pose, frame};
use std::sync::atomic::{AtomicUsize, Ordering};

/// One running search.
pub struct Search<'a> {
    /// Scratch memory; `workspace.work` counts.
    pub workspace: Workspace<'a>,
    /// Random numbers of this attempt.
    pub rng: Rng,
    /// Why attempts failed.
    pub tally: Tally,
    /// Index of the leg that is being planned.
    pub leg: usize,
    /// The state nearest to the leg's goal pose so far, with its distance.
    pub nearest: Option<(f64, GraspState)>,
    /// What was reached when the search was stopped.
    pub reached: Option<Box<Outline>>,
    /// Nodes made.
    pub n_nodes: u64,
    /// Grasps and contacts sampled.
    pub n_samples: u64,
    /// Start pose of the leg.
    pub start: Pose,
    /// Goal pose of the leg.
    pub goal: Pose,
    passages: Passages,
    /// Index of the attempt.
    pub attempt: usize,
    /// True when a wall-clock limit cut something that a plan was found without.
    pub cut_by_time: bool,
    budget: &'a Budget,
    work_limit: u64,
    /// The lowest attempt that has found a plan: later ones may stop.
    winner: &'a AtomicUsize,
    progress: &'a (dyn Fn(Progress) + Sync),
    next_report: u64,
}

/// Why an attempt ends without a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// Its share of work is used up: another attempt may do better.
    Restart,
    /// An earlier attempt has a plan.
    Overtaken,
    /// The caller's limits.
    Budget(Interrupt),
}

impl Stop {
    /// What it is for a search that has no further attempt.
    pub fn kind(&self) -> FailureKind {
        match self {
            Stop::Budget(interrupt) => (*interrupt).into(),
            Stop::Restart | Stop::Overtaken => FailureKind::WorkSpent,
        }
    }
}

/// Work between two reports of progress.
const REPORT_EVERY: u64 = 20_000;

impl<'a> Search<'a> {
    /// Attempt `attempt`, with at most `work_limit` units of work.
    pub fn new(
        model: &'a Model<'a>,
        (start, goal): (Pose, Pose),
        (seed, attempt): (u64, usize),
        (budget, work_limit): (&'a Budget, u64),
        winner: &'a AtomicUsize,
        progress: &'a (dyn Fn(Progress) + Sync),
    ) -> Self {
        let mut workspace = Workspace::new(model);
        workspace.draws.work_limit = work_limit;
        Search {
            workspace,
            rng: Rng::keyed(seed, "attempt", attempt as u64),
            tally: Tally::default(),
            leg: 0,
            nearest: None,
            reached: None,
            n_nodes: 0,
            n_samples: 0,
            start,
            goal,
            passages: Passages::default(),
            attempt,
            cut_by_time: false,
            budget,
            work_limit,
            winner,
            progress,
            next_report: REPORT_EVERY,
        }
    }

    /// Work that is left of this search's share.
    pub fn work_left(&self) -> u64 {
        self.work_limit.saturating_sub(self.workspace.work)
    }

    /// Another search for a part of what this one looks for, with a share of its limits and random numbers of its own.
    pub fn for_detour(&self, (seed, attempt): (u64, usize), work_limit: u64) -> Self {
        let search = Search::new(
            self.model(),
            (self.start, self.goal),
            (seed, 0),
            (self.budget, work_limit),
            self.winner,
            self.progress,
        );
        Search { rng: Rng::keyed(seed, "detour", attempt as u64), ..search }
    }

    /// Turns to another leg; what was learnt about failures stays.
    pub fn begin_leg(&mut self, leg: usize, start: Pose, goal: Pose) {
        (self.leg, self.start, self.goal) = (leg, start, goal);
        (self.nearest, self.n_nodes) = (None, 0);
        self.passages = Passages::of(self.model(), [&start, &goal]);
    }

    /// Why attempts failed, with the grasps that were refused for want of forces.
    pub fn whole_tally(&self) -> Tally {
        let mut tally = self.tally.clone();
        for (cause, count) in self.workspace.refusals.counts() {
            tally.add_many(Reason::NoForces(cause), count);
        }
        tally
    }

    /// The scene, prepared.
    pub fn model(&self) -> &'a Model<'a> {
        self.workspace.model
    }

    /// Err when this attempt is to stop. To be called at least every few hundred units of work.
    pub fn check(&mut self) -> Result<(), Stop> {
        let work = self.workspace.work;
        if work >= self.next_report {
            self.next_report = work + REPORT_EVERY;
            // Before anything is reached, all of the leg is left.
            let nearest = self.nearest.as_ref().map_or(&self.start, |(_, state)| &state.world_from_object);
            let angle_left = frame::rotation_between(nearest, &self.goal).norm();
            (self.progress)(Progress { nodes: self.n_nodes, work, restarts: self.attempt as u64, angle_left });
        }
        if self.winner.load(Ordering::Relaxed) < self.attempt {
            return Err(Stop::Overtaken);
        }
        // The caller's work limit is shared out among the attempts, this one's share being `work_limit`.
        self.budget.check_caller().map_err(Stop::Budget)?;
        if work >= self.work_limit { Err(Stop::Restart) } else { Ok(()) }
    }

    /// A random pose near the way, or out of a passage at one of its ends.
    pub fn draw_pose(&mut self) -> Pose {
        let model = self.model();
        let way_out = self.passages.draw(model.settings.passage_share, &mut self.rng);
        way_out.unwrap_or_else(|| draw_pose(model, &self.start, &self.goal, &mut self.rng))
    }

    /// Distance between poses, with angles weighed by the object's radius.
    pub fn distance(&self, a: &Pose, b: &Pose) -> f64 {
        frame::pose_distance(a, b, self.model().turn_length())
    }

    /// Takes note of a state, for the nearest miss.
    pub fn note(&mut self, state: &GraspState) {
        let distance = self.distance(&state.world_from_object, &self.goal);
        if self.nearest.as_ref().is_none_or(|(least, _)| distance < *least) {
            self.nearest = Some((distance, state.clone()));
        }
    }
}
