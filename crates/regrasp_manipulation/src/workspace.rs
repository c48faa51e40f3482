//! One configuration of hand and object at a time, and continuous collision tests of the step to the next.
//!
//! A step moves every joint linearly and the object by `interpolate_pose`. Along it each point of a body stays within a
//! known deviation of the straight line between its two end positions. So if one direction separates two bodies at both
//! ends by more than their deviations, it separates them all along: two support evaluations prove a step. Where bodies
//! are far apart the distance known from before, less what both have moved since, proves it for nothing.

/// One or two fingers, whatever the others do.
mod alone;
/// Where everything is at one moment.
mod configuration;
/// Directions that separate pairs.
mod directions;
/// What draws of contacts cost.
mod draws;
/// Obstacles near the bodies that move.
mod nearby;
/// How far tips may be from where they rest.
mod reach;
/// What is nearer at the start than the clearance.
pub mod start;
/// A fingertip in contact keeps to the surface.
mod tip_clear;
/// What is in the way of contacts.
pub mod tried;

use crate::forces::limits::Refusals;
use crate::grasp::state::{Contacts, GraspState, HandJoints};
use crate::model::{Carrier, Model, Pair};
use crate::passing::{PassingOver, RrtRuns};
use configuration::{Configuration, midway, place_finger, place_object};
use draws::Draws;
use nearby::Nearby;
use regrasp_geometry::collision::{Placed, Placement, Separation, gap_along, separation};
use regrasp_geometry::{Pose, Vector, frame};
use regrasp_robot::kinematics::finger_ik::Coordinates;
use tried::Tried;

/// What the fingertips do during a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TipMode {
    /// The tips of fingers that hold may press into the object by the contact allowance, along their normals; those of
    /// free ones keep clear of it.
    AllHold,
    /// One finger is leaving or reaching the contact with this outward normal, in the world.
    Near {
        /// The finger.
        finger: usize,
        /// Outward normal of the object at the contact.
        normal_in_world: Vector,
    },
    /// One finger is away and keeps this clearance; the others hold.
    Away {
        /// The finger.
        finger: usize,
        /// Distance that its tip keeps from the object, in metres.
        clearance: f64,
    },
}

/// Largest number of times a step is halved before it counts as a collision.
const MAX_HALVINGS: u32 = 4;
/// Directions tried between two that each separate at one end of a step.
const MAX_BETWEEN: usize = 5;
/// Separation beyond which a search for a better direction stops, in metres.
const ENOUGH: f64 = 0.004;

/// Where `next` may differ from `now`, besides what the coming step changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stale {
    Nothing,
    Finger(usize),
    Everything,
}

/// Scratch memory of one search thread.
#[derive(Debug)]
pub struct Workspace<'a> {
    /// The scene, prepared.
    pub model: &'a Model<'a>,
    now: Configuration,
    next: Configuration,
    stale: Stale,
    /// False in a test of a step: what was outside a mesh where it began, and crosses no triangle, is outside all along.
    stands: bool,
    /// Pairs that something is known of: those of the model, then those with obstacles that were ever near.
    pairs: Vec<Pair>,
    /// Which obstacles are near.
    nearby: Nearby,
    /// Obstacles to be tested just now.
    hits: Vec<u32>,
    /// Direction that last separated each pair, from `a` to `b`: in the frame of the object where it is one of them, else in
    /// the world. Near the object it is a normal of its surface, which turns with it.
    directions: Vec<Vector>,
    hints: Vec<[u32; 2]>,
    /// Lower bound of each pair's distance now.
    slack: Vec<f64>,
    /// How far each body but obstacles moves at most in the current step.
    motion: Vec<f64>,
    /// How far its points stray at most from straight lines in the current step.
    deviation: Vec<f64>,
    contacts: Contacts,
    /// Fingers that are free, as bits.
    free: u32,
    /// Iterations of RRT-Connect that a relocation is worth just now.
    pub rrt_iterations: usize,
    /// How a finger passes from above one contact to above another.
    pub passing_over: PassingOver,
    /// Runs of RRT-Connect so far, and those of them that found nothing.
    pub rrt_runs: RrtRuns,
    /// Configurations looked at, and what draws of contacts cost beside.
    pub work: u64,
    /// True where every finger may find contacts by closing, and not only those that reach no points.
    pub all_close: bool,
    /// What draws of contacts cost.
    pub draws: Draws,
    /// Contacts that fingers came to, and what was in the way there.
    pub tried: Tried,
    /// Grasps refused for want of forces.
    pub refusals: Refusals,
    /// The pair that stopped the last failed step.
    pub blocking_pair: Option<Pair>,
    /// Its index in `pairs`.
    blocking_index: usize,
}

impl<'a> Workspace<'a> {
    /// Fresh scratch memory for `model`.
    pub fn new(model: &'a Model<'a>) -> Self {
        let bodies = &model.bodies[..model.first_obstacle()];
        let placements: Vec<Placement> = bodies.iter().map(|body| body.carrier_from_body).collect();
        let joints = model.view.hand.fingers.iter().map(|finger| finger.rest.iter().copied().collect()).collect();
        let centers = bodies.iter().map(|body| body.carrier_from_body.point(&body.center)).collect();
        let now = Configuration { joints, world_from_object: Pose::identity(), placements, centers };
        Workspace {
            next: now.clone(),
            stale: Stale::Nothing,
            stands: true,
            now,
            pairs: model.pairs.clone(),
            nearby: Nearby::new(model),
            hits: Vec::new(),
            directions: vec![Vector::zeros(); model.pairs.len()],
            hints: vec![[0; 2]; model.pairs.len()],
            slack: vec![f64::NEG_INFINITY; model.pairs.len()],
            motion: vec![0.0; bodies.len()],
            deviation: vec![0.0; bodies.len()],
            contacts: Contacts::new(),
            free: 0,
            rrt_iterations: model.settings.rrt_iterations,
            passing_over: PassingOver::SurfaceFirst,
            rrt_runs: RrtRuns::default(),
            work: 0,
            all_close: false,
            draws: Draws::default(),
            tried: Tried::default(),
            refusals: Refusals::default(),
            blocking_pair: None,
            blocking_index: 0,
            model,
        }
    }

    /// Goes to a state, without any test.
    pub fn set_state(&mut self, state: &GraspState) {
        self.set_held(&state.world_from_object, &state.joints, &state.contacts, state.holding);
    }

    /// Goes to a configuration in which all fingers hold, without any test. `contacts` are where.
    pub fn set(&mut self, world_from_object: &Pose, joints: &HandJoints, contacts: &Contacts) {
        self.set_held(world_from_object, joints, contacts, self.model.all_fingers());
    }

    /// Goes to a configuration, without any test. `contacts` are where the fingers of `holding` hold.
    pub fn set_held(&mut self, world_from_object: &Pose, joints: &HandJoints, contacts: &Contacts, holding: u32) {
        self.contacts.clone_from(contacts);
        self.free = self.model.all_fingers() & !holding;
        self.blocking_pair = None;
        place_object(self.model, &mut self.now, world_from_object);
        for finger in 0..self.model.n_fingers() {
            place_finger(self.model, &mut self.now, finger, &joints[finger]);
        }
        self.forget_slack();
        self.stale = Stale::Everything;
    }

    /// The coming step ends with these contacts: fingertips roll.
    pub fn roll_to(&mut self, contacts: &Contacts) {
        self.contacts.clone_from(contacts);
    }

    /// Makes `next` the same as `now`, but for a finger that is placed afresh anyway.
    fn align(&mut self, except: Option<usize>) {
        match self.stale {
            Stale::Nothing => {}
            Stale::Finger(finger) if Some(finger) == except => {}
            Stale::Finger(finger) => {
                self.next.joints[finger].clone_from(&self.now.joints[finger]);
                let bodies = self.model.fingers[finger].bodies.clone();
                self.next.placements[bodies.clone()].copy_from_slice(&self.now.placements[bodies.clone()]);
                self.next.centers[bodies.clone()].copy_from_slice(&self.now.centers[bodies]);
            }
            Stale::Everything => self.next.clone_from(&self.now),
        }
        self.stale = Stale::Nothing;
    }

    /// Puts one finger somewhere, without any test.
    pub fn set_finger(&mut self, finger: usize, joints: &Coordinates) {
        self.stale = match self.stale {
            Stale::Nothing => Stale::Finger(finger),
            Stale::Finger(other) if other == finger => self.stale,
            _ => Stale::Everything,
        };
        place_finger(self.model, &mut self.now, finger, joints);
        for &pair in &self.model.fingers[finger].pairs {
            self.slack[pair] = f64::NEG_INFINITY;
        }
        self.nearby.forget(self.model.fingers[finger].bodies.clone());
    }

    /// Puts the object somewhere, without any test; what pairs knew of each other is forgotten.
    pub fn place_object(&mut self, world_from_object: &Pose) {
        place_object(self.model, &mut self.now, world_from_object);
        place_object(self.model, &mut self.next, world_from_object);
        self.forget_slack();
    }

    /// Puts the object and one finger somewhere, without any test.
    pub fn place_object_and_finger(&mut self, world_from_object: &Pose, finger: usize, joints: &Coordinates) {
        self.place_object(world_from_object);
        self.set_finger(finger, joints);
    }

    /// Tested next is where everything is now, not a step.
    fn stand(&mut self) {
        self.work += 1;
        self.align(None);
        self.motion.fill(0.0);
        self.deviation.fill(0.0);
        self.stands = true;
    }

    /// True when no pair is too near now, and no tip too far away.
    pub fn is_clear(&mut self, mode: TipMode) -> bool {
        self.stand();
        self.is_within_reach(None) && self.all_are_clear(None, mode)
    }

    /// True when no pair of one finger is too near now, and its tip not too far away.
    pub fn finger_is_clear(&mut self, finger: usize, mode: TipMode) -> bool {
        self.stand();
        self.is_within_reach(Some(finger)) && self.all_are_clear(Some(finger), mode)
    }

    /// Moves everything to the next configuration if the step is clear; stays otherwise.
    pub fn step(&mut self, world_from_object: &Pose, joints: &HandJoints, mode: TipMode) -> bool {
        place_object(self.model, &mut self.next, world_from_object);
        for finger in 0..self.model.n_fingers() {
            place_finger(self.model, &mut self.next, finger, &joints[finger]);
        }
        self.stale = Stale::Everything;
        self.try_step(None, mode, MAX_HALVINGS)
    }

    /// Goes to a configuration with other contacts; true when it is clear.
    ///
    /// What lies between is not tested: contacts that slide are no motion that is carried out (paths in GS_n, Saut 2011,
    /// sec. 4.1). How far bodies move only spares tests of what is far apart.
    pub fn slide(&mut self, world_from_object: &Pose, joints: &HandJoints, contacts: &Contacts) -> bool {
        self.contacts.clone_from(contacts);
        place_object(self.model, &mut self.next, world_from_object);
        for finger in 0..self.model.n_fingers() {
            place_finger(self.model, &mut self.next, finger, &joints[finger]);
        }
        self.bound_motion(None);
        for (slack, pair) in self.slack.iter_mut().zip(&self.model.pairs) {
            *slack -= self.motion[pair.a] + self.motion[pair.b];
        }
        self.nearby.drift(&self.motion);
        self.now.clone_from(&self.next);
        self.stale = Stale::Nothing;
        self.stand();
        self.is_within_reach(None) && self.all_are_clear(None, TipMode::AllHold)
    }

    /// Moves one finger if the step is clear; stays otherwise.
    pub fn step_finger(&mut self, finger: usize, joints: &Coordinates, mode: TipMode) -> bool {
        self.align(Some(finger));
        self.stale = Stale::Finger(finger);
        place_finger(self.model, &mut self.next, finger, joints);
        self.try_step(Some(finger), mode, MAX_HALVINGS)
    }

    /// Tests the step from `now` to `next`; on success `now` becomes `next`. Only pairs of `moving` are looked at.
    fn try_step(&mut self, moving: Option<usize>, mode: TipMode, halvings: u32) -> bool {
        self.work += 1;
        self.stands = false;
        self.bound_motion(moving);
        let model = self.model;
        let is_within_reach = self.is_within_reach(moving);
        if is_within_reach && self.all_are_clear(moving, mode) {
            std::mem::swap(&mut self.now, &mut self.next);
            return true;
        }
        // Pairs tested before the one that failed have their slack at `next`; it is not known at `now` any more.
        self.forget_slack();
        if !is_within_reach || halvings == 0 || !self.end_is_clear(self.blocking_index, mode) {
            return false;
        }
        self.stale = Stale::Everything;
        let (start, goal) = (self.now.clone(), self.next.clone());
        self.next = midway(model, &start, &goal);
        if self.try_step(moving, mode, halvings - 1) {
            self.next = goal;
            if self.try_step(moving, mode, halvings - 1) {
                return true;
            }
        }
        self.now = start;
        self.forget_slack();
        false
    }

    /// True when the pair is clear at `next` by itself: only then can shorter steps help.
    fn end_is_clear(&mut self, pair: usize, mode: TipMode) -> bool {
        self.motion.fill(0.0);
        self.deviation.fill(0.0);
        self.slack[pair] = f64::NEG_INFINITY;
        // Hollows are narrow beside long steps: there the triangles are asked about the end alone.
        self.stands = self.model.folds;
        let is_clear = self.pair_is_clear(pair, mode);
        self.stands = false;
        self.slack[pair] = f64::NEG_INFINITY;
        is_clear
    }

    /// Fills `motion` and `deviation` for the step from `now` to `next`.
    fn bound_motion(&mut self, moving: Option<usize>) {
        let model = self.model;
        match moving {
            None => {
                for finger in 0..model.n_fingers() {
                    self.bound_finger_motion(finger);
                }
                let turn = frame::rotation_between(&self.now.world_from_object, &self.next.world_from_object).norm();
                let object = model.object;
                // A point at distance r from the origin turns with acceleration turn^2 r per unit time squared.
                self.deviation[object] = turn * turn * model.object_reach / 8.0;
                let body = &model.bodies[object];
                self.motion[object] =
                    self.now.placements[object].displacement(&self.next.placements[object], &body.center, body.radius)
                        + self.deviation[object];
            }
            Some(finger) => {
                self.motion.fill(0.0);
                self.deviation.fill(0.0);
                self.bound_finger_motion(finger);
            }
        }
    }

    fn bound_finger_motion(&mut self, finger: usize) {
        let mut change = Coordinates::new();
        for (a, b) in self.now.joints[finger].iter().zip(&self.next.joints[finger]) {
            change.push((b - a).abs());
        }
        for index in self.model.fingers[finger].bodies.clone() {
            let body = &self.model.bodies[index];
            let Carrier::Finger { bound, .. } = &body.carrier else { unreachable!("bodies of a finger") };
            self.deviation[index] = bound.chord_deviation(&change);
            self.motion[index] =
                self.now.placements[index].displacement(&self.next.placements[index], &body.center, body.radius)
                    + self.deviation[index];
        }
    }

    /// True when all pairs that a motion of `moving`, or of everything, can bring together stay apart during the step, in the
    /// order of [`Pair`]; ends at the first that does not.
    #[inline]
    fn all_are_clear(&mut self, moving: Option<usize>, mode: TipMode) -> bool {
        let model = self.model;
        match moving {
            Some(finger) => {
                let moving = &model.fingers[finger];
                let test = |this: &mut Self, k: usize| this.pair_is_clear(moving.pairs[k], mode);
                self.in_turn(moving.pairs.len(), &moving.turns, mode, test)
            }
            None => self.in_turn(model.pairs.len(), &model.turns, mode, |this, k| this.pair_is_clear(k, mode)),
        }
    }

    /// How far points of a body stray at most from straight lines in the current step.
    #[inline]
    fn deviation_of(&self, body: usize) -> f64 {
        self.deviation.get(body).copied().unwrap_or(0.0)
    }

    /// True when the pair stays apart during the step from `now` to `next`; its slack is then the one at `next`.
    #[inline]
    fn pair_is_clear(&mut self, index: usize, mode: TipMode) -> bool {
        let model = self.model;
        let Some(&Some(bodies)) = model.usual.get(index) else { return self.near_pair_is_clear(index, mode) };
        let [a, b] = bodies.map(usize::from);
        // Most pairs are far apart: of them nothing is looked at but their balls.
        let motion = self.motion[a] + self.motion[b];
        if self.slack[index] - motion > model.settings.clearance {
            self.slack[index] -= motion;
            return true;
        }
        let between = self.between_balls(a, b);
        if between > model.settings.clearance + motion {
            self.slack[index] = between;
            return true;
        }
        self.near_pair_is_clear(index, mode)
    }

    /// Distance between the bounding balls of two bodies at `next`.
    #[inline]
    fn between_balls(&self, a: usize, b: usize) -> f64 {
        let model = self.model;
        (self.next.center(model, a) - self.next.center(model, b)).norm() - model.radii[a] - model.radii[b]
    }

    /// What [`Workspace::pair_is_clear`] says, of a pair that may be near.
    fn near_pair_is_clear(&mut self, index: usize, mode: TipMode) -> bool {
        let pair = self.pairs[index];
        // Obstacles do not move, and are never first.
        let motion = self.motion[pair.a] + self.motion.get(pair.b).copied().unwrap_or(0.0);
        let is_free_tip = pair.tip_of.is_some_and(|finger| self.free & (1 << finger) != 0);
        let usual = if is_free_tip { self.model.free_clearance() } else { self.model.settings.clearance };
        let kept = self.model.kept.get(index).copied().unwrap_or(f64::INFINITY);
        let required = usual.min(kept);
        self.slack[index] -= motion;
        if self.slack[index] > required {
            return true;
        }
        let is_clear = match (pair.tip_of, mode) {
            (Some(finger), TipMode::Near { finger: near, normal_in_world }) if finger == near => {
                self.tip_is_clear(index, finger, Some(normal_in_world))
            }
            (Some(finger), TipMode::Away { finger: away, clearance }) if finger == away => {
                self.apart(index, clearance.min(kept), motion)
            }
            (Some(finger), _) if !is_free_tip => self.tip_is_clear(index, finger, None),
            _ => self.apart(index, required, motion),
        };
        if !is_clear {
            self.blocking_pair = Some(pair);
            self.blocking_index = index;
        }
        is_clear
    }

    /// Proves that the pair, which moves by at most `motion`, keeps `required` all along the step.
    fn apart(&mut self, index: usize, required: f64, motion: f64) -> bool {
        let pair = self.pairs[index];
        let model = self.model;
        let between = self.between_balls(pair.a, pair.b);
        if between > required + motion {
            self.slack[index] = between;
            return true;
        }
        let (a, b) = (&model.bodies[pair.a], &model.bodies[pair.b]);
        let (at_a, at_b) = (&self.next.placements[pair.a], self.next.at(model, pair.b));
        let required_at_ends = required + self.deviation[pair.a] + self.deviation_of(pair.b);
        let direction = self.last_direction(index);
        let mut separating = direction;
        let hints = &mut self.hints[index];
        let mut at_next = gap_along(&direction, &a.shape, at_a, &b.shape, at_b, hints);
        if !(at_next >= required_at_ends && direction != Vector::zeros()) {
            let answer = separation(
                Placed { shape: &a.shape, at: at_a },
                Placed { shape: &b.shape, at: at_b },
                required_at_ends,
                ENOUGH,
                &mut separating,
                hints,
            );
            self.directions[index] = self.to_keep(index, &separating);
            match answer {
                Separation::SeparatedBy(d) => at_next = d,
                Separation::TooNear | Separation::Unresolved => return self.trees_apart(index, required),
            }
        }
        let (from_a, from_b) = (&self.now.placements[pair.a], self.now.at(model, pair.b));
        // What is known at `next` less all motion may be enough; else the same direction must separate at `now`.
        if at_next - motion >= required
            || gap_along(&separating, &a.shape, from_a, &b.shape, from_b, &mut self.hints[index]) >= required_at_ends
        {
            self.slack[index] = at_next;
            return true;
        }
        // The best direction at `now` may separate at `next` as well.
        let mut best_now = separating;
        let hints = &mut self.hints[index];
        let answer = separation(
            Placed { shape: &a.shape, at: from_a },
            Placed { shape: &b.shape, at: from_b },
            required_at_ends,
            ENOUGH,
            &mut best_now,
            hints,
        );
        if matches!(answer, Separation::SeparatedBy(_)) {
            let gap = gap_along(&best_now, &a.shape, at_a, &b.shape, at_b, hints);
            if gap >= required_at_ends {
                self.directions[index] = self.to_keep(index, &best_now);
                self.slack[index] = gap;
                return true;
            }
            if self.apart_between(index, [best_now, separating], required_at_ends) {
                return true;
            }
        }
        self.trees_apart(index, required)
    }

    /// Looks for a direction that separates at both ends, between one that does at `now` and one that does at `next`: long
    /// links that turn have both no room for the other's.
    fn apart_between(&mut self, index: usize, [good_now, good_next]: [Vector; 2], required_at_ends: f64) -> bool {
        let (pair, model) = (self.pairs[index], self.model);
        let (a, b) = (&model.bodies[pair.a].shape, &model.bodies[pair.b].shape);
        let (mut good_now, mut good_next) = (good_now, good_next);
        let hints = &mut self.hints[index];
        for _ in 0..MAX_BETWEEN {
            let Some(middle) = (good_now + good_next).try_normalize(1e-6) else { return false };
            let (now, next) = (&self.now, &self.next);
            let gap_now = gap_along(&middle, a, &now.placements[pair.a], b, now.at(model, pair.b), hints);
            let gap_next = gap_along(&middle, a, &next.placements[pair.a], b, next.at(model, pair.b), hints);
            match (gap_now >= required_at_ends, gap_next >= required_at_ends) {
                (true, true) => {
                    self.directions[index] = self.to_keep(index, &middle);
                    self.slack[index] = gap_next;
                    return true;
                }
                (true, false) => good_now = middle,
                (false, true) => good_next = middle,
                (false, false) => return false,
            }
        }
        false
    }

    /// The last word where a hull is larger than its mesh: exact triangles, with the relative motion of the step.
    fn trees_apart(&mut self, index: usize, required: f64) -> bool {
        let pair = self.pairs[index];
        let model = self.model;
        let tree_of = |body: usize| match pair.tip_of {
            Some(_) => model.bodies[body].tree_for_tips.as_ref(),
            None => model.bodies[body].tree.as_ref(),
        };
        let (mesh, other, tree) = match (tree_of(pair.a), tree_of(pair.b)) {
            (_, Some(tree)) => (pair.b, pair.a, tree),
            (Some(tree), None) => (pair.a, pair.b, tree),
            (None, None) => return false,
        };
        let body = &model.bodies[other];
        let now = self.now.at(model, mesh).inverse_then(self.now.at(model, other));
        let next = self.next.at(model, mesh).inverse_then(self.next.at(model, other));
        let relative_motion = match self.stands {
            true => 0.0,
            false => {
                now.displacement(&next, &body.center, body.radius) + self.deviation_of(mesh) + self.deviation_of(other)
            }
        };
        // Whatever the moment, one of the two ends is at most half of the motion away.
        let needed = required + 0.5 * relative_motion;
        let mut smallest = 0.0;
        if (self.stands || tree.is_apart(&body.shape, &now, needed, &mut smallest))
            && tree.is_apart(&body.shape, &next, needed, &mut smallest)
            && !(self.stands && tree.holds(&next.point(&body.middle)))
        {
            self.slack[index] = smallest;
            return true;
        }
        false
    }
}
