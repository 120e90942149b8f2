//! The triangle from which rays start, and planes that bound what they reach from it.
//!
//! All points that rays in the directions of a bin reach from any point of the triangle are its
//! *shaft*. A plane proves that no ray hits another triangle if the start triangle lies on its
//! upper side, the other one on its lower side, and every direction of the bin points strictly
//! upwards: then no point p + s d of the shaft with s > 0 is a point of the other triangle, also
//! where both share corners on the plane.
//!
//! In the frame of the start triangle, whose z is 0, directions are (X, Y, 1) with the slopes X and
//! Y of the bin. The planes tried have normals (m, w): a line in the plane of the triangle that
//! holds it on the side of the unit vector m, tilted around that line. Directions point upwards
//! from it if w > -m · (X, Y) for all slopes of the bin, which is the sum of a bound for the column
//! and one for the row; with a larger w they still do. Six lines are used: the lines along the axes
//! through the outermost corners, and the edges.

use super::frame::{ALL_COLUMNS, COLUMNS, Frame};
use bth::simd::LANES;
use bth_format::exact::side as exact_side;
use std::cmp::Ordering;

/// Number of lines.
pub(super) const LINES: usize = 6;
/// Lines whose planes depend on the column alone, and those on the row alone: the other two are
/// edges.
pub(super) const BY_COLUMN: [usize; 2] = [0, 1];
pub(super) const BY_ROW: [usize; 2] = [2, 3];
pub(super) const BY_BOTH: [usize; 2] = [4, 5];

/// A line that holds the start triangle on one side.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Line {
    /// Unit vector towards that side.
    pub(super) inward: [f32; 2],
    /// Its product with the points of the line.
    pub(super) offset: f32,
    /// Bits of the corners that lie exactly on it; all others are above.
    pub(super) on: u8,
    /// Smallest w, for each column and row, for which the directions of bins point upwards; to be
    /// added.
    pub(super) of_column: [f32; LANES],
    pub(super) of_row: [f32; LANES],
}

/// The start triangle as lanes see it.
pub(super) struct Start {
    pub(super) corners: [[f32; 3]; 3],
    side: Ordering,
    pub(super) axes: [[f32; 3]; 3],
    /// Coordinates of the corners along the first two axes.
    pub(super) local: [[f32; 2]; 3],
    /// Smallest and largest of these, rounded outwards.
    pub(super) extent: [[f32; 2]; 2],
    /// The largest in absolute value.
    pub(super) size: f32,
    /// What is small, relative to its distance ([`super::see::SMALL`]).
    pub(super) small: f32,
    pub(super) lines: [Line; LINES],
}

impl Start {
    pub(super) fn new(corners: [[f32; 3]; 3], frame: &Frame, is_back: bool, small: f32) -> Self {
        let local = corners.map(|p| frame.local(p));
        let size = local.iter().flatten().fold(0f64, |size, x| size.max(x.abs()));
        let slack = size / f64::from(1 << 20);
        let extent = [0, 1].map(|k| {
            let of = local.map(|p| p[k]);
            let (least, most) = of.iter().fold((0f64, 0f64), |(a, b), x| (a.min(*x), b.max(*x)));
            [(least - slack) as f32, (most + slack) as f32]
        });
        let edge = |k: usize| Line::along_edge(&local, k);
        let outermost = |inward: [f64; 2]| Line::through_outermost(&local, inward, size);
        // The first edge lies exactly along the first axis.
        let first = Line::new([0.0, 1.0], 0.0, 0b011);
        Start {
            corners,
            side: if is_back { Ordering::Less } else { Ordering::Greater },
            axes: frame.axes.map(|axis| axis.map(|x| x as f32)),
            local: local.map(|p| p.map(|x| x as f32)),
            extent,
            size: size as f32,
            small,
            lines: [
                outermost([1.0, 0.0]),
                outermost([-1.0, 0.0]),
                outermost([0.0, -1.0]),
                first,
                edge(1),
                edge(2),
            ],
        }
    }

    /// Returns true if another triangle has a point on the side of the plane from which rays start.
    /// Exact.
    #[cold]
    pub(super) fn is_below(&self, other: &[[f32; 3]; 3]) -> bool {
        let [a, b, c] = self.corners;
        other.iter().any(|p| exact_side(a, b, c, *p) == self.side)
    }
}

/// Bound of the rounding of heights, relative to the triangle's size: corners whose heights differ
/// by less may be equally high.
const EQUAL: f64 = 1e-12;
/// Bound of the rounding of one height, relative to the triangle's size.
const LOWER: f64 = 1e-14;

impl Line {
    fn new(inward: [f64; 2], offset: f64, on: u8) -> Self {
        let columns = &*COLUMNS;
        let inward = inward.map(|x| x as f32);
        let bounds = |m: f32| {
            let mut least = [f32::INFINITY; LANES];
            for column in (0..LANES).filter(|column| ALL_COLUMNS >> column & 1 == 1) {
                least[column] = (-m * columns.least[column]).max(-m * columns.greatest[column]);
            }
            least
        };
        Line { inward, offset: offset as f32, on, of_column: bounds(inward[0]), of_row: bounds(inward[1]) }
    }

    /// The line along the edge from corner k to the next.
    fn along_edge(local: &[[f64; 2]; 3], k: usize) -> Self {
        let [from, to, third] = [local[k], local[(k + 1) % 3], local[(k + 2) % 3]];
        let normal = [from[1] - to[1], to[0] - from[0]];
        let length = normal[0].hypot(normal[1]);
        let height = normal[0] * (third[0] - from[0]) + normal[1] * (third[1] - from[1]);
        let inward = normal.map(|x| x / length.copysign(height));
        let offset = inward[0] * from[0] + inward[1] * from[1];
        Line::new(inward, offset, 1 << k | 1 << ((k + 1) % 3))
    }

    /// The line through the corner that lies farthest against a direction along an axis. Where two
    /// corners lie equally far, within rounding errors, none counts as lying on it.
    fn through_outermost(local: &[[f64; 2]; 3], inward: [f64; 2], size: f64) -> Self {
        let heights = local.map(|p| inward[0] * p[0] + inward[1] * p[1]);
        let least = heights.into_iter().fold(f64::INFINITY, f64::min);
        let near = |height: &f64| *height <= least + EQUAL * size;
        let on = (0..3).filter(|k| near(&heights[*k])).fold(0, |on, k| on | 1u8 << k);
        Line::new(inward, least - LOWER * size, if on.is_power_of_two() { on } else { 0 })
    }
}
