//! What all methods of the in-hand planner share: scratch memory, random numbers, budget, tally.

use crate::in_hand::attempt::accessible::Accessible;
use crate::in_hand::attempt::passage::Passages;
use crate::in_hand::attempt::patience::Patience;
use crate::in_hand::attempt::poses::draw_pose;
use crate::in_hand::attempt::tally::{Reason, Tally};
use crate::settings::{FingerWays, InHandSettings, Method};
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_geometry::{Pose, frame};
use regrasp_manipulation::failure::FailureKind;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::model::Model;
use regrasp_manipulation::outline::Outline;
use regrasp_manipulation::passing::PassingOver;
use regrasp_manipulation::progress::Progress;
use regrasp_manipulation::workspace::Workspace;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What all attempts at a query have in common.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// The scene, prepared.
    pub model: &'a Model<'a>,
    /// Settings, within the limits of the scene.
    pub settings: &'a InHandSettings,
    /// Seed of all random numbers.
    pub seed: u64,
    /// The caller's limits.
    pub budget: &'a Budget,
    /// The lowest attempt that has found a plan: later ones may stop.
    pub winner: &'a AtomicUsize,
    /// What is told of the search while it runs.
    pub progress: &'a (dyn Fn(Progress) + Sync),
}

/// One running search.
pub struct Search<'a> {
    /// Settings, within the limits of the scene.
    pub settings: &'a InHandSettings,
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
    /// Where the hand reaches; measured when it is first asked for.
    accessible: Option<Accessible>,
    /// How long the way of a finger is looked for, by the methods of Saut 2011; None for a short time only.
    pub patience: Option<Patience>,
    /// Index of the attempt.
    pub attempt: usize,
    /// True where the object stays where it is: what is asked is a grasp, not one from which a finger may lift.
    pub holds_only: bool,
    /// True when a wall-clock limit cut something that a plan was found without.
    pub cut_by_time: bool,
    /// What all attempts at the query have in common.
    context: Context<'a>,
    work_limit: u64,
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
    pub fn new(context: Context<'a>, [start, goal]: [Pose; 2], attempt: usize, work_limit: u64) -> Self {
        let mut workspace = Workspace::new(context.model);
        workspace.draws.work_limit = work_limit;
        let settings = context.settings;
        if settings.method != Method::Gait && settings.baselines.finger_ways == FingerWays::RrtOnly {
            workspace.passing_over = PassingOver::RrtOnly;
        }
        Search {
            settings: context.settings,
            workspace,
            rng: Rng::keyed(context.seed, "attempt", attempt as u64),
            tally: Tally::default(),
            leg: 0,
            nearest: None,
            reached: None,
            n_nodes: 0,
            n_samples: 0,
            start,
            goal,
            passages: Passages::default(),
            accessible: None,
            patience: (settings.method != Method::Gait).then(Patience::default),
            attempt,
            holds_only: false,
            cut_by_time: false,
            context,
            work_limit,
            next_report: REPORT_EVERY,
        }
    }

    /// Work that is left of this search's share.
    pub fn work_left(&self) -> u64 {
        self.work_limit.saturating_sub(self.workspace.work)
    }

    /// Another search for a part of what this one looks for, with a share of its limits and random numbers of its own.
    pub fn for_detour(&self, number: usize, work_limit: u64) -> Self {
        let search = Search::new(self.context, [self.start, self.goal], 0, work_limit);
        Search { rng: Rng::keyed(self.context.seed, "detour", number as u64), ..search }
    }

    /// Turns to another leg; what was learnt about failures stays.
    pub fn begin_leg(&mut self, leg: usize, start: Pose, goal: Pose) {
        (self.leg, self.start, self.goal) = (leg, start, goal);
        (self.nearest, self.n_nodes) = (None, 0);
        for pose in [start, goal] {
            self.learn_reach(&pose);
        }
        self.passages = Passages::of(self.model(), self.settings.search.wander_distance, [&start, &goal]);
    }

    /// Why no grasp was found among the contacts at hand.
    pub fn no_grasp(&self) -> Reason {
        if self.holds_only { Reason::NotHeld } else { Reason::NotClosed }
    }

    /// Why attempts failed, with the grasps that were refused for want of forces.
    pub fn whole_tally(&self) -> Tally {
        let mut tally = self.tally.clone();
        for (cause, count) in self.workspace.refusals.counts() {
            tally.add_many(Reason::NoForces(cause), count);
        }
        tally.tried.merge(&self.workspace.tried);
        tally
    }

    /// The scene, prepared.
    pub fn model(&self) -> &'a Model<'a> {
        self.workspace.model
    }

    /// What is asked is a grasp, and not one from which a finger may lift. In hands that can do no more than hold, every finger then finds
    /// contacts by closing too.
    pub fn ask_only_to_hold(&mut self) {
        let model = self.model();
        self.holds_only = true;
        self.workspace.all_close = !model.may_release || !model.may_move_object();
    }

    /// Err when this attempt is to stop. To be called at least every few hundred units of work.
    pub fn check(&mut self) -> Result<(), Stop> {
        let work = self.workspace.work;
        if work >= self.next_report {
            self.next_report = work + REPORT_EVERY;
            // Before anything is reached, all of the leg is left.
            let nearest = self.nearest.as_ref().map_or(&self.start, |(_, state)| &state.world_from_object);
            let angle_left = frame::rotation_between(nearest, &self.goal).norm();
            (self.context.progress)(Progress { nodes: self.n_nodes, work, restarts: self.attempt as u64, angle_left });
        }
        if self.context.winner.load(Ordering::Relaxed) < self.attempt {
            return Err(Stop::Overtaken);
        }
        // The caller's work limit is shared out among the attempts, this one's share being `work_limit`.
        self.context.budget.check_caller().map_err(Stop::Budget)?;
        if work >= self.work_limit { Err(Stop::Restart) } else { Ok(()) }
    }

    /// A random pose near the way, or out of a passage at one of its ends.
    pub fn draw_pose(&mut self) -> Pose {
        let model = self.model();
        let way_out = self.passages.draw(self.settings.search.passage_share, &mut self.rng);
        way_out.unwrap_or_else(|| draw_pose(model, &self.settings.search, &self.start, &self.goal, &mut self.rng))
    }

    /// A random pose where the hand reaches the object, anyhow turned (Saut 2011, sec. 4.2.2).
    pub fn draw_pose_in_reach(&mut self) -> Pose {
        if let Some(way_out) = self.passages.draw(self.settings.search.passage_share, &mut self.rng) {
            return way_out;
        }
        let model = self.model();
        let (rng, ends) = (&mut self.rng, [self.start, self.goal]);
        let accessible = self.accessible.get_or_insert_with(|| {
            let mut accessible = Accessible::measure(model, rng);
            ends.iter().for_each(|pose| accessible.learn(model, pose));
            accessible
        });
        accessible.draw(model, rng)
    }

    /// Takes note of a pose at which a grasp was found, where others are to be drawn.
    pub fn learn_reach(&mut self, pose: &Pose) {
        let model = self.model();
        if let Some(accessible) = &mut self.accessible {
            accessible.learn(model, pose);
        }
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
