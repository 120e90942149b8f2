//! Finds the bins in which rays from a start triangle may hit the triangles of a block.

use super::frame::{ALL_COLUMNS, BinSet, COLUMNS, bins};
use super::see::{ERROR, bins_of, columns_and_rows, dot, squared_gap, sum_abs};
use super::start::{BY_BOTH, BY_COLUMN, BY_ROW, LINES, Line, Start};
use super::tree::Block;
use bth::simd::{LANES, Simd};
use bth_format::layout::FREE_SIDE;

/// Sixteen triangles as a start triangle sees them.
#[repr(align(64))]
pub(super) struct Met {
    /// Largest w, for each line of the start triangle, with which its plane holds the triangle on
    /// the lower side; -∞ if there is no such w.
    most: [[f32; LANES]; LINES],
    /// Normals of the triangles' planes, towards the side on which the whole start triangle lies,
    /// in its frame.
    normal: [[f32; LANES]; 3],
    /// What products of normals with directions must exceed to be certainly positive; infinite if
    /// the start triangle lies on both sides.
    least_product: [f32; LANES],
    /// Lower bounds of the squared distances.
    pub(super) squared_gap: [f32; LANES],
    /// Bits of the triangles that may have a point on the side from which rays start, and of those
    /// that certainly have.
    pub(super) above: u32,
    pub(super) certainly_above: u32,
    /// Bits of those that are [small](super::see::SMALL).
    small: u32,
}

/// The corners of sixteen triangles in the frame of the start triangle.
struct Corners<S: Simd, const TOUCHES: bool> {
    /// By corner and axis.
    at: [[S::F; 3]; 3],
    /// Bounds of the errors of coordinates, and sums of the absolute values of those from which
    /// they were computed.
    error: [S::F; 3],
    size: [S::F; 3],
    /// Where a corner is a corner of the start triangle, by both; nowhere without `TOUCHES`.
    shared: [[S::M; 3]; 3],
}

impl<S: Simd, const TOUCHES: bool> Corners<S, TOUCHES> {
    /// An error is at most 5 units of the size: one of the difference, one of the axis, three of
    /// the product and the sums. The bound is 16.
    #[inline(always)]
    fn new(s: S, start: &Start, block: &Block) -> Self {
        let zero = s.splat(0.0);
        let none = s.mask(0);
        let mut out =
            Corners { at: [[zero; 3]; 3], error: [zero; 3], size: [zero; 3], shared: [[none; 3]; 3] };
        for corner in 0..3 {
            let mut from = [zero; 3];
            let mut stored = [zero; 3];
            for k in 0..3 {
                stored[k] = s.load(&block.corner[corner][k]);
                from[k] = s.sub(stored[k], s.splat(start.corners[0][k]));
            }
            for k in 0..3 {
                out.at[corner][k] = dot(s, &start.axes[k], &from);
            }
            out.size[corner] = sum_abs(s, &from);
            out.error[corner] = s.add(s.mul(out.size[corner], s.splat(ERROR)), s.splat(f32::MIN_POSITIVE));
            for other in 0..if TOUCHES { 3 } else { 0 } {
                let mut equal = s.mask(0xffff);
                for k in 0..3 {
                    let coordinate = s.bits(s.splat(start.corners[other][k]));
                    equal = s.and(equal, s.eq_u(s.bits(stored[k]), coordinate));
                }
                out.shared[corner][other] = equal;
            }
        }
        out
    }

    /// Where a corner is one of the start triangle's that `on` names by bits.
    #[inline(always)]
    fn shared_with(&self, s: S, corner: usize, on: u8) -> S::M {
        let mut any = s.mask(0);
        for other in 0..if TOUCHES { 3 } else { 0 } {
            if on >> other & 1 == 1 {
                any = s.or(any, self.shared[corner][other]);
            }
        }
        any
    }
}

/// What a start triangle sees of the triangles of a block that may be seen in some `bins`.
/// `TOUCHES` if the block's box touches the start triangle, so that corners may be shared. There
/// are no fused operations, so that all instruction sets agree.
#[inline(always)]
pub(super) fn meet<S: Simd, const TOUCHES: bool>(s: S, start: &Start, block: &Block, bins: BinSet) -> Met {
    let corners = Corners::<S, TOUCHES>::new(s, start, block);
    let zero = s.splat(0.0);
    let mut met = Met {
        most: [[0.0; LANES]; LINES],
        normal: [[0.0; LANES]; 3],
        least_product: [0.0; LANES],
        squared_gap: [0.0; LANES],
        above: 0,
        certainly_above: 0,
        small: 0,
    };
    let (mut above, mut certainly) = (s.mask(0), s.mask(0));
    for corner in 0..3 {
        // Shared corners lie exactly in the plane.
        let shared = corners.shared_with(s, corner, 0b111);
        let (z, error) = (corners.at[corner][2], corners.error[corner]);
        above = s.or(above, s.and_not(s.lt(zero, s.add(z, error)), shared));
        certainly = s.or(certainly, s.and_not(s.lt(zero, s.sub(z, error)), shared));
    }
    met.above = s.mask_bits(above) & ((1 << block.count) - 1);
    met.certainly_above = s.mask_bits(certainly);
    if met.above == 0 {
        return met;
    }
    let ranges = distances(s, start, &corners, &mut met);
    // Triangles that touch the start triangle's box are seen in all bins.
    if !TOUCHES {
        met.above &= seen_in(s, bins, &ranges);
        if met.above == 0 {
            return met;
        }
    }
    let factors = Factors::new(s, &corners);
    for line in 0..LINES {
        s.store(factors.most(s, start, &corners, &start.lines[line]), &mut met.most[line]);
    }
    away(s, start, &corners, &mut met);
    met
}

/// Bits of the lanes whose points, with coordinates in ranges, may be seen in some bins.
#[inline(always)]
fn seen_in<S: Simd>(s: S, bins: BinSet, ranges: &[[S::F; 2]; 3]) -> u32 {
    let (range, seen) = columns_and_rows(s, ranges);
    let mut of = [0; LANES];
    s.store_u(range, &mut of);
    let (mut lanes, mut found) = (s.mask_bits(seen), 0);
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize % LANES;
        lanes &= lanes - 1;
        found |= u32::from(bins_of(of[lane]) & bins != 0) << lane;
    }
    found
}

/// Ranges of the coordinates of triangles relative to points of the start triangle. Stores
/// distances, and what is small for them.
#[inline(always)]
fn distances<S: Simd, const TOUCHES: bool>(
    s: S,
    start: &Start,
    corners: &Corners<S, TOUCHES>,
    met: &mut Met,
) -> [[S::F; 2]; 3] {
    let zero = s.splat(0.0);
    let half = s.splat(0.5);
    let error = s.max(s.max(corners.error[0], corners.error[1]), corners.error[2]);
    let mut ranges = [[zero; 2]; 3];
    let mut diagonal = zero;
    for k in 0..3 {
        let of = [corners.at[0][k], corners.at[1][k], corners.at[2][k]];
        let least = s.sub(s.min(s.min(of[0], of[1]), of[2]), error);
        let most = s.add(s.max(s.max(of[0], of[1]), of[2]), error);
        let side = s.mul(half, s.sub(most, least));
        diagonal = s.add(diagonal, s.mul(side, side));
        let [start_least, start_most] = if k < 2 { start.extent[k] } else { [0.0; 2] };
        ranges[k] = [s.sub(least, s.splat(start_most)), s.sub(most, s.splat(start_least))];
    }
    let gap = squared_gap(s, &ranges);
    s.store(gap, &mut met.squared_gap);
    met.small = s.mask_bits(s.le(diagonal, s.mul(gap, s.splat(start.small * start.small))));
    ranges
}

/// Factors of the heights of corners above a line in its plane, whose products bound w, by corner.
struct Factors<S: Simd> {
    /// Where the corner may lie above the start triangle's plane: the product is an upper bound,
    /// else a lower one.
    is_above: [S::M; 3],
    /// For corners that lie on the side of the start triangle, or on the other.
    inside: [S::F; 3],
    outside: [S::F; 3],
}

impl<S: Simd> Factors<S> {
    /// A corner at the height a above the line and z above the plane lies below a plane with w if
    /// `a + w z <= 0`. z lies between two bounds, so w <= -a / z or w >= -a / z with the bound that
    /// makes this harder.
    #[inline(always)]
    fn new<const TOUCHES: bool>(s: S, corners: &Corners<S, TOUCHES>) -> Self {
        let zero = s.splat(0.0);
        let one = s.splat(1.0);
        let tiny = s.splat(1.0 / (1u128 << 100) as f32);
        let minus_tiny = s.sub(zero, tiny);
        let mut out = Factors { is_above: [s.mask(0); 3], inside: [zero; 3], outside: [zero; 3] };
        for k in 0..3 {
            let (z, error) = (corners.at[k][2], corners.error[k]);
            let (low, high) = (s.sub(z, error), s.add(z, error));
            let above = s.lt(zero, high);
            // Quotients with what is nearly 0 are bounds that no w, or any w, observes.
            let by_high = s.div(one, s.select(above, s.max(high, tiny), s.min(high, minus_tiny)));
            let by_low = s.div(one, s.select(s.lt(zero, low), s.max(low, tiny), s.min(low, minus_tiny)));
            let never = s.select(above, s.splat(f32::INFINITY), s.splat(f32::NEG_INFINITY));
            let harder = s.select(above, by_low, by_high);
            let is_certain = s.or(s.and(above, s.lt(tiny, low)), s.and_not(s.lt(high, minus_tiny), above));
            out.is_above[k] = above;
            out.inside[k] = s.select(is_certain, harder, never);
            out.outside[k] = s.select(above, by_high, by_low);
        }
        out
    }

    /// Largest w with which the plane along a line holds triangles on the lower side; -∞ if there
    /// is no such w.
    ///
    /// The error of heights above the line is at most 18 units of the size of the corner and 2
    /// units of the size of the start triangle. The error of the quotients is 3 units of both. The
    /// bounds are 32 and 16.
    #[inline(always)]
    fn most<const TOUCHES: bool>(
        &self,
        s: S,
        start: &Start,
        corners: &Corners<S, TOUCHES>,
        line: &Line,
    ) -> S::F {
        let zero = s.splat(0.0);
        let infinite = s.splat(f32::INFINITY);
        let minus_infinite = s.splat(f32::NEG_INFINITY);
        let offset = s.splat(line.offset);
        let of_start = s.splat(start.size * ERROR + f32::MIN_POSITIVE);
        let (mut most, mut least) = (infinite, minus_infinite);
        for k in 0..3 {
            let [x, y, _] = corners.at[k];
            let along = s.add(s.mul(s.splat(line.inward[0]), x), s.mul(s.splat(line.inward[1]), y));
            let error = s.add(s.mul(corners.size[k], s.splat(2.0 * ERROR)), of_start);
            let height = s.add(s.sub(along, offset), error);
            let factor = s.select(s.le(height, zero), self.outside[k], self.inside[k]);
            let bound = s.sub(zero, s.mul(height, factor));
            // Corners that lie on the line bound nothing; other corners of the start triangle lie
            // above all planes.
            let on = corners.shared_with(s, k, line.on);
            let off = corners.shared_with(s, k, !line.on & 0b111);
            let upper = s.select(self.is_above[k], bound, infinite);
            let lower = s.select(self.is_above[k], minus_infinite, bound);
            most = s.min(most, s.select(off, minus_infinite, s.select(on, infinite, upper)));
            least = s.max(least, s.select(s.or(on, off), minus_infinite, lower));
        }
        s.select(s.le(least, most), most, minus_infinite)
    }
}

/// Planes of the triangles that hold the start triangle on one side: rays that leave it away from
/// them hit nothing there.
#[inline(always)]
fn away<S: Simd, const TOUCHES: bool>(s: S, start: &Start, corners: &Corners<S, TOUCHES>, met: &mut Met) {
    let zero = s.splat(0.0);
    let [mut e, mut f] = [[zero; 3]; 2];
    for k in 0..3 {
        e[k] = s.sub(corners.at[1][k], corners.at[0][k]);
        f[k] = s.sub(corners.at[2][k], corners.at[0][k]);
    }
    let mut normal = [zero; 3];
    for k in 0..3 {
        let [a, b] = [(k + 1) % 3, (k + 2) % 3];
        normal[k] = s.sub(s.mul(e[a], f[b]), s.mul(e[b], f[a]));
    }
    // Errors of the edges, of the components of the normal, and of the heights of the start
    // triangle's corners above the plane.
    let (e_size, f_size) = (sum_abs(s, &e), sum_abs(s, &f));
    let e_error = s.add(corners.error[0], corners.error[1]);
    let f_error = s.add(corners.error[0], corners.error[2]);
    let crossed = s.add(s.mul(e_size, f_error), s.mul(f_size, e_error));
    let rounded = s.add(s.mul(s.mul(e_size, f_size), s.splat(ERROR)), s.mul(e_error, f_error));
    let error = s.add(s.add(crossed, crossed), s.add(rounded, s.splat(f32::MIN_POSITIVE)));
    let size = sum_abs(s, &normal);
    let (mut positive, mut negative) = (s.mask(0xffff), s.mask(0xffff));
    for corner in 0..3 {
        let [x, y] = start.local[corner];
        let at = &corners.at[0];
        let from = [s.sub(s.splat(x), at[0]), s.sub(s.splat(y), at[1]), s.sub(zero, at[2])];
        let [a, b, c] = [s.mul(normal[0], from[0]), s.mul(normal[1], from[1]), s.mul(normal[2], from[2])];
        let height = s.add(s.add(a, b), c);
        let distance = sum_abs(s, &from);
        let of_start = s.splat(start.size * ERROR);
        let of_point = s.add(s.add(corners.error[0], of_start), s.mul(distance, s.splat(ERROR)));
        let slack = s.add(s.mul(error, distance), s.add(s.mul(size, of_point), s.mul(error, of_point)));
        let slack = s.add(slack, s.splat(f32::MIN_POSITIVE));
        // Corners of both triangles lie in both planes.
        let mut shared = s.mask(0);
        for other in 0..if TOUCHES { 3 } else { 0 } {
            shared = s.or(shared, corners.shared[other][corner]);
        }
        positive = s.and(positive, s.or(s.lt(slack, height), shared));
        negative = s.and(negative, s.or(s.lt(height, s.sub(zero, slack)), shared));
    }
    for k in 0..3 {
        s.store(s.select(positive, normal[k], s.sub(zero, normal[k])), &mut met.normal[k]);
    }
    // Slopes are at most 17.
    let least = s.add(s.mul(error, s.splat(40.0)), s.mul(size, s.splat(4.0 * ERROR)));
    let least = s.select(s.or(positive, negative), least, s.splat(f32::INFINITY));
    s.store(least, &mut met.least_product);
}

impl Met {
    /// Returns the bins of `of` in which rays may hit the triangle in a lane.
    #[inline(always)]
    pub(super) fn blocked<S: Simd>(&self, s: S, start: &Start, lane: usize, of: BinSet) -> BinSet {
        let columns = self.open(s, start, lane, BY_COLUMN, |line| &line.of_column);
        let rows = self.open(s, start, lane, BY_ROW, |line| &line.of_row);
        if columns == 0 || rows == 0 {
            return 0;
        }
        let range = |bits: u32| [bits.trailing_zeros() as usize, 32 - bits.leading_zeros() as usize];
        let of = of & bins(range(columns), range(rows));
        if of == 0 || self.small >> lane & 1 == 1 {
            return of;
        }
        let slopes = &*COLUMNS;
        let (least, greatest) = (s.load(&slopes.least), s.load(&slopes.greatest));
        let [nx, ny, nz] = [self.normal[0][lane], self.normal[1][lane], self.normal[2][lane]];
        let products = s.min(s.mul(s.splat(nx), least), s.mul(s.splat(nx), greatest));
        let least_product = s.splat(self.least_product[lane]);
        let [first, second] = [&start.lines[BY_BOTH[0]], &start.lines[BY_BOTH[1]]];
        let most = [s.splat(self.most[BY_BOTH[0]][lane]), s.splat(self.most[BY_BOTH[1]][lane])];
        let of_column = [s.load(&first.of_column), s.load(&second.of_column)];
        let mut blocked = 0;
        let mut rows = rows;
        while rows != 0 {
            let row = rows.trailing_zeros() as usize;
            rows &= rows - 1;
            let in_row = (of >> (FREE_SIDE * row)) as u32 & ALL_COLUMNS;
            if in_row == 0 {
                continue;
            }
            let in_y = (ny * slopes.least[row]).min(ny * slopes.greatest[row]);
            let misses = s.lt(least_product, s.add(products, s.splat(in_y + nz)));
            let misses = s.or(misses, s.le(s.add(of_column[0], s.splat(first.of_row[row])), most[0]));
            let misses = s.or(misses, s.le(s.add(of_column[1], s.splat(second.of_row[row])), most[1]));
            blocked |= BinSet::from(in_row & !s.mask_bits(misses)) << (FREE_SIDE * row);
        }
        blocked
    }

    /// Columns or rows that two lines leave open.
    #[inline(always)]
    fn open<S: Simd>(
        &self,
        s: S,
        start: &Start,
        lane: usize,
        lines: [usize; 2],
        of: impl Fn(&Line) -> &[f32; LANES],
    ) -> u32 {
        let mut open = ALL_COLUMNS;
        for line in lines {
            let misses = s.le(s.load(of(&start.lines[line])), s.splat(self.most[line][lane]));
            open &= !s.mask_bits(misses);
        }
        open
    }
}
