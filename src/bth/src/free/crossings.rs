//! Where the lines of rays cross the triangles on which they start, and the bins of their directions, in f32.

use crate::simd::{LANES, Lanewise};
use bth_format::layout::{FREE_BORDERS, FREE_SIDE, FREE_STEEPEST};

/// Directions are looked up whose greatest component in absolute value is between these, so that no product underflows or overflows.
pub(super) const DIRECTIONS: [f32; 2] = [1.0 / (1 << 20) as f32, (1 << 20) as f32];
/// Slack of `tmin` beside that which is relative to it. Any that is at least `f32::MIN_POSITIVE` is correct; the product of this one with
/// an area is rarely denormal, where `tmin` is 0, which would take Intel processors hundreds of cycles for every sixteen rays.
const LEAST_T: f32 = 1.0 / (1u128 << 80) as f32;
/// Relative slack of where ranges begin, for the rounding of t and of what is computed here.
pub(super) const SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Column of directions that are too steep.
pub(super) const NO_COLUMN: u32 = LANES as u32 - 1;
/// Unit of rounding.
const U: f32 = f32::EPSILON / 2.0;

/// What follows from the triangles of the rays of a piece.
pub(super) struct Crossings<S: Lanewise> {
    /// Bits of the rays whose line certainly crosses the triangle before `tmin` to its front, and to its back.
    pub(super) front: u32,
    pub(super) back: u32,
    /// Lower bounds of t there.
    pub(super) start: S::F,
    /// The columns and the rows of the directions.
    pub(super) columns: [S::U; 2],
}

impl<S: Lanewise> Crossings<S> {
    /// The crossings of rays, whose floats are `fields`, with triangles, whose corners are by corner and axis.
    ///
    /// Derivation: as in the f64 decision about one ray ([`super::single`]), whose bounds these are with the unit of f32; terms with
    /// `MIN_POSITIVE` bound what underflows. Triangles without an area are not certainly crossed, whatever the rounding errors.
    #[inline(always)]
    pub(super) fn new(s: S, corners: &[[[f32; LANES]; 3]; 3], fields: [S::F; 8]) -> Self {
        let [ox, oy, oz, tmin, dx, dy, dz, _] = fields;
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let zero = s.splat(0.0);
        let mut p = [[zero; 3]; 3];
        let mut r = [[zero; 3]; 3];
        let mut far = zero;
        for corner in 0..3 {
            for k in 0..3 {
                p[corner][k] = s.load(&corners[corner][k]);
                r[corner][k] = s.sub(p[corner][k], o[k]);
                far = s.max_abs(far, r[corner][k]);
            }
        }
        let size = s.add(s.add(s.abs(dx), s.abs(dy)), s.abs(dz));
        let least = s.splat(f32::MIN_POSITIVE);
        let square = s.mul(far, far);
        // One is added before products with `least`, which would be denormal.
        let one = s.splat(1.0);
        let side_error = s.fma(s.mul(square, size), s.splat(20.0 * U), s.mul(s.add(size, one), least));
        let normal = cross(s, r[1], r[2]);
        let a = dot(s, d, normal);
        let b = dot(s, d, cross(s, r[2], r[0]));
        let c = dot(s, d, cross(s, r[0], r[1]));
        let above = s.and(s.and(s.lt(side_error, a), s.lt(side_error, b)), s.lt(side_error, c));
        let minus = s.sub(zero, side_error);
        let below = s.and(s.and(s.lt(a, minus), s.lt(b, minus)), s.lt(c, minus));

        let volume = dot(s, r[0], normal);
        let volume = s.select(above, volume, s.sub(zero, volume));
        let volume_error =
            s.fma(s.mul(square, far), s.splat(64.0 * U), s.mul(s.fma(far, s.splat(3.0), one), least));
        let sum = s.abs(s.add(s.add(a, b), c));
        let sum_error = s.fma(side_error, s.splat(4.0), s.mul(sum, s.splat(8.0 * U)));
        let first = s.sub(tmin, s.fma(s.abs(tmin), s.splat(SLACK), s.splat(LEAST_T)));
        let bound = s.sub(s.fnma(s.abs(first), sum_error, s.mul(first, sum)), least);
        let before = s.lt(s.add(volume, volume_error), bound);

        let least_sum = s.sub(sum, sum_error);
        let start = s.div(s.min(s.sub(volume, volume_error), zero), least_sum);
        let greatest = s.max_abs(s.max_abs(dx, dy), dz);
        let is_usual = s.and(s.lt(s.splat(DIRECTIONS[0]), greatest), s.lt(greatest, s.splat(DIRECTIONS[1])));
        let usable = s.and(s.and(s.lt(zero, least_sum), before), is_usual);
        Crossings {
            front: s.mask_bits(s.and(above, usable)),
            back: s.mask_bits(s.and(below, usable)),
            start,
            columns: columns(s, &p, d),
        }
    }
}

#[inline(always)]
fn dot<S: Lanewise>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.fma(a[2], b[2], s.fma(a[1], b[1], s.mul(a[0], b[0])))
}

#[inline(always)]
fn cross<S: Lanewise>(s: S, a: [S::F; 3], b: [S::F; 3]) -> [S::F; 3] {
    [
        s.fnma(a[2], b[1], s.mul(a[1], b[2])),
        s.fnma(a[0], b[2], s.mul(a[2], b[0])),
        s.fnma(a[1], b[0], s.mul(a[0], b[1])),
    ]
}

/// The columns and rows of the bins of directions ([`bth_format::layout::free_bin`]), or [`NO_COLUMN`] for both.
///
/// The errors of the axes are 5 units of the lengths of the edges, those of their products with a direction a few more: relative to
/// the normal, which is at least 1/128 of the product of the edges, less than 2^-13, a sixteenth of the margin. For edges and
/// directions in their ranges nothing overflows, and what underflows is less than that.
#[inline(always)]
fn columns<S: Lanewise>(s: S, corners: &[[S::F; 3]; 3], d: [S::F; 3]) -> [S::U; 2] {
    let zero = s.splat(0.0);
    let (mut e, mut f) = ([zero; 3], [zero; 3]);
    for k in 0..3 {
        e[k] = s.sub(corners[1][k], corners[0][k]);
        f[k] = s.sub(corners[2][k], corners[0][k]);
    }
    let normal = cross(s, e, f);
    let per_height = s.div(s.splat(1.0), dot(s, d, normal));
    let per_square = s.div(s.splat(1.0), dot(s, e, e));
    let x = s.mul(dot(s, d, e), per_height);
    let y = s.mul(dot(s, d, cross(s, normal, e)), per_height);
    // Squares of the slopes. Signs are those of the components, not of the slopes, which are negated on the back.
    let x_square = s.mul(s.mul(s.mul(x, x), per_square), dot(s, normal, normal));
    let y_square = s.mul(s.mul(y, y), per_square);
    let upwards = s.lt(zero, per_height);
    let flat = s.and(s.lt(x_square, s.splat(STEEPEST)), s.lt(y_square, s.splat(STEEPEST)));
    let none = s.splat_u(NO_COLUMN);
    [
        s.select_u(flat, column(s, (x, x_square), upwards), none),
        s.select_u(flat, column(s, (y, y_square), upwards), none),
    ]
}

/// The column of a direction, given its slope along the axis and the square of that.
#[inline(always)]
fn column<S: Lanewise>(s: S, (slope, square): (S::F, S::F), upwards: S::M) -> S::U {
    let zero = s.splat(0.0);
    let mut beyond = s.splat_u(0);
    for border in FREE_BORDERS {
        beyond = s.add_where(beyond, s.lt(s.splat(border as f32), square), s.splat_u(1));
    }
    let negative = s.or(s.and(upwards, s.lt(slope, zero)), s.and_not(s.lt(zero, slope), upwards));
    add_signed(s, s.splat_u((FREE_SIDE / 2) as u32), negative, beyond)
}

/// Square of the greatest slope.
const STEEPEST: f32 = (FREE_STEEPEST * FREE_STEEPEST) as f32;

/// a ± b, the latter where the mask is set.
#[inline(always)]
fn add_signed<S: Lanewise>(s: S, a: S::U, negative: S::M, b: S::U) -> S::U {
    let ones = s.select_u(negative, s.splat_u(u32::MAX), s.splat_u(0));
    s.add_u(a, s.add_where(s.xor_u(b, ones), negative, s.splat_u(1)))
}
