//! On which side rays leave the triangles on which they start, and the bins of their directions, in
//! f32.

use crate::intersect::vector::dot_lanes;
use crate::simd::{LANES, Lanewise};
use bth_format::layout::{FREE_BORDERS, FREE_SIDE, FREE_STEEPEST};

/// Directions are looked up whose largest component in absolute value is between these, so that no
/// product underflows or overflows.
pub(super) const DIRECTIONS: [f32; 2] = [1.0 / (1 << 20) as f32, (1 << 20) as f32];
/// Relative slack of distances, for the rounding of t and of what is computed here.
pub(super) const SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Column of directions that are too steep.
pub(super) const NO_COLUMN: u32 = LANES as u32 - 1;
/// Bound of the loss where up to eight products underflow, also if the caller has denormal numbers
/// flushed to zero.
const UNDERFLOW: f32 = 8.0 * f32::MIN_POSITIVE;
/// Unit of rounding.
const U: f32 = f32::EPSILON / 2.0;

/// What follows from the triangles on which the rays of a piece start.
pub(super) struct Leaving<S: Lanewise> {
    /// Bits of the rays that certainly leave to the front of the triangle, and to its back.
    pub(super) front: u32,
    pub(super) back: u32,
    /// The columns and the rows of the directions.
    pub(super) columns: [S::U; 2],
}

impl<S: Lanewise> Leaving<S> {
    /// For rays with these directions, and triangles whose corners `corner` loads, given corner and
    /// axis.
    ///
    /// Errors, in units of rounding u, where no component of the edges e and f is greater than
    /// `far` and `size` is the sum of the direction's: a component of e×f is off by 4.1u of its
    /// terms, 8.2u·far², and the product with d has three more roundings of at most 2·far²·size:
    /// 17u.
    #[inline(always)]
    pub(super) fn new(s: S, corner: impl Fn(usize, usize) -> S::F, d: [S::F; 3]) -> Self {
        let zero = s.splat(0.0);
        let (mut e, mut f, mut far) = ([zero; 3], [zero; 3], zero);
        for k in 0..3 {
            let first = corner(0, k);
            e[k] = s.sub(corner(1, k), first);
            f[k] = s.sub(corner(2, k), first);
            far = s.max(s.max_abs(e[k], f[k]), far);
        }
        let sizes = [s.abs(d[0]), s.abs(d[1]), s.abs(d[2])];
        let size = s.add(s.add(sizes[0], sizes[1]), sizes[2]);
        let normal = cross(s, e, f);
        let height = dot_lanes(s, d, normal);
        let one = s.splat(1.0);
        let underflow = s.mul(s.add(s.add(size, far), one), s.splat(UNDERFLOW));
        let error = s.fma(s.mul(s.mul(far, far), size), s.splat(32.0 * U), underflow);
        let greatest = s.max(s.max(sizes[0], sizes[1]), sizes[2]);
        let is_usual = s.and(s.lt(s.splat(DIRECTIONS[0]), greatest), s.lt(greatest, s.splat(DIRECTIONS[1])));
        Leaving {
            front: s.mask_bits(s.and(is_usual, s.lt(error, height))),
            back: s.mask_bits(s.and(is_usual, s.lt(error, s.sub(zero, height)))),
            columns: columns(s, [e, normal], d, height),
        }
    }
}

#[inline(always)]
fn cross<S: Lanewise>(s: S, a: [S::F; 3], b: [S::F; 3]) -> [S::F; 3] {
    [
        s.fnma(a[2], b[1], s.mul(a[1], b[2])),
        s.fnma(a[0], b[2], s.mul(a[2], b[0])),
        s.fnma(a[1], b[0], s.mul(a[0], b[1])),
    ]
}

/// The columns and rows of the bins of directions d ([`bth_format::layout::free_bin`]), or
/// [`NO_COLUMN`] for both, given the first edge, the normal and their product with d.
///
/// The errors of the axes are 5 units of the lengths of the edges; the errors of their products
/// with a direction are a few units more: relative to the normal, which is at least 1/128 of the
/// product of the edges, less than 2^-13, a sixteenth of the margin. For edges and directions in
/// their ranges nothing overflows, and what underflows is less than that.
#[inline(always)]
fn columns<S: Lanewise>(s: S, [e, normal]: [[S::F; 3]; 2], d: [S::F; 3], height: S::F) -> [S::U; 2] {
    let per_height = s.div(s.splat(1.0), height);
    let per_square = s.div(s.splat(1.0), dot_lanes(s, e, e));
    let x = s.mul(dot_lanes(s, d, e), per_height);
    let y = s.mul(dot_lanes(s, d, cross(s, normal, e)), per_height);
    // Squares of the slopes. Signs are taken from the components, not from the slopes, which are
    // negated on the back.
    let x_square = s.mul(s.mul(s.mul(x, x), per_square), dot_lanes(s, normal, normal));
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

/// Square of the largest slope.
const STEEPEST: f32 = (FREE_STEEPEST * FREE_STEEPEST) as f32;

/// a ± b, the latter where the mask is set.
#[inline(always)]
fn add_signed<S: Lanewise>(s: S, a: S::U, negative: S::M, b: S::U) -> S::U {
    let ones = s.select_u(negative, s.splat_u(u32::MAX), s.splat_u(0));
    s.add_u(a, s.add_where(s.xor_u(b, ones), negative, s.splat_u(1)))
}
