//! Two bodies that meet, in a posture or on the way from it. The same tests as the search makes, in the same order.

use super::Seen;
use crate::context::Context;
use crate::exchange::{HANDS_TOUCH, own_collider, pair_model};
use crate::failing::{Stage, Try};
use crate::line::{collider, lift_colliders, straight, way_colliders};
use crate::placements::Place;
use crate::station::{FINGER_STEPS, LIFT_SHARES, WAY_SHARES, with_fingers};
use crate::timing::Smooth;
use regrasp_arms::plan::meeting;
use regrasp_arms::{Collider, World};
use regrasp_geometry::{Pose, Vector};
use regrasp_manipulation::robot_miss::Meeting;
use regrasp_robot::manipulator::layout::Part;

/// The robot, the object's pose, and what meets there.
type Found = (Vec<f64>, Pose, Meeting);

/// Steps of a way that are looked at.
const STEPS: usize = 64;

/// The first meeting of hands at the object. None where none is found: then it was no collision that failed.
pub fn first_meeting(context: &Context, (stage, tried): (Stage, &Try), seen: &Seen) -> Option<Found> {
    let look = Look { context, seen };
    let grasps = tried.grasps.as_slice();
    match (stage, grasps) {
        (_, [giver, taker]) if tried.reason == HANDS_TOUCH => look.of_hands([*giver, *taker]),
        (_, [giver, taker]) => look.at_exchange(*giver, *taker),
        (Stage::Exchange | Stage::InHand, [own]) => look.alone(*own),
        (Stage::Grasp | Stage::Place | Stage::PutDown, [own]) => look.at_station(*own),
        (Stage::Carry | Stage::Transit, _) => look.on_motion(grasps.first().copied()),
        _ => None,
    }
}

struct Look<'c, 'a> {
    context: &'c Context<'a>,
    seen: &'c Seen,
}

impl Look<'_, '_> {
    /// The first of some states in which something meets, by any of the tests; the object rests.
    fn first(&self, tests: &mut [Collider], states: &[Vec<f64>]) -> Option<Found> {
        states.iter().find_map(|state| {
            let found = tests.iter_mut().find_map(|test| meeting(test, &test.model.configuration_of(state)))?;
            Some((state.clone(), self.seen.world_from_object, found))
        })
    }

    fn states(&self, path: &Smooth, n_steps: usize) -> Vec<Vec<f64>> {
        path.timed(&self.context.limits, 1.0, n_steps).points.into_iter().map(|point| point.joints).collect()
    }

    /// A hand at the object on a support.
    fn at_station(&self, [hand, grasp]: [usize; 2]) -> Option<Found> {
        let Look { context, seen } = self;
        let own = &context.hands[hand].grasps[grasp];
        let free = &context.arms_and_torso;
        let closed = with_fingers(context, &seen.state, hand, &own.closed);
        let opened = with_fingers(context, &seen.state, hand, &own.open);
        for state in [&closed, &opened] {
            let model = context.model(state, free, None);
            let found = self.first(&mut [collider(context, &model, &context.fixed)], std::slice::from_ref(state));
            if found.is_some() {
                return found;
            }
        }
        self.way_out([hand, grasp], &opened, None)
            .or_else(|| self.closing(hand, [&opened, &closed]))
            .or_else(|| self.way_up([hand, grasp], &closed))
    }

    /// The open hand leaves the object, on the shortest way; another one may hold it.
    fn way_out(&self, [hand, grasp]: [usize; 2], opened: &[f64], holder: Option<[usize; 2]>) -> Option<Found> {
        let Look { context, seen } = self;
        let own = &context.hands[hand].grasps[grasp];
        let free = &context.arms_and_torso;
        let direction = seen.world_from_object.rotation * own.direction;
        let share = WAY_SHARES.into_iter().fold(1.0, f64::min);
        let way = straight(context, hand, opened, &(-direction * own.distance * share))?;
        let model = context.model(opened, free, None);
        let alone = World::default().with(&context.alone, &seen.world_from_object);
        let found = self.first(&mut way_colliders(context, (&model, hand), &alone), &self.states(&way, STEPS));
        let (None, Some([holder, held])) = (&found, holder) else { return found };
        let hand_from_object = context.hands[holder].grasps[held].object_from_hand.inverse();
        let model = context.model(opened, free, Some((holder, &hand_from_object)));
        self.first(&mut [collider(context, &model, &context.fixed)], std::slice::from_ref(way.ends()[1]))
    }

    fn closing(&self, hand: usize, [from, to]: [&[f64]; 2]) -> Option<Found> {
        let context = self.context;
        let fingers: Vec<usize> = context.hands[hand].fingers.clone().collect();
        let model = context.model(from, &fingers, None);
        let states = self.states(&Smooth::Line([from.to_vec(), to.to_vec()]), FINGER_STEPS);
        self.first(&mut [collider(context, &model, &context.fixed)], &states)
    }

    /// The hand lifts the object, on the shortest way.
    fn way_up(&self, [hand, grasp]: [usize; 2], closed: &[f64]) -> Option<Found> {
        let Look { context, seen } = self;
        let hand_from_object = context.hands[hand].grasps[grasp].object_from_hand.inverse();
        let share = LIFT_SHARES.into_iter().fold(1.0, f64::min);
        let up: Vector = context.up() * context.settings.lift * share;
        let lift = straight(context, hand, closed, &up)?;
        let place = Place::new(context, &seen.world_from_object)?;
        let model = context.model(closed, &context.arms_and_torso, Some((hand, &hand_from_object)));
        let worlds = [&*context.fixed, &**place.without_supports(context)];
        let (state, _, found) = self.first(&mut lift_colliders(context, &model, worlds), &self.states(&lift, STEPS))?;
        let pose = context.world_from_hand(hand, &state) * hand_from_object;
        Some((state, pose, found))
    }

    /// A hand by itself with the object in the air.
    fn alone(&self, [hand, grasp]: [usize; 2]) -> Option<Found> {
        let context = self.context;
        let closed = with_fingers(context, &self.seen.state, hand, &context.hands[hand].grasps[grasp].closed);
        let model = context.model(&closed, &context.arms_and_torso, None);
        self.first(&mut [own_collider(context, (&model, hand))], std::slice::from_ref(&closed))
    }

    /// Two hands at the object.
    fn at_exchange(&self, giver: [usize; 2], taker: [usize; 2]) -> Option<Found> {
        let context = self.context;
        let with = |state: &[f64], [hand, grasp]: [usize; 2], is_open: bool| {
            let own = &context.hands[hand].grasps[grasp];
            with_fingers(context, state, hand, if is_open { &own.open } else { &own.closed })
        };
        let both = with(&with(&self.seen.state, giver, false), taker, false);
        let model = pair_model(context, [giver, taker], &both, &context.arms_and_torso);
        let mut test = [collider(context, &model, &context.fixed)];
        self.first(&mut test, std::slice::from_ref(&both))
            .or_else(|| self.way_out(taker, &with(&both, taker, true), Some(giver)))
            .or_else(|| self.closing(taker[0], [&with(&both, taker, true), &both]))
            .or_else(|| self.closing(giver[0], [&both, &with(&both, giver, true)]))
            .or_else(|| self.way_out(giver, &with(&both, giver, true), Some(taker)))
    }

    /// Two hands that meet each other: in their grasps, while the taker comes, or while the giver leaves. All else may overlap: such
    /// pairs fail wherever the object is.
    fn of_hands(&self, pair: [[usize; 2]; 2]) -> Option<Found> {
        let Look { context, seen } = self;
        let mounted = pair.map(|[hand, _]| Part::Hand(context.hands[hand].mounted));
        let fingers = |state: &[f64], which: usize, is_open: bool| {
            let own = &context.hands[pair[which][0]].grasps[pair[which][1]];
            with_fingers(context, state, pair[which][0], if is_open { &own.open } else { &own.closed })
        };
        let both = fingers(&fingers(&seen.state, 0, false), 1, false);
        let mut states = vec![both.clone()];
        for which in [1, 0] {
            let [hand, grasp] = pair[which];
            let own = &context.hands[hand].grasps[grasp];
            let direction = seen.world_from_object.rotation * own.direction;
            let opened = fingers(&both, which, true);
            let way = straight(context, hand, &opened, &(-direction * own.distance));
            states.extend(way.map_or_else(|| vec![opened], |way| self.states(&way, STEPS)));
        }
        let all: Vec<usize> = (0..both.len()).collect();
        let model = context.model(&both, &all, None);
        let mut test = collider(context, &model, &context.fixed);
        let part = |body: usize| context.robot.part_of(model.bodies[body].link);
        test.only(|_| false, |[a, b]| [[part(a), part(b)], [part(b), part(a)]].contains(&mounted));
        self.first(&mut [test], &states)
    }

    /// The end of a motion.
    fn on_motion(&self, carried: Option<[usize; 2]>) -> Option<Found> {
        let Look { context, seen } = self;
        let hand_from_object =
            carried.map(|[hand, grasp]| (hand, context.hands[hand].grasps[grasp].object_from_hand.inverse()));
        let held = hand_from_object.as_ref().map(|(hand, pose)| (*hand, pose));
        let model = context.model(&seen.state, &context.arms_and_torso, held);
        let world = match carried {
            Some(_) => (*context.fixed).clone(),
            None => context.with_object(&seen.world_from_object),
        };
        self.first(&mut [collider(context, &model, &world)], std::slice::from_ref(&seen.state))
    }
}
