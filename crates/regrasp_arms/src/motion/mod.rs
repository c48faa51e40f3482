//! Are motions free? Sampled at a step, or certified at every moment.

/// Every moment of a motion.
mod certified;
/// Where bodies are, in eight configurations.
mod kinematics;
/// Configurations at a step.
mod sampled;
/// One configuration, with shapes in double precision.
mod single;
/// Motions: straight, or cubic.
pub mod track;

use crate::lanes::{F8, V8};
use crate::model::ArmModel;
use crate::world::World;
use kinematics::{FrameBlock, VelocityBlock};

pub use single::{Contact, Partner};
pub use track::Track;

/// How motions are tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColliderSettings {
    /// Sampled motions: configurations per unit of the joints' Euclidean distance.
    pub resolution: f64,
    /// Distance that bodies keep from each other and from obstacles, in metres.
    pub clearance: f64,
    /// Certified motions: what is not decided when bodies move less than this counts as collision, in metres.
    pub least_step: f64,
}

impl Default for ColliderSettings {
    fn default() -> Self {
        ColliderSettings { resolution: 32.0, clearance: 0.0, least_step: 1e-4 }
    }
}

/// How much was looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Blocks of eight configurations.
    pub blocks: u64,
    /// Motions.
    pub motions: u64,
    /// Configurations looked at with shapes in double precision.
    pub exact: u64,
}

/// Tests motions of one robot in one world. Has memory of its own: one for each thread.
#[derive(Debug)]
pub struct Collider<'a> {
    /// The robot.
    pub model: &'a ArmModel,
    /// What stands around it.
    pub world: &'a World,
    /// Settings.
    pub settings: ColliderSettings,
    /// How much was looked at.
    pub counts: Counts,
    arch: pulp::Arch,
    /// Joint values.
    q: Vec<F8>,
    /// Joint velocities.
    rates: Vec<F8>,
    frames: Vec<FrameBlock>,
    velocities: Vec<VelocityBlock>,
    /// Centres of the bodies' bounds.
    bounds: Vec<V8>,
    /// How far each body may move until the next moment that is looked at.
    sways: Vec<F8>,
    balls: Vec<V8>,
    group_bounds: Vec<V8>,
    /// By body: the block in which the bounds of its groups were placed last.
    placed: Vec<u64>,
    /// By group: the block in which its balls were placed last.
    placed_groups: Vec<u64>,
    block: u64,
    /// By body: obstacles that a motion may meet.
    near: Vec<Vec<u32>>,
    found: Vec<u32>,
    /// Groups of two bodies that may meet.
    close_groups: Vec<[usize; 2]>,
    /// Pairs that may meet in a motion.
    close: Vec<u32>,
    /// By body and pair: metres per unit of the motion's parameter.
    body_speeds: Vec<f32>,
    pair_speeds: Vec<f32>,
    /// By body: metres per unit squared.
    bends: Vec<f32>,
    /// Pairs that are tested, by index.
    pairs: Vec<u32>,
    /// Bodies that are tested against obstacles.
    exposed: Vec<u32>,
    intervals: Vec<certified::Interval>,
    single: single::Memory,
}

impl<'a> Collider<'a> {
    /// All pairs and bodies of `model` in `world`.
    pub fn new(model: &'a ArmModel, world: &'a World, settings: ColliderSettings) -> Self {
        let n = model.bodies.len();
        let moves = |body: &usize| model.bodies[*body].frame.is_some();
        Collider {
            model,
            world,
            settings,
            counts: Counts::default(),
            arch: pulp::Arch::new(),
            q: vec![F8::ZERO; model.dimension()],
            rates: vec![F8::ZERO; model.dimension()],
            frames: vec![FrameBlock::WORLD; model.frames.len()],
            velocities: vec![VelocityBlock::REST; model.frames.len()],
            bounds: vec![[F8::ZERO; 3]; n],
            sways: vec![F8::ZERO; n],
            balls: vec![[F8::ZERO; 3]; model.balls.len()],
            group_bounds: vec![[F8::ZERO; 3]; model.groups.len()],
            placed: vec![0; n],
            placed_groups: vec![0; model.groups.len()],
            block: 0,
            near: vec![Vec::new(); n],
            found: Vec::new(),
            close_groups: Vec::new(),
            close: Vec::new(),
            body_speeds: vec![0.0; n],
            pair_speeds: vec![0.0; model.pairs.len()],
            bends: vec![0.0; n],
            pairs: (0..model.pairs.len() as u32).collect(),
            exposed: (0..n).filter(moves).map(|body| body as u32).collect(),
            intervals: Vec::new(),
            single: single::Memory::default(),
        }
    }

    /// Tests only what is asked for: bodies against obstacles, and pairs of bodies.
    pub fn only(&mut self, exposed: impl Fn(usize) -> bool, pair: impl Fn([usize; 2]) -> bool) {
        let model = self.model;
        let moving = |body: &u32| model.bodies[*body as usize].frame.is_some() && exposed(*body as usize);
        self.exposed = (0..model.bodies.len() as u32).filter(moving).collect();
        self.pairs = (0..model.pairs.len() as u32).filter(|&index| pair(model.pairs[index as usize].bodies)).collect();
    }

    /// True where the straight motion is free at a step of the resolution, its first configuration left out. Balls only.
    pub fn is_sampled_free(&mut self, from: &[f64], to: &[f64]) -> bool {
        let arch = self.arch;
        arch.dispatch(Sampled { collider: self, from, to })
    }

    /// For each of the configurations: true where it is proved to keep the clearance.
    pub fn are_free(&mut self, configurations: &[Vec<f64>]) -> Vec<bool> {
        let mut free = Vec::with_capacity(configurations.len());
        for block in configurations.chunks(crate::lanes::LANES) {
            let arch = self.arch;
            let bits =
                arch.dispatch(Unfree { collider: self, configurations: block.iter().map(Vec::as_slice).collect() });
            free.extend((0..block.len()).map(|l| bits >> l & 1 == 0));
        }
        free
    }

    /// True where no body meets another one or an obstacle at any moment of the motion. What is not decided counts as collision.
    pub fn is_certified_free(&mut self, track: &Track) -> bool {
        self.are_certified_free(std::slice::from_ref(track))
    }

    /// The same for all of some motions: sooner than one by one where they are short.
    pub fn are_certified_free(&mut self, tracks: &[Track]) -> bool {
        let arch = self.arch;
        arch.dispatch(Certified { collider: self, tracks })
    }
}

/// A test that is compiled for the vector instructions of the machine.
struct Sampled<'c, 'a, 'q> {
    collider: &'c mut Collider<'a>,
    from: &'q [f64],
    to: &'q [f64],
}

impl pulp::NullaryFnOnce for Sampled<'_, '_, '_> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.collider.sampled(self.from, self.to)
    }
}

/// As [`Sampled`].
struct Unfree<'c, 'a, 'q> {
    collider: &'c mut Collider<'a>,
    configurations: Vec<&'q [f64]>,
}

impl pulp::NullaryFnOnce for Unfree<'_, '_, '_> {
    type Output = u8;

    #[inline(always)]
    fn call(self) -> u8 {
        self.collider.unfree(&self.configurations)
    }
}

/// As [`Sampled`].
struct Certified<'c, 'a, 't> {
    collider: &'c mut Collider<'a>,
    tracks: &'t [Track],
}

impl pulp::NullaryFnOnce for Certified<'_, '_, '_> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.collider.certified(self.tracks)
    }
}
