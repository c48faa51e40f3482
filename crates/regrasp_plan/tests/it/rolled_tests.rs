//! Rolling transfers of the sample: their slip, their traces, what does not roll.

use crate::rolled::plan;
use crate::sample::{self, OBJECT_RADIUS, judge, kinds};
use regrasp_geometry::{Point, Pose};
use regrasp_grasp::Grip;
use regrasp_plan::check::ViolationKind;
use regrasp_plan::check::closure::{HeldBody, margin};
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::{ContactMode, ContactState};

#[test]
fn a_plan_that_rolls_is_accepted_and_its_slip_falls_with_the_square_of_the_steps() {
    let scene = sample::scene();
    let mut slips = Vec::new();
    for n_steps in [5, 10, 20] {
        let report = judge(&scene, &plan(&scene, n_steps));
        assert!(report.accepted(), "{report:#?}");
        slips.push(report.max_slip.unwrap());
    }
    assert!(slips[1] < 1e-5, "{slips:?}");
    for pair in slips.windows(2) {
        assert!(((pair[0] / pair[1]).log2() - 2.0).abs() < 0.3, "{slips:?}");
    }
}

/// The trace of a contact on the object and the one on the tip are as long, and bend alike: in the frame of the contact,
/// carried along without turning about the normal, they are one curve.
#[test]
fn traces_on_object_and_tip_are_as_long() {
    let scene = sample::scene();
    let plan = plan(&scene, 200);
    let segment = &plan.segments[0];
    for f in 0..sample::N_FINGERS {
        let (mut on_object, mut on_tip) = (0.0, 0.0);
        for pair in segment.waypoints.windows(2) {
            let touching = |w: &regrasp_plan::Waypoint| {
                let point = Point::from(w.contacts[f].point_in_object.unwrap());
                let hand_from_object = sample::world_from_hand().inverse() * Pose::from(&w.world_from_object);
                let joints = [0, 1, 2].map(|k| w.joints[3 * f + k]);
                (point, sample::hand_from_tip(f, &joints).inverse() * hand_from_object * point)
            };
            let (before, after) = (touching(&pair[0]), touching(&pair[1]));
            let (object_way, tip_way) = (after.0 - before.0, after.1 - before.1);
            assert!((object_way.norm() - tip_way.norm()).abs() < 1e-3 * object_way.norm() + 1e-12);
            on_object += object_way.norm();
            on_tip += tip_way.norm();
        }
        assert!(on_object > 0.3e-3, "{on_object}");
        assert!((on_object - on_tip).abs() < 1e-7, "{on_object} {on_tip}");
    }
}

#[test]
fn contacts_that_stay_where_they_were_do_not_roll() {
    // The fixed contacts of the plain sample, passed off as rolling: the tips pivot.
    let scene = sample::scene();
    let mut plan = sample::plan(&scene);
    for waypoint in &mut plan.segments[0].waypoints {
        waypoint.contacts.iter_mut().for_each(|contact| contact.mode = ContactMode::Rolling);
    }
    let report = judge(&scene, &plan);
    assert_eq!(kinds(&report), [ViolationKind::Slip], "{report:#?}");
    assert!(report.max_slip.unwrap() > 0.5e-3);
}

#[test]
fn sharp_tips_and_resting_objects_do_not_roll() {
    let scene = sample::scene();
    let mut plan = plan(&scene, 10);
    let resting = &mut plan.segments[1].waypoints;
    resting.iter_mut().for_each(|waypoint| waypoint.contacts[0].mode = ContactMode::Rolling);
    assert!(kinds(&judge(&scene, &plan)).contains(&ViolationKind::WrongContactMode));
    let mut sharp = sample::scene();
    for finger in &mut sharp.hands[0].hand.fingers {
        finger.tip.shape = regrasp_robot::TipShape::Point;
    }
    assert!(kinds(&judge(&sharp, &plan)).contains(&ViolationKind::WrongContactMode));
}

#[test]
fn the_smallest_margin_of_contacts_that_roll_is_that_of_every_waypoint_by_itself() {
    for scene in [sample::scene(), sample::soft_scene()] {
        let plan = plan(&scene, 40);
        let body =
            HeldBody { center_of_mass: Point::origin(), torque_scale: OBJECT_RADIUS, friction: plan.promises.friction };
        let margin_at = |contacts: &Vec<ContactState>| {
            let holding = contacts.iter().enumerate().filter(|(_, contact)| contact.holds());
            let grip = |(f, state): (usize, &ContactState)| Grip {
                contact: contact_of(state).unwrap(),
                model: scene.hands[0].hand.fingers[f].tip.contact,
            };
            margin(&holding.map(grip).collect::<Vec<_>>(), &body)
        };
        let smallest = plan.segments.iter().flat_map(|segment| {
            let moving = segment.moving_finger.as_ref().map(|name| name[1..].parse::<usize>().unwrap());
            segment.waypoints.iter().map(move |waypoint| {
                let mut contacts = waypoint.contacts.clone();
                moving.iter().for_each(|&f| contacts[f] = ContactState::FREE);
                contacts
            })
        });
        let smallest = smallest.map(|contacts| margin_at(&contacts)).fold(f64::INFINITY, f64::min);
        let found = judge(&scene, &plan).min_margin.unwrap();
        assert!((found - smallest).abs() < 1e-12, "{found} {smallest}");
    }
}
