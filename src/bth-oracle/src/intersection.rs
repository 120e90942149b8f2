//! The exact intersection of a line and a triangle.

use bth::rays::Ray;
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};

/// A point in integer coordinates, in a unit that the caller chooses.
pub(crate) type Point = [BigInt; 3];

/// Bounds the error of a determinant in f64 relative to the size of its products.
const ROUNDING: f64 = 1e-13;
/// The bound holds for sizes from here on: no product has underflowed.
const LEAST_SIZE: f64 = 1e-280;

/// The point at which a line hits a triangle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Intersection {
    /// Parameter of the point along the ray: origin + t * direction.
    pub t: BigRational,
    /// Barycentric weight of the second corner.
    pub u: BigRational,
    /// Barycentric weight of the third corner.
    pub v: BigRational,
}

/// A quotient rounded to the nearest f64.
pub fn to_f64(t: &BigRational) -> f64 {
    t.to_f64().expect("quotients of f32 input are within the range of f64")
}

/// A finite f32 as an integer, in units of the smallest positive f32, 2^-149.
pub(crate) fn integer(x: f32) -> BigInt {
    assert!(x.is_finite());
    let (exponent, fraction) = ((x.to_bits() >> 23) & 0xff, x.to_bits() & 0x7f_ffff);
    let magnitude = match exponent {
        0 => BigInt::from(fraction),
        e => BigInt::from(fraction | 0x80_0000) << (e - 1),
    };
    if x.is_sign_negative() { -magnitude } else { magnitude }
}

pub(crate) fn sub(a: &Point, b: &Point) -> Point {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

pub(crate) fn determinant(a: &Point, b: &Point, c: &Point) -> BigInt {
    let minor = |i: usize, j: usize| &b[i] * &c[j] - &b[j] * &c[i];
    &a[0] * minor(1, 2) + &a[1] * minor(2, 0) + &a[2] * minor(0, 1)
}

/// Returns true if a ray defines a line: its coordinates are finite and its direction is not zero.
pub(crate) fn has_line(ray: &Ray) -> bool {
    ray.origin.iter().chain(&ray.direction).all(|x| x.is_finite()) && ray.direction != [0.0; 3]
}

/// Returns true if a line certainly misses a triangle. The corners are relative to the origin of
/// the line; each coordinate has an error of at most 2^-52 times the sum of `magnitude` and itself.
pub(crate) fn certainly_missed(direction: [f64; 3], corners: [[f64; 3]; 3], magnitude: f64) -> bool {
    let (mut positive, mut negative) = (false, false);
    for (p, q) in [(0, 1), (1, 2), (2, 0)] {
        let (mut value, mut size) = (0.0, 0.0);
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            let (x, y) = (corners[p][j] * corners[q][k], corners[p][k] * corners[q][j]);
            let reach = |c: usize, axis: usize| corners[c][axis].abs() + magnitude;
            value += direction[i] * (x - y);
            size += direction[i].abs() * (reach(p, j) * reach(q, k) + reach(p, k) * reach(q, j));
        }
        if size > LEAST_SIZE {
            positive |= value > ROUNDING * size;
            negative |= value < -ROUNDING * size;
        }
    }
    positive && negative
}

/// The intersection of the line through `origin` along `direction` with a closed triangle; all in
/// the same unit.
pub(crate) fn intersect_exactly(
    origin: &Point,
    direction: &Point,
    corners: &[Point; 3],
) -> Option<Intersection> {
    let [a, b, c] = [0, 1, 2].map(|i| sub(&corners[i], origin));
    let sides =
        [determinant(direction, &b, &c), determinant(direction, &c, &a), determinant(direction, &a, &b)];
    let (positive, negative) = (sides.iter().any(Signed::is_positive), sides.iter().any(Signed::is_negative));
    // With both signs the line misses. With neither the line lies in the plane, or the triangle has
    // no area in the projection along it.
    if positive == negative {
        return None;
    }
    let whole: BigInt = sides.iter().sum();
    debug_assert!(!whole.is_zero());
    let [_, u, v] = sides;
    Some(Intersection {
        t: BigRational::new(determinant(&a, &b, &c), whole.clone()),
        u: BigRational::new(u, whole.clone()),
        v: BigRational::new(v, whole),
    })
}

/// The intersection of the whole line of a ray, in both directions and whatever its range, with a
/// closed triangle.
pub fn intersection(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<Intersection> {
    if !has_line(ray) {
        return None;
    }
    let from = corners.map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(ray.origin[k])));
    if certainly_missed(ray.direction.map(f64::from), from, 0.0) {
        return None;
    }
    intersect_exactly(&ray.origin.map(integer), &ray.direction.map(integer), &corners.map(|p| p.map(integer)))
}

/// Returns true if the direction of a ray and the normal (b-a)×(c-a) of a triangle point to
/// opposite sides, so that the ray comes from the side from which the corners appear
/// counter-clockwise. False if they are perpendicular.
pub fn is_front(ray: &Ray, corners: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.map(integer));
    let whole = determinant(&ray.direction.map(integer), &sub(&b, &a), &sub(&c, &a));
    whole.is_negative()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f32> {
        let bits = any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |x| x.is_finite());
        prop_oneof![
            (-3i32..4).prop_map(|x| x as f32),
            -1.0f32..1.0,
            bits,
            Just(f32::MAX),
            Just(1e-45),
            Just(-0.0)
        ]
    }

    fn ray() -> impl Strategy<Value = Ray> {
        let point = || prop::array::uniform3(number());
        (point(), point()).prop_map(|(origin, direction)| Ray {
            origin,
            tmin: 0.0,
            direction,
            tmax: f32::INFINITY,
        })
    }

    #[test]
    fn integers_are_the_numbers() {
        let power = |bits: u32| BigInt::from(1) << bits;
        assert_eq!(integer(f32::from_bits(1)), power(0));
        assert_eq!(integer(-f32::MIN_POSITIVE), -power(23));
        assert_eq!(integer(1.5), power(149) + power(148));
        assert_eq!(integer(f32::MAX), power(277) - power(253));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3000))]
        /// The filter never skips a triangle that the line hits.
        #[test]
        fn the_filter_changes_no_intersection(ray in ray(), corners in prop::array::uniform3(prop::array::uniform3(number()))) {
            prop_assume!(has_line(&ray));
            let exact = intersect_exactly(&ray.origin.map(integer), &ray.direction.map(integer), &corners.map(|p| p.map(integer)));
            prop_assert_eq!(intersection(&ray, corners), exact);
        }

        /// A ray aimed at a point of a triangle from outside its plane hits it with the t, u and v
        /// of that point.
        #[test]
        fn a_point_of_a_triangle_is_met_there(
            corners in prop::array::uniform3(prop::array::uniform3(-50i32..50)),
            weights in (0i32..9).prop_flat_map(|a| (Just(a), 0..9 - a)),
            origin in prop::array::uniform3(-50i32..50),
        ) {
            let (a, b) = weights;
            let c = 8 - a - b;
            let f = |p: [i32; 3]| p.map(|x| 8.0 * x as f32);
            let target = [0, 1, 2].map(|k| (a * corners[0][k] + b * corners[1][k] + c * corners[2][k]) as f32);
            let (origin, scaled) = (f(origin), corners.map(f));
            let direction = [0, 1, 2].map(|k| (target[k] - origin[k]) / 4.0);
            let ray = Ray::new(origin, direction);
            if let Some(found) = intersection(&ray, scaled) {
                let eighth = |n: i32| BigRational::new(n.into(), 8.into());
                prop_assert_eq!(found, Intersection { t: eighth(32), u: eighth(b), v: eighth(c) });
            } else {
                // There is no intersection only when the line lies in the plane or the triangle has
                // no area.
                let p = |q: [f32; 3]| sub(&q.map(integer), &origin.map(integer));
                let [x, y, z] = scaled.map(p);
                prop_assert!(determinant(&x, &y, &z).is_zero());
            }
        }
    }
}
