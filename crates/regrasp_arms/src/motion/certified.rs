//! Motions that are free at every moment.
//!
//! A motion is cut into intervals. In the middle of an interval every ball is grown by how far it can move within half of it:
//! where the grown balls meet nothing, the whole interval is free. Intervals that meet something are cut in two. The bound is the
//! speed in the middle times the half, plus half of the largest acceleration times its square. Eight intervals are looked at together,
//! of one motion or of several.

use super::{Collider, Track};
use crate::lanes::{F8, LANES};
use crate::world::{Item, ball_overlap};

/// Single precision: positions are off by less than this, in metres, for robots of a few metres.
pub const ROUNDING: f32 = 1e-5;
/// How far bodies move between two first moments, at most, in metres.
const FIRST_WAY: f32 = 0.3;
/// First intervals at most.
const MOST_FIRST: usize = 64;

/// Part of a track: moments within `half` of `middle`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Interval {
    track: u32,
    middle: f32,
    half: f32,
}

impl Collider<'_> {
    #[inline(always)]
    pub(super) fn certified(&mut self, tracks: &[Track]) -> bool {
        self.counts.motions += tracks.len() as u64;
        if tracks.is_empty() || !tracks.iter().all(Track::is_finite) {
            return tracks.is_empty();
        }
        let fastest = self.prepare(tracks);
        self.first_intervals(tracks.len(), fastest);
        while !self.intervals.is_empty() {
            let n_lanes = self.intervals.len().min(LANES);
            let mut lanes = [Interval::default(); LANES];
            for lane in 0..LANES {
                lanes[lane] = match lane < n_lanes {
                    true => self.intervals[self.intervals.len() - n_lanes + lane],
                    false => lanes[0],
                };
            }
            self.intervals.truncate(self.intervals.len() - n_lanes);
            let (mut middles, mut halves) = (F8::ZERO, F8::ZERO);
            for l in 0..LANES {
                // The middles of intervals are rounded.
                (middles.0[l], halves.0[l]) = (lanes[l].middle, lanes[l].half + 2e-7);
            }
            let all = lanes.map(|lane| &tracks[lane.track as usize]);
            for k in 0..self.q.len() {
                (self.q[k], self.rates[k]) = Track::lanes(all, k, middles);
            }
            let Some(undecided) = self.undecided::<true>(halves, n_lanes) else { return false };
            for lane in (0..n_lanes).filter(|lane| undecided >> lane & 1 == 1) {
                let Interval { track, middle, half } = lanes[lane];
                let is_last = half * fastest < self.settings.least_step as f32 || half < 1e-6;
                if is_last && !self.is_interval_exactly_free(all[lane], [middle, half]) {
                    return false;
                }
                if is_last {
                    continue;
                }
                let half = 0.5 * half;
                self.intervals.extend([middle - half, middle + half].map(|middle| Interval { track, middle, half }));
            }
        }
        true
    }

    /// The intervals that are looked at first, of so many tracks: whole blocks of them, none in which a body moves far.
    fn first_intervals(&mut self, n_tracks: usize, fastest: f32) {
        let of_way = (fastest / FIRST_WAY).ceil() as usize;
        let n = of_way.max(LANES.div_ceil(n_tracks)).min(MOST_FIRST);
        let n = if n_tracks == 1 { n.next_multiple_of(LANES) } else { n };
        let half = 0.5 / n as f32;
        let of =
            |index: usize| Interval { track: (index / n) as u32, middle: (2 * (index % n) + 1) as f32 * half, half };
        // The last ones are taken first: spread over all motions.
        let stride = (n * n_tracks).div_ceil(LANES);
        self.intervals.clear();
        for offset in 0..stride {
            let spread = (0..LANES).map(|l| l * stride + offset).filter(|&index| index < n * n_tracks);
            self.intervals.extend(spread.map(of));
        }
    }

    /// How fast bodies move at most in any of the tracks; fills in speeds of pairs and bounds of accelerations.
    #[inline(always)]
    fn prepare(&mut self, tracks: &[Track]) -> f32 {
        let n = self.model.dimension();
        let largest: Vec<[f32; 2]> = (0..n)
            .map(|k| {
                let larger = |a: [f32; 2], b: [f32; 2]| [a[0].max(b[0]), a[1].max(b[1])];
                tracks.iter().map(|track| track.largest(k)).fold([0.0; 2], larger)
            })
            .collect();
        self.find_speeds(|k| largest[k][0]);
        // How fast all joints turn together.
        let mut pace = 0.0;
        let mut slides = false;
        for frame in &self.model.frames {
            pace += frame.terms.iter().map(|&(k, multiplier)| multiplier.abs() * largest[k][0]).sum::<f32>();
            slides |= frame.slides;
        }
        // Where joints slide, each product of two velocities may count twice.
        let factor = if slides { 2.0 } else { 1.0 };
        let mut fastest = 0.0f32;
        for (body, of_model) in self.model.bodies.iter().enumerate() {
            let [mut speed, mut bend] = [0.0, 0.0];
            for term in &of_model.speed {
                speed += term.reach * largest[term.coordinate][0];
                bend += term.reach * largest[term.coordinate][1];
            }
            self.bends[body] = bend + factor * pace * speed;
            fastest = fastest.max(speed);
        }
        fastest
    }

    /// One bit for each of at most eight configurations that is not proved to be free.
    #[inline(always)]
    pub(super) fn unfree(&mut self, configurations: &[&[f64]]) -> u8 {
        for k in 0..self.q.len() {
            let value = |l: usize| configurations[if l < configurations.len() { l } else { 0 }][k] as f32;
            self.q[k] = F8(std::array::from_fn(value));
            self.rates[k] = F8::ZERO;
        }
        self.undecided::<false>(F8::ZERO, configurations.len()).unwrap_or(u8::MAX)
    }

    /// One bit for each of the first `n_lanes` intervals that is not proved to be free, about the joints in `q`. With `STOP` none where
    /// the middle of one collides.
    #[inline(always)]
    fn undecided<const STOP: bool>(&mut self, halves: F8, n_lanes: usize) -> Option<u8> {
        let asked = if n_lanes >= LANES { u8::MAX } else { (1 << n_lanes) - 1 };
        self.place_frames();
        self.find_velocities();
        let clearance = self.settings.clearance as f32;
        let mut undecided = 0u8;
        for index in 0..self.exposed.len() {
            let body = self.exposed[index] as usize;
            let center = self.place_bound(body);
            let of_model = &self.model.bodies[body];
            let sway = self.sway(body, halves) + (clearance + ROUNDING);
            self.sways[body] = sway;
            let reach = sway + of_model.bound.radius;
            let is_exact = of_model.is_exact;
            self.find_near(&center, &reach);
            for index in 0..self.found.len() {
                let world = self.world;
                let item = &world.items[self.found[index] as usize];
                if !item.overlap(&center, reach).any_positive() {
                    continue;
                }
                let (mut grown, mut bare) = (F8::splat(-1.0), F8::splat(-1.0));
                self.place_groups(body);
                for group in self.model.bodies[body].groups.clone() {
                    let of_group = &self.model.groups[group];
                    let about = sway + of_group.bound.radius;
                    if !item.overlap(&self.group_bounds[group], about).any_positive() {
                        continue;
                    }
                    self.place_balls(body, group);
                    for index in of_group.balls.clone() {
                        let (radius, center) = (self.model.balls[index].radius, &self.balls[index]);
                        let reach = sway + radius;
                        let mut overlap = item.overlap(center, reach);
                        if let Item::Other { exact, .. } = item
                            && overlap.any_positive()
                        {
                            // The body's shapes decide, below: one distance each instead of one for each ball.
                            if !is_exact {
                                grown = grown.max(overlap);
                                continue;
                            }
                            overlap = Item::refined(exact, center, reach, overlap);
                        } else {
                            bare = bare.max(item.overlap(center, F8::splat(radius + clearance - ROUNDING)));
                        }
                        grown = grown.max(overlap);
                    }
                }
                if STOP && is_exact && bare.any_positive() {
                    return None;
                }
                let mut bits = grown.positive() & asked & !undecided;
                if !is_exact && bits != 0 {
                    bits = self.near_obstacle(body, self.found[index] as usize, bits, sway);
                }
                undecided |= bits;
            }
        }
        self.place_other_bounds();
        for index in 0..self.pairs.len() {
            let pair = self.pairs[index] as usize;
            let [a, b] = self.model.pairs[pair].bodies;
            let bound = self.model.bodies[a].bound.radius + self.model.bodies[b].bound.radius;
            let sway = halves * self.pair_speeds[pair] + (clearance + 2.0 * ROUNDING);
            if !ball_overlap(&self.bounds[a], &self.bounds[b], sway + bound).any_positive() {
                continue;
            }
            let is_exact = self.model.bodies[a].is_exact && self.model.bodies[b].is_exact;
            let (mut grown, mut bare) = (F8::splat(-1.0), F8::splat(-1.0));
            self.find_close_groups([a, b], sway);
            for index in 0..self.close_groups.len() {
                let groups = self.close_groups[index];
                self.place_balls(a, groups[0]);
                self.place_balls(b, groups[1]);
                let bound = &self.model.groups[groups[1]].bound;
                for i in self.model.groups[groups[0]].balls.clone() {
                    let (radius, center) = (self.model.balls[i].radius, self.balls[i]);
                    let whole = sway + (radius + bound.radius);
                    if !ball_overlap(&center, &self.group_bounds[groups[1]], whole).any_positive() {
                        continue;
                    }
                    for j in self.model.groups[groups[1]].balls.clone() {
                        let radii = radius + self.model.balls[j].radius;
                        grown = grown.max(ball_overlap(&center, &self.balls[j], sway + radii));
                        let bare_reach = F8::splat(radii + clearance - 2.0 * ROUNDING);
                        bare = bare.max(ball_overlap(&center, &self.balls[j], bare_reach));
                    }
                }
            }
            if STOP && is_exact && bare.any_positive() {
                return None;
            }
            let mut bits = grown.positive() & asked & !undecided;
            if !is_exact && bits != 0 {
                bits = self.near_body([a, b], bits, sway);
            }
            undecided |= bits;
        }
        Some(undecided)
    }
}
