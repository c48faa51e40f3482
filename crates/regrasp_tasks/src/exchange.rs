//! Where one hand gives the object to another one (Saut 2010, sec. V-C).

/// One hand by itself at an exchange.
mod alone;

use crate::context::{Context, Grasp};
use crate::failing::{Stage, Tally, Try};
use crate::line::{LINE_STEPS, are_states_free, is_state_free, is_way_free, straight};
use crate::station::{Effort, WAY_SHARES, can_close, common_postures, natural_first, with_fingers};
use crate::timing::Smooth;
pub use alone::own_collider;
use alone::{Alone, At};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use regrasp_arms::model::ArmModel;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp_lists::pairs::are_hands_apart;
use regrasp_manipulation::robot_miss::{ExchangeOutcome, TriedExchange};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Postures of one arm that are looked at.
const POSTURES: usize = 3;
/// Standard deviation of drawn orientations about one of the set, in radians. By hand.
const TURN_SPREAD: f64 = 0.4;
/// Postures of the common joints that are drawn for one drawn pose.
const COMMON_DRAWS: usize = 2;
/// The grid reaches so far beyond shoulders, start and goal, in metres.
const BEYOND: f64 = 0.3;
/// Places that are tried with little effort.
const LITTLE_PLACES: usize = 8;

/// One hand gives the object to another one.
#[derive(Debug, Clone)]
pub struct Give {
    /// Hand and index of its grasp: who gives.
    pub giver: [usize; 2],
    /// Who takes.
    pub taker: [usize; 2],
    /// The open taker from the object to where its way in begins; the giver holds.
    pub way_in: Smooth,
    /// The open giver from the object to where its way out ends; the taker holds.
    pub way_out: Smooth,
}

/// Positions of the exchange, the best first.
pub struct Places {
    positions: Vec<Point>,
    turns: Vec<UnitQuaternion<f64>>,
    /// What is known of each hand by itself at these places.
    alone: Alone,
    /// How near pairs of grasps came with little effort, by the index of the reason.
    reached: BTreeMap<[[usize; 2]; 2], usize>,
    /// By position: the furthest that any pair came, by the index of the reason. None where none was tried.
    came: Vec<Option<usize>>,
}

/// Where the shoulder of a hand's arm is at the start.
fn shoulder(context: &Context, hand: usize) -> Point {
    let mut poses = Vec::new();
    context.robot.link_poses(&context.query.start, &mut poses);
    poses[context.robot.arms[context.hands[hand].arm].base.0].translation.vector.into()
}

impl Places {
    /// Free nodes of a grid, by the sum of the ways of both wrists: from its start over the object at the start, the exchange and to
    /// its end for the first hand; over the exchange and the goal for the second one.
    pub fn new(context: &Context, hands: [usize; 2]) -> Self {
        let wrists = hands.map(|hand| context.world_from_hand(hand, &context.query.start).translation.vector);
        let ends = hands.map(|hand| context.world_from_hand(hand, &context.query.end).translation.vector);
        let object = [&context.query.world_from_object_start, &context.query.world_from_object_goal];
        let [start, goal] = object.map(|pose| (pose * context.object.center_of_mass).coords);
        let shoulders = hands.map(|hand| shoulder(context, hand).coords);
        let corners = [start, goal, shoulders[0], shoulders[1]];
        let low = corners.iter().fold(corners[0], |low, c| low.inf(c)) - Vector::repeat(BEYOND);
        let high = corners.iter().fold(corners[0], |high, c| high.sup(c)) + Vector::repeat(BEYOND);
        // No more nodes than this along a side.
        let step = context.settings.exchange_grid.max((high - low).max() / 40.0);
        let n = ((high - low) / step).map(|count| count.floor() as usize);
        let radius = context.object.radius;
        let mut nodes: Vec<(f64, Point)> = Vec::new();
        for i in 0..=n.x {
            for j in 0..=n.y {
                for k in 0..=n.z {
                    let at = low + Vector::new(i as f64, j as f64, k as f64) * step;
                    let ways = (wrists[0] - start).norm()
                        + (start - at).norm()
                        + (at - ends[0]).norm()
                        + (wrists[1] - at).norm()
                        + (at - goal).norm()
                        + (goal - ends[1]).norm();
                    nodes.push((ways, at.into()));
                }
            }
        }
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let positions: Vec<Point> = nodes
            .into_iter()
            .map(|(_, at)| at)
            .filter(|at| context.fixed.is_ball_free(at, radius))
            .take(context.settings.exchange_places)
            .collect();
        let came = vec![None; positions.len()];
        Places { positions, turns: turns(), alone: Alone::default(), reached: BTreeMap::new(), came }
    }

    /// Places at which pairs of grasps were tried, and how far these came.
    pub fn tried(&self) -> impl Iterator<Item = TriedExchange> {
        let outcome = |reason: usize| match reason {
            0 => ExchangeOutcome::OutOfReach,
            1 => ExchangeOutcome::InCollision,
            _ => ExchangeOutcome::NoWay,
        };
        let all = self.positions.iter().zip(&self.came);
        all.filter_map(move |(at, came)| Some(TriedExchange { position: at.coords.into(), outcome: outcome((*came)?) }))
    }

    /// Poses of the object for a pair of grasps, the best places first, with the most natural turns at each.
    pub fn poses(&self, context: &Context, pair: [[usize; 2]; 2]) -> impl Iterator<Item = Pose> {
        let natural = Natural::new(context, pair);
        let n_turns = context.settings.exchange_turns;
        self.positions.iter().flat_map(move |at| {
            let ranked = natural.ranked(at, &self.turns).into_iter().take(n_turns);
            ranked.map(|(_, turn)| pose_at(context, at, &self.turns[turn])).collect::<Vec<Pose>>()
        })
    }

    /// Positions of the object's centre of mass, the best first.
    pub fn iter(&self) -> impl Iterator<Item = &Point> {
        self.positions.iter()
    }

    /// Where the object comes with one grasp each. Err with a reason.
    pub fn give(
        &mut self,
        context: &Context,
        [giver, taker]: [[usize; 2]; 2],
        effort: Effort,
        tally: &mut Tally,
    ) -> Result<Give, &'static str> {
        let Places { positions, turns, alone, reached, came } = self;
        let mut attempt = Attempt::new(context, giver, taker, alone);
        attempt.reached = reached.get(&[giver, taker]).copied().unwrap_or(0);
        let natural = Natural::new(context, [giver, taker]);
        let n_little = LITTLE_PLACES.min(positions.len());
        let (places, n_draws) = match effort {
            Effort::Little => (0..n_little, 0),
            Effort::Full => (n_little..positions.len(), context.settings.exchange_draws),
        };
        for place in places {
            let at = &positions[place];
            let before = std::mem::take(&mut attempt.reached);
            for (_, turn) in natural.ranked(at, turns).into_iter().take(context.settings.exchange_turns) {
                let pose = (&pose_at(context, at, &turns[turn]), Some([place, turn]));
                if let Some(give) = attempt.at(pose, &context.query.start, tally) {
                    return Ok(give);
                }
            }
            came[place] = came[place].max(Some(attempt.reached));
            attempt.reached = attempt.reached.max(before);
        }
        // Drawn about the best places.
        let index = ((giver[0] * 1009 + giver[1]) * 1009 + taker[0]) * 1009 + taker[1];
        let mut rng = Rng::keyed(context.seed, "exchange", index as u64);
        if positions.is_empty() {
            return Err("without a free place");
        }
        let hands = [giver[0], taker[0]];
        for draw in 0..n_draws {
            let middle = &positions[draw % positions.len().min(8)];
            let spread = context.settings.exchange_spread;
            let shift = Vector::new(rng.normal(), rng.normal(), rng.normal()) * spread;
            let at = middle + shift;
            let best = (0..4)
                .map(|_| {
                    let turn = turns[rng.below(turns.len())];
                    let bend = Vector::new(rng.normal(), rng.normal(), rng.normal()) * TURN_SPREAD;
                    let turn = UnitQuaternion::from_scaled_axis(bend) * turn;
                    (natural.of(&at, &turn), turn)
                })
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, turn)) = best else { continue };
            let mut commons = common_postures(context, &hands, &context.query.start, COMMON_DRAWS, &mut rng);
            natural_first(context, &mut commons, &[at, at]);
            for common in &commons {
                if let Some(give) = attempt.at((&pose_at(context, &at, &turn), None), common, tally) {
                    return Ok(give);
                }
            }
        }
        let nearest = attempt.reached;
        reached.insert([giver, taker], nearest);
        Err(REASONS[nearest])
    }
}

/// How natural orientations are: by the directions in which the hands come, and from the shoulders to the object.
struct Natural {
    shoulders: [Point; 2],
    /// In which the hands come, in the object frame.
    directions: [Vector; 2],
}

impl Natural {
    fn new(context: &Context, pair: [[usize; 2]; 2]) -> Self {
        Natural {
            shoulders: pair.map(|[hand, _]| shoulder(context, hand)),
            directions: pair.map(|[hand, grasp]| context.hands[hand].grasps[grasp].direction),
        }
    }

    /// Of an orientation at a place: the larger, the better.
    fn of(&self, at: &Point, turn: &UnitQuaternion<f64>) -> f64 {
        let of = |k: usize| {
            let comes = turn * self.directions[k];
            (at - self.shoulders[k]).try_normalize(1e-9).map_or(0.0, |towards| towards.dot(&comes))
        };
        of(0).min(of(1)) + 0.1 * (of(0) + of(1))
    }

    /// Indices of turns at a place, the most natural first.
    fn ranked(&self, at: &Point, turns: &[UnitQuaternion<f64>]) -> Vec<(f64, usize)> {
        let mut ranked: Vec<(f64, usize)> =
            turns.iter().enumerate().map(|(index, turn)| (self.of(at, turn), index)).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        ranked
    }
}

/// The pose with the object's centre of mass at a point.
fn pose_at(context: &Context, at: &Point, turn: &UnitQuaternion<f64>) -> Pose {
    let position = at.coords - turn * context.object.center_of_mass.coords;
    Pose::from_parts(Translation3::from(position), *turn)
}

/// Why a pair of grasps fails wherever the object is.
pub const HANDS_TOUCH: &str = "hands touch";

/// A pair of grasps in which the hands hit each other.
pub fn hands_touch(pair: [[usize; 2]; 2]) -> Try {
    Try { reason: HANDS_TOUCH.into(), world_from_object: None, grasps: pair.to_vec(), state: None }
}

/// True where the hands of two grasps do not hit each other: in the grasps, while the taker comes, and while the giver leaves (Saut
/// 2010, sec. IV-B).
pub fn is_double_grasp(context: &Context, giver: [usize; 2], taker: [usize; 2]) -> bool {
    let one = |[hand, grasp]: [usize; 2]| {
        let own = &context.hands[hand];
        (own.model, &own.list.grasps[own.grasps[grasp].index])
    };
    are_hands_apart(one(giver), one(taker))
}

/// Why an exchange fails, from far to near.
const REASONS: [&str; 6] = [
    "out of reach",
    "in collision",
    "without a way of the taker",
    "with a taker that cannot close",
    "with a giver that cannot open",
    "without a way of the giver",
];

/// One pair of grasps.
struct Attempt<'c, 'a, 'p> {
    context: &'c Context<'a>,
    giver: [usize; 2],
    taker: [usize; 2],
    /// What is known of each hand by itself.
    alone: &'p mut Alone,
    /// Both hands closed, with the object; made when it is needed.
    model: Option<Rc<ArmModel>>,
    /// The taker before the exchange, the giver after it: that hand open.
    open: [Option<Rc<Open>>; 2],
    /// Index of the nearest reason.
    reached: usize,
}

impl<'c, 'a, 'p> Attempt<'c, 'a, 'p> {
    fn new(context: &'c Context<'a>, giver: [usize; 2], taker: [usize; 2], alone: &'p mut Alone) -> Self {
        Attempt { context, giver, taker, alone, model: None, open: [None, None], reached: 0 }
    }

    /// The exchange with the object at a pose, with the common joints of `common`. `at` names poses of the set.
    fn at(&mut self, (world_from_object, at): (&Pose, Option<At>), common: &[f64], tally: &mut Tally) -> Option<Give> {
        let context = self.context;
        tally.work(1);
        let hands = [self.giver, self.taker];
        let mut by_itself = |own| {
            let states = self.alone.states(context, own, (world_from_object, at), common, tally);
            self.reached = self.reached.max(states.as_ref().as_ref().err().copied().unwrap_or(0));
            states
        };
        let first = by_itself(hands[0]);
        let first = first.as_ref().as_ref().ok()?;
        let second = by_itself(hands[1]);
        let second = second.as_ref().as_ref().ok()?;
        let [giver, taker] = hands.map(|[hand, grasp]| (hand, &context.hands[hand].grasps[grasp]));
        let both =
            with_fingers(context, &with_fingers(context, common, giver.0, &giver.1.closed), taker.0, &taker.1.closed);
        self.reached = self.reached.max(1);
        let free = &context.arms_and_torso;
        let model =
            self.model.get_or_insert_with(|| Rc::new(pair_model(context, [self.giver, self.taker], &both, free)));
        let model = Rc::clone(model);
        let arms = [giver.0, taker.0].map(|hand| context.hands[hand].arm_joints.clone());
        let with_second = |first: &Vec<f64>, second: &Vec<f64>| {
            let mut at = both.clone();
            at[arms[0].clone()].copy_from_slice(&first[arms[0].clone()]);
            at[arms[1].clone()].copy_from_slice(&second[arms[1].clone()]);
            at
        };
        let all: Vec<Vec<f64>> =
            first.iter().flat_map(|first| second.iter().map(|second| with_second(first, second))).collect();
        let free = are_states_free(context, &model, &context.fixed, &all, tally);
        for (at, is_free) in all.into_iter().zip(free) {
            let so_far = match is_free {
                false => 1,
                true => match self.ways([giver, taker], &at, world_from_object, tally) {
                    Ok([way_in, way_out]) => {
                        return Some(Give { giver: self.giver, taker: self.taker, way_in, way_out });
                    }
                    Err(reason) => reason,
                },
            };
            self.reached = self.reached.max(so_far);
            // Farther than one hand by itself.
            tally.keep(Stage::Exchange, 2 + so_far, || Try {
                reason: REASONS[so_far].into(),
                world_from_object: Some(*world_from_object),
                grasps: hands.to_vec(),
                state: Some(at),
            });
        }
        None
    }

    /// The taker comes and closes, the giver opens and leaves. Err: index of the reason.
    fn ways(
        &mut self,
        [giver, taker]: [(usize, &Grasp); 2],
        at: &[f64],
        world_from_object: &Pose,
        tally: &mut Tally,
    ) -> Result<[Smooth; 2], usize> {
        let context = self.context;
        let way_in = self.way(taker, giver, at, world_from_object, tally).ok_or(2usize)?;
        if !can_close(context, taker.0, [&with_fingers(context, at, taker.0, &taker.1.open), at], tally) {
            return Err(3);
        }
        if !can_close(context, giver.0, [at, &with_fingers(context, at, giver.0, &giver.1.open)], tally) {
            return Err(4);
        }
        let way_out = self.way(giver, taker, at, world_from_object, tally).ok_or(5usize)?;
        Ok([way_in, way_out])
    }

    /// The straight way of one open hand from the object, while the other one holds it. It ends where searches for motions may begin.
    fn way(
        &mut self,
        (hand, grasp): (usize, &Grasp),
        holder: (usize, &Grasp),
        at: &[f64],
        world_from_object: &Pose,
        tally: &mut Tally,
    ) -> Option<Smooth> {
        let context = self.context;
        let opened = with_fingers(context, at, hand, &grasp.open);
        let open = self.open[usize::from(hand == self.giver[0])].get_or_insert_with(|| {
            let free = &context.arms_and_torso;
            let carried = (holder.0, &holder.1.object_from_hand.inverse());
            Rc::new(Open {
                alone: context.model(&opened, free, None),
                holding: context.model(&opened, free, Some(carried)),
            })
        });
        let open = Rc::clone(open);
        let direction = world_from_object.rotation * grasp.direction;
        WAY_SHARES.iter().find_map(|share| {
            let way = straight(context, hand, &opened, &(-direction * grasp.distance * *share))?;
            if !is_state_free(context, &open.holding, &context.fixed, way.ends()[1], tally) {
                return None;
            }
            let timed = way.timed(&context.limits, 1.0, LINE_STEPS);
            is_way_free(context, (&open.alone, hand), world_from_object, &timed, tally).then_some(way)
        })
    }
}

/// The robot with both hands at the object, coordinates `free`, all others as in `state`.
pub fn pair_model(context: &Context, [giver, taker]: [[usize; 2]; 2], state: &[f64], free: &[usize]) -> ArmModel {
    let hand_from_object = context.hands[giver[0]].grasps[giver[1]].object_from_hand.inverse();
    let attached = context.attached(giver[0], &hand_from_object, &[taker[0]]);
    ArmModel::new(context.robot, &context.covers.links, &[attached], state, free)
}

/// A robot with one hand open.
struct Open {
    /// Without the object.
    alone: ArmModel,
    /// The other hand holds the object.
    holding: ArmModel,
}

/// The 24 turns that bring a cube to itself.
pub fn turns() -> Vec<UnitQuaternion<f64>> {
    let axes: Vec<Vector> = (0..3).flat_map(|k| [Vector::ith(k, 1.0), Vector::ith(k, -1.0)]).collect();
    let mut found = Vec::new();
    for x in &axes {
        for y in axes.iter().filter(|y| y.dot(x) == 0.0) {
            let matrix = Matrix3::from_columns(&[*x, *y, x.cross(y)]);
            found.push(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix)));
        }
    }
    found
}
