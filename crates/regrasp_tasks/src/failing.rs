//! Why there is no plan.

use regrasp_geometry::Pose;
use regrasp_manipulation::failure::{Cause, Failure, FailureKind};
use regrasp_plan::robot_plan::RobotStatistics;
use std::collections::BTreeMap;

/// A stage of the search, in its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// A grasp where the object stands at the start.
    Grasp,
    /// A grasp where it shall stand.
    Place,
    /// An intermediate placement.
    PutDown,
    /// Two hands.
    Exchange,
    /// Another grasp of the same hand.
    InHand,
    /// A motion with nothing in the hands.
    Transit,
    /// A motion with the object.
    Carry,
}

impl Stage {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Grasp => "grasp",
            Stage::Place => "place",
            Stage::PutDown => "put down",
            Stage::Exchange => "exchange",
            Stage::InHand => "in hand",
            Stage::Transit => "transit",
            Stage::Carry => "carry",
        }
    }
}

/// Something that was tried and failed, to be looked at again where no plan is found.
#[derive(Debug, Clone)]
pub struct Try {
    /// Why it failed.
    pub reason: String,
    /// Pose of the object; none where the same fails wherever it is.
    pub world_from_object: Option<Pose>,
    /// Hands at the object, each with the index of its grasp. At an exchange the giver first.
    pub grasps: Vec<[usize; 2]>,
    /// The robot, fingers as in the grasps. None where no arm was looked at, or one does not get there.
    pub state: Option<Vec<f64>>,
}

/// Most tries of a stage that are kept of those that came equally far.
const MOST_TRIES: usize = 16;

/// Counts of a search.
#[derive(Debug, Default)]
pub struct Tally {
    /// Counts of searches for motions.
    pub statistics: RobotStatistics,
    /// What was tried, by stage.
    pub tried: BTreeMap<Stage, u64>,
    /// What worked, by stage.
    pub found: BTreeMap<Stage, u64>,
    /// Why the rest did not.
    pub reasons: BTreeMap<(Stage, String), u64>,
    /// The nearest miss by stage: how far, and in words.
    pub nearest: BTreeMap<Stage, (f64, String)>,
    /// By stage and how far they came, the larger the nearer to success: the first tries that failed.
    pub tries: BTreeMap<(Stage, usize), Vec<Try>>,
}

impl Tally {
    /// Something was tried at a stage, and came out so.
    pub fn count(&mut self, stage: Stage, outcome: Result<(), &str>) {
        *self.tried.entry(stage).or_default() += 1;
        match outcome {
            Ok(()) => *self.found.entry(stage).or_default() += 1,
            Err(reason) => *self.reasons.entry((stage, reason.to_owned())).or_default() += 1,
        }
    }

    /// Something missed by so much; the least counts.
    pub fn miss(&mut self, stage: Stage, by: f64, words: impl FnOnce() -> String) {
        if self.nearest.get(&stage).is_none_or(|nearest| by < nearest.0) {
            self.nearest.insert(stage, (by, words()));
        }
    }

    /// Keeps something that failed and came so far: the larger, the nearer to success.
    pub fn keep(&mut self, stage: Stage, so_far: usize, made: impl FnOnce() -> Try) {
        let tries = self.tries.entry((stage, so_far)).or_default();
        if tries.len() < MOST_TRIES {
            tries.push(made());
        }
    }

    /// The tries that tell most about a stage: those that came nearest where nothing worked there, else those that failed for the
    /// commonest reason.
    pub fn telling_tries(&self, stage: Stage) -> &[Try] {
        let mut own = self.tries.range((stage, 0)..=(stage, usize::MAX)).map(|(_, tries)| tries);
        let count = |tries: &Vec<Try>| {
            let reason = tries.first().map_or_else(String::new, |tried| tried.reason.clone());
            self.reasons.get(&(stage, reason)).copied().unwrap_or_default()
        };
        let chosen = match self.found.contains_key(&stage) {
            true => own.max_by_key(|tries| count(tries)),
            false => own.next_back(),
        };
        chosen.map_or(&[], Vec::as_slice)
    }

    /// One configuration was looked at.
    pub fn work(&mut self, n: u64) {
        self.statistics.work += n;
    }

    /// Takes the counts of a search for a motion.
    pub fn take(&mut self, other: &RobotStatistics) {
        self.statistics.nodes += other.nodes;
        self.statistics.samples += other.samples;
        self.statistics.work += other.work;
        self.statistics.cut_by_time |= other.cut_by_time;
    }

    /// The counts as a plan has them.
    pub fn statistics(&self) -> RobotStatistics {
        let mut statistics = self.statistics.clone();
        for (stage, count) in &self.tried {
            statistics.counts.insert(format!("{}_tried", stage.name().replace(' ', "_")), *count);
        }
        statistics
    }

    /// A stage in words: how many were tried, and why they failed.
    fn in_words(&self, stage: Stage) -> String {
        let tried = self.tried.get(&stage).copied().unwrap_or_default();
        let mut parts: Vec<(u64, String)> = self
            .reasons
            .iter()
            .filter(|((of, _), _)| *of == stage)
            .map(|((_, reason), count)| (*count, format!("{count} {reason}")))
            .collect();
        parts.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
        let parts: Vec<String> = parts.into_iter().map(|(_, words)| words).collect();
        let nearest = self.nearest.get(&stage).map_or_else(String::new, |(_, words)| format!(" (nearest: {words})"));
        format!("{tried} tried, {}{nearest}", parts.join(", "))
    }

    /// The first stage at which nothing worked.
    fn failing_stage(&self) -> Stage {
        let order =
            [Stage::Grasp, Stage::Place, Stage::Exchange, Stage::PutDown, Stage::InHand, Stage::Transit, Stage::Carry];
        let is_empty = |stage: &Stage| self.tried.contains_key(stage) && !self.found.contains_key(stage);
        let last = || order.into_iter().rev().find(|stage| self.reasons.keys().any(|(of, _)| of == stage));
        order.into_iter().find(is_empty).or_else(last).unwrap_or(Stage::Grasp)
    }

    /// The stages that a failure names.
    pub fn failing_stages(&self) -> Vec<Stage> {
        // A change of grasp in a hand is tried only because exchanges failed: those come first.
        let have_exchanges_failed = self.reasons.keys().any(|(of, _)| *of == Stage::Exchange);
        match self.failing_stage() {
            Stage::InHand if have_exchanges_failed => vec![Stage::Exchange, Stage::InHand],
            stage => vec![stage],
        }
    }

    /// No plan: the first stage at which nothing worked says why.
    pub fn failure(&self, kind: FailureKind) -> Failure {
        let stages = self.failing_stages();
        let parts = stages.iter().map(|stage| format!("{}: {}", stage.name(), self.in_words(*stage)));
        let (stage, message) = (stages[0], parts.collect::<Vec<_>>().join("; "));
        let advice = match stage {
            Stage::Grasp | Stage::Place => {
                "make longer lists of grasps, or move the object nearer or away from clutter"
            }
            Stage::Exchange => "make longer lists of grasps, or let the object be put down on the way",
            Stage::InHand => "allow more work in a hand (`in_hand_work`), or let the object be put down on the way",
            Stage::PutDown => "give a support that both hands reach",
            Stage::Transit | Stage::Carry => "try another seed, more samples, or less clutter",
        };
        let mut failure = Failure::bare(kind, message, advice);
        let all: u64 = self.reasons.values().sum();
        failure.causes = self
            .reasons
            .iter()
            .map(|((stage, reason), &count)| Cause {
                reason: format!("{}: {reason}", stage.name()),
                count,
                share: count as f64 / all.max(1) as f64,
            })
            .collect();
        failure.causes.sort_by_key(|cause| std::cmp::Reverse(cause.count));
        failure.statistics.work = self.statistics.work;
        failure.statistics.samples = self.statistics.samples;
        failure
    }
}

/// A failure before any search.
pub fn refused(kind: FailureKind, message: String, advice: &str) -> Failure {
    Failure::bare(kind, message, advice)
}
