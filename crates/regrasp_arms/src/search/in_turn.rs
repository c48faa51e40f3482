//! Robots of several arms: one arm after the other first, all of them at once where that does not lead to the goal.
//!
//! An arm alone has half the coordinates, and few problems need two arms to give way to each other at once. Shortcuts let them move
//! together afterwards.

use super::rrt_connect::{Region, RrtOutcome, RrtSettings, rrt_connect};
use crate::motion::Collider;
use regrasp_base::{Budget, Rng};
use regrasp_manipulation::motion_settings::PartsMove;

/// Settings of [`in_turn`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InTurnSettings {
    /// The search for one arm. Its samples are those of one order of the arms.
    pub one: RrtSettings,
    /// The search for all coordinates.
    pub all: RrtSettings,
    /// Which parts may move at the same time.
    pub parts: PartsMove,
}

impl Default for InTurnSettings {
    fn default() -> Self {
        let one = RrtSettings { max_samples: 1500, ..RrtSettings::default() };
        InTurnSettings { one, all: RrtSettings::for_dimension(14), parts: PartsMove::AtOnce }
    }
}

/// A path from `start` to `goal`: parts in turn, in any order, then all coordinates at once.
pub fn in_turn(
    collider: &mut Collider,
    start: &[f64],
    goal: &[f64],
    settings: &InTurnSettings,
    rng: &mut Rng,
    budget: &Budget,
) -> RrtOutcome {
    let model = collider.model;
    let region = Region::of(model, &[start, goal]);
    let mut outcome = RrtOutcome { path: None, n_nodes: 0, n_samples: 0, interrupt: None };
    let parts = model.parts();
    let all = parts.arms.into_iter().chain([parts.common]);
    let moving: Vec<Vec<usize>> = all.filter(|own| own.iter().any(|&k| start[k] != goal[k])).collect();
    let only_in_turn = settings.parts == PartsMove::InTurn;
    if (if only_in_turn { 1 } else { 2 }..=4).contains(&moving.len()) {
        if !only_in_turn && collider.is_sampled_free(start, goal) {
            outcome.path = Some(vec![start.to_vec(), goal.to_vec()]);
            return outcome;
        }
        for order in orders(moving.len()) {
            let mut path = vec![start.to_vec()];
            for &part in &order {
                let asked = Leg { from: &path[path.len() - 1], goal, part: &moving[part] };
                let leg = leg(collider, &asked, &region, settings, rng, budget);
                outcome.n_nodes += leg.n_nodes;
                outcome.n_samples += leg.n_samples;
                outcome.interrupt = leg.interrupt;
                match leg.path {
                    Some(leg) => path.extend(leg.into_iter().skip(1)),
                    None => {
                        path.clear();
                        break;
                    }
                }
            }
            if outcome.interrupt.is_some() {
                break;
            }
            if !path.is_empty() {
                outcome.path = Some(path);
                break;
            }
        }
        everything(collider);
        if outcome.path.is_some() || outcome.interrupt.is_some() || only_in_turn {
            return outcome;
        }
    }
    let goals = [goal.to_vec()];
    let all = rrt_connect(start, &goals, &region, &settings.all, rng, budget, |a, b| collider.is_sampled_free(a, b));
    RrtOutcome { n_nodes: outcome.n_nodes + all.n_nodes, n_samples: outcome.n_samples + all.n_samples, ..all }
}

fn everything(collider: &mut Collider) {
    collider.only(|_| true, |_| true);
}

/// One part goes from where it is at `from` to where it is at `goal`; all others stay.
struct Leg<'a> {
    from: &'a [f64],
    goal: &'a [f64],
    /// The part's coordinates.
    part: &'a [usize],
}

fn leg(
    collider: &mut Collider,
    asked: &Leg,
    region: &Region,
    settings: &InTurnSettings,
    rng: &mut Rng,
    budget: &Budget,
) -> RrtOutcome {
    let Leg { from, goal, part } = *asked;
    let model = collider.model;
    // What no coordinate of the part moves is where it was.
    collider
        .only(|body| model.is_moved_by(body, part), |[a, b]| model.is_moved_by(a, part) || model.is_moved_by(b, part));
    let own = |configuration: &[f64]| part.iter().map(|&k| configuration[k]).collect::<Vec<f64>>();
    let (first, last) = (own(from), own(goal));
    let mut whole = [from.to_vec(), from.to_vec()];
    let mut is_free = |a: &[f64], b: &[f64]| {
        for (i, &k) in part.iter().enumerate() {
            (whole[0][k], whole[1][k]) = (a[i], b[i]);
        }
        collider.is_sampled_free(&whole[0], &whole[1])
    };
    if !is_free(&last, &last) {
        return RrtOutcome { path: None, n_nodes: 0, n_samples: 0, interrupt: None };
    }
    let region = region.of_part(part, from);
    let mut found = rrt_connect(&first, &[last], &region, &settings.one, rng, budget, is_free);
    if let Some(path) = &mut found.path {
        for point in path.iter_mut() {
            let mut whole = from.to_vec();
            part.iter().zip(point.iter()).for_each(|(&k, value)| whole[k] = *value);
            *point = whole;
        }
    }
    found
}

/// All orders of `n` things.
fn orders(n: usize) -> Vec<Vec<usize>> {
    if n == 0 {
        return vec![Vec::new()];
    }
    let mut all = Vec::new();
    for shorter in orders(n - 1) {
        for place in (0..n).rev() {
            let mut order = shorter.clone();
            order.insert(place, n - 1);
            all.push(order);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_all_permutations() {
        let all = orders(4);
        assert_eq!(all.len(), 24);
        let mut sorted = all.clone();
        sorted.sort();
        sorted.dedup();
        assert_eq!(sorted.len(), 24);
        assert_eq!(all[0], [0, 1, 2, 3]);
    }
}
