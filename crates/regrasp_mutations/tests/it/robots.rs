//! Every mutant of a good plan of a whole robot is rejected, for a reason that fits.

use crate::moving_robot::{load, motion, straight, two_arms, upright};
use regrasp_base::Rng;
use regrasp_mutations::robots::robot_mutants;
use regrasp_plan::RobotPlan;
use regrasp_plan::check::{CheckSettings, ViolationKind, check_robot};
use regrasp_scene::{LoadedScene, MotionGoal, MotionQuery, WristGoal};
use std::collections::{BTreeMap, BTreeSet};

/// Straight motions of a scene whose ends are drawn near those of a query, as far as the checker accepts them.
fn good_plans(loaded: &LoadedScene, query: &MotionQuery, n: usize, share: f64) -> Vec<(MotionQuery, RobotPlan)> {
    let robot = &loaded.scene.robots[0];
    let MotionGoal::Joints(goal) = &query.goal else { panic!("a goal of joints") };
    let mut rng = Rng::keyed(3, "good_robot_plans", n as u64);
    let mut found = Vec::new();
    for attempt in 0..20 * n {
        let mut near = |joints: &[f64]| -> Vec<f64> {
            let moved = |(k, q): (usize, &f64)| {
                let coordinate = &robot.layout.coordinates[k];
                let is_finger = matches!(coordinate.part, regrasp_robot::Part::Hand(_));
                let reach = if is_finger { 0.0 } else { 0.1 };
                (q + rng.uniform(-reach, reach)).clamp(coordinate.lower, coordinate.upper)
            };
            joints.iter().enumerate().map(moved).collect()
        };
        // What is carried starts where the scene says.
        let start = if query.carried.is_empty() { near(&query.start) } else { query.start.clone() };
        let goal = near(goal);
        let plan_for = MotionQuery { start: start.clone(), goal: MotionGoal::Joints(goal.clone()), ..query.clone() };
        let plan = straight(&loaded.scene, &plan_for, &[start, goal.clone()], 3 + attempt % 6, share);
        let report = check_robot((&loaded.scene, &loaded.state), Some(&plan_for), &plan, &CheckSettings::default());
        if !report.accepted() {
            continue;
        }
        let mut asked = plan_for;
        if attempt % 3 == 2 && !robot.arms.is_empty() {
            let mut poses = Vec::new();
            robot.link_poses(&goal, &mut poses);
            let wrist = |arm: usize| WristGoal { arm, world_from_mount: poses[robot.arms[arm].mount.0] };
            asked.goal = MotionGoal::Wrists((0..robot.arms.len()).map(wrist).collect());
        }
        found.push((asked, plan));
        if found.len() == n {
            break;
        }
    }
    assert_eq!(found.len(), n, "good plans");
    found
}

/// Mutants of all plans, `rounds` times: how often each was made, and the kinds for which they were rejected.
fn judge(loaded: &LoadedScene, plans: &[(MotionQuery, RobotPlan)], rounds: usize) -> BTreeMap<&'static str, usize> {
    let (mut counts, mut wrong) = (BTreeMap::new(), Vec::new());
    for round in 0..rounds * plans.len() {
        let (query, plan) = &plans[round % plans.len()];
        let rng = &mut Rng::keyed(1, "robot_mutation", round as u64);
        for mutant in robot_mutants(plan, (&loaded.scene, &loaded.state), query, rng) {
            let scene = mutant.scene.as_ref().unwrap_or(&loaded.scene);
            let state = mutant.state.as_ref().unwrap_or(&loaded.state);
            let query = mutant.query.as_ref().unwrap_or(query);
            let report = check_robot((scene, state), Some(query), &mutant.plan, &CheckSettings::default());
            let found: BTreeSet<ViolationKind> = report.violations.iter().map(|v| v.kind).collect();
            *counts.entry(mutant.name).or_default() += 1;
            if report.accepted() || !mutant.expected.iter().any(|kind| found.contains(kind)) {
                wrong.push(format!("{}: wanted one of {:?}, found {found:?}", mutant.name, mutant.expected));
            }
        }
    }
    assert!(wrong.is_empty(), "{} mutants wrongly judged:\n{}", wrong.len(), wrong.join("\n"));
    counts
}

#[test]
fn every_mutant_of_a_robots_plan_is_rejected() {
    let n_each: usize = std::env::var("REGRASP_ROBOT_MUTANTS").ok().and_then(|n| n.parse().ok()).unwrap_or(40);
    let loaded = load(&two_arms());
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut add =
        |more: BTreeMap<&'static str, usize>| more.into_iter().for_each(|(k, n)| *counts.entry(k).or_default() += n);
    let rounds = n_each.div_ceil(8);
    for name in ["swing", "carry"] {
        add(judge(&loaded, &good_plans(&loaded, &motion(&loaded, name), 8, 0.9), rounds));
    }
    let (_folder, upright) = upright();
    add(judge(&upright, &good_plans(&upright, &motion(&upright, ""), 8, 0.49), rounds));
    for (name, count) in &counts {
        assert!(*count >= n_each, "{name} was only made {count} times");
    }
    assert_eq!(counts.len(), 44, "{counts:#?}");
}
