//! Tracking plans are accepted, and every rule of tracking is broken by itself.

use crate::sample::{self, judge, kinds};
use crate::tracked::{
    Course, FRICTION, Motion, RADII, Round, SIZE, SQUEEZE, add_forces, ball_grasp, ball_plan, ball_scene, box_plan,
    box_scene, edge_plan, gaiting_plan, mesh_scene, plan_of, pose, segment, spinning,
};
use nalgebra::UnitQuaternion;
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::rolling::Roll;
use regrasp_plan::check::{Report, ViolationKind};
use regrasp_plan::plan::TrackingPromises;
use regrasp_plan::{ContactMode, ContactState, Plan};
use regrasp_scene::Scene;
use std::path::Path;

/// The first violations, in short.
fn complaints(report: &Report) -> String {
    let lines: Vec<String> =
        report.violations.iter().take(12).map(|v| v.to_string().chars().take(170).collect()).collect();
    format!("{} violations:\n{}", report.n_violations, lines.join("\n"))
}

#[test]
fn plans_of_closed_forms_are_accepted() {
    type Make = fn(&mut Scene) -> Plan;
    let plans: [(&str, Scene, Make); 5] = [
        ("gaiting", ball_scene(), gaiting_plan),
        ("ball", ball_scene(), ball_plan),
        ("box", box_scene(), box_plan),
        ("edge", box_scene(), edge_plan),
        ("edge of a mesh", mesh_scene(), edge_plan),
    ];
    for (name, mut scene, make) in plans {
        let plan = make(&mut scene);
        let report = judge(&scene, &plan);
        assert!(report.accepted(), "{name}: {}", complaints(&report));
        assert!(report.max_slip.unwrap() < 3e-5, "{name}: {:?}", report.max_slip);
        assert!(report.max_sliding_force_error.unwrap() < 1e-12, "{name}: {:?}", report.max_sliding_force_error);
        assert!(report.max_contact_error < 5e-5, "{name}: {}", report.max_contact_error);
        assert_eq!(report.min_margin.is_some(), name == "gaiting", "{name}: {:?}", report.min_margin);
        assert_eq!(
            regrasp_plan::format::from_json(Path::new("plan.json"), regrasp_plan::format::to_json(&plan).as_bytes())
                .as_ref(),
            Ok(&plan)
        );
    }
}

#[test]
fn every_rule_of_tracking_is_broken_by_itself() {
    use ViolationKind::*;
    type Damage<'a> = &'a dyn Fn(&mut Plan);
    fn states(plan: &mut Plan, s: usize, f: usize) -> impl Iterator<Item = &mut ContactState> {
        plan.segments[s].waypoints.iter_mut().map(move |waypoint| &mut waypoint.contacts[f])
    }
    fn tracking(plan: &mut Plan) -> &mut TrackingPromises {
        plan.promises.tracking.as_mut().unwrap()
    }
    let mut scene = ball_scene();
    let good = ball_plan(&mut scene);
    // Segments: 0 carried, 1 pure rolling, 2 rolling, 3 pure sliding, 4 sliding, 5 twisting; finger 1 twists in 0, 2 and 5,
    // where 2 and 3 slide.
    let cases: [(Damage, &[ViolationKind]); 22] = [
        (&|p| states(p, 0, 1).for_each(|c| c.mode = ContactMode::Rolling), &[]),
        (&|p| states(p, 1, 0).for_each(|c| c.mode = ContactMode::Rolling), &[]),
        (&|p| states(p, 2, 0).for_each(|c| c.mode = ContactMode::PureRolling), &[ContactModeWrong]),
        (&|p| states(p, 2, 0).for_each(|c| c.mode = ContactMode::Twisting), &[ContactModeWrong]),
        (&|p| states(p, 0, 1).for_each(|c| c.mode = ContactMode::Fixed), &[ContactModeWrong]),
        (&|p| states(p, 0, 1).for_each(|c| c.mode = ContactMode::PureRolling), &[ContactModeWrong]),
        (&|p| states(p, 3, 0).for_each(|c| c.mode = ContactMode::Sliding), &[]),
        (
            &|p| p.segments[4].waypoints[3].contacts[0].relative_turn_in_object = Some([0.1; 3]),
            &[RelativeVelocityWrong],
        ),
        (
            &|p| p.segments[0].waypoints[3].contacts[0].relative_turn_in_object = Some([1e-3; 3]),
            &[RelativeVelocityWrong],
        ),
        (
            &|p| p.segments[0].waypoints[3].contacts[1].relative_velocity_in_object = Some([1e-3; 3]),
            &[RelativeVelocityWrong],
        ),
        (&|p| p.segments[0].waypoints[3].contacts[1].point_in_tip.as_mut().unwrap()[0] += 2e-4, &[ContactOffTip]),
        (&|p| p.segments[0].waypoints[3].contacts[1].point_in_tip = None, &[RelativeMotionMissing]),
        (&|p| p.segments[0].waypoints[10].contacts[0].mode = ContactMode::Rolling, &[WrongContactMode]),
        (&|p| p.segments[1].waypoints[5].contacts[0].mode = ContactMode::Rolling, &[WrongContactMode]),
        (&|p| p.segments[0].rolling_finger = Some("a".into()), &[WrongRollingFinger]),
        (&|p| p.segments[0].rolling_finger = Some("c".into()), &[WrongRollingFinger]),
        (&|p| p.segments[0].rolling_finger = Some("thumb".into()), &[WrongRollingFinger]),
        (&|p| p.segments[1].moving_finger = Some("c".into()), &[WrongMovingFinger]),
        (&|p| tracking(p).goal_tolerance = 0.0421, &[PromiseBroken]),
        (&|p| tracking(p).goal_tolerance = 0.0099, &[GoalMismatch]),
        (&|p| tracking(p).sliding_friction = FRICTION * 0.999, &[PromiseBroken]),
        (&|p| (p.promises.required_margin, p.promises.kept_margin) = (0.0, 1e-6), &[PromiseBroken]),
    ];
    for (i, (damage, expected)) in cases.iter().enumerate() {
        let mut plan = good.clone();
        damage(&mut plan);
        let report = judge(&scene, &plan);
        assert_eq!(&kinds(&report), expected, "case {i}: {}", complaints(&report));
    }
    // Where the goal is, is not asked.
    let mut elsewhere = good.clone();
    elsewhere.goal.position = [0.3, 0.0, 0.0];
    assert!(judge(&scene, &elsewhere).accepted());
    scene.hands[0].reach = Some(0.004);
    assert_eq!(kinds(&judge(&scene, &good)), [OutOfReach]);
}

#[test]
fn fixed_fingers_may_begin_to_slide_on_their_way() {
    // The last steps of a ball that spins, after steps in which everything rests.
    let mut scene = ball_scene();
    let start = Pose::identity();
    let tips: [Pose; 4] =
        std::array::from_fn(|f| pose(ball_grasp()[f] * (SIZE + RADII[f]), UnitQuaternion::identity()));
    let carried = Round { mode: ContactMode::Fixed, center: Vector::zeros(), link: Vector::zeros() };
    let later = |t: f64| (2.0 * t - 1.0).max(0.0);
    let whole = spinning(&start, ball_grasp()[1], 0.06, &tips, &carried);
    let (object, tip) = (whole.object, whole.tips);
    let [a, b, c, d] = tip;
    let halting = |course: Course<'static>| -> Course<'static> { Box::new(move |t: f64| course(later(t))) };
    let motion = Motion {
        moving: 0,
        rolling: 1,
        modes: whole.modes,
        object: halting(object),
        tips: [halting(a), halting(b), halting(c), halting(d)],
        n_steps: 10,
    };
    let mut segment = segment(&scene, &motion, &SQUEEZE);
    for waypoint in &mut segment.waypoints[..5] {
        waypoint.contacts.iter_mut().for_each(|contact| contact.mode = ContactMode::Fixed);
        add_forces(&scene, waypoint, &SQUEEZE, None);
    }
    let plan = plan_of(&mut scene, vec![segment]);
    let report = judge(&scene, &plan);
    assert!(report.accepted(), "{}", complaints(&report));
    // What does not slide has no full friction.
    let mut plan = plan;
    plan.segments[0].waypoints[2].contacts[2].mode = ContactMode::Sliding;
    let found = kinds(&judge(&scene, &plan));
    assert!(
        found.contains(&ViolationKind::ContactModeWrong) && found.contains(&ViolationKind::SlidingForceWrong),
        "{found:?}"
    );
}

/// What the checker makes of the poses against the closed forms that they are from.
#[test]
fn slides_and_turns_are_those_of_the_closed_forms() {
    let mut scene = ball_scene();
    let plan = ball_plan(&mut scene);
    let model = sample::with_task(&scene, CheckedHand::new).unwrap();
    let sums = |s: usize, f: usize| {
        let mut sums = [0.0; 3];
        for pair in plan.segments[s].waypoints.windows(2) {
            let roll = Roll::new((f, &model.fingers[f]), &pair[0], &pair[1], &model.shape, 1e-4);
            let turning = roll.turning().unwrap();
            sums[0] += roll.sliding(|_| 1e-10).unwrap().0.norm();
            sums[1] += turning.twist;
            sums[2] += turning.roll;
            assert!((turning.whole.norm() - turning.all).abs() < 1e-5);
        }
        sums
    };
    let across = |axis: &Vector, normal: &Vector| axis.cross(normal).norm();
    let [_, spin, c, _] = ball_grasp();
    let touch = SIZE + RADII[0];
    let cases = [
        // Carried; twisting about the axis of the spin; and sliding round it, with a link that turns back.
        (0, 0, [0.0, 0.0, 0.0]),
        (0, 1, [0.0, 0.1, 0.0]),
        (0, 2, [0.1 * SIZE * across(&spin, &c), 0.1 * spin.dot(&c).abs(), 0.1 * across(&spin, &c)]),
        // Rolling along a great circle; and along a small one, with its twist.
        (1, 0, [0.0, 0.0, 0.08 * touch / RADII[0]]),
        (2, 0, [0.0, 0.05 * touch / RADII[0], 0.06 * touch / RADII[0]]),
        // The touching point of a link that does not turn goes as far as its centre.
        (3, 0, [0.06 * touch, 0.0, 0.0]),
        (5, 0, [0.0, 0.15, 0.0]),
    ];
    for (s, f, expected) in cases {
        let found = sums(s, f);
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 3e-4 + 2e-3 * expected, "segment {s} finger {f}: {found} {expected}");
        }
    }
}

#[test]
fn points_on_the_tip_are_in_the_frame_of_its_link() {
    let scene = sample::scene();
    let model = sample::with_task(&scene, CheckedHand::new).unwrap();
    let joints: Vec<f64> = (0..3 * sample::N_FINGERS).map(|k| 0.1 + 0.03 * k as f64).collect();
    for (f, finger) in model.fingers.iter().enumerate() {
        let found = finger.path.world_from_link(&joints) * finger.body_from_tip_link;
        let tip = sample::hand_from_tip(f, &[0, 1, 2].map(|k| joints[3 * f + k]));
        assert!((found - (sample::world_from_hand() * tip).to_homogeneous()).norm() < 1e-12);
    }
}

/// In each of many short segments a finger slides by less than the slip tolerance.
#[test]
fn short_segments_are_no_way_to_slide_and_hold() {
    let mut scene = ball_scene();
    let spin = ball_grasp()[1];
    let carried = Round { mode: ContactMode::Fixed, center: Vector::zeros(), link: Vector::zeros() };
    let slow = |mode: ContactMode, scene: &mut Scene| {
        let mut tips: [Pose; 4] =
            std::array::from_fn(|f| pose(ball_grasp()[f] * (SIZE + RADII[f]), UnitQuaternion::identity()));
        let mut object = Pose::identity();
        let mut segments = Vec::new();
        for _ in 0..6 {
            let mut motion = spinning(&object, spin, 0.001, &tips, &carried);
            (motion.n_steps, motion.modes[2], motion.modes[3]) = (1, mode, mode);
            segments.push(segment(scene, &motion, &SQUEEZE));
            (object, tips[0]) = ((motion.object)(1.0), (motion.tips[0])(1.0));
        }
        plan_of(scene, segments)
    };
    let sliding = slow(ContactMode::Sliding, &mut scene);
    let report = judge(&scene, &sliding);
    assert!(report.accepted(), "{}", complaints(&report));
    let rolling = slow(ContactMode::Rolling, &mut scene);
    let report = judge(&scene, &rolling);
    assert_eq!(kinds(&report), [ViolationKind::Slip], "{}", complaints(&report));
    assert!(report.max_slip.unwrap() < 0.8e-4, "{:?}", report.max_slip);
}
