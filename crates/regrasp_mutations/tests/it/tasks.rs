//! Every mutant of a good plan of pick and place is rejected, for a reason that fits.

use crate::made_by_hand::{MadeByHand, hand_over, one_arm};
use regrasp_base::Rng;
use regrasp_mutations::tasks::task_mutants;
use regrasp_plan::check::{CheckSettings, ViolationKind, check_pick_and_place};
use std::collections::{BTreeMap, BTreeSet};

#[test]
fn every_mutant_of_a_plan_of_pick_and_place_is_rejected() {
    let n_each: usize = std::env::var("REGRASP_TASK_MUTANTS").ok().and_then(|n| n.parse().ok()).unwrap_or(6);
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut wrong = Vec::new();
    let made: Vec<MadeByHand> = vec![one_arm(), hand_over()];
    for round in 0..2 * n_each {
        let MadeByHand { loaded, query, plan, .. } = &made[round % 2];
        let around = (&loaded.scene, &loaded.state);
        let rng = &mut Rng::keyed(1, "task_mutation", round as u64);
        for mutant in task_mutants(plan, around, query, rng) {
            let scene = mutant.scene.as_ref().unwrap_or(&loaded.scene);
            let state = mutant.state.as_ref().unwrap_or(&loaded.state);
            let query = mutant.query.as_ref().unwrap_or(query);
            let report = check_pick_and_place((scene, state), Some(query), &mutant.plan, &CheckSettings::default());
            let found: BTreeSet<ViolationKind> = report.violations.iter().map(|v| v.kind).collect();
            *counts.entry(mutant.name).or_default() += 1;
            if report.accepted() || !mutant.expected.iter().any(|kind| found.contains(kind)) {
                wrong.push(format!("{round} {}: wanted one of {:?}, found {found:?}", mutant.name, mutant.expected));
            }
        }
    }
    assert!(wrong.is_empty(), "{} mutants wrongly judged:\n{}", wrong.len(), wrong.join("\n"));
    for (name, count) in &counts {
        assert!(*count >= n_each / 2, "{name} was only made {count} times");
    }
    assert!(counts.len() > 60, "{} kinds: {counts:#?}", counts.len());
}
