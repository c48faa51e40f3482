//! Random numbers keyed by (seed, purpose, index), so that results do not depend on the number of threads.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng};

/// A stream of random numbers. Two streams with different keys are independent.
#[derive(Debug, Clone)]
pub struct Rng {
    generator: Pcg64Mcg,
}

/// Finaliser of SplitMix64 (Steele, Lea, Flood 2014).
fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Rng {
    /// The stream of `(seed, purpose, index)`; `purpose` is a name such as `"start_grasp"`.
    pub fn keyed(seed: u64, purpose: &str, index: u64) -> Self {
        let mut key = mix(seed);
        for byte in purpose.bytes() {
            key = mix(key ^ u64::from(byte));
        }
        Rng { generator: Pcg64Mcg::seed_from_u64(mix(key ^ mix(index))) }
    }

    /// A new stream whose key is drawn from this one and `index`; this stream does not advance.
    pub fn child(&self, purpose: &str, index: u64) -> Self {
        let mut probe = self.generator.clone();
        Rng::keyed(probe.next_u64(), purpose, index)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.generator.next_u64()
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in `0..n_choices`. Panics if there is nothing to choose from.
    pub fn below(&mut self, n_choices: usize) -> usize {
        assert!(n_choices > 0, "nothing to choose from");
        // Multiply-shift: the bias is below 2^-40 for any list that fits in memory here.
        ((u128::from(self.bits()) * n_choices as u128) >> 64) as usize
    }

    /// True with probability `probability`.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Standard normal, by Marsaglia's polar method.
    pub fn normal(&mut self) -> f64 {
        loop {
            let (u, v) = (self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                return u * (-2.0 * s.ln() / s).sqrt();
            }
        }
    }

    /// Uniform on the unit sphere, as `[x, y, z]`.
    pub fn direction(&mut self) -> [f64; 3] {
        let z = self.uniform(-1.0, 1.0);
        let angle = self.uniform(0.0, std::f64::consts::TAU);
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * angle.cos(), r * angle.sin(), z]
    }

    /// Uniform over rotations, as a unit quaternion `[x, y, z, w]` (Shoemake 1992).
    pub fn quat_xyzw(&mut self) -> [f64; 4] {
        let (u, a, b) =
            (self.unit(), self.uniform(0.0, std::f64::consts::TAU), self.uniform(0.0, std::f64::consts::TAU));
        let (r, s) = ((1.0 - u).sqrt(), u.sqrt());
        [r * a.sin(), r * a.cos(), s * b.sin(), s * b.cos()]
    }

    /// Shuffles in place (Fisher, Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_key_same_stream_and_other_key_other_stream() {
        let draw = |seed, purpose, index| Rng::keyed(seed, purpose, index).bits();
        assert_eq!(draw(1, "a", 2), draw(1, "a", 2));
        assert_ne!(draw(1, "a", 2), draw(1, "a", 3));
        assert_ne!(draw(1, "a", 2), draw(1, "b", 2));
        assert_ne!(draw(1, "a", 2), draw(2, "a", 2));
    }

    #[test]
    fn uniform_moments_match_closed_forms() {
        let mut rng = Rng::keyed(7, "moments", 0);
        let n_draws = 200_000;
        let (mut sum, mut squares, mut normal_squares) = (0.0, 0.0, 0.0);
        for _ in 0..n_draws {
            let x = rng.unit();
            sum += x;
            squares += x * x;
            normal_squares += rng.normal().powi(2);
        }
        let n = f64::from(n_draws);
        assert!((sum / n - 0.5).abs() < 5e-3);
        assert!((squares / n - 1.0 / 3.0).abs() < 5e-3);
        assert!((normal_squares / n - 1.0).abs() < 2e-2);
    }

    #[test]
    fn below_covers_every_choice() {
        let mut rng = Rng::keyed(7, "below", 0);
        let mut counts = [0usize; 5];
        for _ in 0..5000 {
            counts[rng.below(5)] += 1;
        }
        assert!(counts.iter().all(|&count| count > 850 && count < 1150), "{counts:?}");
    }
}
