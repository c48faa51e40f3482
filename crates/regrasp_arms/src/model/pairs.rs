//! Pairs of bodies that are kept apart, and bounds of how far bodies move.

use super::{ArmModel, Body, Frame};

/// A share of the speed of a body: metres per unit of a coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedTerm {
    /// The coordinate.
    pub coordinate: usize,
    /// Metres that a point moves at most per unit of it.
    pub reach: f32,
}

/// Two bodies that have to be apart.
#[derive(Debug, Clone)]
pub struct Pair {
    /// Indices in [`ArmModel::bodies`].
    pub bodies: [usize; 2],
    /// How fast they move relative to each other at most: joints that move both alike count nothing.
    pub speed: Vec<SpeedTerm>,
}

/// More than rounding in single precision.
const ROUNDED_UP: f64 = 1.0 + 1e-5;

/// The frames above a body, its own first.
fn frames_above(frames: &[Frame], first: Option<usize>) -> Vec<usize> {
    let mut above = Vec::new();
    let mut at = first;
    while let Some(frame) = at {
        above.push(frame);
        at = frames[frame].parent;
    }
    above
}

fn norm(v: &[f32; 3]) -> f64 {
    v.iter().map(|x| f64::from(*x) * f64::from(*x)).sum::<f64>().sqrt()
}

/// What one frame can do to a body.
struct Lever {
    frame: usize,
    /// How far the axis is from the centres of the body's balls at most; one for a joint that slides.
    reach: f64,
    /// How far the origin of the frame is from them at most.
    distance: f64,
}

impl ArmModel {
    /// What the frames above a body can do to it, the body's own frame first.
    fn levers(&self, body: &Body) -> Vec<Lever> {
        let centers = || self.balls[body.balls.clone()].iter().map(|ball| ball.center).chain([body.bound.center]);
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let flat = |c: &[f32; 3]| f64::from(c[0]).hypot(f64::from(c[1]));
        let mut reach = largest(&mut centers().map(|c| flat(&c)));
        let mut distance = largest(&mut centers().map(|c| norm(&c)));
        let mut levers = Vec::new();
        for index in frames_above(&self.frames, body.frame) {
            let frame = &self.frames[index];
            // How far a joint that slides carries what is on it.
            let slide = if frame.slides { self.largest_position(frame) } else { 0.0 };
            levers.push(Lever { frame: index, reach: if frame.slides { 1.0 } else { reach }, distance });
            reach = flat(&frame.translation) + distance + slide;
            distance += norm(&frame.translation) + slide;
        }
        levers
    }

    /// Largest size of the position of a frame's joint.
    fn largest_position(&self, frame: &Frame) -> f64 {
        let terms = frame.terms.iter().map(|&(k, multiplier)| {
            let c = &self.coordinates[k];
            f64::from(multiplier).abs() * c.lower.abs().max(c.upper.abs())
        });
        terms.sum::<f64>() + f64::from(frame.offset).abs()
    }

    fn speed_terms<'l>(&self, levers: impl Iterator<Item = &'l Lever>) -> Vec<SpeedTerm> {
        let mut terms: Vec<SpeedTerm> = Vec::new();
        for lever in levers {
            for &(coordinate, multiplier) in &self.frames[lever.frame].terms {
                let reach = (lever.reach * f64::from(multiplier).abs() * ROUNDED_UP) as f32;
                match terms.iter_mut().find(|term| term.coordinate == coordinate) {
                    Some(term) => term.reach += reach,
                    None => terms.push(SpeedTerm { coordinate, reach }),
                }
            }
        }
        terms
    }

    /// Fills in how fast bodies move, and which pairs have to be apart.
    pub(super) fn find_speeds_and_pairs(&mut self, may_touch: impl Fn(&Body, &Body) -> bool) {
        let levers: Vec<Vec<Lever>> = self.bodies.iter().map(|body| self.levers(body)).collect();
        for (index, own) in levers.iter().enumerate() {
            self.bodies[index].speed = self.speed_terms(own.iter());
        }
        let largest_radius =
            |body: &Body| self.balls[body.balls.clone()].iter().map(|ball| f64::from(ball.radius)).fold(0.0, f64::max);
        let radii: Vec<f64> = self.bodies.iter().map(largest_radius).collect();
        let mut pairs = Vec::new();
        for b in 0..self.bodies.len() {
            for a in 0..b {
                let [first, second] = [&self.bodies[a], &self.bodies[b]];
                if first.frame == second.frame {
                    continue;
                }
                // Joints that move one of the two only.
                let shared = levers[a].iter().rev().zip(levers[b].iter().rev());
                let n_common = shared.take_while(|(x, y)| x.frame == y.frame).count();
                let [own_a, own_b] = [a, b].map(|k| &levers[k][..levers[k].len() - n_common]);
                if self.never_meet([a, b], [own_a, own_b], &radii) || may_touch(first, second) {
                    continue;
                }
                let speed = self.speed_terms(own_a.iter().chain(own_b));
                pairs.push(Pair { bodies: [a, b], speed });
            }
        }
        self.pairs = pairs;
    }

    /// True where the balls that the two bodies stay in, seen from the frame that carries both, are apart.
    fn never_meet(&self, bodies: [usize; 2], own: [&[Lever]; 2], radii: &[f64]) -> bool {
        let stays_in = |k: usize| match own[k].last() {
            Some(lever) => {
                let frame = &self.frames[lever.frame];
                let slide = if frame.slides { self.largest_position(frame) } else { 0.0 };
                (frame.translation, lever.distance + slide + radii[bodies[k]])
            }
            None => {
                let bound = &self.bodies[bodies[k]].bound;
                (bound.center, f64::from(bound.radius))
            }
        };
        let ((a, reach_a), (b, reach_b)) = (stays_in(0), stays_in(1));
        let between = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        norm(&between) > (reach_a + reach_b) * ROUNDED_UP + 1e-4
    }
}
