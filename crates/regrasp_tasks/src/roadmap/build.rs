//! A roadmap is made: graph, pairs of grasps, exchanges.

use super::{DoubleGrasps, TaskRoadmap, graph_model, origin};
use crate::context::{Context, Grasp, Prepared};
use crate::exchange::{Give, Places, is_double_grasp};
use crate::failing::Tally;
use crate::placements::Place;
use crate::station::{Effort, may_hold};
use crate::{Failure, FailureKind, TaskSettings};
use regrasp_arms::roadmap::{BuildSettings, Roads, build};
use regrasp_base::Budget;
use regrasp_grasp::list::GraspList;
use regrasp_scene::{PickAndPlaceQuery, Scene, State};
use serde::{Deserialize, Serialize};

/// Settings of [`build_roadmap`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RoadmapBuildSettings {
    /// Nodes of the roadmap of each arm; 30 make a super graph of about 1,700 nodes.
    pub nodes_per_arm: usize,
    /// Exchanges that are looked for.
    pub exchanges: usize,
    /// Pairs of grasps that are tried for them, at most.
    pub tries: usize,
}

impl Default for RoadmapBuildSettings {
    fn default() -> Self {
        RoadmapBuildSettings { nodes_per_arm: 30, exchanges: 400, tries: 1600 }
    }
}

impl RoadmapBuildSettings {
    /// Err with what is wrong.
    pub fn validate(&self) -> Result<(), String> {
        let at_most = |name: &str, value: usize, most: usize| match value <= most {
            true => Ok(()),
            false => Err(format!("{name} is {value}; at most {most}")),
        };
        at_most("nodes_per_arm", self.nodes_per_arm, 1_000)?;
        at_most("exchanges", self.exchanges, 100_000)?;
        at_most("tries", self.tries, 1_000_000)
    }
}

/// Makes the roadmap of a robot, what rests around it, and lists of grasps. The query says where exchanges are convenient, and what the
/// object is. The same roadmap for the same input and seed.
///
/// Errors: as `plan_pick_and_place` before any search; the budget is used up.
pub fn build_roadmap(
    (scene, state): (&Scene, &State),
    query: &PickAndPlaceQuery,
    lists: &[(usize, GraspList)],
    (settings, of_build): (&TaskSettings, &RoadmapBuildSettings),
    (seed, budget): (u64, &Budget),
) -> Result<TaskRoadmap, Failure> {
    settings.validate().and_then(|()| of_build.validate()).map_err(|problem| Failure::of_settings(&problem))?;
    let prepared = Prepared::new(scene, query, lists, settings)?;
    let models = prepared.models();
    let context = Context::new((scene, state), query, (&prepared, &models), settings, (seed, budget))?;
    let model = graph_model(&context);
    let of_graph = BuildSettings {
        nodes_per_arm: of_build.nodes_per_arm,
        clearance: settings.clearance + settings.search_margin,
        ..BuildSettings::default()
    };
    let roads = build(&model, &context.fixed, &of_graph, seed).map(Roads::new);
    let double_grasps = if settings.hand_over { double_grasps(&context) } else { Vec::new() };
    let exchanges = exchanges(&context, &double_grasps, of_build)?;
    Ok(TaskRoadmap { origin: origin(&context, &model), seed, roads, double_grasps, exchanges })
}

/// All pairs of grasps of hands on different arms.
fn double_grasps(context: &Context) -> Vec<DoubleGrasps> {
    let mut found = Vec::new();
    for first in 0..context.hands.len() {
        for second in first + 1..context.hands.len() {
            if context.hands[first].arm == context.hands[second].arm {
                continue;
            }
            let n = [first, second].map(|hand| context.hands[hand].grasps.len());
            let all = (0..n[0]).flat_map(|i| (0..n[1]).map(move |j| [i, j]));
            let pairs = all.filter(|&[i, j]| is_double_grasp(context, [first, i], [second, j])).collect();
            found.push(DoubleGrasps { hands: [first, second], pairs });
        }
    }
    found
}

/// Rounds among pairs of grasps that fit start and goal, before the others. By hand.
const ROUNDS_OF_FITTING: usize = 8;

/// Exchanges from each hand to each other one: pairs of good grasps first, each grasp once before any one twice.
fn exchanges(
    context: &Context,
    double_grasps: &[DoubleGrasps],
    of_build: &RoadmapBuildSettings,
) -> Result<Vec<Give>, Failure> {
    let mut found = Vec::new();
    let directions: Vec<([usize; 2], Vec<[usize; 2]>)> = double_grasps
        .iter()
        .flat_map(|of| {
            let swapped = of.pairs.iter().map(|&[i, j]| [j, i]).collect();
            [(of.hands, of.pairs.clone()), ([of.hands[1], of.hands[0]], swapped)]
        })
        .collect();
    let n_directions = directions.len().max(1);
    let share = |n: usize| n.div_ceil(n_directions);
    let mut tally = Tally::default();
    let ends = [&context.query.world_from_object_start, &context.query.world_from_object_goal];
    for (hands, mut pairs) in directions {
        // Grasps in which the object can be taken as it stands at the start, and put down as at the goal, come first.
        let fits: [Vec<bool>; 2] = [0, 1].map(|k| {
            let place = Place::new(context, ends[k]);
            let fits =
                |grasp: &Grasp| place.as_ref().is_some_and(|place| may_hold(context, place, hands[k], grasp).is_ok());
            context.hands[hands[k]].grasps.iter().map(fits).collect()
        });
        let score = |pair: &[usize; 2]| {
            let of = |k: usize| context.hands[hands[k]].grasps[pair[k]].score;
            let n_fit = (0..2).filter(|&k| fits[k][pair[k]]).count();
            n_fit as f64 + of(0).min(of(1)).clamp(0.0, 1.0)
        };
        pairs.sort_by(|a, b| score(b).total_cmp(&score(a)).then(a.cmp(b)));
        let n_fit = pairs.iter().take_while(|pair| (0..2).all(|k| fits[k][pair[k]])).count();
        let mut places = Places::new(context, hands);
        let mut used = hands.map(|hand| vec![0usize; context.hands[hand].grasps.len()]);
        let (mut n_found, mut n_tried) = (0, 0);
        let mut is_tried = vec![false; pairs.len()];
        for round in 1.. {
            let mut is_any_left = false;
            // Others get their turn when each grasp of those that fit had some.
            let n_now = if round <= ROUNDS_OF_FITTING { n_fit } else { pairs.len() };
            is_any_left |= n_now < pairs.len();
            for (index, pair) in pairs.iter().take(n_now).enumerate() {
                if n_found >= share(of_build.exchanges) || n_tried >= share(of_build.tries) {
                    break;
                }
                if is_tried[index] {
                    continue;
                }
                is_any_left = true;
                if (0..2).any(|k| used[k][pair[k]] >= round) {
                    continue;
                }
                if let Err(interrupt) = context.budget.check(tally.statistics.work) {
                    return Err(tally.failure(FailureKind::from(interrupt)));
                }
                is_tried[index] = true;
                n_tried += 1;
                (0..2).for_each(|k| used[k][pair[k]] += 1);
                if let Ok(give) =
                    places.give(context, [[hands[0], pair[0]], [hands[1], pair[1]]], Effort::Little, &mut tally)
                {
                    n_found += 1;
                    found.push(give);
                }
            }
            let is_enough = n_found >= share(of_build.exchanges) || n_tried >= share(of_build.tries);
            if !is_any_left || is_enough {
                break;
            }
        }
    }
    found.sort_by_key(|give| (give.giver, give.taker));
    Ok(found)
}
