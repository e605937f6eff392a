//! Sines and cosines of joint positions, for one number or for lanes. Both use the same operations in the
//! same order, none of them fused. Both have the same bits on every processor and with every mathematics
//! library.
//!
//! Reduction by Cody and Waite, polynomials of Sun's fdlibm (`k_sin.c`, `k_cos.c`).

use super::real::{MaskOf, Real};

/// Largest angle of these functions, radians; the system's functions handle larger ones. Up to here a
/// multiple of the first part of pi / 2 is exact.
pub const LARGEST: f64 = 1_048_576.0;

/// Constant that rounds: its sum with a moderate number is an integer.
const ROUNDS: f64 = 1.5 / f64::EPSILON;
/// First 33 bits of pi / 2, and the rest.
const HALF_PI: f64 = 1.570_796_326_734_125_6;
const HALF_PI_REST: f64 = 6.077_100_506_506_192e-11;

const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Returns sine and cosine of an angle, radians.
#[inline]
pub fn sin_cos(angle: f64) -> (f64, f64) {
    if angle.abs() <= LARGEST { sin_cos_of_moderate(angle) } else { angle.sin_cos() }
}

/// Returns sine and cosine of an angle up to [`LARGEST`], radians.
#[inline(always)]
pub fn sin_cos_of_moderate<R: Real>(angle: R) -> (R, R) {
    let count = rounded(angle * angle.splat(std::f64::consts::FRAC_2_PI));
    let from_first = angle - count * angle.splat(HALF_PI);
    let rest = count * angle.splat(HALF_PI_REST);
    let x = from_first - rest;
    // Rounding error of the reduced angle.
    let t = (from_first - x) - rest;
    let (sin, cos) = (sine(x, t), cosine(x, t));
    // Quarter turns beyond whole turns: -2 to 2.
    let quarters = count - angle.splat(4.0) * rounded(count * angle.splat(0.25));
    let square = quarters * quarters;
    let is_odd = square.equals(square.splat(1.0));
    let (up, along) = (is_odd.select(cos, sin), is_odd.select(sin, cos));
    let is_back = square.equals(square.splat(4.0));
    let (sin_turns, cos_turns) = (quarters.splat(-1.0), quarters.splat(1.0));
    (
        (is_back | quarters.equals(sin_turns)).select(-up, up),
        (is_back | quarters.equals(cos_turns)).select(-along, along),
    )
}

/// Rounds to the nearest integer, ties to even.
#[inline(always)]
fn rounded<R: Real>(number: R) -> R {
    number + number.splat(ROUNDS) - number.splat(ROUNDS)
}

/// Returns the sine of `x + t`, at most pi / 4, where `t` is small.
#[inline(always)]
fn sine<R: Real>(x: R, t: R) -> R {
    let [s1, s2, s3, s4, s5, s6] = SINE;
    let z = x * x;
    let first = x.splat(s2) + z * (x.splat(s3) + z * x.splat(s4));
    let r = first + z * (z * z) * (x.splat(s5) + z * x.splat(s6));
    let v = z * x;
    x - ((z * (x.splat(0.5) * t - v * r) - t) - v * x.splat(s1))
}

/// Returns the cosine of `x + t`, at most pi / 4, where `t` is small.
#[inline(always)]
fn cosine<R: Real>(x: R, t: R) -> R {
    let [c1, c2, c3, c4, c5, c6] = COSINE;
    let z = x * x;
    let w = z * z;
    let first = z * (x.splat(c1) + z * (x.splat(c2) + z * x.splat(c3)));
    let r = first + w * w * (x.splat(c4) + z * (x.splat(c5) + z * x.splat(c6)));
    let half = x.splat(0.5) * z;
    let near = x.splat(1.0) - half;
    near + (((x.splat(1.0) - near) - half) + (z * r - x * t))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;

    /// Returns the larger error of both against the system's functions, in units of 2^-53.
    fn error(angle: f64) -> f64 {
        let (sin, cos) = sin_cos(angle);
        (sin - angle.sin()).abs().max((cos - angle.cos()).abs()) * 2.0 / f64::EPSILON
    }

    #[test]
    fn sines_and_cosines_are_those_of_the_system_to_rounding() {
        let mut largest = 0.0f64;
        for scale in [1e-8, 1.0, 10.0, 1e3, LARGEST] {
            for i in 0..100_000 {
                // Distributed by the golden ratio.
                let spread = (f64::from(i) * 0.618_033_988_749_894_9).fract();
                largest = largest.max(error((2.0 * spread - 1.0) * scale));
            }
        }
        assert!(largest <= 2.0, "{largest}");
    }

    #[test]
    fn they_hold_where_quarters_of_a_turn_end() {
        for quarter in -40..40 {
            for at in [f64::from(quarter) * FRAC_PI_2, f64::from(quarter) * FRAC_PI_2 + FRAC_PI_4] {
                for angle in [at.next_down(), at, at.next_up()] {
                    assert!(error(angle) <= 2.0, "{angle}: {}", error(angle));
                }
            }
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn large_angles_and_nan_are_left_to_the_system() {
        for angle in [LARGEST, LARGEST.next_up(), -1e9, 1e300] {
            assert!(error(angle) <= 2.0, "{angle}");
        }
        for angle in [f64::NAN, f64::INFINITY] {
            let (sin, cos) = sin_cos(angle);
            assert!(sin.is_nan() && cos.is_nan(), "{angle}");
        }
    }
}
