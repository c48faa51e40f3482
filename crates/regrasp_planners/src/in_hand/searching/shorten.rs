//! Random shortcuts over a sequence of motions: one transfer and one regrasp, in either order, in place of many
//! (Saut 2011, sec. 4.2.1, last step).

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::regrasping::change::{Arrival, regrasp_transfer, transfer_regrasp, whole_transfer};
use crate::settings::Method;
use regrasp_base::{Interrupt, Rng};
use regrasp_manipulation::grasp::sequence::{Motion, Sequence, Step};
use regrasp_manipulation::grasp::state::GraspState;

/// Shortcuts in a row that did not help, after which a plan of the methods of Saut 2011 counts as smooth; twice as many as it
/// has motions where that is more.
const IN_VAIN: usize = 40;

/// What motions cost: relocations first, then transfers.
fn cost(steps: &[Step]) -> (usize, usize) {
    let n_transfers = steps.iter().filter(|step| matches!(step.motion(), Motion::Transfer(_))).count();
    (steps.len() - n_transfers, n_transfers)
}

/// Tries random shortcuts on `way`: as many as the settings say, with the methods of Saut 2011 until many in a row did not help.
/// `at_end` is what is asked of its end.
///
/// A plan that is already there is never given up: the caller's limits only end the shortening.
pub fn shorten(search: &mut Search, way: &mut Sequence, at_end: Arrival) {
    let patience = search.patience.take();
    shorten_in_haste(search, way, at_end);
    search.patience = patience;
}

/// The same; the ways of fingers are not looked for long.
fn shorten_in_haste(search: &mut Search, way: &mut Sequence, at_end: Arrival) {
    let end_is_free = at_end == Arrival::AnyPosture;
    let is_baseline = search.settings.method != Method::Gait;
    let (mut n_tried, mut in_vain) = (0, 0);
    loop {
        let n_steps = way.steps().len();
        let is_enough = match is_baseline {
            true => in_vain >= IN_VAIN.max(2 * n_steps),
            false => n_tried >= search.settings.search.shortcuts,
        };
        if n_steps < 2 || is_enough {
            return;
        }
        (n_tried, in_vain) = (n_tried + 1, in_vain + 1);
        if let Err(Stop::Budget(interrupt)) = search.check() {
            search.cut_by_time |= interrupt != Interrupt::WorkSpent;
            return;
        }
        let first = search.rng.below(n_steps - 1);
        let last = if end_is_free && search.rng.chance(0.3) {
            n_steps - 1
        } else {
            first + 1 + search.rng.below(n_steps - first - 1)
        };
        let arrival = if end_is_free && last + 1 == n_steps { Arrival::AnyPosture } else { Arrival::Exact };
        let old = cost(&way.steps()[first..=last]);
        let (from, to) = (way.state_before(first), way.steps()[last].end());
        if let Some(detour) = direct(search, from, to, arrival, old)
            && cost(detour.steps()) < old
        {
            let fits = way.replace(first..=last, detour);
            debug_assert!(fits, "a direct way from and to the same states");
            in_vain = 0;
        }
    }
}

/// A way from `from` to `to` that is cheaper than `old`, if one of the direct ones is feasible.
fn direct(
    search: &mut Search,
    from: &GraspState,
    to: &GraspState,
    arrival: Arrival,
    old: (usize, usize),
) -> Option<Sequence> {
    let n_changed = (0..from.contacts.len()).filter(|&finger| from.contact(finger) != to.contact(finger)).count();
    let moves = from.world_from_object != to.world_from_object;
    if arrival == Arrival::AnyPosture
        && from.holding & to.holding == to.holding
        && old > (0, usize::from(moves))
        && let Some(way) = whole_transfer(search, from, &to.world_from_object)
    {
        return Some(way);
    }
    if (n_changed, usize::from(moves)) >= old {
        return None;
    }
    let mut rng = Rng::child(&search.rng, "shortcut", 0);
    search.rng.bits();
    transfer_regrasp(search, from, to, arrival, &mut rng)
        .or_else(|| regrasp_transfer(search, from, to, arrival, &mut rng))
}
