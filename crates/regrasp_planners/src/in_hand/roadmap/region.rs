//! The poses of the object that a roadmap covers, and places spread over them.

use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Vector, frame, pose_from};
use regrasp_manipulation::model::Model;
use serde::{Deserialize, Serialize};

/// Poses with the object's centre of mass in a box of the hand's frame and its orientation within an angle of a reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Middle of the box, in the hand's frame, in metres.
    pub center: [f64; 3],
    /// Half the edges of the box, along the axes of the hand's frame, in metres.
    pub half_extents: [f64; 3],
    /// Reference orientation, hand from object.
    pub reference_quat_xyzw: [f64; 4],
    /// Largest angle from the reference, in radians; pi is every orientation.
    pub max_angle: f64,
}

impl Region {
    /// Every orientation, with the centre of mass within `within` metres, along each axis, of the box that holds it at
    /// all of `poses`.
    pub fn around(poses: &[Pose], center_of_mass: &Point, within: f64, max_angle: f64) -> Self {
        let mut low = Vector::repeat(f64::INFINITY);
        let mut high = Vector::repeat(f64::NEG_INFINITY);
        for pose in poses {
            let center = (pose * center_of_mass).coords;
            low = low.inf(&center);
            high = high.sup(&center);
        }
        let half = (high - low) / 2.0 + Vector::repeat(within);
        let reference_quat_xyzw = poses.first().map_or([0.0, 0.0, 0.0, 1.0], |pose| frame::parts_of(pose).1);
        Region { center: ((low + high) / 2.0).into(), half_extents: half.into(), reference_quat_xyzw, max_angle }
    }

    /// What is wrong with it, if anything.
    pub fn validate(&self) -> Result<(), String> {
        let numbers = self.center.iter().chain(&self.half_extents).chain(&self.reference_quat_xyzw);
        if !numbers.copied().all(f64::is_finite) {
            return Err("the region has a number that is not finite".into());
        }
        if self.half_extents.iter().any(|&half| !(0.0..=10.0).contains(&half)) {
            return Err(format!("half_extents are {:?}; they must be from 0 to 10 m", self.half_extents));
        }
        let length: f64 = self.reference_quat_xyzw.iter().map(|x| x * x).sum();
        if !((length - 1.0).abs() < 1e-6) {
            return Err("the reference quaternion is not of length one".into());
        }
        if !(LEAST_ANGLE..=std::f64::consts::PI).contains(&self.max_angle) {
            return Err(format!("max_angle is {}; it must be from {LEAST_ANGLE} to pi", self.max_angle));
        }
        Ok(())
    }

    /// A pose drawn uniformly: of positions by volume, of orientations by the invariant measure.
    pub fn draw(&self, center_of_mass: &Point, rng: &mut Rng) -> Pose {
        let mut center = Vector::from(self.center);
        for axis in 0..3 {
            center[axis] += self.half_extents[axis] * rng.uniform(-1.0, 1.0);
        }
        let reference = pose_from([0.0; 3], self.reference_quat_xyzw).rotation;
        let rotation = if self.max_angle >= std::f64::consts::PI {
            pose_from([0.0; 3], rng.quat_xyzw()).rotation
        } else {
            let turn = Vector::from(rng.direction()) * self.draw_angle(rng);
            nalgebra::UnitQuaternion::from_scaled_axis(turn) * reference
        };
        Pose::from_parts((center - rotation * center_of_mass.coords).into(), rotation)
    }

    /// An angle with density proportional to `1 - cos`, which is that of uniform rotations.
    fn draw_angle(&self, rng: &mut Rng) -> f64 {
        // 1 - cos a is 2 sin^2 (a/2), which small angles keep their digits in.
        let most = (0.5 * self.max_angle).sin().powi(2);
        loop {
            let angle = self.max_angle * rng.unit();
            if rng.unit() * most < (0.5 * angle).sin().powi(2) {
                return angle;
            }
        }
    }

    /// True when `pose` is in the region, or outside by no more than `slack` (metres and radians).
    pub fn contains(&self, pose: &Pose, center_of_mass: &Point, slack: f64) -> bool {
        let center = (pose * center_of_mass).coords - Vector::from(self.center);
        let reference = pose_from([0.0; 3], self.reference_quat_xyzw);
        (0..3).all(|axis| center[axis].abs() <= self.half_extents[axis] + slack)
            && frame::rotation_between(&reference, pose).norm() <= self.max_angle + slack
    }
}

/// Smallest `max_angle`, in radians.
const LEAST_ANGLE: f64 = 1e-6;
/// Poses drawn for one place, of which the one farthest from the places before is taken (Mitchell 1991, "best
/// candidate"): they lie more evenly than if drawn alone.
const CANDIDATES: u64 = 6;

/// `n` poses spread over the region at which the object itself is clear of palm and obstacles.
pub fn spread_places(model: &Model, region: &Region, n: usize, seed: u64) -> Vec<Pose> {
    let center_of_mass = model.view.object.center_of_mass;
    let mut places: Vec<Pose> = Vec::with_capacity(n);
    for index in 0..n {
        let mut rng = Rng::keyed(seed, "roadmap_place", index as u64);
        let mut best: Option<(f64, Pose)> = None;
        for _ in 0..CANDIDATES {
            let pose = region.draw(&center_of_mass, &mut rng);
            if regrasp_manipulation::ends::blocked::object_blocked_by(model, &pose).is_some() {
                continue;
            }
            let nearest = nearness(&places, &pose, model.turn_length());
            if best.as_ref().is_none_or(|(farthest, _)| nearest > *farthest) {
                best = Some((nearest, pose));
            }
        }
        places.extend(best.map(|(_, pose)| pose));
    }
    places
}

/// Distance to the nearest of `places`.
fn nearness(places: &[Pose], pose: &Pose, turn_length: f64) -> f64 {
    places.iter().map(|place| near_distance(place, pose, turn_length)).fold(f64::INFINITY, f64::min)
}

/// `frame::pose_distance` for looking at many: the same value by another formula.
pub fn near_distance(a: &Pose, b: &Pose, turn_length: f64) -> f64 {
    let cosine = a.rotation.coords.dot(&b.rotation.coords).abs().min(1.0);
    (a.translation.vector - b.translation.vector).norm() + turn_length * 2.0 * cosine.acos()
}

/// A lower bound of [`near_distance`], with room for rounding.
fn at_least(a: &Pose, b: &Pose, turn_length: f64) -> f64 {
    let cosine = a.rotation.coords.dot(&b.rotation.coords).abs().min(1.0);
    let chord = (2.0 - 2.0 * cosine).max(0.0).sqrt();
    (1.0 - 1e-9) * ((a.translation.vector - b.translation.vector).norm() + turn_length * 2.0 * chord) - 1e-9
}

/// The `n` places nearest to `pose` for which `admit` holds, nearest first.
pub fn nearest_places(
    places: &[Pose],
    pose: &Pose,
    turn_length: f64,
    n: usize,
    admit: impl Fn(usize) -> bool,
) -> Vec<(f64, usize)> {
    let mut best: Vec<(f64, usize)> = Vec::with_capacity(n + 1);
    for (index, place) in places.iter().enumerate() {
        if !admit(index) {
            continue;
        }
        // No angle is less than its chord, which is cheaper.
        let farthest = if best.len() < n { f64::INFINITY } else { best.last().map_or(0.0, |last| last.0) };
        if at_least(place, pose, turn_length) > farthest {
            continue;
        }
        let distance = near_distance(place, pose, turn_length);
        if best.len() < n || best.last().is_some_and(|last| distance < last.0) {
            let at = best.partition_point(|other| other.0 <= distance);
            best.insert(at, (distance, index));
            best.truncate(n);
        }
    }
    best
}
