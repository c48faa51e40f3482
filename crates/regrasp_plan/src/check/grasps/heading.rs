//! Names, files and promises of a list.

use crate::check::continuity::same_positions;
use crate::check::model::CheckedHand;
use crate::check::violation::{Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log, forces, promises};
use crate::plan::Plan;
use regrasp_geometry::Vector;
use regrasp_grasp::list::GraspList;
use regrasp_scene::GraspScene;

/// Masses, frictions and lengths may be off by this share: rounding.
const ROUNDING: f64 = 1e-9;

/// Hand and joints of the list are those of the scene. Nothing can be judged where they are not.
pub(super) fn check_names(model: &CheckedHand, list: &GraspList, log: &mut Log) -> bool {
    let mut is_good = true;
    let fingers: Vec<&str> = model.fingers.iter().map(|finger| finger.name.as_str()).collect();
    let joints: Vec<&str> = model.joint_names.iter().map(String::as_str).collect();
    for (what, seen, expected) in [("fingers", &list.hand.fingers, fingers), ("joints", &list.hand.joint_names, joints)]
    {
        if *seen != expected {
            let message = format!("the list has the {what} {seen:?}, the hand has {expected:?}");
            log.push(Violation::new(Kind::WrongScene, message).subjects([list.hand.name.as_str()]));
            is_good = false;
        }
    }
    if !same_positions(&list.hand.held_joints, &model.held_joints) {
        let [seen, expected] = [&list.hand.held_joints, &model.held_joints].map(|joints| format!("{joints:?}"));
        let message = format!("the list has the joints that stand still {seen}, the hand has {expected}");
        log.push(Violation::new(Kind::WrongScene, message).subjects([list.hand.name.as_str()]));
        is_good = false;
    }
    is_good
}

/// Files, object and promises.
pub(super) fn check_heading(
    scene: &GraspScene,
    list: &GraspList,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) {
    let task = scene.manipulation();
    let object = task.object();
    promises::check_input_files(&plan.inputs, &scene.scene.inputs, log);
    // Closure is judged grasp by grasp: here only what is promised of it.
    let margin = Some(plan.promises.required_margin);
    promises::check_promises(object, plan, settings, margin, log);
    if let Some(promised) = &plan.promises.forces {
        forces::check_promises(&task, model, promised, log);
        let (largest, limit) = (promised.normal_force[1], scene.scene.limits.normal_force);
        if largest > limit {
            let message = format!("normal forces up to {largest} N, the scene allows {limit} N");
            let violation = Violation::new(Kind::LimitExceeded, message).subjects(["normal_force"]);
            log.push(violation.amount(largest, limit));
        }
    }
    let off = (Vector::from(list.object.center_of_mass) - object.center_of_mass.coords).norm();
    for (name, error, limit) in [
        ("friction", (list.object.friction - object.friction).abs(), ROUNDING * object.friction),
        ("center_of_mass", off, ROUNDING * object.radius),
    ] {
        if error > limit {
            let message = format!("{name} of the object is off by {error:.3e}");
            log.push(Violation::new(Kind::PromiseBroken, message).subjects([name]).amount(error, limit));
        }
    }
}
