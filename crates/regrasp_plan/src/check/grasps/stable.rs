//! Stable poses, by a polygon of the object's own vertices, and hands that stay above the support.

use super::waypoints::way_of;
use super::{Judged, Measured};
use crate::check::Log;
use crate::check::bodies::{Bodies, OBJECT, Owner, Pair};
use crate::check::motion::{WaypointStep, certify};
use crate::check::polygon::distance_inside;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use nalgebra::UnitQuaternion;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_grasp::list::{GraspList, StablePose};
use regrasp_scene::Object;

/// Vertices this near to the plane carry the object, in metres: `docs/reference/grasp-list-format.md`.
const ON_PLANE: f64 = 0.2e-3;
/// The plane may be this far from the lowest vertex, in metres: rounding.
const HEIGHT_TOLERANCE: f64 = 1e-6;
/// Tipping angles may be this much too large, in radians: the rim of a cylinder is taken as a polygon.
const ANGLE_TOLERANCE: f64 = 1e-4;
/// Corners of the polygon that stands for a rim.
const RIM: usize = 720;
/// Half the length and half the thickness of the plate that stands for the support, in metres: hands are smaller.
const PLATE: [f64; 2] = [1.5, 0.5];
/// Pieces of motion that are looked at in one step.
const MOST_PIECES: u64 = 200_000;

/// Judges the stable poses of the list.
pub(super) fn check_poses(object: &Object, list: &GraspList, log: &mut Log) {
    let corners = corners_of(&object.shape);
    for (index, pose) in list.stable_poses.iter().enumerate() {
        if let Err(problem) = check_pose(&corners, object, pose, list.promises.tipping_angle) {
            let message = format!("stable pose {index}: {problem}");
            log.push(Violation::new(Kind::StablePoseWrong, message).subjects([object.name.as_str()]));
        }
    }
}

/// The points that carry an object on a plane; none for what rolls everywhere.
fn corners_of(shape: &Shape) -> Vec<Point> {
    match shape {
        Shape::Cuboid { half_extents: h } => {
            let side = |k: usize, bit: usize| if k >> bit & 1 == 1 { h[bit] } else { -h[bit] };
            (0..8).map(|k| Point::new(side(k, 0), side(k, 1), side(k, 2))).collect()
        }
        Shape::Cylinder { half_length, radius } => (0..2 * RIM)
            .map(|k| {
                let angle = std::f64::consts::TAU * (k / 2) as f64 / RIM as f64;
                let z = if k % 2 == 0 { *half_length } else { -half_length };
                Point::new(radius * angle.cos(), radius * angle.sin(), z)
            })
            .collect(),
        Shape::Convex(hull) => hull.vertices().to_vec(),
        Shape::Mesh(mesh) => mesh.vertices().to_vec(),
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => Vec::new(),
    }
}

fn check_pose(corners: &[Point], object: &Object, pose: &StablePose, least: f64) -> Result<(), String> {
    let down = Vector::from(pose.down_in_object);
    let height = corners.iter().map(|p| p.coords.dot(&down)).fold(f64::NEG_INFINITY, f64::max);
    if !((height - pose.height).abs() <= HEIGHT_TOLERANCE) {
        return Err(format!(
            "the object's lowest point is at {height:.6} m along down, the plane at {:.6} m",
            pose.height
        ));
    }
    let above = height - down.dot(&object.center_of_mass.coords);
    // Every line through two points of what touches that has all others on one side is a side of the polygon; what counts is
    // the least distance of the centre of mass's foot from the sides, which is the least value of the support function.
    let foot = object.center_of_mass + down * above;
    let touching: Vec<Vector> =
        corners.iter().filter(|p| p.coords.dot(&down) > height - ON_PLANE).map(|p| p - foot).collect();
    let distance = distance_inside(&touching, &down);
    let angle = distance.atan2(above);
    if distance > 0.0 && angle >= pose.tipping_angle - ANGLE_TOLERANCE && angle >= least - ANGLE_TOLERANCE {
        return Ok(());
    }
    Err(format!(
        "the object tips over at {:.4} rad, the list says {:.4} and promises {least:.4}",
        angle, pose.tipping_angle
    ))
}

/// Judges that the hand stays above the support in the poses that the grasp names.
pub(super) fn check_grasp(judged: &Judged, index: usize, log: &mut Log, measured: &mut Measured) {
    let grasp = &judged.list.grasps[index];
    if grasp.stable_poses.is_empty() {
        return;
    }
    let [before, open, closed] = way_of(grasp);
    let bodies = judged.bodies;
    let of_hand = |a: &usize| matches!(bodies.items[*a].owner, Owner::Finger(_) | Owner::Palm);
    for ends in [[&before, &open], [&open, &closed]] {
        let mut step = WaypointStep::new(bodies, ends[0], ends[1]);
        step.most_pieces = MOST_PIECES;
        for &which in &grasp.stable_poses {
            let plate = judged.first_plate + which;
            for a in (0..judged.first_plate).filter(of_hand) {
                let pair = Pair { a, b: plate, tip_of: None };
                let resolution = judged.settings.resolution;
                if let Err(breach) = certify(&mut step, &pair, (0.0, 1.0), f64::NEG_INFINITY, 0.0, resolution) {
                    let name = bodies.items[a].name.as_str();
                    let message = format!("\"{name}\" reaches below the support of stable pose {which}");
                    let at = Moment { segment: 0, waypoint: index, fraction: breach.t };
                    let violation = Violation::new(Kind::StablePoseWrong, message).when(at).subjects([name]);
                    log.push(violation.amount(breach.distance.map_or(f64::NAN, |distance| -distance), 0.0));
                    break;
                }
            }
        }
        measured.n_distances += step.n_distances;
    }
}

/// Adds a plate below the object for every stable pose of the list. They are in no pair: only hands that are said to stay above
/// them are judged.
pub(super) fn add_plates(bodies: &mut Bodies, list: &GraspList) -> Result<(), String> {
    for pose in &list.stable_poses {
        let down = Vector::from(pose.down_in_object);
        let turn = UnitQuaternion::rotation_between(&Vector::z(), &down)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f64::consts::PI));
        let [half_length, half_thickness] = PLATE;
        let at = Pose::from_parts((down * (pose.height + half_thickness)).into(), turn);
        let plate = Shape::Cuboid { half_extents: Vector::new(half_length, half_length, half_thickness) };
        bodies.add("support", Owner::Obstacle, OBJECT, &at, &plate)?;
    }
    Ok(())
}
