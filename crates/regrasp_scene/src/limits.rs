//! What a plan may ask of hand and object where the robot file says nothing.
//!
//! Planners plan within these limits and the checker judges by them. A plan can keep to tighter ones, never to looser ones.

/// Limits of a scene. [`Limits::default`] holds where the scene file says nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest speed of fingertips and of the object's surface, in metres per second. Plans are quasi-static: forces balance
    /// the weight, not accelerations. Default 0.1, by hand: replays at 0.08 were as good as at 0.04.
    pub largest_speed: f64,
    /// Largest velocity of joints of which the robot file states none, in radians or metres per second. Default pi, by hand.
    pub joint_velocity: f64,
    /// Largest acceleration of all joints, in radians or metres per second squared: robot files state none. Default 20, by
    /// hand: from rest to 2 rad/s in a tenth of a second.
    pub joint_acceleration: f64,
    /// Largest normal force of a fingertip, in newtons. Default 100, by hand; the robot's efforts limit forces too.
    pub normal_force: f64,
    /// The least that the friction coefficient is divided by before closure and forces count on it. None: 1.5 for in-hand
    /// tasks (in simulation 1.5 kept 20 of 20 plans where 1 kept 2 of 8), 1 for tracking (Cherif and Gupta 1999, whose
    /// sliding fingertips have the friction in full).
    pub friction_margin: Option<f64>,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            largest_speed: 0.1,
            joint_velocity: std::f64::consts::PI,
            joint_acceleration: 20.0,
            normal_force: 100.0,
            friction_margin: None,
        }
    }
}
