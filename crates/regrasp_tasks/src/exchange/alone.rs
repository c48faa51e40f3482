//! One hand by itself at an exchange: what its arm cannot do alone, no other hand mends, and many pairs of grasps ask for the same.

use super::POSTURES;
use crate::clear::{HandLinks, is_hand_clear, links_of};
use crate::context::Context;
use crate::failing::{Stage, Tally, Try};
use crate::forces;
use crate::line::{collider, count};
use crate::station::{arm_postures, with_fingers};
use regrasp_arms::Collider;
use regrasp_arms::model::ArmModel;
use regrasp_geometry::Pose;
use regrasp_robot::manipulator::layout::Part;
use std::collections::BTreeMap;
use std::rc::Rc;

/// A place and a turn of the set, by their indices.
pub type At = [usize; 2];

/// States in which a hand by itself holds the object free of all that rests and of its own robot, the arms of other hands left out.
/// Err: index among the reasons of the exchange.
pub type States = Rc<Result<Vec<Vec<f64>>, usize>>;

/// What was found out about hands by themselves.
#[derive(Default)]
pub struct Alone {
    /// By hand and grasp.
    held: BTreeMap<[usize; 2], Rc<Held>>,
    /// By hand, grasp and pose of the set.
    known: BTreeMap<([usize; 2], At), States>,
}

/// A hand in a grasp.
struct Held {
    model: ArmModel,
    links: HandLinks,
}

impl Alone {
    /// States of a hand in a grasp with the object at a pose, with the common joints of `common`, fingers closed. `at` names the pose where
    /// others may ask for it again: with the common joints of the start.
    pub fn states(
        &mut self,
        context: &Context,
        own: [usize; 2],
        (world_from_object, at): (&Pose, Option<At>),
        common: &[f64],
        tally: &mut Tally,
    ) -> States {
        if let Some(known) = at.and_then(|at| self.known.get(&(own, at))) {
            return Rc::clone(known);
        }
        let found: States = Rc::new(self.find(context, own, world_from_object, common, tally));
        if let Some(at) = at {
            self.known.insert((own, at), Rc::clone(&found));
        }
        found
    }

    fn find(
        &mut self,
        context: &Context,
        [hand, index]: [usize; 2],
        world_from_object: &Pose,
        common: &[f64],
        tally: &mut Tally,
    ) -> Result<Vec<Vec<f64>>, usize> {
        let grasp = &context.hands[hand].grasps[index];
        let failed = |tally: &mut Tally, so_far: usize, reason: &str, state: Option<&Vec<f64>>| {
            tally.keep(Stage::Exchange, so_far, || Try {
                reason: reason.into(),
                world_from_object: Some(*world_from_object),
                grasps: vec![[hand, index]],
                state: state.cloned(),
            });
        };
        let closed = with_fingers(context, common, hand, &grasp.closed);
        let pose = world_from_object * grasp.object_from_hand;
        tally.work(1);
        let postures = arm_postures(context, hand, &closed, &pose, POSTURES).map_err(|(by, words)| {
            tally.miss(Stage::Exchange, by, || words);
            failed(tally, 1, super::REASONS[0], None);
            0usize
        })?;
        if !forces::holds(context, hand, grasp, world_from_object) {
            return Err(0);
        }
        let held = self.held.entry([hand, index]).or_insert_with(|| {
            let links = links_of(context, hand, &grasp.closed);
            Rc::new(Held { model: context.model(&closed, &context.arms_and_torso, None), links })
        });
        if !is_hand_clear(context, &held.links, &pose) {
            failed(tally, 2, super::REASONS[1], postures.first());
            return Err(1);
        }
        let model = &held.model;
        let mut collider = own_collider(context, (model, hand));
        let all: Vec<Vec<f64>> = postures.iter().map(|state| model.configuration_of(state)).collect();
        let free = collider.are_free(&all);
        count(&collider, tally);
        let (free, others): (Vec<_>, Vec<_>) = postures.into_iter().zip(free).partition(|(_, is_free)| *is_free);
        if free.is_empty() {
            others.iter().for_each(|(state, _)| failed(tally, 2, super::REASONS[1], Some(state)));
            return Err(1);
        }
        Ok(free.into_iter().map(|(state, _)| state).collect())
    }
}

/// The test of a hand by itself: what its arm moves, against what rests and against the robot without other arms.
pub fn own_collider<'c>(context: &'c Context, (model, hand): (&'c ArmModel, usize)) -> Collider<'c> {
    let own = &context.hands[hand];
    let arm: Vec<usize> =
        (0..model.dimension()).filter(|&k| own.arm_joints.contains(&model.coordinates[k].index)).collect();
    let moves = |body: usize| model.is_moved_by(body, &arm);
    let is_other = |body: usize| match context.robot.part_of(model.bodies[body].link) {
        Part::Arm(other) => other != own.arm,
        Part::Hand(other) => other != own.mounted,
        _ => false,
    };
    let mut collider = collider(context, model, &context.fixed);
    collider.only(moves, |[a, b]| (moves(a) || moves(b)) && !is_other(a) && !is_other(b));
    collider
}
