//! The motions of a plan, one after the other, from stations and exchanges.

use crate::context::{Context, Grasp, motion_of};
use crate::exchange::Give;
use crate::failing::{Stage, Tally, Try};
use crate::forces::{Carried, Off, under, weight};
use crate::in_hand::{self, Change};
use crate::line::{LINE_STEPS, is_lift_free, is_motion_free};
use crate::placements::Place;
use crate::record::{Holding, Moves, Record};
use crate::station::{FINGER_STEPS, Station, with_fingers};
use crate::timing::{Smooth, at_rest, one_after_the_other};
use regrasp_arms::roadmap::Roads;
use regrasp_arms::times::TimedPath;
use regrasp_arms::{LegTimes, Problem, World, plan_leg};
use regrasp_geometry::Pose;
use regrasp_grasp::wrench::{BalancedForces, Wrench};
use regrasp_manipulation::failure::FailureKind;
use regrasp_manipulation::motion_settings::MotionSettings;
use regrasp_plan::robot_plan::{RobotSegment, RobotSegmentKind};
use regrasp_scene::motion::{CarriedObject, Holder};
use std::sync::Arc;

/// What happens between two motions.
pub enum Step<'s> {
    /// A hand takes the object from a place.
    Pick(&'s Station, &'s Place),
    /// It gives it to another hand.
    Give(&'s Give),
    /// The hand changes its grasp.
    Change(&'s Change),
    /// The hand puts it down.
    Place(&'s Station, &'s Place),
}

/// A motion that was not found.
#[derive(Debug)]
pub struct Stuck {
    /// At this stage.
    pub stage: Stage,
    /// On the way to this step, by index; the number of steps for the way to the end.
    pub step: usize,
    /// Why.
    pub reason: String,
    /// The budget is used up, or the caller asked to stop.
    pub interrupt: Option<FailureKind>,
}

/// Forces are looked for at ever slower motions; this many times.
const SLOWER: usize = 12;
/// By this factor.
const SLOWER_BY: f64 = 1.3;
/// Steps of a smooth motion with the object, at first; twice as many where forces between waypoints are off.
const CARRY_STEPS: usize = 24;
/// So often.
const FINER: usize = 3;

/// Samples of one motion in the first attempt at a plan; the second has twice as many, and so on.
const FIRST_SAMPLES: u64 = 1000;
/// Why a motion with the object has no forces.
const TOO_FAST: &str = "motions without forces that hold the object";

/// The motions of a plan.
pub struct Made {
    /// Its segments.
    pub segments: Vec<RobotSegment>,
    /// States at the corners of paths that the graph of the arms did not have.
    pub new_ways: Vec<Vec<Vec<f64>>>,
}

/// Makes the segments of the steps. `attempt` tells searches for motions apart; `roads` is the graph of the arms, where one is known.
pub fn segments(
    context: &Context,
    steps: &[Step],
    (attempt, roads): (u64, Option<&Roads>),
    tally: &mut Tally,
) -> Result<Made, Stuck> {
    let mut maker = Maker {
        context,
        attempt,
        roads,
        new_ways: Vec::new(),
        record: Record::default(),
        state: context.query.start.clone(),
        object: context.query.world_from_object_start,
        lift: None,
        carried: None,
        step: 0,
    };
    for (index, step) in steps.iter().enumerate() {
        maker.step = index;
        match step {
            Step::Pick(station, place) => maker.pick(station, place, &steps[index + 1..], tally)?,
            Step::Give(give) => maker.give(give, tally)?,
            Step::Change(change) => maker.change(change, tally)?,
            Step::Place(station, place) => maker.place(station, place, tally)?,
        }
    }
    maker.step = steps.len();
    maker.end(tally)?;
    Ok(Made { segments: maker.record.segments, new_ways: maker.new_ways })
}

/// Where the robot and the object are.
struct Maker<'c, 'a> {
    context: &'c Context<'a>,
    attempt: u64,
    /// The graph of the arms among what rests.
    roads: Option<&'c Roads>,
    /// Paths that it did not have.
    new_ways: Vec<Vec<Vec<f64>>>,
    record: Record,
    state: Vec<f64>,
    object: Pose,
    /// The way off the support, which the next motion with the object begins with, and the world without that support.
    lift: Option<(Smooth, Arc<World>)>,
    carried: Option<Carried<'c>>,
    step: usize,
}

impl<'c, 'a> Maker<'c, 'a> {
    fn stuck(&self, stage: Stage, reason: impl Into<String>) -> Stuck {
        Stuck { stage, step: self.step, reason: reason.into(), interrupt: None }
    }

    fn grasp(&self, [hand, grasp]: [usize; 2]) -> &'c Grasp {
        &self.context.hands[hand].grasps[grasp]
    }

    /// A path with the fingers of all hands but those in `own` as they are now.
    fn overlaid(&self, path: &Smooth, own: &[usize]) -> Smooth {
        let mut path = path.clone();
        for hand in (0..self.context.robot.hands.len())
            .filter(|mounted| own.iter().all(|&hand| self.context.hands[hand].mounted != *mounted))
        {
            let range = self.context.robot.layout.range(regrasp_robot::manipulator::layout::Part::Hand(hand));
            path.fix(range.clone(), &self.state[range]);
        }
        path
    }

    /// Arms and fingers move, nothing is held: fingers first, or last where that does not fit.
    fn transit(&mut self, target: &[f64], world: &Arc<World>, support: &str, tally: &mut Tally) -> Result<(), Stuck> {
        let context = self.context;
        let fingers = |from: &[f64], to: &[f64]| self.with_fingers_of(from, to);
        let mut pieces = Vec::new();
        let opened = fingers(&self.state, target);
        let moves = opened != self.state;
        let first = moves.then(|| self.finger_motion([&self.state, &opened], world, tally)).flatten();
        let from = if first.is_some() { opened } else { self.state.clone() };
        let is_first = first.is_some();
        pieces.extend(first);
        let to = if is_first || !moves { target.to_vec() } else { fingers(target, &self.state) };
        if let Some(leg) = self.leg([&from, &to], world, None, LegTimes::Fastest, Stage::Transit, tally)? {
            pieces.push(leg.timed.ok_or_else(|| self.stuck(Stage::Transit, "motions without times"))?);
        }
        if moves && !is_first {
            let last = self.finger_motion([&to, target], world, tally);
            pieces.push(last.ok_or_else(|| self.stuck(Stage::Transit, "fingers that cannot move"))?);
        }
        if pieces.is_empty() {
            pieces.push(at_rest(&self.state, context.settings.rest));
        }
        let timed = one_after_the_other(pieces);
        let moves = Moves::Not(self.object);
        self.record.add(context, RobotSegmentKind::Transit, vec![support.to_owned()], &[], &moves, &timed);
        self.state = target.to_vec();
        Ok(())
    }

    /// The state `arms` with the fingers of all hands as in `fingers`.
    fn with_fingers_of(&self, arms: &[f64], fingers: &[f64]) -> Vec<f64> {
        let mut state = fingers.to_vec();
        for &k in &self.context.arms_and_torso {
            state[k] = arms[k];
        }
        state
    }

    /// All fingers move on a straight line. None where that is not free.
    fn finger_motion(&self, [from, to]: [&[f64]; 2], world: &World, tally: &mut Tally) -> Option<TimedPath> {
        let context = self.context;
        let free: Vec<usize> = (0..from.len()).filter(|&k| from[k] != to[k]).collect();
        let model = context.model(from, &free, None);
        let timed = Smooth::Line([from.to_vec(), to.to_vec()]).timed(&context.limits, 1.0, FINGER_STEPS);
        is_motion_free(context, &model, world, &timed, tally).then_some(timed)
    }

    /// A planned motion; none where the ends are the same.
    fn leg(
        &mut self,
        [from, to]: [&[f64]; 2],
        world: &Arc<World>,
        carried: Option<&Carried>,
        times: LegTimes,
        stage: Stage,
        tally: &mut Tally,
    ) -> Result<Option<regrasp_arms::Leg>, Stuck> {
        if from == to {
            return Ok(None);
        }
        let context = self.context;
        let mut query = motion_of(context.query, from.to_vec(), to.to_vec());
        query.carried.extend(carried.map(|carried| CarriedObject {
            object: context.query.object,
            holder: Holder::Hand(context.hands[carried.hand].index),
            world_from_object: carried.world_from_object(context, from),
        }));
        let mut problem = Problem::in_world(context.scene, &query, world.clone(), &context.covers);
        if let Some(roads) = self.roads {
            let unknown = match carried {
                Some(_) => World::default(),
                None => World::default().with(&context.alone, &self.object),
            };
            problem.use_graph(roads, unknown);
        }
        let seed = context.seed.wrapping_mul(31).wrapping_add(self.attempt * 64 + self.step as u64);
        let mut budget = context.budget.clone();
        budget.max_work = budget.max_work.saturating_sub(tally.statistics.work);
        // Little at first: another pair of grasps may be easier.
        let max_samples = context.motion.max_samples.min(FIRST_SAMPLES * self.attempt.max(1));
        let settings = MotionSettings { max_samples, ..context.motion.clone() };
        match plan_leg(&problem, &[to.to_vec()], times, &settings, (seed, &budget)) {
            Ok(leg) => {
                tally.take(&leg.statistics);
                self.new_ways.extend(leg.is_new.then(|| leg.corners.clone()));
                Ok(Some(leg))
            }
            Err(failure) => {
                let is_cut = matches!(failure.kind, FailureKind::TimeLimit | FailureKind::Interrupted);
                tally.keep(stage, 0, || Try {
                    reason: failure.message.clone(),
                    world_from_object: Some(
                        carried.map_or(self.object, |carried| carried.world_from_object(context, to)),
                    ),
                    grasps: carried.and_then(|carried| index_of(context, carried)).into_iter().collect(),
                    state: Some(to.to_vec()),
                });
                tally.work(failure.statistics.work.max(1000));
                Err(Stuck {
                    stage,
                    step: self.step,
                    interrupt: is_cut.then_some(failure.kind),
                    reason: failure.message,
                })
            }
        }
    }

    /// Fingers of the hands that will take the object next are opened while nothing is held.
    fn with_open_takers(&self, target: &[f64], picker: usize, next: &[Step]) -> Vec<f64> {
        let mut target = target.to_vec();
        let mut known = vec![picker];
        for step in next {
            let give = match step {
                Step::Give(give) => give,
                Step::Change(_) => continue,
                Step::Pick(..) | Step::Place(..) => break,
            };
            let [hand, _] = give.taker;
            if !known.contains(&hand) {
                known.push(hand);
                target = with_fingers(self.context, &target, hand, &self.grasp(give.taker).open);
            }
        }
        target
    }

    /// A straight way of a hand that holds nothing; the object rests.
    fn way(
        &mut self,
        (path, hand): (&Smooth, usize),
        kind: RobotSegmentKind,
        (held_by, holding): (Vec<String>, Option<[usize; 2]>),
        world: &World,
        tally: &mut Tally,
    ) -> Result<(), Stuck> {
        let context = self.context;
        let timed = path.timed(&context.limits, 1.0, LINE_STEPS);
        // A hand that holds the object rests, and touches it.
        let arm: Vec<usize> = context.hands[hand].arm_joints.clone().collect();
        let model = context.model(&timed.points[0].joints, &arm, None);
        if !is_motion_free(context, &model, world, &timed, tally) {
            let stage = if holding.is_some() { Stage::Exchange } else { Stage::Transit };
            return Err(self.stuck(stage, format!("ways of the hand \"{}\"", context.hand_name(hand))));
        }
        let holding = self.resting(holding, timed.points.len())?;
        self.record.add(context, kind, held_by, &holding, &Moves::Not(self.object), &timed);
        self.state.clone_from(&timed.points[timed.points.len() - 1].joints);
        Ok(())
    }

    /// Fingers close or open; all else rests.
    fn fingers(
        &mut self,
        (hand, joints): (usize, &[f64]),
        kind: RobotSegmentKind,
        (held_by, holding): (Vec<String>, Option<[usize; 2]>),
        tally: &mut Tally,
    ) -> Result<(), Stuck> {
        let context = self.context;
        let to = with_fingers(context, &self.state, hand, joints);
        let fingers: Vec<usize> = context.hands[hand].fingers.clone().collect();
        let model = context.model(&self.state, &fingers, None);
        let timed = match to == self.state {
            true => at_rest(&self.state, context.settings.rest),
            false => Smooth::Line([self.state.clone(), to.clone()]).timed(&context.limits, 1.0, FINGER_STEPS),
        };
        if !is_motion_free(context, &model, &context.fixed, &timed, tally) {
            let stage = if holding.is_some() { Stage::Exchange } else { Stage::Transit };
            return Err(self.stuck(stage, format!("fingers of the hand \"{}\"", context.hand_name(hand))));
        }
        let holding = self.resting(holding, timed.points.len())?;
        self.record.add(context, kind, held_by, &holding, &Moves::Not(self.object), &timed);
        self.state = to;
        Ok(())
    }

    /// A hand that holds the object at rest, for this many waypoints.
    fn resting(&self, holding: Option<[usize; 2]>, n_points: usize) -> Result<Vec<Holding<'c>>, Stuck> {
        let Some([hand, grasp]) = holding else { return Ok(Vec::new()) };
        let grasp = self.grasp([hand, grasp]);
        let forces = self.forces(hand, grasp, weight(self.context, &self.object))?;
        Ok(vec![Holding { hand, grasp, forces: vec![forces; n_points] }])
    }

    fn forces(&self, hand: usize, grasp: &Grasp, load: Wrench) -> Result<BalancedForces, Stuck> {
        under(self.context, hand, grasp, load)
            .ok_or_else(|| self.stuck(Stage::Carry, "grasps that do not hold the weight"))
    }

    /// A moment of rest in which one holder joins and another one may leave: forces of each go from one load to another.
    fn rest(&mut self, held_by: Vec<String>, hands: &[([usize; 2], [Wrench; 2])]) -> Result<(), Stuck> {
        let context = self.context;
        let mut holding = Vec::new();
        for (which, loads) in hands {
            let grasp = self.grasp(*which);
            let forces = [self.forces(which[0], grasp, loads[0])?, self.forces(which[0], grasp, loads[1])?];
            holding.push(Holding { hand: which[0], grasp, forces: forces.to_vec() });
        }
        let timed = at_rest(&self.state, context.settings.rest);
        self.record.add(context, RobotSegmentKind::Carry, held_by, &holding, &Moves::Not(self.object), &timed);
        Ok(())
    }

    /// The hand comes to the object, closes, and is ready to lift it.
    fn pick(&mut self, station: &Station, place: &Place, next: &[Step], tally: &mut Tally) -> Result<(), Stuck> {
        let context = self.context;
        let which = [station.hand, station.grasp];
        let (grasp, support) = (self.grasp(which), place.support_name(context));
        let world = match self.object == place.world_from_object {
            true => place.with_object(context).clone(),
            false => Arc::new(context.with_object(&self.object)),
        };
        // Hands that are not needed keep their fingers.
        let pre = self.overlaid(&station.way, &[station.hand]);
        let target = self.with_open_takers(pre.ends()[1], station.hand, next);
        self.transit(&target, &world, support, tally)?;
        let way = self.overlaid(&station.way, &[station.hand]).reversed();
        let held = || (vec![support.to_owned()], None);
        self.way((&way, station.hand), RobotSegmentKind::Approach, held(), &world, tally)?;
        self.fingers((station.hand, &grasp.closed), RobotSegmentKind::Grasp, held(), tally)?;
        let hand_from_object = context.world_from_hand(station.hand, &self.state).inverse() * self.object;
        let loads = [Wrench::ZERO, weight(context, &self.object)];
        let holders = vec![support.to_owned(), context.hand_name(station.hand).to_owned()];
        self.rest(holders, &[(which, loads)])?;
        self.carried = Some(Carried { hand: station.hand, grasp, hand_from_object });
        self.lift = Some((self.overlaid(&station.lift, &[station.hand]), place.without_supports(context).clone()));
        Ok(())
    }

    /// The motion with the object from here to `target`, which ends with `down`, straight onto a support.
    fn carry(&mut self, target: &[f64], down: Option<(Smooth, Arc<World>)>, tally: &mut Tally) -> Result<(), Stuck> {
        let context = self.context;
        let Some(carried) = self.carried.clone() else { return Err(self.stuck(Stage::Carry, "nothing held")) };
        let mut pieces: Vec<TimedPath> = Vec::new();
        let lift = self.lift.take();
        let from = lift.as_ref().map_or(&self.state, |(lift, _)| lift.ends()[1]).clone();
        let model =
            context.model(&self.state, &context.arms_and_torso, Some((carried.hand, &carried.hand_from_object)));
        for (path, without) in lift.iter().chain(&down) {
            let timed = path.timed(&context.limits, 1.0, LINE_STEPS);
            // Slower motions on the same path are free as well; finer ones are looked at again.
            if !is_lift_free(context, &model, [&context.fixed, without], &timed, tally) {
                return Err(self.stuck(Stage::Carry, "ways off a support"));
            }
        }
        if let Some((lift, without)) = &lift {
            pieces.push(self.smooth(&carried, lift, Some((&model, without)), tally)?);
        }
        // A hand that has held the object before opens for its next grasp.
        let opened = self.with_fingers_of(&from, target);
        if opened != from {
            let fingers: Vec<usize> = (0..from.len()).filter(|&k| from[k] != opened[k]).collect();
            let model = context.model(&from, &fingers, Some((carried.hand, &carried.hand_from_object)));
            let timed = Smooth::Line([from, opened.clone()]).timed(&context.limits, 1.0, FINGER_STEPS);
            if !is_motion_free(context, &model, &context.fixed, &timed, tally) {
                return Err(self.stuck(Stage::Carry, "fingers that cannot move"));
            }
            pieces.push(timed);
        }
        let from = opened;
        let leg = self.leg([&from, target], &context.fixed, Some(&carried), LegTimes::Callers, Stage::Carry, tally)?;
        for pair in leg.iter().flat_map(|leg| leg.corners.windows(2)) {
            let line = Smooth::Line([pair[0].clone(), pair[1].clone()]);
            pieces.push(self.smooth(&carried, &line, None, tally)?);
        }
        if let Some((down, without)) = &down {
            pieces.push(self.smooth(&carried, down, Some((&model, without)), tally)?);
        }
        if pieces.is_empty() {
            pieces.push(at_rest(&self.state, context.settings.rest));
        }
        let timed = one_after_the_other(pieces);
        let forces = carried.along(context, &timed).map_err(|_| self.stuck(Stage::Carry, TOO_FAST))?;
        let holding = [Holding { hand: carried.hand, grasp: carried.grasp, forces }];
        let holders = vec![context.hand_name(carried.hand).to_owned()];
        self.state.clone_from(&timed.points[timed.points.len() - 1].joints);
        self.object = carried.world_from_object(context, &self.state);
        self.record.add(context, RobotSegmentKind::Carry, holders, &holding, &Moves::With(carried), &timed);
        Ok(())
    }

    /// A smooth motion with the object, slow enough for its forces, with waypoints near enough to each other.
    fn smooth(
        &self,
        carried: &Carried,
        path: &Smooth,
        tested: Option<(&regrasp_arms::model::ArmModel, &Arc<World>)>,
        tally: &mut Tally,
    ) -> Result<TimedPath, Stuck> {
        let context = self.context;
        let (mut slower, mut n_steps) = (1.0, CARRY_STEPS);
        let share = carried.inertia_share(context, &path.timed(&context.limits, slower, n_steps));
        if share > context.settings.carried_inertia {
            // On the same path inertia falls with the square of the speed.
            slower = (share / context.settings.carried_inertia).sqrt();
        }
        for _ in 0..SLOWER + FINER {
            let timed = path.timed(&context.limits, slower, n_steps);
            match carried.along(context, &timed) {
                Ok(_) => {
                    if let Some((model, without)) = tested
                        && !is_lift_free(context, model, [&context.fixed, without], &timed, tally)
                    {
                        return Err(self.stuck(Stage::Carry, "ways off a support"));
                    }
                    return Ok(timed);
                }
                Err(Off::NotHeld) => slower *= SLOWER_BY,
                Err(Off::Coarse) if n_steps < CARRY_STEPS << FINER => n_steps *= 2,
                Err(Off::Coarse) => slower *= SLOWER_BY,
            }
        }
        Err(self.stuck(Stage::Carry, TOO_FAST))
    }

    /// The object comes to the exchange, changes hands, and the giver leaves.
    fn give(&mut self, give: &Give, tally: &mut Tally) -> Result<(), Stuck> {
        let context = self.context;
        let [giver, taker] = [give.giver, give.taker];
        let names = [giver, taker].map(|[hand, _]| context.hand_name(hand).to_owned());
        let way_in = self.overlaid(&give.way_in, &[giver[0], taker[0]]);
        self.carry(way_in.ends()[1], None, tally)?;
        let world = context.with_object(&self.object);
        let by_giver = || (vec![names[0].clone()], Some(giver));
        let way = way_in.reversed();
        self.way((&way, taker[0]), RobotSegmentKind::Approach, by_giver(), &world, tally)?;
        let grasps = [self.grasp(giver), self.grasp(taker)];
        self.fingers((taker[0], &grasps[1].closed), RobotSegmentKind::Grasp, by_giver(), tally)?;
        let heavy = weight(context, &self.object);
        self.rest(names.to_vec(), &[(giver, [heavy, Wrench::ZERO]), (taker, [Wrench::ZERO, heavy])])?;
        let by_taker = || (vec![names[1].clone()], Some(taker));
        self.fingers((giver[0], &grasps[0].open), RobotSegmentKind::Release, by_taker(), tally)?;
        let way_out = self.overlaid(&give.way_out, &[giver[0], taker[0]]);
        self.way((&way_out, giver[0]), RobotSegmentKind::Retreat, by_taker(), &world, tally)?;
        let hand_from_object = context.world_from_hand(taker[0], &self.state).inverse() * self.object;
        self.carried = Some(Carried { hand: taker[0], grasp: grasps[1], hand_from_object });
        Ok(())
    }

    /// The object comes to a free place, and the hand changes its grasp there.
    fn change(&mut self, change: &Change, tally: &mut Tally) -> Result<(), Stuck> {
        let context = self.context;
        let hand = change.from[0];
        let target = self.overlaid(&Smooth::Line([change.at.clone(), change.at.clone()]), &[hand]);
        let target = target.ends()[0].clone();
        self.carry(&target, None, tally)?;
        let segments = in_hand::segments(context, change, &target);
        let last = segments.last().and_then(|segment| segment.waypoints.last());
        let Some(last) = last.cloned() else { return Err(self.stuck(Stage::InHand, "changes without a motion")) };
        self.record.embed(segments, context.settings.rest);
        self.state = last.joints;
        self.object = Pose::from(&last.world_from_objects[0]);
        let hand_from_object = context.world_from_hand(hand, &self.state).inverse() * self.object;
        self.carried = Some(Carried { hand, grasp: self.grasp(change.to), hand_from_object });
        Ok(())
    }

    /// The object comes down onto its support, and the hand leaves.
    fn place(&mut self, station: &Station, place: &Place, tally: &mut Tally) -> Result<(), Stuck> {
        let context = self.context;
        let which = [station.hand, station.grasp];
        let (grasp, support) = (self.grasp(which), place.support_name(context).to_owned());
        let down = self.overlaid(&station.lift, &[station.hand]).reversed();
        let target = down.ends()[0].clone();
        self.carry(&target, Some((down, place.without_supports(context).clone())), tally)?;
        self.carried = None;
        let loads = [weight(context, &self.object), Wrench::ZERO];
        let hand = context.hand_name(station.hand).to_owned();
        self.rest(vec![hand, support.clone()], &[(which, loads)])?;
        let held = || (vec![support.clone()], None);
        self.fingers((station.hand, &grasp.open), RobotSegmentKind::Release, held(), tally)?;
        let world = context.with_object(&self.object);
        let way = self.overlaid(&station.way, &[station.hand]);
        self.way((&way, station.hand), RobotSegmentKind::Retreat, held(), &world, tally)
    }

    /// To the posture asked for at the end.
    fn end(&mut self, tally: &mut Tally) -> Result<(), Stuck> {
        let context = self.context;
        let world = Arc::new(context.with_object(&self.object));
        let support = self.record.segments.last().and_then(|last| last.held_by.values().next()).cloned();
        let support = support.and_then(|names| names.into_iter().next()).unwrap_or_default();
        self.transit(&context.query.end, &world, &support, tally)
    }
}

/// The hand that carries, and the index of its grasp.
fn index_of(context: &Context, carried: &Carried) -> Option<[usize; 2]> {
    let grasps = &context.hands[carried.hand].grasps;
    Some([carried.hand, grasps.iter().position(|grasp| std::ptr::eq(grasp, carried.grasp))?])
}
