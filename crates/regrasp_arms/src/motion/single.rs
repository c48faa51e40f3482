//! One configuration, with shapes in double precision.

use super::{Collider, Track};
use crate::lanes::{F8, LANES};
use crate::world::ExactShape;
use nalgebra::Matrix3;
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::{Pose, Shape, Vector};

/// What a body meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Partner {
    /// An obstacle, by its index.
    Obstacle(usize),
    /// Another body, by its index.
    Body(usize),
}

/// A body with what it meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The body, by its index.
    pub body: usize,
    /// What it meets.
    pub partner: Partner,
}

/// Memory.
#[derive(Debug, Default)]
pub struct Memory {
    frames: Vec<Pose>,
    bodies: Vec<Placement>,
    /// Obstacles near a body.
    near: Vec<u32>,
}

/// More than any rounding of single precision near a robot, in metres.
const SINGLE_ROUNDING: f64 = 1e-4;

impl Collider<'_> {
    /// The first body that is not proved to keep the clearance, in this configuration. None where all do.
    pub fn contact(&mut self, configuration: &[f64]) -> Option<Contact> {
        let none = |_: usize| 0.0;
        let clearance = self.settings.clearance;
        self.contact_within(configuration, none, none, clearance)
    }

    /// The first body that is not farther from something than both can move, plus `clearance`.
    fn contact_within(
        &mut self,
        configuration: &[f64],
        sway: impl Fn(usize) -> f64,
        pair_sway: impl Fn(usize) -> f64,
        clearance: f64,
    ) -> Option<Contact> {
        self.counts.exact += 1;
        let mut memory = std::mem::take(&mut self.single);
        self.model.frame_poses(configuration, &mut memory.frames);
        memory.bodies.clear();
        let placement = |frame: Option<usize>| frame.map_or(Placement::IDENTITY, |f| (&memory.frames[f]).into());
        memory.bodies.extend(self.model.bodies.iter().map(|body| placement(body.frame)));
        let found = self.first_contact((&memory.bodies, &mut memory.near), sway, pair_sway, clearance);
        self.single = memory;
        found
    }

    fn first_contact(
        &self,
        (places, near): (&[Placement], &mut Vec<u32>),
        sway: impl Fn(usize) -> f64,
        pair_sway: impl Fn(usize) -> f64,
        clearance: f64,
    ) -> Option<Contact> {
        for &body in &self.exposed {
            let body = body as usize;
            let required = sway(body) + clearance;
            // Obstacles whose box is farther from the body's ball are farther from the body.
            let bound = &self.model.bodies[body].bound;
            let (center, reach) = (places[body].point(&bound.center.map(f64::from).into()), f64::from(bound.radius));
            let corner = |sign: f64| {
                let room = sign * (reach + required + SINGLE_ROUNDING);
                [center.x + room, center.y + room, center.z + room].map(|x| x as f32)
            };
            self.world.near(corner(-1.0), corner(1.0), near);
            for obstacle in near.iter().map(|&obstacle| obstacle as usize) {
                if !self.is_apart_from(body, &places[body], &self.world.exact[obstacle], required) {
                    return Some(Contact { body, partner: Partner::Obstacle(obstacle) });
                }
            }
        }
        for &pair in &self.pairs {
            let [a, b] = self.model.pairs[pair as usize].bodies;
            if !self.are_apart([a, b], [&places[a], &places[b]], pair_sway(pair as usize) + clearance) {
                return Some(Contact { body: a, partner: Partner::Body(b) });
            }
        }
        None
    }

    /// Of the configurations in `bits`: those in which a body is not proved to be farther than `reach` from an obstacle, by its shapes.
    #[inline(never)]
    pub(super) fn near_obstacle(&mut self, body: usize, obstacle: usize, bits: u8, reach: F8) -> u8 {
        let mut near = 0;
        for lane in (0..LANES).filter(|lane| bits >> lane & 1 == 1) {
            self.counts.exact += 1;
            let (at, reach) = (self.placement(body, lane), f64::from(reach.0[lane]));
            let is_apart = self.is_apart_from(body, &at, &self.world.exact[obstacle], reach);
            near |= u8::from(!is_apart) << lane;
        }
        near
    }

    /// The same for two bodies.
    #[inline(never)]
    pub(super) fn near_body(&mut self, bodies: [usize; 2], bits: u8, reach: F8) -> u8 {
        let mut near = 0;
        for lane in (0..LANES).filter(|lane| bits >> lane & 1 == 1) {
            self.counts.exact += 1;
            let at = bodies.map(|body| self.placement(body, lane));
            let is_apart = self.are_apart(bodies, [&at[0], &at[1]], f64::from(reach.0[lane]));
            near |= u8::from(!is_apart) << lane;
        }
        near
    }

    /// True where a body is proved to be farther than `required` from an obstacle.
    pub(crate) fn is_apart_from(&self, body: usize, at: &Placement, exact: &ExactShape, required: f64) -> bool {
        let of_model = &self.model.bodies[body];
        let ball = |center: [f32; 3]| Placement {
            rotation: Matrix3::identity(),
            translation: at.point(&center.map(f64::from).into()).coords,
        };
        let bound = Shape::Sphere { radius: f64::from(of_model.bound.radius) };
        if exact.is_apart(&bound, &ball(of_model.bound.center), required) {
            return true;
        }
        of_model.shapes.iter().all(|placed| {
            let at = at.then(&(&placed.parent_from_shape).into());
            exact.is_apart(&placed.shape, &at, required)
        })
    }

    /// True where two bodies are proved to be farther than `required` from each other.
    pub(crate) fn are_apart(&self, bodies: [usize; 2], at: [&Placement; 2], required: f64) -> bool {
        let of_model = bodies.map(|body| &self.model.bodies[body]);
        let centers = [0, 1].map(|k| at[k].point(&of_model[k].bound.center.map(f64::from).into()));
        let radii = f64::from(of_model[0].bound.radius) + f64::from(of_model[1].bound.radius);
        if (centers[0] - centers[1]).norm() > radii + required {
            return true;
        }
        of_model[0].shapes.iter().all(|first| {
            let at_first = at[0].then(&(&first.parent_from_shape).into());
            of_model[1].shapes.iter().all(|second| {
                let at_second = at[1].then(&(&second.parent_from_shape).into());
                let found = separation(
                    Placed { shape: &first.shape, at: &at_first },
                    Placed { shape: &second.shape, at: &at_second },
                    required.max(1e-12),
                    required.max(1e-12),
                    &mut Vector::zeros(),
                    &mut [0; 2],
                );
                matches!(found, Separation::SeparatedBy(_))
            })
        })
    }

    /// True where shapes prove that an interval of a motion is free: its middle, and its half.
    pub(super) fn is_interval_exactly_free(&mut self, track: &Track, [middle, half]: [f32; 2]) -> bool {
        let (middle, half) = (f64::from(middle), f64::from(half) + 2e-7);
        let configuration = track.at(middle);
        let n = self.model.dimension();
        let largest: Vec<f64> = (0..n).map(|k| f64::from(track.largest(k)[0])).collect();
        let model = self.model;
        let speed = |terms: &[crate::model::SpeedTerm]| {
            terms.iter().map(|term| f64::from(term.reach) * largest[term.coordinate]).sum::<f64>()
        };
        let body_sways: Vec<f64> = model.bodies.iter().map(|body| half * speed(&body.speed)).collect();
        let pair_sways: Vec<f64> = model.pairs.iter().map(|pair| half * speed(&pair.speed)).collect();
        let clearance = self.settings.clearance;
        self.contact_within(&configuration, |body| body_sways[body], |pair| pair_sways[pair], clearance).is_none()
    }
}
