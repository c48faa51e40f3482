//! Obstacles and resting bodies so far from an item that a whole step cannot matter to the pair: by balls, before anything is measured.

use crate::check::bodies::Bodies;
use crate::check::motion::WaypointStep;
use regrasp_geometry::Point;

/// A list of obstacles left out reaches this much less far than it might, in metres, so that it holds for some steps.
const SPARE: f64 = 0.01;
/// More than any rounding of lengths.
const WITH_ROUNDING: f64 = 1.0 + 1e-9;

/// The pairs of one item with all that stands still.
struct Run {
    item: usize,
    /// The pairs, by index; one after the other.
    pairs: std::ops::Range<usize>,
    /// Centre of the item's ball when pairs were last left out.
    center: Point,
    /// Every ball of a pair that is left out was at least this far from the item's ball then.
    gap: f64,
}

/// Which pairs are looked at, in their order.
pub struct Looked {
    runs: Vec<Run>,
    /// By pair: whether it is left out.
    is_far: Vec<bool>,
    /// Indices of the others.
    near: Vec<usize>,
}

impl Looked {
    /// All pairs.
    pub fn new(bodies: &Bodies) -> Self {
        let mut runs: Vec<Run> = Vec::new();
        for (index, pair) in bodies.pairs.iter().enumerate() {
            if !bodies.items[pair.b].owner.stands_still() {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.item == pair.a && run.pairs.end == index => run.pairs.end += 1,
                _ => runs.push(Run {
                    item: pair.a,
                    pairs: index..index + 1,
                    center: Point::origin(),
                    gap: f64::NEG_INFINITY,
                }),
            }
        }
        Looked { runs, is_far: vec![false; bodies.pairs.len()], near: (0..bodies.pairs.len()).collect() }
    }

    /// The pairs to look at in `step`. Those left out stay more than `keep` apart all the time: they neither collide nor have
    /// the smallest clearance. `leave_out` is told of each when it is first left out.
    pub fn in_step(
        &mut self,
        bodies: &Bodies,
        step: &mut WaypointStep,
        keep: f64,
        mut leave_out: impl FnMut(usize),
    ) -> &[usize] {
        if !keep.is_finite() {
            return &self.near;
        }
        let mut has_changed = false;
        for run in &mut self.runs {
            let center = step.center(run.item, 0.0);
            // No point of an item goes farther in a step than its fastest one.
            let room = keep + step.speed(run.item);
            if ((center - run.center).norm() + room) * WITH_ROUNDING < run.gap {
                continue;
            }
            has_changed = true;
            let enough = (room + SPARE) * WITH_ROUNDING;
            (run.center, run.gap) = (center, f64::INFINITY);
            for index in run.pairs.clone() {
                let obstacle = &bodies.items[bodies.pairs[index].b];
                let gap = (center - obstacle.center).norm() - bodies.items[run.item].radius - obstacle.radius;
                let was_far = std::mem::replace(&mut self.is_far[index], gap > enough);
                if self.is_far[index] {
                    run.gap = run.gap.min(gap);
                    if !was_far {
                        leave_out(index);
                    }
                }
            }
        }
        if has_changed {
            self.near.clear();
            self.near.extend((0..self.is_far.len()).filter(|&index| !self.is_far[index]));
        }
        &self.near
    }
}
