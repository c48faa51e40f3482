//! Motions looked at in steps, eight configurations at a time, spread over the whole motion: what collides is found early.

use super::Collider;
use crate::lanes::{F8, LANES, V8};
use crate::world::{Item, ball_overlap};

/// Of each lane of the first block: the part of the motion between it and the moments nearest to it, at most.
const GAPS: F8 = F8([0.125, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625]);

impl Collider<'_> {
    #[inline(always)]
    pub(super) fn sampled(&mut self, from: &[f64], to: &[f64]) -> bool {
        self.counts.motions += 1;
        let mut distance = 0.0;
        for k in 0..self.q.len() {
            distance += (to[k] - from[k]) * (to[k] - from[k]);
        }
        let distance = distance.sqrt();
        if !distance.is_finite() {
            return false;
        }
        let n = (distance * self.settings.resolution / LANES as f64).ceil().max(1.0) as usize;
        // The first block has the moments 1/8, 2/8, ..., 1.
        self.place_lanes(from, to, n, n);
        if n > 1 {
            self.find_speeds(|k| (to[k] - from[k]).abs() as f32);
        }
        if self.first_block_hits(n > 1) {
            return false;
        }
        for step in 1..n {
            self.place_lanes(from, to, step, n);
            if self.block_hits() {
                return false;
            }
        }
        true
    }

    /// Joint values of block `step` of `n`.
    #[inline(always)]
    fn place_lanes(&mut self, from: &[f64], to: &[f64], step: usize, n: usize) {
        let mut moments = F8::ZERO;
        let whole = (LANES * n) as f32;
        for l in 0..LANES {
            moments.0[l] = (l * n + step) as f32 / whole;
        }
        for k in 0..self.q.len() {
            self.q[k] = F8::splat(from[k] as f32) + moments * ((to[k] - from[k]) as f32);
        }
        self.place_frames();
    }

    /// How fast bodies and pairs move at most, for these sizes of the joints' changes.
    #[inline(always)]
    pub(super) fn find_speeds(&mut self, change: impl Fn(usize) -> f32) {
        for &body in &self.exposed {
            let mut speed = 0.0;
            for term in &self.model.bodies[body as usize].speed {
                speed += term.reach * change(term.coordinate);
            }
            self.body_speeds[body as usize] = speed;
        }
        for &pair in &self.pairs {
            let mut speed = 0.0;
            for term in &self.model.pairs[pair as usize].speed {
                speed += term.reach * change(term.coordinate);
            }
            self.pair_speeds[pair as usize] = speed;
        }
    }

    /// Obstacles near the box about eight balls.
    #[inline(always)]
    pub(super) fn find_near(&mut self, center: &V8, reach: &F8) {
        let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
        for i in 0..3 {
            low[i] = (center[i] - *reach).lowest();
            high[i] = (center[i] + *reach).highest();
        }
        self.world.near(low, high, &mut self.found);
    }

    /// The first block: also finds what the other blocks have to look at.
    #[inline(always)]
    fn first_block_hits(&mut self, has_more: bool) -> bool {
        let clearance = self.settings.clearance as f32;
        for index in 0..self.exposed.len() {
            let body = self.exposed[index] as usize;
            let center = self.place_bound(body);
            let radius = self.model.bodies[body].bound.radius + clearance;
            let wide = if has_more { GAPS * self.body_speeds[body] + radius } else { F8::splat(radius) };
            self.find_near(&center, &wide);
            self.near[body].clear();
            for index in 0..self.found.len() {
                let item = self.found[index];
                let world = self.world;
                if !world.items[item as usize].overlap(&center, wide).any_positive() {
                    continue;
                }
                if has_more {
                    self.near[body].push(item);
                }
                if self.body_hits(body, item, &center, radius, clearance) {
                    return true;
                }
            }
        }
        self.place_other_bounds();
        self.close.clear();
        for index in 0..self.pairs.len() {
            let pair = self.pairs[index];
            let [a, b] = self.model.pairs[pair as usize].bodies;
            let reach = self.model.bodies[a].bound.radius + self.model.bodies[b].bound.radius + clearance;
            let wide = if has_more { GAPS * self.pair_speeds[pair as usize] + reach } else { F8::splat(reach) };
            if !ball_overlap(&self.bounds[a], &self.bounds[b], wide).any_positive() {
                continue;
            }
            if has_more {
                self.close.push(pair);
            }
            if self.pair_hits(a, b, reach, clearance) {
                return true;
            }
        }
        false
    }

    /// Bounds of bodies that are not tested against obstacles.
    #[inline(always)]
    pub(super) fn place_other_bounds(&mut self) {
        if self.exposed.len() == self.model.bodies.len() {
            return;
        }
        let mut exposed = 0;
        for body in 0..self.model.bodies.len() {
            if exposed < self.exposed.len() && self.exposed[exposed] as usize == body {
                exposed += 1;
            } else {
                self.place_bound(body);
            }
        }
    }

    /// The blocks after the first one.
    #[inline(always)]
    fn block_hits(&mut self) -> bool {
        let clearance = self.settings.clearance as f32;
        for index in 0..self.exposed.len() {
            let body = self.exposed[index] as usize;
            let center = self.place_bound(body);
            let radius = self.model.bodies[body].bound.radius + clearance;
            for index in 0..self.near[body].len() {
                let item = self.near[body][index];
                if self.body_hits(body, item, &center, radius, clearance) {
                    return true;
                }
            }
        }
        if self.close.is_empty() {
            return false;
        }
        self.place_other_bounds();
        for index in 0..self.close.len() {
            let [a, b] = self.model.pairs[self.close[index] as usize].bodies;
            let reach = self.model.bodies[a].bound.radius + self.model.bodies[b].bound.radius + clearance;
            if self.pair_hits(a, b, reach, clearance) {
                return true;
            }
        }
        false
    }

    /// True where balls of a body meet an obstacle.
    #[inline(always)]
    fn body_hits(&mut self, body: usize, index: u32, center: &V8, radius: f32, clearance: f32) -> bool {
        let obstacle = index as usize;
        let item = &self.world.items[obstacle];
        if !item.overlap(center, F8::splat(radius)).any_positive() {
            return false;
        }
        self.place_groups(body);
        let mut worst = F8::splat(-1.0);
        let is_exact = self.model.bodies[body].is_exact;
        for group in self.model.bodies[body].groups.clone() {
            let of_group = &self.model.groups[group];
            let about = F8::splat(of_group.bound.radius + clearance);
            if !item.overlap(&self.group_bounds[group], about).any_positive() {
                continue;
            }
            self.place_balls(body, group);
            for index in of_group.balls.clone() {
                let center = &self.balls[index];
                let reach = F8::splat(self.model.balls[index].radius + clearance);
                let mut overlap = item.overlap(center, reach);
                // Where the body has shapes, those decide, below: one distance each instead of one for each ball.
                if let Item::Other { exact, .. } = item
                    && is_exact
                    && overlap.any_positive()
                {
                    overlap = Item::refined(exact, center, reach, overlap);
                }
                worst = worst.max(overlap);
            }
        }
        worst.any_positive()
            && (is_exact || self.near_obstacle(body, obstacle, worst.positive(), F8::splat(clearance)) != 0)
    }

    /// True where balls of two bodies meet.
    #[inline(always)]
    fn pair_hits(&mut self, a: usize, b: usize, reach: f32, clearance: f32) -> bool {
        if !ball_overlap(&self.bounds[a], &self.bounds[b], F8::splat(reach)).any_positive() {
            return false;
        }
        self.find_close_groups([a, b], F8::splat(clearance));
        let mut worst = F8::splat(-1.0);
        for index in 0..self.close_groups.len() {
            let groups = self.close_groups[index];
            self.place_balls(a, groups[0]);
            self.place_balls(b, groups[1]);
            let bound = &self.model.groups[groups[1]].bound;
            for i in self.model.groups[groups[0]].balls.clone() {
                let (radius, center) = (self.model.balls[i].radius, self.balls[i]);
                let whole = F8::splat(radius + bound.radius + clearance);
                if !ball_overlap(&center, &self.group_bounds[groups[1]], whole).any_positive() {
                    continue;
                }
                for j in self.model.groups[groups[1]].balls.clone() {
                    let reach = F8::splat(radius + self.model.balls[j].radius + clearance);
                    worst = worst.max(ball_overlap(&center, &self.balls[j], reach));
                }
            }
        }
        let is_exact = self.model.bodies[a].is_exact && self.model.bodies[b].is_exact;
        worst.any_positive() && (is_exact || self.near_body([a, b], worst.positive(), F8::splat(clearance)) != 0)
    }

    /// Pairs of groups of two bodies' balls that are not farther from each other than `sway`.
    #[inline(always)]
    pub(super) fn find_close_groups(&mut self, [a, b]: [usize; 2], sway: F8) {
        self.close_groups.clear();
        let model = self.model;
        let groups = [a, b].map(|body| model.bodies[body].groups.clone());
        self.place_groups(a);
        self.place_groups(b);
        let is_one = groups[1].len() == 1;
        for first in groups[0].clone() {
            let (radius, center) = (model.groups[first].bound.radius, self.group_bounds[first]);
            if !is_one {
                let whole = sway + (radius + model.bodies[b].bound.radius);
                if !ball_overlap(&center, &self.bounds[b], whole).any_positive() {
                    continue;
                }
            }
            for second in groups[1].clone() {
                let reach = sway + (radius + model.groups[second].bound.radius);
                if ball_overlap(&center, &self.group_bounds[second], reach).any_positive() {
                    self.close_groups.push([first, second]);
                }
            }
        }
    }
}
