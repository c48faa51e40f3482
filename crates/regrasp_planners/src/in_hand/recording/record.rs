//! The plan as it is written to a file, and what a waypoint says when it is read back.

use crate::in_hand::searching::legs::Solution;
use crate::settings::InHandSettings;
use regrasp_manipulation::forces::limits::Unbalanced;
use regrasp_manipulation::grasp::sequence::{Motion, Sequence};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::recording::recorder::{Joins, Recorder};
use regrasp_plan::plan::{Plan, Statistics};
use regrasp_scene::InHandQuery;

/// Settings as plans have them.
pub fn settings_of(settings: &InHandSettings) -> serde_json::Value {
    serde_json::to_value(settings).unwrap_or_default()
}

/// Makes the plan of `solution`.
///
/// Errors: a moment at which no contact forces balance the weight: a plan without them is none.
pub fn record(
    model: &Model,
    settings: &InHandSettings,
    query: &InHandQuery,
    seed: u64,
    solution: &Solution,
    statistics: Statistics,
) -> Result<Plan, Unbalanced> {
    let Solution { way, steps_to_way } = solution;
    let mut recorder = Recorder::at(model, way.start(), Joins::Nothing);
    recorder.sequence(way);
    let plan = recorder.finish(query, seed, steps_to_way, statistics)?;
    Ok(Plan { method: settings.method.name().into(), settings: settings_of(settings), ..plan })
}

/// The smallest closure margin of the fingers that hold, at any moment: that is what a plan promises.
pub fn kept_margin(model: &Model, way: &Sequence) -> f64 {
    let mut kept = model.closure_margin(&way.end().contacts, way.end().holding);
    for (index, step) in way.steps().iter().enumerate() {
        let before = way.state_before(index);
        let holding = match step.motion() {
            Motion::Transfer(moments) => {
                if model.any_rolls() {
                    let margins = moments.iter().map(|moment| model.closure_margin(&moment.contacts, before.holding));
                    kept = margins.fold(kept, f64::min);
                }
                before.holding
            }
            Motion::Regrasp { finger, .. } => before.holding & !(1 << finger),
        };
        kept = kept.min(model.closure_margin(&before.contacts, holding));
    }
    kept
}
