//! Random grasps, and what other ways of knowing say about them.

use nalgebra::{DMatrix, DVector};
use regrasp_base::Rng;
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_grasp::{Contact, ContactModel, GraspFrame, Grip};

pub const FRAME: GraspFrame =
    GraspFrame { center_of_mass: Point::new(0.001, -0.002, 0.003), torque_scale: 0.03, friction: 0.5 };

pub fn soft(torsion_radius: f64) -> ContactModel {
    ContactModel::SoftFinger { torsion_radius }
}

/// Contacts on a bumpy ball: normals are not those of a sphere, so that every torque has a lever.
pub fn grips(models: &[ContactModel], rng: &mut Rng) -> Vec<Grip> {
    models
        .iter()
        .map(|&model| {
            let direction = Vector::from(rng.direction());
            let normal = UnitVector::new_normalize(direction + Vector::from(rng.direction()) * 0.3);
            let point_in_object = Point::from(direction * rng.uniform(0.02, 0.03));
            Grip { contact: Contact { point_in_object, normal_in_object: normal }, model }
        })
        .collect()
}

/// `n` models drawn from all three.
pub fn models(n: usize, rng: &mut Rng) -> Vec<ContactModel> {
    (0..n)
        .map(|_| match rng.below(4) {
            0 => ContactModel::Frictionless,
            1 => ContactModel::Point,
            _ => soft(rng.uniform(0.002, 0.01)),
        })
        .collect()
}

/// Unit forces that span the cone of `grip`, its axis first: wrenches (force; torque / scale). Those across the axis are
/// orthonormal in the cone's own coordinates.
pub fn columns(grip: &Grip, frame: &GraspFrame) -> Vec<[f64; 6]> {
    let normal = grip.contact.normal_in_object.into_inner();
    let arm = (grip.contact.point_in_object - frame.center_of_mass) / frame.torque_scale;
    let helper = if normal.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
    let x = normal.cross(&helper).normalize();
    let wrench = |force: Vector, torque: Vector| [force.x, force.y, force.z, torque.x, torque.y, torque.z];
    let force = |direction: Vector| wrench(direction, arm.cross(&direction));
    let mut columns = vec![force(-normal)];
    match grip.model {
        ContactModel::Frictionless => {}
        ContactModel::Point => columns.extend([force(x), force(normal.cross(&x))]),
        ContactModel::SoftFinger { torsion_radius } => {
            let moment = wrench(Vector::zeros(), normal * (torsion_radius / frame.torque_scale));
            columns.extend([force(x), force(normal.cross(&x)), moment]);
        }
    }
    columns
}

/// The grasp map and the first column of each contact.
pub fn grasp_map(grips: &[Grip], frame: &GraspFrame) -> (DMatrix<f64>, Vec<usize>) {
    let (mut all, mut starts) = (Vec::new(), Vec::new());
    for grip in grips {
        starts.push(all.len());
        all.extend(columns(grip, frame));
    }
    starts.push(all.len());
    (DMatrix::from_fn(6, all.len(), |row, column| all[column][row]), starts)
}

/// Largest work of a unit-effort contact force along `direction`.
pub fn support(grips: &[Grip], frame: &GraspFrame, direction: &DVector<f64>) -> f64 {
    grips
        .iter()
        .map(|grip| {
            let work: Vec<f64> = columns(grip, frame)
                .iter()
                .map(|column| column.iter().zip(direction.iter()).map(|(a, b)| a * b).sum())
                .collect();
            work[0] + frame.friction * work[1..].iter().map(|x| x * x).sum::<f64>().sqrt()
        })
        .fold(0.0, f64::max)
}

/// Smallest support found by descent from many directions: an upper bound of the Ferrari-Canny radius.
pub fn least_support(grips: &[Grip], frame: &GraspFrame, rng: &mut Rng) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..8 {
        let mut draw = || DVector::from_fn(6, |_, _| rng.normal()).normalize();
        let mut u = draw();
        let mut best = support(grips, frame, &u);
        let mut radius = 0.5;
        while radius > 1e-5 {
            let mut improved = false;
            for _ in 0..50 {
                let next = (&u + draw() * radius).normalize();
                let value = support(grips, frame, &next);
                if value < best {
                    (u, best, improved) = (next, value, true);
                }
            }
            if !improved {
                radius *= 0.6;
            }
        }
        least = least.min(best);
    }
    least
}
