//! Leaves of both record formats as points and triangles between them.

use super::bounds::PacketBounds;
use super::points::RelativePoints;
use crate::intersect::filter::TriangleBlock;
use crate::simd::{Part, Simd};
use bth_format::layout::{IndexedLeaf, RawLeaf, WIDTH};

/// A leaf's record and its child code.
pub(crate) struct Leaf<'a, B> {
    pub(crate) block: &'a B,
    pub(crate) code: u32,
}

/// A leaf as points and triangles between them.
pub(crate) trait LeafMesh: TriangleBlock {
    /// Number of rows of sixteen points.
    const PARTS: usize;
    /// One coordinate of all points, as stored in the leaf.
    type Row<'a>: Copy
    where
        Self: 'a;
    /// The coordinates of all points along an axis.
    fn row(&self, axis: usize) -> Self::Row<'_>;
    /// The coordinate of a point, whose index is below [`super::points::POINTS`].
    fn at(row: Self::Row<'_>, point: usize) -> f32;
    /// Indices of a triangle's points, below [`super::points::POINTS`].
    fn points_of(&self, triangle: usize) -> [usize; 3];
    /// Computes all points relative to an origin.
    fn relative<S: Simd>(&self, s: S, origin: [f32; 3], points: &mut RelativePoints);
    /// The triangles whose corners all lie beyond the same side of the bounds, a bit each: all rays miss them.
    fn outside<S: Simd, H: PacketBounds<S>>(&self, s: S, bounds: &H) -> u32;
}

/// [`LeafMesh::outside`] as a part of kernels.
pub(crate) struct Outside<'a, H, B> {
    pub(crate) bounds: &'a H,
    pub(crate) block: &'a B,
}

impl<S: Simd, H: PacketBounds<S>, B: LeafMesh> Part<S> for Outside<'_, H, B> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        self.block.outside(s, self.bounds)
    }
}

/// The lanes in which the three words have a bit in common.
#[inline(always)]
fn common<S: Simd>(s: S, [a, b, c]: [S::U; 3]) -> u32 {
    s.mask_bits(s.lt_u(s.splat_u(0), s.and_u(a, s.and_u(b, c))))
}

/// Three rows of lanes.
#[inline(always)]
fn load<S: Simd>(s: S, rows: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
    [s.load(&rows[0]), s.load(&rows[1]), s.load(&rows[2])]
}

/// Floats from the begin of the first corner's row of an axis to the end of the third corner's row of that axis.
const RAW_ROW: usize = 7 * WIDTH;

impl LeafMesh for IndexedLeaf {
    const PARTS: usize = 1;
    type Row<'a> = &'a [f32; WIDTH];
    #[inline(always)]
    fn row(&self, axis: usize) -> &[f32; WIDTH] {
        &self.vertex[axis]
    }
    #[inline(always)]
    fn at(row: &[f32; WIDTH], point: usize) -> f32 {
        row[point % WIDTH]
    }
    #[inline(always)]
    fn points_of(&self, triangle: usize) -> [usize; 3] {
        let at = triangle % WIDTH;
        let [a, b, c] = &self.corner;
        [usize::from(a[at]) % WIDTH, usize::from(b[at]) % WIDTH, usize::from(c[at]) % WIDTH]
    }
    #[inline(always)]
    fn relative<S: Simd>(&self, s: S, origin: [f32; 3], points: &mut RelativePoints) {
        points.put(s, 0, load(s, &self.vertex), origin);
    }
    #[inline(always)]
    fn outside<S: Simd, H: PacketBounds<S>>(&self, s: S, bounds: &H) -> u32 {
        let sides = bounds.sides(s, load(s, &self.vertex));
        let [a, b, c] = &self.corner;
        let of = [s.load_bytes(a), s.load_bytes(b), s.load_bytes(c)];
        common(s, [s.lookup_u(sides, of[0]), s.lookup_u(sides, of[1]), s.lookup_u(sides, of[2])])
    }
}

impl LeafMesh for RawLeaf {
    const PARTS: usize = 3;
    type Row<'a> = &'a [f32; RAW_ROW];
    #[inline(always)]
    fn row(&self, axis: usize) -> &[f32; RAW_ROW] {
        self.corner.as_flattened().as_flattened()[axis * WIDTH..]
            .first_chunk()
            .expect("up to the last corner")
    }
    #[inline(always)]
    fn at(row: &[f32; RAW_ROW], point: usize) -> f32 {
        // Between the rows of two corners lie the rows of the other two axes.
        row[(point + point / WIDTH * (2 * WIDTH)).min(RAW_ROW - 1)]
    }
    #[inline(always)]
    fn points_of(&self, triangle: usize) -> [usize; 3] {
        let at = triangle % WIDTH;
        [at, WIDTH + at, 2 * WIDTH + at]
    }
    #[inline(always)]
    fn relative<S: Simd>(&self, s: S, origin: [f32; 3], points: &mut RelativePoints) {
        for c in 0..3 {
            points.put(s, c, load(s, &self.corner[c]), origin);
        }
    }
    #[inline(always)]
    fn outside<S: Simd, H: PacketBounds<S>>(&self, s: S, bounds: &H) -> u32 {
        let [a, b, c] = &self.corner;
        let sides = [bounds.sides(s, load(s, a)), bounds.sides(s, load(s, b)), bounds.sides(s, load(s, c))];
        common(s, sides)
    }
}
