//! Where bodies are, in eight configurations.

use super::Collider;
use crate::lanes::{F8, V8, minus, squared};
use nalgebra::Matrix3;
use regrasp_geometry::Vector;
use regrasp_geometry::collision::Placement;

/// A moving frame in eight configurations.
#[derive(Debug, Clone, Copy)]
pub struct FrameBlock {
    /// Columns of its rotation.
    axes: [V8; 3],
    origin: V8,
}

/// How a frame moves in eight configurations.
#[derive(Debug, Clone, Copy)]
pub struct VelocityBlock {
    /// Angular velocity.
    turn: V8,
    /// Velocity of its origin.
    velocity: V8,
}

const NOTHING: V8 = [F8::ZERO; 3];

impl FrameBlock {
    /// The frame of the world.
    pub const WORLD: FrameBlock = {
        let (o, i) = (F8([0.0; 8]), F8([1.0; 8]));
        FrameBlock { axes: [[i, o, o], [o, i, o], [o, o, i]], origin: [o; 3] }
    };

    /// The vector with these components in the frame.
    #[inline(always)]
    fn vector(&self, v: &[f32; 3]) -> V8 {
        let mut out = NOTHING;
        for k in 0..3 {
            // Frames of robots are full of zeros.
            if v[k] != 0.0 {
                for i in 0..3 {
                    out[i] = out[i] + self.axes[k][i] * v[k];
                }
            }
        }
        out
    }

    /// The point with these coordinates in the frame.
    #[inline(always)]
    fn point(&self, p: &[f32; 3]) -> V8 {
        let mut out = self.origin;
        for i in 0..3 {
            out[i] = out[i] + self.axes[0][i] * p[0] + self.axes[1][i] * p[1] + self.axes[2][i] * p[2];
        }
        out
    }
}

impl VelocityBlock {
    /// Rest.
    pub const REST: VelocityBlock = VelocityBlock { turn: NOTHING, velocity: NOTHING };
}

#[inline(always)]
fn cross(a: &V8, b: &V8) -> V8 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn plus(a: &V8, b: &V8) -> V8 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

impl Collider<'_> {
    /// Places all frames, for the joint values in `q`.
    #[inline(always)]
    pub(super) fn place_frames(&mut self) {
        self.block += 1;
        self.counts.blocks += 1;
        for (index, frame) in self.model.frames.iter().enumerate() {
            let (before, rest) = self.frames.split_at_mut(index);
            let (parent, placed) = (frame.parent.map_or(&FrameBlock::WORLD, |parent| &before[parent]), &mut rest[0]);
            let mut position = F8::splat(frame.offset);
            for &(k, multiplier) in &frame.terms {
                position = position + self.q[k] * multiplier;
            }
            placed.origin = plus(&parent.origin, &parent.vector(&frame.translation));
            let x = parent.vector(&frame.rotation[0]);
            let y = parent.vector(&frame.rotation[1]);
            placed.axes[2] = parent.vector(&frame.rotation[2]);
            if frame.slides {
                (placed.axes[0], placed.axes[1]) = (x, y);
                for i in 0..3 {
                    placed.origin[i] = placed.origin[i] + placed.axes[2][i] * position;
                }
            } else {
                let (sine, cosine) = position.sin_cos();
                for i in 0..3 {
                    placed.axes[0][i] = x[i] * cosine + y[i] * sine;
                    placed.axes[1][i] = y[i] * cosine - x[i] * sine;
                }
            }
        }
    }

    /// Velocities of all placed frames, for the joint velocities in `rates`.
    #[inline(always)]
    pub(super) fn find_velocities(&mut self) {
        for (index, frame) in self.model.frames.iter().enumerate() {
            let (before, rest) = self.velocities.split_at_mut(index);
            let own = &mut rest[0];
            let (parent, above) = match frame.parent {
                Some(parent) => (&self.frames[parent], &before[parent]),
                None => (&FrameBlock::WORLD, &VelocityBlock::REST),
            };
            let mut rate = F8::ZERO;
            for &(k, multiplier) in &frame.terms {
                rate = rate + self.rates[k] * multiplier;
            }
            let placed = &self.frames[index];
            let arm = minus(&placed.origin, &parent.origin);
            own.velocity = plus(&above.velocity, &cross(&above.turn, &arm));
            own.turn = above.turn;
            let changed = if frame.slides { &mut own.velocity } else { &mut own.turn };
            for i in 0..3 {
                changed[i] = changed[i] + placed.axes[2][i] * rate;
            }
        }
    }

    /// Places the centre of a body's bound.
    #[inline(always)]
    pub(super) fn place_bound(&mut self, body: usize) -> V8 {
        let of_model = &self.model.bodies[body];
        let frame = of_model.frame.map_or(&FrameBlock::WORLD, |frame| &self.frames[frame]);
        let center = frame.point(&of_model.bound.center);
        self.bounds[body] = center;
        center
    }

    /// How far the balls' centres of a body move within `half` of the parameter at most.
    #[inline(always)]
    pub(super) fn sway(&self, body: usize, half: F8) -> F8 {
        let of_model = &self.model.bodies[body];
        let Some(frame) = of_model.frame else { return F8::ZERO };
        let moving = &self.velocities[frame];
        let arm = minus(&self.bounds[body], &self.frames[frame].origin);
        let velocity = plus(&moving.velocity, &cross(&moving.turn, &arm));
        let speed = squared(&velocity).sqrt() + squared(&moving.turn).sqrt() * of_model.bound.radius;
        // Single precision.
        (speed * half + half * half * (0.5 * self.bends[body])) * 1.00001
    }

    /// Where a body is in one of the eight configurations, within the rounding of single precision.
    pub(super) fn placement(&self, body: usize, lane: usize) -> Placement {
        let Some(frame) = self.model.bodies[body].frame else { return Placement::IDENTITY };
        let frame = &self.frames[frame];
        let vector = |v: &V8| Vector::new(f64::from(v[0].0[lane]), f64::from(v[1].0[lane]), f64::from(v[2].0[lane]));
        let columns = [vector(&frame.axes[0]), vector(&frame.axes[1]), vector(&frame.axes[2])];
        Placement { rotation: Matrix3::from_columns(&columns), translation: vector(&frame.origin) }
    }

    /// Places the middles of the groups of a body's balls, once in a block.
    #[inline(always)]
    pub(super) fn place_groups(&mut self, body: usize) {
        if self.placed[body] == self.block {
            return;
        }
        self.placed[body] = self.block;
        let of_model = &self.model.bodies[body];
        let frame = of_model.frame.map_or(&FrameBlock::WORLD, |frame| &self.frames[frame]);
        for index in of_model.groups.clone() {
            self.group_bounds[index] = frame.point(&self.model.groups[index].bound.center);
        }
    }

    /// Places the balls of a group of a body, once in a block.
    #[inline(always)]
    pub(super) fn place_balls(&mut self, body: usize, group: usize) {
        if self.placed_groups[group] == self.block {
            return;
        }
        self.placed_groups[group] = self.block;
        let frame = self.model.bodies[body].frame.map_or(&FrameBlock::WORLD, |frame| &self.frames[frame]);
        for index in self.model.groups[group].balls.clone() {
            self.balls[index] = frame.point(&self.model.balls[index].center);
        }
    }
}
