//! How fast the waypoints are passed: a backward and a forward pass along the path.
//!
//! Scaled down, path speeds that a step allows are allowed: of every waypoint the speeds from which the end can be reached are
//! those up to a largest one. The backward pass finds these; the forward pass takes the fastest speed that they allow. Where the
//! joints stop, path speeds before and after say nothing about each other.

use crate::timing::path::Path;

/// Shares of the speeds at both ends of a step that are tried, from 0 to 1.
const SHARES: usize = 10;
/// Where the joints stop at neither end, these first and last ones are left out: no waypoint has the speed zero then.
const LEFT_OUT: usize = 1;
/// Halvings after which a largest or smallest number that keeps the limits counts as found.
const HALVINGS: usize = 6;
/// A step that is not allowed to be shorter by this factor is as short as it can be.
const TELLS: f64 = 1.003;
/// Rounds in which single speeds are changed where that saves time.
const SWEEPS: usize = 1;
/// By which factors.
const CHANGES: [f64; 2] = [1.1, 0.92];
/// Shares of what is allowed that is taken: rounding.
const KEPT: f64 = 1.0 - 1e-9;

/// Path speeds at waypoints, and times between them.
#[derive(Debug, Default)]
pub struct Speeds {
    /// Path speed of each waypoint; zero where the joints stop.
    pub speeds: Vec<f64>,
    /// Time from each waypoint to the next, in seconds.
    pub spans: Vec<f64>,
    /// Largest path speeds from which the end can be reached.
    reachable: Vec<f64>,
}

impl Speeds {
    /// Finds the speeds along `path`.
    pub fn find(&mut self, path: &Path) {
        let n_steps = path.steps.len();
        self.go_back(path);
        self.speeds.clear();
        self.speeds.resize(n_steps + 1, 0.0);
        self.spans.clear();
        for k in 0..n_steps {
            let span = match path.steps[k].length > 0.0 {
                true => self.go_on(path, k),
                false => path.steps[k].least_span,
            };
            self.spans.push(span);
        }
        for _ in 0..SWEEPS {
            self.improve(path);
        }
    }

    /// The largest speeds from which the end can be reached.
    fn go_back(&mut self, path: &Path) {
        self.reachable.clear();
        self.reachable.resize(path.steps.len() + 1, f64::INFINITY);
        for (k, step) in path.steps.iter().enumerate().rev().filter(|&(k, _)| !path.stops[k]) {
            let next = self.reachable[k + 1];
            let shares = if path.stops[k + 1] { shares(1, 0) } else { shares(LEFT_OUT, LEFT_OUT) };
            let most = shares
                .filter(|&share| path.allows(k, share))
                .map(|share| share * step.largest_sum(share).min(next / (1.0 - share)));
            self.reachable[k] = most.fold(0.0, f64::max).min(path.caps[k]);
        }
    }

    /// Sets the speed at the end of step `k`; the time that the step takes.
    fn go_on(&mut self, path: &Path, k: usize) -> f64 {
        let (step, from) = (&path.steps[k], self.speeds[k]);
        let most = if path.stops[k + 1] { 0.0 } else { self.reachable[k + 1] };
        let sum = match (path.stops[k], path.stops[k + 1]) {
            (true, true) => step.largest_sum(0.5),
            // From rest: the fastest at the end, and of these the shortest.
            (true, false) => {
                let mut best = (0.0, 0.0);
                for share in shares(0, 1).filter(|&share| path.allows(k, share)) {
                    let sum = step.largest_sum(share).min(most / (1.0 - share));
                    let to = sum * (1.0 - share);
                    if to > best.0 * (1.0 + 1e-9) || (to >= best.0 * (1.0 - 1e-9) && sum > best.1) {
                        best = (to, sum);
                    }
                }
                self.speeds[k + 1] = best.0 * KEPT;
                best.1
            }
            (false, true) => shares(1, 0)
                .filter(|&share| path.allows(k, share) && share * step.largest_sum(share) >= from * KEPT)
                .map(|share| from / share)
                .fold(from, f64::max),
            (false, false) => {
                let share = least_share(path, k, from, most);
                self.speeds[k + 1] = (from * (1.0 - share) / share).min(most) * KEPT;
                from + self.speeds[k + 1]
            }
        };
        self.shortest(path, k, [self.speeds[k], self.speeds[k + 1]], 2.0 * step.length / (sum * KEPT))
    }

    /// The shortest time of step `k` between these speeds that is found from `span`, which its limits allow.
    fn shortest(&self, path: &Path, k: usize, speeds: [f64; 2], span: f64) -> f64 {
        let step = &path.steps[k];
        let mut allowed = 1.0 / span;
        // Most steps are as short as they can be.
        if !step.allows(speeds, allowed * TELLS) {
            return span;
        }
        let mut factor = 1.25;
        for _ in 0..HALVINGS {
            if step.allows(speeds, allowed * factor) {
                allowed *= factor;
            } else {
                factor = factor.sqrt();
            }
        }
        1.0 / allowed
    }

    /// Changes single speeds where the steps before and after take less time together.
    fn improve(&mut self, path: &Path) {
        for k in (1..path.steps.len()).filter(|&k| !path.stops[k]) {
            for change in CHANGES {
                let speed = self.speeds[k] * change;
                if speed > path.caps[k] {
                    continue;
                }
                let spans = [k - 1, k].map(|step| {
                    let speeds = if step == k { [speed, self.speeds[k + 1]] } else { [self.speeds[k - 1], speed] };
                    let span = self.spans[step];
                    let is_allowed = path.steps[step].allows(speeds, 1.0 / span);
                    is_allowed.then(|| self.shortest(path, step, speeds, span))
                });
                if let [Some(before), Some(after)] = spans
                    && path.stray(k - 1, self.speeds[k - 1], speed, before) <= 1.0
                    && path.stray(k, speed, self.speeds[k + 1], after) <= 1.0
                    && before + after < (self.spans[k - 1] + self.spans[k]) * (1.0 - 1e-6)
                {
                    self.speeds[k] = speed;
                    (self.spans[k - 1], self.spans[k]) = (before, after);
                }
            }
        }
    }
}

/// The least share of the first speed with which `from` is allowed, and the speed at the end no larger than `most`: the fastest
/// there.
fn least_share(path: &Path, k: usize, from: f64, most: f64) -> f64 {
    let allows = |share: f64| path.allows(k, share) && share * path.steps[k].largest_sum(share) >= from;
    let fastest = from / (from + most);
    if allows(fastest) {
        return fastest;
    }
    let mut tried = shares(LEFT_OUT, LEFT_OUT);
    let Some(mut high) = tried.find(|&share| allows(share)) else { return 0.5 };
    let mut low = high - 1.0 / SHARES as f64;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match allows(middle) {
            true => high = middle,
            false => low = middle,
        }
    }
    high
}

/// Shares from 0 to 1 without so many first and last ones.
fn shares(first: usize, last: usize) -> impl Iterator<Item = f64> {
    (first..=SHARES - last).map(|i| i as f64 / SHARES as f64)
}
