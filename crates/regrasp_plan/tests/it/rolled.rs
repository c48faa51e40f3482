//! Transfers in which the tips of the sample hand roll over the ball, integrated here in tiny steps: the condition is that
//! the touching points of link and object have one velocity, solved for the joint rates. The checker looks at poses only.

use crate::sample::{self, Grasp, OBJECT_RADIUS, TIP_RADIUS, judge, kinds};
use nalgebra::{Matrix3, Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::Grip;
use regrasp_plan::check::ViolationKind;
use regrasp_plan::check::closure::{HeldBody, margin};
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::{ContactMode, ContactState, Plan, Segment};
use regrasp_scene::Scene;

/// Steps of the integration between two waypoints.
const N_SUBSTEPS: usize = 20;

/// The object's course: it turns about a fixed axis of the hand and shifts, at constant rates.
#[derive(Clone, Copy)]
pub struct Course {
    pub from: Pose,
    pub turn: Vector,
    pub shift: Vector,
}

impl Course {
    pub fn pose(&self, t: f64) -> Pose {
        let rotation = UnitQuaternion::from_scaled_axis(self.turn * t) * self.from.rotation;
        Pose::from_parts(Translation3::from(self.from.translation.vector + self.shift * t), rotation)
    }

    /// Velocity of the object's point that is at `point` in the hand.
    fn velocity(&self, t: f64, point: &Point) -> Vector {
        self.shift + self.turn.cross(&(point - self.pose(t) * Point::origin()))
    }
}

/// Rates of a finger's joints with which its tip rolls on the ball.
fn rolling_rates(f: usize, joints: &[f64; 3], course: &Course, t: f64) -> [f64; 3] {
    let (axes, center) = sample::finger_axes(f, joints);
    let normal = (center - course.pose(t) * Point::origin()).normalize();
    let touching = center - normal * TIP_RADIUS;
    let columns = axes.map(|(origin, axis)| axis.cross(&(touching - origin)));
    let rates = Matrix3::from_columns(&columns).lu().solve(&course.velocity(t, &touching)).expect("no singular finger");
    rates.into()
}

/// One step of the classical method of Runge and Kutta.
fn runge_kutta(f: usize, joints: &[f64; 3], course: &Course, t: f64, h: f64) -> [f64; 3] {
    let ahead = |rates: &[f64; 3], by: f64| std::array::from_fn(|k| joints[k] + by * rates[k]);
    let first = rolling_rates(f, joints, course, t);
    let second = rolling_rates(f, &ahead(&first, 0.5 * h), course, t + 0.5 * h);
    let third = rolling_rates(f, &ahead(&second, 0.5 * h), course, t + 0.5 * h);
    let fourth = rolling_rates(f, &ahead(&third, h), course, t + h);
    std::array::from_fn(|k| joints[k] + h / 6.0 * (first[k] + 2.0 * second[k] + 2.0 * third[k] + fourth[k]))
}

/// A transfer in which every finger rolls, from a grasp; the grasp it ends in, by directions from the centre.
pub fn transfer(course: &Course, grasp: &Grasp, n_steps: usize) -> (Segment, Grasp) {
    let mut now = *grasp;
    let mut waypoint = sample::waypoint(&course.from, grasp, None);
    let roll_all = |contacts: &mut [ContactState]| contacts.iter_mut().for_each(|c| c.mode = ContactMode::Rolling);
    roll_all(&mut waypoint.contacts);
    let mut waypoints = vec![waypoint.clone()];
    for step in 0..n_steps {
        for f in 0..sample::N_FINGERS {
            let mut joints = [0, 1, 2].map(|k| waypoint.joints[3 * f + k]);
            for substep in 0..N_SUBSTEPS {
                let h = 1.0 / (n_steps * N_SUBSTEPS) as f64;
                joints = runge_kutta(f, &joints, course, (step * N_SUBSTEPS + substep) as f64 * h, h);
            }
            let pose = course.pose((step + 1) as f64 / n_steps as f64);
            let (_, center) = sample::finger_axes(f, &joints);
            now[f] = (pose.inverse() * center).coords.normalize();
            waypoint.joints[3 * f..3 * f + 3].copy_from_slice(&joints);
            waypoint.contacts[f] =
                ContactState::at(ContactMode::Rolling, (now[f] * OBJECT_RADIUS).into(), now[f].into());
            waypoint.world_from_object = (&(sample::world_from_hand() * pose)).into();
        }
        waypoints.push(waypoint.clone());
    }
    (Segment::transfer(waypoints), now)
}

/// Rolling transfer, relocation of a finger, rolling transfer.
pub fn plan(scene: &Scene, n_steps: usize) -> Plan {
    let from = Pose::translation(0.0, 0.0, 0.078);
    let first = Course { from, turn: Vector::new(0.02, 0.06, 0.2), shift: Vector::new(0.001, -0.001, 0.002) };
    let (rolled, grasp) = transfer(&first, &sample::START_GRASP.map(|(a, e)| sample::around(a, e)), n_steps);
    let (relocated, grasp) = sample::regrasp(&first.pose(1.0), &grasp, 1, sample::around(65.0, 2.0), 0.004);
    let last =
        Course { from: first.pose(1.0), turn: Vector::new(-0.05, 0.0, 0.15), shift: Vector::new(0.0, 0.002, -0.002) };
    let (rolled_again, _) = transfer(&last, &grasp, n_steps);
    sample::plan_of(scene, &from, &last.pose(1.0), vec![rolled, relocated, rolled_again])
}

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
