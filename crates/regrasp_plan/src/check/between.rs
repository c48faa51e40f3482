//! Where joints and object are between two waypoints, as `docs/reference/plan-format.md` (Time) defines it, with bounds of how fast.
//!
//! Every joint follows the cubic through its positions, velocities and times. The object follows
//! [`pose_between`](crate::check::pose::pose_between) at the parameter `sigma`: a cubic from 0 to 1 whose slopes at both
//! ends are those of the joints along their chord. Here `u` is the share of the time between the waypoints.
//!
//! All bounds are exact. The first derivative of a cubic is a parabola, largest at an end or at its vertex. The second one is
//! linear, largest at an end.

use crate::check::pose::pose_between;
use crate::plan::Waypoint;
use regrasp_geometry::Pose;

/// The slopes of `sigma` lie between 0 and this: then it never turns back (Fritsch and Carlson 1980).
pub const LARGEST_SLOPE: f64 = 3.0;
/// A joint's velocity times the time of a step is at most this, in radians or metres: no plan needs more, and motion bounds
/// grow with it.
pub const LARGEST_TANGENT: f64 = 1.5;
/// The slopes of `sigma` may be this much beyond: rounding.
const SLOPE_ROUNDING: f64 = 1e-6;
/// Joints that move less than this in a step, all together, rest, in radians or metres.
pub const LEAST_CHORD: f64 = 1e-9;

/// A cubic over `[0, 1]`: its change and its slopes at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    /// Value at 1 minus value at 0.
    pub change: f64,
    /// Slope at 0.
    pub first: f64,
    /// Slope at 1.
    pub last: f64,
}

impl Cubic {
    /// The straight line.
    pub fn line(change: f64) -> Self {
        Cubic { change, first: change, last: change }
    }

    /// Value at `u` minus value at 0.
    pub fn at(&self, u: f64) -> f64 {
        let Cubic { change, first, last } = *self;
        u * (first + u * (3.0 * change - 2.0 * first - last + u * (first + last - 2.0 * change)))
    }

    /// Slope at `u`.
    pub fn slope(&self, u: f64) -> f64 {
        let Cubic { change, first, last } = *self;
        first + u * (2.0 * (3.0 * change - 2.0 * first - last) + 3.0 * u * (first + last - 2.0 * change))
    }

    /// Second derivatives at 0 and 1.
    pub fn bends(&self) -> [f64; 2] {
        let Cubic { change, first, last } = *self;
        [6.0 * change - 4.0 * first - 2.0 * last, 2.0 * first + 4.0 * last - 6.0 * change]
    }

    /// Largest size of the slope.
    pub fn largest_slope(&self) -> f64 {
        let ends = self.first.abs().max(self.last.abs());
        let [bend, end] = self.bends();
        // The second derivative is zero at the vertex, if that is inside.
        if bend * end < 0.0 { ends.max(self.slope(bend / (bend - end)).abs()) } else { ends }
    }

    /// Largest size of the second derivative.
    pub fn largest_bend(&self) -> f64 {
        let [first, last] = self.bends();
        first.abs().max(last.abs())
    }

    /// Smallest and largest value minus value at 0.
    pub fn range(&self) -> [f64; 2] {
        let (mut low, mut high) = (self.change.min(0.0), self.change.max(0.0));
        // Slope: first + 2 half u + square u^2.
        let [bend, end] = self.bends();
        let (half, square) = (0.5 * bend, 0.5 * (end - bend));
        let root = (half * half - square * self.first).max(0.0).sqrt();
        let of_larger = -(half + root.copysign(half));
        for u in [of_larger / square, self.first / of_larger] {
            if u > 0.0 && u < 1.0 {
                low = low.min(self.at(u));
                high = high.max(self.at(u));
            }
        }
        [low, high]
    }
}

/// A joint over a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBounds {
    /// Largest speed, per step.
    pub speed: f64,
    /// Largest acceleration, per step squared.
    pub acceleration: f64,
    /// Its change, per step cubed: the third derivative of a cubic is constant.
    pub jerk: f64,
    /// Largest size of the position.
    pub size: f64,
}

/// The motion between two waypoints.
#[derive(Debug, Clone)]
pub struct Between<'a> {
    from: &'a Waypoint,
    joints: Vec<Cubic>,
    sigma: Cubic,
    object: [Pose; 2],
    /// True where velocities and times make no motion.
    is_broken: bool,
}

impl<'a> Between<'a> {
    /// The motion from one waypoint to the next.
    ///
    /// Where time does not rise, or velocities make a motion that [`Between::is_broken`] says is none, everything goes straight
    /// and evenly: `times` has reported the plan then, and the effort of the other tests stays bounded.
    pub fn new(from: &'a Waypoint, to: &'a Waypoint) -> Self {
        let object = [from, to].map(|waypoint| Pose::from(&waypoint.world_from_object));
        let changes = from.joints.iter().zip(&to.joints).map(|(a, b)| b - a);
        let span = to.time - from.time;
        let ends = from.joint_velocities.iter().zip(&to.joint_velocities);
        let joints: Vec<Cubic> = changes
            .zip(ends)
            .map(|(change, (first, last))| Cubic { change, first: first * span, last: last * span })
            .collect();
        let sigma = sigma(&joints);
        let slope_is_sound = |slope: f64| (-SLOPE_ROUNDING..=LARGEST_SLOPE + SLOPE_ROUNDING).contains(&slope);
        let largest = if rests(&joints) { LEAST_CHORD } else { LARGEST_TANGENT };
        let is_short = |joint: &Cubic| joint.first.abs().max(joint.last.abs()) <= largest;
        let is_broken =
            !(span > 0.0 && [sigma.first, sigma.last].into_iter().all(slope_is_sound) && joints.iter().all(is_short));
        let mut motion = Between { from, joints, sigma, object, is_broken };
        if is_broken {
            motion.joints.iter_mut().for_each(|joint| *joint = Cubic::line(joint.change));
            motion.sigma = Cubic::line(1.0);
        }
        motion
    }

    /// True where time does not rise, `sigma` turns back, joints that rest have velocities, or a velocity is far too large for
    /// the time.
    pub fn is_broken(&self) -> bool {
        self.is_broken
    }

    /// How far joint `k` has come.
    pub fn joint(&self, k: usize) -> &Cubic {
        &self.joints[k]
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// The object's parameter.
    pub fn sigma(&self) -> &Cubic {
        &self.sigma
    }

    /// Joints at `u`.
    pub fn joints_at(&self, u: f64) -> Vec<f64> {
        self.from.joints.iter().zip(&self.joints).map(|(from, joint)| from + joint.at(u)).collect()
    }

    /// Pose of the object at `u`.
    pub fn object_at(&self, u: f64) -> Pose {
        let [start, end] = &self.object;
        pose_between(start, end, self.sigma.at(u))
    }

    /// When `sigma` is `share`: so much of the way of the object and of the change of the forces is made by then.
    pub fn when(&self, share: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        // As many halvings as a double has digits.
        for _ in 0..54 {
            let middle = 0.5 * (low + high);
            match self.sigma.at(middle) < share {
                true => low = middle,
                false => high = middle,
            }
        }
        0.5 * (low + high)
    }

    /// Bounds of all joints.
    pub fn joint_bounds(&self) -> Vec<JointBounds> {
        let bounds = |(from, joint): (&f64, &Cubic)| {
            let [low, high] = joint.range();
            JointBounds {
                speed: joint.largest_slope(),
                acceleration: joint.largest_bend(),
                jerk: (joint.bends()[1] - joint.bends()[0]).abs(),
                size: (from + low).abs().max((from + high).abs()),
            }
        };
        self.from.joints.iter().zip(&self.joints).map(bounds).collect()
    }
}

/// True where the joints are at both ends in the same place.
fn rests(joints: &[Cubic]) -> bool {
    joints.iter().map(|joint| joint.change * joint.change).sum::<f64>() <= LEAST_CHORD * LEAST_CHORD
}

/// The object's parameter: its slopes are the joints' slopes projected on their chord, over the chord's length. Linear where
/// the joints rest.
fn sigma(joints: &[Cubic]) -> Cubic {
    if rests(joints) {
        return Cubic::line(1.0);
    }
    let square: f64 = joints.iter().map(|joint| joint.change * joint.change).sum();
    let along =
        |slope: &dyn Fn(&Cubic) -> f64| joints.iter().map(|joint| joint.change * slope(joint)).sum::<f64>() / square;
    Cubic { change: 1.0, first: along(&|joint| joint.first), last: along(&|joint| joint.last) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn bounds_of_cubics_are_those_of_many_samples() {
        let mut rng = Rng::keyed(1, "cubic", 0);
        for _ in 0..2000 {
            let [change, first, last] = std::array::from_fn(|_| rng.uniform(-1.0, 1.0));
            let cubic = Cubic { change, first, last };
            let samples = || (0..=2000).map(|i| f64::from(i) / 2000.0);
            let slope = samples().map(|u| cubic.slope(u).abs()).fold(0.0, f64::max);
            assert!(slope <= cubic.largest_slope() + 1e-12 && slope > cubic.largest_slope() - 1e-5);
            let h = 1e-4;
            let bend = |u: f64| (cubic.slope(u + h) - cubic.slope(u - h)) / (2.0 * h);
            let most = samples().map(|u| bend(u).abs()).fold(0.0, f64::max);
            assert!((most - cubic.largest_bend()).abs() < 1e-8);
            let [low, high] = cubic.range();
            let lowest = samples().map(|u| cubic.at(u)).fold(f64::INFINITY, f64::min);
            let highest = samples().map(|u| cubic.at(u)).fold(f64::NEG_INFINITY, f64::max);
            assert!((low - lowest).abs() < 1e-5 && (high - highest).abs() < 1e-5 && low < lowest + 1e-12);
            assert!(high > highest - 1e-12);
            assert!((cubic.at(1.0) - change).abs() < 1e-12);
            assert!((cubic.at(0.4 + h) - cubic.at(0.4 - h) - 2.0 * h * cubic.slope(0.4)).abs() < 1e-10);
        }
        for cubic in [Cubic::line(0.3), Cubic::line(0.0), Cubic { change: 1.0, first: 0.0, last: 0.0 }] {
            assert!((cubic.range()[1] - cubic.change).abs() < 1e-12 && cubic.range()[0] == 0.0);
        }
    }

    #[test]
    fn sigma_is_linear_for_even_motion_and_at_rest() {
        let even = [Cubic::line(0.2), Cubic::line(-0.1)];
        assert!((sigma(&even).first - 1.0).abs() < 1e-12 && (sigma(&even).last - 1.0).abs() < 1e-12);
        assert_eq!(sigma(&[Cubic::line(0.0)]), Cubic::line(1.0));
        let from_rest = [Cubic { first: 0.0, ..Cubic::line(0.2) }, Cubic { first: 0.0, ..Cubic::line(0.7) }];
        assert!(sigma(&from_rest).first == 0.0 && (sigma(&from_rest).last - 1.0).abs() < 1e-12);
        // What is across the chord does not count.
        let across = [Cubic { first: 0.5, ..Cubic::line(0.2) }, Cubic { first: 0.0, ..Cubic::line(0.2) }];
        assert!((sigma(&across).first - 1.25).abs() < 1e-12);
    }
}
