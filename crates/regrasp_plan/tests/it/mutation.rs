//! Every mutant of a good plan is rejected, for a reason that fits.

use crate::sample;
use regrasp_base::Rng;
use regrasp_plan::check::mutation::mutants;
use regrasp_plan::check::{CheckSettings, ViolationKind, check};
use std::collections::{BTreeMap, BTreeSet};

#[test]
fn every_mutant_is_rejected_for_a_fitting_reason() {
    let scene = sample::scene();
    let soft = sample::soft_scene();
    let loaded = [crate::loaded::load(sample::plan_with_way(&scene), &scene), crate::loaded::plan(&soft)];
    let plans = [
        (&scene, sample::plan_with_way(&scene)),
        (&scene, sample::plan_with_free_finger(&scene)),
        (&soft, sample::plan_with_two_away(&soft)),
        (&scene, crate::rolled::plan(&scene, 10)),
        (&scene, loaded[0].clone()),
        (&soft, loaded[1].clone()),
        (&scene, crate::loaded::any_gravity_plan(&scene)),
    ];
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut kinds = BTreeSet::new();
    let mut wrong = Vec::new();
    for round in 0..56 {
        let (scene, plan) = &plans[round as usize % plans.len()];
        let query = sample::query(plan);
        for mutant in mutants(plan, scene, &mut Rng::keyed(1, "mutation", round)) {
            // Header mutants also change what was asked for, so the query is only given for the others.
            let judged_in = mutant.scene.as_ref().unwrap_or(scene);
            let report = check(judged_in, Some(&query), &mutant.plan, &CheckSettings::default());
            let found: BTreeSet<ViolationKind> = report.violations.iter().map(|v| v.kind).collect();
            *counts.entry(mutant.name).or_default() += 1;
            if !mutant.expected.iter().any(|kind| found.contains(kind)) {
                wrong.push(format!("{}: wanted one of {:?}, found {found:?}", mutant.name, mutant.expected));
            }
            kinds.extend(found.into_iter().filter(|kind| mutant.expected.contains(kind)));
        }
    }
    assert!(wrong.is_empty(), "{} mutants wrongly judged:\n{}", wrong.len(), wrong.join("\n"));
    // All but one that needs an edge of a box, one that needs a finger of more than three joints, and four of coupled joints.
    assert_eq!(counts.len(), 127, "{counts:?}");
    for (name, count) in &counts {
        assert!(*count >= 5, "{name} was only made {count} times");
    }
    for name in [
        "finger declared free whom the others need",
        "finger declared free that touches the object",
        "free finger touches the object",
        "finger declared holding that is away",
        "free finger holds for a moment",
        "free finger moves while another one relocates",
        "slip tolerance below the slip",
        "rolling contacts shifted on the object only",
        "rolling tip slides there and back",
        "rolling tip creeps",
        "pivoting tip passed off as rolling",
        "fixed contact declared as rolling",
        "rolling contact declared as fixed",
        "finger stops rolling on its way",
        "finger rolls while the object rests",
        "two fingers squeezed beyond their cones",
        "moments out of balance, forces in balance",
        "moving finger presses when it lifts or lands",
        "soft fingertip twists harder than it can",
        "hard fingertip exerts torsion",
        "torque limit promised above the robot's",
        "a step too fast",
        "no torque left for the weight of some direction",
        "squeezed too little for the weight of some direction",
        "no time for forces to change",
        "joint acceleration promised below the motion's",
        "velocity with which the motion turns back",
    ] {
        assert!(counts.contains_key(name), "{name} was never made");
    }
    use ViolationKind::*;
    // All but ContactTooNearEdge: a sphere has no edges.
    for kind in [
        InputHashMismatch,
        WrongScene,
        NotANumber,
        StartMismatch,
        GoalMismatch,
        WayPoseMissed,
        SegmentsDoNotMeet,
        EmptySegment,
        JointLimit,
        JointJump,
        ObjectMovesInRegrasp,
        GraspChanges,
        WrongContactMode,
        WrongMovingFinger,
        ContactOffTip,
        Slip,
        ContactOffSurface,
        ContactNormalWrong,
        ClosureLost,
        FrictionAboveScene,
        Collision,
        LandingOrLiftingNotFree,
        PromiseBroken,
        ForceMissing,
        ForceUnbalanced,
        ForceOutsideCone,
        NormalForceOutOfRange,
        MovingFingerPresses,
        TorqueWrong,
        TorqueLimit,
        TimeOrder,
        JointTooFast,
        TooFast,
        JointAcceleration,
        VelocityInconsistent,
    ] {
        assert!(kinds.contains(&kind), "{kind:?} was never the reason");
    }
}
