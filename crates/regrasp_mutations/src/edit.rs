//! Small changes of a plan that several kinds of damage make.

use super::choice::{pick, waypoints_mut};
use nalgebra::{DMatrix, DVector};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::pose::pose_difference;
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::plan::{Plan, PoseData, Segment};

pub(super) fn shift(pose: &mut PoseData, rng: &mut Rng, low: f64, high: f64) {
    let way = Vector::from(rng.direction()) * rng.uniform(low, high);
    (0..3).for_each(|k| pose.position[k] += way[k]);
}

pub(super) fn travel(segment: &Segment) -> f64 {
    match (segment.waypoints.first(), segment.waypoints.last()) {
        (Some(a), Some(b)) => {
            let (distance, angle) = pose_difference(&a.world_from_object, &b.world_from_object);
            distance.max(angle)
        }
        _ => 0.0,
    }
}

/// True when the object or a joint ends more than a millionth of a metre or radian from where it began.
pub(super) fn goes_somewhere(segment: &Segment) -> bool {
    let (Some(first), Some(last)) = (segment.waypoints.first(), segment.waypoints.last()) else { return false };
    travel(segment) > 1e-6 || first.joints.iter().zip(&last.joints).any(|(a, b)| (a - b).abs() > 1e-6)
}

/// Moves the tip of finger `f` so that its centre is at `target`, by damped least squares from where it is.
///
/// None when it does not get there within a micrometre.
pub(super) fn move_tip(model: &CheckedHand, f: usize, joints: &mut [f64], target: &Point) -> Option<()> {
    let finger = &model.fingers[f];
    let mut trial = joints.to_vec();
    for _ in 0..200 {
        let here = finger.center_in_world(&trial);
        let error = target - here;
        if error.norm() < 1e-6 {
            joints.copy_from_slice(&trial);
            return Some(());
        }
        let n_coordinates = finger.coordinates.len();
        let mut jacobian = DMatrix::zeros(3, n_coordinates);
        for (column, k) in finger.coordinates.clone().enumerate() {
            let step = 1e-7;
            trial[k] += step;
            jacobian.set_column(column, &((finger.center_in_world(&trial) - here) / step));
            trial[k] -= step;
        }
        let damped = &jacobian * jacobian.transpose() + DMatrix::identity(3, 3) * 1e-9;
        let solved = damped.lu().solve(&DVector::from_column_slice(error.as_slice()))?;
        let change = jacobian.transpose() * solved;
        let scale = (0.2 / change.norm().max(1e-12)).min(1.0);
        for (column, k) in finger.coordinates.clone().enumerate() {
            trial[k] += scale * change[column];
        }
    }
    None
}

/// Replaces one contact wherever it stands, and moves the joints along with it.
pub(super) fn replace_contact(
    plan: &mut Plan,
    model: &CheckedHand,
    rng: &mut Rng,
    change: impl Fn(Point, UnitVector, &mut Rng) -> (Point, UnitVector),
) -> Option<()> {
    let f = rng.below(model.fingers.len());
    let first = pick(&mut plan.segments, rng)?.waypoints.first()?.contacts[f];
    let contact = contact_of(&first)?;
    let (point, normal) = change(contact.point_in_object, contact.normal_in_object, rng);
    for waypoint in waypoints_mut(plan) {
        if waypoint.contacts[f] == first {
            let state = &mut waypoint.contacts[f];
            state.point_in_object = Some(point.into());
            state.normal_in_object = Some(normal.into_inner().into());
            let center = point + model.fingers[f].center_from_contact(waypoint, &normal);
            move_tip(model, f, &mut waypoint.joints, &(Pose::from(&waypoint.world_from_object) * center))?;
        }
    }
    Some(())
}
