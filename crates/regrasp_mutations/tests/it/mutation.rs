//! Every mutant of a good plan is rejected, for a reason that fits.

use crate::{sample, tracked};
use regrasp_base::Rng;
use regrasp_mutations::mutants;
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, ViolationKind, check};
use regrasp_scene::{Manipulation, Scene};
use std::collections::{BTreeMap, BTreeSet};

/// What came of the mutants of some plans, each looked at `rounds` times with other random places: how often each was made,
/// and the kinds for which they were rejected.
fn judge_mutants(plans: &[(&Scene, Plan)], rounds: usize) -> (BTreeMap<&'static str, usize>, BTreeSet<ViolationKind>) {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut kinds = BTreeSet::new();
    let mut wrong = Vec::new();
    for round in 0..rounds * plans.len() {
        let (scene, plan) = &plans[round % plans.len()];
        let query = sample::query(plan);
        let state = sample::state(scene);
        for mutant in mutants(plan, Manipulation::first(scene, &state), &mut Rng::keyed(1, "mutation", round as u64)) {
            // Header mutants also change what was asked for, so the query is only given for the others.
            let judged_in = mutant.scene.as_ref().unwrap_or(scene);
            let report = check((judged_in, &state), Some(&query), &mutant.plan, &CheckSettings::default());
            let found: BTreeSet<ViolationKind> = report.violations.iter().map(|v| v.kind).collect();
            *counts.entry(mutant.name).or_default() += 1;
            if !mutant.expected.iter().any(|kind| found.contains(kind)) {
                wrong.push(format!("{}: wanted one of {:?}, found {found:?}", mutant.name, mutant.expected));
            }
            kinds.extend(found.into_iter().filter(|kind| mutant.expected.contains(kind)));
        }
    }
    assert!(wrong.is_empty(), "{} mutants wrongly judged:\n{}", wrong.len(), wrong.join("\n"));
    (counts, kinds)
}

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
    let (counts, kinds) = judge_mutants(&plans, 8);
    // All but one that needs an edge of a box, one that needs a finger of more than three joints, two of joints that stand still, four of
    // coupled joints, and those that tracking alone has.
    assert_eq!(counts.len(), 150, "{counts:?}");
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
        "velocity where a joint rests",
        "joint accelerates too fast between waypoints only",
        "time squeezed until a joint accelerates too fast",
        "joint too fast between waypoints only",
        "fingertip too fast between waypoints only",
        "velocity with which a fingertip leaves its contact",
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

#[test]
fn every_mutant_of_tracking_is_rejected_for_a_fitting_reason() {
    use ViolationKind::*;
    let [mut ball, mut gaited] = [tracked::ball_scene(), tracked::ball_scene()];
    let [mut cuboid, mut mesh] = [tracked::box_scene(), tracked::mesh_scene()];
    let plans = [
        tracked::ball_plan(&mut ball),
        tracked::gaiting_plan(&mut gaited),
        tracked::box_plan(&mut cuboid),
        tracked::edge_plan(&mut mesh),
    ];
    let scenes = [&ball, &gaited, &cuboid, &mesh];
    let plans: Vec<(&Scene, Plan)> = scenes.into_iter().zip(plans).collect();
    let (counts, kinds) = judge_mutants(&plans, 6);
    for name in TRACKING_MUTANTS.into_iter().chain(MIXED_MUTANTS) {
        assert!(counts.get(name).is_some_and(|count| *count >= 5), "{name} was only made {:?} times", counts.get(name));
    }
    for kind in [
        WrongRollingFinger,
        ContactModeWrong,
        RelativeMotionMissing,
        RelativeVelocityWrong,
        SlidingForceWrong,
        OutOfReach,
        ContactNormalWrong,
        GoalMismatch,
        Slip,
    ] {
        assert!(kinds.contains(&kind), "{kind:?} was never the reason");
    }
}

/// Every kind of damage that only tracking with relocations between has.
const MIXED_MUTANTS: [&str; 7] = [
    "relocation passed off as tracking",
    "relocation left out between tracking",
    "relocated finger tracks on from where it was",
    "finger slides while another one is in the air",
    "finger is tracked while another one is in the air",
    "finger in the air is said to slide",
    "object tracks on while a finger is in the air",
];

/// Every kind of damage that only tracking has.
const TRACKING_MUTANTS: [&str; 74] = [
    "sliding said to be fixed",
    "sliding said to be rolling",
    "sliding said to be pure rolling",
    "sliding said to be twisting",
    "sliding said to be pure sliding",
    "pure sliding said to be fixed",
    "pure sliding said to be rolling",
    "pure sliding said to be pure rolling",
    "pure sliding said to be twisting",
    "rolling said to be fixed",
    "rolling said to be pure rolling",
    "rolling said to be twisting",
    "rolling said to be sliding",
    "pure rolling said to be fixed",
    "pure rolling said to be twisting",
    "pure rolling said to be sliding",
    "pure rolling said to be pure sliding",
    "twisting said to be fixed",
    "twisting said to be pure rolling",
    "twisting said to be sliding",
    "twisting said to be pure sliding",
    "fixed said to be sliding",
    "fixed said to be pure sliding",
    "sliding of which half is said to roll",
    "mode of one waypoint is another",
    "moving fingertip that rolls slides there and back",
    "relative velocity too large",
    "relative velocity too small",
    "relative velocity turned aside",
    "relative velocity of the object instead of the tip's",
    "relative velocity in the world's frame",
    "velocity and friction turned aside together",
    "relative velocity of a contact that does not slide",
    "relative turn too fast",
    "relative turn the other way",
    "relative turn left out",
    "point on the tip missing",
    "relative velocity missing",
    "relative turn missing",
    "relative velocity where nothing is tracked",
    "friction of what slides not full",
    "friction of what slides more than full",
    "friction against the drag",
    "friction aside of the drag by a millionth",
    "what slides is said to stick by its friction",
    "torsion of a soft fingertip that slides",
    "resting finger moves in tracking",
    "another finger named as moving in tracking",
    "moving finger of tracking not named",
    "rolling finger not named",
    "rolling finger is the moving one",
    "finger named as rolling that slides",
    "finger named as rolling in a transfer",
    "finger lets go in tracking",
    "tracking passed off as a transfer",
    "sharp fingertip tracks",
    "point on the tip elsewhere",
    "points on the tip of another moment",
    "moving fingertip off the object",
    "moving fingertip pressed into the object",
    "way round an edge cut short",
    "fixed contact elsewhere for a moment",
    "normal on an edge outside what its faces span",
    "goal tolerance promised too wide",
    "goal tolerance promised below the miss",
    "goal asked for as another orientation",
    "last segments of tracking cut off",
    "tracking reversed in time",
    "sliding friction promised smaller",
    "sliding friction promised larger",
    "promises of tracking left out",
    "gravity of any direction in tracking",
    "object with more friction than it had",
    "reach shorter than the way",
];
