//! Short searches from the places that look best.

use super::probe::probe;
use super::{Place, Tried, at_once};
use crate::settings::InHandSettings;
use regrasp_base::Budget;
use regrasp_manipulation::failure::Failure;
use regrasp_scene::{HandView, InHandQuery};

/// Poses from which short searches are made, a batch at a time until in one of them some turned out well.
const PROBED: usize = 24;
const BATCH: usize = 4;
/// Poses from which every turn was found, at which no more are looked for; so many are searched from again.
const ENOUGH: usize = 2;
const AGAIN: usize = 4;
/// Times that it is searched again where no turn was found. By measurement on the left LEAP hand (cube about z by 180 degrees): after 3 times no
/// turn was found; with more, a pose from which 5 of 6 seeds have a plan within 400,000 configurations.
const TIMES_AGAIN: u64 = 12;
/// Work of a short search, and of those made again from the best poses.
const PROBE_WORK: (u64, u64) = (25_000, 60_000);

/// Short searches for `queries`.
pub struct ShortSearches<'a> {
    /// The scene.
    pub view: &'a HandView<'a>,
    /// What is asked.
    pub queries: &'a [InHandQuery],
    /// Settings, within the limits of the scene.
    pub settings: &'a InHandSettings,
    /// Seed of all random numbers.
    pub seed: u64,
    /// The caller's limits.
    pub budget: &'a Budget,
    /// Hears what was tried so far.
    pub told: &'a (dyn Fn(&Tried) + Sync),
}

impl ShortSearches<'_> {
    /// Searches from each of `places`, several at the same time; how many it came to. The answer does not depend on the number of threads:
    /// what one thread would not have come to, because the work is spent, does not count.
    fn search(&self, places: &mut [&mut Place], round: u64, tried: &mut Tried) -> Result<usize, Failure> {
        // Another seed than that of the plan: what is asked is how often a plan is found.
        let seed = self.seed.wrapping_add(1 + round);
        let work = if round == 0 { PROBE_WORK.0 } else { PROBE_WORK.1 };
        let asked = (self.settings, seed, self.budget);
        let probe_all = |place: &&mut Place| probe(self.view, self.queries, &place.world_from_object, asked, work);
        let mut n_searched = 0;
        for together in places.chunks_mut(self.settings.n_threads.max(1)) {
            if self.budget.check(tried.work).is_err() {
                break;
            }
            let seen = at_once(together, probe_all);
            for (place, probes) in together.iter_mut().zip(seen) {
                if self.budget.check(tried.work).is_err() {
                    return Ok(n_searched);
                }
                let probes = probes?;
                tried.work += probes.iter().map(|probe| probe.work).sum::<u64>();
                match place.probes.is_empty() {
                    true => place.probes = probes,
                    false => place.probes.iter_mut().zip(probes).for_each(|(known, new)| known.add(new)),
                }
                n_searched += 1;
                tried.probed += u64::from(round == 0);
                tried.solved += u64::from(round == 0 && place.is_solved());
            }
            (self.told)(tried);
        }
        Ok(n_searched)
    }

    /// Searches from places that nobody searched from yet, those with the most evidence first, until some turn out well.
    pub fn first(&self, places: &mut [Place], tried: &mut Tried) -> Result<(), Failure> {
        // Stable: of equals the one that was estimated better stays first.
        places.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        for _ in 0..PROBED / BATCH {
            let mut batch: Vec<&mut Place> =
                places.iter_mut().filter(|place| place.probes.is_empty()).take(BATCH).collect();
            let n_searched = self.search(&mut batch, 0, tried)?;
            if n_searched == 0 || n_solved(places) >= ENOUGH {
                break;
            }
        }
        tried.solved = n_solved(places) as u64;
        Ok(())
    }

    /// Searches again from the best places; where no turn was found, some more times from those that seem best by then.
    pub fn again(&self, places: &mut [Place], tried: &mut Tried) -> Result<(), Failure> {
        for round in 1..=TIMES_AGAIN {
            places.sort_by(|a, b| b.rate().total_cmp(&a.rate()));
            let mut again: Vec<&mut Place> =
                places.iter_mut().take(AGAIN).filter(|place| !place.probes.is_empty()).collect();
            let n_searched = self.search(&mut again, round, tried)?;
            if n_searched == 0 || n_solved(places) > 0 || self.queries.iter().all(InHandQuery::stays) {
                break;
            }
        }
        tried.solved = n_solved(places) as u64;
        Ok(())
    }
}

fn n_solved(places: &[Place]) -> usize {
    places.iter().filter(|place| place.is_solved()).count()
}
