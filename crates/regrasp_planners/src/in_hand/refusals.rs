//! Start and goal as the query gives them: what is wrong with them is said before any search.

use crate::settings::{InHandSettings, Method, ReleaseRule};
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_grasp::ContactModel;
use regrasp_grasp::closure::may_close;
use regrasp_grasp::held_at_most;
use regrasp_manipulation::ends::blocked::{refuse_buried_object, refuse_object_out_of_reach};
use regrasp_manipulation::ends::end::End;
use regrasp_manipulation::ends::given_grasp::{Near, given_grasp_at};
use regrasp_manipulation::ends::inside::{refuse_hand_inside, refuse_palm_overlap};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::following::{joints_in_words, refuse_fingers_that_cannot_follow};
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::model::{Model, fingers_in_words, friction_in_words, releasable};
use regrasp_scene::{GraspRequest, InHandQuery, STANDARD_GRAVITY};

/// Refuses what no search can find: hands that cannot hold or never change their grasp, poses at which the object is buried.
pub fn refuse_hopeless(model: &Model, settings: &InHandSettings, query: &InHandQuery) -> Result<(), Failure> {
    refuse_holding_nothing(model)?;
    refuse_too_heavy(model)?;
    if !query.stays() {
        refuse_hand_that_cannot_follow(model)?;
        refuse_method_without_free_fingers(model, settings)?;
    }
    let may_try_transfers = model.n_fingers() == 2 || settings.search.transfers_alone;
    if !query.stays() && (settings.method != Method::Gait || !may_try_transfers) {
        refuse_impossible(model)?;
    }
    let way = query.world_from_object_way.iter().enumerate().map(|(index, pose)| (End::Way(index + 1), pose));
    let ends = [(End::Start, &query.world_from_object_start)].into_iter().chain(way);
    for (end, pose) in ends.chain([(End::Goal, &query.world_from_object_goal)]) {
        refuse_buried_object(model, end, pose)?;
        refuse_object_out_of_reach(model, end, pose)?;
    }
    refuse_palm_overlap(model)?;
    refuse_hand_inside(model, &query.world_from_object_start)
}

/// Refuses hands of which the others can never hold while one finger is away.
pub fn refuse_impossible(model: &Model) -> Result<(), Failure> {
    if model.may_release {
        return Ok(());
    }
    Err(Failure::bare(FailureKind::Impossible, never_released(model), MORE_FINGERS))
}

/// Refuses hands that cannot hold an object even with all fingers.
pub fn refuse_holding_nothing(model: &Model) -> Result<(), Failure> {
    let all: Vec<ContactModel> = model.fingers.iter().map(|finger| finger.contact).collect();
    if may_close(&all, model.frame.friction) {
        return Ok(());
    }
    let message = format!(
        "the hand has {} and friction {}: all of them together cannot hold an object",
        fingers_in_words(model),
        friction_in_words(model)
    );
    let advice = if may_close(&all, USUAL_FRICTION) { MORE_FRICTION } else { MORE_FINGERS };
    Err(Failure::bare(FailureKind::Impossible, message, advice))
}

/// Refuses objects that weigh more than all fingertips hold together, before any search.
pub fn refuse_too_heavy(model: &Model) -> Result<(), Failure> {
    let Some(forces) = &model.forces else { return Ok(()) };
    let (mass, n, largest) = (model.view.object.mass, model.n_fingers(), forces.limits().largest);
    let (weight, held) = (mass * STANDARD_GRAVITY, held_at_most(n, largest, model.frame.friction));
    if weight <= held {
        return Ok(());
    }
    let name = &model.view.object.name;
    let message = format!(
        "\"{name}\" weighs {weight:.0} N ({mass} kg), and {n} fingertips that press with at most {largest} N each, friction {}, hold at \
         most {held:.0} N together: no contact forces balance the weight",
        friction_in_words(model)
    );
    let advice = format!(
        "give the object's mass in kilograms, {:.2} at most (mass of the object; for `regrasp place`, --mass); or let stronger fingers press \
         harder (forces.normal_force in --settings, and normal_force in [limits] of the scene)",
        (100.0 * held / STANDARD_GRAVITY).floor() / 100.0
    );
    Err(Failure::bare(FailureKind::Impossible, message, &advice))
}

/// Refuses to move the object with hands of which the fingers that could follow it cannot hold it.
pub fn refuse_hand_that_cannot_follow(model: &Model) -> Result<(), Failure> {
    if model.closing_fingers() == 0 || model.may_move_object() {
        return Ok(());
    }
    let message = format!(
        "the hand cannot turn objects: a fingertip needs three independent joints that move it in three directions to follow a turning \
         object. {}",
        joints_in_words(model)
    );
    let advice = "ask whether the hand can hold the object (`regrasp place --hold` writes a scene, `regrasp plan --hold` the grasp), or \
                  move hand and object together (task = \"pick_and_place\"); if the real joints move one by one, remove what couples \
                  them (<mimic> in the URDF, [[couplings]] in the hand file)";
    Err(Failure::bare(FailureKind::Impossible, message, advice))
}

/// Refuses methods in which all fingers hold while the object moves, for hands of which some cannot follow it.
fn refuse_method_without_free_fingers(model: &Model, settings: &InHandSettings) -> Result<(), Failure> {
    match settings.method == Method::Gait && settings.search.release_rule == ReleaseRule::WhereOthersHold {
        true => Ok(()),
        false => refuse_fingers_that_cannot_follow(model),
    }
}

/// Friction of skin-like fingertips on most things.
const USUAL_FRICTION: f64 = 0.8;
const MORE_FRICTION: &str = "raise the friction (friction = 0.8 of the object; for `regrasp place`, --friction 0.8): without any, \
     fingertips can only push along the normal";
const MORE_FINGERS: &str = "use a hand with at least 4 fingers, or declare soft fingertips, of which two can hold (contact = \
     \"soft_finger\" and torsion_radius = 0.005 in the hand file; for `regrasp place`, --torsion-radius 0.005)";

fn never_released(model: &Model) -> String {
    format!(
        "the hand has {} and friction {}: {OTHERS_CANNOT_HOLD}. Such a hand can never change its grasp",
        fingers_in_words(model),
        friction_in_words(model)
    )
}

/// Why a hand that holds things can never change its grasp of them.
pub const OTHERS_CANNOT_HOLD: &str = "while one of them is away the others cannot hold an object (fewer than three points cannot: it turns about \
     the line through two of them)";

/// What a search with such a hand that found no transfer comes to: `failure` with the reason for which transfers are all that
/// it has.
pub fn refuse_after_transfers(model: &Model, failure: Failure) -> Failure {
    Failure {
        kind: FailureKind::Impossible,
        message: format!("{}, and no transfer alone was found: {}", never_released(model), failure.message),
        advice: MORE_FINGERS.into(),
        ..failure
    }
}

/// True when all fingers hold and none of them may lift. A finger that is free needs no leave to land.
pub fn is_stuck(model: &Model, state: &GraspState) -> bool {
    state.is_held_by_all() && model.may_release && releasable(model, &state.contacts, state.holding) == 0
}

/// The grasp that the query gives at one end; None where the planner chooses.
pub fn given_grasp(
    model: &Model,
    end: End,
    world_from_object: &Pose,
    request: &GraspRequest,
    rng: &mut Rng,
) -> Result<Option<GraspState>, Failure> {
    let Some(state) = given_grasp_at(model, end, world_from_object, request, Near::Any(rng))? else { return Ok(None) };
    let margin = model.closure_margin(&state.contacts, state.holding);
    if margin < model.settings.closure_margin {
        return Err(end.failure(
            format!(
                "the {} grasp is not force closed with the margin asked for: {margin:.4} of {}, at friction {}",
                end.name(),
                model.settings.closure_margin,
                friction_in_words(model)
            ),
            "move the contacts apart, or lower the margin (--margin)",
        ));
    }
    // Contacts that roll change while the object moves: a finger may be able to lift elsewhere.
    if end == End::Start && !model.any_rolls() && is_stuck(model, &state) {
        return Err(end.failure(
            "in the start grasp no finger can lift: no set of n-1 fingers has force closure".into(),
            "choose other contacts, or let the planner choose (grasp = \"automatic\")",
        ));
    }
    Ok(Some(state))
}
