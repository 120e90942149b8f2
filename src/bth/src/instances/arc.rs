//! Sine and arc cosine of arcs up to a quarter of a circle, as the interpolation of rotations needs them. Those of the standard library
//! are the platform's, so their last bit differs between platforms; and they reduce arguments of any size, for which they hold 1,200 bits
//! of 2 / π.
//!
//! Polynomials and their errors, below one unit in the last place: S. Moshier and K. C. Ng, fdlibm (Sun Microsystems, 1993), `k_sin.c`,
//! `k_cos.c` and `e_acos.c`.
#![expect(clippy::excessive_precision)] // The coefficients have the digits that they have there.

/// π / 2 as the sum of two numbers: the nearest, and what that lacks.
const QUARTER: [f64; 2] = [std::f64::consts::FRAC_PI_2, 6.123233995736766e-17];

/// A polynomial with these coefficients, the constant one first.
fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

/// The sine of an angle from 0 to π / 2.
pub(super) fn sine(angle: f64) -> f64 {
    if angle > std::f64::consts::FRAC_PI_4 {
        // The difference is exact, as both numbers are within a factor of 2.
        return cosine_near_0([QUARTER[0] - angle, QUARTER[1]]);
    }
    let square = angle * angle;
    let rest = polynomial(
        square,
        [
            -1.66666666666666324348e-01,
            8.33333333332248946124e-03,
            -1.98412698298579493134e-04,
            2.75573137070700676789e-06,
            -2.50507602534068634195e-08,
            1.58969099521155010221e-10,
        ],
    );
    angle + square * angle * rest
}

/// The cosine of an angle up to π / 4, given as the sum of two numbers of which the second is far smaller.
fn cosine_near_0([angle, more]: [f64; 2]) -> f64 {
    let square = angle * angle;
    let rest = square
        * polynomial(
            square,
            [
                4.16666666666666019037e-02,
                -1.38888888888741095749e-03,
                2.48015872894767294178e-05,
                -2.75573143513906633035e-07,
                2.08757232129817482790e-09,
                -1.13596475577881948265e-11,
            ],
        );
    let half = 0.5 * square;
    let first = 1.0 - half;
    first + (((1.0 - first) - half) + (square * rest - angle * more))
}

/// The arc cosine of a number from 0 to 1.
pub(super) fn arc_cosine(cosine: f64) -> f64 {
    if cosine < 0.5 {
        return QUARTER[0] - (cosine - (QUARTER[1] - cosine * arc_sine_rest(cosine * cosine)));
    }
    // acos x = 2 asin √((1 - x) / 2).
    let square = (1.0 - cosine) * 0.5;
    let root = square.sqrt();
    if root == 0.0 {
        return 0.0;
    }
    // The upper half of the bits of the root, whose square is exact, and what the root lacks of it.
    let upper = f64::from_bits(root.to_bits() & !0xffff_ffff);
    let lower = (square - upper * upper) / (root + upper);
    2.0 * (upper + (arc_sine_rest(square) * root + lower))
}

/// (asin x - x) / x for x up to 1/2, given its square.
fn arc_sine_rest(square: f64) -> f64 {
    let p = polynomial(
        square,
        [
            1.66666666666666657415e-01,
            -3.25565818622400915405e-01,
            2.01212532134862925881e-01,
            -4.00555345006794114027e-02,
            7.91534994289814532176e-04,
            3.47933107596021167570e-05,
        ],
    );
    let q = polynomial(
        square,
        [
            1.0,
            -2.40339491173441421878e+00,
            2.02094576023350569471e+00,
            -6.88283971605453293030e-01,
            7.70381505559019352791e-02,
        ],
    );
    square * p / q
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    /// Distance of two numbers from 0 on in units in the last place.
    fn units(a: f64, b: f64) -> u64 {
        a.to_bits().abs_diff(b.to_bits())
    }

    /// Numbers from 0 to 1: evenly spread, near 0, and near 1.
    fn parts() -> impl Iterator<Item = f64> {
        let mut rng = Rng::new(11);
        let random = (0..if cfg!(miri) { 100 } else { 30_000 }).flat_map(move |_| {
            let x = rng.below(1 << 53) as f64 / (1u64 << 53) as f64;
            [x, x * f64::exp2(-(rng.below(60) as f64)), 1.0 - x * f64::exp2(-(rng.below(53) as f64))]
        });
        [0.0, 0.25, 0.5, 0.5f64.next_down(), 0.5f64.next_up(), 1.0, 1.0f64.next_down()]
            .into_iter()
            .chain(random)
    }

    #[test]
    fn sines_are_those_of_the_platform_to_the_last_bit() {
        for angle in parts().map(|x| x * std::f64::consts::FRAC_PI_2) {
            assert!(units(sine(angle), angle.sin()) <= 1, "{angle:e}: {:e}, {:e}", sine(angle), angle.sin());
        }
        assert_eq!((sine(0.0), sine(std::f64::consts::FRAC_PI_2)), (0.0, 1.0));
    }

    #[test]
    fn arc_cosines_are_those_of_the_platform_to_the_last_bit() {
        for x in parts() {
            let (ours, expected) = (arc_cosine(x), x.acos());
            assert!(units(ours, expected) <= 1, "{x:e}: {ours:e}, {expected:e}");
        }
        assert_eq!((arc_cosine(1.0), arc_cosine(0.0)), (0.0, std::f64::consts::FRAC_PI_2));
    }
}
