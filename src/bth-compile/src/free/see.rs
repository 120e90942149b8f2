//! What a start triangle may see of the children of a node.

use super::frame::{BinSet, COLUMNS, bins};
use super::start::Start;
use super::tree::Node;
use bth::simd::{LANES, Simd};
use bth_format::layout::FREE_SIDE;

/// Relative bound of rounding errors: 16 units, for eight roundings of coordinates.
pub(super) const ERROR: f32 = 1.0 / (1 << 20) as f32;
/// Boxes and triangles whose size, relative to their distance, is at most this block the bins in
/// which they may be seen, without proof that rays hit them: six degrees.
pub(super) const SMALL: f32 = 1.0 / 10.0;
/// The same as [`SMALL`] where only sectors are decided, which are wider than bins.
pub(super) const SMALL_FOR_SECTORS: f32 = 1.0 / 6.0;

/// What may be seen of children.
pub(super) struct SeenChildren {
    /// Lower bounds of the squared distances.
    pub(super) squared_gap: [f32; LANES],
    /// Bits of the children in any bins.
    pub(super) lanes: u32,
    /// Bits of those that are [`SMALL`].
    pub(super) small: u32,
    /// Bytes: first column, column after the last, and the same for rows.
    range: [u32; LANES],
}

impl SeenChildren {
    /// The bins in which a child may be seen, which is one of `lanes`.
    #[inline(always)]
    pub(super) fn bins(&self, lane: usize) -> BinSet {
        bins_of(self.range[lane])
    }
}

/// The bins of a range of columns and one of rows, as [`SeenChildren`] stores them.
#[inline(always)]
pub(super) fn bins_of(range: u32) -> BinSet {
    let [first, end, first_row, end_row] = range.to_le_bytes();
    bins([first.into(), end.into()], [first_row.into(), end_row.into()])
}

#[inline(always)]
pub(super) fn dot<S: Simd>(s: S, a: &[f32; 3], b: &[S::F; 3]) -> S::F {
    let [x, y, z] = [s.mul(s.splat(a[0]), b[0]), s.mul(s.splat(a[1]), b[1]), s.mul(s.splat(a[2]), b[2])];
    s.add(s.add(x, y), z)
}

/// Sum of the absolute values.
#[inline(always)]
pub(super) fn sum_abs<S: Simd>(s: S, a: &[S::F; 3]) -> S::F {
    s.add(s.add(s.abs(a[0]), s.abs(a[1])), s.abs(a[2]))
}

/// Sum of the squares of distances of intervals from 0.
#[inline(always)]
pub(super) fn squared_gap<S: Simd>(s: S, ranges: &[[S::F; 2]; 3]) -> S::F {
    let zero = s.splat(0.0);
    let mut sum = zero;
    for [least, most] in ranges {
        let gap = s.max(s.max(*least, s.sub(zero, *most)), zero);
        sum = s.add(sum, s.mul(gap, gap));
    }
    sum
}

/// What a start triangle may see of the boxes of a node. There are no fused operations, so that all
/// instruction sets agree.
#[inline(always)]
pub(super) fn see<S: Simd>(s: S, start: &Start, node: &Node) -> SeenChildren {
    let zero = s.splat(0.0);
    let half = s.splat(0.5);
    // Middles, relative to the first corner, and halves of the sides.
    let (mut middle, mut side) = ([zero; 3], [zero; 3]);
    for k in 0..3 {
        let origin = s.splat(start.corners[0][k]);
        let (lower, upper) = (s.sub(s.load(&node.lower[k]), origin), s.sub(s.load(&node.upper[k]), origin));
        middle[k] = s.mul(half, s.add(lower, upper));
        side[k] = s.mul(half, s.sub(upper, lower));
    }
    let size = s.add(sum_abs(s, &middle), s.add(s.add(side[0], side[1]), side[2]));
    let slack = s.add(s.mul(size, s.splat(ERROR)), s.splat(f32::MIN_POSITIVE));
    // Smallest and largest coordinates along an axis, relative to points of the start triangle.
    let mut ranges = [[zero; 2]; 3];
    for k in 0..3 {
        let axis = &start.axes[k];
        let at = dot(s, axis, &middle);
        let reach = dot(s, &[axis[0].abs(), axis[1].abs(), axis[2].abs()], &side);
        let reach = s.add(reach, slack);
        let [least, most] = if k < 2 { start.extent[k] } else { [0.0; 2] };
        ranges[k] = [s.sub(s.sub(at, reach), s.splat(most)), s.sub(s.add(at, reach), s.splat(least))];
    }
    let gap = squared_gap(s, &ranges);
    let diagonal = s.add(s.add(s.mul(side[0], side[0]), s.mul(side[1], side[1])), s.mul(side[2], side[2]));
    let small = s.le(diagonal, s.mul(gap, s.splat(start.small * start.small)));
    let (range, seen) = columns_and_rows(s, &ranges);
    let mut out = SeenChildren {
        squared_gap: [0.0; LANES],
        lanes: s.mask_bits(s.and(seen, s.lt(zero, ranges[2][1]))) & node.children,
        small: s.mask_bits(small),
        range: [0; LANES],
    };
    s.store(gap, &mut out.squared_gap);
    s.store_u(range, &mut out.range);
    out
}

/// What divisors are raised to, so that quotients are numbers. It has no unit: a lower bound of
/// heights, relative to a frame's size, at which all columns are seen.
const FLOOR: f32 = 1e-30;

/// Columns and rows in which points with coordinates in ranges may be seen, as [`SeenChildren`]
/// stores them, and where there are any.
#[inline(always)]
pub(super) fn columns_and_rows<S: Simd>(s: S, ranges: &[[S::F; 2]; 3]) -> (S::U, S::M) {
    let zero_u = s.splat_u(0);
    let floor = s.splat(FLOOR);
    let near = s.div(s.splat(1.0), s.max(ranges[2][0], floor));
    let far = s.div(s.splat(1.0), s.max(ranges[2][1], floor));
    let columns = &*COLUMNS;
    let mut counts = [zero_u; 4];
    for k in 0..2 {
        let [least, most] = ranges[k];
        let least = s.min(s.mul(least, near), s.mul(least, far));
        let most = s.max(s.mul(most, near), s.mul(most, far));
        for i in 0..FREE_SIDE {
            let before = s.lt(s.splat(columns.greatest[i]), least);
            counts[2 * k] = s.add_where(counts[2 * k], before, s.splat_u(1));
            let until = s.le(s.splat(columns.least[i]), most);
            counts[2 * k + 1] = s.add_where(counts[2 * k + 1], until, s.splat_u(1));
        }
    }
    let seen = s.and(s.lt_u(counts[0], counts[1]), s.lt_u(counts[2], counts[3]));
    let columns = s.or_u(counts[0], s.shl_u::<8>(counts[1]));
    let rows = s.or_u(counts[2], s.shl_u::<8>(counts[3]));
    (s.or_u(columns, s.shl_u::<16>(rows)), seen)
}
