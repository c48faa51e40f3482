//! Fingers that cannot follow an object that moves, told with the count of their joints.

use crate::failure::{Failure, FailureKind};
use crate::model::Model;

/// How many independent joints every finger has, and which fingers follow a moving object.
pub fn joints_in_words(model: &Model) -> String {
    let fingers = || model.fingers.iter().zip(&model.view.hand.fingers);
    let counts: Vec<String> = fingers()
        .map(|(prepared, finger)| {
            let n = prepared.ik.chain().n_coordinates();
            let is_flat = if prepared.closes() && n >= 3 { " in one plane" } else { "" };
            format!("\"{}\" has {n}{is_flat}", finger.name)
        })
        .collect();
    let n_following = fingers().filter(|(prepared, _)| !prepared.closes()).count();
    let following = match n_following {
        0 => "none can".to_owned(),
        n if model.may_move_object() => format!("{n} can"),
        n => format!("{n} can, and cannot hold an object without the others"),
    };
    format!("Of its {} fingers {following}: {}", counts.len(), counts.join(", "))
}

/// Refuses hands of which some fingers cannot follow the object, for plans in which all fingers hold while it moves.
pub fn refuse_fingers_that_cannot_follow(model: &Model) -> Result<(), Failure> {
    if model.closing_fingers() == 0 {
        return Ok(());
    }
    let message = format!(
        "all fingers are to hold while the object moves, and some cannot follow it. {}",
        joints_in_words(model)
    );
    let advice = "plan with the method gait and release_rule = \"where_others_hold\", or name the other fingers alone in the hand file";
    Err(Failure::bare(FailureKind::Impossible, message, advice))
}
