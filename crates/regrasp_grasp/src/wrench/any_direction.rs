//! Room for a weight whose direction is not known.
//!
//! A grasp holds whatever the direction of gravity when forces `f0` that balance nothing keep enough room: with the
//! weight `w d`, `d` of unit length, the forces `f0 - w K d` balance it, where `K` are the force columns of the least-norm
//! right inverse `G^T (G G^T)^-1` of the grasp map `G` (wrenches as force and torque over the torque scale; columns for
//! unit forces against the normal and across it, and for a unit of torsion over torsion radius). Of the rows of one contact
//! let `k` be that of the normal force and `T` the others, and of a joint's torques over these coordinates let `r` be the
//! row. Over all `d` the normal force then changes by at most `w |k|`, the joint's torque by at most `w |r K|`, and the
//! length of tangential force and torsion by at most `w` times the largest singular value of `T`. Kept free are these
//! changes, and from the cone both the first times the friction coefficient and the last: enough, though not always needed,
//! as they need not come together.

use super::barrier::MAX_GRIPS;
use super::force_distribution::{JointRow, JointRows, Reserve, axes, exerted};
use crate::closure::GraspFrame;
use crate::contact::{ContactForce, Grip};
use arrayvec::ArrayVec;
use nalgebra::{Matrix3, Matrix4x3, Matrix6, Matrix6x3, Matrix6x4};
use regrasp_geometry::Vector;

/// What to keep free at each contact for a weight of `weight` newtons at the centre of mass, whatever its direction. None
/// where the contacts cannot exert forces in every direction without torque.
pub fn reserves(
    grips: &[Grip],
    joints: &[JointRows],
    frame: &GraspFrame,
    weight: f64,
) -> Option<ArrayVec<Reserve, MAX_GRIPS>> {
    let answers = answers(grips, frame)?;
    let reserve = |(index, answer): (usize, &Matrix4x3<f64>)| {
        let across = answer.fixed_rows::<3>(1);
        let largest = (across * across.transpose()).symmetric_eigenvalues().max();
        let axes = axes::<4>(frame.friction, &grips[index]);
        let joint = |row: &JointRow| {
            let torques = nalgebra::Vector4::from_fn(|i, _| row.torque(&axes[i]));
            weight * answer.tr_mul(&torques).norm()
        };
        Reserve {
            normal: weight * answer.row(0).norm(),
            tangential: weight * largest.max(0.0).sqrt(),
            joints: joints.get(index).into_iter().flatten().map(joint).collect(),
        }
    };
    Some(answers.iter().enumerate().map(reserve).collect())
}

/// What has to be added to forces that balance nothing so that they balance `load`, a force at the centre of mass.
pub fn answer(grips: &[Grip], frame: &GraspFrame, load: &Vector) -> Option<ArrayVec<ContactForce, MAX_GRIPS>> {
    let answers = answers(grips, frame)?;
    let added = |(grip, answer): (&Grip, &Matrix4x3<f64>)| {
        let coordinates: [f64; 4] = (-(answer * load)).into();
        exerted(frame.friction, grip, &coordinates)
    };
    Some(grips.iter().zip(&answers).map(added).collect())
}

/// Force columns of the least-norm right inverse, contact by contact.
fn answers(grips: &[Grip], frame: &GraspFrame) -> Option<ArrayVec<Matrix4x3<f64>, MAX_GRIPS>> {
    let map = |grip: &Grip| -> Matrix6x4<f64> {
        let arm = (grip.contact.point_in_object - frame.center_of_mass) / frame.torque_scale;
        let axes = axes::<4>(frame.friction, grip);
        Matrix6x4::from_columns(&axes.map(|axis| {
            let twist = grip.contact.normal_in_object.into_inner() * (axis.torsion / frame.torque_scale);
            let torque = arm.cross(&axis.force) + twist;
            nalgebra::Vector6::new(axis.force.x, axis.force.y, axis.force.z, torque.x, torque.y, torque.z)
        }))
    };
    let maps: ArrayVec<Matrix6x4<f64>, MAX_GRIPS> = grips.iter().map(map).collect();
    let square: Matrix6<f64> = maps.iter().map(|map| map * map.transpose()).sum();
    let factor = square.cholesky()?;
    let diagonal = factor.l_dirty().diagonal();
    if !(diagonal.min() > 1e-6 * diagonal.max()) {
        return None;
    }
    let mut forces = Matrix6x3::zeros();
    forces.fixed_rows_mut::<3>(0).copy_from(&Matrix3::identity());
    let inverse = factor.solve(&forces);
    Some(maps.iter().map(|map| map.tr_mul(&inverse)).collect())
}
