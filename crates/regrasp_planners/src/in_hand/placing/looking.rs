//! A look at estimated poses with all links of the hand.

use super::estimating::{Estimated, Turns, nearby};
use super::evidence::Evidence;
use super::outlook::Outlook;
use super::proposals::Proposals;
use super::{Place, Tried, at_once};
use crate::in_hand::attempt::search::{Context, Search};
use crate::in_hand::attempt::tally::Tally;
use regrasp_base::{Interrupt, Rng};
use regrasp_geometry::Pose;

/// Poses that are looked at where those that seemed best turned out badly: spread over all that were estimated, because the estimate, which
/// knows no links, has said little. By measurement on a hand with five fingers 1.6 times as large as a person's and a prism: of 300 poses that
/// were spread so, 139 had a grasp, and 9 of the 30 best by the estimate; none of the 48 that are looked at first led to a turn.
const SPREAD: usize = 128;
/// After them, how often the best are taken, how many of them, and how many poses near each are looked at.
const NEARBY: (usize, usize, usize) = (2, 8, 4);

/// What is seen of poses, and those with a grasp, as they are found.
pub struct Looks<'a> {
    /// The search that looks.
    pub context: Context<'a>,
    /// What is asked.
    pub asked: &'a Turns<'a>,
    /// False where the object is only to be held.
    pub moves: bool,
    /// Those found.
    pub places: Vec<Place>,
    /// Why the others have none.
    pub tally: Tally,
    /// What was tried.
    pub tried: Tried,
    /// Poses given out so far: each has random numbers of its own.
    pub n_given: u64,
    /// Hears what was tried so far.
    pub told: &'a (dyn Fn(&Tried) + Sync),
}

/// What a look at a pose comes to.
struct Seen {
    joints: Option<Vec<f64>>,
    worths: Vec<f64>,
    work: u64,
    tally: Tally,
}

impl Looks<'_> {
    /// Looks at poses of the object in the hand's frame, in their order, several at the same time. The answer does not depend on the number
    /// of threads: what one thread would not have come to, because the work is spent, does not count.
    ///
    /// Returns why it did not look at all of them.
    pub fn look_at(&mut self, poses: &[(f64, Pose)]) -> Option<Interrupt> {
        let numbered: Vec<(u64, (f64, Pose))> = (self.n_given..).zip(poses.iter().copied()).collect();
        self.n_given += poses.len() as u64;
        let budget = self.context.budget;
        for together in numbered.chunks(self.context.settings.n_threads.max(1)) {
            if let Err(cut) = budget.check(self.tried.work) {
                return Some(cut);
            }
            let all_seen = at_once(together, |(index, (_, start))| self.seen_at(*index, start));
            for ((_, (worth, start)), seen) in together.iter().zip(all_seen) {
                if let Err(cut) = budget.check(self.tried.work) {
                    return Some(cut);
                }
                self.tried.looked_at += 1;
                self.tried.work += seen.work;
                self.tally.merge(&seen.tally);
                let Some(joints) = seen.joints else { continue };
                self.tried.with_grasp += 1;
                let evidence =
                    (seen.worths.iter().map(|worth| worth.ln()).sum::<f64>() / seen.worths.len() as f64).exp();
                self.places.push(Place {
                    world_from_object: self.asked.view.world_from(start),
                    outlook: *worth,
                    evidence,
                    probes: Vec::new(),
                    joints,
                });
            }
            (self.told)(&self.tried);
        }
        None
    }

    fn seen_at(&self, index: u64, start: &Pose) -> Seen {
        let model = self.context.model;
        let mut search = Search::new(self.context, [Pose::identity(); 2], 0, u64::MAX);
        search.rng = Rng::keyed(self.context.seed, "place_evidence", index);
        if !self.moves {
            search.ask_only_to_hold();
        }
        let first = Evidence::gather(&mut search, start);
        let mut worths = vec![first.worth(model)];
        if first.grasp.is_some() {
            let others = self.asked.others(start);
            worths.extend(others.iter().map(|pose| Evidence::gather(&mut search, pose).worth(model)));
        }
        let joints = first.grasp.map(|grasp| grasp.joints.iter().flatten().copied().collect());
        Seen { joints, worths, work: search.workspace.work, tally: search.whole_tally() }
    }

    /// Looks at poses that seemed worse, and then near those that turned out best.
    ///
    /// Returns why it did not look at all of them.
    pub fn widen(
        &mut self,
        estimated: &Estimated,
        proposals: &Proposals,
        outlook: &Outlook,
        rng: &mut Rng,
    ) -> Option<Interrupt> {
        let mut cut = self.look_at(&estimated.spread(self.asked, self.context.model, SPREAD));
        let (n_rounds, n_best, n_near) = NEARBY;
        for _ in 0..n_rounds {
            if cut.is_some() {
                break;
            }
            self.places.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
            let centers: Vec<Pose> = self
                .places
                .iter()
                .take(n_best)
                .map(|place| self.asked.view.hand_from(&place.world_from_object))
                .collect();
            let mut near = Vec::new();
            for center in &centers {
                near.extend(nearby(self.asked, proposals, outlook, (center, n_near), rng, &mut self.tried));
            }
            cut = self.look_at(&near);
        }
        cut
    }
}
