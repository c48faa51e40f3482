//! Whether one grasp can be changed into another as far as closure says. Closure knows nothing but the contacts in the object's frame, so
//! the grasps may be at two poses of the object.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::{Candidate, Choice};
use crate::in_hand::grasps::closure_table::ClosureTable;
use regrasp_manipulation::grasp::state::GraspState;

/// Units of work that one question is counted as: 4 microseconds on the Allegro hand, about the time of one configuration.
const WORK: u64 = 1;

/// True when the fingers can change one after the other from the contacts of `from` to those of `to`, each while the others hold the
/// object.
pub fn exists(search: &mut Search, from: &GraspState, to: &GraspState) -> bool {
    search.workspace.work += WORK;
    let model = search.model();
    let n = model.n_fingers();
    let of_finger = |finger: usize| vec![Candidate::present(from, finger), Candidate::present(to, finger)];
    let options: Vec<Vec<Candidate>> = (0..n).map(of_finger).collect();
    let all = (1u32 << n) - 1;
    ClosureTable::new(model, &options).of_few(|table| {
        // Sets of fingers that have changed, as bits.
        let (mut is_seen, mut waiting) = (vec![false; 1 << n], vec![0u32]);
        while let Some(changed) = waiting.pop() {
            if changed == all {
                return true;
            }
            let choice: Choice = (0..n).map(|finger| usize::from(changed & (1 << finger) != 0)).collect();
            for bit in (0..n).map(|finger| 1u32 << finger).filter(|bit| changed & bit == 0) {
                let next = changed | bit;
                if !is_seen[next as usize] && table.is_closed(&choice, all & !bit) {
                    is_seen[next as usize] = true;
                    waiting.push(next);
                }
            }
        }
        false
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::in_hand::grasps::sample::draw_state;
    use crate::in_hand::roadmap_tests::with_search;

    /// All 24 orders of four fingers one by one, with closure from the model.
    fn by_all_orders(search: &Search, from: &GraspState, to: &GraspState) -> bool {
        let model = search.model();
        let permutations =
            (0..4u32.pow(4)).map(|code| [code % 4, code / 4 % 4, code / 16 % 4, code / 64].map(|f| f as usize));
        let is_one = |order: &[usize; 4]| (0..4).all(|finger| order.contains(&finger));
        permutations.filter(is_one).any(|order| {
            let mut state = from.clone();
            order.into_iter().all(|finger| {
                let others = state.holding & !(1 << finger);
                let holds = model.closure_margin(&state.contacts, others) >= model.settings.closure_margin;
                state.set_contact(finger, to.contact(finger));
                holds
            })
        })
    }

    #[test]
    fn an_order_exists_where_one_of_all_orders_keeps_the_object_held() {
        with_search("box_90x.toml", |search| {
            // Grasps that were drawn can all be changed into each other; put together of several, they hold less well.
            let drawn: Vec<GraspState> = (0..400).filter_map(|_| draw_state(search)).take(40).collect();
            let put_together = |first: usize| {
                let mut state = drawn[first].clone();
                (1..4).for_each(|finger| state.set_contact(finger, drawn[(first + 7 * finger) % 40].contact(finger)));
                state
            };
            let states: Vec<GraspState> = (0..40).map(put_together).collect();
            let mut n_seen = [0; 2];
            for from in &states {
                for to in &states {
                    let expected = by_all_orders(search, from, to);
                    assert_eq!(exists(search, from, to), expected, "{from:?} {to:?}");
                    n_seen[usize::from(expected)] += 1;
                }
            }
            assert!(n_seen.iter().all(|&n| n > 50), "{n_seen:?}");
        });
    }
}
