//! Runge-Kutta steps of Dormand and Prince, orders 5 and 4 (Hairer, Norsett, Wanner 1993, II.5), with error control per unit
//! of time.

use super::NoStep;
use nalgebra::SVector;

const NODES: [f64; 6] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0];
const STAGES: [[f64; 5]; 6] = [
    [0.0; 5],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
];
/// Weights of order 5; the last stage is the rate at the end.
const WEIGHTS: [f64; 6] = [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
/// Weights of order 5 less those of order 4.
const ERRORS: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Shortest step, over the whole duration.
const SHORTEST: f64 = 1e-10;

/// One step of `length` from `state` at `time`, where the rate is `slope`: the state of order 5, and its difference from that of
/// order 4.
pub(super) fn step<const N: usize>(
    rate: &mut impl FnMut(f64, &SVector<f64, N>) -> Result<SVector<f64, N>, NoStep>,
    time: f64,
    state: &SVector<f64, N>,
    slope: &SVector<f64, N>,
    length: f64,
) -> Result<(SVector<f64, N>, SVector<f64, N>), NoStep> {
    let mut slopes = [SVector::<f64, N>::zeros(); 7];
    slopes[0] = *slope;
    for k in 1..6 {
        let at = (0..k).fold(*state, |at, j| at + slopes[j] * (length * STAGES[k][j]));
        slopes[k] = rate(time + NODES[k] * length, &at)?;
    }
    let end = (0..6).fold(*state, |at, k| at + slopes[k] * (length * WEIGHTS[k]));
    slopes[6] = rate(time + length, &end)?;
    let error = (0..7).fold(SVector::zeros(), |sum, k| sum + slopes[k] * (length * ERRORS[k]));
    Ok((end, error))
}

/// Integrates over `duration` so that the estimated errors of all steps add up to at most `tolerance`.
///
/// `size` measures an error at a state; `settled` replaces a state reached by an equal one (a better chart, a point put back
/// onto its surface). Returns the end and the number of steps tried.
pub(super) fn integrate<const N: usize>(
    mut rate: impl FnMut(f64, &SVector<f64, N>) -> Result<SVector<f64, N>, NoStep>,
    size: impl Fn(&SVector<f64, N>, &SVector<f64, N>) -> f64,
    mut settled: impl FnMut(SVector<f64, N>) -> SVector<f64, N>,
    start: SVector<f64, N>,
    duration: f64,
    tolerance: f64,
) -> Result<(SVector<f64, N>, usize), NoStep> {
    let (mut time, mut state, mut length, mut n_steps) = (0.0, start, duration, 0);
    let mut slope = rate(0.0, &state)?;
    while time < duration {
        n_steps += 1;
        let is_last = time + length >= duration;
        let length_now = if is_last { duration - time } else { length };
        let tried = step(&mut rate, time, &state, &slope, length_now);
        let error = match &tried {
            Ok((end, error)) => size(end, error) / length_now,
            Err(_) => f64::INFINITY,
        };
        let allowed = tolerance / duration;
        if let Ok((end, _)) = &tried
            && error <= allowed
        {
            state = settled(*end);
            time = if is_last { duration } else { time + length_now };
            if !is_last {
                slope = rate(time, &state)?;
            }
        } else if length_now < SHORTEST * duration {
            return Err(tried.err().unwrap_or(NoStep::Tolerance { reached: time, error }));
        }
        // The error per unit of time goes with the fourth power of the step.
        let wished = 0.9 * (allowed / error).powf(0.25);
        length = length_now * if wished.is_nan() { 0.2 } else { wished.clamp(0.2, 5.0) };
    }
    Ok((state, n_steps))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    fn circle(_: f64, x: &Vector2<f64>) -> Result<Vector2<f64>, NoStep> {
        Ok(Vector2::new(-x.y, x.x))
    }

    #[test]
    fn the_error_falls_with_the_fifth_power_of_the_step_and_its_estimate_too() {
        let run = |n: u32| {
            let length = 2.0 / f64::from(n);
            let start = (Vector2::x(), 0.0);
            let (end, estimated) = (0..n).fold(start, |(at, sum), _| {
                let slope = circle(0.0, &at).unwrap();
                let (to, error) = step(&mut circle, 0.0, &at, &slope, length).unwrap();
                (to, sum + error.norm())
            });
            ((end - Vector2::new(2f64.cos(), 2f64.sin())).norm(), estimated)
        };
        let ((first, first_estimate), (second, second_estimate)) = (run(10), run(20));
        assert!((28.0..36.0).contains(&(first / second)), "{first} {second}");
        assert!((14.0..18.0).contains(&(first_estimate / second_estimate)), "{first_estimate} {second_estimate}");
        assert!(first < first_estimate);
    }

    #[test]
    fn the_tolerance_is_kept_and_steps_grow_with_it() {
        let run = |tolerance: f64| {
            let (end, n) = integrate(circle, |_, error| error.norm(), |x| x, Vector2::x(), 10.0, tolerance).unwrap();
            let error = (end - Vector2::new(10f64.cos(), 10f64.sin())).norm();
            assert!(error <= tolerance, "{error} {tolerance}");
            n
        };
        let counts = [1e-4, 1e-7, 1e-10].map(run);
        assert!(counts[0] < counts[1] && counts[1] < counts[2] && counts[2] < 2000, "{counts:?}");
        let wild = integrate(|_, _| Ok(Vector2::repeat(f64::NAN)), |_, e| e.norm(), |x| x, Vector2::x(), 1.0, 1e-6);
        assert!(matches!(wild, Err(NoStep::Tolerance { .. })));
    }
}
