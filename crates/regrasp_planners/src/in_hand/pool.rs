//! Candidates gathered at one object pose. Nodes at the same pose share them, so that a pose that is looked at again is
//! looked at better.

use super::candidates::{Candidate, Way, draw_candidates};
use super::search::Search;
use regrasp_base::Rng;
use regrasp_geometry::Pose;

/// Most candidates kept per finger.
const POOL_SIZE: usize = 32;

/// Candidates of every finger at one pose, with how far they follow to the goal.
#[derive(Debug)]
pub struct Pool {
    world_from_object: Pose,
    way: Way,
    of_finger: Vec<Vec<Candidate>>,
}

impl Pool {
    /// An empty pool at `world_from_object`, for the way to `goal`.
    pub fn new(world_from_object: &Pose, goal: &Pose, n_fingers: usize) -> Self {
        Pool {
            world_from_object: *world_from_object,
            way: Way::new(world_from_object, goal),
            of_finger: vec![Vec::new(); n_fingers],
        }
    }

    /// Its pose.
    pub fn world_from_object(&self) -> &Pose {
        &self.world_from_object
    }

    /// The way to the goal.
    pub fn way(&self) -> &Way {
        &self.way
    }

    /// Draws new candidates of `finger`; false when there is none at all.
    pub fn grow(&mut self, search: &mut Search, finger: usize) -> bool {
        let n_drawn = search.model().settings.candidates;
        let pool = &mut self.of_finger[finger];
        let new = draw_candidates(
            &mut search.workspace,
            finger,
            &self.world_from_object,
            &self.way,
            n_drawn,
            n_drawn,
            &mut search.rng,
        );
        search.n_samples += new.len() as u64;
        pool.extend(new);
        pool.sort_by(|a, b| b.follow.total_cmp(&a.follow));
        pool.truncate(POOL_SIZE);
        !pool.is_empty()
    }

    /// Up to `n_wanted` candidates of `finger`: those that follow farthest, and one of the others for variety.
    pub fn choose(&self, finger: usize, n_wanted: usize, rng: &mut Rng) -> Vec<Candidate> {
        let pool = &self.of_finger[finger];
        let mut order: Vec<usize> = (0..pool.len()).collect();
        rng.shuffle(&mut order);
        // Stable: those that follow equally far stay in random order.
        order.sort_by(|&a, &b| pool[b].follow.total_cmp(&pool[a].follow));
        if order.len() > n_wanted && n_wanted > 1 {
            let other = n_wanted - 1 + rng.below(order.len() - n_wanted + 1);
            order.swap(n_wanted - 1, other);
        }
        order.into_iter().take(n_wanted).map(|which| pool[which].clone()).collect()
    }
}
