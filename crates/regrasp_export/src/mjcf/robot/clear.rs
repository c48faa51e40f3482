//! Where the hands of a robot are, as [`crate::mjcf::clear`] asks for it.

use crate::mjcf::clear::{LinkShape, Touch, around_tips, beside_links};
use regrasp_geometry::Pose;
use regrasp_geometry::parts::Clear;
use regrasp_plan::robot_plan::{RobotPlan, RobotSegmentKind, RobotWaypoint};
use regrasp_robot::{LinkId, Manipulator, Part};
use regrasp_scene::Object;

/// Largest number of moments of a segment at which links are looked at.
const MOMENTS: usize = 4;

/// For the hands of `robot`, along the whole plan, in the frame of `object`.
pub(super) fn for_hands(robot: &Manipulator, object: &Object, plan: &RobotPlan) -> Vec<Clear> {
    if object.surface.mesh().is_none() {
        return Vec::new();
    }
    let links = robot.robot.links.iter().enumerate();
    let of_hands = links.filter(|(l, _)| matches!(robot.part_of(LinkId(*l)), Part::Hand(_)));
    let placed = of_hands.flat_map(|(l, link)| link.collision.iter().map(move |placed| (l, placed)));
    let shapes: Vec<LinkShape> = placed.filter_map(|(l, placed)| LinkShape::new(l, placed)).collect();
    let links_at = |waypoint: &RobotWaypoint| {
        let object_from_world = Pose::from(waypoint.world_from_objects.first()?).inverse();
        let mut world_from_link = Vec::new();
        robot.link_poses(&waypoint.joints, &mut world_from_link);
        Some(world_from_link.iter().map(|world_from_link| object_from_world * world_from_link).collect())
    };
    let mut clear = around_tips(&object.surface, &touches(robot, plan));
    clear.extend(beside_links(&object.surface, &shapes, moments(plan).filter_map(links_at)));
    clear
}

/// Where fingertips touch, each place once.
fn touches(robot: &Manipulator, plan: &RobotPlan) -> Vec<Touch> {
    let mut found = Vec::new();
    let mut known: Vec<([f64; 3], &str)> = Vec::new();
    for contact in plan.waypoints().flat_map(|waypoint| &waypoint.contacts) {
        if known.contains(&(contact.point_in_object, contact.finger.as_str())) {
            continue;
        }
        known.push((contact.point_in_object, &contact.finger));
        let mounted = robot.hands.iter().find(|mounted| mounted.name == contact.hand);
        let finger = mounted
            .and_then(|mounted| mounted.hand.finger_named(&contact.finger).map(|id| &mounted.hand.fingers[id.0]));
        found.extend(finger.map(|finger| Touch::of(finger, contact.point_in_object, contact.normal_in_object)));
    }
    found
}

/// Moments at which hands are at the object or near it.
fn moments(plan: &RobotPlan) -> impl Iterator<Item = &RobotWaypoint> {
    let near = |kind: RobotSegmentKind| !matches!(kind, RobotSegmentKind::Transit);
    plan.segments.iter().filter(move |segment| near(segment.kind)).flat_map(|segment| {
        let last = segment.waypoints.len() - 1;
        // A carried object goes with its hand.
        let n = if segment.kind == RobotSegmentKind::Carry { 1 } else { MOMENTS.min(last) };
        (0..=n).map(move |k| &segment.waypoints[last * k / n.max(1)])
    })
}
