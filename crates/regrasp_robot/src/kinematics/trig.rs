//! Sine and cosine together, the same bits on every machine.
//!
//! Cody and Waite's reduction by pi/2 in three parts, then the kernels of fdlibm (`k_sin.c`, `k_cos.c`).

use std::f64::consts::FRAC_2_PI;

/// Largest angle for which the reduction below keeps its accuracy; beyond it the library's functions serve.
const LARGEST_ANGLE: f64 = 1e4;
/// Adding and subtracting it rounds to the nearest integer, which then stands in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// pi/2 in three parts; the first two have 33 bits, so that their products with small integers are exact.
const PI_2: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

/// `(sin(angle), cos(angle))`, within 2e-16.
#[inline(always)]
pub fn sin_cos(angle: f64) -> (f64, f64) {
    if angle.abs() > LARGEST_ANGLE || angle.is_nan() {
        return far_sin_cos(angle);
    }
    let shifted = angle * FRAC_2_PI + ROUND;
    let quadrant = shifted.to_bits();
    let n = shifted - ROUND;
    let x = ((angle - n * PI_2[0]) - n * PI_2[1]) - n * PI_2[2];
    let z = x * x;
    let z2 = z * z;
    let z4 = z2 * z2;
    // Estrin's scheme: half as long a chain of dependent operations as Horner's.
    let sine_low = -1.666_666_666_666_663_2e-1 + z * 8.333_333_333_322_49e-3;
    let sine_middle = -1.984_126_982_985_795e-4 + z * 2.755_731_370_707_006_8e-6;
    let sine_high = -2.505_076_025_340_686_3e-8 + z * 1.589_690_995_211_55e-10;
    let sine = x + x * z * ((sine_low + z2 * sine_middle) + z4 * sine_high);
    let cosine_low = 4.166_666_666_666_66e-2 + z * -1.388_888_888_887_411e-3;
    let cosine_middle = 2.480_158_728_947_673e-5 + z * -2.755_731_435_139_066_3e-7;
    let cosine_high = 2.087_572_321_298_175e-9 + z * -1.135_964_755_778_819_5e-11;
    let cosine = (1.0 - 0.5 * z) + z2 * ((cosine_low + z2 * cosine_middle) + z4 * cosine_high);
    // Without branches: the quadrant of a joint angle can't be predicted.
    let swap = 0u64.wrapping_sub(quadrant & 1);
    let (sine, cosine) = (sine.to_bits(), cosine.to_bits());
    let difference = (sine ^ cosine) & swap;
    let s = f64::from_bits((sine ^ difference) ^ ((quadrant & 2) << 62));
    let c = f64::from_bits((cosine ^ difference) ^ ((quadrant.wrapping_add(1) & 2) << 62));
    (s, c)
}

#[cold]
fn far_sin_cos(angle: f64) -> (f64, f64) {
    angle.sin_cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_library() {
        let mut rng = regrasp_base::Rng::keyed(3, "sin_cos", 0);
        let mut worst: f64 = 0.0;
        for range in [1e-3, 1.0, 4.0, 100.0, 9e3, 1e6] {
            for _ in 0..20_000 {
                let angle = rng.uniform(-range, range);
                let (s, c) = sin_cos(angle);
                worst = worst.max((s - angle.sin()).abs()).max((c - angle.cos()).abs());
            }
        }
        assert!(worst < 2.5e-16, "{worst:e}");
    }
}
