//! By how much a segment must be slower so that joints and fingertips keep their limits between waypoints too.

use super::*;
use crate::timing::speeds::Speeds;

impl Path<'_, '_> {
    /// The same for joints alone. Where a forward pass finds nothing that its limits allow, a step may exceed them; slowed down as
    /// a whole, a segment keeps its shape.
    fn joints_too_fast(&self, waypoints: &[Waypoint], speeds: &Speeds) -> f64 {
        let mut most: f64 = 1.0;
        for (k, pair) in waypoints.windows(2).enumerate() {
            let span = speeds.spans[k];
            for j in 0..self.n_joints {
                let ends = [k, k + 1].map(|end| self.directions[end * self.n_joints + j] * speeds.speeds[end] * span);
                let [slope, bend] = steepest(pair[1].joints[j] - pair[0].joints[j], ends[0], ends[1]);
                let velocity = slope / (span * self.limits.joint_velocities[j]);
                let acceleration = bend / (span * span * self.limits.joint_accelerations[j]);
                most = most.max(velocity).max(acceleration.sqrt());
            }
        }
        most
    }

    /// By how much all must be slower so that joints keep their limits and fingertips their largest speed; at least one.
    pub fn too_fast(&self, waypoints: &[Waypoint], speeds: &Speeds) -> f64 {
        let mut most = self.joints_too_fast(waypoints, speeds);
        for (k, pair) in waypoints.windows(2).enumerate() {
            for (finger, of_model) in self.fingers.iter().zip(&self.model.fingers) {
                let range = &finger.coordinates;
                let (from, to) = (&pair[0].joints[range.clone()], &pair[1].joints[range.clone()]);
                let ends = [k, k + 1].map(|k| &self.directions[k * self.n_joints..][range.clone()]);
                if from == to && ends.iter().all(|direction| direction.iter().all(|value| *value == 0.0)) {
                    continue;
                }
                let tangents = [k, k + 1].map(|end| speeds.speeds[end] * speeds.spans[k]);
                let speed_at = |u: f64| {
                    let v = 1.0 - u;
                    let [blend, first, last] = [u * u * (3.0 - 2.0 * u), u * v * v, -u * u * v];
                    let [rate, first_rate, last_rate] = [6.0 * u * v, v * (1.0 - 3.0 * u), u * (3.0 * u - 2.0)];
                    let (mut joints, mut rates) = (Coordinates::new(), Coordinates::new());
                    for j in 0..from.len() {
                        let (change, a, b) = (to[j] - from[j], ends[0][j] * tangents[0], ends[1][j] * tangents[1]);
                        joints.push(from[j] + blend * change + first * a + last * b);
                        rates.push(rate * change + first_rate * a + last_rate * b);
                    }
                    speed(&of_model.ik.tip_jacobian(&joints), &rates).norm()
                };
                let n_looks = LOOKS[usize::from(self.lengths[k] > LONG_STEP)];
                let way = largest((0..=n_looks).map(|look| speed_at(look as f64 / n_looks as f64)));
                most = most.max(way / (speeds.spans[k] * KEPT * self.limits.largest_speed));
            }
        }
        most
    }
}

/// Largest sizes of the slope and of the second derivative of the cubic with this change and these slopes at both ends.
fn steepest(change: f64, first: f64, last: f64) -> [f64; 2] {
    let bends = [6.0 * change - 4.0 * first - 2.0 * last, 2.0 * first + 4.0 * last - 6.0 * change];
    let mut slope = first.abs().max(last.abs());
    if bends[0] * bends[1] < 0.0 {
        let u = bends[0] / (bends[0] - bends[1]);
        slope = slope.max((first + u * bends[0] + 0.5 * u * u * (bends[1] - bends[0])).abs());
    }
    [slope, bends[0].abs().max(bends[1].abs())]
}

/// The largest of values that are taken evenly from a smooth function, and of the parabolas through three of them.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    let (mut before, mut now, mut most): (f64, f64, f64) = (f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0);
    for after in values {
        if now >= before && now >= after && before.is_finite() {
            let bend = 2.0 * now - before - after;
            most = most.max(now + if bend > 0.0 { (after - before).powi(2) / (8.0 * bend) } else { 0.0 });
        }
        most = most.max(after);
        (before, now) = (now, after);
    }
    most
}
