//! Montana's equations (Cherif 1999, equation 12; Montana 1988) in charts of both surfaces.
//!
//! With relative velocities of the object over the fingertip, in the frame of the object's chart, equation 12 holds as printed.
//! `R_psi` is a reflection, its own inverse. Angles `psi` as in Montana: turning the object's x by `-psi` about the object's
//! outward normal gives the fingertip's x.

use super::chart::{ChartedSurface, Coordinates, Forms};
use super::dormand_prince;
use super::mode::RelativeVelocity;
use super::{ContactPose, NoStep, checked_request, point_rates};
use nalgebra::{Matrix2, Matrix3, Rotation3, SVector, UnitQuaternion, Vector2};
use regrasp_geometry::{Point, Pose, Vector};
use std::cell::Cell;

/// Newton steps for the nearest points, and the longest of them in coordinates: radians on round surfaces.
const MAX_NEWTON_STEPS: usize = 60;
const LONGEST_NEWTON_STEP: f64 = 0.4;
/// A step this short ends the search; the next would be its square.
const SETTLED: f64 = 1e-11;

/// The two surfaces of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPair {
    /// Of the object, in the object frame.
    pub object: ChartedSurface,
    /// Of the fingertip, in its own frame.
    pub tip: ChartedSurface,
}

/// `eta = (u_o, v_o, u_f, v_f, psi)`: where the surfaces touch, and how they are turned against each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactState {
    /// The contact on the object.
    pub object: Coordinates,
    /// The contact on the fingertip.
    pub tip: Coordinates,
    /// Angle of contact, in radians.
    pub psi: f64,
}

/// Rates of a [`ContactState`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateRates {
    /// Of `u_o` and `v_o`.
    pub object: Vector2<f64>,
    /// Of `u_f` and `v_f`.
    pub tip: Vector2<f64>,
    /// Of `psi`, in rad/s.
    pub psi: f64,
    /// Angular velocity of the object chart's x about the outward normal, relative to the object, in rad/s.
    pub chart_turn: f64,
}

/// Relative velocities over a time.
#[derive(Clone, Copy)]
pub enum RelativeControl<'a> {
    /// Constant components in the frame of the object's chart, as in Cherif 1999: a path that depends on the chart.
    InChart(RelativeVelocity),
    /// Constant components in a frame that starts as that of the object's chart and does not turn about the normal: paths that
    /// no chart decides. On faces of polyhedra it is the same.
    Transported(RelativeVelocity),
    /// Anything, from the time since the start and the contact, in the contact's frame. Parts along the normal above 1e-9 m/s
    /// are refused.
    Varying(&'a dyn Fn(f64, &ContactPose) -> RelativeVelocity),
}

/// A contact after a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Advanced {
    /// Where it is, in charts whose poles are far.
    pub state: ContactState,
    /// How far the frame of a [`RelativeControl`] with constant components is turned about the normal from that of the
    /// object's chart, in radians: `velocity.in_frame_turned_by(-turned)` goes on.
    pub turned: f64,
    /// Steps of the integration, with those that were refused.
    pub n_steps: usize,
}

impl ContactPair {
    /// Equation 12.
    pub fn rates(&self, state: &ContactState, velocity: &RelativeVelocity) -> Result<StateRates, NoStep> {
        rates(&self.object.forms(&state.object), &self.tip.forms(&state.tip), state.psi, velocity)
    }

    /// The contact frame of the object's chart, seen from both bodies.
    pub fn contact_pose(&self, state: &ContactState) -> ContactPose {
        let r = reflection(state.psi);
        let turn = Matrix3::new(r[(0, 0)], r[(0, 1)], 0.0, r[(1, 0)], r[(1, 1)], 0.0, 0.0, 0.0, -1.0);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        ContactPose {
            object_from_contact: self.object.body_from_contact(&state.object),
            tip_from_contact: self.tip.body_from_contact(&state.tip) * turn,
        }
    }

    /// Pose of the fingertip relative to the object.
    pub fn object_from_tip(&self, state: &ContactState) -> Pose {
        self.contact_pose(state).object_from_tip()
    }

    /// The state of a contact that is given by its frame, whose x and y may be any; refused where the surfaces are farther from
    /// its origin than `distance` (metres) or their normals are off its z by more than `angle` (radians).
    pub fn state_at(&self, contact: &ContactPose, distance: f64, angle: f64) -> Result<ContactState, NoStep> {
        let here = |from_contact: &Pose| Point::from(from_contact.translation.vector);
        let state = ContactState {
            object: self.object.coordinates(&here(&contact.object_from_contact)),
            tip: self.tip.coordinates(&here(&contact.tip_from_contact)),
            psi: 0.0,
        };
        let contact_from_object_chart =
            contact.object_from_contact.inverse() * self.object.body_from_contact(&state.object);
        let contact_from_tip_chart = contact.tip_from_contact.inverse() * self.tip.body_from_contact(&state.tip);
        let away = [&contact_from_object_chart, &contact_from_tip_chart].map(|p| p.translation.vector.norm());
        let off = |normal: Vector, wanted: Vector| normal.cross(&wanted).norm().atan2(normal.dot(&wanted));
        let angles = [
            off(contact_from_object_chart * Vector::z(), Vector::z()),
            off(contact_from_tip_chart * Vector::z(), -Vector::z()),
        ];
        let (worst, turned) = (away[0].max(away[1]), angles[0].max(angles[1]));
        if !(worst <= distance && turned <= angle) {
            return Err(NoStep::NotTouching { distance: worst, angle: turned });
        }
        let x = contact_from_object_chart.inverse() * (contact_from_tip_chart * Vector::x());
        Ok(ContactState { psi: (-x.y).atan2(x.x), ..state })
    }

    /// Where a fingertip at `object_from_tip` is nearest to the object, found from a state near it: the state, and the distance of
    /// the two points along the normal, negative where the bodies overlap. None when Newton's method finds no such points.
    pub fn nearest_points(&self, object_from_tip: &Pose, near: &ContactState) -> Option<(ContactState, f64)> {
        let mut state = *near;
        for _ in 0..MAX_NEWTON_STEPS {
            (state, _) = self.in_good_charts(&state, 0.0);
            let (object, tip) = (self.object.forms(&state.object), self.tip.forms(&state.tip));
            let object_from_chart = self.object.body_from_contact(&state.object);
            let tip_chart = object_from_chart.inverse() * object_from_tip * self.tip.body_from_contact(&state.tip);
            let x = tip_chart * Vector::x();
            state.psi = (-x.y).atan2(x.x);
            let (apart, lean) = (tip_chart.translation.vector, -(tip_chart * Vector::z()).xy());
            let tip_curvature = reflection(state.psi) * tip.curvature * reflection(state.psi);
            // Moving by a over the object and by b over the tip: lean = K_o a + K_f b, apart + b = a + gap K_o a.
            let (gap, across) = (apart.z, apart.xy());
            let relative = object.curvature + tip_curvature + tip_curvature * object.curvature * gap;
            let on_object = relative.try_inverse()? * (lean + tip_curvature * across);
            let on_tip = on_object + object.curvature * on_object * gap - across;
            let steps =
                [solve_upper(&object.metric, &on_object), solve_upper(&tip.metric, &(reflection(state.psi) * on_tip))];
            let size = steps[0].norm().max(steps[1].norm());
            if !size.is_finite() {
                return None;
            }
            if size < SETTLED && (tip_chart * Vector::z()).z < 0.0 {
                return Some((state, gap));
            }
            let share = (LONGEST_NEWTON_STEP / size).min(1.0);
            for (at, step) in [(&mut state.object, steps[0]), (&mut state.tip, steps[1])] {
                at.u += step.x * share;
                at.v += step.y * share;
            }
        }
        None
    }

    /// Moves a contact under constant components in a transported frame for `duration` seconds.
    ///
    /// `tolerance` bounds the sum of the estimated errors of the contact on both bodies, in metres, and of the angle of
    /// contact, in radians.
    pub fn advance(
        &self,
        state: &ContactState,
        velocity: &RelativeVelocity,
        duration: f64,
        tolerance: f64,
    ) -> Result<ContactState, NoStep> {
        self.advance_under(state, RelativeControl::Transported(*velocity), duration, tolerance).map(|end| end.state)
    }

    /// [`ContactPair::advance`] under any relative velocities.
    pub fn advance_under(
        &self,
        state: &ContactState,
        control: RelativeControl<'_>,
        duration: f64,
        tolerance: f64,
    ) -> Result<Advanced, NoStep> {
        let still = RelativeVelocity::zero();
        let asked = match &control {
            RelativeControl::InChart(velocity) | RelativeControl::Transported(velocity) => velocity,
            RelativeControl::Varying(_) => &still,
        };
        checked_request(duration, tolerance, asked)?;
        let (start, turned) = self.in_good_charts(state, 0.0);
        let axes = Cell::new([start.object.axis, start.tip.axis]);
        let (end, n_steps) = dormand_prince::integrate(
            |time, packed| self.packed_rates(time, packed, axes.get(), control),
            |packed, error| self.size_of(packed, error, axes.get()),
            |packed| {
                let (state, turned) = self.in_good_charts(&unpack(&packed, axes.get()), packed[5]);
                axes.set([state.object.axis, state.tip.axis]);
                pack(&state, turned)
            },
            pack(&start, turned),
            duration,
            tolerance,
        )?;
        Ok(Advanced { state: unpack(&end, axes.get()), turned: end[5], n_steps })
    }

    pub(super) fn packed_rates(
        &self,
        time: f64,
        packed: &Packed,
        axes: [usize; 2],
        control: RelativeControl<'_>,
    ) -> Result<Packed, NoStep> {
        let (state, turned) = (unpack(packed, axes), packed[5]);
        let (object, tip) = (self.object.forms(&state.object), self.tip.forms(&state.tip));
        let velocity = match control {
            RelativeControl::InChart(velocity) | RelativeControl::Transported(velocity) => {
                velocity.in_frame_turned_by(-turned)
            }
            RelativeControl::Varying(velocity) => velocity(time, &self.contact_pose(&state)),
        };
        let rates = rates(&object, &tip, state.psi, &velocity)?;
        let turn = if matches!(control, RelativeControl::Transported(_)) { -rates.chart_turn } else { 0.0 };
        Ok(Packed::from([rates.object.x, rates.object.y, rates.tip.x, rates.tip.y, rates.psi, turn]))
    }

    /// The larger of an error's parts, in metres on the surfaces and in radians.
    fn size_of(&self, packed: &Packed, error: &Packed, axes: [usize; 2]) -> f64 {
        let state = unpack(packed, axes);
        let on_object = self.object.forms(&state.object).metric * Vector2::new(error[0], error[1]);
        let on_tip = self.tip.forms(&state.tip).metric * Vector2::new(error[2], error[3]);
        // Not `f64::max`, which drops what is not a number.
        let parts = [on_object.norm(), on_tip.norm(), error[4].abs(), error[5].abs()];
        if parts.iter().all(|part| part.is_finite()) { parts.into_iter().fold(0.0, f64::max) } else { f64::NAN }
    }

    /// The same contact in charts whose poles are far, and the turn of the control's frame from that of the object's chart.
    fn in_good_charts(&self, state: &ContactState, turned: f64) -> (ContactState, f64) {
        let (object, tip) = (self.object.in_good_chart(&state.object), self.tip.in_good_chart(&state.tip));
        let mut moved = ContactState { object, tip, psi: state.psi };
        let mut turned = turned;
        if object.axis != state.object.axis {
            let angle =
                angle_between(&self.object.body_from_contact(&state.object), &self.object.body_from_contact(&object));
            moved.psi += angle;
            turned -= angle;
        }
        if tip.axis != state.tip.axis {
            moved.psi += angle_between(&self.tip.body_from_contact(&state.tip), &self.tip.body_from_contact(&tip));
        }
        (moved, turned)
    }
}

/// State and turn of the control's frame, for the integration.
pub(super) type Packed = SVector<f64, 6>;

pub(super) fn pack(state: &ContactState, turned: f64) -> Packed {
    Packed::from([state.object.u, state.object.v, state.tip.u, state.tip.v, state.psi, turned])
}

pub(super) fn unpack(packed: &Packed, [object, tip]: [usize; 2]) -> ContactState {
    ContactState {
        object: Coordinates { axis: object, u: packed[0], v: packed[1] },
        tip: Coordinates { axis: tip, u: packed[2], v: packed[3] },
        psi: packed[4],
    }
}

/// `R_psi`: the x and y of the fingertip's contact frame in those of the object's.
fn reflection(psi: f64) -> Matrix2<f64> {
    let (sine, cosine) = psi.sin_cos();
    Matrix2::new(cosine, -sine, -sine, -cosine)
}

fn rates(object: &Forms, tip: &Forms, psi: f64, velocity: &RelativeVelocity) -> Result<StateRates, NoStep> {
    let reflection = reflection(psi);
    let tip_curvature = reflection * tip.curvature * reflection;
    let points = point_rates(&object.curvature, &tip_curvature, velocity)?;
    let on_tip = reflection * points.on_tip;
    let chart_turn = (object.torsion * points.on_object).x;
    Ok(StateRates {
        object: solve_upper(&object.metric, &points.on_object),
        tip: solve_upper(&tip.metric, &on_tip),
        psi: velocity.angular.z + chart_turn + (tip.torsion * on_tip).x,
        chart_turn,
    })
}

fn solve_upper(m: &Matrix2<f64>, right: &Vector2<f64>) -> Vector2<f64> {
    let second = right.y / m[(1, 1)];
    Vector2::new((right.x - m[(0, 1)] * second) / m[(0, 0)], second)
}

/// Angle about the common outward normal from the x of one frame to that of another.
fn angle_between(from: &Pose, to: &Pose) -> f64 {
    let x = from.inverse() * (to * Vector::x());
    x.y.atan2(x.x)
}
