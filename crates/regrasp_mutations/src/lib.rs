//! Plans broken in exactly one known way each, to test the checker (reliability R1). Every mutant must be rejected. Some
//! are good plans in a hand that is another than the one they were made for: what the plan does not say, the hand does.
//!
//! Amounts are small: a mutant that any check would catch proves nothing.

/// Random places for damage.
mod choice;
/// Contacts and roles of fingers.
mod contacts;
/// Small changes of plans.
mod edit;
/// Forces, torques, and what is promised of them.
mod forces;
/// Fingers that are free, and fingers that are said to be.
mod free;
/// Grasp lists.
pub mod grasps;
/// Good plans in hands of other contacts and couplings.
mod hand;
/// Names, promises, inputs.
mod header;
/// Plans that allow themselves more than the scene does.
mod limits;
/// Tracking and relocations in one plan.
mod mixed;
/// Joints and objects elsewhere.
mod motion;
/// Segments and waypoints.
mod order;
/// Lifting and landing.
mod relocations;
/// Plans of whole robots.
pub mod robots;
/// Fingertips that roll, and fingertips that are said to.
mod rolling;
/// Objects that turn though nothing drives them.
mod still;
/// Plans of pick and place.
pub mod tasks;
/// Times and velocities.
mod times;
/// Tracking: modes, relative velocities, friction of what slides.
mod tracking;
/// Way poses gone wrong.
mod way;

use regrasp_base::Rng;
use regrasp_plan::Plan;
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::violation::ViolationKind;
use regrasp_robot::Hand;
use regrasp_scene::{Manipulation, Scene};

/// A broken plan.
#[derive(Debug, Clone)]
pub struct Mutant {
    /// What was done to it.
    pub name: &'static str,
    /// The broken plan.
    pub plan: Plan,
    /// The scene to judge it in, where that is what was changed.
    pub scene: Option<Scene>,
    /// At least one of these must be reported; others may follow from them.
    pub expected: Vec<ViolationKind>,
}

/// All mutants that `plan`, which must be a good one, has; places and amounts are drawn from `rng`.
///
/// Kinds of damage that the plan offers no place for (a regrasp, an edge, an input file) are left out.
/// Panics if the checker cannot read the hand of `part`.
pub fn mutants(plan: &Plan, task: Manipulation, rng: &mut Rng) -> Vec<Mutant> {
    let model = CheckedHand::new(&task).expect("a good plan was checked in this scene");
    let mut breeder = Breeder { plan, task, model: &model, rng, found: Vec::new() };
    breeder.break_header();
    breeder.break_way();
    breeder.break_order();
    breeder.break_joints();
    breeder.break_object();
    breeder.break_contacts();
    breeder.break_roles();
    breeder.break_relocations();
    breeder.break_contact_models();
    breeder.break_couplings();
    breeder.break_free_fingers();
    breeder.break_rolling();
    breeder.break_forces();
    breeder.break_times();
    breeder.break_tracking();
    breeder.break_mixed();
    breeder.break_limits();
    breeder.break_drive();
    breeder.found
}

struct Breeder<'a> {
    plan: &'a Plan,
    task: Manipulation<'a>,
    model: &'a CheckedHand,
    rng: &'a mut Rng,
    found: Vec<Mutant>,
}

impl Breeder<'_> {
    /// Adds a mutant if `damage` finds a place for it.
    fn add(
        &mut self,
        name: &'static str,
        expected: &[ViolationKind],
        damage: impl FnOnce(&mut Plan, &mut Rng) -> Option<()>,
    ) {
        let mut plan = self.plan.clone();
        if damage(&mut plan, self.rng).is_some() {
            self.found.push(Mutant { name, plan, scene: None, expected: expected.to_vec() });
        }
    }

    /// Adds the plan as it is, in a scene with another hand, if `damage` finds a place for it.
    fn add_hand(
        &mut self,
        name: &'static str,
        expected: &[ViolationKind],
        damage: impl FnOnce(&mut Hand, &mut Rng) -> Option<()>,
    ) {
        let mut scene = self.task.scene.clone();
        if damage(&mut scene.hands[self.task.hand_index].hand, self.rng).is_some() {
            let plan = self.plan.clone();
            self.found.push(Mutant { name, plan, scene: Some(scene), expected: expected.to_vec() });
        }
    }
}
