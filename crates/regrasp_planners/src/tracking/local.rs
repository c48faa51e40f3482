//! The local planner (Cherif 1999, sec. 6.2.4, `LocalReOrientation`): from a grasp towards a sub-goal, step by step.

use crate::tracking::grasp::{PerFinger, TrackingGrasp, turn_to};
use crate::tracking::object_motion::ObjectMotion;
use crate::tracking::range::{RESTING, Range};
use crate::tracking::settings::RoleChoice;
use crate::tracking::step::{Asked, Controls, Fingers, NoStep, Roles, STEP_WORK, Stepper, TrackingStep, each};
use arrayvec::ArrayVec;
use nalgebra::UnitQuaternion;
use regrasp_base::Rng;
use regrasp_geometry::{Point, UnitVector, Vector, frame};
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::Model;
use regrasp_robot::kinematics::whole_pose::has_all_directions;

/// Cosine of the angle between the wanted turn and the one that the contacts allow, below which roles are not taken. By hand.
const LEAST_ALIGNED: f64 = 0.2;
/// The same where roles are drawn at random: only those that lead away are left out.
const LEAST_TOWARDS: f64 = 1e-3;
/// Cosine below which roles are looked for that follow better.
const WELL_ALIGNED: f64 = 0.5;
/// The same where the moving finger cannot choose how its tip turns: a change of roles helps its reach nothing. By measurement, the
/// wide hand's sphere: 120 segments in place of 1400, in a third of the time.
const STILL_ALIGNED: f64 = 0.15;
/// How much chance counts against alignment when roles are chosen.
const CHANCE: f64 = 0.4;
/// Share of failures after which the object rests while the moving finger rolls (Cherif 1999 draws from rest and motion).
const REST_SHARE: f64 = 0.5;

/// Time that a moving finger is looked ahead, in seconds. By hand.
const AHEAD: f64 = 2.0;
/// What a finger at the end of its reach counts against alignment. By hand.
const REACH_WEIGHT: f64 = 1.0;
/// What roles that go on count for.
const KEPT: f64 = 0.05;

/// Distance from home, in units of the object's size, from which a finger is rolled back, where one finger moves at a time. By hand.
const FAR: f64 = 0.06;
/// Distance from home to which it is rolled back then. By hand.
const NEAR: f64 = 0.04;
/// As [`FAR`], where several fingers move at a time. By measurement: with 0.06 and 0.04 plans of the football take 366 seconds on the mean,
/// with 0.2 and 0.05 they take 280, and as many are solved. Where one finger moves, scenario D-3 of Cherif 1999 is not solved with these.
const FAR_OF_SEVERAL: f64 = 0.2;
/// As [`NEAR`], where several fingers move at a time.
const NEAR_OF_SEVERAL: f64 = 0.05;
/// Distance from home, in the same unit, at which a finger is back on its first contact, where ranges are asked for. By hand.
const BACK: f64 = 0.01;
/// What a step must bring a finger nearer home, to be followed by another, in the same unit. By hand.
const LEAST_GAIN: f64 = 1e-4;
/// What distance from home, in the same unit, counts against alignment. By hand.
const LAG_WEIGHT: f64 = 0.3;

/// What roles promise.
struct Prospect {
    /// Of the angle between the wanted turn and the one that they allow.
    cosine: f64,
    /// Motion of the object's origin in a step, in the world.
    shift: Vector,
    /// Turn of the object in a step, in the world.
    turn: Vector,
}

impl Prospect {
    /// Way of a moving tip in a step, rolling aside, in the world.
    fn tip_way(&self, model: &Model, here: &TrackingGrasp, finger: usize) -> Vector {
        let tip = here.tip_in_world(model, finger);
        self.shift + self.turn.cross(&(tip.coords - here.world_from_object.translation))
    }
}

/// Where the centres of the fingertips have their homes: places that moving fingers roll back to.
pub enum Homes {
    /// They turn with the object: points in the object frame.
    OnObject(PerFinger<Point>),
    /// They stay where they are: points in the world.
    InWorld(PerFinger<Point>),
}

impl Homes {
    /// Of a start grasp: on a polyhedron the fingertips belong to the faces that they are on if they `keep_faces`, else and elsewhere
    /// to places in the world. There they roll from face to face as the object turns. With `ranges` they belong to their contacts on
    /// smooth objects too (Cherif 1999, sec. 4.2).
    pub fn of(model: &Model, start: &TrackingGrasp, keep_faces: bool, ranges: bool) -> Self {
        let surface = &model.view.object.surface;
        match keep_faces && (ranges || surface.crease_distance(&start.touches[0].foot).is_finite()) {
            true => Homes::OnObject(start.touches.iter().map(|touch| touch.ball.center).collect()),
            false => Homes::InWorld(model.fingers.iter().map(|finger| finger.tip_at_rest).collect()),
        }
    }
}

/// What has been tried for one step.
#[derive(Default)]
struct Tried {
    n: usize,
    /// Fingers of which one has to move; where there are none, any may.
    guilty: Fingers,
    /// Roles that fail whatever the moving fingers do.
    useless: Vec<Roles>,
    /// Moving fingers beside which the range of those that rest has the sub-goal, once asked for.
    covering: Option<Vec<Fingers>>,
}

impl Tried {
    /// True where ranges were asked for and none has the sub-goal.
    fn has_no_range(&self) -> bool {
        self.covering.as_ref().is_some_and(Vec::is_empty)
    }
}

/// How often steps failed, by Cherif 1999's numbers; 0 and [`OUTSIDE_RANGES`] for what it does not list.
pub type Failures = [u64; 9];
/// Sub-goals that no range of orientations has.
const OUTSIDE_RANGES: usize = 8;

/// Roles and the moving fingers' controls, kept from step to step while they do.
#[derive(Debug, Clone, Copy)]
struct Choice {
    roles: Roles,
    controls: Controls,
    /// Turn of the object in a step, in the world; none where it rests.
    turn: Option<Vector>,
    /// How long the step takes.
    seconds: f64,
}

impl Choice {
    /// The same in half of the time, or in the time of the shortest step.
    fn shorter(mut self, shortest: f64) -> Self {
        let seconds = (0.5 * self.seconds).max(shortest);
        let share = seconds / self.seconds;
        self.controls.iter_mut().flatten().for_each(|control| *control *= share);
        Choice { turn: self.turn.map(|turn| turn * share), seconds, ..self }
    }
}

/// What a local plan has come to.
pub struct LocalPlan {
    /// Its steps.
    pub steps: Vec<TrackingStep>,
    /// True when it ends within the tolerance of the sub-goal.
    pub arrived: bool,
}

/// Plans towards a sub-goal.
pub struct Local<'s, 'm, 'a> {
    /// Makes the steps.
    pub stepper: &'s mut Stepper<'m, 'a>,
    /// Random numbers.
    pub rng: &'s mut Rng,
    /// The finger that the object rolls on, where it is chosen once.
    pub rolling: Option<usize>,
    /// Where the fingertips have their homes.
    pub homes: &'s Homes,
    /// Counts.
    pub failures: &'s mut Failures,
}

impl Local<'_, '_, '_> {
    /// From `start` to within `tolerance` of the orientation `goal`, beginning with the roles `before`.
    pub fn plan(
        &mut self,
        start: &TrackingGrasp,
        goal: &UnitQuaternion<f64>,
        tolerance: f64,
        before: Option<Roles>,
    ) -> LocalPlan {
        let settings = self.stepper.settings;
        let most_seconds = settings.local_time * settings.sub_goal_time;
        let mut seconds = 0.0;
        let mut steps: Vec<TrackingStep> = Vec::new();
        let mut here = start.clone();
        self.stepper.workspace.set(&here.world_from_object.to_pose(), &here.joints, &here.contacts());
        let one_moves = self.stepper.model.n_fingers() <= self.stepper.resting + 1;
        let (far, near) = if one_moves { (FAR, NEAR) } else { (FAR_OF_SEVERAL, NEAR_OF_SEVERAL) };
        self.restore(&mut here, &mut steps, far, near);
        if settings.range_coverage && !self.enter_range(&mut here, &mut steps, goal) {
            self.failures[OUTSIDE_RANGES] += 1;
            return LocalPlan { steps: Vec::new(), arrived: false };
        }
        let mut choice = before.map(|roles| {
            let way = |_| Some(Vector::zeros());
            let controls = self.controls_home(&here, roles.moving, way, settings.longest_step);
            Choice { roles, controls, turn: None, seconds: settings.longest_step }
        });
        // The last step may end beyond by what sums of tenths are off.
        while seconds < most_seconds - 1e-6 {
            let left = turn_to(&here.orientation(), goal);
            if left.norm() <= tolerance {
                return LocalPlan { steps, arrived: true };
            }
            let mut tried = Tried::default();
            let mut made = None;
            while tried.n < settings.trials {
                let kept = choice.filter(|_| tried.n == 0).and_then(|choice| self.keep(&here, &choice, &left));
                let next = kept.or_else(|| self.choose(&here, &left, &mut tried, choice));
                tried.n += 1;
                tried.guilty = 0;
                if tried.has_no_range() {
                    break;
                }
                let Some(next) = next else {
                    self.failures[NoStep::Degenerate.number()] += 1;
                    continue;
                };
                let (next, result) = self.step(&here, next);
                choice = Some(next);
                match result {
                    Ok(step) => {
                        made = Some(step);
                        break;
                    }
                    Err(failure) => {
                        self.failures[failure.number()] += 1;
                        self.learn(&mut tried, &next, failure);
                    }
                }
            }
            let Some(step) = made else {
                // Where the range ends another one is begun.
                if tried.has_no_range() && self.enter_range(&mut here, &mut steps, goal) {
                    continue;
                }
                break;
            };
            seconds += step.seconds;
            here = step.end.clone();
            steps.push(step);
        }
        let arrived = turn_to(&here.orientation(), goal).norm() <= tolerance;
        LocalPlan { steps, arrived }
    }

    /// The step of this choice, halved as long as it is too long; and the choice of which it is.
    fn step(&mut self, here: &TrackingGrasp, mut choice: Choice) -> (Choice, Result<TrackingStep, NoStep>) {
        loop {
            let Choice { roles, controls: rolled, turn, seconds } = choice;
            match self.stepper.step(here, &Asked { roles, turn, rolled, seconds }) {
                Err(NoStep::TooLong) => choice = choice.shorter(self.stepper.settings.time_step),
                result => return (choice, result),
            }
        }
    }

    /// True where some range has the turn to `goal`, if need be after the fingertips have gone back to their first contacts: the
    /// scheme of Cherif 1999, sec. 4.1.2. `here` becomes the end of what is added to `steps`.
    fn enter_range(
        &mut self,
        here: &mut TrackingGrasp,
        steps: &mut Vec<TrackingStep>,
        goal: &UnitQuaternion<f64>,
    ) -> bool {
        let left = turn_to(&here.orientation(), goal);
        if !self.covering(here, &left).is_empty() {
            return true;
        }
        self.restore(here, steps, BACK, BACK);
        !steps.is_empty() && !self.covering(here, &left).is_empty()
    }

    /// Moving fingers, a set for each choice, beside which the range of those that rest has the turn `left`, in the world.
    fn covering(&mut self, here: &TrackingGrasp, left: &Vector) -> Vec<Fingers> {
        self.stepper.work += STEP_WORK;
        let model = self.stepper.model;
        let covers = |moving: &Fingers| {
            let resting: PerFinger<usize> = each(model.all_fingers() & !moving).collect();
            <[usize; RESTING]>::try_from(&resting[..]).is_ok_and(|resting| Range::of(model, here, resting).covers(left))
        };
        let mut moving: Vec<Fingers> =
            Roles::all(model.n_fingers(), self.stepper.resting).map(|roles| roles.moving).collect();
        moving.dedup();
        moving.retain(covers);
        moving
    }

    /// While the object rests, rolls fingers back that are `far` from home until they are `near` or come no nearer: the
    /// object at rest of Cherif 1999 (section 6.2.4, `w_O` of zero), with a purpose. `here` becomes the end of what is added to `steps`.
    /// Both distances are in units of the object's size.
    fn restore(&mut self, here: &mut TrackingGrasp, steps: &mut Vec<TrackingStep>, far: f64, near: f64) {
        let model = self.stepper.model;
        let size = model.frame.torque_scale;
        for moving in 0..model.n_fingers() {
            let mut before = self.lag(here, moving);
            if before < far * size || !self.rolls_by_itself(moving) {
                continue;
            }
            let rolling = self.rolling.filter(|once| *once != moving).unwrap_or((moving + 1) % model.n_fingers());
            let settings = self.stepper.settings;
            let mut seconds = settings.rest_step.max(settings.time_step);
            loop {
                let roles = Roles { moving: 1 << moving, rolling };
                let rolled = self.controls_home(here, roles.moving, |_| None, seconds);
                let asked = Asked { roles, turn: None, rolled, seconds };
                let step = match self.stepper.step(here, &asked) {
                    Ok(step) => step,
                    Err(NoStep::TooLong) => {
                        seconds = (0.5 * seconds).max(settings.time_step);
                        continue;
                    }
                    Err(_) => break,
                };
                // Also a step that leads no nearer has been made: the workspace is there.
                *here = step.end.clone();
                steps.push(step);
                let now = self.lag(here, moving);
                if now < near * size || now > before - LEAST_GAIN * size {
                    break;
                }
                before = now;
            }
        }
    }

    /// A fingertip's home as the object lies.
    fn home_in_object(&self, here: &TrackingGrasp, finger: usize) -> Point {
        match self.homes {
            Homes::OnObject(centers) => centers[finger],
            Homes::InWorld(centers) => here.world_from_object.point_to_child(&centers[finger]),
        }
    }

    /// How far a fingertip is from its home on the object, in metres.
    fn lag(&self, here: &TrackingGrasp, finger: usize) -> f64 {
        (here.touches[finger].ball.center - self.home_in_object(here, finger)).norm()
    }

    /// What a failure says about what to try next (Cherif 1999, sec. 6.2.4): 1 and 3 keep the moving finger and change its
    /// control, 4 moves the guilty one, 5 to 7 change the roles.
    fn learn(&self, tried: &mut Tried, choice: &Choice, failure: NoStep) {
        tried.guilty = match failure {
            NoStep::BrokenContact(finger) => 1 << finger,
            NoStep::Collision | NoStep::MovingPad => choice.roles.moving,
            _ => 0,
        };
        let whatever_it_does =
            matches!(failure, NoStep::BrokenContact(_) | NoStep::RestingPad | NoStep::Degenerate | NoStep::Unbalanced);
        if whatever_it_does && choice.turn.is_some() && !tried.useless.contains(&choice.roles) {
            tried.useless.push(choice.roles);
        }
    }

    /// True where a finger can roll while the object rests; another one follows it, and rests where it does.
    fn rolls_by_itself(&self, finger: usize) -> bool {
        has_all_directions(self.stepper.model.fingers[finger].ik.chain())
    }

    /// The choice of the step before, where its roles still lead towards the goal.
    fn keep(&self, here: &TrackingGrasp, choice: &Choice, left: &Vector) -> Option<Choice> {
        let Roles { moving, .. } = choice.roles;
        let least = if each(moving).any(|finger| self.rolls_by_itself(finger)) { WELL_ALIGNED } else { STILL_ALIGNED };
        let seconds = choice.seconds;
        let prospect = self.prospect(here, choice.roles, left, seconds).filter(|prospect| prospect.cosine >= least)?;
        let way = |finger| Some(prospect.tip_way(self.stepper.model, here, finger));
        let controls = self.controls_home(here, moving, way, seconds);
        Some(Choice { turn: Some(prospect.turn), controls, ..*choice })
    }

    /// What these roles promise in a step of `seconds` where `left` is the turn left to the sub-goal.
    ///
    /// The contacts leave one turn, which Cherif 1999 takes at the extreme velocity of the largest component wanted. Here it goes no
    /// farther than to where it is nearest to the sub-goal.
    fn prospect(&self, here: &TrackingGrasp, roles: Roles, left: &Vector, seconds: f64) -> Option<Prospect> {
        let model = self.stepper.model;
        let resting: PerFinger<usize> = each(model.all_fingers() & !roles.moving).collect();
        let motion = ObjectMotion::new(model, here, &resting, roles.rolling, left)?;
        let (shift, allowed) = motion.twist(left);
        let cosine = allowed.dot(left) / (allowed.norm() * left.norm());
        let most = self.stepper.settings.object_velocity * seconds / allowed.amax();
        let share = (allowed.dot(left) / allowed.norm_squared()).min(most);
        let (shift, allowed) = (shift * share, allowed * share);
        Some(Prospect { cosine, shift, turn: allowed })
    }

    /// How far along its reach a tip is that goes on for [`AHEAD`] as in a step of the longest time: 1 at the end; 0 where reach has no end.
    fn reach_share(&self, here: &TrackingGrasp, finger: usize, tip_way: &Vector) -> f64 {
        let model = self.stepper.model;
        let Some(reach) = model.view.reach else { return 0.0 };
        let tip = here.tip_in_world(model, finger) + tip_way * (AHEAD / self.stepper.settings.longest_step);
        (tip - model.fingers[finger].tip_at_rest).norm() / reach
    }

    /// Other roles: those that lead best towards the goal and whose moving fingers have reach left, with some chance.
    fn choose(
        &mut self,
        here: &TrackingGrasp,
        left: &Vector,
        tried: &mut Tried,
        before: Option<Choice>,
    ) -> Option<Choice> {
        self.stepper.work += STEP_WORK;
        if self.stepper.settings.range_coverage && tried.covering.is_none() {
            tried.covering = Some(self.covering(here, left));
        }
        let model = self.stepper.model;
        let n = model.n_fingers();
        let seconds = self.stepper.settings.longest_step;
        let has_failed = tried.n > 0;
        let chance = if has_failed { 1.0 } else { CHANCE };
        let is_random = self.stepper.settings.roles == RoleChoice::Random;
        let least_aligned = if is_random { LEAST_TOWARDS } else { LEAST_ALIGNED };
        let mut best: Option<(f64, Roles, Prospect)> = None;
        for roles in
            Roles::all(n, self.stepper.resting).filter(|roles| tried.guilty == 0 || roles.moving & tried.guilty != 0)
        {
            if self.rolling.is_some_and(|once| once != roles.rolling) || tried.useless.contains(&roles) {
                continue;
            }
            if tried.covering.as_ref().is_some_and(|covering| !covering.contains(&roles.moving)) {
                continue;
            }
            let noise = self.rng.uniform(0.0, chance);
            let Some(prospect) = self.prospect(here, roles, left, seconds).filter(|p| p.cosine >= least_aligned) else {
                continue;
            };
            if is_random {
                if best.as_ref().is_none_or(|(most, _, _)| noise > *most) {
                    best = Some((noise, roles, prospect));
                }
                continue;
            }
            let share = |finger| self.reach_share(here, finger, &prospect.tip_way(model, here, finger));
            let share = each(roles.moving).map(share).fold(0.0, f64::max);
            if share > 1.0 {
                continue;
            }
            // Changing roles costs a pause.
            let kept = if before.is_some_and(|before| before.roles == roles) && !has_failed { KEPT } else { 0.0 };
            let lag = each(roles.moving).map(|finger| self.lag(here, finger)).fold(0.0, f64::max);
            let lag = lag / model.frame.torque_scale;
            let worth = prospect.cosine + noise + kept - REACH_WEIGHT * share * share + LAG_WEIGHT * lag;
            if best.as_ref().is_none_or(|(most, _, _)| worth > *most) {
                best = Some((worth, roles, prospect));
            }
        }
        let object_rests = has_failed && self.rng.chance(REST_SHARE);
        let (roles, moves) = match best {
            Some((_, roles, prospect)) => {
                let rests = object_rests && each(roles.moving).any(|finger| self.rolls_by_itself(finger));
                (roles, Some(prospect).filter(|_| !rests))
            }
            // Nothing leads there: a finger that rolls on while the object rests may change that.
            None if object_rests => {
                let moving = each(tried.guilty).next().unwrap_or_else(|| self.rng.below(n));
                let others: ArrayVec<usize, MAX_FINGERS> = (0..n).filter(|&finger| finger != moving).collect();
                let rolling = self.rolling.unwrap_or_else(|| others[self.rng.below(others.len())]);
                if rolling == moving || !self.rolls_by_itself(moving) {
                    return None;
                }
                (Roles { moving: 1 << moving, rolling }, None)
            }
            None => return None,
        };
        let controls = match has_failed {
            true => self.drawn_controls(roles.moving, seconds),
            false => {
                let way = |finger| moves.as_ref().map(|prospect| prospect.tip_way(model, here, finger));
                self.controls_home(here, roles.moving, way, seconds)
            }
        };
        Some(Choice { roles, controls, turn: moves.map(|prospect| prospect.turn), seconds })
    }

    /// The controls of moving fingers for a step of `seconds` that lead them home; `tip_way` is the way of a finger's tip in the
    /// world with the object, none where this rests.
    fn controls_home(
        &self,
        here: &TrackingGrasp,
        moving: Fingers,
        tip_way: impl Fn(usize) -> Option<Vector>,
        seconds: f64,
    ) -> Controls {
        let mut controls = Controls::default();
        for finger in each(moving) {
            controls[finger] = self.control_home(here, finger, tip_way(finger).as_ref(), seconds);
        }
        controls
    }

    /// The control of a moving finger for a step of `seconds`, of the extremes (Cherif 1999, eq. 10), that leads it nearest to its
    /// home; `tip_way` is the way of its tip in the world with the object, none where this rests.
    fn control_home(&self, here: &TrackingGrasp, moving: usize, tip_way: Option<&Vector>, seconds: f64) -> [f64; 2] {
        let settings = self.stepper.settings;
        let ball = &here.touches[moving].ball;
        let (x, y) = frame::tangents(&UnitVector::new_unchecked(ball.normal));
        let arm = ball.normal * self.stepper.model.fingers[moving].tip_radius;
        let most = settings.rolling_velocity * seconds;
        let mut home = self.home_in_object(here, moving);
        // Where the object rests, only this step is sure to be rolled so; else others like it follow.
        let mut n_steps = 1.0;
        if let Some(tip_way) = tip_way {
            n_steps = AHEAD / seconds;
            if matches!(self.homes, Homes::InWorld(_)) {
                home -= here.world_from_object.vector_to_child(tip_way) * n_steps;
            }
        }
        let left = |control: &[f64; 2]| {
            let turn = x.into_inner() * control[0] + y.into_inner() * control[1];
            (ball.center + turn.cross(&arm) * n_steps - home).norm()
        };
        let controls = (0..9).map(|k| [f64::from(k % 3 - 1) * most, f64::from(k / 3 - 1) * most]);
        controls.min_by(|a, b| left(a).total_cmp(&left(b))).unwrap_or([0.0; 2])
    }

    /// Controls of moving fingers for a step of `seconds`, drawn from the extremes (Cherif 1999, eq. 10).
    fn drawn_controls(&mut self, moving: Fingers, seconds: f64) -> Controls {
        let most = self.stepper.settings.rolling_velocity * seconds;
        let mut controls = Controls::default();
        for finger in each(moving) {
            controls[finger] = std::array::from_fn(|_| most * (self.rng.below(3) as f64 - 1.0));
        }
        controls
    }
}
