//! Names, promises and inputs of a plan.

use super::Breeder;
use super::choice::{any_closed, pick, swap_two};
use super::edit::shift;
use regrasp_plan::check::violation::ViolationKind::{
    ClosureLost, FrictionAboveScene, GoalMismatch, InputHashMismatch, PromiseBroken, StartMismatch, WrongHolder,
    WrongScene,
};
use regrasp_plan::plan::ContactState;

impl Breeder<'_> {
    pub(super) fn break_header(&mut self) {
        let scene_friction = self.task.object().friction;
        self.add("friction promise raised", &[FrictionAboveScene], |plan, rng| {
            plan.promises.friction = scene_friction * rng.uniform(1.0001, 1.05);
            (scene_friction > 0.0).then_some(())
        });
        self.add("friction promise lowered below closure", &[ClosureLost, PromiseBroken], |plan, rng| {
            plan.promises.friction *= rng.uniform(0.001, 0.02);
            any_closed(plan, rng).map(|_| ())
        });
        self.add("contact tolerance raised", &[PromiseBroken], |plan, rng| {
            plan.promises.contact_tolerance = rng.uniform(0.51e-3, 0.7e-3);
            Some(())
        });
        self.add("margin required raised above the one kept", &[PromiseBroken], |plan, rng| {
            plan.promises.required_margin = plan.promises.kept_margin + rng.uniform(0.001, 0.01);
            Some(())
        });
        self.add("margins raised above the true one", &[ClosureLost], |plan, rng| {
            // No grasp has a Ferrari-Canny radius above one.
            plan.promises.kept_margin = rng.uniform(1.0, 1.1);
            plan.promises.required_margin = plan.promises.kept_margin;
            any_closed(plan, rng).map(|_| ())
        });
        self.add("kept margin invented", &[PromiseBroken], |plan, rng| {
            plan.promises.kept_margin = rng.uniform(0.9, 1.0);
            Some(())
        });
        self.add("torque scale changed", &[PromiseBroken], |plan, rng| {
            plan.promises.torque_scale *= rng.uniform(1.001, 1.01);
            Some(())
        });
        self.add("input hash changed", &[InputHashMismatch], |plan, rng| {
            let input = pick(&mut plan.inputs, rng)?;
            let flipped = if input.sha256.starts_with('0') { "1" } else { "0" };
            input.sha256.replace_range(0..1, flipped);
            Some(())
        });
        self.add("input left out", &[InputHashMismatch], |plan, rng| {
            let n_inputs = plan.inputs.len();
            (n_inputs > 0).then(|| drop(plan.inputs.remove(rng.below(n_inputs))))
        });
        self.add("start asked for elsewhere", &[StartMismatch], |plan, rng| {
            shift(&mut plan.start, rng, 1e-5, 1e-4);
            Some(())
        });
        self.add("goal asked for elsewhere", &[GoalMismatch], |plan, rng| {
            shift(&mut plan.goal, rng, 1e-5, 1e-4);
            plan.promises.tracking.is_none().then_some(())
        });
        self.add("two joint names swapped", &[WrongScene], |plan, rng| swap_two(&mut plan.joint_names, rng));
        self.add("joint that stands still invented", &[WrongScene], |plan, rng| {
            plan.held_joints.insert("no_such_joint".into(), rng.uniform(-1.0, 1.0)).is_none().then_some(())
        });
        self.add("joint that stands still left out", &[WrongScene], |plan, _| plan.held_joints.pop_first().map(|_| ()));
        self.add("joint that stands still elsewhere", &[WrongScene], |plan, rng| {
            *plan.held_joints.values_mut().next()? += rng.uniform(1e-6, 1e-3);
            Some(())
        });
        self.add("two finger names swapped", &[WrongScene], |plan, rng| swap_two(&mut plan.fingers, rng));
        self.add("hand of another name", &[WrongScene], |plan, _| {
            plan.hand.push('2');
            Some(())
        });
        self.add("object of another name", &[WrongScene], |plan, _| {
            plan.object.push('2');
            Some(())
        });
        self.add("answer to a query of another name", &[WrongScene], |plan, _| {
            plan.query.push('2');
            Some(())
        });
        self.add("object said to be held by nobody", &[WrongHolder], |plan, rng| {
            pick(&mut plan.segments, rng)?.held_by.clear();
            Some(())
        });
        self.add("object said to be held by another hand too", &[WrongHolder], |plan, rng| {
            pick(&mut plan.segments, rng)?.held_by.push("other".into());
            Some(())
        });
        self.add("object let go by all fingers, said to be held by nobody", &[WrongHolder], |plan, rng| {
            let segment = pick(&mut plan.segments, rng)?;
            segment.held_by.clear();
            pick(&mut segment.waypoints, rng)?.contacts.fill(ContactState::FREE);
            Some(())
        });
        self.add("task renamed", &[WrongScene], |plan, _| {
            plan.task = if plan.task == "tracking" { "in_hand" } else { "tracking" }.into();
            Some(())
        });
    }
}
