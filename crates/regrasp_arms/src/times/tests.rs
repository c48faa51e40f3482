use super::*;
use regrasp_base::Rng;

fn random_path(rng: &mut Rng, n: usize, dimension: usize) -> Vec<Vec<f64>> {
    (0..n).map(|_| (0..dimension).map(|_| rng.uniform(-1.5, 1.5)).collect()).collect()
}

#[test]
fn a_line_is_passed_in_the_least_time() {
    // 2 rad at 1 rad/s and 4 rad/s^2: 0.25 s to speed up, 1.75 s at speed, 0.25 s to stop.
    let path = RoundedPath::new(&[vec![0.0, 0.0], vec![2.0, 1.0]], 1.0).unwrap();
    let timed = times(&path, &Limits::of_joints(&[1.0, 9.0], &[4.0, 9.0]));
    assert!((timed.duration() - 2.25).abs() < 0.02, "{}", timed.duration());
}

#[test]
fn paths_that_turn_back_take_no_more_than_stopping_there() {
    let mut rng = Rng::keyed(3, "times", 0);
    for case in 0..60 {
        // Out and back again by nearly the same way.
        let aside = if case % 3 == 0 { 0.0 } else { 10f64.powf(rng.uniform(-9.0, -1.0)) };
        let out: Vec<f64> = (0..6).map(|_| rng.uniform(-1.0, 1.0)).collect();
        let back: Vec<f64> = out.iter().map(|value| 0.1 * value + aside * rng.uniform(-1.0, 1.0)).collect();
        let corners = [vec![0.0; 6], out, back];
        let limits = Limits::of_joints(&[1.0; 6], &[5.0; 6]);
        let path = RoundedPath::new(&corners, 0.5).unwrap();
        let mut sharp = path.clone();
        sharp.stop(1);
        let [rounded, stopping] = [path, sharp].map(|path| times(&path, &limits).duration());
        assert!(rounded <= 1.1 * stopping, "{aside}: {rounded} {stopping}");
    }
}

#[test]
fn limits_are_kept_at_every_moment_and_reached_somewhere() {
    let mut rng = Rng::keyed(1, "times", 0);
    for case in 0..40 {
        let corners = random_path(&mut rng, 2 + case % 5, 7);
        let velocities: Vec<f64> = (0..7).map(|_| rng.uniform(0.5, 2.5)).collect();
        let accelerations: Vec<f64> = (0..7).map(|_| rng.uniform(2.0, 12.0)).collect();
        let path = RoundedPath::new(&corners, 0.5).unwrap();
        let timed = times(&path, &Limits::of_joints(&velocities, &accelerations));
        let mut closest: f64 = 0.0;
        for k in 0..timed.corners.len() {
            let (track, span) = (timed.track(k), timed.points[k + 1].time - timed.points[k].time);
            assert!(span > 0.0);
            for i in 0..=50 {
                let t = f64::from(i) / 50.0;
                for (j, c) in track.coefficients.iter().enumerate() {
                    let velocity = (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) / span;
                    let acceleration = (2.0 * c[2] + 6.0 * c[3] * t) / (span * span);
                    assert!(velocity.abs() <= velocities[j] * (1.0 + 1e-9));
                    assert!(acceleration.abs() <= accelerations[j] * (1.0 + 1e-9));
                    closest = closest.max(velocity.abs() / velocities[j]).max(acceleration.abs() / accelerations[j]);
                }
            }
        }
        assert!(closest > 0.95, "{closest}");
        let (first, last) = (&timed.points[0], &timed.points[timed.points.len() - 1]);
        assert_eq!((&first.joints, &last.joints), (&corners[0], &corners[corners.len() - 1]));
        assert!(first.velocities.iter().chain(&last.velocities).all(|velocity| *velocity == 0.0));
    }
}

/// Speeds on a fine grid by an independent method: lower a profile until all limits hold (a fixed point, no linear program).
#[test]
fn durations_are_near_those_of_a_relaxed_profile() {
    let mut rng = Rng::keyed(2, "times", 0);
    let mut ratios = Vec::new();
    for _ in 0..10 {
        let corners = random_path(&mut rng, 4, 5);
        let path = RoundedPath::new(&corners, 0.4).unwrap();
        let (velocities, accelerations) = (vec![1.5; 5], vec![6.0; 5]);
        let timed = times(&path, &Limits::of_joints(&velocities, &accelerations));
        // Bound from below: each line alone from its middle to its middle at full speed, never slower than the fastest joint.
        let least: f64 = corners
            .windows(2)
            .map(|pair| pair[0].iter().zip(&pair[1]).map(|(a, b)| (b - a).abs() / 1.5).fold(0.0, f64::max))
            .sum();
        // From above: stopping at every corner.
        let mut sharp = path.clone();
        for k in sharp.inner_corners() {
            while !sharp.is_sharp(k) {
                sharp.sharpen(k);
            }
        }
        let stopping = times(&sharp, &Limits::of_joints(&velocities, &accelerations)).duration();
        assert!(timed.duration() < stopping, "{} {stopping}", timed.duration());
        ratios.push(timed.duration() / least);
    }
    assert!(ratios.iter().all(|ratio| (0.8..1.6).contains(ratio)), "{ratios:?}");
}
