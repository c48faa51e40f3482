//! How an object in a hand moves: velocity of turning, and accelerations, from the cubics of all joints that move the hand.

use crate::check::between::Cubic;
use crate::check::robots::motion::RobotStep;
use crate::check::robots::tree::{Frame, Tree};
use regrasp_geometry::{Point, Vector};

/// A body of the robot at one moment of a step.
#[derive(Debug, Clone, Copy)]
pub struct BodyMotion {
    /// Its frame in the world.
    pub frame: Frame,
    /// Angular velocity, in the world.
    pub spin: Vector,
    /// Angular acceleration, in the world.
    pub spin_rate: Vector,
    /// Acceleration of the origin of its frame, in the world.
    acceleration: Vector,
}

impl BodyMotion {
    /// Of a body, at the share `u` of the time of a step.
    ///
    /// Every joint adds, with its axis `a`, its rate and the angular velocity `w` before it: to the angular acceleration
    /// `a q'' + w x a q'` where it turns; to the acceleration `a q'' + 2 w x a q'` where it slides. From one joint to the next, `r` away
    /// in the same body, the acceleration changes by `w' x r + w x (w x r)`.
    pub fn of(tree: &Tree, body: usize, step: &RobotStep, u: f64) -> Self {
        let (mut joints, mut frames, mut axes) = (Vec::new(), Vec::new(), Vec::new());
        step.joints_at(u, &mut joints);
        tree.frames(&joints, &mut frames, &mut axes);
        let mut chain = tree.chain(body);
        chain.reverse();
        let (mut spin, mut spin_rate, mut acceleration) = (Vector::zeros(), Vector::zeros(), Vector::zeros());
        let mut at = frames[0].origin;
        for k in chain {
            let Some(joint) = tree.body(k) else { continue };
            let axis = axes[k].rotation * joint.axis;
            let cubic = step.of_drive(&joint.drive);
            let (rate, bend) = match step.span > 0.0 {
                true => (cubic.slope(u) / step.span, bend(&cubic, u) / (step.span * step.span)),
                false => (0.0, 0.0),
            };
            acceleration += carried(&spin, &spin_rate, &(axes[k].origin - at));
            at = axes[k].origin;
            if joint.slides {
                acceleration += carried(&spin, &spin_rate, &(frames[k].origin - at));
                acceleration += spin.cross(&axis) * (2.0 * rate) + axis * bend;
                at = frames[k].origin;
            } else {
                spin_rate += axis * bend + spin.cross(&axis) * rate;
                spin += axis * rate;
            }
        }
        acceleration += carried(&spin, &spin_rate, &(frames[body].origin - at));
        BodyMotion { frame: frames[body], spin, spin_rate, acceleration }
    }

    /// Acceleration of a point that moves with the body, both in the world.
    pub fn acceleration_of(&self, point: &Point) -> Vector {
        self.acceleration + carried(&self.spin, &self.spin_rate, &(point.coords - self.frame.origin))
    }
}

fn carried(spin: &Vector, spin_rate: &Vector, arm: &Vector) -> Vector {
    spin_rate.cross(arm) + spin.cross(&spin.cross(arm))
}

fn bend(cubic: &Cubic, u: f64) -> f64 {
    let [first, last] = cubic.bends();
    first + (last - first) * u
}
