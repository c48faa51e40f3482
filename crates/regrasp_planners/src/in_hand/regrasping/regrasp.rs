//! Sequences of relocations from one grasp to another, the object standing still: which finger first.

use crate::in_hand::grasps::candidate::{Candidate, Choice};
use crate::in_hand::grasps::closure_table::ClosureTable;
use regrasp_base::Rng;
use regrasp_manipulation::forces::held::balances;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::relocation::{Foothold, relocate};
use regrasp_manipulation::workspace::Workspace;
use regrasp_roadmap::astar::{AStar, Limits};
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Relocations already tried from one state between one set of options: what moved before decides what is in the way.
#[derive(Debug, Default)]
pub struct Tried {
    /// (options of all fingers before, finger, option after) and the path, if there is one.
    known: Vec<(Choice, usize, usize, Option<Vec<Coordinates>>)>,
    /// True when one was refused as the others cannot balance the weight: that is counted by itself.
    pub lacks_forces: bool,
}

impl Tried {
    /// True when a relocation on a way to `goal` was tried and has no path, with every finger where it was or where `goal` has it.
    pub fn failed_towards(&self, goal: &Choice) -> bool {
        let is_on_way =
            |before: &Choice| before.iter().zip(goal).all(|(&option, &wanted)| option == 0 || option == wanted);
        self.known.iter().any(|(before, f, option, path)| path.is_none() && *option == goal[*f] && is_on_way(before))
    }

    /// True when this relocation was tried and has no path.
    fn failed(&self, before: &Choice, finger: usize, option: usize) -> bool {
        self.known.iter().any(|(c, f, o, path)| path.is_none() && *f == finger && *o == option && c == before)
    }
}

/// Relocations over options, of which the options 0 are where the fingers are in `start`.
struct Relocations<'r, 'm> {
    workspace: &'r mut Workspace<'m>,
    start: &'r GraspState,
    options: &'r [Vec<Candidate>],
    tried: &'r mut Tried,
    rng: &'r mut Rng,
}

/// Moves fingers one at a time from option 0 of each to `goal`; each leaves only where the others that hold are closed.
///
/// Depth first over the orders; what failed once is not tried again. `start` holds the options 0.
pub fn regrasp(
    workspace: &mut Workspace,
    start: &GraspState,
    options: &[Vec<Candidate>],
    goal: &Choice,
    table: &mut ClosureTable,
    tried: &mut Tried,
    rng: &mut Rng,
) -> Option<Sequence> {
    let mut current: Choice = goal.iter().map(|_| 0).collect();
    let relocations = Relocations { workspace, start, options, tried, rng };
    let mut orders = Orders { relocations, goal, table, dead: Vec::new(), order: Vec::new() };
    if !orders.lead_on_from(&mut current) {
        return None;
    }
    let Orders { order, relocations: Relocations { tried, .. }, .. } = orders;
    let mut way = Sequence::at(start.clone());
    for (finger, which) in order {
        way.push_regrasp(finger, options[finger][goal[finger]].contact, tried.known[which].3.clone()?);
    }
    Some(way)
}

/// What a choice of options is to be changed into.
pub struct ChangeGoal<G, N> {
    /// True for a choice that will do.
    pub is_there: G,
    /// At most the number of relocations that a choice is away from one that will do.
    pub n_away: N,
}

/// Moves fingers one at a time from option 0 of each by the fewest relocations to a choice that is a goal, over other
/// options where need be: where two grasps have too few fingers in common to hold by, a third one leads from one to the
/// other.
///
/// The order is sought in closure alone; a relocation that is then found impossible is left out and the order sought again,
/// with `n_tries` relocations tried in all. `start` holds the options 0.
pub fn regrasp_over(
    workspace: &mut Workspace,
    start: &GraspState,
    options: &[Vec<Candidate>],
    goal: &ChangeGoal<impl Fn(&Choice) -> bool, impl Fn(&Choice) -> f64>,
    table: &mut ClosureTable,
    n_tries: usize,
    rng: &mut Rng,
) -> Option<Sequence> {
    let n = options.len();
    let all = (1u32 << n) - 1;
    let base = options.iter().map(Vec::len).max().unwrap_or(1);
    let as_node = |choice: &Choice| choice.iter().rev().fold(0, |node, &option| node * base + option);
    let as_choice = |mut node: usize| -> Choice {
        let digit = |_| {
            let option = node % base;
            node /= base;
            option
        };
        (0..n).map(digit).collect()
    };
    let first: Choice = (0..n).map(|_| 0).collect();
    let (mut tried, mut search) = (Tried::default(), AStar::new());
    loop {
        let limits = Limits { n_expanded: MOST_GRASPS, ..Limits::NONE };
        let neighbours = |node: usize, edges: &mut Vec<(usize, f64)>| {
            let choice = as_choice(node);
            for finger in 0..n {
                if !table.is_closed(&choice, all & !(1 << finger)) {
                    continue;
                }
                for option in (0..options[finger].len()).filter(|&option| option != choice[finger]) {
                    // The others hold wherever the finger lands.
                    if !tried.failed(&choice, finger, option) {
                        let mut next = choice.clone();
                        next[finger] = option;
                        edges.push((as_node(&next), 1.0));
                    }
                }
            }
        };
        let is_there = |node: usize| (goal.is_there)(&as_choice(node));
        let n_left = |node: usize| (goal.n_away)(&as_choice(node));
        let path = search.cheapest_path_within(limits, as_node(&first), is_there, neighbours, n_left)?;
        let mut way = Sequence::at(start.clone());
        let is_whole = path.nodes.windows(2).all(|pair| {
            let (before, after) = (as_choice(pair[0]), as_choice(pair[1]));
            let Some(finger) = (0..n).find(|&finger| before[finger] != after[finger]) else { return false };
            let option = after[finger];
            let (workspace, rng) = (&mut *workspace, &mut *rng);
            let mut relocations = Relocations { workspace, start, options, tried: &mut tried, rng };
            let which = relocations.attempt(&before, finger, option);
            let Some(path) = &tried.known[which].3 else { return false };
            way.push_regrasp(finger, options[finger][option].contact, path.clone());
            true
        });
        if is_whole {
            return Some(way);
        }
        if tried.known.len() >= n_tries {
            return None;
        }
    }
}

/// Most grasps looked at for an order.
const MOST_GRASPS: usize = 400;

/// Orders of relocations, depth first.
struct Orders<'o, 'r, 'm, 't> {
    relocations: Relocations<'r, 'm>,
    goal: &'o Choice,
    table: &'o mut ClosureTable<'t>,
    /// Choices from which nothing leads to the goal.
    dead: Vec<Choice>,
    /// Fingers relocated so far, each with the index of its relocation.
    order: Vec<(usize, usize)>,
}

impl Orders<'_, '_, '_, '_> {
    /// True when relocations lead from `current` to the goal.
    fn lead_on_from(&mut self, current: &mut Choice) -> bool {
        let goal = self.goal;
        if current == goal {
            return true;
        }
        if self.dead.contains(current) {
            return false;
        }
        let all = (1u32 << goal.len()) - 1;
        for finger in 0..goal.len() {
            if current[finger] == goal[finger] || !self.table.is_closed(current, all & !(1 << finger)) {
                continue;
            }
            let which = self.relocations.attempt(current, finger, goal[finger]);
            if self.relocations.tried.known[which].3.is_none() {
                continue;
            }
            let before = std::mem::replace(&mut current[finger], goal[finger]);
            self.order.push((finger, which));
            if self.lead_on_from(current) {
                return true;
            }
            self.order.pop();
            current[finger] = before;
        }
        self.dead.push(current.clone());
        false
    }
}

impl Relocations<'_, '_> {
    /// Index in `tried` of the relocation of `finger` from where `current` has it to `option`.
    fn attempt(&mut self, current: &Choice, finger: usize, option: usize) -> usize {
        let Relocations { workspace, start, options, tried, rng } = self;
        let known = tried.known.iter().position(|(c, f, o, _)| c == current && *f == finger && *o == option);
        if let Some(which) = known {
            return which;
        }
        let mut state = GraspState::clone(start);
        for (f, &taken) in current.iter().enumerate() {
            if taken != 0 {
                state.set_contact(f, options[f][taken].contact);
                state.joints[f].clone_from(&options[f][taken].joints);
            }
        }
        let others = state.holding & !(1 << finger);
        if !balances(workspace, &state.world_from_object, &state.joints, &state.contacts, others) {
            tried.lacks_forces = true;
            tried.known.push((current.clone(), finger, option, None));
            return tried.known.len() - 1;
        }
        workspace.set_state(&state);
        let to = &options[finger][option];
        let path = relocate(
            workspace,
            &state.world_from_object,
            finger,
            Foothold { contact: state.contact(finger).as_ref(), joints: &state.joints[finger] },
            Foothold { contact: to.contact.as_ref(), joints: &to.joints },
            rng,
        );
        tried.known.push((current.clone(), finger, option, path));
        tried.known.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_failed_counts_for_the_grasps_that_it_is_on_the_way_to() {
        let choice = |options: &[usize]| -> Choice { options.iter().copied().collect() };
        // With finger 0 on its option 1, finger 2 found no path to its option 3.
        let known = vec![(choice(&[1, 0, 0]), 2, 3, None), (choice(&[0, 0, 0]), 0, 1, Some(Vec::new()))];
        let tried = Tried { known, lacks_forces: false };
        for (goal, expected) in [
            ([1, 0, 3], true),
            ([1, 2, 3], true),
            ([1, 0, 0], false),
            ([1, 0, 2], false),
            ([2, 0, 3], false),
            ([0, 0, 3], false),
        ] {
            assert_eq!(tried.failed_towards(&choice(&goal)), expected, "{goal:?}");
        }
    }
}
