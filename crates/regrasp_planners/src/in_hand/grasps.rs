//! Grasps at a given object pose: chosen by the planner, or as the query gives them.

use super::candidates::{Candidate, Way, draw_candidates};
use super::combine::{ClosureTable, rank};
use super::search::{Search, Stop};
use super::state::GraspState;
use super::tally::Reason;
use super::workspace::{Contacts, HandJoints, TipMode};
use regrasp_geometry::Pose;

/// Rounds of candidates before a pose counts as one without grasps.
const MAX_ROUNDS: usize = 40;

/// A grasp with the object at `world_from_object` that is closed, clear, and follows the way to `target` far.
///
/// The random loop generator of paper 000, section 4.2.2: the object is the active part, the fingers the passive one.
/// None when no grasp was found in a bounded number of rounds.
pub fn draw_grasp(search: &mut Search, world_from_object: &Pose, target: &Pose) -> Result<Option<GraspState>, Stop> {
    let model = search.model();
    let way = Way::new(world_from_object, target);
    let settings = &model.settings;
    for _ in 0..MAX_ROUNDS {
        search.check()?;
        search.workspace.place_object(world_from_object);
        let mut options: Vec<Vec<Candidate>> = Vec::with_capacity(model.n_fingers());
        for finger in 0..model.n_fingers() {
            let (n_drawn, n_kept) = (settings.candidates, settings.candidates_kept + 1);
            let found = draw_candidates(
                &mut search.workspace,
                finger,
                world_from_object,
                &way,
                n_drawn,
                n_kept,
                &mut search.rng,
            );
            search.n_samples += found.len() as u64;
            if found.is_empty() {
                search.tally.add(Reason::NoContact(finger));
                break;
            }
            options.push(found);
        }
        if options.len() < model.n_fingers() {
            continue;
        }
        match choose_grasp(search, world_from_object, &options) {
            Some(state) => return Ok(Some(state)),
            None => search.tally.add(Reason::NotClosed),
        }
    }
    Ok(None)
}

/// The best grasp that `options` make, closed and clear.
pub fn choose_grasp(search: &mut Search, world_from_object: &Pose, options: &[Vec<Candidate>]) -> Option<GraspState> {
    let model = search.model();
    let mut table = ClosureTable::new(model, options);
    let ranked = rank(&mut search.workspace, options, &mut table, None, GRASPS_TRIED);
    for combination in ranked {
        let chosen = |f: usize| &options[f][combination.choice[f]];
        let contacts: Contacts = (0..options.len()).map(|f| chosen(f).contact).collect();
        let joints: HandJoints = (0..options.len()).map(|f| chosen(f).joints.clone()).collect();
        search.workspace.set(world_from_object, &joints, &contacts);
        if search.workspace.is_clear(TipMode::AllHold) {
            return Some(GraspState { world_from_object: *world_from_object, contacts, joints });
        }
        if let Some(pair) = search.workspace.blocking_pair {
            search.tally.add(Reason::TooNear(pair));
        }
    }
    None
}

/// Closed grasps that are tested for collision.
const GRASPS_TRIED: usize = 4;
