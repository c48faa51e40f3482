//! Where the joints are between two waypoints: every one on the cubic through its positions, velocities and times
//! (`docs/reference/plan-format.md`, Time). Parameters are shares of the time of the step.

use crate::check::between::Cubic;
use crate::check::kinematics::Drive;
use crate::robot_plan::RobotWaypoint;

/// The motion of all joints between two waypoints.
pub struct RobotStep<'a> {
    from: &'a [f64],
    cubics: Vec<Cubic>,
    /// Its time, in seconds.
    pub span: f64,
}

impl<'a> RobotStep<'a> {
    /// From one waypoint to the next. Where time does not rise, velocities make no motion: everything goes evenly then, and the plan is
    /// rejected for its times.
    pub fn new(from: &'a RobotWaypoint, to: &RobotWaypoint) -> Self {
        let span = to.time - from.time;
        let ends = from.joint_velocities.iter().zip(&to.joint_velocities);
        let changes = from.joints.iter().zip(&to.joints).map(|(a, b)| b - a);
        let cubic = |(change, (first, last)): (f64, (&f64, &f64))| match span > 0.0 {
            true => Cubic { change, first: first * span, last: last * span },
            false => Cubic::line(change),
        };
        RobotStep { from: &from.joints, cubics: changes.zip(ends).map(cubic).collect(), span }
    }

    /// How coordinate `k` moves.
    pub fn cubic(&self, k: usize) -> &Cubic {
        &self.cubics[k]
    }

    /// Number of coordinates.
    pub fn n_joints(&self) -> usize {
        self.cubics.len()
    }

    /// Joints at `u`.
    pub fn joints_at(&self, u: f64, joints: &mut Vec<f64>) {
        joints.clear();
        joints.extend(self.from.iter().zip(&self.cubics).map(|(from, cubic)| from + cubic.at(u)));
    }

    /// How a joint with this drive moves: a sum of cubics is a cubic.
    pub fn of_drive(&self, drive: &Drive) -> Cubic {
        let mut sum = Cubic { change: 0.0, first: 0.0, last: 0.0 };
        for &(k, multiplier) in &drive.terms {
            let Cubic { change, first, last } = self.cubics[k];
            sum.change += multiplier * change;
            sum.first += multiplier * first;
            sum.last += multiplier * last;
        }
        sum
    }

    /// Position of a joint with this drive at the start of the step.
    pub fn start_of(&self, drive: &Drive) -> f64 {
        drive.position(self.from)
    }
}

/// Largest distance of the cubic from its value at `middle`, between `first` and `last`.
pub fn largest_change(cubic: &Cubic, first: f64, middle: f64, last: f64) -> f64 {
    let (start, length) = (cubic.at(first), last - first);
    let piece =
        Cubic { change: cubic.at(last) - start, first: cubic.slope(first) * length, last: cubic.slope(last) * length };
    let [low, high] = piece.range();
    let at_middle = cubic.at(middle) - start;
    (high - at_middle).max(at_middle - low)
}
