//! Poses of the object that are worth a look.

use nalgebra::{Rotation3, UnitQuaternion};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Shape, Vector, frame};
use regrasp_manipulation::model::Model;
use regrasp_robot::inspect::TipReach;

/// Share of the orientations in which the object's axes lie along the hand's.
const ALIGNED: f64 = 0.5;
/// Share of the orientations that are near such a one; the others are any.
const NEARLY_ALIGNED: f64 = 0.3;
/// Standard deviation of a tilt from an aligned orientation, in radians.
const TILT: f64 = 0.25;
/// Standard deviations of a step to a pose nearby, in metres and radians.
const STEP: (f64, f64) = (0.006, 0.15);
/// Fingers whose tips must reach the places that poses are drawn around.
const FINGERS_AROUND: usize = 2;

/// Where poses are drawn: about the voxels that several fingertips reach, out to where the object still touches them.
#[derive(Debug)]
pub struct Proposals<'m> {
    model: &'m Model<'m>,
    around: Vec<Point>,
    /// Largest distance of the centre of mass from such a place, in metres.
    farthest: f64,
    /// Orientation in the hand's frame, where the query gives it.
    rotation: Option<UnitQuaternion<f64>>,
}

impl<'m> Proposals<'m> {
    /// For the object of `model`, in the orientation given in the hand's frame.
    pub fn new(model: &'m Model<'m>, reach: &TipReach, rotation: Option<UnitQuaternion<f64>>) -> Self {
        let fingers = FINGERS_AROUND.min(model.n_fingers());
        let (mut around, mut farthest) = (reach.voxels(fingers), model.frame.torque_scale);
        if around.is_empty() && model.closing_fingers() != 0 {
            // Jaws come from both sides of the object, and never to the same place.
            around = reach.voxels(1);
            farthest += model.fingers.iter().map(|finger| finger.tip_radius).fold(0.0, f64::max);
        }
        Proposals { model, around, farthest, rotation }
    }

    /// True when the fingertips have no place in common.
    pub fn is_empty(&self) -> bool {
        self.around.is_empty()
    }

    /// A pose of the object in the hand's frame, its centre of mass near a place that fingertips reach.
    pub fn draw(&self, rng: &mut Rng) -> Pose {
        let rotation = self.rotation.unwrap_or_else(|| self.draw_rotation(rng));
        let near = self.around[rng.below(self.around.len())];
        let away = self.farthest * rng.unit();
        let center = near + Vector::from(rng.direction()) * away;
        self.pose_about(&center, rotation)
    }

    /// A pose near `pose`.
    pub fn near(&self, pose: &Pose, rng: &mut Rng) -> Pose {
        let center = pose * self.model.view.object.center_of_mass;
        let step = Vector::new(rng.normal(), rng.normal(), rng.normal()) * STEP.0;
        let rotation = match (self.rotation, &self.model.view.object.shape) {
            (Some(given), _) => given,
            (None, Shape::Sphere { .. }) => pose.rotation,
            // Half of the steps keep an orientation that is along the axes.
            (None, _) if rng.chance(0.5) => pose.rotation,
            (None, _) => small_turn(STEP.1, rng) * pose.rotation,
        };
        self.pose_about(&(center + step), rotation)
    }

    /// The pose with this orientation and the object's centre of mass at `center`.
    fn pose_about(&self, center: &Point, rotation: UnitQuaternion<f64>) -> Pose {
        let shift = rotation * self.model.view.object.center_of_mass.coords;
        // To a tenth of a millimetre: positions are for people to read, too.
        let position = (center.coords - shift).map(|value| (value * 1e4).round() / 1e4 + 0.0);
        Pose::from_parts(position.into(), rotation)
    }

    fn draw_rotation(&self, rng: &mut Rng) -> UnitQuaternion<f64> {
        if matches!(self.model.view.object.shape, Shape::Sphere { .. }) {
            return UnitQuaternion::identity();
        }
        let kind = rng.unit();
        if kind < ALIGNED {
            return aligned(rng);
        }
        if kind < ALIGNED + NEARLY_ALIGNED {
            return small_turn(TILT, rng) * aligned(rng);
        }
        frame::pose_from([0.0; 3], rng.quat_xyzw()).rotation
    }
}

/// One of the 24 orientations in which axes lie along axes.
fn aligned(rng: &mut Rng) -> UnitQuaternion<f64> {
    let axes = [Vector::x(), Vector::y(), Vector::z()];
    let first = axes[rng.below(3)] * if rng.chance(0.5) { 1.0 } else { -1.0 };
    let across: Vec<Vector> = axes.into_iter().filter(|axis| axis.dot(&first) == 0.0).collect();
    let second = across[rng.below(2)] * if rng.chance(0.5) { 1.0 } else { -1.0 };
    let matrix = nalgebra::Matrix3::from_columns(&[first, second, first.cross(&second)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

fn small_turn(deviation: f64, rng: &mut Rng) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector::new(rng.normal(), rng.normal(), rng.normal()) * deviation)
}
