//! Validating a plan once at the planner's resolution: the floor of planning time.
//!
//! This is a measure, not a judge: it shares everything with the planner. The judge is `regrasp_plan::check`.

use super::model::Model;
use super::settings::InHandSettings;
use super::workspace::{Contacts, HandJoints, TipMode, Workspace};
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_grasp::{Contact, closure};
use regrasp_plan::plan::{Plan, Segment, SegmentKind, Waypoint};
use regrasp_scene::Scene;

/// Steps through every waypoint of `plan` once, as the planner does: kinematics, collision and closure.
///
/// Returns the index of the first segment that fails, if one does.
pub fn validate_once(scene: &Scene, plan: &Plan, settings: &InHandSettings) -> Result<(), usize> {
    let model = Model::new(scene, settings);
    let mut workspace = Workspace::new(&model);
    for (index, segment) in plan.segments.iter().enumerate() {
        if !segment_is_valid(&model, &mut workspace, segment) {
            return Err(index);
        }
    }
    Ok(())
}

fn segment_is_valid(model: &Model, workspace: &mut Workspace, segment: &Segment) -> bool {
    let (Some(first), Some(last)) = (segment.waypoints.first(), segment.waypoints.last()) else { return false };
    let Some(contacts) = contacts_of(first) else { return false };
    let moving = segment.moving_finger.as_ref().and_then(|name| model.scene.hand.finger_named(name)).map(|id| id.0);
    let holding: Vec<Contact> = (0..contacts.len()).filter(|&f| Some(f) != moving).map(|f| contacts[f]).collect();
    if closure::closure_margin(&holding, &model.frame) < model.settings.closure_margin {
        return false;
    }
    let pose = Pose::from(&first.world_from_object);
    workspace.set(&pose, &joints_of(model, first), &contacts);
    match (segment.kind, moving) {
        (SegmentKind::Transfer, _) => segment.waypoints[1..].iter().all(|waypoint| {
            workspace.step(&Pose::from(&waypoint.world_from_object), &joints_of(model, waypoint), TipMode::AllHold)
        }),
        (SegmentKind::Regrasp, Some(finger)) => {
            let Some(landing) = contacts_of(last) else { return false };
            let ends = [contacts[finger], landing[finger]].map(|contact| End::new(model, finger, &pose, &contact));
            segment.waypoints[1..].iter().all(|waypoint| {
                let joints = &joints_of(model, waypoint)[finger];
                let before = model.fingers[finger].ik.tip(&workspace.joints()[finger]);
                let after = model.fingers[finger].ik.tip(joints);
                let over =
                    ends.iter().find(|end| end.height_over(&before).is_some() && end.height_over(&after).is_some());
                let mode = match over {
                    Some(end) => TipMode::Near { finger, normal_in_world: end.normal.into_inner() },
                    None => TipMode::Away { finger, clearance: 0.0 },
                };
                workspace.step_finger(finger, joints, mode)
            })
        }
        (SegmentKind::Regrasp, None) => false,
    }
}

/// A contact with the line that the tip's centre leaves it along.
struct End {
    foot: Point,
    normal: UnitVector,
}

impl End {
    fn new(model: &Model, finger: usize, pose: &Pose, contact: &Contact) -> Self {
        let placement = Placement::from(pose);
        let normal: Vector = placement.vector(&contact.normal_in_object);
        let foot = placement.point(&contact.point_in_object) + normal * model.fingers[finger].tip_radius;
        End { foot, normal: UnitVector::new_unchecked(normal) }
    }

    /// Height of a tip's centre that is straight over the contact.
    fn height_over(&self, tip: &Point) -> Option<f64> {
        let arm = tip - self.foot;
        let height = arm.dot(&self.normal);
        ((arm - self.normal.into_inner() * height).norm() < 1e-5 && height > -1e-5).then_some(height)
    }
}

fn contacts_of(waypoint: &Waypoint) -> Option<Contacts> {
    waypoint
        .contacts
        .iter()
        .map(|contact| {
            let point_in_object = Point::from(Vector::from(contact.point_in_object?));
            let normal_in_object = UnitVector::new_normalize(Vector::from(contact.normal_in_object?));
            Some(Contact { point_in_object, normal_in_object })
        })
        .collect()
}

fn joints_of(model: &Model, waypoint: &Waypoint) -> HandJoints {
    let mut rest = waypoint.joints.as_slice();
    model
        .fingers
        .iter()
        .map(|finger| {
            let (own, others) = rest.split_at(finger.ik.chain().n_coordinates().min(rest.len()));
            rest = others;
            own.iter().copied().collect()
        })
        .collect()
}
