//! Leaves as packets read them: rows of the coordinates of points, and the points of each triangle.

use super::bounds::PacketBounds;
use super::points::RelativePoints;
use crate::intersect::filter::TriangleBlock;
use crate::simd::Simd;
use bth_format::layout::{IndexedLeaf, RawLeaf, WIDTH};

/// A leaf and its child code.
pub(crate) struct Leaf<'a, B> {
    pub(crate) block: &'a B,
    pub(crate) code: u32,
}

/// The points of a leaf, in object space, and the triangles between them, in either of the leaf's record formats.
pub(crate) trait LeafMesh: TriangleBlock {
    /// Number of vectors of sixteen points that hold all points.
    const VECTORS: usize;
    /// One coordinate of all points.
    type Row<'a>: Copy
    where
        Self: 'a;
    /// The coordinates of all points along an axis.
    fn row(&self, axis: usize) -> Self::Row<'_>;
    /// The coordinate of a point, whose index is below [`super::points::POINTS`].
    fn point_coordinate(row: Self::Row<'_>, point: usize) -> f32;
    /// Indices of the three points of a triangle, below [`super::points::POINTS`].
    fn corner_points(&self, triangle: usize) -> [usize; 3];
    /// Stores all points relative to `origin`.
    fn store_relative<S: Simd>(&self, s: S, origin: [f32; 3], points: &mut RelativePoints);
    /// The triangles, as bits, whose corners all lie beyond the same side of the bounds, so that all rays miss them.
    fn outside<S: Simd, P: PacketBounds<S>>(&self, s: S, bounds: &P) -> u32;
}

/// The lanes in which three outcodes have a bit in common.
#[inline(always)]
fn lanes_with_common_bit<S: Simd>(s: S, [a, b, c]: [S::U; 3]) -> u32 {
    s.mask_bits(s.lt_u(s.splat_u(0), s.and_u(a, s.and_u(b, c))))
}

/// Loads rows of x, y and z.
#[inline(always)]
fn load<S: Simd>(s: S, rows: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
    [s.load(&rows[0]), s.load(&rows[1]), s.load(&rows[2])]
}

/// Number of floats in a raw leaf from the first corner's row of an axis to the end of the third corner's row of that axis.
const RAW_ROW: usize = 7 * WIDTH;

impl LeafMesh for IndexedLeaf {
    const VECTORS: usize = 1;
    type Row<'a> = &'a [f32; WIDTH];
    #[inline(always)]
    fn row(&self, axis: usize) -> &[f32; WIDTH] {
        &self.vertex[axis]
    }
    #[inline(always)]
    fn point_coordinate(row: &[f32; WIDTH], point: usize) -> f32 {
        row[point % WIDTH]
    }
    #[inline(always)]
    fn corner_points(&self, triangle: usize) -> [usize; 3] {
        let triangle = triangle % WIDTH;
        let [a, b, c] = &self.corner;
        [
            usize::from(a[triangle]) % WIDTH,
            usize::from(b[triangle]) % WIDTH,
            usize::from(c[triangle]) % WIDTH,
        ]
    }
    #[inline(always)]
    fn store_relative<S: Simd>(&self, s: S, origin: [f32; 3], points: &mut RelativePoints) {
        points.store(s, 0, load(s, &self.vertex), origin);
    }
    #[inline(always)]
    fn outside<S: Simd, P: PacketBounds<S>>(&self, s: S, bounds: &P) -> u32 {
        let outcodes = bounds.outcodes(s, load(s, &self.vertex));
        let [a, b, c] = &self.corner;
        let [a, b, c] = [s.load_bytes(a), s.load_bytes(b), s.load_bytes(c)];
        lanes_with_common_bit(s, [s.lookup_u(outcodes, a), s.lookup_u(outcodes, b), s.lookup_u(outcodes, c)])
    }
}

impl LeafMesh for RawLeaf {
    const VECTORS: usize = 3;
    type Row<'a> = &'a [f32; RAW_ROW];
    #[inline(always)]
    fn row(&self, axis: usize) -> &[f32; RAW_ROW] {
        self.corner.as_flattened().as_flattened()[axis * WIDTH..]
            .first_chunk()
            .expect("a leaf holds the rows up to the third corner")
    }
    #[inline(always)]
    fn point_coordinate(row: &[f32; RAW_ROW], point: usize) -> f32 {
        // The rows of the two other axes lie between those of consecutive corners.
        row[(point + point / WIDTH * (2 * WIDTH)).min(RAW_ROW - 1)]
    }
    #[inline(always)]
    fn corner_points(&self, triangle: usize) -> [usize; 3] {
        let triangle = triangle % WIDTH;
        [triangle, WIDTH + triangle, 2 * WIDTH + triangle]
    }
    #[inline(always)]
    fn store_relative<S: Simd>(&self, s: S, origin: [f32; 3], points: &mut RelativePoints) {
        for c in 0..3 {
            points.store(s, c, load(s, &self.corner[c]), origin);
        }
    }
    #[inline(always)]
    fn outside<S: Simd, P: PacketBounds<S>>(&self, s: S, bounds: &P) -> u32 {
        let [a, b, c] = &self.corner;
        let outcodes =
            [bounds.outcodes(s, load(s, a)), bounds.outcodes(s, load(s, b)), bounds.outcodes(s, load(s, c))];
        lanes_with_common_bit(s, outcodes)
    }
}
