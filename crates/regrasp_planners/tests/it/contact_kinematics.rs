//! Rolling fingertips of tracking plans against Montana's equations: the planner solves for whole steps by the midpoint rule, the
//! equations move the contact by the curvatures of the two surfaces. Neither knows of the other.

use crate::in_hand_methods::scene;
use crate::queries::Queries;
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_base::Budget;
use regrasp_geometry::{Point, Pose, Shape, Surface, Vector};
use regrasp_grasp::contact::kinematics::{ContactPose, RelativeVelocity, SurfacePair};
use regrasp_plan::plan::{ContactMode, ContactState, SegmentKind, Waypoint};
use regrasp_planners::{TrackingSettings, plan_tracking};
use regrasp_scene::HandView;

/// Contacts may differ by this share of their travel, and by a length, in metres: a step turns by some thousandths.
const SHARE: f64 = 0.02;
const LENGTH: f64 = 1e-6;

/// The last link of a finger, seen from the object.
fn object_from_link(view: &HandView, finger: usize, waypoint: &Waypoint) -> Pose {
    let first: usize = view.hand.fingers[..finger].iter().map(|finger| finger.chain.n_coordinates()).sum();
    let chain = &view.hand.fingers[finger].chain;
    let link = chain.last_frame(&waypoint.joints[first..first + chain.n_coordinates()]).to_pose();
    let world_from_link = view.world_from(&link);
    Pose::from(&waypoint.world_from_object).inverse() * world_from_link
}

fn point(state: &ContactState) -> Point {
    Point::from(state.point_in_object.expect("a finger that holds has a contact"))
}

/// A contact frame at a contact.
fn object_from_contact(state: &ContactState) -> Pose {
    let normal = Vector::from(state.normal_in_object.expect("a finger that holds has a normal"));
    let turn = UnitQuaternion::rotation_between(&Vector::z(), &normal)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f64::consts::PI));
    Pose::from_parts(Translation3::from(point(state).coords), turn)
}

#[test]
fn rolling_contacts_of_tracking_plans_go_where_montana_says() {
    let loaded = scene("tracking_sphere_six.toml");
    let view = loaded.view();
    let settings = TrackingSettings::default();
    let (mut n_compared, mut longest) = (0, 0.0_f64);
    for seed in 0..2 {
        let query = loaded.tracking(seed);
        let plan = plan_tracking(&view, &query, &settings, seed, &Budget::work(2_000_000), &|_| {}).expect("a plan");
        let tracked = plan.segments.iter().filter(|segment| segment.kind == SegmentKind::Tracking);
        for pair in tracked.flat_map(|segment| segment.waypoints.windows(2)) {
            for (finger, (from, to)) in pair[0].contacts.iter().zip(&pair[1].contacts).enumerate() {
                if from.mode != ContactMode::Rolling {
                    continue;
                }
                let tip = &view.hand.fingers[finger].tip;
                let surface = Surface::of(&Shape::Sphere { radius: tip.radius() }).expect("a ball");
                let pair_of_surfaces = SurfacePair {
                    object: &view.object.surface,
                    tip: &surface,
                    tip_from_surface: Pose::from_parts(
                        Translation3::from(tip.center_in_body.coords),
                        UnitQuaternion::identity(),
                    ),
                };
                let [before, after] = [&pair[0], &pair[1]].map(|waypoint| object_from_link(&view, finger, waypoint));
                // How the object turns, seen from the tip, in one second.
                let turn = (after.rotation.inverse() * before.rotation).scaled_axis();
                let contact = ContactPose::of(&object_from_contact(from), &before);
                let angular = contact.tip_from_contact.rotation.inverse() * turn;
                let velocity = RelativeVelocity { linear: Vector::zeros(), angular };
                let moved = pair_of_surfaces.advance(&contact, &velocity, 1.0, 1e-10).expect("it rolls on");
                let there = Point::from(moved.object_from_contact.translation.vector);
                let travel = (point(to) - point(from)).norm();
                let apart = (there - point(to)).norm();
                let allowed = SHARE * travel + LENGTH;
                assert!(apart <= allowed, "seed {seed}, finger {finger}: {apart:e} m apart after {travel:e} m");
                n_compared += 1;
                longest = longest.max(travel);
            }
        }
    }
    // Far more than what they may differ by.
    assert!(n_compared > 100 && longest > 20.0 * LENGTH, "{n_compared} steps, at most {longest:e} m");
}
