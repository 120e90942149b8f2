//! The slow and obvious truth: every triangle against the ray, in rational arithmetic.
//!
//! Triangles are closed; a ray that lies in the plane of a triangle misses it; t is the exact
//! quotient. An f64 filter only skips triangles that the line misses by far more than rounding.

use bth::rays::Ray;
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};

type Point = [BigInt; 3];

/// An exact hit.
#[derive(Clone, Debug)]
pub struct Truth {
    /// t of the nearest hit.
    pub t: BigRational,
    /// All triangles that are hit at exactly this t, ascending.
    pub triangles: Vec<u32>,
}

impl Truth {
    /// t rounded to f64.
    pub fn t_f64(&self) -> f64 {
        to_f64(&self.t)
    }
}

/// An f32 as an integer, in units of the least positive f32.
fn integer(x: f32) -> BigInt {
    assert!(x.is_finite());
    let bits = x.to_bits();
    let (exponent, fraction) = ((bits >> 23) & 0xff, bits & 0x7f_ffff);
    let magnitude = match exponent {
        0 => BigInt::from(fraction),
        e => BigInt::from(fraction | 0x80_0000) << (e - 1),
    };
    if x.is_sign_negative() { -magnitude } else { magnitude }
}

fn point(p: [f32; 3]) -> Point {
    p.map(integer)
}

fn sub(a: &Point, b: &Point) -> Point {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

fn determinant(a: &Point, b: &Point, c: &Point) -> BigInt {
    let minor = |i: usize, j: usize| &b[i] * &c[j] - &b[j] * &c[i];
    &a[0] * minor(1, 2) + &a[1] * minor(2, 0) + &a[2] * minor(0, 1)
}

fn clearly_missed(ray: &Ray, corners: [[f32; 3]; 3]) -> bool {
    let o = ray.origin.map(f64::from);
    let d = ray.direction.map(f64::from);
    let from = corners.map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - o[k]));
    let mut signs = (false, false);
    for (p, q) in [(0, 1), (1, 2), (2, 0)] {
        let (mut value, mut size) = (0.0, 0.0);
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            let (x, y) = (from[p][j] * from[q][k], from[p][k] * from[q][j]);
            value += d[i] * (x - y);
            size += d[i].abs() * (x.abs() + y.abs());
        }
        if value > 1e-13 * size {
            signs.0 = true;
        } else if value < -1e-13 * size {
            signs.1 = true;
        }
    }
    signs == (true, true)
}

/// t at which the line of a ray meets a closed triangle.
pub fn crossing(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<BigRational> {
    if clearly_missed(ray, corners) {
        return None;
    }
    let (o, d) = (point(ray.origin), point(ray.direction));
    let [a, b, c] = corners.map(|p| sub(&point(p), &o));
    let sides = [determinant(&d, &a, &b), determinant(&d, &b, &c), determinant(&d, &c, &a)];
    let (positive, negative) = (sides.iter().any(|s| s.is_positive()), sides.iter().any(|s| s.is_negative()));
    if positive == negative {
        return None;
    }
    let whole: BigInt = sides.into_iter().sum();
    debug_assert!(!whole.is_zero());
    Some(BigRational::new(determinant(&a, &b, &c), whole))
}

/// The nearest exact hit whose t, rounded to f32 as it is reported, lies within the ray's range.
pub fn nearest(corners: &[[[f32; 3]; 3]], ray: &Ray) -> Option<Truth> {
    let mut best: Option<Truth> = None;
    for (id, &triangle) in corners.iter().enumerate() {
        let Some(t) = crossing(ray, triangle) else { continue };
        let reported = to_f64(&t) as f32;
        if !(ray.tmin <= reported && reported <= ray.tmax && reported < f32::INFINITY) {
            continue;
        }
        match &mut best {
            Some(b) if t > b.t => {}
            Some(b) if t == b.t => b.triangles.push(id as u32),
            _ => best = Some(Truth { t, triangles: vec![id as u32] }),
        }
    }
    best
}

/// A t rounded to f64.
pub fn to_f64(t: &BigRational) -> f64 {
    t.to_f64().expect("t of f32 input is within the range of f64")
}
