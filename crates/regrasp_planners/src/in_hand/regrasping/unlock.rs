//! Moving the finger that is seldom free to move. Where the others hardly ever hold without one finger (the thumb, against
//! a box), trees that take what follows farthest never meet a grasp in which it may leave. Such grasps are sought here.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::Choice;
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::pool::Pool;
use crate::in_hand::regrasping::regrasp::{ChangeGoal, regrasp_over};
use regrasp_base::Rng;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::GraspState;

/// A finger that the others let go in less than this share of the grasps seen is seldom free to move.
const SELDOM: f64 = 0.1;

/// Grasps seen before that is judged.
const LEAST_SEEN: u64 = 100;

/// Share of the extensions that then seek to move such a finger. By measurement, 10 seeds: allegro/cube57_x takes a fifth of
/// the work that it takes without them; with 0.3 box_x and cube45_x take twice that of 0.65, with 0.8 box_x takes less and
/// cube45_x twice to three times as much.
const SHARE: f64 = 0.6;

/// Contacts per finger over which it is tried. By measurement, 10 seeds and a share of 0.5: with 5, 8 and 12 allegro/box_x
/// takes 1.9, 1.1 and 0.7 million configurations, cube45_x 1.6, 1.4 and 1.1; with a share of 0.8, 12 are too many.
const CONTACTS: usize = 10;

/// Relocations tried for it.
const RELOCATIONS: usize = 24;

/// The finger that the next extension is to move, which few grasps let go; mostly none.
pub fn draw_bound_finger(search: &mut Search) -> Option<usize> {
    let mut bound: Vec<usize> = (0..search.model().n_fingers())
        .filter(|&finger| {
            let seen = search.tally.release(finger);
            seen.n_grasps >= LEAST_SEEN && (seen.n_held as f64) < SELDOM * seen.n_grasps as f64
        })
        .collect();
    if bound.is_empty() || !search.rng.chance(SHARE) {
        return None;
    }
    Some(bound.swap_remove(search.rng.below(bound.len())))
}

/// The fewest relocations from `state` that end with one of `finger`, over contacts of the `pool` at the same pose.
pub fn unlock(search: &mut Search, state: &GraspState, finger: usize, pool: &mut Pool) -> Option<Sequence> {
    let model = search.model();
    let options = pool.around(search, state, CONTACTS);
    let mut table = ClosureTable::new(model, &options);
    let mut rng = Rng::child(&search.rng, "unlock", 0);
    search.rng.bits();
    let goal = ChangeGoal {
        is_there: |choice: &Choice| choice[finger] != 0,
        n_away: |choice: &Choice| f64::from(u8::from(choice[finger] == 0)),
    };
    regrasp_over(&mut search.workspace, state, &options, &goal, &mut table, RELOCATIONS, &mut rng)
}
