//! Starts at which bodies are nearer to each other than plans keep them: where fingers have come to rest, or where a plan with less clearance
//! ended. Those pairs may stay about as near as they are, and nothing else: with less clearance for all pairs, links would come near
//! wherever the plan goes.

use super::{TipMode, Workspace};
use crate::grasp::state::GraspState;
use crate::model::Model;

/// A pair keeps the first of these shares of the clearance that it has at the start, about half of its distance or more, or else the least distance.
const SHARES: [f64; 6] = [0.8, 0.5, 0.3, 0.15, 0.08, 0.04];
/// Least distance that is kept, in metres, and of the tip of a free finger from the object. By hand: below it plans have no room to stray
/// from what was tested. Of free fingertips the checker asks for half of that.
const LEAST: f64 = 2e-5;
const LEAST_OF_TIPS: f64 = 1e-4;

/// Distances that the pairs of `model` keep which are nearer than the clearance at `start`: `Model::kept`. Pairs that are nearer than every
/// such distance have none: the start is refused for them.
pub fn distances_to_keep(model: &Model, start: &GraspState) -> Vec<f64> {
    let mut workspace = Workspace::new(model);
    workspace.set_state(start);
    workspace.stand();
    let mut kept = Vec::new();
    for index in 0..model.pairs.len() {
        let tip_of = model.pairs[index].tip_of;
        let presses = tip_of.is_some_and(|finger| start.holding & (1 << finger) != 0);
        if presses || workspace.pair_is_clear(index, TipMode::AllHold) {
            continue;
        }
        let (usual, least) = match tip_of {
            Some(_) => (model.free_clearance(), LEAST_OF_TIPS),
            None => (model.settings.clearance, LEAST),
        };
        let shares = SHARES.iter().map(|share| share * usual).filter(|distance| *distance >= least);
        let mut distances = shares.chain([least]);
        if let Some(distance) = distances.find(|distance| workspace.apart(index, *distance, 0.0)) {
            kept.resize(model.pairs.len(), f64::INFINITY);
            kept[index] = distance;
        }
    }
    kept
}
