//! The checker of plans of pick and place, on plans that were made without a planner.

use crate::made_by_hand::{MadeByHand, hand_over, one_arm};
use regrasp_plan::AnyPlan;
use regrasp_plan::RobotPlan;
use regrasp_plan::check::{CheckSettings, Report, ViolationKind as Kind, check_any, check_pick_and_place};
use regrasp_plan::format::{read_any, robot_to_json};
use regrasp_scene::Query;
use std::path::Path;

fn judge(made: &MadeByHand, plan: &RobotPlan) -> Report {
    let around = (&made.loaded.scene, &made.loaded.state);
    check_pick_and_place(around, Some(&made.query), plan, &CheckSettings::default())
}

fn kinds(report: &Report) -> Vec<Kind> {
    let mut kinds: Vec<Kind> = report.violations.iter().map(|violation| violation.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

#[track_caller]
fn accepted(report: &Report) {
    let said: Vec<String> = report.violations.iter().map(ToString::to_string).collect();
    assert!(report.accepted(), "{}\n{:?}", said.join("\n"), report.left_out);
}

#[test]
fn plans_of_one_arm_and_of_a_hand_over_are_accepted_and_read_back() {
    for (made, n_segments) in [(one_arm(), 11), (hand_over(), 16)] {
        assert_eq!(made.plan.segments.len(), n_segments);
        let report = judge(&made, &made.plan);
        accepted(&report);
        assert_eq!(report.assumed.len(), 2);
        assert!(report.min_margin.is_some_and(|margin| margin > 0.01), "{report:?}");
        assert!(report.max_force_residual.is_some_and(|off| off > 0.0 && off < 1e-6), "{report:?}");
        assert!(report.max_half_way_imbalance.is_some_and(|share| share > 0.0 && share < 0.05), "{report:?}");
        let around = (&made.loaded.scene, &made.loaded.state);
        accepted(&check_pick_and_place(around, None, &made.plan, &CheckSettings::default()));
        let text = robot_to_json(&made.plan);
        let read = read_any(Path::new("plan.json"), text.as_bytes()).unwrap();
        assert_eq!(read, AnyPlan::Robot(Box::new(made.plan.clone())));
        let query = Query::PickAndPlace(made.query.clone());
        accepted(&check_any(around, Some(&query), &read, &CheckSettings::default()));
    }
}

/// The plan with one thing changed, and the kinds of violation that it then has.
#[track_caller]
fn broken(made: &MadeByHand, change: impl FnOnce(&mut RobotPlan), expected: &[Kind]) {
    let mut plan = made.plan.clone();
    change(&mut plan);
    let report = judge(made, &plan);
    assert_eq!(kinds(&report), expected, "{:#?}", report.violations);
    assert!(!report.accepted());
}
