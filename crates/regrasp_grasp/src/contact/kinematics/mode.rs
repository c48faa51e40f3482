//! Contact modes and their forces (Cherif 1999, sec. 6.1.1 and 6.1.2, table 1, equations 4, 6, 11).
//!
//! Where Cherif 1999 is not followed: equation 4 lets the tangential force on the object point along the velocity of the object
//! over the fingertip; friction opposes it.

use nalgebra::{Matrix6, Rotation3};
use regrasp_geometry::{Pose, Vector};

/// Velocity of the object relative to the fingertip at their contact, `q_r` of equation 6, in the contact frame: z along the
/// outward normal of the object, x and y as the frame that it was taken in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeVelocity {
    /// Of the material point of the object that touches, as seen from the material point of the fingertip, in m/s. Along z it
    /// is negative where the contact opens.
    pub linear: Vector,
    /// Angular velocity, in rad/s.
    pub angular: Vector,
}

/// Velocity of a body relative to the world or to any other frame, in its own frame (`g^-1 dg/dt` for its pose `g`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyVelocity {
    /// Of the origin of its frame, in m/s.
    pub linear: Vector,
    /// Angular velocity, in rad/s.
    pub angular: Vector,
}

impl BodyVelocity {
    /// A body at rest.
    pub fn zero() -> Self {
        BodyVelocity { linear: Vector::zeros(), angular: Vector::zeros() }
    }

    /// The same motion in a frame fixed to the body: velocity of that frame's origin, in its axes.
    pub fn seen_at(&self, body_from_frame: &Pose) -> Self {
        let turned = body_from_frame.rotation.inverse();
        let linear = self.linear + self.angular.cross(&body_from_frame.translation.vector);
        BodyVelocity { linear: turned * linear, angular: turned * self.angular }
    }
}

/// The matrix that maps a body velocity, linear part first, to the velocity of a frame fixed to the body, in that frame:
/// `G_i^T` of equations 6 to 11 for the object and its contact frame. Its rows are x, y, z, then about x, y, z.
pub fn velocity_map(body_from_frame: &Pose) -> Matrix6<f64> {
    let turned = body_from_frame.rotation.inverse().to_rotation_matrix();
    let arm = body_from_frame.translation.vector.cross_matrix();
    let mut map = Matrix6::zeros();
    map.fixed_view_mut::<3, 3>(0, 0).copy_from(turned.matrix());
    map.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-turned.matrix() * arm));
    map.fixed_view_mut::<3, 3>(3, 3).copy_from(turned.matrix());
    map
}

impl RelativeVelocity {
    /// Rest.
    pub fn zero() -> Self {
        RelativeVelocity { linear: Vector::zeros(), angular: Vector::zeros() }
    }

    /// Pure rolling: the object turns at `x` and `y` about the axes across the normal, in rad/s (equation 10).
    pub fn rolling(x: f64, y: f64) -> Self {
        RelativeVelocity { linear: Vector::zeros(), angular: Vector::new(x, y, 0.0) }
    }

    /// Pure sliding: the object moves over the fingertip at `x` and `y`, in m/s.
    pub fn sliding(x: f64, y: f64) -> Self {
        RelativeVelocity { linear: Vector::new(x, y, 0.0), angular: Vector::zeros() }
    }

    /// Pure twisting: the object turns at `z` about its outward normal, in rad/s.
    pub fn twisting(z: f64) -> Self {
        RelativeVelocity { linear: Vector::zeros(), angular: Vector::new(0.0, 0.0, z) }
    }

    /// Equation 6: from the velocities of both bodies relative to one and the same frame, and the contact frame in each.
    pub fn between(
        object: &BodyVelocity,
        object_from_contact: &Pose,
        tip: &BodyVelocity,
        tip_from_contact: &Pose,
    ) -> Self {
        let (object, tip) = (object.seen_at(object_from_contact), tip.seen_at(tip_from_contact));
        RelativeVelocity { linear: object.linear - tip.linear, angular: object.angular - tip.angular }
    }

    /// Equation 11: the fingertip stands still.
    pub fn with_tip_at_rest(object: &BodyVelocity, object_from_contact: &Pose) -> Self {
        let object = object.seen_at(object_from_contact);
        RelativeVelocity { linear: object.linear, angular: object.angular }
    }

    /// Equation 6 solved for the fingertip: its velocity, in its own frame, where the object's is `object`.
    pub fn tip_velocity(
        &self,
        object: &BodyVelocity,
        object_from_contact: &Pose,
        tip_from_contact: &Pose,
    ) -> BodyVelocity {
        let object = object.seen_at(object_from_contact);
        BodyVelocity { linear: object.linear - self.linear, angular: object.angular - self.angular }
            .seen_at(&tip_from_contact.inverse())
    }

    /// The same velocity in a contact frame turned by `angle` about the normal.
    pub fn in_frame_turned_by(&self, angle: f64) -> Self {
        let turn = Rotation3::from_axis_angle(&Vector::z_axis(), -angle);
        RelativeVelocity { linear: turn * self.linear, angular: turn * self.angular }
    }

    /// Times a number.
    pub fn scaled(&self, by: f64) -> Self {
        RelativeVelocity { linear: self.linear * by, angular: self.angular * by }
    }

    /// False where a component is infinite or not a number.
    pub fn is_finite(&self) -> bool {
        self.linear.iter().chain(self.angular.iter()).all(|x| x.is_finite())
    }

    /// Speed of sliding, in m/s.
    pub fn sliding_speed(&self) -> f64 {
        self.linear.xy().norm()
    }
}

/// What the velocities of a contact obey (table 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mode {
    /// Turns about axes across the normal.
    PureRolling,
    /// Slides without turning.
    PureSliding,
    /// Turns about the normal.
    PureTwisting,
    /// Turns about any axis.
    RollingWithoutSliding,
    /// Slides, and turns about any axis.
    Sliding,
}

/// What the force of a contact obeys (section 6.1.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceLaw {
    /// Frictional rolling force, FRF: anywhere in the friction cone.
    Rolling,
    /// Frictional sliding force, FSF: on the boundary of the cone, against the sliding of the object.
    Sliding,
}

/// What a relative velocity is; see [`motion_of`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactMotion {
    /// Nothing moves.
    AtRest,
    /// The contact is kept in this mode.
    InMode(Mode),
    /// The bodies part.
    Opens,
    /// The bodies go into each other.
    Presses,
}

/// Velocities that count as none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeTolerances {
    /// In m/s.
    pub linear: f64,
    /// In rad/s.
    pub angular: f64,
}

impl Default for ModeTolerances {
    /// By hand: at a hundredth of a second per step, a hundred times below what plans promise of contacts.
    fn default() -> Self {
        ModeTolerances { linear: 1e-6, angular: 1e-6 }
    }
}

impl Mode {
    /// All modes, the most special first.
    pub const ALL: [Mode; 5] =
        [Mode::PureTwisting, Mode::PureRolling, Mode::PureSliding, Mode::RollingWithoutSliding, Mode::Sliding];

    /// Which components of a relative velocity are zero: linear x, y, z, angular x, y, z. Sliding modes also ask that linear
    /// x and y are not both zero.
    pub fn zero_components(self) -> [bool; 6] {
        match self {
            Mode::PureRolling => [true, true, true, false, false, true],
            Mode::PureSliding => [false, false, true, true, true, true],
            Mode::PureTwisting => [true, true, true, true, true, false],
            Mode::RollingWithoutSliding => [true, true, true, false, false, false],
            Mode::Sliding => [false, false, true, false, false, false],
        }
    }

    /// The law of the forces in this mode.
    pub fn force_law(self) -> ForceLaw {
        match self {
            Mode::PureRolling | Mode::PureTwisting | Mode::RollingWithoutSliding => ForceLaw::Rolling,
            Mode::PureSliding | Mode::Sliding => ForceLaw::Sliding,
        }
    }

    /// True when `velocity` obeys this mode. Rest obeys the modes that do not slide.
    pub fn permits(self, velocity: &RelativeVelocity, tolerances: &ModeTolerances) -> bool {
        let [still, _, _, no_roll, _, no_twist] = self.zero_components();
        let slides = velocity.sliding_speed() > tolerances.linear;
        let rolls = velocity.angular.xy().norm() > tolerances.angular;
        let twists = velocity.angular.z.abs() > tolerances.angular;
        velocity.is_finite()
            && velocity.linear.z.abs() <= tolerances.linear
            && slides != still
            && !(rolls && no_roll)
            && !(twists && no_twist)
    }
}

/// The most special mode that permits `velocity`, or why there is none. Speeds across the normal and the rates about axes
/// across it are measured by their length, so the answer does not depend on the frame's x and y. What is not a number opens.
pub fn motion_of(velocity: &RelativeVelocity, tolerances: &ModeTolerances) -> ContactMotion {
    if velocity.linear.z > tolerances.linear {
        return ContactMotion::Presses;
    }
    let turns = [velocity.angular.xy().norm(), velocity.angular.z.abs()];
    if velocity.is_finite()
        && velocity.linear.z.abs() <= tolerances.linear
        && velocity.sliding_speed() <= tolerances.linear
        && turns.iter().all(|rate| *rate <= tolerances.angular)
    {
        return ContactMotion::AtRest;
    }
    let mode = Mode::ALL.into_iter().find(|mode| mode.permits(velocity, tolerances));
    mode.map_or(ContactMotion::Opens, ContactMotion::InMode)
}

/// The force on the object at a contact that slides at `velocity`, in the contact frame, in newtons (equation 4, with its sign
/// put right): `normal_force` against the outward normal, and friction along the velocity of the fingertip over the object.
/// None at a contact that does not slide.
pub fn sliding_force(normal_force: f64, friction: f64, velocity: &RelativeVelocity) -> Option<Vector> {
    let way = velocity.linear.xy().try_normalize(f64::MIN_POSITIVE)?;
    Some(Vector::new(-friction * normal_force * way.x, -friction * normal_force * way.y, -normal_force))
}

impl ForceLaw {
    /// How far `force` (on the object, in the contact frame, in newtons) is from obeying the law, over its normal part: zero
    /// where it obeys. Infinite for forces that pull, and under the law of sliding where nothing slides. No force at all obeys.
    pub fn residual(self, force: &Vector, velocity: &RelativeVelocity, friction: f64) -> f64 {
        let pressing = -force.z;
        if force.norm() == 0.0 {
            return 0.0;
        }
        if !(pressing > 0.0 && force.iter().all(|x| x.is_finite())) {
            return f64::INFINITY;
        }
        match self {
            ForceLaw::Rolling => (force.xy().norm() / pressing - friction).max(0.0),
            ForceLaw::Sliding => {
                sliding_force(pressing, friction, velocity).map_or(f64::INFINITY, |f| (force - f).norm() / pressing)
            }
        }
    }

    /// True when the residual is at most `tolerance`.
    pub fn obeys(self, force: &Vector, velocity: &RelativeVelocity, friction: f64, tolerance: f64) -> bool {
        self.residual(force, velocity, friction) <= tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    const EXACT: ModeTolerances = ModeTolerances { linear: 1e-12, angular: 1e-12 };

    fn any(rng: &mut Rng) -> Vector {
        Vector::from(rng.direction()) * rng.uniform(0.1, 2.0)
    }

    fn pose(rng: &mut Rng) -> Pose {
        Pose::new(any(rng), any(rng))
    }

    /// Table 1 said over again, one row at a time.
    #[test]
    fn each_mode_permits_what_the_table_says() {
        let mut rng = Rng::keyed(1, "mode", 0);
        for pattern in 0..64u32 {
            let has = |k: u32| pattern >> k & 1 == 1;
            let part = |from: u32, rng: &mut Rng| {
                Vector::from_fn(|k, _| if has(from + k as u32) { rng.normal() } else { 0.0 })
            };
            let (linear, angular) = (part(0, &mut rng), part(3, &mut rng));
            let velocity = RelativeVelocity { linear, angular };
            let slides = has(0) || has(1);
            let (rolls, twists) = (has(3) || has(4), has(5));
            let kept = !has(2);
            let table = |mode| match mode {
                Mode::PureRolling => kept && !slides && !twists,
                Mode::PureSliding => kept && slides && !rolls && !twists,
                Mode::PureTwisting => kept && !slides && !rolls,
                Mode::RollingWithoutSliding => kept && !slides,
                Mode::Sliding => kept && slides,
            };
            for mode in Mode::ALL {
                assert_eq!(mode.permits(&velocity, &EXACT), table(mode), "{mode:?} {velocity:?}");
            }
            let expected = match (kept, slides, rolls, twists) {
                (false, ..) if linear.z < 0.0 => ContactMotion::Opens,
                (false, ..) => ContactMotion::Presses,
                (_, false, false, false) => ContactMotion::AtRest,
                (_, false, true, false) => ContactMotion::InMode(Mode::PureRolling),
                (_, false, false, true) => ContactMotion::InMode(Mode::PureTwisting),
                (_, false, true, true) => ContactMotion::InMode(Mode::RollingWithoutSliding),
                (_, true, false, false) => ContactMotion::InMode(Mode::PureSliding),
                (_, true, ..) => ContactMotion::InMode(Mode::Sliding),
            };
            assert_eq!(motion_of(&velocity, &EXACT), expected);
        }
        let broken = RelativeVelocity { linear: Vector::new(f64::NAN, 0.0, 0.0), angular: Vector::zeros() };
        assert!(Mode::ALL.iter().all(|mode| !mode.permits(&broken, &EXACT)));
        assert_eq!(motion_of(&broken, &EXACT), ContactMotion::Opens);
    }

    /// The material points that touch, followed in the world by differences.
    #[test]
    fn relative_velocities_are_those_of_the_points_that_touch() {
        let mut rng = Rng::keyed(2, "mode", 0);
        for _ in 0..50 {
            let (world_from_object, world_from_contact) = (pose(&mut rng), pose(&mut rng));
            let world_from_tip = pose(&mut rng);
            let [object, tip] = [0, 1].map(|_| BodyVelocity { linear: any(&mut rng), angular: any(&mut rng) });
            let object_from_contact = world_from_object.inverse() * world_from_contact;
            let tip_from_contact = world_from_tip.inverse() * world_from_contact;
            let relative = RelativeVelocity::between(&object, &object_from_contact, &tip, &tip_from_contact);
            let moved = |from: &Pose, v: &BodyVelocity, t: f64| from * Pose::new(v.linear * t, v.angular * t);
            let step = 1e-6;
            let in_contact = |t: f64| {
                let point = |world_from: &Pose, v: &BodyVelocity, from_contact: &Pose| {
                    world_from_contact.inverse() * moved(world_from, v, t) * from_contact
                };
                let object = point(&world_from_object, &object, &object_from_contact);
                (object, point(&world_from_tip, &tip, &tip_from_contact))
            };
            let ((o1, f1), (o0, f0)) = (in_contact(step), in_contact(-step));
            let linear = ((o1.translation.vector - o0.translation.vector)
                - (f1.translation.vector - f0.translation.vector))
                / (2.0 * step);
            let rate = |a: &Pose, b: &Pose| (a.rotation * b.rotation.inverse()).scaled_axis() / (2.0 * step);
            assert!((relative.linear - linear).norm() < 1e-7, "{relative:?} {linear}");
            assert!((relative.angular - rate(&o1, &o0) + rate(&f1, &f0)).norm() < 1e-7);

            let back = relative.tip_velocity(&object, &object_from_contact, &tip_from_contact);
            assert!((back.linear - tip.linear).norm() < 1e-12 && (back.angular - tip.angular).norm() < 1e-12);
            let stacked =
                nalgebra::Vector6::from_fn(|k, _| if k < 3 { object.linear[k] } else { object.angular[k - 3] });
            let mapped = velocity_map(&object_from_contact) * stacked;
            let still = RelativeVelocity::with_tip_at_rest(&object, &object_from_contact);
            assert!((mapped.fixed_rows::<3>(0) - still.linear).norm() < 1e-12);
            assert!((mapped.fixed_rows::<3>(3) - still.angular).norm() < 1e-12);
            let turned = Pose::from_parts(
                object_from_contact.translation,
                object_from_contact.rotation * nalgebra::UnitQuaternion::from_axis_angle(&Vector::z_axis(), 0.7),
            );
            let other = RelativeVelocity::with_tip_at_rest(&object, &turned);
            assert!((other.linear - still.in_frame_turned_by(0.7).linear).norm() < 1e-12);
        }
    }

    /// Friction takes power out of the pair, as much as it can: the principle of maximal dissipation over the cone's section.
    #[test]
    fn friction_opposes_the_sliding_of_the_object() {
        let mut rng = Rng::keyed(3, "mode", 0);
        for _ in 0..100 {
            let velocity =
                RelativeVelocity { linear: Vector::new(rng.normal(), rng.normal(), 0.0), angular: any(&mut rng) };
            let (pressing, friction) = (rng.uniform(0.1, 10.0), rng.uniform(0.1, 1.0));
            let force = sliding_force(pressing, friction, &velocity).unwrap();
            assert!(ForceLaw::Sliding.residual(&force, &velocity, friction) < 1e-14);
            assert!(ForceLaw::Rolling.residual(&force, &velocity, friction) < 1e-14);
            // Power of the contact on both bodies together.
            let power = force.dot(&velocity.linear);
            for k in 0..64 {
                let (sine, cosine) = (f64::from(k) * std::f64::consts::TAU / 64.0).sin_cos();
                let other = Vector::new(cosine, sine, 0.0) * friction * pressing - Vector::z() * pressing;
                assert!(other.dot(&velocity.linear) >= power - 1e-12);
                if (other - force).norm() > 1e-3 * pressing {
                    assert!(!ForceLaw::Sliding.obeys(&other, &velocity, friction, 1e-9));
                }
            }
            let inside = Vector::new(0.9 * force.x, 0.9 * force.y, force.z);
            assert!((ForceLaw::Sliding.residual(&inside, &velocity, friction) - 0.1 * friction).abs() < 1e-12);
            assert!(ForceLaw::Rolling.obeys(&inside, &velocity, friction, 0.0));
            let outside = Vector::new(1.1 * force.x, 1.1 * force.y, force.z);
            assert!((ForceLaw::Rolling.residual(&outside, &velocity, friction) - 0.1 * friction).abs() < 1e-12);
            assert!(!ForceLaw::Rolling.obeys(&-force, &velocity, friction, 1e9));
            assert!(!ForceLaw::Sliding.obeys(&force, &RelativeVelocity::rolling(1.0, 0.0), friction, 1e9));
            assert!(ForceLaw::Sliding.obeys(&Vector::zeros(), &velocity, friction, 0.0));
            let broken = Vector::new(f64::NAN, 0.0, -1.0);
            assert!(
                [ForceLaw::Rolling, ForceLaw::Sliding].iter().all(|law| !law.obeys(&broken, &velocity, friction, 1e9))
            );
        }
    }
}
