//! Blocks of eight numbers: one for each of eight configurations.
//!
//! Plain arrays and loops of fixed length, which the compiler turns into vector instructions. No operation contracts a product and
//! a sum, so that every machine gets the same bits.

use std::ops::{Add, Mul, Sub};

/// Configurations of a block.
pub const LANES: usize = 8;

/// Eight numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub struct F8(pub [f32; LANES]);

/// A point or vector in each of eight configurations.
pub type V8 = [F8; 3];

macro_rules! operation {
    ($name:ident, $function:ident, $op:tt) => {
        impl $name for F8 {
            type Output = F8;
            #[inline(always)]
            fn $function(self, other: F8) -> F8 {
                let mut out = self;
                for l in 0..LANES {
                    out.0[l] = self.0[l] $op other.0[l];
                }
                out
            }
        }
        impl $name<f32> for F8 {
            type Output = F8;
            #[inline(always)]
            fn $function(self, other: f32) -> F8 {
                let mut out = self;
                for l in 0..LANES {
                    out.0[l] = self.0[l] $op other;
                }
                out
            }
        }
    };
}
operation!(Add, add, +);
operation!(Sub, sub, -);
operation!(Mul, mul, *);

impl F8 {
    /// Eight times zero.
    pub const ZERO: F8 = F8([0.0; LANES]);

    /// The same number in each lane.
    #[inline(always)]
    pub fn splat(value: f32) -> F8 {
        F8([value; LANES])
    }

    /// The larger of two numbers; `self` where `other` is not a number.
    #[inline(always)]
    pub fn max(self, other: F8) -> F8 {
        let mut out = self;
        for l in 0..LANES {
            out.0[l] = if other.0[l] > self.0[l] { other.0[l] } else { self.0[l] };
        }
        out
    }

    /// The smaller of two numbers; `self` where `other` is not a number.
    #[inline(always)]
    pub fn min(self, other: F8) -> F8 {
        let mut out = self;
        for l in 0..LANES {
            out.0[l] = if other.0[l] < self.0[l] { other.0[l] } else { self.0[l] };
        }
        out
    }

    /// Sizes.
    #[inline(always)]
    pub fn abs(self) -> F8 {
        let mut out = self;
        for l in 0..LANES {
            out.0[l] = self.0[l].abs();
        }
        out
    }

    /// Square roots.
    #[inline(always)]
    pub fn sqrt(self) -> F8 {
        let mut out = self;
        for l in 0..LANES {
            out.0[l] = self.0[l].sqrt();
        }
        out
    }

    /// The least number.
    #[inline(always)]
    pub fn lowest(self) -> f32 {
        let low = |a: f32, b: f32| if b < a { b } else { a };
        let v = &self.0;
        let half = [low(v[0], v[4]), low(v[1], v[5]), low(v[2], v[6]), low(v[3], v[7])];
        low(low(half[0], half[2]), low(half[1], half[3]))
    }

    /// The largest number.
    #[inline(always)]
    pub fn highest(self) -> f32 {
        let high = |a: f32, b: f32| if b > a { b } else { a };
        let v = &self.0;
        let half = [high(v[0], v[4]), high(v[1], v[5]), high(v[2], v[6]), high(v[3], v[7])];
        high(high(half[0], half[2]), high(half[1], half[3]))
    }

    /// True where any number is positive.
    #[inline(always)]
    pub fn any_positive(self) -> bool {
        let mut any = false;
        for l in 0..LANES {
            any |= self.0[l] > 0.0;
        }
        any
    }

    /// One bit for each number that is positive.
    #[inline(always)]
    pub fn positive(self) -> u8 {
        let mut bits = 0;
        for l in 0..LANES {
            bits |= u8::from(self.0[l] > 0.0) << l;
        }
        bits
    }

    /// Sines and cosines, within 2e-7 for angles up to 100.
    ///
    /// Polynomials of Cephes on a quarter turn about zero, after subtracting quarter turns in three parts (Cody, Waite 1980).
    #[inline(always)]
    pub fn sin_cos(self) -> (F8, F8) {
        /// Adding and subtracting it rounds to whole numbers.
        const ROUND: f32 = 12_582_912.0;
        let (mut sines, mut cosines) = (F8::ZERO, F8::ZERO);
        for l in 0..LANES {
            let x = self.0[l];
            let shifted = x * std::f32::consts::FRAC_2_PI + ROUND;
            let quarter = shifted.to_bits();
            let turns = shifted - ROUND;
            let r = ((x - turns * 1.570_312_5) - turns * 4.837_513e-4) - turns * 7.549_79e-8;
            let r2 = r * r;
            let sine = r + r * r2 * (-1.666_665_5e-1 + r2 * (8.332_161e-3 + r2 * -1.951_529_6e-4));
            let cosine = 1.0 - 0.5 * r2 + r2 * r2 * (4.166_664_6e-2 + r2 * (-1.388_731_6e-3 + r2 * 2.443_315_7e-5));
            let is_odd = quarter & 1 == 1;
            let (s, c) = (if is_odd { cosine } else { sine }, if is_odd { sine } else { cosine });
            sines.0[l] = f32::from_bits(s.to_bits() ^ ((quarter & 2) << 30));
            cosines.0[l] = f32::from_bits(c.to_bits() ^ ((quarter.wrapping_add(1) & 2) << 30));
        }
        (sines, cosines)
    }
}

/// Sum of squares.
#[inline(always)]
pub fn squared(v: &V8) -> F8 {
    v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
}

/// Difference of two points.
#[inline(always)]
pub fn minus(a: &V8, b: &V8) -> V8 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_agree_with_double_precision() {
        let mut most: f64 = 0.0;
        for i in -20_000..20_000 {
            let x = i as f32 * 5e-3;
            let (s, c) = F8::splat(x).sin_cos();
            let (sine, cosine) = f64::from(x).sin_cos();
            most = most.max((f64::from(s.0[3]) - sine).abs()).max((f64::from(c.0[5]) - cosine).abs());
        }
        assert!(most < 2e-7, "{most}");
    }

    #[test]
    fn bits_tell_lanes_apart() {
        let values = F8([1.0, -1.0, 0.0, 2.0, f32::NAN, -0.0, 1e-30, -5.0]);
        assert_eq!(values.positive(), 0b0100_1001);
        assert!(values.any_positive() && !F8::ZERO.any_positive());
    }
}
