//! The closed form for arms whose first three axes meet in a shoulder and whose last three meet in a wrist (S-R-S).
//!
//! The distance from shoulder to wrist gives the elbow, in two branches. What is left is a turn about the line from shoulder to wrist,
//! the free angle: rotations of shoulder and wrist are linear in its cosine and sine (Shimizu 2008, sec. III). So is each condition that
//! a joint stands at a limit, and the borders of the free angle's feasible intervals are roots of waves. Axes may have any angle between
//! neighbours, and the elbow any offset.

use super::triple::{Border, MAX_BORDERS, Range, Triple};
use super::wave::{FreeRotation, Wave, turn};
use super::{ArmPosture, LIMIT_TOLERANCE, MEETING, Unreachable};
use crate::kinematics::body_frame::BodyFrame;
use crate::kinematics::chain::{Chain, JointLine, JointMotion};
use crate::kinematics::finger_ik::Coordinates;
use arrayvec::ArrayVec;
use nalgebra::Matrix3;
use regrasp_geometry::Vector;
use std::f64::consts::TAU;

/// Joints of the arm.
const N_JOINTS: usize = 7;
/// Distance outside of reach that is rounding, in metres.
const REACH_TOLERANCE: f64 = 1e-10;
/// Angle of the elbow outside its limits that may be rounding: near the stretched arm it has half the digits.
const LIMIT_SLACK: f64 = 1e-7;
/// Half the difference of the elbow's branches below which they are one, in radians.
const STRETCHED: f64 = 1e-9;
/// Borders that are this near are one, in radians.
const SAME_BORDER: f64 = 1e-10;
/// Distance between shoulder and wrist below which the free angle has no axis, in metres.
const FOLDED: f64 = 1e-6;

/// An arm with spherical shoulder and wrist.
#[derive(Debug, Clone)]
pub(super) struct SphericalArm {
    shoulder: Vector,
    shoulder_joints: Triple,
    elbow_axis: Vector,
    elbow_point: Vector,
    elbow_range: Range,
    /// Square of the distance from shoulder to wrist over the angle of the elbow.
    distance: Wave,
    /// The wrist while all joints are at zero.
    wrist: Vector,
    wrist_joints: Triple,
    /// The wrist in the last body.
    wrist_in_last: Vector,
    /// Rotation of the last body while all joints are at zero.
    zero_rotation: Matrix3<f64>,
    /// How far outside of its reach a wrist may seem to be: rounding, and axes that nearly meet.
    looseness: f64,
    names: Vec<String>,
}

/// Postures with one branch of elbow, shoulder and wrist each, over the free angle.
#[derive(Debug, Clone)]
pub struct Family {
    /// Angle of the elbow.
    pub elbow: f64,
    /// Branch of the shoulder, and of the wrist: the middle joint is above or below the angle at which the branches meet.
    pub is_upper: [bool; 2],
    /// Parts of the free angle in which all joints keep their limits: from a first angle in `-pi..pi` to a later one. They end where a
    /// joint comes to a limit or where branches meet.
    pub intervals: Vec<[f64; 2]>,
    /// The pose of the last body.
    pub(super) base_from_last: BodyFrame,
    shoulder: FreeRotation,
    wrist: FreeRotation,
}

impl SphericalArm {
    /// None where the chain has another form.
    pub fn new(chain: &Chain) -> Option<Self> {
        let is_own = |k: usize| chain.joints[k].drive == crate::coupling::Coupling::independent(k);
        let turns = chain.joints.iter().all(|joint| joint.motion == JointMotion::Turn);
        if chain.joints.len() != N_JOINTS || chain.n_coordinates() != N_JOINTS || !turns {
            return None;
        }
        if !(0..N_JOINTS).all(is_own) || !chain.linear_limits.is_empty() {
            return None;
        }
        let mut lines = ArrayVec::<JointLine, N_JOINTS>::new();
        let zero = chain.joint_lines(&[0.0; N_JOINTS], &mut lines);
        let range = |k: usize| Range { lower: chain.lower[k], upper: chain.upper[k] };
        let triple = |k: usize| Triple::new([k, k + 1, k + 2].map(|j| lines[j].axis), [k, k + 1, k + 2].map(range));
        let ((shoulder, off_shoulder), (wrist, off_wrist)) = (meeting(&lines[..3])?, meeting(&lines[4..])?);
        let (axis, point) = (lines[3].axis, lines[3].origin);
        let (to_wrist, to_shoulder) = (wrist - point, shoulder - point);
        let along = axis * axis.dot(&to_wrist);
        let across = to_wrist - along;
        let distance = Wave {
            constant: to_wrist.norm_squared() + to_shoulder.norm_squared() - 2.0 * to_shoulder.dot(&along),
            cosine: -2.0 * to_shoulder.dot(&across),
            sine: -2.0 * to_shoulder.dot(&axis.cross(&across)),
        };
        if distance.amplitude() < MEETING {
            return None;
        }
        Some(SphericalArm {
            shoulder,
            shoulder_joints: triple(0)?,
            elbow_axis: axis,
            elbow_point: point,
            elbow_range: range(3),
            distance,
            wrist,
            wrist_joints: triple(4)?,
            wrist_in_last: zero.rotation.transpose() * (wrist - zero.translation),
            zero_rotation: zero.rotation,
            looseness: REACH_TOLERANCE + 4.0 * (off_shoulder + off_wrist),
            names: chain.names.clone(),
        })
    }

    /// All families of postures with which the last body stands at `base_from_last`; only those with a feasible interval.
    ///
    /// Errors: how far out of reach it is.
    pub fn families(&self, base_from_last: &BodyFrame) -> Result<Vec<Family>, Unreachable> {
        let wrist = base_from_last.rotation * self.wrist_in_last + base_from_last.translation;
        let way = wrist - self.shoulder;
        let elbows = self.elbows(way.norm())?;
        let turned = base_from_last.rotation * self.zero_rotation.transpose();
        let mut families = Vec::new();
        let mut nearest = Unreachable::Limits { joint: self.names[3].clone(), by: f64::INFINITY };
        for elbow in elbows {
            let at_elbow = turn(&self.elbow_axis, elbow);
            let to_wrist = at_elbow * (self.wrist - self.elbow_point) + self.elbow_point - self.shoulder;
            let shoulder = FreeRotation::between(&to_wrist, &way);
            let wrist = shoulder.rest_of(&at_elbow, &turned);
            let borders = self.borders(&shoulder, &wrist);
            for is_upper in [[false, false], [false, true], [true, false], [true, true]] {
                let mut family =
                    Family { elbow, is_upper, intervals: Vec::new(), base_from_last: *base_from_last, shoulder, wrist };
                self.find_intervals(&mut family, &borders, &mut nearest);
                if !family.intervals.is_empty() {
                    families.push(family);
                }
            }
        }
        if families.is_empty() { Err(nearest) } else { Ok(families) }
    }

    /// Angles of the elbow at which the wrist is at `distance` from the shoulder.
    fn elbows(&self, distance: f64) -> Result<ArrayVec<f64, 2>, Unreachable> {
        let Range { lower, upper } = self.elbow_range;
        let inside = |angle: f64| self.elbow_range.place(angle, 0.0, 0.0).ok();
        let crest = self.distance.crest();
        let turning = [crest, crest + 0.5 * TAU].into_iter().filter_map(inside);
        let ends = [lower, upper].into_iter().filter(|end| end.is_finite());
        let reached = ends.chain(turning).map(|angle| self.distance.at(angle).max(0.0).sqrt());
        let [least, most] = reached.fold([f64::INFINITY, 0.0], |[least, most], d: f64| [least.min(d), most.max(d)]);
        if distance > most + self.looseness {
            return Err(Unreachable::TooFar { by: distance - most });
        }
        if distance < least.max(FOLDED) - self.looseness {
            return Err(Unreachable::TooNear { by: least.max(FOLDED) - distance });
        }
        // At a limit of the elbow, or stretched, rounding may be on the wrong side.
        let kept = distance.clamp(least, most);
        let half = self.distance.half_width(kept * kept, self.looseness).unwrap_or(0.0);
        let branches = if half < STRETCHED { &[0.0][..] } else { &[-1.0, 1.0] };
        let angles = branches.iter().map(|side| crest + side * half);
        Ok(angles.filter_map(|angle| self.elbow_range.place(angle, 0.0, LIMIT_SLACK).ok()).collect())
    }

    /// In rising order.
    fn borders(&self, shoulder: &FreeRotation, wrist: &FreeRotation) -> ArrayVec<Border, { 2 * MAX_BORDERS }> {
        let mut borders = ArrayVec::new();
        self.shoulder_joints.borders(shoulder, &mut borders);
        self.wrist_joints.borders(wrist, &mut borders);
        borders.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        borders
    }

    /// Between two borders either every angle is feasible or none, so the middle decides.
    fn find_intervals(&self, family: &mut Family, borders: &[Border], nearest: &mut Unreachable) {
        let mut is_feasible = |family: &Family, angle: f64| match self.posture(family, angle, &[0.0; N_JOINTS]) {
            Ok(_) => true,
            Err((joint, by)) => {
                if let Unreachable::Limits { joint: worst, by: least } = nearest
                    && by < *least
                {
                    (*worst, *least) = (self.names[joint].clone(), by);
                }
                false
            }
        };
        let Some(first) = borders.first() else {
            if is_feasible(family, 0.0) {
                family.intervals.push([-0.5 * TAU, 0.5 * TAU]);
            }
            return;
        };
        let mut is_open = false;
        for (k, border) in borders.iter().enumerate() {
            let end = borders.get(k + 1).map_or(first.angle + TAU, |next| next.angle);
            if end - border.angle < SAME_BORDER {
                is_open &= !border.is_singular;
                continue;
            }
            let feasible = is_feasible(family, 0.5 * (border.angle + end));
            match family.intervals.last_mut().filter(|_| feasible && is_open && !border.is_singular) {
                Some(last) => last[1] = end,
                None if feasible => family.intervals.push([border.angle, end]),
                None => {}
            }
            is_open = feasible;
        }
        // The last interval may go on in the first one.
        if let [start, .., _] = family.intervals.as_slice()
            && !first.is_singular
            && is_open
            && start[0] == first.angle
        {
            let joined = start[1] + TAU;
            family.intervals.remove(0);
            if let Some(last) = family.intervals.last_mut() {
                last[1] = joined;
            }
        }
    }

    /// The posture of a family at a free angle; joints that may turn more than once come near `near`.
    ///
    /// Errors: the joint that is farthest outside its limits, and by how much.
    pub fn posture(&self, family: &Family, free: f64, near: &[f64]) -> Result<Coordinates, (usize, f64)> {
        let angles = |triple: &Triple, rotation: &FreeRotation, side| {
            let found = triple.angles(&rotation.at(free), family.is_upper[side]);
            found.ok_or((4 * side + 1, f64::INFINITY))
        };
        let shoulder = angles(&self.shoulder_joints, &family.shoulder, 0)?;
        let shoulder = self.shoulder_joints.place(&shoulder, &near[..3], LIMIT_TOLERANCE);
        let wrist = angles(&self.wrist_joints, &family.wrist, 1)?;
        let wrist = self.wrist_joints.place(&wrist, &near[4..], LIMIT_TOLERANCE).map_err(|(k, by)| (k + 4, by));
        match (shoulder, wrist) {
            (Ok(shoulder), Ok(wrist)) => {
                let elbow = self.elbow_range.place(family.elbow, near[3], LIMIT_SLACK).unwrap_or(family.elbow);
                Ok(shoulder.into_iter().chain([elbow]).chain(wrist).collect())
            }
            (Err(a), Err(b)) => Err(if a.1 > b.1 { a } else { b }),
            (Err(a), Ok(_)) | (Ok(_), Err(a)) => Err(a),
        }
    }

    /// The free angle of a posture, as this family counts it.
    pub fn free_angle(&self, family: &Family, joints: &[f64]) -> f64 {
        family.shoulder.angle_of(&self.shoulder_joints.rotation(&joints[..3]))
    }

    /// Postures near `near` and spread over all intervals, at most `spacing` of the free angle apart.
    pub fn spread(&self, families: &[Family], near: &[f64], spacing: f64) -> Vec<ArmPosture> {
        let mut found = Vec::new();
        for family in families {
            let own = self.free_angle(family, near);
            for &[start, end] in &family.intervals {
                let n_parts = ((end - start) / spacing).ceil().max(1.0) as usize;
                let part = (end - start) / n_parts as f64;
                let spread = (0..n_parts).map(|k| start + part * (k as f64 + 0.5));
                let here = [own, own + TAU].into_iter().filter(|angle| (start..=end).contains(angle)).take(1);
                for free in spread.chain(here) {
                    if let Ok(joints) = self.posture(family, free, near) {
                        found.push(ArmPosture { joints, free_angle: Some(super::wave::wrapped(free)) });
                    }
                }
            }
        }
        found
    }
}

/// The point in which three lines meet, and how far it is from the farthest.
fn meeting(lines: &[JointLine]) -> Option<(Vector, f64)> {
    // The point nearest to all lines: the sum of (1 - a a^T) (p - origin) is zero.
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector::zeros());
    for line in lines {
        let across = Matrix3::identity() - line.axis * line.axis.transpose();
        matrix += across;
        right += across * line.origin;
    }
    let point = matrix.try_inverse()? * right;
    let off = |line: &JointLine| (point - line.origin).cross(&line.axis).norm();
    let farthest = lines.iter().map(off).fold(0.0, f64::max);
    (farthest < MEETING).then_some((point, farthest))
}
