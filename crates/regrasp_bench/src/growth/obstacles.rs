//! Small boxes and balls in a shell around hand and object, drawn one by one: the first of more are the same as of fewer.

use regrasp_base::Rng;
use std::fmt::Write;

/// Middle of the shell, in the world, in metres: the start of the object.
const MIDDLE: [f64; 3] = [0.0, 0.0, 0.078];
/// Distance of an obstacle's centre from the middle, in metres: from where the knuckles move to far away. Fingertips and
/// object stay within the shell.
const DISTANCE: [f64; 2] = [0.085, 0.200];
/// Half size of an obstacle, in metres.
const HALF_SIZE: [f64; 2] = [0.002, 0.004];
/// No obstacle reaches below this height, in metres: the palm lies there.
const LOWEST: f64 = 0.005;

/// The `[[obstacles]]` of a scene file: the first `n` of `seed`.
pub fn obstacles_toml(n: usize, seed: u64) -> String {
    let mut out = String::new();
    for index in 0..n {
        obstacle(index, seed, &mut out);
    }
    out
}

fn obstacle(index: usize, seed: u64, out: &mut String) {
    let mut rng = Rng::keyed(seed, "growth_obstacle", index as u64);
    let size = rng.uniform(HALF_SIZE[0], HALF_SIZE[1]);
    let center = loop {
        // Uniform in the shell: the cube of the distance is.
        let distance = rng.uniform(DISTANCE[0].powi(3), DISTANCE[1].powi(3)).cbrt();
        let direction = rng.direction();
        let center: [f64; 3] = std::array::from_fn(|k| MIDDLE[k] + distance * direction[k]);
        // A box reaches as far as its diagonal.
        if center[2] - 2.0 * size > LOWEST {
            break center;
        }
    };
    let [x, y, z] = center;
    let _ = writeln!(out, "\n[[obstacles]]\nname = \"obstacle_{}\"\nposition = [{x:.6}, {y:.6}, {z:.6}]", index + 1);
    if rng.chance(0.5) {
        let _ = writeln!(out, "sphere = {{ radius = {size:.6} }}");
    } else {
        let edge = 2.0 * size;
        let [a, b, c, w] = rng.quat_xyzw();
        let _ = writeln!(
            out,
            "box = {{ size = [{edge:.6}, {edge:.6}, {edge:.6}] }}\nquat_xyzw = [{a:.12}, {b:.12}, {c:.12}, {w:.12}]"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_are_the_first_of_more_and_another_seed_draws_others() {
        let [few, many] = [10, 100].map(|n| obstacles_toml(n, 0));
        assert!(many.starts_with(&few));
        assert_eq!(many.matches("[[obstacles]]").count(), 100);
        assert_ne!(few, obstacles_toml(10, 1));
        let n_balls = many.matches("sphere").count();
        assert!((30..70).contains(&n_balls), "{n_balls} of 100 are balls");
    }
}
