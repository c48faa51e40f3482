//! The grasp that a plan ends with. The next plan begins with it: where it holds little, that plan holds as little.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::Choice;
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::pool::Pool;
use crate::in_hand::regrasping::regrasp::{ChangeGoal, regrasp_over};
use arrayvec::ArrayVec;
use regrasp_base::Rng;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::{GraspState, MAX_FINGERS};

/// Contacts per finger among which a better grasp is sought. By hand.
const CONTACTS: usize = 10;
/// Relocations tried for it. By hand.
const RELOCATIONS: usize = 12;

/// The fewest relocations after `end` that lead to a grasp of all fingers with the closure margin `wanted`; None where `end` holds so
/// much, and where no such relocations are found. It ends by itself, after few tries: the search's limits are not looked at.
pub fn better_end(search: &mut Search, end: &GraspState, wanted: f64) -> Option<Sequence> {
    let model = search.model();
    let holds = |contacts: &[Contact], holding: u32| model.closure_margin_up_to(contacts, holding, wanted) >= wanted;
    if !model.may_release || holds(&end.contacts, end.holding) {
        return None;
    }
    let pose = end.world_from_object;
    let options = Pool::new(&pose, &pose, model.n_fingers()).around(search, end, CONTACTS);
    let mut table = ClosureTable::new(model, &options);
    let mut rng = Rng::child(&search.rng, "ending", 0);
    search.rng.bits();
    let is_there = |choice: &Choice| {
        let contacts: Option<ArrayVec<Contact, MAX_FINGERS>> =
            choice.iter().zip(&options).map(|(&option, of_finger)| of_finger[option].contact).collect();
        contacts.is_some_and(|contacts| holds(&contacts, model.all_fingers()))
    };
    let goal = ChangeGoal { is_there, n_away: |_: &Choice| 0.0 };
    regrasp_over(&mut search.workspace, end, &options, &goal, &mut table, RELOCATIONS, &mut rng)
}
