//! Given joints and contacts that nearly touch: the nearest ones that do, and how far they are from what was asked.

use crate::model::FingerModel;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Surface};
use regrasp_grasp::Contact;
use regrasp_plan::Plan;
use regrasp_plan::plan::Waypoint;
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings};
use regrasp_scene::{GRASP_TOLERANCE, GRASP_TURN_TOLERANCE, GraspRequest, HandView, Query};

/// A tip that is no farther off the surface than this, in metres, touches as it stands: half of what the checker allows.
const TOUCHES: f64 = 5e-6;
/// Steps towards the surface: one for a ball, a few for other tips, which touch with another point when the link turns.
const MOST_STEPS: usize = 8;
/// Moves below this, in metres, are rounding and not worth a word.
const WORTH_A_WORD: f64 = 1e-6;

/// Why a finger does not touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoTouch {
    /// The tip's centre is inside the object.
    Inside,
    /// The tip is farther from the surface than a given grasp may be, in metres; negative inside.
    Off(f64),
    /// It is as near, in metres, but cannot be moved to touch by as little.
    Stuck(f64),
}

/// Largest way along the surface, per way to it, on which a finger that cannot go straight comes to touch.
const STEEPEST: f64 = 2.0;

/// The contact of a finger with these joints, and joints with which it touches there: the given ones where they do, else ones
/// nearby. No finger moves by the rounding of given joints.
pub fn touching(
    finger: &FingerModel,
    surface: &Surface,
    given: &Coordinates,
    world_from_object: &Placement,
) -> Result<(Contact, Coordinates), NoTouch> {
    let (mut contact, gap) = finger.contact_at(surface, given, world_from_object).ok_or(NoTouch::Inside)?;
    if gap.abs() > GRASP_TOLERANCE {
        return Err(NoTouch::Off(gap));
    }
    let mut left = gap;
    let mut joints = given.clone();
    for _ in 0..MOST_STEPS {
        if left.abs() <= TOUCHES {
            return if is_near(finger, given, &joints) { Ok((contact, joints)) } else { Err(NoTouch::Stuck(gap)) };
        }
        let normal = contact.normal_in_object.into_inner();
        let wanted = Contact { point_in_object: contact.point_in_object - normal * left, ..contact };
        let settings = IkSettings { limit_margin: 0.0, preference: None, max_step: GRASP_TURN_TOLERANCE };
        let moved = match finger.closes() {
            true => finger.ik.push(&joints, &world_from_object.vector(&normal), -left, (0.0, STEEPEST)),
            false => finger.touch_near(world_from_object, &wanted, &joints, &settings),
        };
        joints = moved.ok_or(NoTouch::Stuck(gap))?;
        (contact, left) = finger.contact_at(surface, &joints, world_from_object).ok_or(NoTouch::Stuck(gap))?;
    }
    Err(NoTouch::Stuck(gap))
}

/// True when the tip's centre and all joints are as near to where they were given as a given grasp may be.
fn is_near(finger: &FingerModel, given: &Coordinates, joints: &Coordinates) -> bool {
    let turn = given.iter().zip(joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    (finger.ik.tip(given) - finger.ik.tip(joints)).norm() <= GRASP_TOLERANCE && turn <= GRASP_TURN_TOLERANCE
}

/// A finger that the plan has elsewhere than the query, because it did not touch there.
#[derive(Debug, Clone, PartialEq)]
pub struct MovedFinger {
    /// `start` or `goal`.
    pub end: &'static str,
    /// Name of the finger.
    pub finger: String,
    /// How far its tip or its contact was moved, in metres.
    pub distance: f64,
}

/// Which given fingertips and contacts `plan` has moved onto the surface, and how far.
pub fn moved_fingers(view: &HandView, query: &Query, plan: &Plan) -> Vec<MovedFinger> {
    let first = plan.segments.first().and_then(|segment| segment.waypoints.first());
    let last = plan.segments.last().and_then(|segment| segment.waypoints.last());
    let ends = [("start", query.start_grasp(), first), ("goal", query.goal_grasp(), last)];
    let mut moved = Vec::new();
    for (end, grasp, waypoint) in ends {
        let Some(waypoint) = waypoint else { continue };
        for (finger, distance) in view.hand.fingers.iter().zip(distances(view, grasp, waypoint)) {
            if distance > WORTH_A_WORD {
                moved.push(MovedFinger { end, finger: finger.name.clone(), distance });
            }
        }
    }
    moved
}

/// Per finger, how far it is from what is asked.
fn distances(view: &HandView, asked: &GraspRequest, waypoint: &Waypoint) -> Vec<f64> {
    match asked {
        GraspRequest::Automatic => Vec::new(),
        GraspRequest::Contacts(points) => {
            let contacts = waypoint.contacts.iter().map(|contact| contact.point_in_object.map(Point::from));
            points.iter().zip(contacts).map(|(asked, found)| found.map_or(0.0, |at| (at - asked).norm())).collect()
        }
        GraspRequest::Joints(values) | GraspRequest::Posture { joints: values, .. } => {
            let mut first = 0;
            let tip_moved = |finger: &regrasp_robot::hand::Finger| {
                let own = first..first + finger.ik.chain().n_coordinates();
                first = own.end;
                let ends = values.get(own.clone()).zip(waypoint.joints.get(own));
                ends.map_or(0.0, |(a, b)| (finger.ik.tip(a) - finger.ik.tip(b)).norm())
            };
            view.hand.fingers.iter().map(tip_moved).collect()
        }
    }
}

/// The contact that a finger takes for a given point, and how far that is from the point, in metres.
pub fn contact_for(finger: &FingerModel, surface: &Surface, given: &Point) -> (Contact, f64) {
    let foot = surface.project(given);
    let foot = surface.settle(&foot, finger.settle_radius).unwrap_or(foot);
    let contact = Contact { point_in_object: foot.point_in_object, normal_in_object: foot.normal_in_object };
    (contact, (foot.point_in_object - given).norm())
}
