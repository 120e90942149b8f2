//! Small functions of numbers and of vectors with three components, of one triangle or in lanes.

use crate::simd::{Lanewise, Simd};

/// Converts to f64, which is exact.
#[inline(always)]
pub(crate) fn wide(v: [f32; 3]) -> [f64; 3] {
    v.map(f64::from)
}

/// The smaller of two numbers that are not NaN. This comparison compiles to a single vector
/// instruction.
#[inline(always)]
pub(crate) fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers; see [`lesser`].
#[inline(always)]
pub(crate) fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The largest |component| of a vector.
#[inline(always)]
pub(crate) fn max_norm([x, y, z]: [f64; 3]) -> f64 {
    greater(greater(x.abs(), y.abs()), z.abs())
}

#[inline(always)]
pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The scalar product, rounded.
#[inline(always)]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product, rounded.
#[inline(always)]
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The scalar product in lanes.
#[inline(always)]
pub(crate) fn dot_lanes<S: Lanewise>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.fma(a[2], b[2], s.fma(a[1], b[1], s.mul(a[0], b[0])))
}

/// Broadcasts three numbers.
#[inline(always)]
pub(crate) fn splat3<S: Lanewise>(s: S, [x, y, z]: [f32; 3]) -> [S::F; 3] {
    [s.splat(x), s.splat(y), s.splat(z)]
}

/// Three rows of lanes.
#[inline(always)]
pub(crate) fn load3<S: Lanewise>(s: S, rows: &[[f32; crate::simd::LANES]; 3]) -> [S::F; 3] {
    [s.load(&rows[0]), s.load(&rows[1]), s.load(&rows[2])]
}

/// [`Simd::pick`] of three vectors.
#[inline(always)]
pub(crate) fn pick3<S: Simd>(p: S::Piece, [x, y, z]: &[S::F; 3]) -> [<S::Piece as Lanewise>::F; 3] {
    [S::pick(p, x), S::pick(p, y), S::pick(p, z)]
}

/// [`Simd::put`] of three vectors.
#[inline(always)]
pub(crate) fn put3<S: Simd>(p: S::Piece, to: &mut [S::F; 3], from: [<S::Piece as Lanewise>::F; 3]) {
    for k in 0..3 {
        S::put(p, &mut to[k], from[k]);
    }
}
