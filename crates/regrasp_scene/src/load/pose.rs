//! Positions, orientations and turns in scene files.

use super::numbers::shown;
use nalgebra::UnitQuaternion;
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_geometry::frame::{direction, length};
use regrasp_geometry::{Pose, UnitVector, Vector, pose_from};
use std::f64::consts::TAU;

/// A quaternion whose length differs from 1 by more is an error, not a rounding.
const QUATERNION_TOLERANCE: f64 = 1e-2;
/// A quaternion whose length differs from 1 by more is normalised with a note.
const QUATERNION_NOTE: f64 = 1e-6;

/// `position`, in metres.
pub(super) fn position(table: &mut Table, found: &mut Found) -> Option<Vector> {
    let entry = table.required(found, "position", "add position = [x, y, z], in metres")?;
    entry.numbers(found).map(Vector::from)
}

/// Keys of an orientation.
pub(super) const ORIENTATIONS: [&str; 3] = ["quat_xyzw", "quat_wxyz", "rotation_vector"];

/// Orientation of [`ORIENTATIONS`].
pub(super) fn orientation(table: &mut Table, found: &mut Found) -> Option<UnitQuaternion<f64>> {
    Some(pose_from([0.0; 3], quaternion(table, found)?).rotation)
}

/// `quat_xyzw`, `quat_wxyz` or `rotation_vector` (axis times angle, in radians), as x y z w of length one; no turn when none
/// is given.
///
/// Errors: several given (`S106`), a zero quaternion (`V003`), its length off by more than 1e-2 (`V002`), a rotation vector that
/// is longer than a turn (`S107`).
pub(super) fn quaternion(table: &mut Table, found: &mut Found) -> Option<[f64; 4]> {
    let entries = table.present(&ORIENTATIONS);
    let [entry] = entries.as_slice() else {
        if let [first, second, ..] = entries.as_slice() {
            let diagnostic =
                second.error("S106", found, format!("says the same as {}", first.name)).fix("keep one of them");
            found.diagnostics.push(diagnostic);
            return None;
        }
        return Some([0.0, 0.0, 0.0, 1.0]);
    };
    if entry.name.ends_with("rotation_vector") {
        let vector = Vector::from(entry.numbers::<3>(found)?);
        let angle = length(&vector);
        if angle > TAU {
            let diagnostic = entry.error("S107", found, format!("turns by {} rad", shown(angle, 3)));
            found.diagnostics.push(diagnostic.expected("an axis times an angle of at most 2 pi radians"));
            return None;
        }
        return Some(UnitQuaternion::from_scaled_axis(vector).coords.into());
    }
    let [a, b, c, d] = entry.numbers::<4>(found)?;
    let [x, y, z, w] = if entry.name.ends_with("quat_wxyz") { [b, c, d, a] } else { [a, b, c, d] };
    let norm = x.hypot(y).hypot(z.hypot(w));
    if norm == 0.0 {
        let diagnostic = entry
            .error("V003", found, "is the zero quaternion, which is no rotation")
            .fix("no rotation is quat_xyzw = [0, 0, 0, 1]");
        found.diagnostics.push(diagnostic);
        return None;
    }
    if !norm.is_finite() || (norm - 1.0).abs() > QUATERNION_TOLERANCE {
        let diagnostic = entry
            .error("V002", found, format!("has length {}", shown(norm, 6)))
            .expected(format!("a unit quaternion (length 1 within {QUATERNION_TOLERANCE})"))
            .fix(format!("divided by its length it is {:.9?}", [a, b, c, d].map(|part| part / norm)));
        found.diagnostics.push(diagnostic);
        return None;
    }
    if (norm - 1.0).abs() > QUATERNION_NOTE {
        found.note(&entry.span, format!("{} has length {norm:.6} and was normalised", entry.name));
    }
    Some([x / norm, y / norm, z / norm, w / norm])
}

/// `position` and orientation.
pub(super) fn pose(table: &mut Table, found: &mut Found) -> Option<Pose> {
    let position = position(table, found);
    let quaternion = quaternion(table, found);
    Some(pose_from(position?.into(), quaternion?))
}

/// `{ axis, angle_deg }`: a turn about an axis of the world; the angle in radians.
pub(super) fn turn(entry: &Entry, found: &mut Found) -> Option<(UnitVector, f64)> {
    let mut table = entry.table(found)?;
    let axis = table
        .required(found, "axis", "add axis = \"x\", \"y\", \"z\" or [x, y, z]")
        .and_then(|entry| axis(&entry, found));
    let angle = table
        .required(found, "angle_deg", "add angle_deg = 90")
        .and_then(|entry| entry.number_that(found, "degrees between -3600 and 3600", |angle| angle.abs() <= 3600.0));
    table.finish(found);
    Some((axis?, angle?.to_radians()))
}

fn axis(entry: &Entry, found: &mut Found) -> Option<UnitVector> {
    if entry.as_text().is_some() {
        return Some(match entry.choice(found, &["x", "y", "z"])? {
            "x" => Vector::x_axis(),
            "y" => Vector::y_axis(),
            _ => Vector::z_axis(),
        });
    }
    let axis = direction(&Vector::from(entry.numbers::<3>(found)?));
    if axis.is_none() {
        let diagnostic = entry.error("S107", found, "is the zero vector, which is no axis").expected("a direction");
        found.diagnostics.push(diagnostic);
    }
    axis
}
