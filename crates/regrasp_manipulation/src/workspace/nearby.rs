//! Obstacles near the bodies that move. Hand and object move among obstacles that are mostly far away: those of which the
//! bounding ball is too far from a body's are never looked at, and yet every answer, every direction and every bound is, bit
//! for bit, the one of a test of all pairs in turn.
//!
//! Two things make that so. An obstacle is left out only where the balls prove the step, which changes nothing of a pair but
//! its slack. And what the slack of a pair would be follows from the motion of the body alone, which is written down; it is
//! worked out when the pair is next too near for its balls.

#[cfg(test)]
mod tests;

use crate::model::{Model, Pair, Turn};
use crate::workspace::{TipMode, Workspace};
use regrasp_geometry::collision::Ball;
use regrasp_geometry::{Point, Vector};

/// A list of near obstacles reaches farther than the step that it is made for by this share of the body's radius, so that it
/// serves for a few steps more. By hand: any value gives the same plans.
const FARTHER: f64 = 0.5;
/// More than any rounding of lengths.
const WITH_ROUNDING: f64 = 1.0 + 1e-9;

/// One look at a body's pairs with all obstacles.
#[derive(Debug, Clone, Copy)]
struct Look {
    /// How far the body had moved at most since the look before.
    motion: f64,
    /// Centre of its bounding ball, in the world.
    center: Point,
    /// Obstacles that were looked at: those below this one.
    below: u32,
}

/// What is known of the obstacles around one body.
#[derive(Debug, Clone)]
struct Around {
    /// Obstacles that may be near.
    near: Vec<Ball>,
    /// Where `near` was looked up: centre of the body's ball, in the world.
    center: Point,
    /// Lower bound of the distance of all other obstacles' balls from `center`.
    others: f64,
    /// Looks since the body's slacks were last forgotten.
    looks: Vec<Look>,
    /// Number of times that they were.
    epoch: u64,
    /// By obstacle: one more than the index of its track; zero where it has none yet.
    tracks: Vec<u32>,
}

/// A pair of a body and an obstacle that was once too near for the balls.
#[derive(Debug, Clone, Copy)]
struct Track {
    /// Epoch of the body in which the slack was known.
    epoch: u64,
    /// Looks of that epoch that the slack has taken in.
    n_looks: usize,
}

/// Scratch memory of one search thread for obstacles; nothing in it where there are none.
#[derive(Debug, Clone)]
pub struct Nearby {
    /// By body.
    around: Vec<Around>,
    tracks: Vec<Track>,
}

impl Nearby {
    /// Fresh scratch memory for `model`.
    pub fn new(model: &Model) -> Self {
        let n_bodies = if model.turns.is_empty() { 0 } else { model.first_obstacle() };
        let around = Around {
            near: Vec::new(),
            center: Point::origin(),
            others: f64::NEG_INFINITY,
            looks: Vec::new(),
            epoch: 1,
            tracks: vec![0; model.view.obstacles.len()],
        };
        Nearby { around: vec![around; n_bodies], tracks: Vec::new() }
    }

    /// Forgets the slacks of all bodies.
    #[inline]
    pub fn forget_all(&mut self) {
        self.around.iter_mut().for_each(Around::forget);
    }

    /// Forgets the slacks of some bodies.
    #[inline]
    pub fn forget(&mut self, bodies: std::ops::Range<usize>) {
        if !self.around.is_empty() {
            self.around[bodies].iter_mut().for_each(Around::forget);
        }
    }

    /// Every body moved by at most `motion` without a look at its pairs.
    pub fn drift(&mut self, motion: &[f64]) {
        for (around, &motion) in self.around.iter_mut().zip(motion) {
            around.looks.push(Look { motion, center: around.center, below: 0 });
        }
    }

    /// Looks at the pairs of `body`, which moved by at most `motion` to where its ball's centre is `center`. Appends to `hits`,
    /// in order, the obstacles of which the pair cannot be left to the balls.
    pub fn look(&mut self, model: &Model, body: usize, center: Point, motion: f64, hits: &mut Vec<u32>) {
        let around = &mut self.around[body];
        let radius = model.bodies[body].radius;
        let reach = radius + model.settings.clearance + motion;
        let moved = (center - around.center).norm();
        if !((moved + reach) * WITH_ROUNDING < around.others) {
            // After a leap the next place is no nearer than any other.
            let farther = if around.looks.is_empty() { 0.0 } else { FARTHER * radius };
            around.near.clear();
            around.center = center;
            around.others = model.obstacles.near(&center, (reach + farther) * WITH_ROUNDING, &mut around.near);
        }
        around.looks.push(Look { motion, center, below: u32::MAX });
        let is_hit = |ball: &&Ball| {
            let far = (reach + ball.radius) * WITH_ROUNDING;
            !((ball.center - center).norm_squared() > far * far)
        };
        hits.extend(around.near.iter().filter(is_hit).map(|ball| ball.index));
        hits.sort_unstable();
    }

    /// The last look at `body` ended at this obstacle.
    pub fn end_look(&mut self, body: usize, obstacle: u32) {
        if let Some(look) = self.around[body].looks.last_mut() {
            look.below = obstacle;
        }
    }

    /// The track of a pair, and whether it is new: tracks are counted from zero.
    pub fn track(&mut self, body: usize, obstacle: u32) -> (usize, bool) {
        let slot = &mut self.around[body].tracks[obstacle as usize];
        let is_new = *slot == 0;
        if is_new {
            self.tracks.push(Track { epoch: 0, n_looks: 0 });
            *slot = self.tracks.len() as u32;
        }
        (*slot as usize - 1, is_new)
    }

    /// Slack of a pair just before the last look, of which it takes part: what it would be, had the pair been tested in every
    /// look; `slack` is what it was when the pair was last tested.
    pub fn slack_before_look(&mut self, model: &Model, body: usize, obstacle: u32, slack: f64) -> f64 {
        let around = &self.around[body];
        let track = &mut self.tracks[around.tracks[obstacle as usize] as usize - 1];
        let (mut slack, n_known) =
            if track.epoch == around.epoch { (slack, track.n_looks) } else { (f64::NEG_INFINITY, 0) };
        *track = Track { epoch: around.epoch, n_looks: around.looks.len() };
        let (moving, fixed) = (&model.bodies[body], &model.bodies[model.first_obstacle() + obstacle as usize]);
        let center = fixed.carrier_from_body.point(&fixed.center);
        for look in &around.looks[n_known..around.looks.len() - 1] {
            slack -= look.motion;
            if obstacle < look.below && !(slack > model.settings.clearance) {
                slack = (look.center - center).norm() - moving.radius - fixed.radius;
            }
        }
        slack
    }
}

impl Around {
    #[inline]
    fn forget(&mut self) {
        self.looks.clear();
        self.epoch += 1;
    }
}

impl Workspace<'_> {
    /// Tests `n_pairs` pairs and obstacles in turn, until one fails.
    #[inline(always)]
    pub(super) fn in_turn(
        &mut self,
        n_pairs: usize,
        turns: &[Turn],
        mode: TipMode,
        mut test: impl FnMut(&mut Self, usize) -> bool,
    ) -> bool {
        let mut n_done = 0;
        for turn in turns {
            if !(n_done..turn.n_before).all(|k| test(self, k)) || !self.is_clear_of_obstacles(turn.body, mode) {
                return false;
            }
            n_done = turn.n_before;
        }
        (n_done..n_pairs).all(|k| test(self, k))
    }

    /// True when a body stays apart from all obstacles during the step.
    pub(super) fn is_clear_of_obstacles(&mut self, body: usize, mode: TipMode) -> bool {
        let center = self.next.centers[body];
        let mut hits = std::mem::take(&mut self.hits);
        hits.clear();
        self.nearby.look(self.model, body, center, self.motion[body], &mut hits);
        let stopped_by = hits.iter().copied().find(|&obstacle| !self.obstacle_is_clear(body, obstacle, mode));
        self.hits = hits;
        if let Some(obstacle) = stopped_by {
            self.nearby.end_look(body, obstacle);
        }
        stopped_by.is_none()
    }

    fn obstacle_is_clear(&mut self, body: usize, obstacle: u32, mode: TipMode) -> bool {
        let (track, is_new) = self.nearby.track(body, obstacle);
        let index = self.model.pairs.len() + track;
        if is_new {
            self.pairs.push(Pair { a: body, b: self.model.first_obstacle() + obstacle as usize, tip_of: None });
            self.directions.push(Vector::zeros());
            self.hints.push([0; 2]);
            self.slack.push(f64::NEG_INFINITY);
        }
        self.slack[index] = self.nearby.slack_before_look(self.model, body, obstacle, self.slack[index]);
        self.pair_is_clear(index, mode)
    }

    /// Forgets what is known of distances.
    #[inline]
    pub(super) fn forget_slack(&mut self) {
        self.slack[..self.model.pairs.len()].fill(f64::NEG_INFINITY);
        self.nearby.forget_all();
    }
}
