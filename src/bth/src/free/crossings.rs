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
/// What is lost where the products of a term underflow, also if the caller has denormal numbers flushed to zero: that of eight.
const UNDERFLOW: f32 = 8.0 * f32::MIN_POSITIVE;
/// The bit of the sign of an f32.
const SIGN: u32 = 1 << 31;
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
    /// With the first corner r relative to the origin, the edges e and f at it and the moment m = r×d, the line of direction d crosses the plane
    /// at t = r·(e×f) / d·(e×f), and passes each edge on the side that the sign of one of b = f·m, c = -e·m and a = d·(e×f) - b - c says. These
    /// have the same sign if it crosses the triangle.
    ///
    /// Errors, in units of rounding u, where no component of r, e and f is greater than `far` and `size` is the sum of those of d: r, e and f
    /// are rounded once. A component of m is off by 3.1u of its terms, so b and c by 3.1 + 1 + 4 of theirs, which are at most 2·far²·size
    /// together: 17u·far²·size. A component of e×f is off by 4.1u of its terms, 8.2u·far², so d·(e×f) by 17u·far²·size, too, and a, for two more
    /// roundings of at most 4 and 6 far²·size, by 61u·far²·size. The volume is off by (25 + 30)u·far³. Bounds of 64u hold
    /// the roundings of products with these, too, and terms with `UNDERFLOW` what underflows. Triangles without an area are not certainly crossed, whatever the rounding errors.
    #[inline(always)]
    pub(super) fn new(s: S, corners: &[[[f32; LANES]; 3]; 3], fields: [S::F; 8]) -> Self {
        let [ox, oy, oz, tmin, dx, dy, dz, _] = fields;
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let zero = s.splat(0.0);
        let (mut r, mut e, mut f, mut far) = ([zero; 3], [zero; 3], [zero; 3], zero);
        for k in 0..3 {
            let first = s.load(&corners[0][k]);
            r[k] = s.sub(first, o[k]);
            e[k] = s.sub(s.load(&corners[1][k]), first);
            f[k] = s.sub(s.load(&corners[2][k]), first);
            far = s.max_abs(s.max_abs(far, r[k]), s.max_abs(e[k], f[k]));
        }
        let sizes = [s.abs(dx), s.abs(dy), s.abs(dz)];
        let size = s.add(s.add(sizes[0], sizes[1]), sizes[2]);
        let normal = cross(s, e, f);
        let height = dot(s, d, normal);
        let moment = cross(s, r, d);
        let b = dot(s, f, moment);
        let minus_c = dot(s, e, moment);
        let a = s.add(s.sub(height, b), minus_c);

        let least = s.splat(UNDERFLOW);
        let square = s.mul(far, far);
        // One is added before products with `least`, which would be denormal.
        let one = s.splat(1.0);
        let underflow = s.mul(s.add(s.add(size, far), one), least);
        let side_error = s.fma(s.mul(square, size), s.splat(64.0 * U), underflow);
        let sign = s.and_u(s.bits(height), s.splat_u(SIGN));
        let opposite = s.xor_u(sign, s.splat_u(SIGN));
        let others = s.min(negate(s, b, sign), negate(s, minus_c, opposite));
        // `a` is NaN where any of the three is.
        let crosses = s.lt(side_error, s.min(others, negate(s, a, sign)));

        let volume = negate(s, dot(s, r, normal), sign);
        let volume_error =
            s.fma(s.mul(square, far), s.splat(64.0 * U), s.mul(s.fma(far, s.splat(3.0), one), least));
        let height_size = s.abs(height);
        let first = s.sub(tmin, s.fma(s.abs(tmin), s.splat(SLACK), s.splat(LEAST_T)));
        let bound = s.sub(s.fnma(s.abs(first), side_error, s.mul(first, height_size)), least);
        let before = s.lt(s.add(volume, volume_error), bound);

        let least_height = s.sub(height_size, side_error);
        let start = s.div(s.min(s.sub(volume, volume_error), zero), least_height);
        let greatest = s.max(s.max(sizes[0], sizes[1]), sizes[2]);
        let is_usual = s.and(s.lt(s.splat(DIRECTIONS[0]), greatest), s.lt(greatest, s.splat(DIRECTIONS[1])));
        let usable = s.and(s.and(s.lt(zero, least_height), before), s.and(is_usual, crosses));
        let upwards = s.lt(zero, height);
        Crossings {
            front: s.mask_bits(s.and(usable, upwards)),
            back: s.mask_bits(s.and_not(usable, upwards)),
            start,
            columns: columns(s, [e, normal], d, height),
        }
    }
}

/// The negative where the bit of the sign is set in `sign`, which has no other bits.
#[inline(always)]
fn negate<S: Lanewise>(s: S, a: S::F, sign: S::U) -> S::F {
    s.floats(s.xor_u(s.bits(a), sign))
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

/// The columns and rows of the bins of directions d ([`bth_format::layout::free_bin`]), or [`NO_COLUMN`] for both, given the first edge, the
/// normal and their product with d.
///
/// The errors of the axes are 5 units of the lengths of the edges, those of their products with a direction a few more: relative to
/// the normal, which is at least 1/128 of the product of the edges, less than 2^-13, a sixteenth of the margin. For edges and
/// directions in their ranges nothing overflows, and what underflows is less than that.
#[inline(always)]
fn columns<S: Lanewise>(s: S, [e, normal]: [[S::F; 3]; 2], d: [S::F; 3], height: S::F) -> [S::U; 2] {
    let per_height = s.div(s.splat(1.0), height);
    let per_square = s.div(s.splat(1.0), dot(s, e, e));
    let x = s.mul(dot(s, d, e), per_height);
    let y = s.mul(dot(s, d, cross(s, normal, e)), per_height);
    // Squares of the slopes. Signs are those of the components, not of the slopes, which are negated on the back.
    let x_square = s.mul(s.mul(s.mul(x, x), per_square), dot(s, normal, normal));
    let y_square = s.mul(s.mul(y, y), per_square);
    let upwards = s.lt(s.splat(0.0), height);
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
