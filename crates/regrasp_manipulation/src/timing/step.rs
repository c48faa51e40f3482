//! The limits of one step between two waypoints.
//!
//! With length `h` and direction `c` of the chord, directions `d0` and `d1` at its ends and path speeds `s0` and `s1` there, the
//! joints' velocities are `d0 s0` and `d1 s1`, and their cubic lasts `T`. In `T = 2 h / (s0 + s1)`, which is even acceleration along
//! a straight path, all velocities are the sum `s0 + s1` times something that depends on the share `s0 / (s0 + s1)` only, and all
//! accelerations its square times something: the largest sum for a share has a closed form.

use regrasp_geometry::Vector;

/// One joint, or the object's parameter.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Direction of the chord.
    pub chord: f64,
    /// Directions at both ends.
    pub ends: [f64; 2],
    /// Largest velocity.
    pub velocity: f64,
    /// Largest acceleration.
    pub acceleration: f64,
}

/// A fingertip at a moment between the waypoints, with the Jacobian there.
#[derive(Debug, Clone, Copy)]
pub struct TipRow {
    /// Share of the step's time.
    pub moment: f64,
    /// How it goes along the chord, in metres per unit of the path.
    pub chord: Vector,
    /// How it would go in the directions of both ends.
    pub ends: [Vector; 2],
}

impl TipRow {
    /// Its velocity, with these even speed along the chord and path speeds at both ends.
    fn velocity(&self, even: f64, speeds: [f64; 2]) -> Vector {
        let (u, v) = (self.moment, 1.0 - self.moment);
        let ends = [v * (1.0 - 3.0 * u) * speeds[0], u * (3.0 * u - 2.0) * speeds[1]];
        self.chord * (6.0 * u * v * even) + self.ends[0] * ends[0] + self.ends[1] * ends[1]
    }
}

/// A step: what limits it.
#[derive(Debug, Clone, Default)]
pub struct StepLimits {
    /// Length of the chord of all joints.
    pub length: f64,
    /// Joints that move; the object's parameter, in units of the chord's length, is one too.
    pub rows: Vec<Row>,
    /// Fingertips that move.
    pub tips: Vec<TipRow>,
    /// Largest speed of fingertips, in metres per second.
    pub tip_speed: f64,
    /// Least time, in seconds.
    pub least_span: f64,
}

impl StepLimits {
    /// The largest sum of the path speeds at both ends, of which `share` is the first one, when the step lasts twice its length
    /// over the sum. Velocities at the ends themselves are not looked at.
    pub fn largest_sum(&self, share: f64) -> f64 {
        let (mut pace, mut bend): (f64, f64) = (0.5 * self.least_span / self.length, 0.0);
        for row in &self.rows {
            let [first, last] = [row.ends[0] * share, row.ends[1] * (1.0 - share)];
            let middle = 1.5 * row.chord - first - last;
            pace = pace.max(peak(first, middle, last) / row.velocity);
            bend = bend.max((middle - first).abs().max((last - middle).abs()) / row.acceleration);
        }
        let tips = self.tips.iter().map(|tip| tip.velocity(0.5, [share, 1.0 - share]).norm_squared());
        pace = pace.max(tips.fold(0.0, f64::max).sqrt() / self.tip_speed);
        // The velocities are those of a parabola with these Bernstein coefficients, and the acceleration twice the difference
        // of two of them over the time.
        (1.0 / pace).min((self.length / bend).sqrt())
    }

    /// True when a step between these path speeds keeps its limits in `1 / rate` seconds. Velocities at the ends themselves are
    /// not looked at.
    pub fn allows(&self, speeds: [f64; 2], rate: f64) -> bool {
        let even = self.length * rate;
        self.least_span * rate <= 1.0
            && self.rows.iter().all(|row| {
                let [first, last] = [row.ends[0] * speeds[0], row.ends[1] * speeds[1]];
                let middle = 3.0 * row.chord * even - first - last;
                let bend = 2.0 * rate * (middle - first).abs().max((last - middle).abs());
                peak(first, middle, last) <= row.velocity && bend <= row.acceleration
            })
            && self.tips.iter().all(|tip| tip.velocity(even, speeds).norm_squared() <= self.tip_speed * self.tip_speed)
    }
}

/// Largest size of a parabola with these Bernstein coefficients inside its interval; at the ends where that is not inside.
fn peak(first: f64, middle: f64, last: f64) -> f64 {
    let ends = first.abs().max(last.abs());
    if (middle - first) * (last - middle) >= 0.0 {
        return ends;
    }
    ends.max(((first * last - middle * middle) / (first - 2.0 * middle + last)).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    fn step(rng: &mut Rng) -> StepLimits {
        let mut row = || {
            let chord = rng.uniform(-1.0, 1.0);
            let ends = [rng.uniform(0.5, 1.5), rng.uniform(0.5, 1.5)]
                .map(|share| chord * share + 0.1 * rng.uniform(-1.0, 1.0));
            Row { chord, ends, velocity: rng.uniform(0.5, 2.0), acceleration: rng.uniform(5.0, 20.0) }
        };
        let rows = (0..4).map(|_| row()).collect();
        StepLimits { length: rng.uniform(0.01, 0.3), rows, tips: Vec::new(), tip_speed: 0.04, least_span: 1e-3 }
    }

    #[test]
    fn the_largest_sum_is_allowed_and_no_larger_one() {
        let mut rng = Rng::keyed(1, "largest sum", 0);
        for _ in 0..500 {
            let (step, share) = (step(&mut rng), rng.unit());
            let sum = step.largest_sum(share);
            let allows = |sum: f64| step.allows([share * sum, (1.0 - share) * sum], 0.5 * sum / step.length);
            assert!(allows(sum * (1.0 - 1e-9)));
            assert!(!allows(sum * (1.0 + 1e-6)));
            // Scaled down, it stays allowed.
            assert!(allows(0.3 * sum));
        }
    }

    #[test]
    fn what_is_allowed_keeps_velocity_and_acceleration_at_every_moment() {
        let mut rng = Rng::keyed(2, "allowed", 0);
        for _ in 0..200 {
            let (step, share) = (step(&mut rng), rng.unit());
            let sum = step.largest_sum(share);
            let span = 2.0 * step.length / sum;
            let mut closest: f64 = 0.0;
            for row in &step.rows {
                let [first, last] = [row.ends[0] * share * sum, row.ends[1] * (1.0 - share) * sum];
                let mean = row.chord * step.length / span;
                let velocity = |u: f64| {
                    let v = 1.0 - u;
                    6.0 * u * v * mean + v * (1.0 - 3.0 * u) * first + u * (3.0 * u - 2.0) * last
                };
                for i in 0..=100 {
                    let u = f64::from(i) / 100.0;
                    let acceleration = (velocity(u + 1e-5) - velocity(u - 1e-5)) / (2e-5 * span);
                    assert!(acceleration.abs() <= row.acceleration * (1.0 + 1e-6));
                    closest = closest.max(acceleration.abs() / row.acceleration);
                    // Ends are limited where waypoints are.
                    let ends = first.abs().max(last.abs());
                    assert!(velocity(u).abs() <= row.velocity.max(ends) * (1.0 + 1e-9));
                    closest = closest.max(velocity(u).abs() / row.velocity);
                }
            }
            assert!(closest > 0.999, "{closest}");
        }
    }
}
